//! Statistics: what turns two noisy images into a verdict, and a law into a p-value. Nothing here knows of rendering.
//!
//! From sums to decisions, each in its own file:
//!
//! | concept | file | answer |
//! |---|---|---|
//! | running mean and variance | [`moments`] | [`Moments`] |
//! | the same, bit-identical for every order and sharding | [`exact`] | [`ExactSum`], [`ExactMoments`] |
//! | a mean with its uncertainty | [`estimate`] | [`Estimate`] |
//! | two means | [`welch`] | [`Welch`] |
//! | two means, equal within a bound | [`equivalence`] | [`Equivalence`] |
//! | counts against expectations | [`chi2`] | [`Chi2`] |
//! | samples against a distribution function | [`ks`] | [`Ks`] |
//! | many tests at once | [`multiple`] | levels, adjusted p-values, rejections |
//! | counts of rejections against a rate | [`binomial`] | exact tail probabilities |
//! | what a test would have seen | [`power`] | detectable differences |
//! | a power law through points | [`slope`] | [`Slope`] |
//! | a curve of predicted shape | [`amplitude`] | [`Amplitudes`] |
//! | where two power laws meet | [`crossing`] | [`LogInterval`] |
//! | images reduced to tiles | [`tiles`] | [`Tiling`], [`TiledMeans`] |
//! | "ours equals the reference" | [`verdict`] | [`Verdict`] |
//!
//! A test returns its numbers, and the caller sets the level, once. A p-value of exactly 0 means that the null
//! hypothesis is impossible (two exact and different means, a sample where the density vanishes) or that the tail
//! is smaller than the smallest double.
//!
//! Every test here leans on the central limit theorem somewhere. Heavy tails (a caustic found by luck, fireflies) are
//! the caller's business: average more samples into each batch or tile before testing, and never clamp.

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
