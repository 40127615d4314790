//! Brick, stone, tiles, concrete, plaster, wood and marble.

use super::noise::{fbm, hash, mix, smooth};
use super::relief::{Texel, Texture, bevel, blend, bond, render, scaled};

/// Red-brown running bond with light mortar.
pub fn brick() -> Texture {
    render("brick", 256, 0.35, |u, v| {
        let brick = bond(u, v, 4, 8, 0.5);
        let grain = fbm(u, v, [16, 16], 4, 11);
        let wobble = brick.edge + (fbm(u, v, [24, 24], 2, 15) - 0.5) * 2.0;
        let tone = hash(brick.id[0], brick.id[1], 0, 12);
        let clay = blend([0.56, 0.31, 0.22], [0.68, 0.44, 0.32], tone);
        let burnt = if hash(brick.id[0], brick.id[1], 1, 13) > 0.85 {
            0.72
        } else {
            1.0
        };
        let face = scaled(clay, burnt * mix(0.8, 1.15, grain));
        let mortar = scaled([0.62, 0.58, 0.52], mix(0.8, 1.1, fbm(u, v, [32, 32], 3, 14)));
        let height = bevel(wobble, 1.5, 3.0, 3.0);
        Texel::new(blend(mortar, face, smooth(1.2, 2.6, wobble)), height + grain * 1.5)
    })
}

/// Large pale ashlar blocks.
pub fn stone() -> Texture {
    render("stone", 256, 0.3, |u, v| {
        let block = bond(u, v, 2, 4, 0.5);
        let grain = fbm(u, v, [8, 8], 5, 21);
        let pits = smooth(0.62, 0.75, fbm(u, v, [32, 32], 3, 23));
        let tone = hash(block.id[0], block.id[1], 0, 22);
        let rock = blend([0.66, 0.61, 0.53], [0.76, 0.71, 0.62], tone);
        let face = scaled(rock, mix(0.82, 1.12, grain) * (1.0 - 0.12 * pits));
        let joint = [0.46, 0.42, 0.36];
        let height = bevel(block.edge, 1.0, 5.0, 4.0) + grain * 2.0 - pits * 1.2;
        Texel::new(blend(joint, face, smooth(0.8, 2.2, block.edge)), height)
    })
}

/// Square floor tiles of warm grey stone.
pub fn tiles() -> Texture {
    render("tiles", 256, 0.3, |u, v| {
        let tile = bond(u, v, 4, 4, 0.0);
        let cloud = fbm(u, v, [6, 6], 5, 31);
        let dark = (tile.id[0] + tile.id[1]) % 2 == 0;
        let base = if dark { [0.50, 0.46, 0.42] } else { [0.62, 0.57, 0.50] };
        let tone = mix(0.92, 1.08, hash(tile.id[0], tile.id[1], 0, 32)) * mix(0.85, 1.12, cloud);
        let grout = [0.36, 0.34, 0.31];
        let height = bevel(tile.edge, 1.0, 2.5, 2.5) + cloud * 0.8;
        Texel::new(blend(grout, scaled(base, tone), smooth(0.8, 2.0, tile.edge)), height)
    })
}

/// Polished marble chequers, light and green-black.
pub fn checker() -> Texture {
    render("checker", 256, 0.15, |u, v| {
        let tile = bond(u, v, 2, 2, 0.0);
        let light = (tile.id[0] + tile.id[1]) % 2 == 0;
        let vein = veins(u, v, if light { 41 } else { 45 });
        let color = if light {
            blend([0.78, 0.74, 0.68], [0.58, 0.54, 0.50], vein)
        } else {
            blend([0.30, 0.34, 0.32], [0.48, 0.52, 0.48], vein * 0.8)
        };
        Texel::new(
            scaled(color, mix(0.75, 1.0, smooth(0.2, 1.6, tile.edge))),
            bevel(tile.edge, 0.5, 1.5, 2.0),
        )
    })
}

/// Cream marble with soft veins, for columns.
pub fn marble() -> Texture {
    render("marble", 256, 0.1, |u, v| {
        let cloud = fbm(u, v, [4, 4], 5, 51);
        let vein = veins(u, v, 52);
        let color = blend([0.80, 0.74, 0.64], [0.66, 0.58, 0.50], vein);
        Texel::new(scaled(color, mix(0.9, 1.06, cloud)), cloud)
    })
}

/// Thin lines where warped noise crosses its middle.
fn veins(u: f32, v: f32, seed: u32) -> f32 {
    let warp = (fbm(u, v, [4, 4], 3, seed + 1) - 0.5) * 0.35;
    let n = fbm(u + warp, v - warp, [3, 3], 4, seed);
    let line = 1.0 - smooth(0.0, 0.06, (n - 0.5).abs());
    line * mix(0.3, 1.0, fbm(u, v, [6, 6], 2, seed + 2))
}

/// Cast concrete slabs with tie holes.
pub fn concrete() -> Texture {
    render("concrete", 256, 0.3, |u, v| {
        let slab = bond(u, v, 1, 2, 0.0);
        let cloud = fbm(u, v, [5, 5], 5, 61);
        let speck = fbm(u, v, [64, 64], 2, 62);
        let stain = fbm(u, v, [16, 2], 3, 63);
        let hole = [0.125, 0.875]
            .iter()
            .flat_map(|&x| [0.2, 0.8].map(|y| (x, y)))
            .fold(99.0_f32, |least, (x, y)| {
                let (dx, dy) = ((slab.at[0] - x) * 256.0, (slab.at[1] - y) * 128.0);
                least.min((dx * dx + dy * dy).sqrt())
            });
        let dark = mix(0.6, 1.0, smooth(3.0, 5.0, hole)) * mix(0.7, 1.0, smooth(0.6, 2.0, slab.edge));
        let tone = mix(0.85, 1.1, cloud) * mix(0.95, 1.05, speck) * mix(0.93, 1.03, stain);
        let height = bevel(slab.edge, 0.6, 2.0, 2.0) + smooth(2.5, 5.0, hole) * 3.0 + speck * 1.0;
        Texel::new(scaled([0.60, 0.59, 0.57], tone * dark), height)
    })
}

/// Warm, slightly uneven wall plaster.
pub fn plaster() -> Texture {
    render("plaster", 256, 0.35, |u, v| {
        let cloud = fbm(u, v, [4, 4], 4, 71);
        let trowel = fbm(u, v, [12, 20], 3, 72);
        let tone = mix(0.92, 1.06, cloud);
        Texel::new(scaled([0.78, 0.72, 0.62], tone), trowel * 4.0)
    })
}

/// Floor boards along u.
pub fn wood() -> Texture {
    render("wood", 256, 0.3, |u, v| {
        let board = bond(u, v, 1, 8, 0.37);
        let offset = hash(board.id[0], board.id[1], 0, 81);
        let grain = fbm(u + offset, v, [4, 64], 3, 82);
        let rings = fbm(u + offset, v + (fbm(u, v, [3, 8], 2, 85) - 0.5) * 0.06, [2, 32], 2, 84);
        let tone = mix(0.8, 1.15, hash(board.id[0], board.id[1], 1, 83)) * mix(0.8, 1.12, grain);
        let color = blend([0.52, 0.36, 0.22], [0.66, 0.48, 0.31], rings);
        let gap = smooth(0.4, 1.6, board.edge);
        Texel::new(scaled(color, tone * mix(0.4, 1.0, gap)), gap * 2.5 + grain)
    })
}
