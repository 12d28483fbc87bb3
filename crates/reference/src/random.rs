//! Random numbers: one generator a sample, so that a picture does not depend on the order of its samples.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// A stream of random numbers \[ONeill14\].
#[derive(Clone, Debug)]
pub struct Random(Pcg64Mcg);

impl Random {
    /// The stream of one sample of one pixel: the same arguments give the same numbers, different ones give
    /// independent numbers. `seed` tells whole pictures apart.
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let low = mix(mix(mix(seed) ^ pixel) ^ sample);
        let high = mix(low ^ 0x6a09_e667_f3bc_c909);
        Self(Pcg64Mcg::new(u128::from(high) << 64 | u128::from(low)))
    }

    /// Uniform in [0, 1).
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Exponentially distributed with mean 1, finite: an optical depth between collisions.
    #[inline]
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.uniform()).ln()
    }
}

/// A bijection of 64 bits without visible structure: the finaliser of SplitMix64 [Steele14].
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
