use glam::{DVec2, DVec3};

use super::{Emission, EmissionTarget, EmitterModel, EmitterSample};
use crate::{
    math::{PerSolidAngle, Ray, Rgb, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::Shape,
};

/// A point that emits equally in all directions.
#[derive(Clone, Debug)]
pub struct Point {
    position: DVec3,
    intensity: Rgb,
}

impl Described for Point {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        manual: manual!("point.rs": "Point"),
        name: "point",
        summary: "A point that emits equally in all directions.",
        params: &[
            Param::optional("position", ParamKind::Point, "the origin of to_world", "the position"),
            Param::optional(
                "to_world",
                ParamKind::Transform,
                "the identity",
                "maps the origin to the position; an alternative to position",
            ),
            Param::new("intensity", ParamKind::Rgb, "1", "the radiant intensity in W/sr").within(Range::LIGHT),
        ],
        examples: &[
            r#"<emitter type="point"><point name="position" x="1" y="2" z="-1"/><rgb name="intensity" value="3, 2, 1"/></emitter>"#,
        ],
        evidence: &["emitter/*", "radiometry/point-light", "radiometry/integrating-sphere"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let origin = params.transform("to_world")?.translation;
        let position = match params.optional_point("position")? {
            Some(_) if params.find("to_world").is_some() => {
                return Err(params
                    .error("position", "a point light has both \"position\" and \"to_world\"")
                    .hint("give one"));
            }
            Some(position) => position,
            None => origin,
        };
        Ok(Self { position, intensity: params.rgb("intensity")? })
    }
}

impl EmitterModel for Point {
    fn sample_direction(&self, _shape: Option<&Shape>, from: DVec3, _u: DVec2) -> Option<EmitterSample> {
        let to_light = self.position - from;
        let distance_squared = to_light.length_squared();
        if distance_squared == 0.0 {
            return None;
        }
        Some(EmitterSample {
            direction: to_light / distance_squared.sqrt(),
            shadow_ray: Ray::between(from, self.position),
            value: self.intensity / distance_squared,
            pdf: None,
        })
    }

    fn emit(&self, _shape: Option<&Shape>, target: &EmissionTarget, [_, u]: [DVec2; 2]) -> Option<Emission> {
        let (direction, pdf) = if target.is_aimed {
            target.towards(self.position, u)
        } else {
            (warp::square_to_sphere(u), PerSolidAngle(warp::SQUARE_TO_SPHERE_PDF))
        };
        Some(Emission { ray: Ray::new(self.position, direction), flux: self.intensity / pdf.0 })
    }

    fn power(&self, _shape: Option<&Shape>, _beam: &EmissionTarget) -> Rgb {
        self.intensity / warp::SQUARE_TO_SPHERE_PDF
    }
}
