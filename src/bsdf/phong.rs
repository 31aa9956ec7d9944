use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec2, DVec3};

use super::{BsdfModel, BsdfSample, Lobe, Query, reflect};
use crate::{
    math::{Frame, PerSolidAngle, Rgb, cos_theta, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::Surface,
    texture::{Texture, TextureModel as _},
};

/// The modified Phong model: `f = kd / π + ks (n + 2) / 2π cosⁿ α`, with `α` the angle to the mirror direction, in the
/// upper hemisphere. The back is black. Lafortune and Willems 1994, "Using the modified Phong reflectance model for
/// physically based rendering", eq. (3) to (5).
///
/// The reflectance is at most `kd + ks`, which must not exceed 1. It is less at grazing angles, where the surface cuts
/// off the lobe. `ambient` is radiance that the surface adds to the image without illumination; not physical.
#[derive(Clone, Debug)]
pub struct Phong {
    diffuse_reflectance: Texture,
    specular_reflectance: Texture,
    exponent: f64,
    ambient: Rgb,
}

impl Described for Phong {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("phong.rs": "Phong"),
        name: "phong",
        summary: "The modified Phong model: a diffuse lobe and a glossy lobe around the mirror direction.",
        params: &[
            Param::new(
                "diffuse_reflectance",
                ParamKind::Texture,
                "0.5",
                "the fraction of light that is reflected diffusely",
            )
            .within(Range::UNIT),
            Param::new(
                "specular_reflectance",
                ParamKind::Texture,
                "0.2",
                "the maximum fraction of light that the glossy lobe reflects",
            )
            .within(Range::UNIT),
            Param::new("exponent", ParamKind::Float, "30", "the exponent of the glossy lobe; greater is narrower")
                .within(Range { min: 0.0, max: 1e6, open: false }),
            Param::new(
                "ambient",
                ParamKind::Rgb,
                "0",
                "radiance that the surface shows without illumination; not physical",
            )
            .within(Range::LIGHT),
        ],
        examples: &[
            r#"<bsdf type="phong"><rgb name="diffuse_reflectance" value="0.2, 0.5, 0.1"/>
                <rgb name="specular_reflectance" value="0.3, 0.2, 0.6"/><float name="exponent" value="10"/></bsdf>"#,
            r#"<bsdf type="phong"><float name="diffuse_reflectance" value="0"/><float name="specular_reflectance" value="1"/>
                <float name="exponent" value="200"/></bsdf>"#,
            r#"<bsdf type="phong"><float name="diffuse_reflectance" value="0"/><float name="specular_reflectance" value="0.9"/>
                <float name="exponent" value="0"/><rgb name="ambient" value="0.1, 0.2, 0.3"/></bsdf>"#,
        ],
        evidence: &["bsdf/phong", "bsdf/*", "reference/materials"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let diffuse_reflectance = Texture::of(params, "diffuse_reflectance")?;
        let specular_reflectance = Texture::of(params, "specular_reflectance")?;
        let greatest = (diffuse_reflectance.extremes().1 + specular_reflectance.extremes().1).max_element();
        if greatest > 1.0 + 1e-9 {
            let what = format!("diffuse and specular reflectance add up to {greatest}");
            return Err(params.error("specular_reflectance", what).hint("their sum must not exceed 1"));
        }
        let (exponent, ambient) = (params.float("exponent")?, params.rgb("ambient")?);
        Ok(Self { diffuse_reflectance, specular_reflectance, exponent, ambient })
    }
}

impl Phong {
    /// The probability of sampling the glossy lobe.
    fn lobe_probability(&self, uv: DVec2) -> f64 {
        let (diffuse, lobe) = (self.diffuse_reflectance.eval(uv), self.specular_reflectance.eval(uv));
        let (diffuse, lobe) = (diffuse.element_sum(), lobe.element_sum());
        if lobe == 0.0 { 0.0 } else { lobe / (diffuse + lobe) }
    }

    /// `cosⁿ α`, or 0 where the cosine is not positive.
    fn power(&self, query: &Query, wo: DVec3) -> f64 {
        let cos = reflect(query.wi).dot(wo);
        if cos > 0.0 { cos.powf(self.exponent) } else { 0.0 }
    }

    /// `eval_cos` and `pdf` together, which share the power of a cosine.
    #[inline]
    fn eval_cos_and_pdf(&self, query: &Query, wo: DVec3) -> (Rgb, PerSolidAngle) {
        if cos_theta(query.wi) <= 0.0 || cos_theta(wo) <= 0.0 {
            return (Rgb::ZERO, PerSolidAngle(0.0));
        }
        let power = self.power(query, wo);
        let diffuse = self.diffuse_reflectance.eval(query.uv) * FRAC_1_PI;
        let lobe = self.specular_reflectance.eval(query.uv) * ((self.exponent + 2.0) / TAU * power);
        let lobe_probability = self.lobe_probability(query.uv);
        let lobe_pdf = (self.exponent + 1.0) / TAU * power;
        let pdf = (1.0 - lobe_probability) * warp::square_to_cosine_hemisphere_pdf(cos_theta(wo))
            + lobe_probability * lobe_pdf;
        ((diffuse + lobe) * cos_theta(wo), PerSolidAngle(pdf))
    }
}

impl BsdfModel for Phong {
    fn is_smooth(&self) -> bool {
        true
    }

    fn is_glossy(&self) -> bool {
        self.exponent > 10.0 && self.diffuse_reflectance.extremes().1 == Rgb::ZERO
    }

    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb {
        self.eval_cos_and_pdf(query, wo).0
    }

    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle {
        self.eval_cos_and_pdf(query, wo).1
    }

    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<BsdfSample> {
        if cos_theta(query.wi) <= 0.0 {
            return None;
        }
        let wo = if u1 < self.lobe_probability(query.uv) {
            let lobe = warp::square_to_cosine_power(u2, self.exponent);
            Frame::from_normal(reflect(query.wi)).to_world(lobe)
        } else {
            warp::square_to_cosine_hemisphere(u2)
        };
        let (value, pdf) = self.eval_cos_and_pdf(query, wo);
        // Directions of the lobe below the surface are absorbed.
        if pdf.0 == 0.0 {
            return None;
        }
        Some(BsdfSample { wo, weight: value / pdf.0, pdf, lobe: Lobe::Smooth, eta: 1.0 })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.diffuse_reflectance.eval(uv) + self.specular_reflectance.eval(uv)
    }

    fn has_self_emission(&self) -> bool {
        self.ambient != Rgb::ZERO
    }

    fn self_emission(&self, _surface: &Surface, is_front: bool) -> Rgb {
        if is_front { self.ambient } else { Rgb::ZERO }
    }
}
