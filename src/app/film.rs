//! Films of recordings: frames at fixed steps of time, each as fine as is wanted, as numbered pictures or through ffmpeg.

use super::capture::display_pixels;
use super::level::EXPOSURE_RATE;
use crate::console::settings::FRAME_RATE;
use crate::game::recording::{RecordedView, Recording};
use crate::gpu::{PipelineCache, SubmitSync};
use crate::output::stats::FrameStats;
use crate::output::{atomic, exr_file, png_file};
use crate::render::frame::FrameInput;
use crate::render::gpu_renderer::{film, shown_film};
use crate::render::realtime::Realtime;
use crate::render::scene_gpu::SceneGpu;
use crate::render::settings::Settings;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;

/// Most frames of a film.
const MOST_FRAMES: f64 = 1e6;

/// A film to make.
pub struct FilmJob<'a> {
    pub scene: Arc<SceneGpu>,
    pub recording: &'a Recording,
    pub settings: Settings,
    pub size: (u32, u32),
    /// Frames a second; `None` shows each recorded frame once.
    pub fps: Option<f64>,
    pub cache: Option<Arc<PipelineCache>>,
    /// Samples that each frame averages; 1 shows frames as they come, denoised.
    pub samples: u32,
    /// `.mp4` and the like by ffmpeg; `.png` or `.exr`: a number is put before the extension.
    pub out: PathBuf,
}

/// Where the frames go.
enum Sink {
    Pictures,
    Ffmpeg(Ffmpeg),
}

/// ffmpeg at work, and the file that it complains to: a pipe that nobody reads would stop it.
struct Ffmpeg {
    child: Child,
    said: PathBuf,
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        // It ends when its input does; without frames there is nothing that it could still spoil.
        drop(self.child.stdin.take());
        let _ = self.child.wait();
        let _ = std::fs::remove_file(&self.said);
    }
}

/// Whether ffmpeg can be run.
pub fn has_ffmpeg() -> bool {
    let probe = Command::new("ffmpeg")
        .arg("-version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    probe.is_ok_and(|status| status.success())
}

impl FilmJob<'_> {
    fn frames(&self) -> usize {
        match self.fps {
            None => self.recording.frames.len(),
            Some(fps) => ((self.recording.length() * fps).floor().min(MOST_FRAMES)) as usize + 1,
        }
    }

    /// What frame `index` shows, `share` of a frame's time later.
    fn view(&self, index: usize, share: f64) -> Option<RecordedView> {
        match self.fps {
            None => self.recording.view(index),
            Some(fps) => self.recording.at((index as f64 + share) / fps),
        }
    }

    /// Path of a picture by its number.
    fn picture(&self, index: usize) -> PathBuf {
        let stem = self.out.file_stem().unwrap_or_default().to_string_lossy();
        let extension = self.out.extension().unwrap_or_default().to_string_lossy();
        self.out.with_file_name(format!("{stem}-{index:05}.{extension}"))
    }

    fn is_pictures(&self) -> bool {
        let extension = self.out.extension().map(|e| e.to_ascii_lowercase());
        extension.is_some_and(|e| e == "png" || e == "exr")
    }

    fn sink(&self) -> Result<Sink, String> {
        atomic::create_parent(&self.out).map_err(|e| e.to_string())?;
        if self.is_pictures() {
            return Ok(Sink::Pictures);
        }
        let (width, height) = self.size;
        let said = self.out.with_extension(format!("ffmpeg{}", std::process::id()));
        let complaints = std::fs::File::create(&said).map_err(|e| format!("cannot write {} ({e})", said.display()))?;
        let child = Command::new("ffmpeg")
            .args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args([
                "-s",
                &format!("{width}x{height}"),
                "-r",
                &self.fps.unwrap_or(60.0).to_string(),
            ])
            .args([
                "-i",
                "-",
                "-vf",
                "crop=trunc(iw/2)*2:trunc(ih/2)*2",
                "-pix_fmt",
                "yuv420p",
            ])
            .arg(&self.out)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(complaints)
            .spawn();
        child.map(|child| Sink::Ffmpeg(Ffmpeg { child, said })).map_err(|e| {
            format!(
                "films such as {} need ffmpeg ({e}); a name that ends in .png makes numbered pictures",
                self.out.display()
            )
        })
    }

    /// Makes the film; `progress` gets the share done and says whether to go on. Returns what was written, and the frames' times.
    ///
    /// # Errors
    /// One sentence of the device's, ffmpeg's or the file system's.
    pub fn run(&self, progress: &dyn Fn(f32) -> bool) -> Result<(String, Vec<FrameStats>), String> {
        let count = self.frames();
        if count == 0 {
            return Err("the recording has no frames".to_owned());
        }
        let mut sink = self.sink()?;
        let mut realtime =
            Realtime::new(self.scene.clone(), self.size, self.cache.as_deref()).map_err(|e| e.to_string())?;
        let mut stats = Vec::new();
        let mut sample = 0;
        let mut written = 0;
        for index in 0..count {
            self.frame(&mut realtime, index, &mut sample, &mut stats)?;
            stats.extend(realtime.finish().map_err(|e| e.to_string())?);
            self.write(&mut sink, &realtime, index)?;
            written = index + 1;
            if !progress(written as f32 / count as f32) {
                break;
            }
        }
        self.close(sink, written).map(|said| (said, stats))
    }

    /// Renders frame `index`.
    fn frame(
        &self,
        realtime: &mut Realtime,
        index: usize,
        sample: &mut u32,
        stats: &mut Vec<FrameStats>,
    ) -> Result<(), String> {
        let averaged = self.samples > 1;
        // The settings' shutter is a share of a frame at that rate; here it is the same share of the film's frames.
        let shutter = f64::from(self.settings.shutter * FRAME_RATE);
        for n in 1..=self.samples.max(1) {
            let share = f64::from(
                Settings {
                    shutter: 1.0,
                    ..self.settings
                }
                .shutter_share(*sample),
            );
            let shown = if averaged { share * shutter } else { 0.0 };
            let Some(view) = self.view(index, shown) else {
                return Err(format!("the recording has no frame {index}"));
            };
            let last = n == self.samples.max(1);
            let seconds = self.frame_seconds(index);
            let input = FrameInput {
                camera: view.camera,
                settings: Settings {
                    clock: view.clock,
                    shutter: 0.0,
                    ..self.settings
                },
                lights: &[],
                polygons: &[],
                entities: &view.entities,
                sample_index: *sample,
                accumulated: if averaged { n } else { 0 },
                exposure_blend: if index == 0 {
                    1.0
                } else {
                    (EXPOSURE_RATE * seconds as f32).min(1.0)
                },
                reuse: !averaged,
                output: last,
            };
            let ended = realtime.frame(&input, |shown| shown.frame.submit(SubmitSync::default()));
            stats.extend(ended.map_err(|e| e.to_string())?);
            *sample += 1;
        }
        Ok(())
    }

    /// Seconds from the frame before to frame `index`.
    fn frame_seconds(&self, index: usize) -> f64 {
        let at = |i: usize| self.recording.frames.get(i).map_or(0.0, |f| f.at);
        match self.fps {
            Some(fps) => 1.0 / fps,
            None => at(index) - at(index.saturating_sub(1)),
        }
    }

    fn write(&self, sink: &mut Sink, realtime: &Realtime, index: usize) -> Result<(), String> {
        let (width, height) = self.size;
        let view = &realtime.view;
        match sink {
            Sink::Pictures => {
                let path = self.picture(index);
                if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
                    let averaged = match self.samples {
                        0 | 1 => shown_film(view),
                        count => film(view, count),
                    };
                    let averaged = averaged.map_err(|e| e.to_string())?;
                    return exr_file::write_film(&path, &averaged, &[]).map_err(|e| e.to_string());
                }
                png_file::write(&path, width, height, &display_pixels(view)?, &[]).map_err(|e| e.to_string())
            }
            Sink::Ffmpeg(ffmpeg) => {
                let pixels = display_pixels(view)?;
                let piped = ffmpeg
                    .child
                    .stdin
                    .as_mut()
                    .map(|pipe| pipe.write_all(bytemuck::cast_slice(&pixels)));
                match piped {
                    Some(Ok(())) => Ok(()),
                    _ => Err(ffmpeg_said(ffmpeg)),
                }
            }
        }
    }

    fn close(&self, sink: Sink, written: usize) -> Result<String, String> {
        match sink {
            Sink::Pictures => Ok(format!("{written} pictures {}", self.picture(0).display())),
            Sink::Ffmpeg(mut ffmpeg) => {
                drop(ffmpeg.child.stdin.take());
                match ffmpeg.child.wait() {
                    Ok(status) if status.success() => Ok(format!("{written} frames in {}", self.out.display())),
                    _ => Err(ffmpeg_said(&mut ffmpeg)),
                }
            }
        }
    }
}

/// Why ffmpeg stopped.
fn ffmpeg_said(ffmpeg: &mut Ffmpeg) -> String {
    drop(ffmpeg.child.stdin.take());
    // It has closed its input, so it ends by itself.
    let _ = ffmpeg.child.wait();
    let said = std::fs::read_to_string(&ffmpeg.said).unwrap_or_default();
    format!(
        "ffmpeg failed ({}); a name that ends in .png makes numbered pictures",
        said.trim().replace('\n', "; ")
    )
}

/// Extension of a film: mp4 where ffmpeg is there, else that of pictures.
pub fn film_extension() -> &'static str {
    if has_ffmpeg() { "mp4" } else { "png" }
}
