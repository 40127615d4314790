//! Metal panels, trim, the door and the grate.

use super::noise::{fbm, mix, smooth};
use super::relief::{Texel, Texture, bevel, blend, bond, render, scaled};

/// Riveted steel plates.
pub fn metal() -> Texture {
    render("metal", 256, 0.35, |u, v| {
        let plate = bond(u, v, 2, 2, 0.0);
        let brushed = fbm(u, v, [4, 96], 2, 111);
        let cloud = fbm(u, v, [5, 5], 4, 112);
        let corner = |t: f32| t.min(1.0 - t) * 128.0 - 9.0;
        let (dx, dy) = (corner(plate.at[0]), corner(plate.at[1]));
        let rivet = smooth(4.5, 1.5, (dx * dx + dy * dy).sqrt());
        let rust = smooth(0.60, 0.75, cloud) * 0.35;
        let steel = blend([0.50, 0.53, 0.57], [0.46, 0.33, 0.24], rust);
        let tone = mix(0.88, 1.08, brushed) * mix(0.9, 1.08, cloud) * mix(0.55, 1.0, smooth(0.6, 2.0, plate.edge));
        Texel::new(scaled(steel, tone), bevel(plate.edge, 0.8, 3.0, 3.0) + rivet * 3.0)
    })
}

/// Dark bronze moulding: bands along u.
pub fn trim() -> Texture {
    render("trim", 128, 0.35, |u, v| {
        let band = v * 4.0;
        let f = band - band.floor();
        let wave = smooth(0.0, 0.25, f) - smooth(0.75, 1.0, f);
        let cloud = fbm(u, v, [6, 6], 4, 121);
        let color = blend([0.36, 0.29, 0.22], [0.56, 0.46, 0.34], wave * mix(0.7, 1.0, cloud));
        Texel::new(scaled(color, mix(0.85, 1.1, cloud)), wave * 5.0)
    })
}

/// A sliding door's face, with a hazard stripe across it.
pub fn door() -> Texture {
    render("door", 256, 0.35, |u, v| {
        let plate = bond(u, v, 2, 3, 0.0);
        let cloud = fbm(u, v, [6, 6], 4, 131);
        let scratch = fbm(u, v, [64, 8], 2, 132);
        let stripe_band = smooth(0.435, 0.44, v) - smooth(0.56, 0.565, v);
        let diagonal = (u * 8.0 + v * 8.0).rem_euclid(1.0);
        let hazard = if diagonal < 0.5 {
            [0.76, 0.58, 0.16]
        } else {
            [0.20, 0.19, 0.18]
        };
        let paint = blend([0.42, 0.50, 0.52], hazard, stripe_band);
        let seam = (u - 0.5).abs() * 256.0;
        let tone = mix(0.85, 1.1, cloud) * mix(0.93, 1.04, scratch) * mix(0.35, 1.0, smooth(0.8, 2.2, seam));
        let height = bevel(plate.edge, 1.0, 4.0, 3.0) * (1.0 - stripe_band);
        Texel::new(scaled(paint, tone), height)
    })
}

/// Crossed bars with holes between them; alpha 0 in the holes.
pub fn grate() -> Texture {
    render("grate", 128, 0.4, |u, v| {
        let mesh = bond(u, v, 4, 4, 0.0);
        // `edge` is in 256ths of the tile: bars are 2 x 9 of 64 wide.
        let bar = smooth(9.5, 8.5, mesh.edge);
        let cloud = fbm(u, v, [8, 8], 3, 141);
        let round = smooth(9.0, 0.0, mesh.edge) * 5.0;
        Texel {
            color: scaled([0.42, 0.40, 0.38], mix(0.8, 1.15, cloud)),
            height: round,
            alpha: bar,
        }
    })
}
