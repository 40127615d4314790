//! Why a pixel differs between culling levels: the lights that its row lacks, and what their segments pass through.

use glam::Vec3;
use q3rays::assets::bsp::Bsp;
use q3rays::reference::CpuRenderer;
use q3rays::reference::direct::{SampleAddress, light_row, point_sampling};
use q3rays::reference::light_sample::{Target, sample_light};
use q3rays::reference::surface::{offset_point, surface_at};
use q3rays::render::settings::Settings;
use q3rays::scene::camera::Camera;
use q3rays::scene::sampling::{DIM_EVERY_LIGHT, key, sample2};

/// What is to be said of a pixel that differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Every segment that level 0 adds crosses a solid leaf: an error of the map's own visibility.
    Leak,
    /// Light arrives through open space that the row should have listed: a bug.
    Missing { light: u32 },
    /// No light is missing, and yet the pixels differ: a bug.
    Unexplained,
}

/// Least length inside solid leafs that counts as crossing one, units: more than rounding of the receiver's position.
const THROUGH: f32 = 0.01;

/// Length of the segment inside solid leafs.
pub fn solid_length(bsp: &Bsp, from: Vec3, to: Vec3) -> f32 {
    let mut total = 0.0;
    let mut stack = vec![(0i32, from, to)];
    if bsp.nodes.is_empty() {
        return 0.0;
    }
    while let Some((at, a, b)) = stack.pop() {
        if at < 0 {
            if bsp.leafs[(-1 - at) as usize].cluster < 0 {
                total += a.distance(b);
            }
            continue;
        }
        let node = &bsp.nodes[at as usize];
        let plane = &bsp.planes[node.plane as usize];
        let side = |p: Vec3| Vec3::from(plane.normal).dot(p) - plane.dist;
        let (sa, sb) = (side(a), side(b));
        let child = |s: f32| node.children[usize::from(s < 0.0)];
        if (sa < 0.0) == (sb < 0.0) {
            stack.push((child(sa), a, b));
        } else {
            let cut = a + (b - a) * (sa / (sa - sb)).clamp(0.0, 1.0);
            stack.push((child(sa), a, cut));
            stack.push((child(sb), cut, b));
        }
    }
    total
}

/// Explains one sample of one pixel in the mode "all lights".
pub fn explain(cpu: &CpuRenderer, camera: &Camera, size: (u32, u32), settings: &Settings, pixel: usize) -> Cause {
    let scene = cpu.scene;
    let (x, y) = (pixel as u32 % size.0, pixel as u32 / size.0);
    let address = SampleAddress {
        pixel: x + (y << 16),
        index: 0,
    };
    let ray = cpu.view(camera, size, settings).sample(settings, x, y, address);
    let Some(hit) = cpu
        .tracer
        .closest(scene, ray.origin, ray.direction, f64::from(f32::MAX))
    else {
        return Cause::Unexplained;
    };
    let at = surface_at(scene, &cpu.tracer, &hit, ray.direction, 0.0, 0.0);
    let (lists, row) = light_row(scene, settings, at.row);
    let listed: std::collections::HashSet<u32> = lists.lights(row).collect();
    let origin = offset_point(at.position, at.geometric_normal);
    let mut cause = Cause::Unexplained;
    for light in (0..scene.lights.lights.len() as u32).filter(|l| !listed.contains(l)) {
        let k = key(settings.seed, address.pixel, DIM_EVERY_LIGHT + light);
        let u = sample2(settings.sequence, k, address.index);
        let record = &scene.lights.lights[light as usize];
        let Some(sample) = sample_light(scene, record, &at, u, point_sampling(settings)) else {
            continue;
        };
        // Suns and skies are in every row: one that is not is a bug, wherever its rays pass.
        let Target::Point(target) = sample.target else {
            return Cause::Missing { light };
        };
        if cpu.tracer.occluded(scene, origin, target - origin, 1.0) {
            continue;
        }
        if solid_length(&scene.bsp, origin, target) < THROUGH {
            return Cause::Missing { light };
        }
        cause = Cause::Leak;
    }
    cause
}
