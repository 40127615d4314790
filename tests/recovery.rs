//! Recovery of stripped lights: planted ones in maps of our own, and (on demand, minutes) the installed maps.
//!
//! `cargo test --release --test recovery -- --ignored --nocapture` prints a table of all installed maps; `Q3RAYS_MAPS=a,b`
//! restricts it, `Q3RAYS_HOLD_OUT=1` holds whole surfaces out.

mod common;

use common::Files;
use glam::{Vec2, Vec3};
use q3rays::assets::bsp::Bsp;
use q3rays::assets::bsp::build::fixtures::{Doorways, chain};
use q3rays::assets::bsp::lumps::{LIGHTMAP_BYTES, LIGHTMAP_SIZE};
use q3rays::recovery::encoding::Encoding;
use q3rays::recovery::recover::RecoveryError;
use q3rays::recovery::score::Score;
use q3rays::recovery::{LightsFile, Options, Recovery, recover};
use q3rays::reference::trace::Tracer;
use q3rays::scene::Scene;
use q3rays::scene::lights::LightSource;

/// A light: position and photons per channel.
type Planted = (Vec3, Vec3);

/// Luxel edge in units, as the compiler's default.
const LUXEL: f32 = 16.0;

/// Irradiance/π of point lights at a luxel as the compiler computes it: sampled one unit off, one ray, no light nearer than 16.
fn baked(scene: &Scene, tracer: &Tracer, lights: &[Planted], p: Vec3, n: Vec3) -> Vec3 {
    let origin = p + n;
    let mut sum = Vec3::ZERO;
    for (light, power) in lights {
        let to = *light - p;
        let d2 = to.length_squared();
        let cosine = n.dot(to) / d2.sqrt();
        if cosine > 0.0 && !tracer.occluded(scene, origin, *light - origin, 0.999) {
            sum += *power * (7500.0 / 255.0 * cosine / d2.max(256.0));
        }
    }
    sum
}

/// Gives every planar surface of a map a lightmap chart and fills it, quantised and clamped as the compiler does.
fn bake(bsp: &mut Bsp, scene: &Scene, encoding: &Encoding, lights: &[Planted]) -> usize {
    let tracer = Tracer::new(scene);
    let (mut x0, mut y0, mut shelf, mut page) = (0, 0, 0, 0);
    let mut clamped = 0;
    for s in &mut bsp.surfaces {
        let range = s.first_vertex as usize..(s.first_vertex + s.vertex_count) as usize;
        let vertices = &mut bsp.vertices[range];
        let normal = Vec3::from(vertices[0].normal);
        // Tangents of an axial face.
        let [u, v] = [
            Vec3::new(normal.z, normal.x, normal.y).abs(),
            Vec3::new(normal.y, normal.z, normal.x).abs(),
        ];
        let flat = |p: Vec3| Vec2::new(p.dot(u), p.dot(v));
        let points: Vec<Vec2> = vertices.iter().map(|x| flat(Vec3::from(x.position))).collect();
        let least = points
            .iter()
            .copied()
            .reduce(Vec2::min)
            .expect("a surface has vertices");
        let greatest = points
            .iter()
            .copied()
            .reduce(Vec2::max)
            .expect("a surface has vertices");
        let size = ((greatest - least) / LUXEL).ceil().as_uvec2() + 1;
        let (w, h) = (size.x as usize, size.y as usize);
        if x0 + w > LIGHTMAP_SIZE {
            (x0, y0, shelf) = (0, y0 + shelf, 0);
        }
        if y0 + h > LIGHTMAP_SIZE {
            (x0, y0, shelf, page) = (0, 0, 0, page + 1);
        }
        shelf = shelf.max(h);
        bsp.lightmaps.resize((page + 1) * LIGHTMAP_BYTES, 0);
        for (vertex, p) in vertices.iter_mut().zip(&points) {
            let at = (*p - least) / LUXEL + 0.5 + Vec2::new(x0 as f32, y0 as f32);
            vertex.lightmap_uv = (at / LIGHTMAP_SIZE as f32).to_array();
        }
        s.lightmap = page as i32;
        let along = normal * Vec3::from(vertices[0].position).dot(normal);
        for y in 0..h {
            for x in 0..w {
                let at = least + Vec2::new(x as f32, y as f32) * LUXEL;
                let value = baked(scene, &tracer, lights, along + u * at.x + v * at.y, normal);
                let bytes = encoding.encode(value);
                clamped += usize::from(encoding.is_clamped(bytes));
                let texel = ((page * LIGHTMAP_SIZE + y0 + y) * LIGHTMAP_SIZE + x0 + x) * 3;
                bsp.lightmaps[texel..texel + 3].copy_from_slice(&bytes);
            }
        }
        x0 += w;
    }
    clamped
}

/// Rooms in a row with lights planted in them: the scene, which knows nothing of them, and its number of clamped luxels.
fn planted(rooms: usize, lights: &[Planted], encoding: &Encoding) -> (Scene, usize) {
    let mut fixture = chain(rooms, Doorways::Staggered, 1).expect("a chain of rooms");
    let plain = common::scene(&fixture);
    let clamped = bake(&mut fixture.bsp, &plain, encoding, lights);
    let scene = Scene::load(&Files(fixture.files()), &fixture.name).expect("the baked map");
    (scene, clamped)
}

/// Lights spread over rooms of 256 x 256 x 192 units, 288 apart, `per_room` in each.
fn scattered(rooms: usize, per_room: usize) -> Vec<Planted> {
    let mut random = q3rays::recovery::random::Random::new(7, 1, 1);
    (0..rooms * per_room)
        .map(|i| {
            let room = (i / per_room) as f32 * 288.0;
            // One in each part of the room, so that no two are one.
            let part = (i % per_room) as f32 / per_room as f32;
            let place = Vec3::new(
                room + 28.0 + (part + random.unit() / per_room as f32 * 0.6) * 200.0,
                28.0 + random.unit() * 200.0,
                28.0 + random.unit() * 136.0,
            );
            let photons = 40.0 * 10f32.powf(random.unit());
            let colour = Vec3::new(1.0, 0.4 + 0.6 * random.unit(), 0.3 + 0.7 * random.unit());
            (place, colour * photons)
        })
        .collect()
}

fn small() -> Options {
    Options {
        fit_luxels: 6000,
        test_luxels: 2000,
        ..Options::default()
    }
}

/// Number of planted lights that were found within 16 units with their power within 10 percent.
fn found(planted: &[Planted], r: &Recovery) -> usize {
    planted
        .iter()
        .filter(|(position, power)| {
            r.lights.iter().any(|l| {
                let ratio = l.power.max_element() / power.max_element();
                l.position.distance(*position) <= 16.0 && (0.9..=1.1).contains(&ratio)
            })
        })
        .count()
}

/// Plants two lights in each room, recovers them, and holds the result against them.
fn check_planted(rooms: usize, encoding: &Encoding, options: &Options) -> Recovery {
    let lights = scattered(rooms, 2);
    let (scene, clamped) = planted(rooms, &lights, encoding);
    assert!(
        clamped > 100,
        "the lights should be strong enough to clamp luxels: {clamped}"
    );
    let r = recover(&scene, options, &common::quiet).expect("luxels");
    let n = found(&lights, &r);
    let (total, made) = (lights.len(), r.lights.len());
    println!("{n} of {total} found, {made} lights, {:?}", r.scores.direct);
    assert!(n * 10 >= total * 9, "{n} of {total}");
    assert!(made * 2 <= total * 3, "{made} lights for {total}");
    assert!(r.scores.direct.correlation > 0.98 && (0.95..1.05).contains(&r.scores.direct.ratio));
    r
}

#[test]
fn planted_lights_are_found() {
    check_planted(8, &Encoding::LINEAR, &small());
}

#[test]
fn the_same_seed_gives_the_same_lights() {
    let (scene, _) = planted(2, &scattered(2, 2), &Encoding::LINEAR);
    let options = Options {
        fit_luxels: 2000,
        ..small()
    };
    let [a, b] = [(); 2].map(|()| recover(&scene, &options, &common::quiet).expect("luxels").lights);
    assert!(!a.is_empty());
    assert_eq!(a, b);
}

#[test]
#[ignore = "a minute"]
fn forty_planted_lights_are_found() {
    check_planted(20, &Encoding::LINEAR, &Options::default());
}

#[test]
fn a_map_without_lightmaps_says_so() {
    let scene = common::scene(&chain(2, Doorways::InLine, 1000).expect("rooms"));
    let error = recover(&scene, &small(), &common::quiet).err();
    assert_eq!(
        error,
        Some(RecoveryError::NoLightmaps {
            map: "chain".to_owned()
        })
    );
}

#[test]
fn an_unlit_bake_gives_no_lights() {
    let mut fixture = chain(2, Doorways::InLine, 1).expect("rooms");
    let plain = common::scene(&fixture);
    bake(&mut fixture.bsp, &plain, &Encoding::LINEAR, &[]);
    let scene = Scene::load(&Files(fixture.files()), &fixture.name).expect("the baked map");
    let r = recover(&scene, &small(), &common::quiet).expect("luxels");
    assert!(r.lights.is_empty(), "{:?}", r.lights);
}

/// γ, c and the maps that have them, from the physics notes; everything else is 1, 1.
const ENCODINGS: [(f32, f32, &[&str]); 9] = [
    (
        1.5,
        1.0,
        &[
            "am_mckinleyish2",
            "am_spacecont",
            "oa_bases3p3ta",
            "oa_bases3plus3",
            "am_underworks",
            "hydronex2",
        ],
    ),
    (
        1.3,
        2.0,
        &[
            "oacmpctf1",
            "oacmpctf2",
            "oacmpctf3",
            "oacmpdm1",
            "oacmpdm2",
            "oacmpdm3",
            "oacmpdm5",
            "oacmpdm6",
        ],
    ),
    (1.3, 2.0, &["oacmpdm7", "oacmpdm8", "oacmpdm9"]),
    (2.0, 2.0, &["ctf_gate1", "ctf_inyard"]),
    (2.0, 3.0, &["oa_koth1", "sleekgrinder"]),
    (2.25, 2.56, &["ctf_compromise"]),
    (2.8, 3.17, &["oa_koth2"]),
    (3.0, 2.85, &["slimefac"]),
    (2.8, 3.0, &["wrackdm17"]),
];
/// γ of compensated maps without other evidence than the grid's floor is this uncertain, relative.
const GAMMA_TOLERANCE: f32 = 0.2;

#[test]
#[ignore = "loads every installed map"]
fn encodings_of_the_installed_maps() {
    let files = common::installed();
    let mut wrong = Vec::new();
    for map in files.maps().iter().filter(|m| m.name != "showcase") {
        let scene = common::real(&map.name);
        let e = Encoding::of(&scene.bsp, &scene.entities, &scene.lights);
        let entry = ENCODINGS.iter().find(|(.., names)| names.contains(&map.name.as_str()));
        let (gamma, c) = entry.map_or((1.0, 1.0), |(gamma, c, _)| (*gamma, *c));
        let tolerance = if c > 1.0 { GAMMA_TOLERANCE } else { 0.01 };
        let good = (e.gamma / gamma - 1.0).abs() <= tolerance && (e.compensate - c).abs() < 0.01;
        println!("{:16} {:.2} {:.2} {:?}", map.name, e.gamma, e.compensate, e.evidence);
        if !good {
            wrong.push(format!("{}: {e:?}, wanted {gamma} {c}", map.name));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

fn show(s: Score) -> String {
    format!("{:.3} {:.2}", s.correlation, s.ratio)
}

/// Light entities that the file still holds: position and photons.
fn truth(scene: &Scene) -> Vec<(Vec3, f32)> {
    let lights = scene.lights.lights.iter().zip(&scene.lights.sources);
    lights
        .filter(|(_, s)| matches!(s, LightSource::PointEntity | LightSource::SpotEntity))
        .map(|(l, _)| (Vec3::from(l.p0), l.p2[2] * 255.0))
        .collect()
}

/// How many light entities were found within 16, 32, 48 and 64 units, and the median of found over true power.
fn recall(truth: &[(Vec3, f32)], r: &Recovery) -> String {
    let nearest: Vec<(f32, f32)> = truth
        .iter()
        .map(|(p, photons)| {
            let pairs = r
                .lights
                .iter()
                .map(|l| (l.position.distance(*p), l.power.max_element() / photons));
            pairs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, 0.0))
        })
        .collect();
    let within = [16.0, 32.0, 48.0, 64.0].map(|d| nearest.iter().filter(|n| n.0 <= d).count());
    let mut ratios: Vec<f32> = nearest.iter().filter(|n| n.0 <= 48.0).map(|n| n.1).collect();
    ratios.sort_by(f32::total_cmp);
    let median = ratios.get(ratios.len() / 2).copied().unwrap_or(0.0);
    format!(
        "truth {}: found {}, within 16 32 48 64: {within:?}, power {median:.2}",
        truth.len(),
        r.lights.len()
    )
}

#[test]
#[ignore = "about a quarter of a minute a map; see the module's documentation"]
fn table_of_the_installed_maps() {
    let files = common::installed();
    let names = match std::env::var("Q3RAYS_MAPS") {
        Ok(list) => list.split(',').map(str::to_owned).collect(),
        Err(_) => files
            .maps()
            .into_iter()
            .map(|m| m.name)
            .filter(|n| n != "showcase")
            .collect::<Vec<_>>(),
    };
    let options = Options {
        hide_entities: true,
        hold_out_surfaces: std::env::var_os("Q3RAYS_HOLD_OUT").is_some(),
        ..Options::default()
    };
    println!("| map | γ | c | lights | known | fitted | + recovered | + ambient | + bounces | bounces | s |");
    for name in names {
        let scene = common::real(&name);
        let start = std::time::Instant::now();
        let r = match recover(&scene, &options, &common::quiet) {
            Ok(r) => r,
            Err(e) => {
                println!("| {name} | {e} |");
                continue;
            }
        };
        let s = &r.scores;
        println!(
            "| {name} | {:.2} | {:.2} | {} | {} | {} | {} | {} | {} | {:.2} | {:.0} |",
            r.encoding.gamma,
            r.encoding.compensate,
            r.lights.len(),
            show(s.known),
            show(s.known_scaled),
            show(s.direct),
            show(s.without_indirect),
            show(s.full),
            r.indirect,
            start.elapsed().as_secs_f32()
        );
        let entities = truth(&scene);
        if !entities.is_empty() {
            println!("  {}", recall(&entities, &r));
        }
        let text = LightsFile::from(&r).to_string();
        assert_eq!(
            LightsFile::parse(&text).map(|f| f.lights.len()),
            Ok(r.lights.len()),
            "{name}"
        );
    }
}
