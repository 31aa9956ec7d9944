//! The format of a study's file.

use std::{
    collections::BTreeMap,
    path::{Component, Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::{StudyError, theory::Curve};

/// A study, as its file describes it.
#[derive(Debug)]
pub struct Study {
    /// The path of the file.
    pub file: PathBuf,
    /// The name: the stem of the file's name.
    pub name: String,
    pub(super) text: String,
    pub(super) spec: StudySpec,
}

impl Study {
    /// The title.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.spec.title
    }

    /// An error at a byte offset of the file.
    pub(super) fn fault(&self, at: usize, what: impl Into<String>) -> StudyError {
        fault(&self.file, &self.text, at, what.into())
    }

    /// Resolves a path of the file, relative to the file's folder.
    pub(super) fn path(&self, named: &Path) -> PathBuf {
        normalized(&self.file.parent().unwrap_or(Path::new("")).join(named))
    }
}

/// An error at a byte offset of a study's text.
pub(super) fn fault(file: &Path, text: &str, at: usize, what: String) -> StudyError {
    let before = text.get(..at).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    StudyError::StudySpec { file: file.to_owned(), line, column, what }
}

/// Removes `.`, and `..` together with the folder before it.
fn normalized(path: &Path) -> PathBuf {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::ParentDir, Some(Component::Normal(_))) => drop(parts.pop()),
            (Component::CurDir, _) => (),
            _ => parts.push(part),
        }
    }
    parts.iter().collect()
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StudySpec {
    pub(super) title: String,
    #[serde(rename = "about")]
    pub(super) description: String,
    /// The number of independent runs of a cell.
    pub(super) seeds: Spanned<u32>,
    #[serde(default)]
    pub(super) first_seed: Option<Spanned<u64>>,
    #[serde(rename = "scene")]
    pub(super) scenes: Spanned<Vec<SceneSpec>>,
    #[serde(rename = "method")]
    pub(super) methods: Spanned<Vec<MethodSpec>>,
    #[serde(default, rename = "fit")]
    pub(super) fits: Vec<Spanned<FitSpec>>,
    #[serde(default, rename = "compare")]
    pub(super) comparisons: Vec<Spanned<ComparisonSpec>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneSpec {
    pub(super) file: Spanned<PathBuf>,
    name: Option<String>,
    #[serde(default)]
    pub(super) defines: BTreeMap<String, Scalar>,
    pub(super) mask: Option<Spanned<MaskSpec>>,
    /// The layer to compare instead of the beauty.
    pub(super) layer: Option<String>,
    /// The layer of the reference if its name differs; "" is the beauty.
    pub(super) reference_layer: Option<String>,
    pub(super) reference: Spanned<ReferenceSpec>,
}

impl SceneSpec {
    /// The name in tables and on the page; by default the stem of the file's name.
    pub(super) fn name(&self) -> String {
        let stem = || self.file.as_ref().file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        self.name.clone().unwrap_or_else(stem)
    }
}

/// The reference of a scene.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum ReferenceSpec {
    /// A folder that `scripts/make_references.py` made.
    Folder(PathBuf),
    /// An image, with its variances if it has them.
    Image(PathBuf),
    /// Long runs of an unbiased integrator.
    Render(RenderSpec),
    /// A constant colour, known in closed form.
    Value([f64; 3]),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RenderSpec {
    pub(super) integrator: Option<String>,
    pub(super) sampler: Option<String>,
    pub(super) spp: u32,
    pub(super) seed: Option<u64>,
    /// The number of independent images. The reference is their mean; their scatter gives its noise.
    #[serde(default = "one")]
    pub(super) seeds: u32,
    #[serde(default)]
    pub(super) params: BTreeMap<String, Scalar>,
    #[serde(default)]
    pub(super) defines: BTreeMap<String, Scalar>,
}

fn one() -> u32 {
    1
}

/// A mask: the pixels that satisfy all given conditions.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaskSpec {
    /// The first column, and one past the last.
    pub(super) x: Option<[u32; 2]>,
    /// The first row, and one past the last.
    pub(super) y: Option<[u32; 2]>,
    /// The luminance of the reference must be greater than this.
    pub(super) above: Option<f64>,
    /// The luminance of the reference must be less than this.
    pub(super) below: Option<f64>,
}

/// The renderer of a method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RendererName {
    /// Étendue, this program.
    #[default]
    Etendue,
    /// Mitsuba 3, run by `scripts/convergence.py`.
    Mitsuba,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MethodSpec {
    pub(super) name: Spanned<String>,
    #[serde(default)]
    pub(super) renderer: RendererName,
    pub(super) variant: Option<String>,
    pub(super) integrator: Option<String>,
    pub(super) sampler: Option<String>,
    pub(super) spp: Option<Spanned<u32>>,
    #[serde(default)]
    pub(super) params: BTreeMap<String, Scalar>,
    #[serde(default)]
    pub(super) defines: BTreeMap<String, Scalar>,
    pub(super) vary: Option<VarySpec>,
    #[serde(default)]
    pub(super) scale: BTreeMap<String, Spanned<ScaleSpec>>,
    /// A glob pattern for the scenes that the method renders.
    #[serde(default = "any")]
    pub(super) scenes: Spanned<String>,
}

fn any() -> Spanned<String> {
    Spanned::new(0..0, "*".into())
}

/// The varied parameter: `spp`, a parameter of the integrator, or, with the prefix `$`, a parameter of the scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VarySpec {
    pub(super) name: Spanned<String>,
    pub(super) values: Spanned<Vec<f64>>,
}

/// A parameter that depends on the varied parameter x by a power law: value (x / at)^power.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScaleSpec {
    pub(super) at: f64,
    pub(super) value: f64,
    pub(super) power: f64,
    /// Whether the result is rounded to a whole number.
    #[serde(default)]
    pub(super) whole: bool,
}

impl ScaleSpec {
    pub(super) fn value(&self, x: f64) -> f64 {
        let value = self.value * (x / self.at).powf(self.power);
        if self.whole { value.round() } else { value }
    }
}

/// A parameter's value.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Scalar {
    Boolean(bool),
    Integer(i64),
    Float(f64),
    Text(String),
}

impl std::fmt::Display for Scalar {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Boolean(b) => b.fmt(f),
            Self::Integer(i) => i.fmt(f),
            Self::Float(x) => x.fmt(f),
            Self::Text(text) => text.fmt(f),
        }
    }
}

/// An error measure of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Quantity {
    Mse,
    Rmse,
    Variance,
    Bias,
    BiasSquared,
    BiasRms,
    RelativeMse,
}

impl Quantity {
    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Mse => "mse",
            Self::Rmse => "rmse",
            Self::Variance => "variance",
            Self::Bias => "bias",
            Self::BiasSquared => "bias_squared",
            Self::BiasRms => "bias_rms",
            Self::RelativeMse => "relative_mse",
        }
    }

    /// The title of an axis.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Mse => "MSE",
            Self::Rmse => "RMSE",
            Self::Variance => "variance",
            Self::Bias => "mean error",
            Self::BiasSquared => "squared bias",
            Self::BiasRms => "bias (root mean square)",
            Self::RelativeMse => "relative MSE",
        }
    }
}

/// The x axis of plots and fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Axis {
    /// The parameter that the method varies.
    #[default]
    X,
    /// Core-seconds: the time summed over all cores.
    CoreSeconds,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FitSpec {
    pub(super) name: Option<String>,
    pub(super) y: Quantity,
    #[serde(default)]
    pub(super) x: Axis,
    #[serde(default)]
    pub(super) masked: bool,
    #[serde(default = "any")]
    pub(super) methods: Spanned<String>,
    #[serde(default = "any")]
    pub(super) scenes: Spanned<String>,
    /// Restricts the fit to points from the first to the second x, inclusive.
    pub(super) range: Option<[f64; 2]>,
    pub(super) slope: Option<f64>,
    pub(super) slope_within: Option<[f64; 2]>,
    /// One curve or two, each with a free amplitude.
    pub(super) finite_n: Option<Vec<Curve>>,
    /// The predicted amplitudes, in the order of the curves; there may be fewer.
    #[serde(default)]
    pub(super) amplitudes: Vec<f64>,
    /// Predicts that y is 0 in every cell.
    #[serde(default)]
    pub(super) zero: bool,
    /// The maximum half-width of a slope's interval for which the prediction can hold.
    pub(super) half_width: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ComparisonSpec {
    pub(super) methods: Spanned<[String; 2]>,
    #[serde(default = "any")]
    pub(super) scenes: Spanned<String>,
    #[serde(default = "mse")]
    pub(super) y: Quantity,
    #[serde(default = "core_seconds")]
    pub(super) x: Axis,
    #[serde(default)]
    pub(super) masked: bool,
    /// The x of the comparison; by default the geometric mean of the ends of the range that both methods cover.
    pub(super) at: Option<f64>,
    /// The method predicted to have the lower y at that x.
    #[serde(rename = "lower")]
    pub(super) expected_lower: Option<String>,
}

fn mse() -> Quantity {
    Quantity::Mse
}

fn core_seconds() -> Axis {
    Axis::CoreSeconds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_normalized() {
        for (path, expected) in [("a/b/../c.xml", "a/c.xml"), ("../a/./b", "../a/b"), ("/a/../b", "/b"), ("a/..", "")] {
            assert_eq!(normalized(Path::new(path)), Path::new(expected), "{path}");
        }
    }

    #[test]
    fn scales_follow_a_power_law() {
        let scale = ScaleSpec { at: 100.0, value: 8.0, power: 2.0 / 3.0, whole: true };
        assert_eq!((scale.value(100.0), scale.value(800.0), scale.value(120.0)), (8.0, 32.0, 9.0));
    }
}
