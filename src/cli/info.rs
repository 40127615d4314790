//! `q3rays info`

use super::args::{CliError, CliResult};
use super::common::Common;
use crate::scene::report::Report;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Arguments of `info`.
#[derive(clap::Args)]
pub struct Args {
    /// Map name
    map: String,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

fn list<K: Display, V: Display>(title: &str, entries: &BTreeMap<K, V>) {
    let text: Vec<_> = entries.iter().map(|(k, v)| format!("{k} {v}")).collect();
    println!("{title:12} {}", text.join(" · "));
}

/// Describes a map.
pub fn run(common: &Common, args: &Args) -> CliResult {
    let scene = common.scene(&args.map)?;
    let r = Report::new(&scene);
    if args.json {
        println!("{}", serde_json::to_string_pretty(&r).map_err(CliError::failed)?);
        return Ok(());
    }
    println!("{}", r.name);
    list("lumps", &r.lumps);
    list("surfaces", &r.surfaces);
    println!(
        "{:12} {} ({} without area dropped) in {} meshes, {} placed",
        "triangles", r.triangles, r.degenerate_triangles, r.meshes, r.placements
    );
    list("geometry", &r.geometry);
    let vis = if r.vised {
        ""
    } else {
        " (never vised: everything sees everything)"
    };
    println!("{:12} {}{vis}", "clusters", r.clusters);
    list("lights", &r.lights);
    println!(
        "{:12} {} rows in {} runs; a cluster's row holds {:.1}% of the lights, {:.1}% after facing",
        "light lists",
        r.light_rows,
        r.light_runs,
        r.row_share[0] * 100.0,
        r.row_share[1] * 100.0
    );
    if r.light_entities_stripped {
        println!(
            "{:12} no light entity is left in the file: point lights of the bake are missing",
            ""
        );
    }
    let nudges: Vec<_> = r
        .receivers
        .by_nudge
        .iter()
        .map(|s| format!("{:.2}%", s * 100.0))
        .collect();
    println!(
        "{:12} in a cluster after 0.25, 1, 4, 8, 16 units: {}; by the surface's leafs {:.2}%; all lights {:.2}%",
        "receivers",
        nudges.join(", "),
        r.receivers.surface_leafs * 100.0,
        r.receivers.all_lights * 100.0
    );
    list("materials", &r.materials);
    println!(
        "{:12} {} ({:.1} MiB with mips); {} materials without a script",
        "textures",
        r.textures,
        r.texture_bytes as f64 / f64::from(1 << 20),
        r.unscripted_materials
    );
    list("entities", &r.entities);
    for (i, s) in r.spawns.iter().enumerate() {
        let [x, y, z] = s.origin;
        println!("{:12} {i}: {} at {x} {y} {z}, angle {}", "spawn", s.class, s.angle);
    }
    let times: BTreeMap<_, _> = r.load_ms.iter().map(|(k, v)| (*k, format!("{v:.0} ms"))).collect();
    list("load time", &times);
    for w in &r.warnings {
        println!("{:12} {w}", "warning");
    }
    Ok(())
}
