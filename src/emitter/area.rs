use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::{Emission, EmissionTarget, EmitterModel, EmitterSample};
use crate::{
    math::{Frame, PerSolidAngle, Ray, Rgb, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::{Shape, ShapeModel as _, Surface},
    texture::{Texture, TextureModel as _},
};

/// A shape that shines from its surface with the same radiance in all directions, on the side of its normal only.
#[derive(Clone, Debug)]
pub struct Area {
    radiance: Texture,
}

impl Described for Area {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        manual: manual!("area.rs": "Area"),
        name: "area",
        summary: "Makes the shape it stands in a light, on the side of its normal.",
        params: &[Param::new("radiance", ParamKind::Texture, "1", "its radiance in W/(m² sr)").within(Range::LIGHT)],
        examples: &[r#"<emitter type="area"><rgb name="radiance" value="5, 4, 3"/></emitter>"#],
        evidence: &["emitter/*", "radiometry/polygon-light", "radiometry/disk-light", "radiometry/sphere-light"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { radiance: Texture::of(params, "radiance")? })
    }
}

impl EmitterModel for Area {
    fn sample_direction(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<EmitterSample> {
        let drawn = shape?.sample_direction(from, u)?;
        let way = drawn.p - from;
        // Only the front shines.
        if way.dot(drawn.n) >= 0.0 {
            return None;
        }
        Some(EmitterSample {
            direction: way.normalize(),
            shadow_ray: Ray::between(from, drawn.p),
            value: self.radiance.eval(drawn.uv),
            pdf: Some(drawn.pdf),
        })
    }

    fn pdf_direction(&self, shape: Option<&Shape>, from: DVec3, surface: Option<&Surface>) -> PerSolidAngle {
        match (shape, surface) {
            (Some(shape), Some(surface)) => shape.pdf_direction(from, surface),
            _ => PerSolidAngle(0.0),
        }
    }

    fn surface_radiance(&self, surface: &Surface, towards: DVec3) -> Rgb {
        if surface.n.dot(towards) > 0.0 { self.radiance.eval(surface.uv) } else { Rgb::ZERO }
    }

    fn emit(&self, shape: Option<&Shape>, target: &EmissionTarget, u: [DVec2; 2]) -> Option<Emission> {
        let drawn = shape?.sample_position(u[0]);
        let (direction, cos_over_pdf) = if target.is_aimed {
            let (direction, pdf) = target.towards(drawn.p, u[1]);
            (direction, drawn.n.dot(direction) / pdf.0)
        } else {
            // The cosine is that of the direction's density, cos θ / π.
            (Frame::from_normal(drawn.n).to_world(warp::square_to_cosine_hemisphere(u[1])), PI)
        };
        let flux = self.radiance.eval(drawn.uv) * (cos_over_pdf / drawn.pdf.0);
        (cos_over_pdf > 0.0).then(|| Emission { ray: Ray::leaving(drawn.p, direction), flux })
    }

    /// The mean over a grid of points, which is exact where the radiance is the same everywhere. What shines between the
    /// points alone still counts for one of them, so that it is drawn.
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
