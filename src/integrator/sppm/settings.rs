use crate::{
    integrator::{
        params::{HIDE_EMITTERS, MAX_DEPTH, PATH_CLASSES},
        photons::{KERNEL, PHOTON_RR_DEPTH, read_kernel, read_photon_path_limits},
    },
    photon::Kernel,
    scene::Scene,
    scene_file::{Param, ParamKind, Params, Range, SceneError},
    sensor::SensorModel as _,
    transport::PathLimits,
};

/// The parameters of progressive photon mapping.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) max_passes: Option<u32>,
    pub(super) photon_count: u64,
    /// The radius of the first pass in m; None means two pixel footprints.
    pub(super) initial_radius: Option<f64>,
    pub(super) alpha: f64,
    pub(super) schedule: Schedule,
    pub(super) kernel: Kernel,
    /// Whether emitter sampling finds direct light; otherwise photons do.
    pub(super) connects: bool,
    pub(super) limits: PathLimits,
    pub(super) hide_emitters: bool,
    pub(super) shows_classes: bool,
}

/// The rule by which radii shrink.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Schedule {
    /// The radius of each pixel shrinks with the photons that it finds.
    PerPixel,
    /// The radius of each pixel shrinks where its photons indicate bias.
    ErrorDriven,
    /// All radii shrink with the index of the pass.
    PerPass,
}

/// The radius of the first pass, in pixel footprints.
const INITIAL_PIXELS: f64 = 2.0;

pub(super) const PARAMS: &[Param] = &[
    Param::optional(
        "max_passes",
        ParamKind::Integer,
        "the sampler's sample_count",
        "passes, unless a render is given samples per pixel, which are passes",
    )
    .within(Range { min: 1.0, max: 4_294_967_295.0, open: false }),
    Param::new("photon_count", ParamKind::Integer, "250000", "photons emitted in each pass").within(Range {
        min: 1.0,
        max: 1e8,
        open: false,
    }),
    Param::new(
        "initial_radius",
        ParamKind::Float,
        "0",
        "the radius of the first pass in m; 0 takes two pixel footprints",
    )
    .within(Range { min: 0.0, max: f64::MAX, open: false }),
    Param::new("alpha", ParamKind::Float, "0.7", "the fraction of a pass's photons that stay within the shrunk radius")
        .within(Range { min: 0.0, max: 1.0, open: true }),
    Param::new(
        "radius_schedule",
        ParamKind::Choice(&["per_pixel", "error_driven", "per_pass"]),
        "per_pixel",
        "whether radii shrink with the photons that each pixel finds, where these indicate bias, or with the number of the pass",
    ),
    KERNEL,
    Param::new(
        "direct",
        ParamKind::Choice(&["traced", "map"]),
        "traced",
        "whether direct light is found by emitter sampling or from photons",
    ),
    MAX_DEPTH,
    PHOTON_RR_DEPTH,
    HIDE_EMITTERS,
    PATH_CLASSES,
];

impl Settings {
    pub(super) fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let initial_radius = params.float("initial_radius")?;
        let max_passes = match params.find("max_passes") {
            Some(_) => Some(params.integer("max_passes")?.unsigned_abs() as u32),
            None => None,
        };
        let schedule = match params.string("radius_schedule")? {
            "error_driven" => Schedule::ErrorDriven,
            "per_pass" => Schedule::PerPass,
            _ => Schedule::PerPixel,
        };
        Ok(Self {
            max_passes,
            photon_count: params.integer("photon_count")?.unsigned_abs(),
            initial_radius: (initial_radius > 0.0).then_some(initial_radius),
            alpha: params.float("alpha")?,
            schedule,
            kernel: read_kernel(params)?,
            connects: params.string("direct")? == "traced",
            limits: read_photon_path_limits(params)?,
            hide_emitters: params.boolean(HIDE_EMITTERS.name)?,
            shows_classes: params.boolean(PATH_CLASSES.name)?,
        })
    }

    /// The radius of the first pass in m, for a pixel footprint in m.
    pub(super) fn first_radius(&self, footprint: f64) -> f64 {
        self.initial_radius.unwrap_or(INITIAL_PIXELS * footprint)
    }

    /// A typical radius of the first pass in a scene, in m.
    pub(super) fn typical_radius(&self, scene: &Scene) -> f64 {
        let sphere = scene.scene_bounds();
        let size = if sphere.radius > 0.0 { sphere.radius } else { 1.0 };
        let seen = self.first_radius(scene.sensor.camera.footprint(sphere.centre).abs());
        if self.initial_radius.is_some() { seen } else { seen.clamp(1e-4 * size, 0.2 * size) }
    }
}
