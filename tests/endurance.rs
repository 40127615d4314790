//! Thousands of frames with every variable set by chance: no panic, no validation error, nothing that is not finite, flat memory.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::real;
use gpu_fixture::with_device;
use q3rays::console::Cvars;
use q3rays::console::settings::settings;
use q3rays::console::table::{CVARS, Kind};
use q3rays::content::fly_through;
use q3rays::gpu::SubmitSync;
use q3rays::render::backend::Backend;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::radiance;
use q3rays::render::realtime::Realtime;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::Settings;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::clock::Clock;
use q3rays::scene::entity_geometry::EntityState;
use std::sync::Arc;

const FRAMES: u32 = 10_000;
/// Frames until memory has to have come to rest: every pass has run and every buffer has been as large as it gets.
const WARM: u32 = 4_000;
const SIZES: [(u32, u32); 4] = [(32, 18), (24, 24), (41, 7), (1, 1)];

struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    }

    fn unit(&mut self) -> f64 {
        f64::from(self.next()) / 4_294_967_296.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// A value of a kind, its limits more often than by chance.
    fn value(&mut self, kind: Kind) -> String {
        match kind {
            Kind::Int { min, max, .. } => match self.below(4) {
                0 => min.to_string(),
                1 => max.to_string(),
                _ => (min + ((max - min + 1) as f64 * self.unit()) as i64).to_string(),
            },
            Kind::Float { min, max, .. } => match self.below(4) {
                0 => min.to_string(),
                1 => max.to_string(),
                // Small values are as likely as large ones.
                _ => (min + (max - min) * self.unit().powi(6)).to_string(),
            },
            Kind::Choice(words) => words[self.below(words.len())].to_owned(),
        }
    }
}

/// Bytes of this program in memory, where that can be told.
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(text.split(' ').nth(1)?.parse::<u64>().ok()? * 4096)
}

#[test]
fn thousands_of_frames_with_random_variables() {
    with_device(|device| {
        let scene = real("showcase");
        let movers: Vec<u32> = (0u32..)
            .zip(&scene.entities)
            .filter(|(_, e)| e.get("model").is_some_and(|m| m.starts_with('*')))
            .map(|(number, _)| number)
            .collect();
        let on_gpu = Arc::new(SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).expect("the scene"));
        let mut realtime = Realtime::new(on_gpu, SIZES[0], None).expect("the passes");
        let (mut cvars, mut random) = (Cvars::default(), Random(7));
        let (mut accumulated, mut at_rest) = (0, None);
        for frame in 0..FRAMES {
            let cvar = &CVARS[random.below(CVARS.len())];
            cvars
                .set(cvar.name, &random.value(cvar.kind))
                .expect("a value of its kind");
            if frame % 61 == 0 {
                realtime.resize(SIZES[random.below(SIZES.len())]).expect("another size");
                accumulated = 0;
            }
            let still = cvars.number("rt_accumulate") + cvars.number("rt_refine") > 0.0 && random.below(8) > 0;
            accumulated = if still { accumulated + 1 } else { 0 };
            // Sometimes somewhere else altogether.
            let share = if random.below(50) == 0 {
                random.unit() as f32
            } else {
                (frame % 1000) as f32 / 1000.0
            };
            let mut entities = Vec::new();
            for entity in &movers {
                if random.below(3) == 0 {
                    entities.push(EntityState {
                        entity: *entity,
                        offset: glam::Vec3::Z * (random.unit() * 100.0) as f32,
                        hidden: random.below(4) == 0,
                    });
                }
            }
            let now = Settings {
                clock: Clock::from_seconds(f64::from(frame) / 60.0 * cvars.number("timescale")),
                ..settings(&cvars)
            };
            let input = FrameInput {
                camera: fly_through::camera(share, cvars.number("cg_fov") as f32),
                settings: if accumulated > 0 { now.at_sample(frame) } else { now },
                lights: &[],
                polygons: &[],
                entities: &entities,
                sample_index: frame,
                accumulated,
                exposure_blend: random.unit() as f32,
                reuse: accumulated == 0,
                output: true,
            };
            let shown = realtime.frame(&input, |shown| shown.frame.submit(SubmitSync::default()));
            shown.unwrap_or_else(|e| panic!("frame {frame}: {e}"));
            if frame % 50 == 49 {
                realtime.finish().expect("the GPU");
                let bad = radiance(&realtime.view).expect("the picture");
                let bad = bad.iter().flatten().filter(|c| !c.is_finite()).count();
                assert_eq!(bad, 0, "frame {frame} after {} with {:?}", cvar.name, cvars.all());
            }
            if frame == WARM {
                realtime.resize(SIZES[0]).expect("the first size");
                at_rest = Some((device.memory_allocated(), resident()));
            }
        }
        let (gpu, main) = at_rest.expect("frames");
        realtime.resize(SIZES[0]).expect("the first size");
        // Which images are there depends on what was asked for last; all of them are small.
        let now = device.memory_allocated();
        assert!(now < gpu + (256 << 10), "GPU memory: {gpu} to {now}");
        if let (Some(before), Some(after)) = (main, resident()) {
            assert!(after < before + (24 << 20), "main memory: {before} to {after}");
        }
    });
}
