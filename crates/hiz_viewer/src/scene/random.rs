//! Random numbers that are the same on every machine, and smooth noise made of them.

/// `SplitMix64` (Steele, Lea and Flood, Fast splittable pseudorandom number generators, 2014).
#[derive(Debug, Clone)]
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        mixed(self.0)
    }

    /// A number in `low..high`.
    pub(super) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// One of 0, 1, ... below `count`.
    pub(super) fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }
}

fn mixed(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A direction in the plane for each corner of the unit grid.
fn gradient(i: i64, j: i64, seed: u64) -> [f64; 2] {
    let key = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (j as u64).rotate_left(32) ^ seed;
    let turn = (mixed(mixed(key)) >> 11) as f64 / (1_u64 << 53) as f64 * std::f64::consts::TAU;
    [turn.cos(), turn.sin()]
}

/// Gradient noise in about -1..1 (Perlin, An image synthesizer, 1985).
pub(super) fn noise(x: f64, z: f64, seed: u64) -> f64 {
    let (i, j) = (x.floor(), z.floor());
    let (u, v) = (x - i, z - j);
    let smooth = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    let corner = |a: i64, b: i64| {
        let [gx, gz] = gradient(i as i64 + a, j as i64 + b, seed);
        gx * (u - a as f64) + gz * (v - b as f64)
    };
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    let (s, t) = (smooth(u), smooth(v));
    let [low, high] = [0, 1].map(|b| mix(corner(0, b), corner(1, b), s));
    1.5 * mix(low, high, t)
}
