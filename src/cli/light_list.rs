//! The lights of a map as `q3rays info --lights` tells them.

use crate::lighting::Lighting;
use crate::recovery::cache::Origin;
use crate::recovery::known::light_terms;
use crate::scene::Scene;
use crate::scene::lights::LightSource;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::{self, Display};

/// Lights of one kind: those of a shader, a sun, or one point light.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    pub source: LightSource,
    /// Shader, sun or the like, as lights files call it; nothing for recovered lights.
    pub name: Option<String>,
    /// Number of lights, triangles above all.
    pub count: usize,
    /// Middle of a point light, units.
    pub position: Option<[f32; 3]>,
    /// Largest radiance, luxel units; of a sun, irradiance/π at normal incidence.
    pub radiance: [f32; 3],
    /// Factor on what the files say.
    pub scale: f32,
    /// Share of the light stored in the lightmaps that they give, where that is known.
    pub explains: Option<f32>,
}

/// All lights, and where recovered ones came from.
#[derive(Clone, Debug, Serialize)]
pub struct LightList {
    pub origin: String,
    pub lights: Vec<Entry>,
}

impl LightList {
    /// Lists the lights that a scene was given.
    pub fn new(scene: &Scene, lit: &Lighting) -> Self {
        let file = lit.loaded.as_ref().map(|l| &l.file);
        let terms = light_terms(scene);
        let mut known: BTreeMap<(LightSource, String), Entry> = BTreeMap::new();
        let mut points = Vec::new();
        for (i, light) in scene.lights.lights.iter().enumerate() {
            let source = scene.lights.sources[i];
            if source == LightSource::Recovered {
                let share = file.and_then(|f| f.lights.iter().find(|l| l.origin.to_array() == light.p0)?.share);
                points.push(Entry {
                    source,
                    name: None,
                    count: 1,
                    position: Some(light.p0),
                    radiance: light.radiance,
                    scale: 1.0,
                    explains: share,
                });
                continue;
            }
            let name = terms[i].clone().unwrap_or_else(|| "sky".to_owned());
            let said = file.and_then(|f| f.scales.iter().find(|s| s.name == name));
            let entry = known.entry((source, name.clone())).or_insert_with(|| Entry {
                source,
                name: Some(name),
                count: 0,
                position: None,
                radiance: light.radiance,
                scale: said.map_or(1.0, |s| s.scale),
                explains: said.and_then(|s| s.share),
            });
            entry.count += 1;
            entry.radiance = std::array::from_fn(|c| entry.radiance[c].max(light.radiance[c]));
        }
        // The strongest first.
        let share = |e: &Entry| e.explains.unwrap_or(0.0);
        let mut lights: Vec<Entry> = known.into_values().chain(points).collect();
        lights.sort_by(|a, b| share(b).total_cmp(&share(a)));
        let origin = match (&lit.loaded, &lit.note) {
            (Some(l), _) => match &l.origin {
                Origin::Paks => "a lights file in the paks".to_owned(),
                Origin::Cache(path) => format!("recovered before, {}", path.display()),
                Origin::Recovered => "recovered now".to_owned(),
            },
            (None, Some(note)) => note.clone(),
            (None, None) => "the map's files alone".to_owned(),
        };
        Self { origin, lights }
    }
}

impl Display for LightList {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "lights from {}", self.origin)?;
        writeln!(f, "explains  scale  lights  source            where")?;
        for e in &self.lights {
            let explains = e.explains.map_or_else(String::new, |s| format!("{:.2}%", s * 100.0));
            let source = format!("{:?}", e.source);
            let place = match (e.position, &e.name) {
                (Some([x, y, z]), _) => {
                    let [r, g, b] = e.radiance;
                    format!("{x:.0} {y:.0} {z:.0}, radiance {r:.1} {g:.1} {b:.1}")
                }
                (None, Some(name)) => name.clone(),
                (None, None) => String::new(),
            };
            writeln!(
                f,
                "{explains:>8}  {:>5.2}  {:>6}  {source:16}  {place}",
                e.scale, e.count
            )?;
        }
        Ok(())
    }
}
