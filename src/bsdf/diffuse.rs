use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{BsdfModel, BsdfSample, Lobe, Query};
use crate::{
    math::{PerSolidAngle, Rgb, cos_theta, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    texture::{Texture, TextureModel as _},
};

/// The Lambertian BRDF, `f = ρ / π`, on the side of the normal. The back is black.
#[derive(Clone, Debug)]
pub struct Diffuse {
    reflectance: Texture,
}

impl Diffuse {
    /// A surface of constant reflectance.
    #[must_use]
    pub fn new(reflectance: Rgb) -> Self {
        Self { reflectance: Texture::constant(reflectance) }
    }
}

impl Described for Diffuse {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("diffuse.rs": "Diffuse"),
        name: "diffuse",
        summary: "A Lambertian (ideally diffuse) surface; its back is black.",
        params: &[Param::new("reflectance", ParamKind::Texture, "0.5", "the fraction of light that is reflected")
            .within(Range::UNIT)],
        examples: &[r#"<bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.4, 0.1"/></bsdf>"#],
        evidence: &["radiometry/furnace", "radiometry/integrating-sphere"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { reflectance: Texture::of(params, "reflectance")? })
    }
}

impl BsdfModel for Diffuse {
    fn is_smooth(&self) -> bool {
        true
    }

    #[inline]
    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb {
        if cos_theta(query.wi) <= 0.0 || cos_theta(wo) <= 0.0 {
            return Rgb::ZERO;
        }
        self.reflectance.eval(query.uv) * (FRAC_1_PI * cos_theta(wo))
    }

    #[inline]
    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle {
        let is_front = cos_theta(query.wi) > 0.0;
        PerSolidAngle(if is_front { warp::square_to_cosine_hemisphere_pdf(cos_theta(wo)) } else { 0.0 })
    }

    #[inline]
    fn sample(&self, query: &Query, _u1: f64, u2: DVec2) -> Option<BsdfSample> {
        let wo = warp::square_to_cosine_hemisphere(u2);
        if cos_theta(query.wi) <= 0.0 || cos_theta(wo) <= 0.0 {
            return None;
        }
        let pdf = PerSolidAngle(warp::square_to_cosine_hemisphere_pdf(cos_theta(wo)));
        Some(BsdfSample { wo, weight: self.reflectance.eval(query.uv), pdf, lobe: Lobe::Smooth, eta: 1.0 })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.reflectance.eval(uv)
    }
}
