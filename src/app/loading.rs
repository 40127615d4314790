//! Loads a map while the window goes on.

use super::level::Level;
use super::screen::Screen;
use crate::assets::vfs::Vfs;
use crate::console::Cvars;
use crate::gpu::{Device, PipelineCache};
use crate::render::backend::Backend;
use crate::scene::Scene;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What is being done, and the share of it that is.
pub type Report<'a> = &'a (dyn Fn(&str, f32) + Sync);

/// Where maps come from: the game's files, and how a scene is made of them.
#[derive(Clone)]
pub struct MapSource {
    pub files: Arc<Vfs>,
    pub load: Arc<LoadScene>,
}

/// Loads the scene of a map; one sentence where it cannot.
pub type LoadScene = dyn Fn(&str, &Cvars, Report<'_>) -> Result<Scene, String> + Send + Sync;

/// Where a loading stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    pub doing: String,
    /// 0..1.
    pub share: f32,
}

/// A map that is being loaded.
pub struct Loading {
    pub map: String,
    pub began: Instant,
    progress: Arc<Mutex<Progress>>,
    worker: Option<JoinHandle<Result<Level, String>>>,
}

/// Steps of a loading with the share of its time that each takes, about: (name, where it begins).
const SCENE: (&str, f32) = ("reading the map", 0.0);
const UPLOAD: (&str, f32) = ("building its trees", 0.7);
const PIPELINES: (&str, f32) = ("preparing shaders", 0.85);

impl Loading {
    /// Begins to load a map for a screen.
    pub fn begin(map: &str, source: &MapSource, cvars: &Cvars, screen: &Screen, size: (u32, u32)) -> Self {
        let progress = Arc::new(Mutex::new(Progress::default()));
        let job = Job {
            map: map.to_owned(),
            source: source.clone(),
            cvars: cvars.clone(),
            device: screen.device.clone(),
            backend: screen.backend,
            cache: screen.cache.clone(),
            size,
            progress: progress.clone(),
        };
        let worker = std::thread::Builder::new()
            .name("map loader".to_owned())
            .spawn(move || job.run());
        let worker = worker.unwrap_or_else(|e| {
            let message = format!("cannot begin to load the map ({e})");
            // A thread that fails at once needs none of what is missing.
            std::thread::spawn(move || Err(message))
        });
        Self {
            map: map.to_owned(),
            began: Instant::now(),
            progress,
            worker: Some(worker),
        }
    }

    /// Where it stands.
    pub fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How long it has taken.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// The map once it is there, or one sentence why it is not; `None` while it is being loaded.
    pub fn take(&mut self) -> Option<Result<Level, String>> {
        if !self.worker.as_ref().is_some_and(JoinHandle::is_finished) {
            return None;
        }
        let joined = self.worker.take()?.join();
        Some(joined.unwrap_or_else(|_| Err("the map's loading broke off: please report this as a bug".to_owned())))
    }

    /// Waits for the end and forgets what comes out.
    pub fn join(mut self) {
        if let Some(worker) = self.worker.take()
            && worker.join().is_err()
        {
            tracing::warn!("the loading of {} broke off", self.map);
        }
    }
}

struct Job {
    map: String,
    source: MapSource,
    cvars: Cvars,
    device: Arc<Device>,
    backend: Backend,
    cache: Arc<PipelineCache>,
    size: (u32, u32),
    progress: Arc<Mutex<Progress>>,
}

impl Job {
    fn say(&self, doing: &str, share: f32) {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Progress {
            doing: doing.to_owned(),
            share,
        };
    }

    fn run(self) -> Result<Level, String> {
        let begin = Instant::now();
        self.say(SCENE.0, SCENE.1);
        let report = |doing: &str, share: f32| self.say(doing, SCENE.1 + (UPLOAD.1 - SCENE.1) * share);
        let scene = (self.source.load)(&self.map, &self.cvars, &report)?;
        let read = begin.elapsed();
        self.say(UPLOAD.0, UPLOAD.1);
        let uploaded = std::cell::Cell::new(Duration::ZERO);
        let say = || {
            uploaded.set(begin.elapsed());
            self.say(PIPELINES.0, PIPELINES.1);
        };
        let fov = self.cvars.number("cg_fov") as f32;
        let made = Level::new(&scene, &self.device, self.backend, &self.cache, self.size, fov, &say);
        let mut level = made.map_err(|e| e.to_string())?;
        level.loading_times = [
            ("map and lights", read),
            ("trees and upload", uploaded.get() - read),
            ("shaders", begin.elapsed() - uploaded.get()),
        ];
        Ok(level)
    }
}
