//! Which drawings a scene gets, and what is on them.

use std::collections::BTreeSet;

use super::{
    Study,
    fits::{Fit, FitResult},
    plot::{Curve, Dot, Plot},
    spec::{Axis, Quantity},
    tables::CellFound,
};

/// The drawings of a scene: the RMSE and all that is fitted, over what is varied and over the time of all cores. The name of
/// each one's file, what it shows, and itself.
pub(super) fn of_scene(study: &Study, scene: &str, cells: &[&CellFound], fits: &[Fit]) -> Vec<(String, String, Plot)> {
    let fitted = fits.iter().filter(|fit| fit.scene == scene && fit.y != Quantity::Bias).map(|fit| (fit.y, fit.masked));
    let wanted: BTreeSet<(Quantity, bool)> = fitted.chain([(Quantity::Rmse, false)]).collect();
    let names: BTreeSet<&str> = cells.iter().map(|cell| cell.cell.x_name.as_str()).collect();
    let mut all = Vec::new();
    for &(y, masked) in &wanted {
        for x_name in &names {
            let own: Vec<_> = cells.iter().copied().filter(|cell| cell.cell.x_name == *x_name).collect();
            all.push(drawing(study, scene, &own, fits, (y, masked), Axis::X, x_name));
        }
    }
    if cells.iter().any(|cell| cell.core_seconds.is_some()) {
        for &(y, masked) in wanted.iter().filter(|(y, _)| matches!(y, Quantity::Rmse | Quantity::Mse)) {
            all.push(drawing(study, scene, cells, fits, (y, masked), Axis::CoreSeconds, "core-seconds"));
        }
    }
    all
}

fn drawing(
    study: &Study,
    scene: &str,
    cells: &[&CellFound],
    fits: &[Fit],
    (y, masked): (Quantity, bool),
    axis: Axis,
    x_name: &str,
) -> (String, String, Plot) {
    let title = format!("{}{}", y.title(), if masked { " in the mask" } else { "" });
    let mut curves = Vec::new();
    for (style, method) in study.spec.methods.as_ref().iter().enumerate() {
        let own = cells.iter().filter(|cell| cell.method == *method.name.as_ref());
        let dots: Vec<Dot> = own.filter_map(|cell| dot(cell, y, masked, axis)).collect();
        if dots.is_empty() {
            continue;
        }
        let belongs = |fit: &&Fit| {
            fit.scene == scene && fit.method == *method.name.as_ref() && (fit.y, fit.masked, fit.x) == (y, masked, axis)
        };
        let predicts = |fit: &&Fit| fit.predicted_slope.is_some() || matches!(fit.found, FitResult::Curves { .. });
        let prediction = fits.iter().filter(belongs).find(predicts).map_or_else(Vec::new, |fit| line(fit, &dots));
        curves.push(Curve { label: method.name.as_ref().clone(), style, dots, prediction });
    }
    let x_title = match (axis, x_name) {
        (Axis::CoreSeconds, _) => "core-seconds of a run".to_owned(),
        (Axis::X, "spp") => "samples per pixel".to_owned(),
        (Axis::X, name) => name.replace('_', " "),
    };
    let id = super::plan::identifier(&format!("{scene}.{}{}.{x_name}", y.name(), if masked { "-masked" } else { "" }));
    let words = format!("{title} over {x_title}");
    (format!("{id}.svg"), words, Plot { title: scene.to_owned(), x_title, y_title: title, curves })
}

fn dot(cell: &CellFound, y: Quantity, masked: bool, axis: Axis) -> Option<Dot> {
    let found = cell.quantity(y, masked)?;
    let x = match axis {
        Axis::X => cell.cell.x,
        Axis::CoreSeconds => cell.core_seconds?.value,
    };
    (x > 0.0).then_some(Dot { x, y: found.value, std_error: found.std_error })
}

/// The prediction of a fit over the range of its points.
fn line(fit: &Fit, dots: &[Dot]) -> Vec<[f64; 2]> {
    const STEPS: u32 = 48;
    let (low, high) = dots.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), dot| (low.min(dot.x), high.max(dot.x)));
    let at = |step: u32| low * (high / low).powf(f64::from(step) / f64::from(STEPS));
    (0..=STEPS).filter_map(|step| Some([at(step), fit.at(at(step))?])).filter(|[_, y]| *y > 0.0).collect()
}
