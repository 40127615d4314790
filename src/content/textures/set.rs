//! The list of textures the shipped map uses.

use super::{Texture, glow, masonry, metal};

/// Lamp images and their colours.
const LAMPS: [(&str, [f32; 3]); 7] = [
    ("lamp_warm", [1.0, 0.80, 0.55]),
    ("lamp_cool", [0.78, 0.90, 1.0]),
    ("lamp_white", [1.0, 0.95, 0.86]),
    ("lamp_red", [1.0, 0.22, 0.14]),
    ("lamp_teal", [0.16, 0.92, 0.84]),
    ("lamp_amber", [1.0, 0.62, 0.18]),
    ("lamp_violet", [0.62, 0.30, 1.0]),
];

/// All textures; `sun` is the unit direction towards the sun.
pub fn all(sun: [f32; 3]) -> Vec<Texture> {
    let mut textures = vec![
        masonry::brick(),
        masonry::stone(),
        masonry::tiles(),
        masonry::checker(),
        masonry::marble(),
        masonry::concrete(),
        masonry::plaster(),
        masonry::wood(),
        metal::metal(),
        metal::trim(),
        metal::door(),
        metal::grate(),
        glow::ember(),
    ];
    textures.extend(LAMPS.iter().map(|&(name, color)| glow::lamp(name, color)));
    textures.extend(glow::sky(sun));
    textures
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_of_moderate_albedo() {
        let surfaces = all([0.0, 0.0, 1.0]);
        for texture in surfaces.iter().take(12) {
            let linear = |b: u8| {
                let x = f32::from(b) / 255.0;
                if x <= 0.04045 {
                    x / 12.92
                } else {
                    ((x + 0.055) / 1.055).powf(2.4)
                }
            };
            let sum: f32 = texture
                .rgba
                .chunks_exact(4)
                .flat_map(|p| &p[..3])
                .map(|&b| linear(b))
                .sum();
            let mean = sum / (texture.side * texture.side * 3) as f32;
            assert!((0.08..0.6).contains(&mean), "{}: {mean}", texture.name);
        }
    }

    #[test]
    fn tiling_textures_have_no_seam() {
        for texture in all([0.0, 0.0, 1.0])
            .iter()
            .filter(|t| t.name.ends_with("plaster") || t.name.ends_with("marble"))
        {
            let side = texture.side;
            let step = |y: usize, a: usize, b: usize| {
                i32::from(texture.rgba[(y * side + a) * 4]).abs_diff(i32::from(texture.rgba[(y * side + b) * 4]))
            };
            let seam: u32 = (0..side).map(|y| step(y, side - 1, 0)).sum();
            let inside: u32 = (0..side).map(|y| step(y, side / 3, side / 3 + 1)).sum();
            assert!(seam < inside * 3 + 200, "{}: {seam} against {inside}", texture.name);
        }
    }

    #[test]
    fn the_grate_has_holes() {
        let textures = all([0.0, 0.0, 1.0]);
        let grate = textures.iter().find(|t| t.name.ends_with("grate")).unwrap();
        let open = grate.rgba.chunks_exact(4).filter(|p| p[3] < 128).count();
        let share = open as f32 / (grate.side * grate.side) as f32;
        assert!((0.4..0.7).contains(&share), "{share}");
    }
}
