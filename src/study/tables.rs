//! The columns of the tables of runs and cells.

use super::{
    Run, Study,
    error_decomposition::{ErrorDecomposition, Uncertain},
    ground_truth::Target,
    measures::Measures,
    plan::Cell,
    record::TableRow,
    spec::{Quantity, RendererName},
};
use crate::film::Image;

/// Time and memory used to render an image, from its header.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ResourceUse {
    pub(super) seconds: Option<f64>,
    pub(super) core_seconds: Option<f64>,
    pub(super) peak_bytes: Option<f64>,
}

impl ResourceUse {
    pub(super) fn of(attributes: &[(String, String)]) -> Self {
        let number = |name: &str| {
            let text = attributes.iter().find(|(known, _)| known == name).map(|(_, text)| text);
            text.and_then(|text| text.parse().ok()).filter(|x: &f64| x.is_finite() && *x >= 0.0)
        };
        Self {
            seconds: number("etendue.seconds"),
            core_seconds: number("etendue.core_seconds"),
            peak_bytes: number("etendue.peak_bytes"),
        }
    }
}

/// The measured errors and header attributes of a run.
#[derive(Clone, Debug)]
pub(super) struct RunResult {
    pub(super) measures: Measures,
    pub(super) cost: ResourceUse,
    integrator: Option<String>,
    sampler: Option<String>,
    spp: Option<u64>,
    version: Option<String>,
}

impl RunResult {
    pub(super) fn new(image: &Image, measures: Measures) -> Self {
        let text = |name: &str| image.attribute(name).map(str::to_owned);
        Self {
            measures,
            cost: ResourceUse::of(&image.attributes),
            integrator: text("etendue.integrator"),
            sampler: text("etendue.sampler"),
            spp: text("etendue.spp").and_then(|spp| spp.parse().ok()),
            version: text("etendue.version"),
        }
    }
}

pub(super) fn renderer(name: RendererName) -> &'static str {
    match name {
        RendererName::Etendue => "etendue",
        RendererName::Mitsuba => "mitsuba",
    }
}

/// The table row of a run.
pub(super) fn row(study: &Study, cell: &Cell, run: &Run, made: &RunResult, target: &Target) -> TableRow {
    let (m, header) = (&made.measures, &run.header);
    let mut row = TableRow::default();
    let planned = |name: &str| header.get(name).map(String::as_str);
    row.push("study", study.name.as_str());
    row.push("scene", study.spec.scenes.as_ref()[cell.scene].name().as_str());
    row.push("method", run.method.as_str());
    row.push("renderer", renderer(run.renderer));
    row.push("integrator", made.integrator.as_deref().or(planned("etendue.integrator")));
    row.push("sampler", made.sampler.as_deref().or(planned("etendue.sampler")));
    row.push("parameters", cell.parameters.as_str());
    row.push("x_name", cell.x_name.as_str());
    row.push("x", cell.x);
    row.push("spp", made.spp.unwrap_or(u64::from(cell.spp)));
    row.push("seed", run.seed);
    row.push("rmse", m.metrics.rmse);
    row.push("mse", m.metrics.rmse.powi(2));
    row.push("relative_mse", m.metrics.relative_mse);
    row.push("bias", m.metrics.bias);
    row.push("rmse_masked", m.rmse_masked);
    row.push("tile_rmse", m.worst_tile);
    row.push("tile_rmse_mean", m.mean_tile);
    row.push("flip", m.flip);
    row.push("ssim", m.ssim);
    row.push("seconds", made.cost.seconds);
    row.push("core_seconds", made.cost.core_seconds);
    row.push("peak_bytes", made.cost.peak_bytes.map(|bytes| bytes as u64));
    row.push("version", made.version.as_deref());
    row.push("reference", target.name.as_str());
    row.push("image", run.output.display().to_string().as_str());
    row
}

/// The results of a cell of which at least one run has an image.
#[derive(Clone, Debug)]
pub(super) struct CellFound {
    pub(super) cell: Cell,
    pub(super) scene: String,
    pub(super) method: String,
    pub(super) renderer: RendererName,
    /// The number of runs with an image.
    pub(super) seeds: usize,
    /// The errors over all pixels.
    pub(super) whole: ErrorDecomposition,
    /// The errors over the pixels of the mask; None without a mask.
    pub(super) masked: Option<ErrorDecomposition>,
    pub(super) relative_mse: Option<Uncertain>,
    pub(super) flip: Option<Uncertain>,
    pub(super) ssim: Option<Uncertain>,
    pub(super) seconds: Option<Uncertain>,
    pub(super) core_seconds: Option<Uncertain>,
    pub(super) peak_bytes: Option<f64>,
}

impl CellFound {
    /// The value of a quantity; None if unknown.
    pub(super) fn quantity(&self, what: Quantity, masked: bool) -> Option<Uncertain> {
        let error_decomposition = if masked { self.masked.as_ref()? } else { &self.whole };
        match what {
            Quantity::Mse => Some(error_decomposition.mse),
            Quantity::Rmse => error_decomposition.mse.root(),
            Quantity::Variance => error_decomposition.variance,
            Quantity::Bias => Some(error_decomposition.bias),
            Quantity::BiasSquared => error_decomposition.bias_squared,
            Quantity::BiasRms => error_decomposition.bias_squared?.root(),
            Quantity::RelativeMse => self.relative_mse.filter(|_| !masked),
        }
    }

    /// The efficiency 1 / (MSE x core-seconds), with its standard error to first order; None if either is unknown or
    /// not positive.
    pub(super) fn efficiency(&self, masked: bool) -> Option<Uncertain> {
        let (mse, time) = (self.quantity(Quantity::Mse, masked)?, self.core_seconds?);
        let value = 1.0 / (mse.value * time.value);
        let relative_error = |x: Uncertain| x.std_error.map(|error| error / x.value);
        let error = relative_error(mse).zip(relative_error(time)).map(|(a, b)| value * a.hypot(b));
        (mse.value > 0.0 && time.value > 0.0).then_some(Uncertain { value, std_error: error })
    }

    /// The table row of the cell.
    pub(super) fn record(&self, study: &Study) -> TableRow {
        let mut line = TableRow::default();
        line.push("study", study.name.as_str());
        line.push("cell", self.cell.id.as_str());
        line.push("scene", self.scene.as_str());
        line.push("method", self.method.as_str());
        line.push("renderer", renderer(self.renderer));
        line.push("parameters", self.cell.parameters.as_str());
        line.push("x_name", self.cell.x_name.as_str());
        line.push("x", self.cell.x);
        line.push("spp", u64::from(self.cell.spp));
        line.push("seeds", self.seeds as u64);
        let mut both = |names: [&'static str; 2], number: Option<Uncertain>| {
            line.push(names[0], number.map(|n| n.value));
            line.push(names[1], number.and_then(|n| n.std_error));
        };
        use Quantity::{Bias, BiasRms, BiasSquared, Mse, RelativeMse, Rmse, Variance};
        both(["rmse", "rmse_se"], self.quantity(Rmse, false));
        both(["mse", "mse_se"], self.quantity(Mse, false));
        both(["relative_mse", "relative_mse_se"], self.quantity(RelativeMse, false));
        both(["variance", "variance_se"], self.quantity(Variance, false));
        both(["bias", "bias_se"], self.quantity(Bias, false));
        both(["bias_squared", "bias_squared_se"], self.quantity(BiasSquared, false));
        both(["bias_rms", "bias_rms_se"], self.quantity(BiasRms, false));
        both(["rmse_masked", "rmse_masked_se"], self.quantity(Rmse, true));
        both(["mse_masked", "mse_masked_se"], self.quantity(Mse, true));
        both(["variance_masked", "variance_masked_se"], self.quantity(Variance, true));
        both(["bias_masked", "bias_masked_se"], self.quantity(Bias, true));
        both(["bias_squared_masked", "bias_squared_masked_se"], self.quantity(BiasSquared, true));
        both(["flip", "flip_se"], self.flip);
        both(["ssim", "ssim_se"], self.ssim);
        both(["seconds", "seconds_se"], self.seconds);
        both(["core_seconds", "core_seconds_se"], self.core_seconds);
        both(["efficiency", "efficiency_se"], self.efficiency(false));
        line.push("peak_bytes", self.peak_bytes.map(|bytes| bytes as u64));
        line.push("reference_noise", self.whole.reference_noise);
        line
    }
}
