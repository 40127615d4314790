//! Culling is exact: with all lights, every `rt_cullLights` level gives the same image bit for bit, but for leaks through
//! solid that a map's own visibility knows nothing of. Level 0 never reads the PVS.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::leaks::{Cause, explain};
use common::{camera, differing_pixels, quiet, real, same_bits, scene, spawn_camera, still};
use gpu_fixture::with_device;
use q3rays::assets::bsp::Bsp;
use q3rays::assets::bsp::build::fixtures::{
    Doorways, Fixture, LitBox, chain, doorway_light, free_emitter, lit_box, surface_in_solid, unvised,
};
use q3rays::assets::vfs::FileSource;
use q3rays::reference::CpuRenderer;
use q3rays::reference::direct::RayCounts;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::Settings;
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;
use q3rays::scene::records::LightRow;
use q3rays::scene::sampling::Sequence;

/// All lights at a level.
fn level(cull_lights: u32) -> Settings {
    Settings {
        cull_lights,
        antialiasing: true,
        ..still(0, Sequence::Sobol, 7)
    }
}

type Render<'a> = &'a dyn Fn(&Settings) -> (Film, RayCounts);

/// Holds levels 1 and 2 against level 0 in one view; returns the number of leak pixels.
fn levels_agree(what: &str, cpu: &CpuRenderer, camera: &Camera, size: (u32, u32), render: Render) -> usize {
    let (all, counts) = render(&level(0));
    let (pvs, pvs_counts) = render(&level(1));
    let (tight, tight_counts) = render(&level(2));
    assert!(
        same_bits(&pvs, &tight),
        "{what}: level 2 differs from level 1 in {} pixels",
        differing_pixels(&pvs, &tight).len()
    );
    let mut leaks = 0;
    for pixel in differing_pixels(&all, &pvs) {
        match explain(cpu, camera, size, &level(1), pixel) {
            Cause::Leak => leaks += 1,
            cause => panic!("{what}: pixel {pixel} differs between levels 0 and 1: {cause:?}"),
        }
    }
    // A ray that facing tests end is none; culling saves tests as well as rays.
    let work = |c: RayCounts| (c.shadow, c.shadow + c.shadow_skipped);
    let saved = |c: RayCounts| {
        let ((rays, samples), (all_rays, all_samples)) = (work(c), work(counts));
        let share = |part: u64, whole: u64| 100.0 * (1.0 - part as f64 / whole.max(1) as f64);
        (share(rays, all_rays), share(samples, all_samples))
    };
    let ((r1, s1), (r2, s2)) = (saved(pvs_counts), saved(tight_counts));
    println!(
        "{what}: {leaks} leak pixels; saved {r1:.1}% of {} shadow rays and {s1:.1}% of light samples, level 2 {r2:.1}% \
         and {s2:.1}%",
        counts.shadow
    );
    assert!(pvs_counts.shadow <= counts.shadow && tight_counts.shadow <= pvs_counts.shadow);
    leaks
}

fn on_cpu(scene: &Scene, what: &str, camera: &Camera, size: (u32, u32)) -> usize {
    let cpu = CpuRenderer::new(scene);
    levels_agree(what, &cpu, camera, size, &|s| {
        cpu.accumulate(camera, size, s, 0..1, &quiet)
    })
}

fn on_gpu(gpu: &SceneGpu, cpu: &CpuRenderer, what: &str, camera: &Camera, size: (u32, u32)) -> usize {
    let renderer = GpuRenderer::new(gpu).unwrap();
    levels_agree(what, cpu, camera, size, &|s| {
        renderer.accumulate(camera, size, s, 0..1, &quiet).unwrap()
    })
}

const LIT_BOX: LitBox = LitBox {
    size: 256,
    albedo: 128,
    light: [[64, 64], [192, 192]],
    surfacelight: 1000,
};

fn fixtures() -> Vec<(Fixture, Camera)> {
    let room = camera([40.3, 128.6, 60.2], 10.0, 2.0, 90.0);
    vec![
        (lit_box(&LIT_BOX).unwrap(), room),
        (free_emitter(48.0, 1000, true).unwrap(), room),
        (free_emitter(48.0, 1000, false).unwrap(), room),
        (doorway_light(1000).unwrap(), room),
        (
            chain(6, Doorways::InLine, 1000).unwrap(),
            camera([40.3, 60.6, 60.2], 5.0, 2.0, 90.0),
        ),
        (
            chain(6, Doorways::Staggered, 1000).unwrap(),
            camera([40.3, 60.6, 60.2], 5.0, 2.0, 90.0),
        ),
        (unvised(4, 1000).unwrap(), camera([40.3, 60.6, 60.2], 5.0, 2.0, 90.0)),
        (surface_in_solid(1000).unwrap(), room),
    ]
}

#[test]
fn levels_are_the_same_image_on_fixtures() {
    with_device(|device| {
        for (fixture, camera) in fixtures() {
            let scene = scene(&fixture);
            let cpu = CpuRenderer::new(&scene);
            let size = (64, 36);
            // Fixtures have exact visibility: nothing leaks.
            assert_eq!(on_cpu(&scene, &fixture.name, &camera, size), 0);
            let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
            assert_eq!(
                on_gpu(&gpu, &cpu, &format!("{} on the GPU", fixture.name), &camera, size),
                0
            );
        }
    });
}

/// At most this share of all pixels may be leaks.
const MOST_LEAKS: f64 = 1e-4;

fn levels_agree_on_maps(maps: &[&str], cameras: usize, size: (u32, u32)) {
    with_device(|device| {
        let (mut leaks, mut pixels) = (0, 0);
        for name in maps {
            let scene = real(name);
            let cpu = CpuRenderer::new(&scene);
            let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
            for spawn in 0..cameras {
                // Spawn points next to each other in the file stand next to each other in the map.
                let camera = spawn_camera(&scene, spawn * scene.spawns.len() / cameras);
                let what = format!("{name} from spawn {spawn}");
                leaks += on_cpu(&scene, &what, &camera, size);
                leaks += on_gpu(&gpu, &cpu, &format!("{what} on the GPU"), &camera, size);
                pixels += 2 * size.0 * size.1;
            }
        }
        println!("{leaks} leak pixels of {pixels}");
        assert!(
            leaks as f64 <= MOST_LEAKS * f64::from(pixels),
            "{leaks} leak pixels of {pixels}"
        );
    });
}

#[test]
fn levels_are_the_same_image_on_real_maps() {
    levels_agree_on_maps(&["oa_dm1", "slimefac", "oa_ctf4ish"], 2, (64, 36));
}

/// The ten maps and three views; minutes of work.
#[test]
#[ignore = "takes minutes; for releases"]
fn levels_are_the_same_image_on_ten_maps() {
    let maps = [
        "oa_dm1",
        "am_galmevish2",
        "ctf_compromise",
        "oa_minia",
        "oa_ctf4ish",
        "slimefac",
        "czest1dm",
        "kaos",
        "oa_koth2",
        "oasago2",
    ];
    levels_agree_on_maps(&maps, 3, (160, 90));
}

/// The same map with a PVS in which no cluster sees another.
fn blind(bsp: &Bsp) -> Bsp {
    let mut bsp = bsp.clone();
    if let Some(vis) = &mut bsp.visibility {
        vis.rows.fill(0);
    }
    bsp
}

#[test]
fn level_0_does_not_read_the_pvs() {
    with_device(|device| {
        let fixture = chain(6, Doorways::InLine, 1000).unwrap();
        let files = common::Files(fixture.files());
        let cases: [(&str, &dyn FileSource, Camera); 2] = [
            ("chain", &files, camera([40.3, 60.6, 60.2], 5.0, 2.0, 90.0)),
            ("oa_dm1", &common::installed(), spawn_camera(&real("oa_dm1"), 2)),
        ];
        for (name, files, camera) in cases {
            let whole = Scene::load(files, name).unwrap();
            let blinded = Scene::from_bsp(files, name, blind(&whole.bsp)).unwrap();
            let mut emptied = Scene::from_bsp(files, name, whole.bsp.clone()).unwrap();
            for lists in [&mut emptied.rows.pvs, &mut emptied.rows.tight] {
                let nothing = LightRow {
                    first_run: 0,
                    run_count: 0,
                    light_count: 0,
                    weight: 0,
                };
                let all = emptied.rows.all_row as usize;
                lists.rows[..all].fill(nothing);
                lists.rows[all + 1..].fill(nothing);
            }
            let size = (64, 36);
            let images = |scene: &Scene| {
                let cpu = CpuRenderer::new(scene);
                let gpu = SceneGpu::new(device, scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
                let renderer = GpuRenderer::new(&gpu).unwrap();
                [0, 1].map(|l| {
                    [
                        cpu.accumulate(&camera, size, &level(l), 0..1, &quiet).0,
                        renderer.accumulate(&camera, size, &level(l), 0..1, &quiet).unwrap().0,
                    ]
                })
            };
            let [level_0, level_1] = images(&whole);
            for (how, scene) in [("blind PVS", blinded), ("empty rows", emptied)] {
                let [damaged_0, damaged_1] = images(&scene);
                for backend in 0..2 {
                    assert!(same_bits(&level_0[backend], &damaged_0[backend]), "{name}, {how}");
                    // The damage is real: level 1 sees it.
                    assert!(!same_bits(&level_1[backend], &damaged_1[backend]), "{name}, {how}");
                }
            }
        }
    });
}
