//! Sums in fixed point, where addition is associative: every order, grouping and sharding gives bit-identical results.
//!
//! Each number is rounded once, to the nearest multiple of the quantum (ties away from 0). All further arithmetic is
//! exact on integers, as in Demmel and Nguyen 2015, "Parallel reproducible summation", but with one wide bin, because
//! radiance has a known range. A sum that overflows stays saturated, and reports it.

use serde::{Deserialize, Serialize};

/// The quantum of a sum is 2^-64 (5.4e-20).
const SUM_FRACTION_BITS: i32 = 64;
/// The quantum of a sum of squares is 2^-70 (8.5e-22).
const SQUARE_FRACTION_BITS: i32 = 70;
/// Bits of an f64 mantissa below the leading one.
const MANTISSA_BITS: i32 = 52;
/// Exponent bias of f64, counted from the last bit of the mantissa.
const EXPONENT_BIAS: i32 = 1023 + MANTISSA_BITS;

/// A sum of numbers in ±2^63 (±9.2e18), exact in units of 2^-64.
///
/// Each addend is rounded to the nearest unit, with ties away from 0. An f64 of magnitude 2^-12 or more is exact. A sum
/// that leaves the range stays saturated, and its value is infinite. For addends of one sign, saturation does not
/// depend on the order. For mixed signs, it does not as long as no partial sum leaves the range.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExactSum {
    quanta: i128,
}

impl ExactSum {
    /// Adds `x`, which must be finite; a debug assertion checks this. Without debug assertions, any other value
    /// saturates the sum in the direction of its sign bit (NaN too), so that it is visible in the result.
    #[inline]
    pub fn add(&mut self, x: f64) {
        debug_assert!(x.is_finite(), "only finite numbers can be summed, got {x}");
        let (mantissa, exponent) = decompose(x);
        let magnitude = scale::<53>(u128::from(mantissa), exponent + SUM_FRACTION_BITS);
        let magnitude = i128::try_from(magnitude).unwrap_or(i128::MAX);
        self.join(if x.is_sign_negative() { -magnitude } else { magnitude });
    }

    /// Adds all numbers that were added to `other`.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        self.join(other.quanta);
    }

    /// The sum, correctly rounded; ±infinity if it is saturated.
    #[must_use]
    pub fn value(&self) -> f64 {
        if self.is_saturated() {
            return f64::INFINITY.copysign(self.quanta.signum() as f64);
        }
        self.quanta as f64 * exp2(-SUM_FRACTION_BITS)
    }

    /// Whether the sum ever left ±2^63, or a number that is not finite was added.
    #[must_use]
    #[inline]
    pub fn is_saturated(&self) -> bool {
        self.quanta.unsigned_abs() >= i128::MAX.unsigned_abs()
    }

    #[inline]
    fn join(&mut self, quanta: i128) {
        // Numbers in ±2^126 have equal top two bits. Two of them are not saturated, and their sum does not overflow.
        let is_small = |quanta: i128| quanta >> 127 == quanta >> 126;
        if is_small(self.quanta) && is_small(quanta) {
            self.quanta += quanta;
        } else if !self.is_saturated() {
            let other = Self { quanta };
            self.quanta = if other.is_saturated() { quanta } else { self.quanta.saturating_add(quanta) };
        }
    }
}

/// Exact count, sum and sum of squares of a stream of numbers: a replacement for [`Moments`] whose merges commute bit
/// for bit.
///
/// Each square is computed exactly and then rounded once to a multiple of 2^-70. The absolute resolution of a standard
/// deviation is therefore about 2e-11: a constant 0.1 may have a variance of 1e-22 instead of 0. The sum of squares
/// saturates above 2^58 (one number of 5e8, or 1e9 numbers of 1.7e4).
///
/// [`Moments`]: super::Moments
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExactMoments {
    n: u64,
    sum: ExactSum,
    sum_sq: u128,
}

impl ExactMoments {
    /// Adds one finite number; [`ExactSum::add`] describes the effect of others.
    #[inline]
    pub fn push(&mut self, x: f64) {
        self.n += 1;
        self.sum.add(x);
        let (mantissa, exponent) = decompose(x);
        let square = u128::from(mantissa) * u128::from(mantissa);
        let square = scale::<106>(square, 2 * exponent + SQUARE_FRACTION_BITS);
        self.sum_sq = self.sum_sq.saturating_add(square);
    }

    /// Adds `count` zeros, for samples without a contribution.
    #[inline]
    pub fn push_zeros(&mut self, count: u64) {
        self.n += count;
    }

    /// Adds all numbers that were pushed to `other`.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum.merge(&other.sum);
        self.sum_sq = self.sum_sq.saturating_add(other.sum_sq);
    }

    /// The number of bytes of [`Self::to_bytes`].
    pub const BYTES: usize = 40;

    /// Encodes the count, the sum in units of 2^-64 and the sum of squares in units of 2^-70, in little endian.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[..8].copy_from_slice(&self.n.to_le_bytes());
        bytes[8..24].copy_from_slice(&self.sum.quanta.to_le_bytes());
        bytes[24..].copy_from_slice(&self.sum_sq.to_le_bytes());
        bytes
    }

    /// Decodes the bytes of [`Self::to_bytes`].
    #[must_use]
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let part = |from: usize| std::array::from_fn(|i| bytes[from + i]);
        let n = u64::from_le_bytes(std::array::from_fn(|i| bytes[i]));
        let sum = ExactSum { quanta: i128::from_le_bytes(part(8)) };
        Self { n, sum, sum_sq: u128::from_le_bytes(part(24)) }
    }

    /// The number of numbers that were pushed.
    #[must_use]
    pub fn n(&self) -> u64 {
        self.n
    }

    /// Whether the sum or the sum of squares left its range.
    #[must_use]
    pub fn is_saturated(&self) -> bool {
        self.sum.is_saturated() || self.sum_sq == u128::MAX
    }

    /// The mean; `None` without numbers, infinite if the sum is saturated.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        (self.n >= 1).then(|| self.sum.value() / self.n as f64)
    }

    /// The unbiased (n - 1) variance of one number; `None` for fewer than two numbers, infinite if a sum is saturated.
    ///
    /// The difference n Σx² - (Σx)² is computed in 256-bit integers, so no precision is lost to cancellation.
    #[must_use]
    pub fn variance(&self) -> Option<f64> {
        if self.n < 2 {
            return None;
        }
        if self.is_saturated() {
            return Some(f64::INFINITY);
        }
        Some(self.scatter() / (self.n as f64 * (self.n - 1) as f64))
    }

    /// The variance of the mean, variance / n; `None` for fewer than two numbers.
    #[must_use]
    pub fn variance_of_mean(&self) -> Option<f64> {
        Some(self.variance()? / self.n as f64)
    }

    /// n Σx² - (Σx)², clamped at 0, because the rounding of the squares may make it slightly negative.
    fn scatter(&self) -> f64 {
        // Both products are in units of 2^-128, the square of the sum's quantum, with 128 bits in each half.
        const ALIGN: u32 = (2 * SUM_FRACTION_BITS - SQUARE_FRACTION_BITS) as u32;
        let (high, low) = wide_mul(u128::from(self.n), self.sum_sq);
        let minuend = ((high << ALIGN) | (low >> (128 - ALIGN)), low << ALIGN);
        let sum = self.sum.quanta.unsigned_abs();
        let subtrahend = wide_mul(sum, sum);
        if minuend < subtrahend {
            return 0.0;
        }
        let (low, borrow) = minuend.1.overflowing_sub(subtrahend.1);
        let high = minuend.0 - subtrahend.0 - u128::from(borrow);
        high as f64 + low as f64 * exp2(-2 * SUM_FRACTION_BITS)
    }
}

/// |x| = mantissa · 2^exponent, exactly. An infinite or NaN x has an exponent outside every range.
#[inline]
fn decompose(x: f64) -> (u64, i32) {
    let bits = x.to_bits();
    let biased = ((bits >> MANTISSA_BITS) & 0x7ff) as i32;
    // A biased exponent of 0 marks a subnormal: no hidden bit, and the exponent of the smallest normal.
    let hidden = u64::from(biased != 0) << MANTISSA_BITS;
    let mantissa = bits & ((1 << MANTISSA_BITS) - 1) | hidden;
    (mantissa, biased.max(1) - EXPONENT_BIAS)
}

/// mantissa · 2^shift, rounded to nearest with ties away from 0; `u128::MAX` on overflow. The mantissa has at most
/// `BITS` bits.
#[inline]
fn scale<const BITS: i32>(mantissa: u128, shift: i32) -> u128 {
    // The mantissa is shifted up until its highest bit is at most bit 126. One shift down then gives twice the result;
    // a shift by 127 already gives 0.
    let up = 127 - BITS;
    let down = up - 1 - shift;
    if down < 0 {
        return scale_up(mantissa, shift.unsigned_abs());
    }
    let twice = (mantissa << up) >> down.min(127);
    (twice + 1) >> 1
}

/// mantissa · 2^shift for a mantissa that is not 0; `u128::MAX` on overflow.
#[cold]
fn scale_up(mantissa: u128, shift: u32) -> u128 {
    if shift <= mantissa.leading_zeros() { mantissa << shift } else { u128::MAX }
}

/// The 256-bit product as (high, low) halves of 128 bits.
fn wide_mul(a: u128, b: u128) -> (u128, u128) {
    const LOW: u128 = u64::MAX as u128;
    let (a_high, a_low, b_high, b_low) = (a >> 64, a & LOW, b >> 64, b & LOW);
    let middle = a_high * b_low + ((a_low * b_low) >> 64);
    let carried = a_low * b_high + (middle & LOW);
    (a_high * b_high + (middle >> 64) + (carried >> 64), (carried << 64) | (a_low * b_low) & LOW)
}

/// 2^exponent for a normal exponent, without a library call.
fn exp2(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << MANTISSA_BITS)
}

#[cfg(test)]
mod tests {
    use super::super::Moments;
    use super::*;
    use proptest::prelude::*;

    fn sum_of(x: &[f64]) -> ExactSum {
        let mut sum = ExactSum::default();
        for &x in x {
            sum.add(x);
        }
        sum
    }

    fn moments_of(x: &[f64]) -> ExactMoments {
        let mut moments = ExactMoments::default();
        for &x in x {
            moments.push(x);
        }
        moments
    }

    /// Numbers of every magnitude on a film, with zeros, both signs and subnormals.
    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![
            Just(0.0),
            Just(f64::MIN_POSITIVE / 3.0),
            -1.0..1.0,
            (-1.0..1.0, -30..24_i32).prop_map(|(x, e): (f64, i32)| x * 2.0_f64.powi(e)),
        ]
    }

    #[test]
    fn rounding_is_to_nearest_with_ties_away_from_zero() {
        let quantum = 2.0_f64.powi(-64);
        let quanta = |x: f64| sum_of(&[x * quantum]).quanta;
        let cases = [(0.25, 0), (0.499_999, 0), (0.5, 1), (1.5, 2), (2.499_999, 2), (2.5, 3), (3.0, 3)];
        for (x, expected) in cases {
            assert_eq!(quanta(x), expected, "{x} quanta");
            assert_eq!(quanta(-x), -expected, "-{x} quanta");
        }
        assert_eq!(sum_of(&[f64::MIN_POSITIVE, 5e-324, -0.0]).quanta, 0);
    }

    #[test]
    fn sums_are_exact_where_float_sums_lose_precision() {
        // In f64, 1e15 + 2^-10 - 1e15 is 0; a sum of a million 0.1 is off by 1.3e-6.
        assert_eq!(sum_of(&[1e15, 2.0_f64.powi(-10), -1e15]).value(), 2.0_f64.powi(-10));
        let mut sum = ExactSum::default();
        (0..1_000_000).for_each(|_| sum.add(0.1));
        assert_eq!(sum.value(), 100_000.0);
    }

    #[test]
    fn the_value_is_correctly_rounded() {
        // 2^53 + 1 lies halfway between two doubles and goes to the even one; a quantum more goes up.
        let halfway = [2.0_f64.powi(53), 1.0];
        assert_eq!(sum_of(&halfway).value(), 2.0_f64.powi(53));
        assert_eq!(sum_of(&[halfway[0], 1.0, 2.0_f64.powi(-64)]).value(), 2.0_f64.powi(53) + 2.0);
    }

    #[test]
    fn saturation_is_visible_and_stays() {
        for (x, end) in [(1e19, f64::INFINITY), (-1e300, f64::NEG_INFINITY), (5e18, f64::INFINITY)] {
            let mut sum = sum_of(&[x, x]);
            assert!(sum.is_saturated(), "twice {x}");
            sum.add(-x.signum());
            sum.merge(&sum_of(&[-3.0 * x.signum()]));
            assert_eq!(sum.value(), end);
            let mut other = sum_of(&[1.0]);
            other.merge(&sum);
            assert_eq!(other.value(), end);
        }
        let below = sum_of(&[9.2e18]);
        assert!(!below.is_saturated());
        assert_eq!(below.value(), 9.2e18);
    }

    #[test]
    fn products_of_256_bits_match_values_by_hand() {
        let max = u128::MAX;
        assert_eq!(wide_mul(max, max), (max - 1, 1));
        assert_eq!(wide_mul(1 << 100, 3 << 99), (3 << 71, 0));
        assert_eq!(wide_mul(max, 1 << 64), ((1 << 64) - 1, max << 64));
        assert_eq!(wide_mul(0x1_0000_0000_0000_0003, 5), (0, 0x5_0000_0000_0000_000f));
    }

    #[test]
    #[cfg_attr(debug_assertions, should_panic(expected = "only finite numbers can be summed"))]
    fn numbers_that_are_not_finite_saturate() {
        assert_eq!(sum_of(&[1.0, f64::INFINITY]).value(), f64::INFINITY);
        assert_eq!(sum_of(&[1.0, f64::NEG_INFINITY]).value(), f64::NEG_INFINITY);
        assert!(moments_of(&[1.0, f64::NAN]).is_saturated());
    }

    #[test]
    fn squares_saturate_before_the_sum() {
        let moments = moments_of(&[1e9, 1.0]);
        assert!(moments.is_saturated() && !moments.sum.is_saturated());
        assert_eq!(moments.variance(), Some(f64::INFINITY));
        assert!(!moments_of(&[5e8, 1.0]).is_saturated());
    }

    #[test]
    fn zeros_count() {
        let mut with = moments_of(&[3.0, 5.0]);
        with.push_zeros(2);
        assert_eq!(with, moments_of(&[3.0, 0.0, 5.0, 0.0]));
        assert_eq!((with.n(), with.mean(), with.variance()), (4, Some(2.0), Some(6.0)));
        assert_eq!(with.variance_of_mean(), Some(1.5));
        assert_eq!(ExactMoments::default().mean(), None);
        assert_eq!(moments_of(&[3.0]).variance(), None);
    }

    #[test]
    fn a_large_offset_does_not_cancel() {
        // 1e8 + {1, 2, 6}: the f64 formula n Σx² - (Σx)² gives 10.67 or 0 here instead of 7.
        let moments = moments_of(&[1e8 + 1.0, 1e8 + 2.0, 1e8 + 6.0]);
        assert_eq!(moments.variance(), Some(7.0));
        // A constant that is a multiple of 2^-35 has a variance of exactly 0.
        assert_eq!(moments_of(&[234.015_625; 1000]).variance(), Some(0.0));
        assert!(moments_of(&[0.1; 1000]).variance().unwrap() < 1e-21);
    }

    #[test]
    fn round_trips_through_json() {
        let moments = moments_of(&[-1e8, 0.1, 7e8 / 3.0]);
        let text = serde_json::to_string(&moments).unwrap();
        assert_eq!(serde_json::from_str::<ExactMoments>(&text).unwrap(), moments);
    }

    #[test]
    fn round_trips_through_bytes() {
        for numbers in [vec![], vec![-1e8, 0.1, 7e8 / 3.0], vec![-1e19, 3.0], vec![1e9]] {
            let moments = moments_of(&numbers);
            assert_eq!(ExactMoments::from_bytes(&moments.to_bytes()), moments, "{numbers:?}");
        }
        let bytes = moments_of(&[1.0, -3.0]).to_bytes();
        let expected = [
            2_u64.to_le_bytes().to_vec(),
            (-2_i128 << 64).to_le_bytes().to_vec(),
            (10_u128 << 70).to_le_bytes().to_vec(),
        ];
        assert_eq!(bytes.to_vec(), expected.concat());
    }

    proptest! {
        #[test]
        fn every_order_and_grouping_gives_the_same_bits(
            (original, shuffled) in prop::collection::vec(number(), 0..80)
                .prop_flat_map(|x| (Just(x.clone()), Just(x).prop_shuffle())),
            shard in 1..9_usize,
            backwards in any::<bool>(),
        ) {
            let whole = moments_of(&original);
            let mut shards: Vec<_> = shuffled.chunks(shard).map(moments_of).collect();
            if backwards {
                shards.reverse();
            }
            let mut merged = ExactMoments::default();
            for shard in &shards {
                merged.merge(shard);
            }
            prop_assert_eq!(merged, whole);
            prop_assert_eq!(merged.variance().map(f64::to_bits), whole.variance().map(f64::to_bits));
        }

        #[test]
        fn agrees_with_floating_point_moments(x in prop::collection::vec(-1e3..1e3, 2..100)) {
            let floating: Moments = x.iter().copied().collect();
            let exact = moments_of(&x);
            let scale = x.iter().map(|x| x.abs()).fold(0.0, f64::max);
            prop_assert!((exact.mean().unwrap() - floating.mean).abs() <= 1e-12 * scale);
            let variance = floating.variance().unwrap();
            prop_assert!((exact.variance().unwrap() - variance).abs() <= 1e-12 * variance.max(1e-6));
        }

        #[test]
        fn one_number_returns_exactly(x in prop_oneof![1e-3..9e18, -9e18..-1e-3]) {
            prop_assert_eq!(sum_of(&[x]).value(), x);
        }
    }
}
