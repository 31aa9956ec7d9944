//! Comparisons of two methods: where their lines cross, and which method has the lower error.

use glob::Pattern;
use serde::Serialize;

use super::{
    Study,
    fits::point,
    spec::{Axis, ComparisonSpec, Quantity},
    tables::CellFound,
};
use crate::stats::{LogInterval, Point, Slope, crossing};

/// The comparison of two methods on one scene.
#[derive(Clone, Debug, Serialize)]
pub(super) struct MethodComparison {
    pub(super) scene: String,
    pub(super) methods: [String; 2],
    pub(super) y: Quantity,
    pub(super) masked: bool,
    pub(super) x: Axis,
    /// The x at which the fitted lines cross; None if they may be parallel.
    pub(super) crossing: Option<LogInterval>,
    /// The x at which the methods are compared.
    pub(super) at: Option<f64>,
    /// The y of the first method divided by the y of the second, at `at`.
    pub(super) ratio: Option<LogInterval>,
    /// Whether `at` lies outside the range of x that both methods cover.
    pub(super) is_extrapolated: bool,
    /// Whether the residuals of both lines are consistent with straight lines.
    pub(super) is_straight: bool,
    /// The method predicted to have the lower y.
    #[serde(rename = "lower")]
    pub(super) expected_lower: Option<String>,
    pub(super) holds: Option<bool>,
    pub(super) why: String,
}

/// The level of the residuals' chi-square test below which a line is reported as curved.
const CURVED: f64 = 0.01;

/// All comparisons of a study.
pub(super) fn all(study: &Study, cells: &[CellFound]) -> Vec<MethodComparison> {
    let of = |spec: &ComparisonSpec| -> Vec<MethodComparison> {
        let pattern = Pattern::new(spec.scenes.as_ref()).expect("patterns were checked");
        let scenes = study.spec.scenes.as_ref().iter().map(super::spec::SceneSpec::name);
        scenes.filter(|scene| pattern.matches(scene)).map(|scene| comparison(spec, &scene, cells)).collect()
    };
    study.spec.comparisons.iter().flat_map(|spec| of(spec.as_ref())).collect()
}

fn comparison(spec: &ComparisonSpec, scene: &str, cells: &[CellFound]) -> MethodComparison {
    let points = |method: &String| -> Vec<Point> {
        let own = cells.iter().filter(|cell| cell.scene == scene && cell.method == *method);
        own.filter_map(|cell| point(cell, spec.y, spec.masked, spec.x)).collect()
    };
    let both = spec.methods.as_ref().each_ref().map(points);
    let lines = both.each_ref().map(|points| Slope::weighted(points));
    let pair = lines[0].zip(lines[1]);
    let shared = shared_range(&both);
    let at = spec.at.or(shared.map(|[low, high]| (low * high).sqrt()));
    let ratio = pair.zip(at).map(|((a, b), at)| crossing::ratio(&a, &b, at));
    let outside = |[low, high]: [f64; 2], at: f64| !(low..=high).contains(&at);
    let is_extrapolated = at.is_some_and(|at| shared.is_none_or(|shared| outside(shared, at)));
    let mut comparison = MethodComparison {
        scene: scene.to_owned(),
        methods: spec.methods.as_ref().clone(),
        y: spec.y,
        masked: spec.masked,
        x: spec.x,
        crossing: pair.and_then(|(a, b)| crossing::crossing(&a, &b)),
        at,
        ratio,
        is_extrapolated,
        is_straight: pair.is_some_and(|(a, b)| a.is_straight(CURVED) && b.is_straight(CURVED)),
        expected_lower: spec.expected_lower.clone(),
        holds: None,
        why: String::new(),
    };
    comparison.judge();
    comparison
}

/// The range of x that both methods cover.
fn shared_range(both: &[Vec<Point>; 2]) -> Option<[f64; 2]> {
    let ends = |points: &Vec<Point>| {
        let x = points.iter().map(|p| p.x);
        Some((x.clone().reduce(f64::min)?, x.reduce(f64::max)?))
    };
    let (a, b) = (ends(&both[0])?, ends(&both[1])?);
    let (low, high) = (a.0.max(b.0), a.1.min(b.1));
    (low < high).then_some([low, high])
}

impl MethodComparison {
    fn judge(&mut self) {
        let Some(lower) = &self.expected_lower else { return };
        let Some(ratio) = self.ratio else {
            self.holds = Some(false);
            "there are too few points to fit two lines, or the methods have no common range of x"
                .clone_into(&mut self.why);
            return;
        };
        let first = *lower == self.methods[0];
        let is_lower = if first { ratio.high < 1.0 } else { ratio.low > 1.0 };
        if !is_lower {
            "the interval of the ratio does not lie on the predicted side of 1".clone_into(&mut self.why);
        } else if self.is_extrapolated {
            "the ratio would have to be extrapolated".clone_into(&mut self.why);
        }
        self.holds = Some(self.why.is_empty());
    }

    /// The result in words.
    pub(super) fn words(&self) -> String {
        let unit = match self.x {
            Axis::X => "",
            Axis::CoreSeconds => " core s",
        };
        let mut parts = Vec::new();
        if let (Some(at), Some(r)) = (self.at, self.ratio) {
            parts.push(format!("ratio {:.3} (95 %: {:.3} to {:.3}) at {at:.4}{unit}", r.value, r.low, r.high));
        }
        parts.push(self.crossing.map_or_else(
            || "no crossing found".to_owned(),
            |c| format!("the lines cross at {:.3e}{unit} (95 %: {:.1e} to {:.1e})", c.value, c.low, c.high),
        ));
        if !self.is_straight {
            parts.push("at least one line is curved or could not be fitted".into());
        }
        parts.join("; ")
    }

    /// The result as one line for the terminal.
    pub(super) fn line(&self) -> String {
        let mark = match self.holds {
            Some(true) => "holds",
            Some(false) => "FAILS",
            None => "found",
        };
        let [a, b] = &self.methods;
        let why = if self.why.is_empty() { String::new() } else { format!(": {}", self.why) };
        format!("{mark}  {} of {a} over {b} on {}: {}{why}", self.y.title(), self.scene, self.words())
    }
}
