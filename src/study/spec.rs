//! What the file of a study may say.

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
    /// The file.
    pub file: PathBuf,
    /// The stem of its name.
    pub name: String,
    pub(super) text: String,
    pub(super) spec: StudySpec,
}

impl Study {
    /// Its title.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.spec.title
    }

    /// A fault at a byte of the file.
    pub(super) fn fault(&self, at: usize, what: impl Into<String>) -> StudyError {
        fault(&self.file, &self.text, at, what.into())
    }

    /// A path that the file names, which starts from the file's folder.
    pub(super) fn path(&self, named: &Path) -> PathBuf {
        plain(&self.file.parent().unwrap_or(Path::new("")).join(named))
    }
}

/// A fault at a byte of a study's text.
pub(super) fn fault(file: &Path, text: &str, at: usize, what: String) -> StudyError {
    let before = text.get(..at).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    StudyError::StudySpec { file: file.to_owned(), line, column, what }
}

/// A path without steps back over folders that it names.
fn plain(path: &Path) -> PathBuf {
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
    /// Independent runs of a cell.
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
    /// Compare this layer instead of the beauty.
    pub(super) layer: Option<String>,
    /// The layer of the reference, if it has another name there; "" is the beauty.
    pub(super) reference_layer: Option<String>,
    pub(super) reference: Spanned<ReferenceSpec>,
}

impl SceneSpec {
    /// The name in cells and on the page.
    pub(super) fn name(&self) -> String {
        let stem = || self.file.as_ref().file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        self.name.clone().unwrap_or_else(stem)
    }
}

/// What the image should be.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum ReferenceSpec {
    /// A folder that `scripts/make_references.py` made.
    Folder(PathBuf),
    /// An image, with its variances if it has any.
    Image(PathBuf),
    /// Long runs of an integrator without bias.
    Render(RenderSpec),
    /// The same colour everywhere, known in closed form.
    Value([f64; 3]),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RenderSpec {
    pub(super) integrator: Option<String>,
    pub(super) sampler: Option<String>,
    pub(super) spp: u32,
    pub(super) seed: Option<u64>,
    /// The reference is the mean of independent images; their scatter gives its noise.
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

/// Which pixels count: those that satisfy everything that is given.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaskSpec {
    /// The first column and the first column that is out.
    pub(super) x: Option<[u32; 2]>,
    /// The first row and the first row that is out.
    pub(super) y: Option<[u32; 2]>,
    /// Luminances of the reference above this.
    pub(super) above: Option<f64>,
    /// Luminances of the reference below this.
    pub(super) below: Option<f64>,
}

/// Who renders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RendererName {
    /// This program.
    #[default]
    Etendue,
    /// Mitsuba 3, by `scripts/convergence.py`.
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
    /// Only these scenes.
    #[serde(default = "any")]
    pub(super) scenes: Spanned<String>,
}

fn any() -> Spanned<String> {
    Spanned::new(0..0, "*".into())
}

/// What is varied: `spp`, a parameter of the integrator, or with a `$` in front one of the scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VarySpec {
    pub(super) name: Spanned<String>,
    pub(super) values: Spanned<Vec<f64>>,
}

/// A parameter that follows what is varied by a power law: value (x / at)^power.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScaleSpec {
    pub(super) at: f64,
    pub(super) value: f64,
    pub(super) power: f64,
    /// Whether it is rounded to a whole number.
    #[serde(default)]
    pub(super) whole: bool,
}

impl ScaleSpec {
    pub(super) fn value(&self, x: f64) -> f64 {
        let value = self.value * (x / self.at).powf(self.power);
        if self.whole { value.round() } else { value }
    }
}

/// A value that stands in an argument.
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

/// What is measured of a cell.
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
    /// As it stands in tables.
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

    /// As it stands on axes.
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

/// Over what a curve is drawn and fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Axis {
    /// What the method varies.
    #[default]
    X,
    /// The time of all cores.
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
    /// Only points from the first to the second x.
    pub(super) range: Option<[f64; 2]>,
    pub(super) slope: Option<f64>,
    pub(super) slope_within: Option<[f64; 2]>,
    /// One curve or two, each with a free amplitude.
    pub(super) finite_n: Option<Vec<Curve>>,
    /// What the amplitudes are, as far as that is predicted.
    #[serde(default)]
    pub(super) amplitudes: Vec<f64>,
    /// Predicts that it is 0 everywhere.
    #[serde(default)]
    pub(super) zero: bool,
    /// Half of the widest interval of a slope that decides.
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
    /// Where they are compared; the geometric middle of what both cover, if it is not given.
    pub(super) at: Option<f64>,
    /// Predicts which is the lower there.
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
    fn paths_are_plain() {
        for (path, expected) in [("a/b/../c.xml", "a/c.xml"), ("../a/./b", "../a/b"), ("/a/../b", "/b"), ("a/..", "")] {
            assert_eq!(plain(Path::new(path)), Path::new(expected), "{path}");
        }
    }

    #[test]
    fn powers_scale() {
        let scale = ScaleSpec { at: 100.0, value: 8.0, power: 2.0 / 3.0, whole: true };
        assert_eq!((scale.value(100.0), scale.value(800.0), scale.value(120.0)), (8.0, 32.0, 9.0));
    }
}
