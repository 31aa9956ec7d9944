use glam::{DVec2, DVec3};

use super::{BsdfModel, BsdfSample, Lobe, Query};
use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// An invisible surface: paths continue straight through it. As in Mitsuba's `path`, it still blocks shadow rays, and
/// it counts as a bounce.
#[derive(Clone, Debug)]
pub struct Null;

impl Described for Null {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("null.rs": "Null"),
        name: "null",
        summary: "An invisible surface: light passes straight through.",
        params: &[],
        examples: &[r#"<bsdf type="null"/>"#],
        evidence: &["reference/null-panes"],
    };

    fn read(_params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self)
    }
}

impl BsdfModel for Null {
    fn is_smooth(&self) -> bool {
        false
    }

    fn eval_cos(&self, _query: &Query, _wo: DVec3) -> Rgb {
        Rgb::ZERO
    }

    fn pdf(&self, _query: &Query, _wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    fn sample(&self, query: &Query, _u1: f64, _u2: DVec2) -> Option<BsdfSample> {
        Some(BsdfSample { wo: -query.wi, weight: Rgb::ONE, pdf: PerSolidAngle(1.0), lobe: Lobe::Null, eta: 1.0 })
    }

    fn albedo(&self, _uv: DVec2) -> Rgb {
        Rgb::ONE
    }

    fn transmits(&self) -> bool {
        true
    }

    fn straight_transmittance(&self, _query: &Query) -> Option<Rgb> {
        Some(Rgb::ONE)
    }
}
