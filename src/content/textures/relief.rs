//! From a description of each point to pixels: colour and height, shaded as relief.

use super::noise::smooth;

/// A finished texture, RGBA8, row by row from the top; colour is sRGB-encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Path in the game folder without extension.
    pub name: String,
    /// Edge length, pixels.
    pub side: usize,
    pub rgba: Vec<u8>,
}

/// One point of a texture before shading.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    /// Encoded colour, 0..1.
    pub color: [f32; 3],
    /// Height in pixels above the ground.
    pub height: f32,
    pub alpha: f32,
}

impl Texel {
    /// An opaque point.
    pub fn new(color: [f32; 3], height: f32) -> Self {
        Self {
            color,
            height,
            alpha: 1.0,
        }
    }
}

/// Evaluates `point` at all pixel centres (u, v in 0..1, v down), and shades slopes as if light came from the upper left.
/// `depth` scales the shading. Tiles wherever `point` does.
pub fn render(name: &str, side: usize, depth: f32, point: impl Fn(f32, f32) -> Texel) -> Texture {
    let centre = |i: usize| (i as f32 + 0.5) / side as f32;
    let texels: Vec<Texel> = (0..side * side)
        .map(|i| point(centre(i % side), centre(i / side)))
        .collect();
    let height = |x: usize, y: usize| texels[(y % side) * side + x % side].height;
    let mut rgba = Vec::with_capacity(side * side * 4);
    for (i, texel) in texels.iter().enumerate() {
        let (x, y) = (i % side, i / side);
        let dx = height(x + 1, y) - height(x + side - 1, y);
        let dy = height(x, y + 1) - height(x, y + side - 1);
        let slope = (dx * 0.6 + dy * 0.8) * 0.5 * depth;
        let shade = (1.0 + slope).clamp(0.45, 1.5);
        rgba.extend(texel.color.map(|c| byte(c * shade)));
        rgba.push(byte(texel.alpha));
    }
    Texture {
        name: format!("textures/showcase/{name}"),
        side,
        rgba,
    }
}

/// Bytes in steps of two: half the noise for the PNG to hold, and no eye sees it.
fn byte(value: f32) -> u8 {
    let v = (value.clamp(0.0, 1.0) * 127.0 + 0.5) as u8;
    v * 2 + u8::from(v == 127)
}

/// Colour scaled in brightness.
pub fn scaled(color: [f32; 3], by: f32) -> [f32; 3] {
    color.map(|c| c * by)
}

/// Colour between two.
pub fn blend(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    [0, 1, 2].map(|i| super::noise::mix(a[i], b[i], t))
}

/// A cell of a running bond or plain grid.
pub struct Brick {
    /// Whole numbers that name the cell within the tile.
    pub id: [i32; 2],
    /// Pixels (of a 256-pixel tile) to the nearest edge.
    pub edge: f32,
    /// Place within the cell, 0..1.
    pub at: [f32; 2],
}

/// The cell of a point in a grid of `columns` x `rows`; every other row is shifted by `shift` of a column.
pub fn bond(u: f32, v: f32, columns: i32, rows: i32, shift: f32) -> Brick {
    let y = v * rows as f32;
    let row = y.floor();
    let x = u * columns as f32 + if row as i32 % 2 == 1 { shift } else { 0.0 };
    let column = x.floor();
    let (fx, fy) = (x - column, y - row);
    let (width, height) = (256.0 / columns as f32, 256.0 / rows as f32);
    let edge = (fx.min(1.0 - fx) * width).min(fy.min(1.0 - fy) * height);
    Brick {
        id: [(column as i32).rem_euclid(columns), row as i32],
        edge,
        at: [fx, fy],
    }
}

/// Height of a bevelled block: 0 in the joint, `top` beyond the bevel.
pub fn bevel(edge: f32, joint: f32, width: f32, top: f32) -> f32 {
    smooth(joint, joint + width, edge) * top
}
