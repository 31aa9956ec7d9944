//! The plots of a scene.

use std::collections::BTreeSet;

use super::{
    Study,
    fits::{Fit, FitResult},
    plan,
    spec::{Axis, Quantity},
    tables::CellFound,
};
use crate::plot::{self, Layer, Plot, Point, Shape, Style};

/// A plot of a scene.
#[derive(Debug)]
pub(super) struct Drawing {
    /// The name of its SVG file.
    pub(super) file: String,
    /// The caption.
    pub(super) words: String,
    pub(super) plot: Plot,
}

/// The subject of a plot: a quantity of a scene over an axis.
#[derive(Clone, Copy)]
struct Subject<'s> {
    scene: &'s str,
    y: Quantity,
    masked: bool,
    x: Axis,
    x_name: &'s str,
}

/// The plots of a scene: the RMSE and every fitted quantity, over the varied parameter and over core-seconds.
pub(super) fn of_scene(study: &Study, scene: &str, cells: &[&CellFound], fits: &[Fit]) -> Vec<Drawing> {
    let fitted = fits.iter().filter(|fit| fit.scene == scene && fit.y != Quantity::Bias).map(|fit| (fit.y, fit.masked));
    let wanted: BTreeSet<(Quantity, bool)> = fitted.chain([(Quantity::Rmse, false)]).collect();
    let names: BTreeSet<&str> = cells.iter().map(|cell| cell.cell.x_name.as_str()).collect();
    let mut all = Vec::new();
    for &(y, masked) in &wanted {
        for x_name in &names {
            let own: Vec<_> = cells.iter().copied().filter(|cell| cell.cell.x_name == *x_name).collect();
            all.push(Subject { scene, y, masked, x: Axis::X, x_name }.drawing(study, &own, fits));
        }
    }
    if cells.iter().any(|cell| cell.core_seconds.is_some()) {
        for &(y, masked) in wanted.iter().filter(|(y, _)| matches!(y, Quantity::Rmse | Quantity::Mse)) {
            let subject = Subject { scene, y, masked, x: Axis::CoreSeconds, x_name: "core-seconds" };
            all.push(subject.drawing(study, cells, fits));
        }
    }
    all
}

impl Subject<'_> {
    fn drawing(self, study: &Study, cells: &[&CellFound], fits: &[Fit]) -> Drawing {
        let Self { scene, y, masked, x, x_name } = self;
        let mut layers = Vec::new();
        for (number, method) in study.spec.methods.as_ref().iter().enumerate() {
            let name = method.name.as_ref();
            let style = Style::Series(number);
            let points: Vec<Point> =
                cells.iter().filter(|cell| cell.method == *name).filter_map(|cell| self.point(cell)).collect();
            if points.is_empty() {
                continue;
            }
            let of_method = |fit: &&Fit| fit.method == *name && self.is_of(fit) && predicts(fit);
            let prediction = fits.iter().find(of_method).map_or_else(Vec::new, |fit| line(fit, &points));
            layers.push(Layer { label: name.clone(), style, shape: Shape::Points { points, joined: true } });
            if !prediction.is_empty() {
                let shape = Shape::Line { points: prediction, is_dashed: true };
                layers.push(Layer { label: "predicted".into(), style, shape });
            }
        }
        let x_title = match (x, x_name) {
            (Axis::CoreSeconds, _) => "time of a run, in core-seconds".to_owned(),
            (Axis::X, "spp") => "samples per pixel".to_owned(),
            (Axis::X, name) => name.replace('_', " "),
        };
        let y_title = format!("{}{}", y.title(), if masked { " in the mask" } else { "" });
        let id = plan::identifier(&format!("{scene}.{}{}.{x_name}", y.name(), if masked { "-masked" } else { "" }));
        let words = format!("{y_title} over {x_title}");
        let (x, y) = (plot::Axis::log(x_title), plot::Axis::log(y_title));
        Drawing { file: format!("{id}.svg"), words, plot: Plot { title: scene.to_owned(), x, y, layers } }
    }

    fn point(&self, cell: &CellFound) -> Option<Point> {
        let found = cell.quantity(self.y, self.masked)?;
        let x = match self.x {
            Axis::X => cell.cell.x,
            Axis::CoreSeconds => cell.core_seconds?.value,
        };
        (x > 0.0).then_some(Point { x, y: found.value, std_error: found.std_error })
    }

    fn is_of(&self, fit: &Fit) -> bool {
        fit.scene == self.scene && (fit.y, fit.masked, fit.x) == (self.y, self.masked, self.x)
    }
}

/// Whether the prediction of a fit can be drawn.
fn predicts(fit: &Fit) -> bool {
    fit.predicted_slope.is_some() || matches!(fit.found, FitResult::Curves { .. })
}

/// The prediction of a fit as a polyline over the range of its points.
fn line(fit: &Fit, points: &[Point]) -> Vec<[f64; 2]> {
    const STEPS: u32 = 48;
    let held = |[low, high]: [f64; 2], point: &Point| [low.min(point.x), high.max(point.x)];
    let [low, high] = points.iter().fold([f64::INFINITY, 0.0], held);
    let at = |step: u32| low * (high / low).powf(f64::from(step) / f64::from(STEPS));
    (0..=STEPS).filter_map(|step| Some([at(step), fit.at(at(step))?])).collect()
}
