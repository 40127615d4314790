//! Texture images: TGA, JPEG and PNG with mip levels built in linear light.

use super::vfs::FileSource;
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::sync::LazyLock;

/// Formats in the order in which the game looks for a name without (or with a missing) extension.
const FORMATS: [(&str, ImageFormat); 4] = [
    ("tga", ImageFormat::Tga),
    ("jpg", ImageFormat::Jpeg),
    ("jpeg", ImageFormat::Jpeg),
    ("png", ImageFormat::Png),
];
/// Largest edge that is decoded, in pixels.
const MAX_EDGE: u32 = 16_384;
/// Edge of the checker that stands in for a missing image, in pixels.
const CHECKER: u32 = 16;

/// Decoded image: RGBA8, colour sRGB-encoded, alpha linear and not premultiplied.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The name it was asked for by.
    pub name: String,
    pub width: u32,
    pub height: u32,
    /// Mip levels, level 0 first, row by row from the top; each is half the one before, rounded down, at least 1.
    pub levels: Vec<Vec<[u8; 4]>>,
    /// Mean of the encoded bytes of level 0 over 255.
    pub mean_encoded: [f32; 3],
    /// Mean of level 0 in linear light.
    pub mean_linear: [f32; 3],
    /// No image was found under this name: this is the checker.
    pub missing: bool,
}

/// sRGB byte → linear 0..1 (IEC 61966-2-1).
pub static SRGB_TO_LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| decode_srgb(i as f32 / 255.0)));

/// sRGB-encoded 0..1 → linear 0..1.
pub fn decode_srgb(x: f32) -> f32 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear 0..1 → sRGB-encoded 0..1.
pub fn encode_srgb(x: f32) -> f32 {
    if x <= 0.003_130_8 {
        x * 12.92
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

impl Texture {
    /// A texture from level 0; the other levels and the means are computed.
    pub fn new(name: &str, width: u32, height: u32, pixels: Vec<[u8; 4]>) -> Self {
        let table = &*SRGB_TO_LINEAR;
        let (mut encoded, mut linear) = ([0f64; 3], [0f64; 3]);
        for p in &pixels {
            for c in 0..3 {
                encoded[c] += f64::from(p[c]);
                linear[c] += f64::from(table[usize::from(p[c])]);
            }
        }
        let n = pixels.len().max(1) as f64;
        let mut levels = vec![pixels];
        let (mut w, mut h) = (width, height);
        while w > 1 || h > 1 {
            let next = halve(&levels[levels.len() - 1], w, h);
            (w, h) = ((w / 2).max(1), (h / 2).max(1));
            levels.push(next);
        }
        Self {
            name: name.to_owned(),
            width,
            height,
            levels,
            mean_encoded: encoded.map(|s| (s / n / 255.0) as f32),
            mean_linear: linear.map(|s| (s / n) as f32),
            missing: false,
        }
    }

    /// One colour, encoded bytes.
    pub fn solid(name: &str, rgba: [u8; 4]) -> Self {
        Self::new(name, 1, 1, vec![rgba])
    }

    /// The stand-in for a missing image: magenta and dark grey squares.
    pub fn checker(name: &str) -> Self {
        let pixels = (0..CHECKER * CHECKER)
            .map(|i| {
                let odd = (i % CHECKER / 8 + i / CHECKER / 8) % 2 == 1;
                if odd { [200, 0, 200, 255] } else { [40, 40, 40, 255] }
            })
            .collect();
        Self {
            missing: true,
            ..Self::new(name, CHECKER, CHECKER, pixels)
        }
    }

    /// Size of a level in pixels.
    pub fn level_size(&self, level: usize) -> (u32, u32) {
        ((self.width >> level).max(1), (self.height >> level).max(1))
    }

    /// Whether any texel is not fully opaque.
    pub fn has_alpha(&self) -> bool {
        self.levels[0].iter().any(|p| p[3] != 255)
    }
}

/// The next mip level: every texel is the area mean, in linear light, of what it covers (odd edges included).
fn halve(from: &[[u8; 4]], w: u32, h: u32) -> Vec<[u8; 4]> {
    let table = &*SRGB_TO_LINEAR;
    let (nw, nh) = ((w / 2).max(1), (h / 2).max(1));
    let mut out = Vec::with_capacity((nw * nh) as usize);
    // With an odd edge the windows overlap by a part of a texel: three texels with weights that slide along the edge.
    let taps = |i: u32, n: u32, old: u32| -> [(u32, f32); 3] {
        if old == 1 {
            [(0, 1.0), (0, 0.0), (0, 0.0)]
        } else if old.is_multiple_of(2) {
            [(2 * i, 0.5), (2 * i + 1, 0.5), (0, 0.0)]
        } else {
            let (n, i_f, total) = (n as f32, i as f32, old as f32);
            [
                (2 * i, (n - i_f) / total),
                (2 * i + 1, n / total),
                (2 * i + 2, (i_f + 1.0) / total),
            ]
        }
    };
    for y in 0..nh {
        for x in 0..nw {
            let (mut rgb, mut alpha) = ([0f32; 3], 0f32);
            for (ty, wy) in taps(y, nh, h) {
                for (tx, wx) in taps(x, nw, w) {
                    let weight = wx * wy;
                    if weight == 0.0 {
                        continue;
                    }
                    let p = from[(ty * w + tx) as usize];
                    for c in 0..3 {
                        rgb[c] += weight * table[usize::from(p[c])];
                    }
                    alpha += weight * f32::from(p[3]);
                }
            }
            let byte = |x: f32| (x + 0.5).clamp(0.0, 255.0) as u8;
            let [r, g, b] = rgb.map(|x| byte(encode_srgb(x) * 255.0));
            out.push([r, g, b, byte(alpha)]);
        }
    }
    out
}

/// Decodes one image file's bytes.
///
/// # Errors
/// The decoder's message.
pub fn decode(name: &str, bytes: &[u8], format: ImageFormat) -> Result<Texture, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_EDGE);
    limits.max_image_height = Some(MAX_EDGE);
    reader.limits(limits);
    let rgba = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    let (w, h) = rgba.dimensions();
    if w == 0 || h == 0 {
        return Err("the image is empty".to_owned());
    }
    Ok(Texture::new(name, w, h, rgba.pixels().map(|p| p.0).collect()))
}

/// Loads the image that a script calls `name`: with its own extension first, then with the other formats'.
/// `Ok(None)` where there is none.
///
/// # Errors
/// One sentence where a file exists and cannot be decoded.
pub fn load(files: &dyn FileSource, name: &str) -> Result<Option<Texture>, String> {
    let stem = match name.rsplit_once('.') {
        Some((stem, extension)) if !extension.contains('/') => stem,
        _ => name,
    };
    let own = name.rsplit_once('.').map(|(_, e)| e.to_ascii_lowercase());
    let mut formats = FORMATS.to_vec();
    formats.sort_by_key(|(extension, _)| own.as_deref() != Some(*extension));
    for (extension, format) in formats {
        let path = format!("{stem}.{extension}");
        match files.read(&path) {
            Ok(Some(bytes)) => {
                return decode(name, &bytes, sniff(&bytes, format))
                    .map(Some)
                    .map_err(|e| format!("cannot decode {path}: {e}"));
            }
            Ok(None) => {}
            Err(e) => return Err(e.to_string()),
        }
    }
    Ok(None)
}

/// Some paks hold files under a wrong extension: the magic number decides where there is one.
fn sniff(bytes: &[u8], named: ImageFormat) -> ImageFormat {
    match bytes {
        [0xff, 0xd8, 0xff, ..] => ImageFormat::Jpeg,
        [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
        _ => named,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mips_keep_the_linear_mean_at_odd_sizes() {
        let (w, h) = (13u32, 6u32);
        let pixels: Vec<[u8; 4]> = (0..w * h)
            .map(|i| {
                [
                    ((i * 97) % 256) as u8,
                    ((i * 31) % 256) as u8,
                    128,
                    ((i * 7) % 256) as u8,
                ]
            })
            .collect();
        let t = Texture::new("t", w, h, pixels);
        assert_eq!(t.level_size(1), (6, 3));
        assert_eq!(t.levels.last().map(Vec::len), Some(1));
        let last = t.levels[t.levels.len() - 1][0];
        for c in 0..3 {
            let linear = SRGB_TO_LINEAR[usize::from(last[c])];
            assert!((linear - t.mean_linear[c]).abs() < 0.01, "channel {c}");
        }
    }

    #[test]
    fn srgb_round_trips() {
        for i in 0..=255u8 {
            let x = encode_srgb(SRGB_TO_LINEAR[usize::from(i)]) * 255.0;
            assert_eq!(x.round() as u8, i);
        }
    }

    #[test]
    fn damaged_images_are_errors() {
        for format in [ImageFormat::Tga, ImageFormat::Jpeg, ImageFormat::Png] {
            assert!(decode("x", b"not an image", format).is_err());
            assert!(decode("x", &[], format).is_err());
        }
    }
}
