use glam::{DVec2, DVec3};

use super::{Emission, EmissionTarget, EmitterModel, EmitterSample};
use crate::{
    math::{PerSolidAngle, Ray, Rgb, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::{Shape, Surface},
};

/// An environment of constant radiance.
#[derive(Clone, Debug)]
pub struct Constant {
    radiance: Rgb,
}

impl Described for Constant {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        manual: manual!("constant.rs": "Constant"),
        name: "constant",
        summary: "An environment with the same radiance in all directions.",
        params: &[Param::new("radiance", ParamKind::Rgb, "1", "the radiance in W/(m² sr)").within(Range::LIGHT)],
        examples: &[r#"<emitter type="constant"><rgb name="radiance" value="0.4, 0.5, 0.7"/></emitter>"#],
        evidence: &["emitter/*", "radiometry/white-environment"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { radiance: params.rgb("radiance")? })
    }
}

impl EmitterModel for Constant {
    fn sample_direction(&self, _shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<EmitterSample> {
        let direction = warp::square_to_sphere(u);
        Some(EmitterSample {
            direction,
            shadow_ray: Ray::leaving(from, direction),
            value: self.radiance,
            pdf: Some(PerSolidAngle(warp::SQUARE_TO_SPHERE_PDF)),
        })
    }

    fn pdf_direction(&self, _: Option<&Shape>, _: DVec3, _: DVec3, surface: Option<&Surface>) -> PerSolidAngle {
        PerSolidAngle(if surface.is_none() { warp::SQUARE_TO_SPHERE_PDF } else { 0.0 })
    }

    fn environment_radiance(&self, _direction: DVec3) -> Rgb {
        self.radiance
    }

    fn is_environment(&self) -> bool {
        true
    }

    fn is_distant(&self) -> bool {
        true
    }

    fn emit(&self, shape: Option<&Shape>, target: &EmissionTarget, u: [DVec2; 2]) -> Option<Emission> {
        let ray = target.entering(warp::square_to_sphere(u[1]), u[0]);
        Some(Emission { ray, flux: self.power(shape, target) })
    }

    fn power(&self, _shape: Option<&Shape>, target: &EmissionTarget) -> Rgb {
        self.radiance * (target.cross_section() / warp::SQUARE_TO_SPHERE_PDF)
    }
}
