//! A mirror between two glass tubes with a pierced ribbon in each, before two coloured lamps: every ray that meets it
//! branches (the thesis's figures 7.5 and 7.6).

use super::palette::Palette;
use crate::assets::bsp::build::{Bounds, Entity, MapBuilder, Mesh, MeshVertex, ShaderId, column};
use glam::{Vec2, Vec3};

/// Height of the glass over its plinth, and where that ends.
const GLASS: [i32; 2] = [16, 176];
/// Outer and inner radius of a tube.
const RADII: [i32; 2] = [26, 22];

/// Makes mirror and tubes before the wall x = `wall`, the mirror's middle at `y`.
pub fn mirror_and_tubes(map: &mut MapBuilder, p: &Palette, wall: i32, y: i32) {
    mirror(map, p, wall, y);
    for at in [y - 96, y + 96] {
        tube(map, p, [wall - 48, at]);
    }
}

fn mirror(map: &mut MapBuilder, p: &Palette, wall: i32, y: i32) {
    const HALF: i32 = 48;
    const FRAME: i32 = 6;
    let [low, high] = [12, 172];
    let piece = |y0: i32, y1: i32, z0: i32, z1: i32| Bounds::new([wall - 10, y0, z0], [wall, y1, z1]);
    let beams = [
        piece(y - HALF - FRAME, y + HALF + FRAME, low - FRAME, low),
        piece(y - HALF - FRAME, y + HALF + FRAME, high, high + FRAME),
        piece(y - HALF - FRAME, y - HALF, low, high),
        piece(y + HALF, y + HALF + FRAME, low, high),
    ];
    for beam in beams {
        map.pillar(beam, p.trim);
    }
    let at = |y: i32, z: i32| Vec3::new((wall - 6) as f32, y as f32, z as f32);
    let (left, right) = (y + HALF, y - HALF);
    map.quad(
        [at(left, low), at(right, low), at(right, high), at(left, high)],
        p.mirror,
    );
    // A portal surface without a target is a mirror.
    let entity = Entity::new("misc_portal_surface");
    map.entity(entity.with("origin", &format!("{} {y} {}", wall - 10, (low + high) / 2)));
}

fn tube(map: &mut MapBuilder, p: &Palette, [x, y]: [i32; 2]) {
    let square = |half: i32, z0: i32, z1: i32| Bounds::new([x - half, y - half, z0], [x + half, y + half, z1]);
    let [low, high] = GLASS;
    map.pillar(square(RADII[0] + 6, 0, low), p.marble);
    map.pillar(square(RADII[0] + 6, high, high + 12), p.marble);
    let base = Vec3::new(x as f32, y as f32, low as f32);
    let height = (high - low) as f32;
    let axis = base + Vec3::Z * (height * 0.5);
    for (radius, away) in RADII.into_iter().zip([true, false]) {
        // Both fronts are on the air's side.
        let side = column(base, radius as f32, height, 64.0).facing(axis, away);
        map.patch(side, p.glass.shader);
    }
    // Keeps players out.
    map.clip(square(RADII[0], low, high));
    ribbon(map, base + Vec3::Z * 8.0, 14.0, height - 16.0, p.grate.shader);
}

/// A band wound around an axis that stands on `base`.
fn ribbon(map: &mut MapBuilder, base: Vec3, radius: f32, height: f32, shader: ShaderId) {
    const STEPS: u32 = 48;
    const TURNS: f64 = 2.5;
    const WIDTH: f32 = 26.0;
    // Whole 64ths hide any difference between machines' sines.
    let snapped = |p: Vec3| (p * 64.0).round() / 64.0;
    let mut mesh = Mesh::default();
    for step in 0..=STEPS {
        let share = step as f32 / STEPS as f32;
        let angle = std::f64::consts::TAU * TURNS * f64::from(share);
        let out = Vec3::new(angle.cos() as f32, angle.sin() as f32, 0.0);
        for (edge, v) in [(0.0, 1.0), (WIDTH, 0.0)] {
            mesh.vertices.push(MeshVertex {
                position: snapped(base + out * radius + Vec3::Z * (share * (height - WIDTH) + edge)),
                normal: snapped(out * 64.0).normalize_or(Vec3::X),
                uv: Vec2::new(share * 8.0, v * 0.8),
            });
        }
    }
    for step in 0..STEPS {
        let a = step * 2;
        let (b, c, d) = (a + 2, a + 3, a + 1);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    map.mesh(mesh, shader);
}
