//! The metrics against scikit-image and flip-evaluator on image pairs made by formula.
//!
//! `metrics_reference.py` makes the same pairs and writes the expected figures, `data/metrics.json`.

use q3rays::metrics::{ImageRgb, Kind, Metrics, compare};
use std::collections::BTreeMap;

const TOLERANCE: f64 = 1e-4;

/// Hash of (seed, x, y, c) in 0..1.
fn unit(seed: u32, x: usize, y: usize, c: usize) -> f32 {
    let mut h = seed
        .wrapping_mul(1024)
        .wrapping_add(y as u32)
        .wrapping_mul(1024)
        .wrapping_add(x as u32);
    h = h.wrapping_mul(4).wrapping_add(c as u32);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    (h >> 8) as f32 * (1.0 / 16_777_216.0)
}

fn image(width: usize, height: usize, value: impl Fn(usize, usize, usize) -> f32) -> ImageRgb {
    let pixels = (0..width * height)
        .map(|i| [0, 1, 2].map(|c| value(i % width, i / width, c)))
        .collect();
    ImageRgb { width, height, pixels }
}

/// The image with each value replaced by a function of itself and its place.
fn changed(image: &ImageRgb, value: impl Fn(f32, usize, usize, usize) -> f32) -> ImageRgb {
    self::image(image.width, image.height, |x, y, c| {
        value(image.pixels[y * image.width + x][c], x, y, c)
    })
}

/// Ramp, checks, a coloured disc and grain.
fn base(width: usize, height: usize) -> ImageRgb {
    image(width, height, |x, y, c| {
        let mut v = x as f32 / width as f32 * 0.5 + 0.1;
        if (x / 8 + y / 6) % 2 == 1 {
            v *= 0.25 + 0.2 * c as f32;
        }
        if x.abs_diff(width / 2).pow(2) + y.abs_diff(height / 2).pow(2) < (height / 3).pow(2) {
            v *= [1.5, 0.75, 0.25][c];
        }
        v * (0.75 + 0.5 * unit(1, x, y, c))
    })
}

/// 1 in the cells of `size` pixels that the hash picks, one in sixteen, else 0.
fn lamp(seed: u32, size: usize, x: usize, y: usize) -> f32 {
    if unit(seed, x / size, y / size, 0) < 0.0625 {
        1.0
    } else {
        0.0
    }
}

fn noisy(image: &ImageRgb, amount: f32) -> ImageRgb {
    changed(image, |v, x, y, c| v * (1.0 + amount * (unit(2, x, y, c) - 0.5)))
}

fn scaled(image: &ImageRgb, factor: f32) -> ImageRgb {
    changed(image, |v, _, _, _| v * factor)
}

fn clamped(image: &ImageRgb) -> ImageRgb {
    changed(image, |v, _, _, _| v.clamp(0.0, 1.0))
}

fn at(image: &ImageRgb, x: usize, y: usize, c: usize) -> f32 {
    image.pixels[y.min(image.height - 1) * image.width + x.min(image.width - 1)][c]
}

fn shifted(image: &ImageRgb, dx: usize, dy: usize) -> ImageRgb {
    changed(image, |_, x, y, c| at(image, x + dx, y + dy, c))
}

fn blurred(image: &ImageRgb) -> ImageRgb {
    changed(image, |_, x, y, c| {
        let mut total = 0.0;
        for dy in [-1, 0, 1] {
            for dx in [-1, 0, 1] {
                total += at(image, x.saturating_add_signed(dx), y.saturating_add_signed(dy), c);
            }
        }
        total * 0.111
    })
}

struct Pair {
    name: &'static str,
    a: ImageRgb,
    b: ImageRgb,
    kind: Kind,
    mask: Option<Vec<bool>>,
}

fn pairs() -> Vec<Pair> {
    let mut pairs = Vec::new();
    let mut add = |name, a: ImageRgb, b: &ImageRgb, kind| {
        pairs.push(Pair {
            name,
            a,
            b: b.clone(),
            kind,
            mask: None,
        });
    };
    let b = base(64, 48);
    add("equal", b.clone(), &b, Kind::Linear);
    add("noise_weak", noisy(&b, 0.05), &b, Kind::Linear);
    add("noise_middle", noisy(&b, 0.5), &b, Kind::Linear);
    add("noise_strong", noisy(&b, 2.0), &b, Kind::Linear);
    add("shift", shifted(&b, 2, 1), &b, Kind::Linear);
    add("blur", blurred(&b), &b, Kind::Linear);
    add("exposure", scaled(&b, 1.5), &b, Kind::Linear);
    let lit = changed(&b, |v, x, y, _| v + 1500.0 * lamp(3, 4, x, y));
    let fireflies = changed(&noisy(&lit, 0.4), |v, x, y, _| v + 300.0 * lamp(4, 1, x, y));
    add("lamps", fireflies, &lit, Kind::Linear);
    let dim = 1.0 / 4096.0;
    add("dark", scaled(&noisy(&b, 0.7), dim), &scaled(&b, dim), Kind::Linear);

    let odd = base(37, 23);
    let black = changed(&odd, |v, x, _, _| if x % 6 == 0 { v * 0.0 } else { v });
    add("odd_size", noisy(&black, 1.0), &black, Kind::Linear);
    add("odd_size_display", noisy(&odd, 0.6), &odd, Kind::Display);

    let display = clamped(&base(50, 40));
    add("display_noise", clamped(&noisy(&display, 0.2)), &display, Kind::Display);
    add("display_shift", shifted(&display, 1, 3), &display, Kind::Display);
    add(
        "display_contrast",
        changed(&display, |v, _, _, _| v * v),
        &display,
        Kind::Display,
    );
    add("display_blur", blurred(&display), &display, Kind::Display);

    let mut a = noisy(&b, 0.3);
    a.pixels[5 * 64 + 7][1] = f32::NAN;
    a.pixels[20 * 64 + 40][0] = f32::INFINITY;
    a.pixels[47 * 64 + 63][2] = f32::NEG_INFINITY;
    let mask = (0..64 * 48).map(|i| (i % 64 + 2 * (i / 64)) % 5 != 0).collect();
    pairs.push(Pair {
        name: "masked_not_finite",
        a,
        b,
        kind: Kind::Linear,
        mask: Some(mask),
    });
    pairs
}

/// Difference of a figure from the expected one in tolerances: absolute for SSIM and FLIP, relative for the rest.
fn distance(name: &str, found: Option<f64>, expected: Option<f64>) -> f64 {
    match (found, expected) {
        (None, None) => 0.0,
        (Some(found), Some(expected)) => {
            let scale = if ["ssim", "flip"].contains(&name) {
                1.0
            } else {
                expected.abs().max(1e-12)
            };
            (found - expected).abs() / scale / TOLERANCE
        }
        _ => f64::INFINITY,
    }
}

fn figures(m: &Metrics) -> [(&'static str, Option<f64>); 11] {
    [
        ("rel_mse", m.rel_mse),
        ("mean_ratio", m.mean_ratio),
        ("rmse", m.rmse),
        ("mean_a", m.mean_a),
        ("mean_b", m.mean_b),
        ("ssim", m.ssim),
        ("flip", m.flip),
        ("psnr", m.psnr),
        ("max_abs", m.max_abs),
        ("nan_count", Some(m.nan_count as f64)),
        ("rel_mse_trimmed", m.rel_mse_trimmed),
    ]
}

#[test]
fn figures_agree_with_the_reference_implementations() {
    let expected: BTreeMap<String, Metrics> = serde_json::from_str(include_str!("data/metrics.json")).unwrap();
    let pairs = pairs();
    assert_eq!(expected.len(), pairs.len());
    let mut wrong = Vec::new();
    for pair in &pairs {
        let found = compare(&pair.a, &pair.b, pair.kind, pair.mask.as_deref()).unwrap();
        let mut worst = ("", 0.0);
        for ((name, found), (_, expected)) in figures(&found).into_iter().zip(figures(&expected[pair.name])) {
            let distance = distance(name, found, expected);
            if distance > worst.1 {
                worst = (name, distance);
            }
            // A figure is never NaN, so neither is a distance.
            if distance > 1.0 {
                wrong.push(format!("{}: {name} {found:?}, expected {expected:?}", pair.name));
            }
        }
        println!("{:<18} worst {:<16} {:.1e}", pair.name, worst.0, worst.1 * TOLERANCE);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
