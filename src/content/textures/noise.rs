//! Repeatable value noise, by integer hashes and basic arithmetic only, so that every machine makes the same bytes.

/// A number in 0..1 for a lattice point.
pub fn hash(x: i32, y: i32, z: i32, seed: u32) -> f32 {
    let mut h = seed.wrapping_mul(0x9e37_79b9);
    for v in [x, y, z] {
        h = (h ^ v as u32).wrapping_mul(0x85eb_ca6b);
        h ^= h >> 15;
        h = h.wrapping_mul(0xc2b2_ae35);
        h ^= h >> 13;
    }
    (h >> 8) as f32 / (1 << 24) as f32
}

/// Smooth step from 0 below `from` to 1 above `to`.
pub fn smooth(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// `a` to `b` by `t`.
pub fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Value noise in 0..1 over a lattice that repeats every `period` cells; `u`, `v` in 0..1 cover one period.
pub fn value(u: f32, v: f32, period: [i32; 2], seed: u32) -> f32 {
    let (x, y) = (u * period[0] as f32, v * period[1] as f32);
    let (ix, iy) = (x.floor(), y.floor());
    let (fx, fy) = (smooth(0.0, 1.0, x - ix), smooth(0.0, 1.0, y - iy));
    let at = |dx: i32, dy: i32| {
        let wrap = |i: f32, d: i32, p: i32| (i as i32 + d).rem_euclid(p);
        hash(wrap(ix, dx, period[0]), wrap(iy, dy, period[1]), 0, seed)
    };
    mix(mix(at(0, 0), at(1, 0), fx), mix(at(0, 1), at(1, 1), fx), fy)
}

/// Sum of octaves of [`value`], each twice as fine and half as strong, in 0..1.
pub fn fbm(u: f32, v: f32, period: [i32; 2], octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..octaves {
        let scale = 1 << octave;
        sum += weight * value(u, v, [period[0] * scale, period[1] * scale], seed + octave);
        total += weight;
        weight *= 0.5;
    }
    sum / total
}

/// Octaves of value noise in space, in 0..1 (for the sky, which has no seams that way).
pub fn fbm3(p: [f32; 3], octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total, mut scale) = (0.0, 1.0, 0.0, 1.0);
    for octave in 0..octaves {
        sum += weight * value3(p.map(|c| c * scale), seed + octave);
        total += weight;
        weight *= 0.5;
        scale *= 2.0;
    }
    sum / total
}

fn value3(p: [f32; 3], seed: u32) -> f32 {
    let i = p.map(f32::floor);
    let f = [0, 1, 2].map(|a| smooth(0.0, 1.0, p[a] - i[a]));
    let at = |dx: i32, dy: i32, dz: i32| hash(i[0] as i32 + dx, i[1] as i32 + dy, i[2] as i32 + dz, seed);
    let layer = |dz: i32| {
        mix(
            mix(at(0, 0, dz), at(1, 0, dz), f[0]),
            mix(at(0, 1, dz), at(1, 1, dz), f[0]),
            f[1],
        )
    };
    mix(layer(0), layer(1), f[2])
}
