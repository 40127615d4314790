//! What a report says of how it came about, so that it can be repeated.

use super::page::Page;
use crate::console::Cvars;
use crate::engine::Engine;
use serde::{Deserialize, Serialize};

/// See the module.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunInfo {
    pub device: String,
    pub driver: String,
    pub backend: String,
    /// Version of the program, and the commit where it was built with `Q3RAYS_COMMIT` set.
    pub build: String,
    pub command: String,
    /// Variables that are not at their defaults.
    pub settings: serde_json::Map<String, serde_json::Value>,
}

impl RunInfo {
    /// Of this run.
    pub fn new(engine: &Engine, cvars: &Cvars) -> Self {
        let (device, driver, backend) = match engine {
            Engine::Cpu => ("CPU".to_owned(), String::new(), "cpu"),
            Engine::Vulkan { device, backend } => {
                (device.info().name.clone(), device.info().driver.clone(), backend.name())
            }
        };
        let defaults = Cvars::default().all();
        let changed = cvars
            .all()
            .into_iter()
            .filter(|(name, value)| defaults.get(name) != Some(value));
        Self {
            device,
            driver,
            backend: backend.to_owned(),
            build: match option_env!("Q3RAYS_COMMIT") {
                Some(commit) => format!("{} ({commit})", env!("CARGO_PKG_VERSION")),
                None => env!("CARGO_PKG_VERSION").to_owned(),
            },
            command: std::iter::once("q3rays".to_owned())
                .chain(std::env::args().skip(1))
                .collect::<Vec<_>>()
                .join(" "),
            settings: changed.collect(),
        }
    }

    /// Puts it on a page.
    pub fn show(&self, page: &mut Page) {
        let settings: Vec<String> = self.settings.iter().map(|(n, v)| format!("{n} {v}")).collect();
        let rows = [
            ("device", self.device.clone()),
            ("driver", self.driver.clone()),
            ("backend", self.backend.clone()),
            ("build", self.build.clone()),
            ("command", self.command.clone()),
            (
                "settings",
                if settings.is_empty() {
                    "defaults".into()
                } else {
                    settings.join(", ")
                },
            ),
        ];
        page.table(&["run", ""], &rows.map(|(n, v)| vec![n.to_owned(), v]));
    }
}
