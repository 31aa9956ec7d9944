use std::num::NonZeroUsize;

use crate::{
    integrator::{
        params::{HIDE_EMITTERS, MAX_DEPTH},
        photons::{KERNEL, PHOTON_RR_DEPTH, read_kernel, read_photon_path_limits},
    },
    photon::{EstimateParameters, Kernel},
    scene::Scene,
    scene_file::{Param, ParamKind, Params, Range, SceneError},
    sensor::SensorModel as _,
    transport::PathLimits,
};

/// The parameters of a photon mapper.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) global_photons: u64,
    pub(super) caustic_photons: u64,
    nearest: Option<NonZeroUsize>,
    global_radius: Option<f64>,
    caustic_radius: Option<f64>,
    kernel: Kernel,
    pub(super) direct: Direct,
    /// The number of gather rays; None if indirect light comes from the map itself.
    pub(super) gather_samples: Option<u32>,
    pub(super) is_guided: bool,
    pub(super) shows_raw: bool,
    pub(super) limits: PathLimits,
    pub(super) hide_emitters: bool,
}

/// The method for direct light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direct {
    Traced,
    Map,
    ShadowPhotons,
}

/// Each photon takes 36 bytes, and each emitted photon may be stored several times.
const COUNT: Range = Range { min: 1.0, max: 1e8, open: false };

pub(super) const PARAMS: &[Param] = &[
    Param::new("global_photons", ParamKind::Integer, "250000", "photons emitted for the global map").within(COUNT),
    Param::new(
        "caustic_photons",
        ParamKind::Integer,
        "500000",
        "photons emitted at mirrors and glass for the caustic map",
    )
    .within(COUNT),
    Param::new(
        "lookup_size",
        ParamKind::Integer,
        "50",
        "the number of nearest photons in an estimate, of which the farthest only sets the radius; 0 uses all within \
         the radius",
    )
    .within(Range { min: 0.0, max: 1e6, open: false }),
    Param::optional(
        "global_lookup_radius",
        ParamKind::Float,
        "1/20 of the scene's radius, or two pixel footprints if that is more",
        "the maximum distance of photons of the global map, in m",
    )
    .within(Range::LENGTH),
    Param::optional(
        "caustic_lookup_radius",
        ParamKind::Float,
        "1/80 of the scene's radius, or two pixel footprints if that is more",
        "the maximum distance of photons of the caustic map, in m",
    )
    .within(Range::LENGTH),
    KERNEL,
    Param::new(
        "direct",
        ParamKind::Choice(&["traced", "map", "shadow_photons"]),
        "traced",
        "how direct light is found",
    ),
    Param::new("indirect", ParamKind::Choice(&["final_gather", "map"]), "final_gather", "how indirect light is found"),
    Param::new("gather_samples", ParamKind::Integer, "1", "gather rays at each point").within(Range {
        min: 1.0,
        max: 1e6,
        open: false,
    }),
    Param::new(
        "gather_importance",
        ParamKind::Boolean,
        "false",
        "whether gather rays are also sampled in proportion to the light in the map",
    ),
    Param::new(
        "raw_estimate",
        ParamKind::Boolean,
        "false",
        "whether to write a layer \"raw\" with the estimate of the global map",
    ),
    MAX_DEPTH,
    PHOTON_RR_DEPTH,
    HIDE_EMITTERS,
];

impl Settings {
    pub(super) fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let count = |name| params.integer(name).map(|count| count.unsigned_abs());
        let direct = match params.string("direct")? {
            "map" => Direct::Map,
            "shadow_photons" => Direct::ShadowPhotons,
            _ => Direct::Traced,
        };
        let gather_samples = count("gather_samples")? as u32;
        Ok(Self {
            global_photons: count("global_photons")?,
            caustic_photons: count("caustic_photons")?,
            nearest: Self::read_nearest(params)?,
            global_radius: params.optional_float("global_lookup_radius")?,
            caustic_radius: params.optional_float("caustic_lookup_radius")?,
            kernel: read_kernel(params)?,
            direct,
            gather_samples: (params.string("indirect")? == "final_gather").then_some(gather_samples),
            is_guided: params.boolean("gather_importance")?,
            shows_raw: params.boolean("raw_estimate")?,
            limits: read_photon_path_limits(params)?,
            hide_emitters: params.boolean(HIDE_EMITTERS.name)?,
        })
    }

    fn read_nearest(params: &Params<'_>) -> Result<Option<NonZeroUsize>, SceneError> {
        match params.integer("lookup_size")?.unsigned_abs() as usize {
            1 => {
                let error = params.error("lookup_size", "\"lookup_size\" is 1");
                Err(error.hint("must be 0, or 2 or more: the farthest photon only sets the radius"))
            }
            nearest => Ok(NonZeroUsize::new(nearest)),
        }
    }

    /// The parameters of estimates from the global map and from the caustic map. Default radii are a fraction of the
    /// scene's radius, but at least two pixel footprints at its center.
    pub(super) fn lookups(&self, scene: &Scene) -> [EstimateParameters; 2] {
        let sphere = scene.scene_bounds();
        let size = if sphere.radius > 0.0 { sphere.radius } else { 1.0 };
        let seen = 2.0 * scene.sensor.camera.footprint(sphere.centre).abs();
        let lookup = |given: Option<f64>, share: f64| EstimateParameters {
            nearest: self.nearest,
            radius: given.unwrap_or_else(|| (share * size).max(seen.min(0.2 * size))),
            kernel: self.kernel,
        };
        [lookup(self.global_radius, 1.0 / 20.0), lookup(self.caustic_radius, 1.0 / 80.0)]
    }
}
