//! Random numbers by address. A stream is a pure function of its address (seed, pixel, sample, ...), so that any path
//! can be replayed alone, and an image does not depend on the timing of threads.

use glam::DVec2;
use rand_core::Rng as _;
use rand_pcg::Pcg64Mcg;

/// Stafford's variant 13 of the 64-bit finaliser of MurmurHash3, the mixer of SplitMix64: a bijection under which
/// every bit of the input changes every bit of the output with probability one half.
#[inline]
#[must_use]
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A hash of a sequence of integers. Sequences that differ in an element or in their order have unrelated hashes.
#[inline]
#[must_use]
pub fn hash(parts: &[u64]) -> u64 {
    parts
        .iter()
        .fold(0x9e37_79b9_7f4a_7c15, |h, &part| mix(h.rotate_left(23).wrapping_add(0x9e37_79b9_7f4a_7c15) ^ mix(part)))
}

/// A stream of uniform random numbers that belongs to an address.
#[derive(Clone, Debug)]
pub struct Stream(Pcg64Mcg);

impl Stream {
    /// The stream of an address, for example `[seed, replicate, pixel, sample]`.
    #[inline]
    #[must_use]
    pub fn at(address: &[u64]) -> Self {
        let high = hash(address);
        Self(Pcg64Mcg::new(u128::from(high) << 64 | u128::from(mix(high ^ 0x6a09_e667_f3bc_c909))))
    }

    /// The next number, uniform on [0, 1): a multiple of 2⁻⁵³.
    #[inline]
    pub fn next_1d(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * 2.0_f64.powi(-53)
    }

    /// The next point, uniform on the unit square.
    #[inline]
    pub fn next_2d(&mut self) -> DVec2 {
        DVec2::new(self.next_1d(), self.next_1d())
    }

    /// The next 64 random bits.
    pub fn next_bits(&mut self) -> u64 {
        self.0.next_u64()
    }
}

/// The element at `index` of a random permutation of `0..length`, which `seed` selects.
/// Kensler 2013, "Correlated Multi-Jittered Sampling", Pixar technical memo 13-01: a hash that is a bijection on the
/// next power of two, repeated until its value is below `length`.
#[must_use]
pub fn permute(mut index: u32, length: u32, seed: u32) -> u32 {
    debug_assert!(index < length);
    let mask = length.next_power_of_two() - 1;
    loop {
        index ^= seed;
        index = index.wrapping_mul(0xe170_893d);
        index ^= seed >> 16;
        index ^= (index & mask) >> 4;
        index ^= seed >> 8;
        index = index.wrapping_mul(0x0929_eb3f);
        index ^= seed >> 23;
        index ^= (index & mask) >> 1;
        index = index.wrapping_mul(1 | seed >> 27);
        index = index.wrapping_mul(0x6935_fa69);
        index ^= (index & mask) >> 11;
        index = index.wrapping_mul(0x74dc_b303);
        index ^= (index & mask) >> 2;
        index = index.wrapping_mul(0x9e50_1cc3);
        index ^= (index & mask) >> 2;
        index = index.wrapping_mul(0xc860_a3df);
        index &= mask;
        index ^= index >> 5;
        if index < length {
            return (index.wrapping_add(seed)) % length;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    #[test]
    fn neighbouring_addresses_give_unrelated_streams() {
        let mut first = HashSet::new();
        for seed in 0..4 {
            for pixel in 0..32 {
                for sample in 0..32 {
                    assert!(first.insert(Stream::at(&[seed, 0, pixel, sample]).next_bits()));
                }
            }
        }
    }

    #[test]
    fn the_mean_over_addresses_is_one_half() {
        let n = 100_000;
        let mean = (0..n).map(|i| Stream::at(&[7, 0, i, 0]).next_1d()).sum::<f64>() / n as f64;
        // Four standard errors of a uniform mean, sqrt(1/12/n).
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0 / n as f64).sqrt(), "{mean}");
    }

    proptest! {
        #[test]
        fn permute_maps_indices_one_to_one(length in 1u32..200, seed: u32) {
            let images: HashSet<u32> = (0..length).map(|i| permute(i, length, seed)).collect();
            prop_assert_eq!(images.len() as u32, length);
            prop_assert!(images.iter().all(|&i| i < length));
        }
    }
}
