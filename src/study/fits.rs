//! Fits of slopes and predicted curves to cells, and whether predictions hold.

use glob::Pattern;
use serde::Serialize;

use super::{
    Study,
    spec::{Axis, FitSpec, Quantity, RendererName},
    tables::CellFound,
    theory::Curve,
};
use crate::{
    report::number::significant,
    stats::{Amplitudes, Chi2, Point, Slope, amplitude, slope::FitCriteria},
};

/// A fit of one method on one scene, with its result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Fit {
    /// Its name in the study.
    pub(super) name: String,
    pub(super) scene: String,
    pub(super) method: String,
    pub(super) y: Quantity,
    pub(super) masked: bool,
    pub(super) x: Axis,
    pub(super) x_name: String,
    /// The prediction in words; empty if nothing is predicted.
    pub(super) predicted: String,
    pub(super) found: FitResult,
    /// The predicted slope, which is drawn through the fitted level.
    pub(super) predicted_slope: Option<f64>,
    /// Whether the prediction holds. None if nothing is predicted, or if another renderer has rendered nothing yet.
    pub(super) holds: Option<bool>,
    /// Why the prediction does not hold; empty if it holds.
    pub(super) why: String,
    /// The criteria of the prediction.
    pub(super) criteria: FitCriteria,
    pub(super) points: Vec<Point>,
}

/// The result of a fit.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum FitResult {
    /// A straight line.
    Slope(Slope),
    /// Amplitudes of predicted curves.
    Curves { curves: Vec<Curve>, fit: Amplitudes },
    /// A chi-square test of all points being 0.
    Zero(Chi2),
    /// There are too few points to fit.
    Nothing,
}

/// All fits of a study, one for each scene and method that matches.
pub(super) fn all(study: &Study, cells: &[CellFound]) -> Vec<Fit> {
    let series: Vec<_> = study.spec.fits.iter().flat_map(|spec| series_of(study, spec.as_ref(), cells)).collect();
    // Predictions about renderers without images are left out; the criteria are not corrected for them.
    let predictions = series.iter().filter(|series| series.spec.is_prediction() && !series.is_left_out()).count();
    let criteria = FitCriteria::default().shared(predictions);
    series.into_iter().map(|series| series.fit(criteria)).collect()
}

impl FitSpec {
    fn is_prediction(&self) -> bool {
        self.slope.is_some() || self.slope_within.is_some() || self.finite_n.is_some() || self.zero
    }

    fn title(&self) -> String {
        let mask = if self.masked { " in the mask" } else { "" };
        self.name.clone().unwrap_or_else(|| format!("{}{mask}", self.y.title()))
    }
}

/// The cells of a method on a scene, in rising order of x.
struct Series<'c> {
    spec: &'c FitSpec,
    scene: String,
    method: String,
    renderer: RendererName,
    x_name: String,
    cells: Vec<&'c CellFound>,
}

fn series_of<'c>(study: &'c Study, spec: &'c FitSpec, cells: &'c [CellFound]) -> Vec<Series<'c>> {
    let pattern = |text: &str| Pattern::new(text).expect("patterns were checked");
    let (scenes, methods) = (pattern(spec.scenes.as_ref()), pattern(spec.methods.as_ref()));
    let mut all = Vec::new();
    for scene in study.spec.scenes.as_ref().iter().map(super::spec::SceneSpec::name).filter(|name| scenes.matches(name))
    {
        for method in study.spec.methods.as_ref() {
            let name = method.name.as_ref();
            if !methods.matches(name) || !pattern(method.scenes.as_ref()).matches(&scene) {
                continue;
            }
            let within = |x: f64| spec.range.is_none_or(|[low, high]| (low..=high).contains(&x));
            let of = |cell: &&CellFound| cell.scene == scene && cell.method == *name && within(cell.cell.x);
            all.push(Series {
                spec,
                scene: scene.clone(),
                method: name.clone(),
                renderer: method.renderer,
                x_name: method.vary.as_ref().map_or("spp".into(), |vary| vary.name.as_ref().clone()),
                cells: cells.iter().filter(of).collect(),
            });
        }
    }
    all
}

/// The point of a cell in a plot; None if the quantity, its standard error or x is unknown.
pub(super) fn point(cell: &CellFound, y: Quantity, masked: bool, axis: Axis) -> Option<Point> {
    let found = cell.quantity(y, masked)?;
    let x = match axis {
        Axis::X => cell.cell.x,
        Axis::CoreSeconds => cell.core_seconds?.value,
    };
    Some(Point { x, y: found.value, std_error: found.std_error?, dof: (cell.seeds - 1) as f64 })
}

impl Series<'_> {
    fn is_left_out(&self) -> bool {
        self.cells.is_empty() && self.renderer != RendererName::Etendue
    }

    fn fit(&self, criteria: FitCriteria) -> Fit {
        let spec = self.spec;
        let criteria = FitCriteria { widest: spec.half_width.unwrap_or(criteria.widest), ..criteria };
        let points: Vec<Point> =
            self.cells.iter().filter_map(|cell| point(cell, spec.y, spec.masked, spec.x)).collect();
        let found = self.found(&points);
        // A cell whose value has no logarithm makes the series incomplete, too.
        let complete = points.len() == self.cells.len() && !points.is_empty();
        let why = if self.is_left_out() { String::new() } else { self.why(&found, complete, &criteria) };
        Fit {
            name: spec.title(),
            scene: self.scene.clone(),
            method: self.method.clone(),
            y: spec.y,
            masked: spec.masked,
            x: spec.x,
            x_name: self.x_name.clone(),
            predicted: self.predicted(),
            predicted_slope: spec.slope,
            holds: (spec.is_prediction() && !self.is_left_out()).then_some(why.is_empty()),
            found,
            why,
            criteria,
            points,
        }
    }

    fn found(&self, points: &[Point]) -> FitResult {
        let spec = self.spec;
        if spec.zero {
            return if points.is_empty() { FitResult::Nothing } else { FitResult::Zero(amplitude::all_zero(points)) };
        }
        let Some(curves) = &spec.finite_n else {
            return Slope::weighted(points).map_or(FitResult::Nothing, FitResult::Slope);
        };
        let values: Vec<Vec<f64>> = curves.iter().map(|curve| points.iter().map(|p| curve.at(p.x)).collect()).collect();
        let fit = Amplitudes::fit(points, &values);
        fit.map_or(FitResult::Nothing, |fit| FitResult::Curves { curves: curves.clone(), fit })
    }

    /// The prediction in words; empty if there is none.
    fn predicted(&self) -> String {
        let spec = self.spec;
        if spec.zero {
            return "0".into();
        }
        if let Some(curves) = &spec.finite_n {
            let factor = |i: usize| spec.amplitudes.get(i).map_or(["a", "b"][i].to_owned(), |x| significant(*x, 5));
            let part = |(i, curve): (usize, &Curve)| match curve {
                Curve::Constant => factor(i),
                _ => format!("{} · {}", factor(i), curve.words()),
            };
            return curves.iter().enumerate().map(part).collect::<Vec<_>>().join(" + ");
        }
        match (spec.slope, spec.slope_within) {
            (Some(slope), _) => format!("slope {}", significant(slope, 4)),
            (_, Some([low, high])) => format!("slope between {low} and {high}"),
            _ => String::new(),
        }
    }

    /// Why the prediction does not hold; empty if it holds or there is none.
    fn why(&self, found: &FitResult, complete: bool, criteria: &FitCriteria) -> String {
        let spec = self.spec;
        let mut reasons = Vec::new();
        let mut unless = |fine: bool, reason: String| {
            if !fine {
                reasons.push(reason);
            }
        };
        if !spec.is_prediction() {
            return String::new();
        }
        unless(complete, "not every cell has a value with a standard error".into());
        let chi2 = match found {
            FitResult::Nothing => {
                unless(false, "there are too few points to fit, or some values have no logarithm".into());
                None
            }
            FitResult::Zero(chi2) => Some(*chi2),
            FitResult::Slope(slope) => {
                let half = slope.half_width(criteria.outside);
                if let Some(predicted) = spec.slope {
                    unless(
                        (slope.slope - predicted).abs() <= half,
                        "the prediction lies outside of the interval".into(),
                    );
                }
                if let Some([low, high]) = spec.slope_within {
                    let inside = low <= slope.slope - half && slope.slope + half <= high;
                    unless(inside, "the interval of the slope is not within the predicted range".into());
                }
                let widest = criteria.widest;
                unless(
                    spec.slope.is_none() || half < widest,
                    format!("the half-width of the interval is {widest} or more, too wide to decide"),
                );
                // A predicted range of slopes does not require a straight line.
                spec.slope.is_some().then_some(slope.residuals)
            }
            FitResult::Curves { fit, .. } => {
                for (found, predicted) in fit.amplitudes.iter().zip(&spec.amplitudes) {
                    let half = found.half_width(criteria.outside, fit.dof);
                    unless(
                        (found.value - predicted).abs() <= half,
                        format!("the predicted amplitude {predicted} lies outside of the interval"),
                    );
                }
                Some(fit.residuals)
            }
        };
        if let Some(chi2) = chi2 {
            unless(
                chi2.p > criteria.level,
                format!("the points scatter more than their standard errors explain (p = {:.2e})", chi2.p),
            );
        }
        reasons.join("; ")
    }
}

impl FitResult {
    /// The result in words.
    pub(super) fn words(&self) -> String {
        match self {
            Self::Slope(s) => format!("slope {:.4} ± {:.4}", s.slope, s.half_width),
            Self::Curves { fit, .. } => {
                let part = |a: &amplitude::Amplitude| format!("{:.4e} ± {:.1e}", a.value, a.half_width);
                format!("amplitude {}", fit.amplitudes.iter().map(part).collect::<Vec<_>>().join(", "))
            }
            Self::Zero(chi2) => format!("χ² {:.1} of {} dof", chi2.statistic, chi2.dof),
            Self::Nothing => "no fit".into(),
        }
    }

    /// The chi-square test of the residuals; None without a fit.
    pub(super) fn residuals(&self) -> Option<Chi2> {
        match self {
            Self::Slope(slope) => Some(slope.residuals),
            Self::Curves { fit, .. } => Some(fit.residuals),
            Self::Zero(chi2) => Some(*chi2),
            Self::Nothing => None,
        }
    }
}

impl Fit {
    /// The result as one line for the terminal.
    pub(super) fn line(&self) -> String {
        let mark = match self.holds {
            Some(true) => "holds",
            Some(false) => "FAILS",
            None => "found",
        };
        let residuals = self.found.residuals().map_or(String::new(), |chi2| format!(", residuals p = {:.3}", chi2.p));
        let predicted =
            if self.predicted.is_empty() { String::new() } else { format!(" (predicted: {})", self.predicted) };
        let why = if self.why.is_empty() { String::new() } else { format!(": {}", self.why) };
        let Self { name, scene, method, .. } = self;
        format!("{mark}  {name}, {method} on {scene}: {}{residuals}{predicted}{why}", self.found.words())
    }

    /// The value at x of the prediction, or of the fitted line where no slope is predicted. None if there is no curve.
    pub(super) fn at(&self, x: f64) -> Option<f64> {
        match &self.found {
            FitResult::Slope(slope) => match self.predicted_slope {
                Some(predicted) => Some((slope.level + predicted * (x.ln() - slope.anchor)).exp()),
                None => Some(slope.at(x)),
            },
            FitResult::Curves { curves, fit } => {
                Some(curves.iter().zip(&fit.amplitudes).map(|(curve, a)| a.value * curve.at(x)).sum())
            }
            FitResult::Zero(_) | FitResult::Nothing => None,
        }
    }
}
