//! Closed forms of direct light, in double precision, and maps that have them.

use glam::{DVec3, Vec3};
use q3rays::assets::bsp::build::fixtures::{Fixture, LitBox, closed_box};
use q3rays::assets::bsp::build::{Bounds, Entity, MapBuilder, Mapping, Paint};
use q3rays::assets::bsp::lumps::surface_flags;

/// Radiance of a fixture's emitter in luxel units, as the fixtures' documentation has it.
pub fn emitter_radiance(surfacelight: u32) -> f64 {
    0.75 * f64::from(surfacelight) / 255.0
}

/// Irradiance/π per radiance by a polygon wholly before the receiver's plane: Lambert's form factor,
/// 1/2π · Σ angle between successive corners × cosine of their plane's normal.
pub fn polygon(at: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let rays: Vec<DVec3> = corners.iter().map(|c| (*c - at).normalize()).collect();
    let edge = |i: usize| {
        let (a, b) = (rays[i], rays[(i + 1) % rays.len()]);
        let cross = a.cross(b);
        // The arc sine would lose the small angles, the arc cosine too.
        let angle = cross.length().atan2(a.dot(b));
        angle * cross.normalize_or_zero().dot(normal)
    };
    let sum: f64 = (0..corners.len()).map(edge).sum();
    sum.abs() / std::f64::consts::TAU
}

/// Corners of a [`LitBox`]'s light.
pub fn ceiling_light(shape: &LitBox) -> [DVec3; 4] {
    let [[x0, y0], [x1, y1]] = shape.light.map(|c| c.map(f64::from));
    let z = f64::from(shape.size);
    [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| DVec3::new(x, y, z))
}

/// Edge of the boxes made here, units.
pub const SIZE: i32 = 256;

/// A map of one box, changed by `change`, under the name and shader script given. Walls are grey 128.
pub fn boxed(name: &str, script: &str, change: impl FnOnce(&mut MapBuilder, &mut [Option<Paint>; 6])) -> Fixture {
    let mut map = MapBuilder::new(Entity::new("worldspawn"));
    let grey = map.paint("textures/fixture/grey128", 64.0);
    let mut walls = [Some(grey); 6];
    change(&mut map, &mut walls);
    map.cell("box", Bounds::new([0; 3], [SIZE; 3]), walls);
    map.entity(Entity::spawn([SIZE / 2, SIZE / 2, 25], 0));
    Fixture {
        name: name.to_owned(),
        bsp: map.build().unwrap(),
        script: script.to_owned(),
        images: closed_box(SIZE, 128).unwrap().images,
    }
}

/// A box with a light entity of `light` at a point.
pub fn point_light(at: Vec3, light: f32) -> Fixture {
    boxed("point_light", "", |map, _| {
        map.entity(Entity::light(at, light, [1.0; 3]));
    })
}

/// A box whose ceiling is sky with a white sun: `(intensity, azimuth, elevation, deviance)` as in the script, degrees.
pub fn sunlit(sun: (f64, f64, f64, f64)) -> Fixture {
    let (intensity, azimuth, elevation, deviance) = sun;
    let script = format!(
        "textures/fixture/sky\n{{\n\tsurfaceparm sky\n\tq3map_sunExt 1 1 1 {intensity} {azimuth} {elevation} {deviance} \
         16\n\tskyparms - 512 -\n}}\n"
    );
    boxed("sunlit", &script, |map, walls| {
        let sky = map.shader(
            "textures/fixture/sky",
            surface_flags::SKY | surface_flags::NOLIGHTMAP,
            0,
        );
        walls[5] = Some(Paint {
            shader: sky,
            mapping: Mapping::Fit,
        });
    })
}

/// A box whose walls and ceiling are sky with a white dome of value V.
pub fn under_dome(value: u32) -> Fixture {
    let script = format!(
        "textures/fixture/sky\n{{\n\tsurfaceparm sky\n\tq3map_lightRGB 1 1 1\n\tq3map_skylight {value} 5\n\tskyparms - \
         512 -\n}}\n"
    );
    boxed("under_dome", &script, |map, walls| {
        let shader = map.shader(
            "textures/fixture/sky",
            surface_flags::SKY | surface_flags::NOLIGHTMAP,
            0,
        );
        let sky = Paint {
            shader,
            mapping: Mapping::Fit,
        };
        // The floor stays.
        for wall in [0, 1, 2, 3, 5] {
            walls[wall] = Some(sky);
        }
    })
}

/// A box with an upright emitter of 16 x 8 units, a quarter unit above the floor, facing +x at x = 128.
pub fn emitter_on_floor(surfacelight: u32) -> Fixture {
    let script = format!(
        "textures/fixture/lamp\n{{\n\tq3map_surfacelight {surfacelight}\n\tq3map_lightRGB 1 1 1\n\tq3map_backsplash 0 0\n\
         \t{{\n\t\tmap textures/fixture/grey128.png\n\t\trgbGen identity\n\t}}\n}}\n"
    );
    boxed("emitter_on_floor", &script, |map, _| {
        let lamp = map.shader("textures/fixture/lamp", surface_flags::NODLIGHT, 1);
        let paint = Paint {
            shader: lamp,
            mapping: Mapping::Fit,
        };
        map.quad(floor_emitter().map(|c| c.as_vec3()), paint);
    })
}

/// Corners of the emitter of [`emitter_on_floor`], counter-clockwise seen from its front.
pub fn floor_emitter() -> [DVec3; 4] {
    [(120.0, 0.25), (136.0, 0.25), (136.0, 8.25), (120.0, 8.25)].map(|(y, z)| DVec3::new(128.0, y, z))
}
