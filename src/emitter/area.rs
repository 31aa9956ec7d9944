use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::{Emission, EmissionTarget, EmitterModel, EmitterSample};
use crate::{
    math::{Frame, PerSolidAngle, Ray, Rgb, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::{Shape, ShapeModel as _, Surface},
    texture::{Texture, TextureModel as _},
};

/// A shape that emits from the side of its normal, with the same radiance in all directions.
#[derive(Clone, Debug)]
pub struct Area {
    radiance: Texture,
}

impl Described for Area {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        manual: manual!("area.rs": "Area"),
        name: "area",
        summary: "An area light: the enclosing shape emits light on the side of its normal.",
        params: &[
            Param::new("radiance", ParamKind::Texture, "1", "the emitted radiance in W/(m² sr)").within(Range::LIGHT)
        ],
        examples: &[r#"<emitter type="area"><rgb name="radiance" value="5, 4, 3"/></emitter>"#],
        evidence: &["emitter/*", "radiometry/polygon-light", "radiometry/disk-light", "radiometry/sphere-light"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { radiance: Texture::of(params, "radiance")? })
    }
}

impl EmitterModel for Area {
    fn is_of_surface(&self) -> bool {
        true
    }

    fn sample_direction(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<EmitterSample> {
        let shape_sample = shape?.sample_direction(from, u)?;
        let to_light = shape_sample.p - from;
        // Only the front emits.
        if to_light.dot(shape_sample.n) >= 0.0 {
            return None;
        }
        Some(EmitterSample {
            direction: to_light.normalize(),
            shadow_ray: Ray::between(from, shape_sample.p),
            value: self.radiance.eval(shape_sample.uv),
            pdf: Some(shape_sample.pdf),
        })
    }

    fn pdf_direction(&self, shape: Option<&Shape>, from: DVec3, _: DVec3, surface: Option<&Surface>) -> PerSolidAngle {
        match (shape, surface) {
            (Some(shape), Some(surface)) => shape.pdf_direction(from, surface),
            _ => PerSolidAngle(0.0),
        }
    }

    fn surface_radiance(&self, surface: &Surface, towards: DVec3) -> Rgb {
        if surface.n.dot(towards) > 0.0 { self.radiance.eval(surface.uv) } else { Rgb::ZERO }
    }

    fn emit(&self, shape: Option<&Shape>, target: &EmissionTarget, u: [DVec2; 2]) -> Option<Emission> {
        let shape_sample = shape?.sample_position(u[0]);
        let (direction, cos_over_pdf) = if target.is_aimed {
            let (direction, pdf) = target.towards(shape_sample.p, u[1]);
            (direction, shape_sample.n.dot(direction) / pdf.0)
        } else {
            // The cosine cancels the cosine of the pdf, cos θ / π.
            (Frame::from_normal(shape_sample.n).to_world(warp::square_to_cosine_hemisphere(u[1])), PI)
        };
        let flux = self.radiance.eval(shape_sample.uv) * (cos_over_pdf / shape_sample.pdf.0);
        (cos_over_pdf > 0.0).then(|| Emission { ray: Ray::leaving(shape_sample.p, direction), flux })
    }

    /// The mean over a grid of points, exact for a constant radiance. The brightest texel counts as at least one point,
    /// so a light that emits only between the points can still be sampled.
    fn power(&self, shape: Option<&Shape>, target: &EmissionTarget) -> Rgb {
        const POINTS: u32 = 16;
        let centre = |i: u32| (f64::from(i) + 0.5) / f64::from(POINTS);
        let points = (0..POINTS * POINTS).map(|i| DVec2::new(centre(i % POINTS), centre(i / POINTS)));
        let flux = |u| self.emit(shape, target, [u, DVec2::ZERO]).map_or(Rgb::ZERO, |emission| emission.flux);
        let mean = points.map(flux).sum::<Rgb>() / f64::from(POINTS * POINTS);
        let brightest = shape.map_or(Rgb::ZERO, |shape| {
            let (_, greatest) = self.radiance.extremes();
            greatest * (PI / shape.sample_position(DVec2::splat(0.5)).pdf.0)
        });
        mean.max(brightest / f64::from(POINTS * POINTS))
    }
}
