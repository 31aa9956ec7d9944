//! Statistics: turns two noisy images into a verdict, and a law into a p-value. The module is independent of rendering.
//!
//! Its concepts, from sums to decisions:
//!
//! | concept | file | result |
//! |---|---|---|
//! | running mean and variance | [`moments`] | [`Moments`] |
//! | exact mean and variance, bit-identical for every order and sharding | [`exact`] | [`ExactSum`], [`ExactMoments`] |
//! | a mean with its uncertainty | [`estimate`] | [`Estimate`] |
//! | a test of two means for a difference | [`welch`] | [`Welch`] |
//! | a test of two means for equivalence within a bound | [`equivalence`] | [`Equivalence`] |
//! | counts against expected counts | [`chi2`] | [`Chi2`] |
//! | samples against a distribution function | [`ks`] | [`Ks`] |
//! | many tests at once | [`multiple`] | levels, adjusted p-values, rejections |
//! | counts of rejections against a rate | [`binomial`] | exact tail probabilities |
//! | the power of a test | [`power`] | detectable differences |
//! | a power law fitted to points | [`slope`] | [`Slope`] |
//! | a curve of predicted shape fitted to points | [`amplitude`] | [`Amplitudes`] |
//! | the crossing of two power laws | [`crossing`] | [`LogInterval`] |
//! | images reduced to tiles | [`tiles`] | [`Tiling`], [`TiledMeans`] |
//! | the comparison of an image with a reference | [`verdict`] | [`Verdict`] |
//!
//! A test returns its statistic and p-value; the caller sets the level. A p-value of exactly 0 means that the null
//! hypothesis is impossible (two exact and different means, a sample where the density is 0) or that the tail
//! probability underflows.
//!
//! Every test here relies on the central limit theorem. For heavy tails (fireflies, rarely sampled caustics), average
//! more samples into each batch or tile before testing, and never clamp.

pub mod amplitude;
pub mod binomial;
pub mod chi2;
pub mod crossing;
pub mod equivalence;
pub mod estimate;
pub mod exact;
mod float;
pub mod ks;
pub mod moments;
pub mod multiple;
pub mod normal;
pub mod power;
pub mod slope;
pub mod student;
pub mod tiles;
pub mod verdict;
pub mod welch;

#[cfg(test)]
mod draws;

pub use amplitude::Amplitudes;
pub use chi2::Chi2;
pub use crossing::LogInterval;
pub use equivalence::Equivalence;
pub use estimate::Estimate;
pub use exact::{ExactMoments, ExactSum};
pub use ks::Ks;
pub use moments::Moments;
pub use slope::{Point, Slope};
pub use tiles::{PixelMeans, TiledMeans, TilesError, Tiling};
pub use verdict::{DeterministicCheck, Outcome, Verdict, VerdictConfig, VerdictError};
pub use welch::Welch;
