//! How loading grows with the size of a map. A measurement, not a check: it runs on demand and prints a table.
//! `cargo test --release --test load_scaling -- --ignored --nocapture`

mod common;

use q3rays::assets::bsp::build::stress;
use q3rays::render::bvh_upload::MeshTrees;
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use std::time::Instant;

#[test]
#[ignore = "a measurement; see the module's documentation"]
fn load_time_over_map_size() {
    let mut points = Vec::new();
    println!("triangles, ms: file to scene, trees, both");
    for triangles in [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000] {
        let fixture = stress(triangles).unwrap();
        let files = common::Files(fixture.files());
        let start = Instant::now();
        let scene = Scene::load(&files, &fixture.name).unwrap();
        let loaded = start.elapsed().as_secs_f64() * 1e3;
        MeshTrees::build(&scene, BvhQuality::Balanced).unwrap();
        let all = start.elapsed().as_secs_f64() * 1e3;
        println!(
            "{triangles}, {loaded:.1}, {:.1}, {all:.1}; {:?}",
            all - loaded,
            scene.timings
        );
        points.push(((triangles as f64).ln(), all.ln()));
    }
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let slope = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
        / points.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>();
    println!("log-log slope {slope:.2}");
}
