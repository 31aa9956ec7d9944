use glam::{DVec2, DVec3};

use super::{Emission, EmissionTarget, EmitterModel, EmitterSample};
use crate::{
    math::{Ray, Rgb},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::Shape,
};

/// Parallel light from infinitely far away.
#[derive(Clone, Debug)]
pub struct Directional {
    /// The unit direction in which the light travels.
    direction: DVec3,
    irradiance: Rgb,
}

impl Described for Directional {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        manual: manual!("directional.rs": "Directional"),
        name: "directional",
        summary: "Parallel light from infinitely far away.",
        params: &[
            Param::optional(
                "direction",
                ParamKind::Point,
                "the z axis of to_world",
                "the direction in which the light travels",
            ),
            Param::optional(
                "to_world",
                ParamKind::Transform,
                "the identity",
                "maps the z axis to the direction; an alternative to direction",
            ),
            Param::new("irradiance", ParamKind::Rgb, "1", "the irradiance at normal incidence, in W/m²")
                .within(Range::LIGHT),
        ],
        examples: &[r#"<emitter type="directional"><vector name="direction" x="1" y="-2" z="0.5"/></emitter>"#],
        evidence: &["emitter/*", "radiometry/directional-light"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let direction = match params.optional_point("direction")? {
            Some(_) if params.find("to_world").is_some() => {
                return Err(params
                    .error("direction", "a directional light has both \"direction\" and \"to_world\"")
                    .hint("give one"));
            }
            Some(direction) => direction,
            None => params.transform("to_world")?.transform_vector3(DVec3::Z),
        };
        let Some(direction) = direction.try_normalize() else {
            return Err(params.error("direction", "the direction has zero length"));
        };
        Ok(Self { direction, irradiance: params.rgb("irradiance")? })
    }
}

impl EmitterModel for Directional {
    fn sample_direction(&self, _shape: Option<&Shape>, from: DVec3, _u: DVec2) -> Option<EmitterSample> {
        Some(EmitterSample {
            direction: -self.direction,
            shadow_ray: Ray::leaving(from, -self.direction),
            value: self.irradiance,
            pdf: None,
        })
    }

    fn is_distant(&self) -> bool {
        true
    }

    fn emit(&self, shape: Option<&Shape>, target: &EmissionTarget, [u, _]: [DVec2; 2]) -> Option<Emission> {
        let ray = target.entering(self.direction, u);
        Some(Emission { ray, flux: self.power(shape, target) })
    }

    fn power(&self, _shape: Option<&Shape>, target: &EmissionTarget) -> Rgb {
        self.irradiance * target.cross_section()
    }
}
