use glam::{DVec2, DVec3};

use super::{Beam, Emission, Incident, Model};
use crate::{
    math::{PerSolidAngle, Ray, Rgb, warp},
    node::{Category, Described, Kind, Param, Params, Plugin, Range, SceneError},
    shape::Shape,
};

/// A point that shines equally in all directions.
#[derive(Clone, Debug)]
pub struct Point {
    position: DVec3,
    intensity: Rgb,
}

impl Described for Point {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        name: "point",
        summary: "A point that shines equally in all directions.",
        params: &[
            Param::optional("position", Kind::Point, "the origin of to_world", "where it is"),
            Param::optional("to_world", Kind::Transform, "the identity", "where its origin goes, instead of position"),
            Param::new("intensity", Kind::Rgb, "1", "its intensity in W/sr").within(Range::LIGHT),
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

impl Model for Point {
    fn sample_towards(&self, _shape: Option<&Shape>, from: DVec3, _u: DVec2) -> Option<Incident> {
        let way = self.position - from;
        let distance_squared = way.length_squared();
        if distance_squared == 0.0 {
            return None;
        }
        Some(Incident {
            direction: way / distance_squared.sqrt(),
            shadow_ray: Ray::between(from, self.position),
            value: self.intensity / distance_squared,
            density: None,
        })
    }

    fn emit(&self, _shape: Option<&Shape>, beam: &Beam, [_, u]: [DVec2; 2]) -> Option<Emission> {
        let (direction, density) = if beam.is_aimed {
            beam.towards(self.position, u)
        } else {
            (warp::square_to_sphere(u), PerSolidAngle(warp::SPHERE_DENSITY))
        };
        Some(Emission { ray: Ray::new(self.position, direction), flux: self.intensity / density.0 })
    }

    fn power(&self, _shape: Option<&Shape>, _beam: &Beam) -> Rgb {
        self.intensity / warp::SPHERE_DENSITY
    }
}
