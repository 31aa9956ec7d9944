//! The HTML page of a study, and its plots.

use minijinja::value::Serde;
use serde::Serialize;

use super::{
    Evaluation, Plan, Study, StudyError,
    comparison::MethodComparison,
    drawings::{self, Drawing},
    error_decomposition::Uncertain,
    fits::{Fit, FitResult},
    spec::Quantity,
    tables::CellFound,
};
use crate::{
    film::exr::write_whole,
    provenance,
    report::{self, Mark, number},
};

/// The content of the page.
#[derive(Debug, Serialize)]
struct Page<'s> {
    style: String,
    title: &'s str,
    description: Vec<&'s str>,
    name: &'s str,
    version: String,
    made: String,
    command: &'s str,
    seeds: u32,
    missing: usize,
    /// The number of predictions.
    predictions: usize,
    /// The number of predictions that fail.
    failed: usize,
    /// The criteria that all predictions share.
    criteria: Option<CriteriaView>,
    fits: Vec<FitView>,
    comparisons: Vec<ComparisonView>,
    scenes: Vec<SceneView>,
}

#[derive(Debug, Serialize)]
struct CriteriaView {
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
    verdict: Mark,
    why: String,
}

#[derive(Debug, Serialize)]
struct ComparisonView {
    methods: String,
    scene: String,
    what: String,
    found: String,
    predicted: String,
    verdict: Mark,
    why: String,
}

#[derive(Debug, Serialize)]
struct SceneView {
    name: String,
    reference: String,
    plots: Vec<PlotView>,
    rows: Vec<RowView>,
    /// Whether the scene has a mask.
    masked: bool,
}

#[derive(Debug, Serialize)]
struct PlotView {
    svg: String,
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

/// Writes the plots and the page.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn write(study: &Study, plan: &Plan, evaluation: &Evaluation, command: &str) -> Result<(), StudyError> {
    let mut scenes = Vec::new();
    for spec in study.spec.scenes.as_ref() {
        let name = spec.name();
        let cells: Vec<&CellFound> = evaluation.cells.iter().filter(|cell| cell.scene == name).collect();
        let mut plots = Vec::new();
        for Drawing { file, words, plot } in drawings::of_scene(study, &name, &cells, &evaluation.fits) {
            if let (Some(svg), Some(alone)) = (plot.inline(), plot.file()) {
                write_whole(&plan.folder.join(&file), alone.as_bytes())?;
                plots.push(PlotView { svg, file, words });
            }
        }
        scenes.push(SceneView {
            reference: reference(study, &name, &cells),
            masked: spec.mask.is_some(),
            rows: cells.iter().map(|cell| RowView::new(cell)).collect(),
            plots,
            name,
        });
    }
    let page = Page::new(study, evaluation, command, scenes);
    let environment = report::environment(&[("study.html", include_str!("study.html"))]);
    let template = environment.get_template("study.html").expect("the template was added");
    let html = template.render(Serde(page)).expect("the page has every variable of the template");
    Ok(write_whole(&evaluation.page, html.as_bytes())?)
}

impl<'s> Page<'s> {
    fn new(study: &'s Study, evaluation: &Evaluation, command: &'s str, scenes: Vec<SceneView>) -> Self {
        let fits = evaluation.fits.iter().map(|fit| fit.holds);
        let verdicts: Vec<bool> =
            fits.chain(evaluation.comparisons.iter().map(|comparison| comparison.holds)).flatten().collect();
        let judged = evaluation.fits.iter().find(|fit| fit.holds.is_some());
        Self {
            style: report::style(),
            title: study.title(),
            description: study.spec.description.split("\n\n").map(str::trim).filter(|text| !text.is_empty()).collect(),
            name: &study.name,
            version: provenance::version(),
            made: report::now(),
            command,
            seeds: *study.spec.seeds.as_ref(),
            missing: evaluation.missing,
            predictions: verdicts.len(),
            failed: verdicts.iter().filter(|holds| !**holds).count(),
            criteria: judged.map(|fit| CriteriaView {
                confidence: number::significant(100.0 * (1.0 - fit.criteria.outside), 4),
                level: number::significant(fit.criteria.level, 2),
            }),
            fits: evaluation.fits.iter().map(FitView::new).collect(),
            comparisons: evaluation.comparisons.iter().map(ComparisonView::new).collect(),
            scenes,
        }
    }
}

impl FitView {
    fn new(fit: &Fit) -> Self {
        let with =
            |value: f64, half: f64| format!("{} ± {}", number::significant(value, 5), number::significant(half, 2));
        let found = match &fit.found {
            FitResult::Slope(s) => format!("slope {}", with(s.slope, s.half_width)),
            FitResult::Curves { fit, .. } => {
                let all: Vec<_> = fit.amplitudes.iter().map(|a| with(a.value, a.half_width)).collect();
                format!("amplitude{} {}", if all.len() == 1 { "" } else { "s" }, all.join(" and "))
            }
            FitResult::Zero(_) | FitResult::Nothing => fit.found.words(),
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
            verdict: Mark::of_prediction(fit.holds),
            why: fit.why.clone(),
        }
    }
}

impl ComparisonView {
    fn new(comparison: &MethodComparison) -> Self {
        let [a, b] = &comparison.methods;
        let masked = if comparison.masked { " in the mask" } else { "" };
        Self {
            methods: format!("{a} over {b}"),
            scene: comparison.scene.clone(),
            what: format!("{}{masked}", comparison.y.title()),
            found: comparison.words(),
            predicted: comparison.expected_lower.as_ref().map_or(String::new(), |lower| format!("{lower} is lower")),
            verdict: Mark::of_prediction(comparison.holds),
            why: comparison.why.clone(),
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

/// The reference of a scene and its noise, in words.
fn reference(study: &Study, name: &str, cells: &[&CellFound]) -> String {
    use super::spec::ReferenceSpec::{Folder, Image, Render, Value};
    let Some(spec) = study.spec.scenes.as_ref().iter().find(|scene| scene.name() == name) else { return String::new() };
    let what = match spec.reference.as_ref() {
        Value([r, g, b]) => format!("a closed form, ({r}, {g}, {b}) in every pixel"),
        Folder(folder) => format!("the reference {}", study.path(folder).display()),
        Image(file) => format!("the image {}", study.path(file).display()),
        Render(render) => format!(
            "{} of {} with {} samples per pixel",
            if render.seeds == 1 { "one run".to_owned() } else { format!("{} runs", render.seeds) },
            render.integrator.as_deref().unwrap_or("the scene's integrator"),
            render.spp
        ),
    };
    let noise = match cells.first().map(|cell| cell.whole.reference_noise) {
        Some(None) => "; its noise is unknown and was not subtracted".to_owned(),
        Some(Some(noise)) if noise > 0.0 => {
            format!("; the mean variance of its noise, {}, was subtracted", number::significant(noise, 2))
        }
        _ => String::new(),
    };
    let layer = spec.layer.as_ref().map_or(String::new(), |layer| format!(" Layer: {layer}."));
    format!("Compared with {what}{noise}.{layer}")
}
