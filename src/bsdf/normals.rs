use glam::{DVec2, DVec3};

use super::{Model, Query, Sample};
use crate::{
    math::{PerSolidAngle, Rgb},
    node::{Category, Described, Params, Plugin, SceneError},
    shape::Surface,
};

/// Shows the shading normal `n` of the world as the colour `(n + 1) / 2`, the same from both sides and whatever the
/// light, and scatters nothing: to look at meshes. Not physical: it glows, and lights what is near.
#[derive(Clone, Debug)]
pub struct Normals;

impl Described for Normals {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        name: "normals",
        summary: "Shows the shading normal as a colour; not physical.",
        params: &[],
        examples: &[r#"<bsdf type="normals"/>"#],
        evidence: &["radiometry/glow", "reference/figure-2-normals"],
    };

    fn read(_params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self)
    }
}

impl Model for Normals {
    fn is_smooth(&self) -> bool {
        false
    }

    fn has_delta(&self) -> bool {
        false
    }

    fn eval_cos(&self, _query: &Query, _wo: DVec3) -> Rgb {
        Rgb::ZERO
    }

    fn density(&self, _query: &Query, _wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    fn sample(&self, _query: &Query, _u1: f64, _u2: DVec2) -> Option<Sample> {
        None
    }

    fn albedo(&self, _uv: DVec2) -> Rgb {
        Rgb::ZERO
    }

    fn glows(&self) -> bool {
        true
    }

    fn glow(&self, surface: &Surface, _is_front: bool) -> Rgb {
        0.5 * (surface.shading.n + 1.0)
    }
}
