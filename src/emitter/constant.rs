use glam::{DVec2, DVec3};

use super::{Beam, Emission, Incident, Model};
use crate::{
    math::{PerSolidAngle, Ray, Rgb, warp},
    node::{Category, Described, Kind, Param, Params, Plugin, Range, SceneError},
    shape::{Shape, Surface},
};

/// A sky that is equally bright in all directions.
#[derive(Clone, Debug)]
pub struct Constant {
    radiance: Rgb,
}

impl Described for Constant {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        name: "constant",
        summary: "A sky that is equally bright in all directions.",
        params: &[Param::new("radiance", Kind::Rgb, "1", "its radiance in W/(m² sr)").within(Range::LIGHT)],
        examples: &[r#"<emitter type="constant"><rgb name="radiance" value="0.4, 0.5, 0.7"/></emitter>"#],
        evidence: &["emitter/*", "radiometry/white-sky"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { radiance: params.rgb("radiance")? })
    }
}

impl Model for Constant {
    fn sample_towards(&self, _shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<Incident> {
        let direction = warp::square_to_sphere(u);
        Some(Incident {
            direction,
            shadow_ray: Ray::leaving(from, direction),
            value: self.radiance,
            density: Some(PerSolidAngle(warp::SPHERE_DENSITY)),
        })
    }

    fn density_towards(&self, _shape: Option<&Shape>, _from: DVec3, surface: Option<&Surface>) -> PerSolidAngle {
        PerSolidAngle(if surface.is_none() { warp::SPHERE_DENSITY } else { 0.0 })
    }

    fn sky_radiance(&self, _direction: DVec3) -> Rgb {
        self.radiance
    }

    fn is_sky(&self) -> bool {
        true
    }

    fn is_distant(&self) -> bool {
        true
    }

    fn emit(&self, shape: Option<&Shape>, beam: &Beam, u: [DVec2; 2]) -> Option<Emission> {
        let ray = beam.entering(warp::square_to_sphere(u[1]), u[0]);
        Some(Emission { ray, flux: self.power(shape, beam) })
    }

    fn power(&self, _shape: Option<&Shape>, beam: &Beam) -> Rgb {
        self.radiance * (beam.cross_section() / warp::SPHERE_DENSITY)
    }
}
