//! The verdict whether an image equals its reference, from two images reduced to tiles.
//!
//! Three statistics share the level α by Bonferroni, a third each. Each detects errors that the others miss:
//!
//! - **global**: Welch's test of each of the three channel means of the image, Šidák-corrected over 3. It detects a
//!   small bias everywhere.
//! - **peak**: the smallest p over tiles × channels, Šidák-corrected over their number. It detects a local error.
//! - **scatter**: a chi-square test of Σz² over tile luminances. Each z is the z-score with the p of its tile's Welch
//!   test, so few degrees of freedom do not inflate it. It detects many small errors that cancel in the mean.
//!
//! The scatter test assumes independent tiles. They are independent for paths traced pixel by pixel, but not for
//! photons shared by many pixels or for Markov chains.
//!
//! Pixels that both sides know exactly (directly visible emitters, the background) must be masked out of the tiles,
//! because t tests reject their round-off errors. A [`DeterministicCheck`] compares them instead.
//!
//! Skewed noise on one side inflates the false rejection rate. Between two runs of the same renderer, skewness cancels
//! in the difference, so an A/A calibration does not reveal it. Between different estimators it does not cancel, and
//! affects mostly the peak test, which depends on the far tail. In simulations of equal images at α = 1 %, with our
//! side skewed and the reference symmetric, the rejection rate is 1 % at a skewness of the tile means (the skewness of
//! a sub-render over √K) of 0.09, 1.5 to 3 % at 0.12 to 0.25, and 5 to 14 % at 0.4 to 0.8. Use larger tiles or more
//! samples until the skewness is below 0.1.
//!
//! Agreement also requires enough power: see [`Outcome::Undecided`].

use super::{Chi2, Estimate, TiledMeans, Welch, multiple, normal, power};
use serde::{Deserialize, Serialize};

/// The significance level and the required power of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct VerdictConfig {
    /// The probability of rejecting a correct image, over all statistics together, in (0, 1).
    pub alpha: f64,
    /// The relative bias of a channel mean that must be detectable, above 0.
    pub target_bias: f64,
    /// The probability with which that bias must be detected, in (0.5, 1).
    pub power: f64,
}

impl Default for VerdictConfig {
    /// A false rejection rate of 1 %, and a power of 99 % to detect a bias of 0.5 %.
    fn default() -> Self {
        Self { alpha: 0.01, target_bias: 0.005, power: 0.99 }
    }
}

/// The outcome of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// No statistic rejects, and a bias of the target size would have been detected in every channel whose reference is
    /// not black.
    Agrees,
    /// At least one statistic or the deterministic pixels reject equality.
    Differs,
    /// No statistic rejects, but a bias of the target size in some channel might not have been detected.
    Undecided {
        /// The factor on our side's samples, to 1 %, that makes the target bias detectable with the same number of
        /// sub-renders. `None` if the reference's own error prevents that.
        needed_factor: Option<f64>,
    },
}

/// The test of the global channel means.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GlobalTest {
    /// Red, green and blue, ours minus the reference.
    pub channels: [Welch; 3],
    /// The differences relative to the reference; `None` for a channel whose reference is black.
    pub relative_difference: [Option<f64>; 3],
    /// The relative bias that each channel's test at its Šidák level detects with the configured power; `None` for a
    /// channel whose reference is black.
    pub detectable_bias: [Option<f64>; 3],
    /// The largest of those, which is compared with the target bias. `None` if the entire reference is black.
    pub worst_detectable_bias: Option<f64>,
    /// The smallest p, Šidák-corrected over the three channels.
    pub p: f64,
    /// The test rejects at or below this p.
    pub level: f64,
}

/// The test of the worst tile and channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PeakTest {
    /// The number of tests: tiles × channels, without those where both sides are exact and equal.
    pub tests: usize,
    /// The tile of the smallest p and its channel (0 red, 1 green, 2 blue); `None` without tests.
    pub tile_and_channel: Option<(usize, usize)>,
    /// The smallest p, uncorrected.
    pub smallest_p: f64,
    /// The smallest p, Šidák-corrected over `tests`.
    pub p: f64,
    /// The test rejects at or below this p.
    pub level: f64,
}

/// The test of the scatter of all tile luminances.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScatterTest {
    /// The test of Σz² over the tiles, without those where both sides are exact and equal.
    pub chi2: Chi2,
    /// The test rejects at or below this p.
    pub level: f64,
}

/// The comparison of one tile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TileComparison {
    /// Red, green and blue.
    pub channels: [Welch; 3],
    /// The test of the luminance. Its p is uniform over tiles if the images are equal, so maps and histograms use it.
    pub luminance: Welch,
    /// The signed z score with the p of the luminance, within ±37.5.
    pub z: f64,
    /// The smallest p of the channels, Šidák-corrected over those that are not vacuous.
    pub p: f64,
}

/// A verdict with all its statistics. Tiles are indexed row by row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The outcome.
    pub outcome: Outcome,
    /// The smallest p of the three statistics, Bonferroni-corrected: they reject if it is at most α.
    pub p: f64,
    /// The test of the global channel means.
    pub global: GlobalTest,
    /// The test of the worst tile.
    pub peak: PeakTest,
    /// The test of the scatter of all tiles.
    pub scatter: ScatterTest,
    /// The check of the pixels without noise, if there are any.
    pub deterministic: Option<DeterministicCheck>,
    /// The number of columns of tiles.
    pub columns: usize,
    /// The number of rows of tiles.
    pub rows: usize,
    /// The number of tiles that are not masked out.
    pub tiles_compared: usize,
    /// The comparison of each tile; `None` if it is masked out.
    pub tiles: Vec<Option<TileComparison>>,
    /// The tiles that Benjamini and Hochberg's procedure rejects at rate α. They locate errors but do not affect the
    /// outcome.
    pub localised: Vec<usize>,
    /// The configuration.
    pub config: VerdictConfig,
}

/// The reason why two sides cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VerdictError {
    /// The grids of tiles have different shapes.
    #[error("our image has {ours:?} tiles (columns, rows), the reference has {reference:?}")]
    GridsDiffer {
        /// Our columns and rows.
        ours: (usize, usize),
        /// The reference's columns and rows.
        reference: (usize, usize),
    },
    /// A tile is masked out on one side only: the masks differ, or one renderer produced a NaN.
    #[error("tile ({column}, {row}) is masked out on one side only")]
    MasksDiffer {
        /// The column of the first such tile.
        column: usize,
        /// The row of the first such tile.
        row: usize,
    },
    /// Every tile is masked out, and there are no deterministic pixels.
    #[error("every tile is masked out and no pixel is deterministic: nothing was compared")]
    NothingCompared,
}

impl Verdict {
    /// Compares two sides on the same grid with the same mask.
    ///
    /// A tile where both sides are exact and equal does not count as a test. A tile where they are exact and different
    /// rejects with p = 0. The masks must be chosen independently of the difference.
    ///
    /// # Errors
    /// If grids or masks differ, or nothing is compared.
    pub fn compare(
        ours: &TiledMeans,
        reference: &TiledMeans,
        deterministic: Option<DeterministicCheck>,
        config: &VerdictConfig,
    ) -> Result<Self, VerdictError> {
        let tiles = compare_tiles(ours, reference)?;
        let tiles_compared = tiles.iter().flatten().count();
        if tiles_compared == 0 && deterministic.is_none_or(|check| check.compared == 0) {
            return Err(VerdictError::NothingCompared);
        }
        let level = multiple::bonferroni_level(config.alpha, 3);
        let global = GlobalTest::new(&ours.global, &reference.global, level, config.power);
        let peak = PeakTest::new(&tiles, level);
        let scatter = ScatterTest::new(&tiles, level);

        let smallest = global.p.min(peak.p).min(scatter.chi2.p);
        let failed = deterministic.is_some_and(|check| !check.passed);
        let outcome = if smallest <= level || failed {
            Outcome::Differs
        } else if global.worst_detectable_bias.is_some_and(|bias| bias > config.target_bias) {
            Outcome::Undecided { needed_factor: needed_factor(&ours.global, &reference.global, level, config) }
        } else {
            Outcome::Agrees
        };
        Ok(Self {
            outcome,
            p: multiple::bonferroni_p(smallest, 3),
            global,
            peak,
            scatter,
            deterministic,
            columns: ours.columns,
            rows: ours.rows,
            tiles_compared,
            localised: localise(&tiles, config.alpha),
            tiles,
            config: *config,
        })
    }
}

/// Compares every tile that is used on both sides.
fn compare_tiles(ours: &TiledMeans, reference: &TiledMeans) -> Result<Vec<Option<TileComparison>>, VerdictError> {
    let grid = |side: &TiledMeans| (side.columns, side.rows);
    if grid(ours) != grid(reference) {
        return Err(VerdictError::GridsDiffer { ours: grid(ours), reference: grid(reference) });
    }
    let comparison = |tile: usize| match (
        ours.tiles[tile].zip(ours.luminance[tile]),
        reference.tiles[tile].zip(reference.luminance[tile]),
    ) {
        (Some(ours), Some(reference)) => Ok(Some(TileComparison::new(&ours, &reference))),
        (None, None) => Ok(None),
        _ => Err(VerdictError::MasksDiffer { column: tile % ours.columns, row: tile / ours.columns }),
    };
    (0..ours.tiles.len()).map(comparison).collect()
}

/// The rounding error of a mean that a renderer computes in single precision, relative to it: some ulps.
const ROUNDING: f64 = 1e-6;

/// Tests one channel. One channel may be without noise where others have noise, such as the blue of a sky: two
/// such means are equal if they differ by no more than a few roundings.
fn test_channel(ours: &Estimate, reference: &Estimate) -> Welch {
    let rounding = ROUNDING * reference.mean.abs();
    let is_exact = |side: &Estimate| side.variance_of_mean < rounding * rounding;
    if is_exact(ours) && is_exact(reference) && (ours.mean - reference.mean).abs() <= 4.0 * rounding {
        let exact = Estimate::exact(reference.mean);
        return Welch::test(&exact, &exact);
    }
    Welch::test(ours, reference)
}

impl TileComparison {
    fn new(ours: &([Estimate; 3], Estimate), reference: &([Estimate; 3], Estimate)) -> Self {
        let channels: [Welch; 3] = std::array::from_fn(|c| test_channel(&ours.0[c], &reference.0[c]));
        let luminance = test_channel(&ours.1, &reference.1);
        let tests = channels.iter().filter(|welch| !welch.is_vacuous()).count();
        let smallest = channels.iter().map(|welch| welch.p).fold(1.0, f64::min);
        Self {
            channels,
            luminance,
            z: normal::two_sided_z(luminance.p).copysign(luminance.difference),
            p: multiple::sidak_p(smallest, tests),
        }
    }
}

impl GlobalTest {
    fn new(ours: &[Estimate; 3], reference: &[Estimate; 3], level: f64, power: f64) -> Self {
        let channels: [Welch; 3] = std::array::from_fn(|c| test_channel(&ours[c], &reference[c]));
        let channel_level = multiple::sidak_level(level, 3);
        let detectable_bias: [Option<f64>; 3] = std::array::from_fn(|c| {
            power::detectable_bias(reference[c].mean, channels[c].std_error, channels[c].dof, channel_level, power)
        });
        let smallest = channels.iter().map(|welch| welch.p).fold(1.0, f64::min);
        Self {
            channels,
            relative_difference: std::array::from_fn(|c| {
                let mean = reference[c].mean;
                (mean != 0.0).then(|| channels[c].difference / mean.abs())
            }),
            detectable_bias,
            worst_detectable_bias: detectable_bias.into_iter().flatten().reduce(f64::max),
            p: multiple::sidak_p(smallest, 3),
            level,
        }
    }
}

impl PeakTest {
    fn new(tiles: &[Option<TileComparison>], level: f64) -> Self {
        let each = tiles.iter().enumerate().filter_map(|(tile, comparison)| Some((tile, comparison.as_ref()?)));
        let each = each.flat_map(|(tile, comparison)| {
            let channels = comparison.channels.iter().enumerate();
            channels.filter(|(_, welch)| !welch.is_vacuous()).map(move |(c, welch)| ((tile, c), welch.p))
        });
        let tests = each.clone().count();
        let smallest = each.min_by(|a, b| a.1.total_cmp(&b.1));
        let smallest_p = smallest.map_or(1.0, |(_, p)| p);
        Self {
            tests,
            tile_and_channel: smallest.map(|(location, _)| location),
            smallest_p,
            p: multiple::sidak_p(smallest_p, tests),
            level,
        }
    }
}

impl ScatterTest {
    fn new(tiles: &[Option<TileComparison>], level: f64) -> Self {
        let tested = tiles.iter().flatten().filter(|tile| !tile.luminance.is_vacuous());
        let z: Vec<f64> = tested.map(|tile| tile.z).collect();
        Self { chi2: Chi2::sum_of_squares(&z), level }
    }
}

fn localise(tiles: &[Option<TileComparison>], rate: f64) -> Vec<usize> {
    let (index, p): (Vec<usize>, Vec<f64>) =
        tiles.iter().enumerate().filter_map(|(tile, comparison)| Some((tile, comparison.as_ref()?.p))).unzip();
    let rejected = multiple::benjamini_hochberg(&p, rate);
    index.into_iter().zip(rejected).filter_map(|(tile, rejected)| rejected.then_some(tile)).collect()
}

/// The factor on our side's samples that makes it practically exact.
const AS_GOOD_AS_EXACT: f64 = 1e6;

/// The factor on our side's samples that reduces the worst detectable bias to the target; `None` if no factor does.
///
/// The variance of our means falls with the number of samples. The degrees of freedom of a side stay the same, and
/// the degrees of freedom of the difference approach the reference's.
fn needed_factor(ours: &[Estimate; 3], reference: &[Estimate; 3], level: f64, config: &VerdictConfig) -> Option<f64> {
    let suffices = |factor: f64| {
        let better = ours.map(|side| Estimate { variance_of_mean: side.variance_of_mean / factor, ..side });
        let worst = GlobalTest::new(&better, reference, level, config.power).worst_detectable_bias;
        worst.is_none_or(|bias| bias <= config.target_bias)
    };
    if !suffices(AS_GOOD_AS_EXACT) {
        return None;
    }
    let mut high = 2.0;
    while !suffices(high) {
        high *= 2.0;
    }
    let mut low = 0.5 * high;
    while high > 1.01 * low {
        let middle = (low * high).sqrt();
        if suffices(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// A comparison, by a tolerance, of pixels that neither side estimates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DeterministicCheck {
    /// The number of compared values.
    pub compared: usize,
    /// The largest relative difference that noise does not explain.
    #[serde(with = "super::float")]
    pub worst_relative: f64,
    /// The largest allowed relative difference.
    pub tolerance: f64,
    /// Whether the largest difference is within the tolerance.
    pub passed: bool,
}

impl DeterministicCheck {
    /// The default relative tolerance. It allows for f32 films and different orders of evaluation, but not for a wrong
    /// emitter.
    pub const TOLERANCE: f64 = 1e-4;
    /// The minimum denominator of a relative difference, as a fraction of the largest value in either image, so that
    /// round-off errors in black pixels do not count.
    pub const FLOOR: f64 = 1e-6;

    /// A difference whose p under the remaining noise is at least this does not count. With about 1e5 values per image,
    /// noise alone fails one image in a thousand.
    const NOISE_LEVEL: f64 = 1e-8;

    /// Compares values pairwise: |a - b| / max(|b|, [`FLOOR`](Self::FLOOR) × the largest value of either side), unless
    /// Welch's test attributes the difference to noise. A NaN or an infinity on either side fails.
    ///
    /// # Panics
    /// If the lengths differ, or a side of non-zero variance has no degrees of freedom.
    #[must_use]
    pub fn compare(ours: &[Estimate], reference: &[Estimate], tolerance: f64) -> Self {
        assert_eq!(ours.len(), reference.len(), "values are compared pairwise");
        let largest = ours.iter().chain(reference).map(|x| x.mean.abs()).fold(f64::MIN_POSITIVE, f64::max);
        let floor = Self::FLOOR * largest;
        let relative = |(a, b): (&Estimate, &Estimate)| match (a.mean - b.mean).abs() / b.mean.abs().max(floor) {
            relative if relative <= tolerance => relative,
            _ if Welch::test(a, b).p >= Self::NOISE_LEVEL => 0.0,
            relative if relative.is_finite() => relative,
            _ => f64::INFINITY,
        };
        let worst_relative = ours.iter().zip(reference).map(relative).fold(0.0, f64::max);
        Self { compared: ours.len(), worst_relative, tolerance, passed: worst_relative <= tolerance }
    }
}

#[cfg(test)]
mod tests;
