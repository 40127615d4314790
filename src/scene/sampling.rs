//! Addressable random numbers, the same bits as `shaders/include/random.glsl`.
//!
//! A number is addressed by (seed, pixel, dimension, sample index). Dimensions are handed out here, two at a time, and no
//! two uses share one. [`Sequence::Sobol`] is the (0,2)-sequence with Owen scrambling by hashing (Burley 2020, "Practical
//! Hash-based Owen Scrambling"), independently scrambled and shuffled per pixel and dimension pair; [`Sequence::Random`]
//! is white noise by the PCG hash (Jarzynski and Olano 2020).

use glam::Vec3;

/// Which kind of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Sequence {
    Random = 0,
    Sobol = 1,
}

/// Sub-pixel position.
pub const DIM_PIXEL: u32 = 0;
/// Position on the lens.
pub const DIM_LENS: u32 = 1;
/// Time within the shutter.
pub const DIM_SHUTTER: u32 = 2;
/// Which of a lit layer and what is behind it is shaded, at the i-th layer.
pub const DIM_LAYER: u32 = 0x4000;
/// Direction of light that a lobe reflects, at the i-th branch of a path.
pub const DIM_LOBE: u32 = 0x5000;
/// Whether the i-th branch of a path is followed, on the GPU in frames that are shown as they come.
pub const DIM_BRANCH: u32 = 0x7000;
/// Choice of the light that a lobe is lit by.
pub const DIM_LOBE_PICK: u32 = 0x6000;
/// Position on it.
pub const DIM_LOBE_POINT: u32 = 0x6001;
/// Choice of the i-th random light, 64 of them.
pub const DIM_LIGHT_PICK: u32 = 16;
/// Position on the i-th random light, 64 of them.
pub const DIM_LIGHT_POINT: u32 = 80;
/// Most lights chosen at random per receiver.
pub const MAX_RANDOM_LIGHTS: u32 = 64;
/// Choice of the candidates for the i-th random light, and which of them is kept.
pub const DIM_CANDIDATE_PICK: u32 = 0x1000;
/// Position on them, the same for all.
pub const DIM_CANDIDATE_POINT: u32 = 0x2000;
/// Most candidates per random light, each of which has a number that decides whether it is kept.
pub const MAX_CANDIDATES: u32 = 32;
/// Reuse of samples: whether the old one is taken; then which neighbours are asked, four of them, and whether theirs are
/// taken.
pub const DIM_REUSE: u32 = 0x3000;
/// Which candidate is kept where samples are reused.
pub const DIM_REUSE_KEEP: u32 = 0x3100;
/// Position on light number i when all lights are sampled; everything from here up belongs to it.
pub const DIM_EVERY_LIGHT: u32 = 0x1_0000;

/// PCG output permutation of a 32-bit state.
pub const fn pcg(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Hash of the address without the sample index. `pixel` = x + y·65536.
pub const fn key(seed: u32, pixel: u32, dimension: u32) -> u32 {
    pcg(pixel.wrapping_add(pcg(dimension.wrapping_add(pcg(seed)))))
}

/// Laine–Karras permutation: an Owen scramble of bit-reversed numbers.
const fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x
}

/// Second dimension of the Sobol sequence, with its bits reversed. Its matrix is Pascal's triangle modulo 2: bit j is the sum of
/// the index's bits k of which C(k, j) is odd, those whose k has all ones of j (Lucas).
const fn sobol1_reversed(index: u32) -> u32 {
    let mut x = index;
    x ^= x >> 16 & 0x0000_ffff;
    x ^= x >> 8 & 0x00ff_00ff;
    x ^= x >> 4 & 0x0f0f_0f0f;
    x ^= x >> 2 & 0x3333_3333;
    x ^= x >> 1 & 0x5555_5555;
    x
}

/// 24 bits → [0, 1), never 1.
pub fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Two numbers of 32 random bits of sample `index` under a [`key`].
pub fn bits2(sequence: Sequence, key: u32, index: u32) -> [u32; 2] {
    match sequence {
        Sequence::Random => {
            let a = pcg(key ^ pcg(index));
            [a, pcg(a ^ key.rotate_left(16))]
        }
        Sequence::Sobol => {
            let shuffled = laine_karras(index.reverse_bits(), key).reverse_bits();
            let x = laine_karras(shuffled, pcg(key ^ 0x68bc_21eb));
            let y = laine_karras(sobol1_reversed(shuffled), pcg(key ^ 0x02e5_be93));
            [x.reverse_bits(), y.reverse_bits()]
        }
    }
}

/// The `part`-th of numbers that stratify 32 random bits: it lies in that part of all 32-bit numbers, and all of the numbers together
/// come to each equally often.
pub const fn stratified(bits: u32, part: u32, parts: u32) -> u32 {
    // (part·2³² + bits) / parts in 32 bits.
    let (whole, rest) = (
        (0u32.wrapping_sub(parts) / parts).wrapping_add(1),
        0u32.wrapping_sub(parts) % parts,
    );
    part.wrapping_mul(whole) + bits / parts + (part * rest + bits % parts) / parts
}

/// Bits that decide whether the `c`-th candidate is kept, of those for all; the first is kept whatever they are.
pub const fn keep_bits(bits: u32, c: u32) -> u32 {
    if c < 2 { bits } else { pcg(bits.wrapping_add(c)) }
}

/// Two numbers in [0, 1) of sample `index` under a [`key`].
pub fn sample2(sequence: Sequence, key: u32, index: u32) -> [f32; 2] {
    bits2(sequence, key, index).map(unit)
}

/// Uniform point in the unit disc from two numbers (concentric map of Shirley and Chiu 1997).
pub fn disc([u, v]: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    let (r, phi) = if a.abs() > b.abs() {
        (a, std::f32::consts::FRAC_PI_4 * (b / a))
    } else {
        (b, std::f32::consts::FRAC_PI_2 - std::f32::consts::FRAC_PI_4 * (a / b))
    };
    [r * phi.cos(), r * phi.sin()]
}

/// Barycentric weights of the second and third vertex, uniform over the triangle (Heitz 2019, "A Low-Distortion Map
/// Between Triangle and Square").
pub fn triangle([u, v]: [f32; 2]) -> [f32; 2] {
    if v > u {
        let x = u * 0.5;
        [x, v - x]
    } else {
        let y = v * 0.5;
        [u - y, y]
    }
}

/// Orthonormal tangents of a unit vector (Duff et al. 2017).
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimension_ranges_are_disjoint() {
        let ranges = [
            DIM_PIXEL..DIM_PIXEL + 1,
            DIM_LENS..DIM_LENS + 1,
            DIM_SHUTTER..DIM_SHUTTER + 1,
            DIM_LIGHT_PICK..DIM_LIGHT_PICK + MAX_RANDOM_LIGHTS,
            DIM_LIGHT_POINT..DIM_LIGHT_POINT + MAX_RANDOM_LIGHTS,
            DIM_CANDIDATE_PICK..DIM_CANDIDATE_PICK + MAX_RANDOM_LIGHTS,
            DIM_CANDIDATE_POINT..DIM_CANDIDATE_POINT + MAX_RANDOM_LIGHTS,
            DIM_EVERY_LIGHT..u32::MAX,
        ];
        for pair in ranges.windows(2) {
            assert!(pair[0].end <= pair[1].start);
        }
    }

    /// Against the definition by direction numbers, v ← v ⊕ v/2.
    #[test]
    fn the_second_dimension_is_that_of_sobol() {
        for index in (0..4096u32).chain((0..32).map(|b| 0x9e37_79b9u32.rotate_left(b))) {
            let (mut v, mut x) = (1u32 << 31, 0);
            for bit in 0..32 {
                x ^= v * (index >> bit & 1);
                v ^= v >> 1;
            }
            assert_eq!(sobol1_reversed(index), x.reverse_bits());
        }
    }

    #[test]
    fn strata_divide_all_numbers() {
        for parts in 1..=MAX_CANDIDATES {
            for part in 0..parts {
                for bits in [0, 1, parts - 1, 12_345_678, u32::MAX - 1, u32::MAX] {
                    let wanted = ((u64::from(part) << 32) + u64::from(bits)) / u64::from(parts);
                    assert_eq!(u64::from(stratified(bits, part, parts)), wanted);
                }
            }
        }
    }

    #[test]
    fn sobol_points_fill_every_elementary_interval() {
        for dimension in 0..50 {
            let k = key(7, 1234, dimension);
            for (across, down) in [(16u32, 16u32), (256, 1), (1, 256), (4, 64)] {
                let mut seen = vec![0; 256];
                for index in 0..256 {
                    let [x, y] = sample2(Sequence::Sobol, k, index);
                    seen[((x * across as f32) as u32 * down + (y * down as f32) as u32) as usize] += 1;
                }
                assert!(seen.iter().all(|&n| n == 1), "{across} x {down}");
            }
        }
    }

    #[test]
    fn white_noise_is_uniform_and_below_one() {
        let mut bins = [0u32; 64];
        let n = 200_000;
        for index in 0..n {
            let [x, y] = sample2(Sequence::Random, key(1, 99, 3), index);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            bins[((x * 8.0) as usize) * 8 + (y * 8.0) as usize] += 1;
        }
        assert!(chi_square(&bins, f64::from(n)) < CHI_63);
        assert!(unit(u32::MAX) < 1.0);
    }

    #[test]
    fn triangle_samples_are_uniform() {
        // Equal-area cells: the triangle cut into 64 similar ones, by the barycentric grid.
        for sequence in [Sequence::Random, Sequence::Sobol] {
            let mut bins = [0u32; 64];
            let n = 100_000;
            for index in 0..n {
                let [a, b] = triangle(sample2(sequence, key(3, 5, 80), index));
                assert!(a >= 0.0 && b >= 0.0 && a + b <= 1.0);
                let (i, j) = ((a * 8.0) as usize, (b * 8.0) as usize);
                let upper = usize::from((a * 8.0).fract() + (b * 8.0).fract() > 1.0);
                // Row i of the grid holds 15 − 2 i cells.
                let before: usize = (0..i).map(|r| 15 - 2 * r).sum();
                bins[before + 2 * j + upper] += 1;
            }
            assert!(chi_square(&bins, f64::from(n)) < CHI_63, "{sequence:?}");
        }
    }

    /// Chi-square with 63 degrees of freedom is exceeded with probability 1e-3 beyond this.
    const CHI_63: f64 = 103.4;

    fn chi_square(bins: &[u32], n: f64) -> f64 {
        let expected = n / bins.len() as f64;
        bins.iter().map(|&b| (f64::from(b) - expected).powi(2) / expected).sum()
    }
}
