//! Fits of cells: slopes and predicted curves, and whether they hold.

use glob::Pattern;
use serde::Serialize;

use super::{
    Study,
    form::{Axis, FitForm, Quantity, RendererName},
    tables::CellFound,
    theory::Curve,
};
use crate::{
    report::number::significant,
    stats::{Amplitudes, Chi2, Point, Slope, amplitude, slope::Demand},
};

/// What a fit of one method on one scene has found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Fit {
    /// What the study calls it.
    pub(super) name: String,
    pub(super) scene: String,
    pub(super) method: String,
    pub(super) y: Quantity,
    pub(super) masked: bool,
    pub(super) x: Axis,
    pub(super) x_name: String,
    /// In words; empty if nothing is predicted.
    pub(super) predicted: String,
    pub(super) found: Found,
    /// Where the prediction is drawn: the slope through the level that was found.
    pub(super) predicted_slope: Option<f64>,
    /// None if nothing is predicted, or nothing was rendered by a renderer that is not ours.
    pub(super) holds: Option<bool>,
    /// Why it does not hold.
    pub(super) why: String,
    /// What is asked of it.
    pub(super) demand: Demand,
    pub(super) points: Vec<Point>,
}

/// The numbers of a fit.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Found {
    /// A straight line.
    Slope(Slope),
    /// Amplitudes of predicted curves.
    Curves { curves: Vec<Curve>, fit: Amplitudes },
    /// Whether all points are 0.
    Zero(Chi2),
    /// There is nothing to fit.
    Nothing,
}

/// All fits of a study, one for each scene and method that matches.
pub(super) fn all(study: &Study, cells: &[CellFound]) -> Vec<Fit> {
    let series: Vec<_> = study.form.fits.iter().flat_map(|form| series_of(study, form.as_ref(), cells)).collect();
    // Predictions about renderers of which there is nothing are left out, and share nothing.
    let predictions = series.iter().filter(|series| series.form.is_prediction() && !series.is_left_out()).count();
    let demand = Demand::default().shared(predictions);
    series.into_iter().map(|series| series.fit(demand)).collect()
}

impl FitForm {
    fn is_prediction(&self) -> bool {
        self.slope.is_some() || self.slope_within.is_some() || self.finite_n.is_some() || self.zero
    }

    fn title(&self) -> String {
        let mask = if self.masked { " in the mask" } else { "" };
        self.name.clone().unwrap_or_else(|| format!("{}{mask}", self.y.title()))
    }
}

/// The cells of a method on a scene, in the order of x.
struct Series<'c> {
    form: &'c FitForm,
    scene: String,
    method: String,
    renderer: RendererName,
    x_name: String,
    cells: Vec<&'c CellFound>,
}

fn series_of<'c>(study: &'c Study, form: &'c FitForm, cells: &'c [CellFound]) -> Vec<Series<'c>> {
    let pattern = |text: &str| Pattern::new(text).expect("patterns were checked");
    let (scenes, methods) = (pattern(form.scenes.as_ref()), pattern(form.methods.as_ref()));
    let mut all = Vec::new();
    for scene in study.form.scenes.as_ref().iter().map(super::form::SceneForm::name).filter(|name| scenes.matches(name))
    {
        for method in study.form.methods.as_ref() {
            let name = method.name.as_ref();
            if !methods.matches(name) || !pattern(method.scenes.as_ref()).matches(&scene) {
                continue;
            }
            let within = |x: f64| form.range.is_none_or(|[low, high]| (low..=high).contains(&x));
            let of = |cell: &&CellFound| cell.scene == scene && cell.method == *name && within(cell.cell.x);
            all.push(Series {
                form,
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

/// The point of a cell in a diagram; None if it lacks what is asked for.
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

    fn fit(&self, demand: Demand) -> Fit {
        let form = self.form;
        let demand = Demand { widest: form.half_width.unwrap_or(demand.widest), ..demand };
        let points: Vec<Point> =
            self.cells.iter().filter_map(|cell| point(cell, form.y, form.masked, form.x)).collect();
        let found = self.found(&points);
        // A point that has no logarithm is missed too.
        let complete = points.len() == self.cells.len() && !points.is_empty();
        let why = if self.is_left_out() { String::new() } else { self.why(&found, complete, &demand) };
        Fit {
            name: form.title(),
            scene: self.scene.clone(),
            method: self.method.clone(),
            y: form.y,
            masked: form.masked,
            x: form.x,
            x_name: self.x_name.clone(),
            predicted: self.predicted(),
            predicted_slope: form.slope,
            holds: (form.is_prediction() && !self.is_left_out()).then_some(why.is_empty()),
            found,
            why,
            demand,
            points,
        }
    }

    fn found(&self, points: &[Point]) -> Found {
        let form = self.form;
        if form.zero {
            return if points.is_empty() { Found::Nothing } else { Found::Zero(amplitude::all_zero(points)) };
        }
        let Some(curves) = &form.finite_n else {
            return Slope::weighted(points).map_or(Found::Nothing, Found::Slope);
        };
        let values: Vec<Vec<f64>> = curves.iter().map(|curve| points.iter().map(|p| curve.at(p.x)).collect()).collect();
        let fit = Amplitudes::fit(points, &values);
        fit.map_or(Found::Nothing, |fit| Found::Curves { curves: curves.clone(), fit })
    }

    /// The prediction in words.
    fn predicted(&self) -> String {
        let form = self.form;
        if form.zero {
            return "0".into();
        }
        if let Some(curves) = &form.finite_n {
            let factor = |i: usize| form.amplitudes.get(i).map_or(["a", "b"][i].to_owned(), |x| significant(*x, 5));
            let part = |(i, curve): (usize, &Curve)| match curve {
                Curve::Constant => factor(i),
                _ => format!("{} · {}", factor(i), curve.words()),
            };
            return curves.iter().enumerate().map(part).collect::<Vec<_>>().join(" + ");
        }
        match (form.slope, form.slope_within) {
            (Some(slope), _) => format!("slope {}", significant(slope, 4)),
            (_, Some([low, high])) => format!("slope between {low} and {high}"),
            _ => String::new(),
        }
    }

    /// Why the prediction does not hold; empty if it does, or there is none.
    fn why(&self, found: &Found, complete: bool, demand: &Demand) -> String {
        let form = self.form;
        let mut reasons = Vec::new();
        let mut unless = |fine: bool, reason: String| {
            if !fine {
                reasons.push(reason);
            }
        };
        if !form.is_prediction() {
            return String::new();
        }
        unless(complete, "not every cell has a value with a standard error".into());
        let chi2 = match found {
            Found::Nothing => {
                unless(false, "there are too few points to fit, or values without logarithm".into());
                None
            }
            Found::Zero(chi2) => Some(*chi2),
            Found::Slope(slope) => {
                let half = slope.half_width(demand.outside);
                if let Some(predicted) = form.slope {
                    unless(
                        (slope.slope - predicted).abs() <= half,
                        "the prediction lies outside of the interval".into(),
                    );
                }
                if let Some([low, high]) = form.slope_within {
                    let inside = low <= slope.slope - half && slope.slope + half <= high;
                    unless(inside, "the interval of the slope reaches out of the range".into());
                }
                let widest = demand.widest;
                unless(
                    form.slope.is_none() || half < widest,
                    format!("the interval is wider than {widest}: it decides nothing"),
                );
                // A range says nothing of straightness.
                slope.residuals.filter(|_| form.slope.is_some())
            }
            Found::Curves { fit, .. } => {
                for (found, predicted) in fit.amplitudes.iter().zip(&form.amplitudes) {
                    let half = found.half_width(demand.outside, fit.dof);
                    unless(
                        (found.value - predicted).abs() <= half,
                        format!("the amplitude {predicted} lies outside of the interval"),
                    );
                }
                Some(fit.residuals)
            }
        };
        if let Some(chi2) = chi2 {
            unless(
                chi2.p > demand.level,
                format!("the points scatter more than their errors let them (p = {:.2e})", chi2.p),
            );
        }
        reasons.join("; ")
    }
}

impl Found {
    /// What was found, in words.
    pub(super) fn words(&self) -> String {
        match self {
            Self::Slope(s) => format!("slope {:.4} ± {:.4}", s.slope, s.half_width),
            Self::Curves { fit, .. } => {
                let part = |a: &amplitude::Amplitude| format!("{:.4e} ± {:.1e}", a.value, a.half_width);
                format!("amplitude {}", fit.amplitudes.iter().map(part).collect::<Vec<_>>().join(", "))
            }
            Self::Zero(chi2) => format!("χ² {:.1} of {} dof", chi2.statistic, chi2.dof),
            Self::Nothing => "nothing".into(),
        }
    }

    /// The test of its residuals.
    pub(super) fn residuals(&self) -> Option<Chi2> {
        match self {
            Self::Slope(slope) => slope.residuals,
            Self::Curves { fit, .. } => Some(fit.residuals),
            Self::Zero(chi2) => Some(*chi2),
            Self::Nothing => None,
        }
    }
}

impl Fit {
    /// A line for the terminal.
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

    /// What the fit gives at an x.
    pub(super) fn at(&self, x: f64) -> Option<f64> {
        match &self.found {
            Found::Slope(slope) => match self.predicted_slope {
                Some(predicted) => Some((slope.level + predicted * (x.ln() - slope.anchor)).exp()),
                None => Some(slope.at(x)),
            },
            Found::Curves { curves, fit } => {
                Some(curves.iter().zip(&fit.amplitudes).map(|(curve, a)| a.value * curve.at(x)).sum())
            }
            Found::Zero(_) | Found::Nothing => None,
        }
    }
}
