use glam::{DVec2, DVec3};

use super::{Incident, Model};
use crate::{
    math::{PerSolidAngle, Ray, Rgb},
    node::{Category, Described, Kind, Param, Params, Plugin, Range, SceneError},
    shape::{Model as _, Shape, Surface},
    texture::Texture,
};

/// A shape that shines from its surface with the same radiance in all directions, on the side of its normal only.
#[derive(Clone, Debug)]
pub struct Area {
    radiance: Texture,
}

impl Described for Area {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        name: "area",
        summary: "Makes the shape it stands in a light, on the side of its normal.",
        params: &[Param::new("radiance", Kind::Texture, "1", "its radiance in W/(m² sr)").within(Range::LIGHT)],
        examples: &[r#"<emitter type="area"><rgb name="radiance" value="5, 4, 3"/></emitter>"#],
        evidence: &["radiometry/polygon-light", "radiometry/disk-light", "radiometry/sphere-light"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { radiance: Texture::of(params, "radiance")? })
    }
}

impl Model for Area {
    fn sample_towards(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<Incident> {
        let drawn = shape?.sample_towards(from, u)?;
        let way = drawn.p - from;
        // Only the front shines.
        if way.dot(drawn.n) >= 0.0 {
            return None;
        }
        Some(Incident {
            direction: way.normalize(),
            shadow_ray: Ray::between(from, drawn.p),
            value: self.radiance.eval(drawn.uv),
            density: Some(drawn.density),
        })
    }

    fn density_towards(&self, shape: Option<&Shape>, from: DVec3, surface: Option<&Surface>) -> PerSolidAngle {
        match (shape, surface) {
            (Some(shape), Some(surface)) => shape.density_towards(from, surface),
            _ => PerSolidAngle(0.0),
        }
    }

    fn surface_radiance(&self, surface: &Surface, towards: DVec3) -> Rgb {
        if surface.n.dot(towards) > 0.0 { self.radiance.eval(surface.uv) } else { Rgb::ZERO }
    }
}
