//! What console commands do to the program.

use super::capture;
use super::film::{FilmJob, film_extension};
use super::game::{FilmNews, FilmWork, Game};
use super::headless::run_stats;
use super::journey::{Playback, Recorder};
use super::lifecycle::StatsRun;
use crate::console::config;
use crate::console::settings::settings;
use crate::console::shell::{Action, Panel};
use crate::game::movement::{EYE, Mode};
use crate::game::recording::Recording;
use crate::output::atomic;
use crate::output::stats::Summary;
use crate::render::scene_gpu::RenderError;
use glam::Vec3;
use std::sync::mpsc;

impl Game {
    /// Does what a command asks for, and says what came of it.
    pub(super) fn act(&mut self, action: Action) {
        let done = match action {
            Action::Map(name) => {
                self.load(&name);
                Ok(None)
            }
            Action::Screenshot { name, radiance } => self.screenshot(name.as_deref(), radiance),
            Action::Record(name) => self.record(name.as_deref()),
            Action::StopRecord => {
                if self.recorder.is_none() {
                    Err("nothing is being recorded".to_owned())
                } else {
                    self.end_recording();
                    Ok(None)
                }
            }
            Action::Playback { name, timed } => self.begin_playback(&name, timed),
            Action::StopPlayback => match self.end_playback() {
                Ok(()) => Ok(None),
                Err(e) => Err(e.to_string()),
            },
            Action::Video { name, fps, samples } => self.begin_film(&name, fps, samples),
            Action::Stats(name) => self.stats(name.as_deref()),
            Action::NoClip => self.switch_mode(Mode::NoClip),
            Action::Fly => self.switch_mode(Mode::Fly),
            Action::Kill => self.player(|level| {
                let yaw = level.play.respawn();
                (level.camera.yaw, level.camera.pitch) = (yaw, 0.0);
                None
            }),
            Action::SetView { eye, yaw, pitch } => self.player(|level| {
                level.play.body.origin = Vec3::from(eye) - Vec3::Z * EYE;
                level.play.body.velocity = Vec3::ZERO;
                (level.camera.yaw, level.camera.pitch) = (yaw.rem_euclid(360.0), pitch.clamp(-89.0, 89.0));
                None
            }),
            Action::ViewPos => Ok(self.shown.map(|(c, _)| {
                let [x, y, z] = c.eye;
                format!("{x:.2} {y:.2} {z:.2} {:.2} {:.2}", c.yaw, c.pitch)
            })),
            Action::ReloadShaders => self.reload_shaders(),
            Action::Restart => {
                self.restart = true;
                Ok(None)
            }
            Action::Toggle(panel) => {
                self.toggle(panel);
                Ok(None)
            }
            Action::Condump(name) => self.condump(&name),
            Action::WriteConfig(name) => self.write_config(name.as_deref()),
            Action::Button { button, down } => {
                // As if a key of the console held it.
                if down {
                    self.input.press(button, "console");
                } else {
                    self.input.release(button, "console");
                }
                Ok(None)
            }
            Action::Quit => {
                self.quit = true;
                Ok(None)
            }
        };
        match done {
            Ok(Some(text)) => self.shell.log.say(text),
            Ok(None) => {}
            Err(text) => self.shell.log.warn(text),
        }
    }

    /// Opens or closes a part of the overlay; what came before that is for what was open then.
    pub(super) fn toggle(&mut self, panel: Panel) {
        self.ui.toggle(panel, &mut self.platform.egui_input_mut().events);
    }

    /// Changes the player, which recordings take note of.
    fn player(
        &mut self,
        change: impl FnOnce(&mut super::level::Level) -> Option<String>,
    ) -> Result<Option<String>, String> {
        let level = self.level.as_mut().ok_or("there is no map yet")?;
        let said = change(level);
        level.camera.eye = level.play.body.eye().into();
        if let Some(recorder) = &mut self.recorder {
            recorder.disturbed = true;
        }
        Ok(said)
    }

    fn switch_mode(&mut self, mode: Mode) -> Result<Option<String>, String> {
        self.player(|level| {
            let body = &mut level.play.body;
            body.mode = if body.mode == mode { Mode::Walk } else { mode };
            let said = match body.mode {
                Mode::Walk => "walking",
                Mode::Fly => "flying",
                Mode::NoClip => "walking through walls",
            };
            Some(said.to_owned())
        })
    }

    fn screenshot(&mut self, name: Option<&str>, radiance: bool) -> Result<Option<String>, String> {
        let extension = if radiance { "exr" } else { "png" };
        let engine = self.screen.engine();
        let (Some(level), Some((camera, clock))) = (&mut self.level, self.shown) else {
            return Err("there is nothing to see yet".to_owned());
        };
        let path = self.folders.named_or_new("screenshots", name, &level.map, extension)?;
        capture::screenshot(level, (&camera, clock), &engine, &self.shell.cvars, &path, radiance)?;
        Ok(Some(format!("wrote {}", path.display())))
    }

    fn record(&mut self, name: Option<&str>) -> Result<Option<String>, String> {
        let level = self.level.as_ref().ok_or("there is no map yet")?;
        if self.playback.is_some() {
            return Err("a recording is being shown: stopplayback ends it".to_owned());
        }
        if self.recorder.is_some() {
            return Err("a recording is being made: stoprecord ends it".to_owned());
        }
        let path = self.folders.named_or_new("recordings", name, &level.map, "json")?;
        let recording = Recording::new(&level.map, self.shell.cvars.all());
        self.recorder = Some(Recorder::new(path, recording));
        Ok(Some("recording; stoprecord ends it".to_owned()))
    }

    /// Ends and writes the recording, where there is one.
    pub(super) fn end_recording(&mut self) {
        let Some(recorder) = self.recorder.take() else {
            return;
        };
        match recorder.recording.write(&recorder.path) {
            Ok(()) => {
                let seconds = recorder.recording.length();
                let frames = recorder.recording.frames.len();
                let text = format!("wrote {} ({frames} frames, {seconds:.1} s)", recorder.path.display());
                self.shell.log.say(text);
                self.shell.names = self.folders.names(&self.source.files);
            }
            Err(e) => self.shell.log.warn(e),
        }
    }

    fn begin_playback(&mut self, name: &str, timed: bool) -> Result<Option<String>, String> {
        let recording = Recording::read(&self.folders.recording(name)?).map_err(|e| e.to_string())?;
        self.end_recording();
        let map = recording.map.clone();
        self.playback = Some(Playback::new(name, recording, timed));
        if self.level.as_ref().is_some_and(|l| l.map == map) && self.loading.is_none() {
            self.begin_playback_here();
        } else {
            self.load(&map);
        }
        Ok(None)
    }

    /// Begins a playback that waited for its map; one of another map is given up.
    pub(super) fn begin_playback_here(&mut self) {
        let (Some(playback), Some(level)) = (&mut self.playback, &mut self.level) else {
            return;
        };
        if playback.map() != level.map {
            self.playback = None;
            return;
        }
        self.shown = None;
        if playback.timed {
            // What a script says next is for when it has ended.
            self.shell.hold();
        }
        // The same frames come out each time, and their times are theirs alone.
        let forgotten = level.realtime.finish().and_then(|_| level.forget());
        if let Err(e) = forgotten {
            self.shell.log.warn(e);
        }
        playback.restart();
    }

    /// Ends a playback, where there is one, and writes the times of a timed one.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub(super) fn end_playback(&mut self) -> Result<(), RenderError> {
        if self.playback.is_none() {
            return Ok(());
        }
        self.shell.release();
        self.shown = None;
        if let Some(level) = &mut self.level {
            let rest = level.realtime.finish()?;
            level.forget()?;
            rest.into_iter().for_each(|stats| self.note_stats(stats));
        }
        let Some(playback) = self.playback.take() else {
            return Ok(());
        };
        if !playback.timed || playback.stats.is_empty() {
            return Ok(());
        }
        let s = Summary::of_frames(&playback.stats);
        let line = format!(
            "{}: {} frames, median {:.2} ms, 95% {:.2} ms, 99% {:.2} ms, longest {:.2} ms, mean {:.2} ms",
            playback.name,
            playback.stats.len(),
            s.p50,
            s.p95,
            s.p99,
            s.max,
            s.mean
        );
        self.shell.log.say(line);
        match self
            .folders
            .file("stats", &format!("timedemo-{}", playback.name), "json")
        {
            Ok(path) => {
                let run = StatsRun {
                    path,
                    frames: playback.stats,
                };
                if let Err(e) = self.write_stats(&run) {
                    self.shell.log.warn(e);
                }
            }
            Err(e) => self.shell.log.warn(e),
        }
        Ok(())
    }

    fn stats(&mut self, name: Option<&str>) -> Result<Option<String>, String> {
        if let Some(run) = self.stats.take() {
            self.write_stats(&run)?;
            return Ok(None);
        }
        let map = self.level.as_ref().map_or("frames", |l| l.map.as_str());
        let path = self.folders.named_or_new("stats", name, map, "json")?;
        self.stats = Some(StatsRun::new(path));
        Ok(Some("writing frame times down; stats again ends it".to_owned()))
    }

    /// Writes frame times: in the form that the path's extension names, and where that is JSON as CSV beside it.
    pub(super) fn write_stats(&mut self, run: &StatsRun) -> Result<(), String> {
        let map = self.level.as_ref().map_or("", |l| l.map.as_str());
        let size = self.level.as_ref().map_or((0, 0), |l| l.realtime.view.gbuffer.size);
        let stats = run_stats(&self.screen.engine(), &self.shell.cvars, map, size, run.frames.clone());
        atomic::create_parent(&run.path).map_err(|e| e.to_string())?;
        let mut paths = vec![run.path.clone()];
        if run.path.extension().is_some_and(|e| e == "json") {
            paths.push(run.path.with_extension("csv"));
        }
        for path in paths {
            stats.write(&path).map_err(|e| e.to_string())?;
            self.shell
                .log
                .say(format!("wrote {} ({} frames)", path.display(), run.frames.len()));
        }
        Ok(())
    }

    /// Makes a film on a thread of its own, with a view of its own of the same scene.
    fn begin_film(&mut self, name: &str, fps: f64, samples: u32) -> Result<Option<String>, String> {
        let recording = Recording::read(&self.folders.recording(name)?).map_err(|e| e.to_string())?;
        let level = self.level.as_ref().filter(|l| l.map == recording.map);
        let level = level.ok_or_else(|| format!("it was recorded on another map: `map {}` first", recording.map))?;
        if self.films.iter().any(|film| film.name == name) {
            return Err(format!("a film of {name} is being made"));
        }
        let out = self.folders.file("films", name, film_extension())?;
        let cache = Some(self.screen.cache.clone());
        let scene = level.realtime.scene.clone();
        let settings = settings(&self.shell.cvars);
        let size = level.realtime.view.gbuffer.size;
        let (sender, receiver) = mpsc::channel();
        let worker = std::thread::Builder::new().name("film".to_owned()).spawn(move || {
            let job = FilmJob {
                scene,
                recording: &recording,
                settings,
                size,
                fps: Some(fps),
                cache,
                samples,
                out,
            };
            // Nobody listens any more once the program ends, and the film ends with it.
            let made = job.run(&|share| sender.send(FilmNews::Share(share)).is_ok());
            let _ = sender.send(FilmNews::Done(made.map(|(said, _)| said)));
        });
        self.films.push(FilmWork {
            name: name.to_owned(),
            note: format!("film {name}: 0%"),
            news: receiver,
            worker: worker.map_err(|e| format!("cannot begin to make a film ({e})"))?,
        });
        Ok(Some(format!(
            "making a film of {name} at {fps} frames a second, {samples} samples each"
        )))
    }

    /// Hears how far films have come.
    pub(super) fn follow_films(&mut self) {
        let mut said = Vec::new();
        self.films.retain_mut(|FilmWork { name, note, news, .. }| {
            let mut goes_on = true;
            loop {
                match news.try_recv() {
                    Ok(FilmNews::Share(share)) => {
                        *note = format!("film {name}: {:.0}%", share * 100.0);
                    }
                    Ok(FilmNews::Done(done)) => {
                        said.push(done);
                        goes_on = false;
                    }
                    Err(mpsc::TryRecvError::Empty) => return goes_on,
                    Err(mpsc::TryRecvError::Disconnected) => {
                        if goes_on {
                            said.push(Err(format!("{note}: broke off; please report this as a bug")));
                        }
                        return false;
                    }
                }
            }
        });
        for done in said {
            match done {
                Ok(text) => self.shell.log.say(format!("wrote {text}")),
                Err(text) => self.shell.log.warn(text),
            }
        }
    }

    fn reload_shaders(&mut self) -> Result<Option<String>, String> {
        if !cfg!(feature = "compile-shaders") {
            return Err("this program has its shaders built in: build it with --features compile-shaders".to_owned());
        }
        let cache = self.screen.cache.clone();
        let level = self.level.as_mut().ok_or("there is no map yet")?;
        match level.realtime.reload_shaders(Some(&cache)) {
            Ok(()) => Ok(Some("shaders compiled anew".to_owned())),
            Err(e) => Err(format!("{e}; the old ones stay in use")),
        }
    }

    fn condump(&mut self, name: &str) -> Result<Option<String>, String> {
        let path = self
            .folders
            .file("console", name.strip_suffix(".txt").unwrap_or(name), "txt")?;
        atomic::create_parent(&path).map_err(|e| e.to_string())?;
        atomic::write(&path, self.shell.log.plain().as_bytes()).map_err(|e| e.to_string())?;
        Ok(Some(format!("wrote {}", path.display())))
    }

    fn write_config(&mut self, name: Option<&str>) -> Result<Option<String>, String> {
        let Some(name) = name else {
            self.config.write(&self.shell)?;
            return Ok(Some(format!("wrote {}", self.config.path().display())));
        };
        let checked = self.folders.file("", name, "cfg")?;
        let path = self.folders.config.join(checked.file_name().unwrap_or_default());
        config::write_to(&path, &self.shell.cvars, &self.shell)?;
        self.shell.names = self.folders.names(&self.source.files);
        Ok(Some(format!("wrote {}", path.display())))
    }
}
