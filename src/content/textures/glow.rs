//! Lamps, embers and the sky.

use super::noise::{fbm, fbm3, mix, smooth};
use super::relief::{Texel, Texture, blend, render, scaled};

/// A lamp's diffuser: brightest in the middle. Its mean colour is the colour of its light.
pub fn lamp(name: &str, color: [f32; 3]) -> Texture {
    render(name, 64, 0.0, |u, v| {
        let edge = u.min(1.0 - u).min(v.min(1.0 - v));
        let bright = mix(0.72, 1.0, smooth(0.0, 0.22, edge));
        let whitened = blend(color, [1.0; 3], smooth(0.1, 0.45, edge) * 0.25);
        Texel::new(scaled(whitened, bright), 0.0)
    })
}

/// Glowing coals.
pub fn ember() -> Texture {
    render("ember", 128, 0.0, |u, v| {
        let warp = (fbm(u, v, [4, 4], 3, 151) - 0.5) * 0.3;
        let crust = fbm(u + warp, v + warp, [5, 5], 4, 152);
        let heat = 1.0 - smooth(0.25, 0.7, crust);
        Texel::new(blend([0.42, 0.08, 0.02], [1.0, 0.66, 0.22], heat), 0.0)
    })
}

/// Sides of a sky box: name's ending, and the direction of image coordinates s (right) and t (up) in −1..1.
type Side = (&'static str, fn(f32, f32) -> [f32; 3]);
const SIDES: [Side; 6] = [
    ("rt", |s, t| [1.0, -s, t]),
    ("lf", |s, t| [-1.0, s, t]),
    ("bk", |s, t| [s, 1.0, t]),
    ("ft", |s, t| [-s, -1.0, t]),
    ("up", |s, t| [-t, -s, 1.0]),
    ("dn", |s, t| [t, -s, -1.0]),
];

/// Edge of a sky side, pixels.
const SKY_SIDE: usize = 256;

/// The six images of `env/showcase`: blue above, pale at the horizon, torn clouds, a glow around `sun` (unit direction).
pub fn sky(sun: [f32; 3]) -> Vec<Texture> {
    let side = |&(ending, direction): &Side| {
        let image = render("", SKY_SIDE, 0.0, |u, v| {
            Texel::new(sky_color(direction(2.0 * u - 1.0, 1.0 - 2.0 * v), sun), 0.0)
        });
        Texture {
            name: format!("env/showcase_{ending}"),
            ..image
        }
    };
    SIDES.iter().map(side).collect()
}

fn sky_color(direction: [f32; 3], sun: [f32; 3]) -> [f32; 3] {
    let length = direction.iter().map(|c| c * c).sum::<f32>().sqrt();
    let d = direction.map(|c| c / length);
    let up = d[2].max(0.0);
    let blue = blend([0.74, 0.80, 0.86], [0.30, 0.48, 0.76], smooth(0.0, 0.7, up));
    let ground = smooth(0.0, -0.2, d[2]);
    // Clouds lie on a plane overhead; the offset keeps the horizon finite.
    let plane = 1.6 / (up + 0.25);
    let cover = fbm3([d[0] * plane, d[1] * plane, 3.5], 5, 161);
    let cloud = smooth(0.48, 0.72, cover) * smooth(0.02, 0.2, up);
    let towards_sun = (0..3).map(|a| d[a] * sun[a]).sum::<f32>().max(0.0);
    let glow = smooth(0.90, 1.0, towards_sun);
    let white = blend([0.84, 0.86, 0.88], [1.0, 0.97, 0.90], glow);
    let clear = blend(blue, [1.0, 0.93, 0.78], glow * glow * 0.8);
    blend(blend(clear, white, cloud * 0.85), [0.46, 0.44, 0.42], ground)
}
