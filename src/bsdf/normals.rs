use glam::{DVec2, DVec3};

use super::{BsdfModel, BsdfSample, Query};
use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
    shape::Surface,
};

/// Shows the world-space shading normal `n` as the colour `(n + 1) / 2`, to inspect meshes. The colour is the same on
/// both sides and independent of illumination. The surface does not scatter light. Not physical: its self-emission
/// illuminates other surfaces.
#[derive(Clone, Debug)]
pub struct Normals;

impl Described for Normals {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("normals.rs": "Normals"),
        name: "normals",
        summary: "Shows the shading normal as a colour; not physical.",
        params: &[],
        examples: &[r#"<bsdf type="normals"/>"#],
        evidence: &["radiometry/self-emission", "reference/figure-2-normals"],
    };

    fn read(_params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self)
    }
}

impl BsdfModel for Normals {
    fn is_smooth(&self) -> bool {
        false
    }

    fn has_delta(&self) -> bool {
        false
    }

    fn eval_cos(&self, _query: &Query, _wo: DVec3) -> Rgb {
        Rgb::ZERO
    }

    fn pdf(&self, _query: &Query, _wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    fn sample(&self, _query: &Query, _u1: f64, _u2: DVec2) -> Option<BsdfSample> {
        None
    }

    fn albedo(&self, _uv: DVec2) -> Rgb {
        Rgb::ZERO
    }

    fn has_self_emission(&self) -> bool {
        true
    }

    fn self_emission(&self, surface: &Surface, _is_front: bool) -> Rgb {
        0.5 * (surface.shading.n + 1.0)
    }
}
