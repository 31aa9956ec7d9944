//! The page of a study, and its drawings.

use std::collections::BTreeSet;

use minijinja::value::Serde;
use serde::Serialize;

use super::{
    Evaluation, Plan, Study, StudyError,
    contest::Contest,
    fits::{Fit, Found},
    form::{Axis, Quantity},
    plot::{Curve, Dot, Plot},
    spread::Uncertain,
    tables::CellFound,
};
use crate::{
    film::exr::write_whole,
    provenance,
    report::{self, number},
};

/// What is on the page.
#[derive(Debug, Serialize)]
struct Page<'s> {
    style: &'static str,
    title: &'s str,
    about: Vec<&'s str>,
    name: &'s str,
    version: String,
    made: String,
    command: &'s str,
    seeds: u32,
    missing: usize,
    /// How many predictions there are, and how many of them fail.
    predictions: usize,
    failed: usize,
    /// What the predictions share.
    demand: Option<DemandView>,
    fits: Vec<FitView>,
    contests: Vec<ContestView>,
    scenes: Vec<SceneView>,
}

#[derive(Debug, Serialize)]
struct DemandView {
    confidence: String,
    level: String,
}

#[derive(Debug, Serialize)]
struct FitView {
    name: String,
    method: String,
    scene: String,
    predicted: String,
    found: String,
    residuals: String,
    verdict: Verdict,
    why: String,
}

#[derive(Debug, Serialize)]
struct ContestView {
    methods: String,
    scene: String,
    what: String,
    found: String,
    predicted: String,
    verdict: Verdict,
    why: String,
}

/// Pass or fail for the eye.
#[derive(Clone, Copy, Debug, Serialize)]
struct Verdict {
    symbol: &'static str,
    word: &'static str,
    class: &'static str,
}

impl Verdict {
    fn new(holds: Option<bool>) -> Self {
        match holds {
            Some(true) => Self { symbol: "✓", word: "holds", class: "pass" },
            Some(false) => Self { symbol: "✗", word: "fails", class: "fail" },
            None => Self { symbol: "–", word: "nothing predicted", class: "open" },
        }
    }
}

#[derive(Debug, Serialize)]
struct SceneView {
    name: String,
    reference: String,
    plots: Vec<PlotView>,
    rows: Vec<RowView>,
    /// Whether a mask is given.
    masked: bool,
}

#[derive(Debug, Serialize)]
struct PlotView {
    file: String,
    words: String,
}

#[derive(Debug, Serialize)]
struct RowView {
    method: String,
    x_name: String,
    x: String,
    seeds: usize,
    rmse: String,
    masked: String,
    variance: String,
    bias: String,
    flip: String,
    ssim: String,
    time: String,
    memory: String,
    efficiency: String,
}

/// Writes the drawings and the page.
///
/// # Errors
/// If they cannot be written.
pub(super) fn write(study: &Study, plan: &Plan, evaluation: &Evaluation, command: &str) -> Result<(), StudyError> {
    let mut scenes = Vec::new();
    for form in study.form.scenes.as_ref() {
        let name = form.name();
        let cells: Vec<&CellFound> = evaluation.cells.iter().filter(|cell| cell.scene == name).collect();
        let mut plots = Vec::new();
        for (file, words, plot) in drawings(study, &name, &cells, &evaluation.fits) {
            if let Some(svg) = plot.draw() {
                write_whole(&plan.folder.join(&file), svg.as_bytes())?;
                plots.push(PlotView { file, words });
            }
        }
        scenes.push(SceneView {
            reference: reference(study, &name, &cells),
            masked: form.mask.is_some(),
            rows: cells.iter().map(|cell| RowView::new(cell)).collect(),
            plots,
            name,
        });
    }
    let page = Page::new(study, evaluation, command, scenes);
    let environment = report::environment(&[("study.html", include_str!("study.html"))]);
    let template = environment.get_template("study.html").expect("it was added");
    let html = template.render(Serde(page)).expect("the template uses what the page has");
    Ok(write_whole(&evaluation.page, html.as_bytes())?)
}

impl<'s> Page<'s> {
    fn new(study: &'s Study, evaluation: &Evaluation, command: &'s str, scenes: Vec<SceneView>) -> Self {
        let fits = evaluation.fits.iter().map(|fit| fit.holds);
        let verdicts: Vec<bool> =
            fits.chain(evaluation.contests.iter().map(|contest| contest.holds)).flatten().collect();
        let judged = evaluation.fits.iter().find(|fit| fit.holds.is_some());
        Self {
            style: include_str!("../report/style.css"),
            title: study.title(),
            about: study.form.about.split("\n\n").map(str::trim).filter(|text| !text.is_empty()).collect(),
            name: &study.name,
            version: provenance::version(),
            made: report::now(),
            command,
            seeds: *study.form.seeds.as_ref(),
            missing: evaluation.missing,
            predictions: verdicts.len(),
            failed: verdicts.iter().filter(|holds| !**holds).count(),
            demand: judged.map(|fit| DemandView {
                confidence: number::significant(100.0 * (1.0 - fit.demand.outside), 4),
                level: number::significant(fit.demand.level, 2),
            }),
            fits: evaluation.fits.iter().map(FitView::new).collect(),
            contests: evaluation.contests.iter().map(ContestView::new).collect(),
            scenes,
        }
    }
}

impl FitView {
    fn new(fit: &Fit) -> Self {
        let with =
            |value: f64, half: f64| format!("{} ± {}", number::significant(value, 5), number::significant(half, 2));
        let found = match &fit.found {
            Found::Slope(s) => format!("slope {}", with(s.slope, s.half_width)),
            Found::Curves { fit, .. } => {
                let all: Vec<_> = fit.amplitudes.iter().map(|a| with(a.value, a.half_width)).collect();
                format!("amplitude{} {}", if all.len() == 1 { "" } else { "s" }, all.join(" and "))
            }
            Found::Zero(_) | Found::Nothing => fit.found.words(),
        };
        Self {
            name: fit.name.clone(),
            method: fit.method.clone(),
            scene: fit.scene.clone(),
            predicted: fit.predicted.clone(),
            found,
            residuals: fit.found.residuals().map_or(String::new(), |chi2| {
                format!(
                    "χ² {} of {}, p = {}",
                    number::significant(chi2.statistic, 3),
                    chi2.dof,
                    number::probability(chi2.p)
                )
            }),
            verdict: Verdict::new(fit.holds),
            why: fit.why.clone(),
        }
    }
}

impl ContestView {
    fn new(contest: &Contest) -> Self {
        let [a, b] = &contest.methods;
        let masked = if contest.masked { " in the mask" } else { "" };
        Self {
            methods: format!("{a} over {b}"),
            scene: contest.scene.clone(),
            what: format!("{}{masked}", contest.y.title()),
            found: contest.words(),
            predicted: contest.lower.as_ref().map_or(String::new(), |lower| format!("{lower} is lower")),
            verdict: Verdict::new(contest.holds),
            why: contest.why.clone(),
        }
    }
}

impl RowView {
    fn new(cell: &CellFound) -> Self {
        let with = |x: Option<Uncertain>| match x {
            None => "–".to_owned(),
            Some(Uncertain { value, std_error: None }) => number::significant(value, 3),
            Some(Uncertain { value, std_error: Some(error) }) => {
                format!("{} ± {}", number::significant(value, 3), number::significant(error, 2))
            }
        };
        let plain = |x: Option<f64>, digits| x.map_or("–".to_owned(), |x| number::significant(x, digits));
        Self {
            method: cell.method.clone(),
            x_name: cell.cell.x_name.clone(),
            x: number::significant(cell.cell.x, 6),
            seeds: cell.seeds,
            rmse: with(cell.quantity(Quantity::Rmse, false)),
            masked: with(cell.quantity(Quantity::Rmse, true)),
            variance: with(cell.quantity(Quantity::Variance, false)),
            bias: with(cell.quantity(Quantity::BiasSquared, false)),
            flip: plain(cell.flip.map(|x| x.value), 3),
            ssim: plain(cell.ssim.map(|x| x.value), 4),
            time: plain(cell.core_seconds.or(cell.seconds).map(|x| x.value), 3),
            memory: plain(cell.peak_bytes.map(|bytes| bytes / 1e6), 3),
            efficiency: plain(cell.efficiency(false).map(|x| x.value), 3),
        }
    }
}

/// What the scene is held to, and how noisy that is.
fn reference(study: &Study, name: &str, cells: &[&CellFound]) -> String {
    use super::form::ReferenceForm::{Folder, Image, Render, Value};
    let Some(form) = study.form.scenes.as_ref().iter().find(|scene| scene.name() == name) else { return String::new() };
    let what = match form.reference.as_ref() {
        Value([r, g, b]) => format!("a closed form, ({r}, {g}, {b}) everywhere"),
        Folder(folder) => format!("the reference {}", study.path(folder).display()),
        Image(file) => format!("the image {}", study.path(file).display()),
        Render(render) => format!(
            "{} of {} with {} samples a pixel",
            if render.seeds == 1 { "a run".to_owned() } else { format!("{} runs", render.seeds) },
            render.integrator.as_deref().unwrap_or("the scene's integrator"),
            render.spp
        ),
    };
    let noise = match cells.first().map(|cell| cell.whole.reference_noise) {
        Some(None) => "; its noise is not known and was not subtracted".to_owned(),
        Some(Some(noise)) if noise > 0.0 => {
            format!("; the mean variance of its noise, {}, was subtracted", number::significant(noise, 2))
        }
        _ => String::new(),
    };
    let layer = form.layer.as_ref().map_or(String::new(), |layer| format!(" The layer is {layer}."));
    format!("Held to {what}{noise}.{layer}")
}

/// The drawings of a scene: the RMSE and all that is fitted, over what is varied and over the time of all cores.
fn drawings(study: &Study, scene: &str, cells: &[&CellFound], fits: &[Fit]) -> Vec<(String, String, Plot)> {
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
    for (style, method) in study.form.methods.as_ref().iter().enumerate() {
        let own = cells.iter().filter(|cell| cell.method == *method.name.as_ref());
        let dots: Vec<Dot> = own.filter_map(|cell| dot(cell, y, masked, axis)).collect();
        if dots.is_empty() {
            continue;
        }
        let belongs = |fit: &&Fit| {
            fit.scene == scene && fit.method == *method.name.as_ref() && (fit.y, fit.masked, fit.x) == (y, masked, axis)
        };
        let predicts = |fit: &&Fit| fit.predicted_slope.is_some() || matches!(fit.found, Found::Curves { .. });
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
