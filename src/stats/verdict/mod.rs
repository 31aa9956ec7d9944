//! The verdict on "ours equals the reference", from two images reduced to tiles.
//!
//! Three statistics share the level α by Bonferroni, a third each, because each sees what the others miss:
//!
//! - **global**: the three channel means of the whole image, Welch each, Šidák over 3. Sees a small bias everywhere.
//! - **peak**: the largest |t| over tiles × channels, as the smallest p, Šidák over their number. Sees a local error.
//! - **scatter**: Σz² over tile luminances against χ². Each z has the p of its tile's Welch t, so that few degrees of
//!   freedom do not inflate it. Sees many small errors that cancel in the mean.
//!
//! The scatter assumes that tiles are independent of each other. Paths traced pixel by pixel are; photons that are shared
//! by many pixels, and chains of mutations, are not.
//!
//! Pixels that both sides know exactly (emitters seen directly, the background) must not be among the tiles: there
//! round-off is significant, and t tests reject on it. They go to a [`DeterministicCheck`].
//!
//! Skew on one side only is the trap. Between two runs of one renderer it cancels in the difference, so an A/A calibration
//! looks honest however skewed the noise; against another estimator it does not, and the peak, far in the tail, is the
//! first to suffer. By simulation of right images at α = 1 %, where our side is skewed and the reference is not: a
//! skewness of the tile means (of a sub-render's, over √K) of 0.09 rejects 1 %, 0.12 to 0.25 rejects 1.5 to 3 %, and
//! 0.4 to 0.8 rejects 5 to 14 %. Take larger tiles or more samples until it is below 0.1.
//!
//! Agreement is only worth what it could have excluded, so it needs power: see [`Outcome::Undecided`].

use super::{Chi2, Estimate, TiledMeans, Welch, multiple, normal, power};
use serde::{Deserialize, Serialize};

/// The levels and the ambition of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct VerdictConfig {
    /// The chance of rejecting an image that is right, all statistics together, in (0, 1).
    pub alpha: f64,
    /// The relative bias of a channel mean that must not pass unseen, above 0.
    pub target_bias: f64,
    /// How surely that bias must be seen, in (0.5, 1).
    pub power: f64,
}

impl Default for VerdictConfig {
    /// One false alarm in a hundred; half a percent of bias, seen 99 times in a hundred.
    fn default() -> Self {
        Self { alpha: 0.01, target_bias: 0.005, power: 0.99 }
    }
}

/// What the evidence says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// Nothing rejects, and a bias of the target size in any lit channel would have been seen.
    Agrees,
    /// At least one statistic, or the deterministic pixels, reject equality.
    Differs,
    /// Nothing rejects, but a bias of the target size in some channel might have passed unseen.
    Undecided {
        /// How many times as many samples our side needs so that it would not, with the same number of sub-renders (to
        /// 1 %); `None` when the reference's own error hides the target bias however good our side is.
        needed_factor: Option<f64>,
    },
}

/// Global channel means.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GlobalTest {
    /// Red, green and blue, ours minus reference.
    pub channels: [Welch; 3],
    /// The differences relative to the reference; `None` in a channel whose reference is black.
    pub relative_difference: [Option<f64>; 3],
    /// The relative bias that each channel's test at its Šidák level finds with the configured power; `None` as above.
    pub detectable_bias: [Option<f64>; 3],
    /// The largest of those: the figure held against the target, because a wrong channel is a wrong image. `None` when
    /// the whole reference is black.
    pub worst_detectable_bias: Option<f64>,
    /// The smallest p, Šidák over the three.
    pub p: f64,
    /// Rejects at or below this p.
    pub level: f64,
}

/// The worst tile and channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PeakTest {
    /// How many tests there were: tiles × channels, less those where both sides are exact and equal.
    pub tests: usize,
    /// The tile of the smallest p and its channel (0 red, 1 green, 2 blue); `None` without tests.
    pub tile_and_channel: Option<(usize, usize)>,
    /// The smallest p as it came.
    pub smallest_p: f64,
    /// The smallest p, Šidák over `tests`.
    pub p: f64,
    /// Rejects at or below this p.
    pub level: f64,
}

/// The scatter of all tile luminances.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScatterTest {
    /// Σz² over the tiles, less those where both sides are exact and equal.
    pub chi2: Chi2,
    /// Rejects at or below this p.
    pub level: f64,
}

/// One tile of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TileComparison {
    /// Red, green and blue.
    pub channels: [Welch; 3],
    /// Luminance: its p is uniform over tiles when the images agree, so this is the one for a map or a histogram.
    pub luminance: Welch,
    /// The signed z score with the p of the luminance, within ±37.5.
    pub z: f64,
    /// The smallest p of the channels, Šidák over those that test anything.
    pub p: f64,
}

/// The verdict with every number behind it. Indices of tiles count row by row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// What the evidence says.
    pub outcome: Outcome,
    /// The smallest p of the three statistics, Bonferroni over them: they reject when it is at or below α.
    pub p: f64,
    /// The global channel means.
    pub global: GlobalTest,
    /// The worst tile.
    pub peak: PeakTest,
    /// The tiles together.
    pub scatter: ScatterTest,
    /// The pixels without noise, when there were any.
    pub deterministic: Option<DeterministicCheck>,
    /// Tiles across.
    pub columns: usize,
    /// Tiles down.
    pub rows: usize,
    /// How many tiles are not masked out.
    pub tiles_compared: usize,
    /// Each tile; `None` where it is masked out.
    pub tiles: Vec<Option<TileComparison>>,
    /// Tiles whose p is rejected by Benjamini and Hochberg at rate α: where to look. They do not enter the outcome.
    pub localised: Vec<usize>,
    /// The levels that were used.
    pub config: VerdictConfig,
}

/// Why two sides cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VerdictError {
    /// The grids of tiles have different shapes.
    #[error("our image has {ours:?} tiles (columns, rows), the reference has {reference:?}")]
    GridsDiffer {
        /// Our columns and rows.
        ours: (usize, usize),
        /// The reference's.
        reference: (usize, usize),
    },
    /// A tile is masked out on one side only: the masks were not shared, or one renderer made a NaN.
    #[error("tile ({column}, {row}) is masked out on one side only")]
    MasksDiffer {
        /// The first such tile.
        column: usize,
        /// The first such tile.
        row: usize,
    },
    /// Every tile is masked out, and there are no deterministic pixels either.
    #[error("every tile is masked out and no pixel is deterministic: nothing was compared")]
    NothingCompared,
}

impl Verdict {
    /// Compares two sides on the same grid with the same mask.
    ///
    /// A tile where both sides are exact and equal is not a test and is not counted; where they are exact and different it
    /// rejects with p = 0. The masks must be chosen without looking at the difference.
    ///
    /// # Errors
    /// If grids or masks differ, or nothing would be compared.
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

/// Every tile that is used on both sides.
fn compare_tiles(ours: &TiledMeans, reference: &TiledMeans) -> Result<Vec<Option<TileComparison>>, VerdictError> {
    let grid = |side: &TiledMeans| (side.columns, side.rows);
    if grid(ours) != grid(reference) {
        return Err(VerdictError::GridsDiffer { ours: grid(ours), reference: grid(reference) });
    }
    let one = |tile: usize| match (
        ours.tiles[tile].zip(ours.luminance[tile]),
        reference.tiles[tile].zip(reference.luminance[tile]),
    ) {
        (Some(ours), Some(reference)) => Ok(Some(TileComparison::new(&ours, &reference))),
        (None, None) => Ok(None),
        _ => Err(VerdictError::MasksDiffer { column: tile % ours.columns, row: tile / ours.columns }),
    };
    (0..ours.tiles.len()).map(one).collect()
}

impl TileComparison {
    fn new(ours: &([Estimate; 3], Estimate), reference: &([Estimate; 3], Estimate)) -> Self {
        let channels: [Welch; 3] = std::array::from_fn(|c| Welch::test(&ours.0[c], &reference.0[c]));
        let luminance = Welch::test(&ours.1, &reference.1);
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
        let channels: [Welch; 3] = std::array::from_fn(|c| Welch::test(&ours[c], &reference[c]));
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
            tile_and_channel: smallest.map(|(place, _)| place),
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

/// With so many times the samples our side might as well be exact.
const AS_GOOD_AS_EXACT: f64 = 1e6;

/// How many times as many samples bring the worst detectable bias down to the target; `None` when none do.
///
/// The variance of our means falls with the samples; the degrees of freedom of a side stay, those of the difference
/// move towards the reference's.
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

/// A comparison, to a tolerance, of pixels that neither side estimates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DeterministicCheck {
    /// How many values were compared.
    pub compared: usize,
    /// The largest relative difference that is not put down to noise.
    #[serde(with = "super::float")]
    pub worst_relative: f64,
    /// The largest one allowed.
    pub tolerance: f64,
    /// Whether the worst is within the tolerance.
    pub passed: bool,
}

impl DeterministicCheck {
    /// The usual tolerance, a relative 1e-4: f32 films and different orders of evaluation pass, a wrong emitter does not.
    pub const TOLERANCE: f64 = 1e-4;
    /// Values below this part of the largest one in either image are compared as if they were that large, so
    /// that the dust in a black pixel is not divided by 0.
    pub const FLOOR: f64 = 1e-6;

    /// A difference that is more likely than this by what noise there is left does not count. Of all values of an
    /// image, some 1e5, noise alone then lets one fail in a thousand images.
    const NOISE_LEVEL: f64 = 1e-8;

    /// Compares values pairwise: |a - b| / max(|b|, [`FLOOR`](Self::FLOOR) × the largest value of either side), unless
    /// Welch's test puts the difference down to noise. A NaN or an infinity on either side fails.
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
