//! Recovery of stripped lights: planted ones in maps of our own, and (on demand, minutes) the installed maps.
//!
//! `cargo test --release --test recovery -- --ignored --nocapture table` prints a table of all installed maps;
//! `Q3RAYS_MAPS=a,b` restricts it, `Q3RAYS_HOLD_OUT=1` recovers each map again with a third of its surfaces held out,
//! `Q3RAYS_UPDATE_DOCS=1` writes it to `docs/recovery.md`.

mod common;
#[path = "recovery/table.rs"]
mod table;

use common::Files;
use glam::{Vec2, Vec3};
use q3rays::assets::bsp::Bsp;
use q3rays::assets::bsp::build::fixtures::{Doorways, chain};
use q3rays::assets::bsp::lumps::{LIGHTMAP_BYTES, LIGHTMAP_SIZE};
use q3rays::lighting::{self, Lights};
use q3rays::recovery::cache::Origin;
use q3rays::recovery::encoding::Encoding;
use q3rays::recovery::known::{self, TermKind, terms};
use q3rays::recovery::luxels::Luxel;
use q3rays::recovery::recover::RecoveryError;
use q3rays::recovery::visibility::Occluders;
use q3rays::recovery::{LightsFile, Options, Recovery, recover, scene_lights};
use q3rays::reference::trace::Tracer;
use q3rays::scene::Scene;
use q3rays::scene::clusters::cluster_at;
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
    let options = quick();
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
fn a_dome_is_one_term_with_the_compilers_irradiance() {
    let scene = common::scene(&common::analytic::under_dome(200));
    assert!(scene.lights.count(LightSource::SkyDome) > 1);
    let occluders = Occluders::new(&scene);
    let floor: Vec<Luxel> = (0..64)
        .map(|i| {
            let position = Vec3::new(40.0 + 20.0 * (i % 8) as f32, 40.0 + 20.0 * (i / 8) as f32, 0.0);
            let cluster = cluster_at(&scene.bsp_nodes, position + Vec3::Z).expect("the floor is in the open");
            Luxel {
                position,
                normal: Vec3::Z,
                steps: [Vec3::X * LUXEL, Vec3::Y * LUXEL],
                area: LUXEL * LUXEL,
                stored: Vec3::ZERO,
                clamped: false,
                two_sided: false,
                surface: 0,
                cluster,
            }
        })
        .collect();
    let terms = terms(&occluders, &floor, false, false, 1);
    let [dome] = terms.as_slice() else {
        panic!("one term, not {terms:?}");
    };
    assert_eq!(dome.kind, TermKind::Dome(0));
    assert_eq!(dome.name, "dome 1");
    // As many suns in every degree of elevation: the mean sine is 2/π.
    let expected = 200.0 / 255.0 * std::f32::consts::FRAC_2_PI;
    for value in &dome.values {
        assert!(
            value.abs_diff_eq(Vec3::splat(expected), 2e-3),
            "{value}, not {expected}"
        );
    }
}

/// A search with few luxels, for tests of what is around it.
fn quick() -> Options {
    Options {
        fit_luxels: 2000,
        ..small()
    }
}

#[test]
fn scenes_are_lit_from_lightmaps_the_cache_and_the_paks() {
    let (mut scene, _) = planted(2, &scattered(2, 2), &Encoding::LINEAR);
    let folder = tempfile::tempdir().expect("a folder");
    let kept = lighting::Kept {
        lights: folder.path().join("lights"),
        cells: folder.path().join("cells"),
    };
    let known = scene.lights.lights.len();
    let none = Files(Vec::new());
    let recovered = |scene: &Scene| scene.lights.count(LightSource::Recovered);
    let light = |scene: &mut Scene, files: &Files, which| {
        lighting::light(scene, files, which, &kept, &quick(), &common::quiet).expect("lights")
    };
    let lit = light(&mut scene, &none, Lights::Known);
    assert!(lit.loaded.is_none() && scene.lights.lights.len() == known);
    let lit = light(&mut scene, &none, Lights::All);
    let first = lit.loaded.expect("lights are looked for");
    assert_eq!(first.origin, Origin::Recovered);
    assert!(recovered(&scene) >= 4 && recovered(&scene) == first.file.lights.len());
    assert!(scene.cells.count() > 0, "light cells are made");
    assert_eq!(
        scene.rows.pvs.rows[scene.rows.all_row as usize].light_count as usize,
        scene.lights.lights.len()
    );
    // The same map again: from the cache, and the same lights.
    let (mut again, _) = planted(2, &scattered(2, 2), &Encoding::LINEAR);
    let second = light(&mut again, &none, Lights::All)
        .loaded
        .expect("lights in the cache");
    assert!(matches!(second.origin, Origin::Cache(_)), "{:?}", second.origin);
    assert_eq!(again.lights.lights, scene.lights.lights);
    assert_eq!(again.cells, scene.cells);
    // A file in the paks counts before both, and a wrong one is told with its line.
    let text = "light 100 100 100 photons 50\nlight 120 100 100 photons 20\n";
    let paks = |text: &str| Files(vec![(format!("maps/{}.lights", again.name), text.into())]);
    let (good, bad) = (paks(text), paks("light 1 2"));
    let edited = light(&mut again, &good, Lights::Recovered)
        .loaded
        .expect("the paks' lights");
    assert_eq!(edited.origin, Origin::Paks);
    assert_eq!((recovered(&again), again.lights.lights.len()), (2, 2));
    let wrong = lighting::light(&mut again, &bad, Lights::All, &kept, &quick(), &common::quiet);
    let told = wrong.expect_err("a light needs three numbers").to_string();
    assert!(told.contains(".lights") && told.contains("line 1"), "{told}");
}

#[test]
fn scales_of_a_lights_file_multiply_known_lights() {
    let mut scene = common::scene(&chain(3, Doorways::InLine, 1).expect("rooms"));
    let before = scene.lights.clone();
    assert!(!before.lights.is_empty(), "the rooms have lamps");
    let term = known::light_terms(&scene)[0].clone().expect("a known light has a term");
    let file = LightsFile::parse(&format!("scale {term} 0.25\nsky 0 0 0\n")).expect("a lights file");
    scene_lights::apply(&mut scene, &file, true);
    assert_eq!(scene.lights.lights.len(), before.lights.len());
    for (now, then) in scene.lights.lights.iter().zip(&before.lights) {
        assert_eq!(now.radiance, then.radiance.map(|r| r * 0.25));
        assert_eq!(now.scale, 0.25);
    }
    let file = LightsFile::parse(&format!("scale {term} 0\n")).expect("a lights file");
    scene_lights::apply(&mut scene, &file, true);
    assert!(scene.lights.lights.is_empty(), "a light without strength is none");
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

/// Light entities that the file still holds: position and photons.
fn truth(scene: &Scene) -> Vec<(Vec3, f32)> {
    let lights = scene.lights.lights.iter().zip(&scene.lights.sources);
    lights
        .filter(|(_, s)| matches!(s, LightSource::PointEntity | LightSource::SpotEntity))
        .map(|(l, _)| (Vec3::from(l.p0), l.p2[2] * 255.0))
        .collect()
}

/// How well the lights of a file were found.
struct Recall {
    truth: usize,
    found: usize,
    /// Distance to the nearest light found, and that one's power over the true one, per light of the file.
    nearest: Vec<(f32, f32)>,
}

/// Distance up to which a light counts for the comparison of powers, units.
const SAME: f32 = 48.0;

impl Recall {
    fn new(truth: &[(Vec3, f32)], r: &Recovery) -> Self {
        let nearest = |(p, photons): &(Vec3, f32)| {
            let pairs = r.lights.iter().map(|l| {
                let ratio = l.power.max_element() / photons;
                (l.position.distance(*p), ratio)
            });
            pairs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, 0.0))
        };
        Self {
            truth: truth.len(),
            found: r.lights.len(),
            nearest: truth.iter().map(nearest).collect(),
        }
    }

    fn within(&self, distance: f32) -> usize {
        self.nearest.iter().filter(|n| n.0 <= distance).count()
    }

    fn power(&self) -> f64 {
        let near = self.nearest.iter().filter(|n| n.0 <= SAME);
        table::median(near.map(|n| f64::from(n.1)))
    }
}

impl std::fmt::Display for Recall {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let [a, b, c, d] = [16.0, 32.0, 48.0, 64.0].map(|d| self.within(d));
        write!(
            f,
            "{} lights, {} found, within 16 32 48 64 units: {a} {b} {c} {d}, median power ratio {:.2}",
            self.truth,
            self.found,
            self.power()
        )
    }
}

fn hidden() -> Options {
    Options {
        hide_entities: true,
        ..Options::default()
    }
}

#[test]
#[ignore = "two minutes"]
fn lights_that_files_still_hold_are_found() {
    // How many must be found within which distance, and whether their number is limited.
    let wanted = [
        ("q3dm6ish", Some((29, 32.0)), true),
        ("oa_bases3", Some((21, 48.0)), true),
        ("kaos", Some((27, 32.0)), false),
        ("oa_ctf2", None, false),
        ("oacmpdm4", None, false),
        ("oacmpdm10", None, false),
    ];
    let mut missed = Vec::new();
    for (map, least, few) in wanted {
        let scene = common::real(map);
        let entities = truth(&scene);
        assert!(!entities.is_empty(), "{map} has no light entities");
        let recall = Recall::new(&entities, &recover(&scene, &hidden(), &common::quiet).expect("luxels"));
        println!("{map}: {recall}");
        let Some((count, distance)) = least else { continue };
        let power_fits = (0.85..=1.15).contains(&recall.power());
        let not_too_many = !few || recall.found * 2 <= recall.truth * 3;
        if recall.within(distance) < count || !power_fits || !not_too_many {
            missed.push(format!("{map}: {recall}"));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
#[ignore = "about a quarter of a minute a map; see the module's documentation"]
fn table_of_the_installed_maps() {
    let asked = std::env::var("Q3RAYS_MAPS").ok();
    let names: Vec<String> = match &asked {
        Some(list) => list.split(',').map(str::to_owned).collect(),
        None => {
            let maps = common::installed().maps();
            maps.into_iter().map(|m| m.name).filter(|n| n != "showcase").collect()
        }
    };
    let hold_out = std::env::var_os("Q3RAYS_HOLD_OUT").is_some();
    let (mut rows, mut failures) = (Vec::new(), Vec::new());
    println!("{}", table::HEAD);
    for name in names {
        table::forget_peak();
        let scene = common::real(&name);
        let start = std::time::Instant::now();
        let r = match recover(&scene, &hidden(), &common::quiet) {
            Ok(r) => r,
            Err(e) => {
                println!("{e}");
                failures.push(e.to_string());
                continue;
            }
        };
        let (seconds, peak) = (start.elapsed().as_secs_f32(), table::peak_mib());
        let text = LightsFile::from(&r).to_string();
        let read = LightsFile::parse(&text).map(|f| f.lights.len());
        assert_eq!(read, Ok(r.lights.len()), "{name}");
        let held_out = hold_out.then(|| {
            let options = Options {
                hold_out_surfaces: true,
                ..hidden()
            };
            let scores = recover(&scene, &options, &common::quiet).expect("luxels").scores;
            scores.full
        });
        let row = table::Row::new(&r, held_out, seconds, peak);
        println!("{row}");
        rows.push(row);
    }
    let summary = table::Summary::new(&rows);
    println!("{summary}");
    if asked.is_some() {
        return;
    }
    if std::env::var_os("Q3RAYS_UPDATE_DOCS").is_some() {
        table::document(&rows, &failures);
    }
    let misses = summary.misses();
    assert!(misses.is_empty(), "{misses:#?}");
}
