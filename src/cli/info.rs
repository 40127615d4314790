//! `q3rays info`

use super::args::{CliError, CliResult};
use super::common::Common;
use super::light_list::LightList;
use crate::console::Cvars;
use crate::output::stdout;
use crate::reference::views::feature_views;
use crate::scene::report::Report;
use std::collections::BTreeMap;
use std::fmt::{self, Display};

/// Arguments of `info`.
#[derive(clap::Args)]
pub struct Args {
    /// Map name
    map: String,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// List the lights, their sources, and what part of the light in the lightmaps they explain
    #[arg(long)]
    lights: bool,
    /// Print, as JSON, a view of each feature of the shader language that the map's materials use
    #[arg(long)]
    views: bool,
}

fn list<K: Display, V: Display>(f: &mut fmt::Formatter, title: &str, entries: &BTreeMap<K, V>) -> fmt::Result {
    let text: Vec<_> = entries.iter().map(|(k, v)| format!("{k} {v}")).collect();
    writeln!(f, "{title:12} {}", text.join(" · "))
}

/// Describes a map.
pub fn run(common: &Common, cvars: &Cvars, args: &Args) -> CliResult {
    if args.lights {
        let (scene, lit) = common.lit_scene(&args.map, cvars)?;
        let list = LightList::new(&scene, &lit);
        return if args.json {
            stdout::line(serde_json::to_string_pretty(&list).map_err(CliError::failed)?)
        } else {
            stdout::line(list)
        }
        .map_err(CliError::failed);
    }
    let scene = common.scene(&args.map)?;
    if args.views {
        let views = feature_views(&scene);
        return stdout::line(serde_json::to_string_pretty(&views).map_err(CliError::failed)?).map_err(CliError::failed);
    }
    let r = Report::new(&scene);
    if args.json {
        stdout::line(serde_json::to_string_pretty(&r).map_err(CliError::failed)?)
    } else {
        stdout::line(Text(&r))
    }
    .map_err(CliError::failed)
}

/// A report as text for people.
struct Text<'a>(&'a Report);

impl Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let r = self.0;
        writeln!(f, "{}", r.name)?;
        list(f, "lumps", &r.lumps)?;
        list(f, "surfaces", &r.surfaces)?;
        writeln!(
            f,
            "{:12} {} ({} without area dropped) in {} meshes, {} placed",
            "triangles", r.triangles, r.degenerate_triangles, r.meshes, r.placements
        )?;
        list(f, "geometry", &r.geometry)?;
        if let Some(growth) = r.deform_box_growth {
            writeln!(
                f,
                "{:12} boxes that hold deforming triangles at all times have {growth:.2} times the area of those at rest",
                ""
            )?;
        }
        let vis = if r.vised {
            ""
        } else {
            " (never vised: everything sees everything)"
        };
        writeln!(f, "{:12} {}{vis}", "clusters", r.clusters)?;
        list(f, "lights", &r.lights)?;
        writeln!(
            f,
            "{:12} {} rows in {} runs; a cluster's row holds {:.1}% of the lights, {:.1}% after facing",
            "light lists",
            r.light_rows,
            r.light_runs,
            r.row_share[0] * 100.0,
            r.row_share[1] * 100.0
        )?;
        if r.light_entities_stripped {
            writeln!(
                f,
                "{:12} no light entity is left in the file: point lights of the bake are missing",
                ""
            )?;
        }
        let nudges: Vec<_> = r
            .receivers
            .by_nudge
            .iter()
            .map(|s| format!("{:.2}%", s * 100.0))
            .collect();
        writeln!(
            f,
            "{:12} in a cluster after 0.25, 1, 4, 8, 16 units: {}; by the surface's leafs {:.2}%; all lights {:.2}%",
            "receivers",
            nudges.join(", "),
            r.receivers.surface_leafs * 100.0,
            r.receivers.all_lights * 100.0
        )?;
        list(f, "materials", &r.materials)?;
        list(f, "features", &r.features)?;
        writeln!(
            f,
            "{:12} {} ({:.1} MiB with mips); {} materials without a script",
            "textures",
            r.textures,
            r.texture_bytes as f64 / f64::from(1 << 20),
            r.unscripted_materials
        )?;
        list(f, "entities", &r.entities)?;
        for (i, s) in r.spawns.iter().enumerate() {
            let [x, y, z] = s.origin;
            writeln!(f, "{:12} {i}: {} at {x} {y} {z}, angle {}", "spawn", s.class, s.angle)?;
        }
        let times: BTreeMap<_, _> = r.load_ms.iter().map(|(k, v)| (*k, format!("{v:.0} ms"))).collect();
        list(f, "load time", &times)?;
        for w in &r.warnings {
            writeln!(f, "{:12} {w}", "warning")?;
        }
        Ok(())
    }
}
