use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{BsdfModel, BsdfSample, Lobe, Query, TransportMode, reflect};
use crate::{
    math::{Frame, PerSolidAngle, Rgb, cos_theta, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    texture::{Texture, TextureModel as _},
};

/// A mirror with a blurred reflection. A path from the camera is reflected along `r + ρ u`, with `r` the mirror
/// direction, `ρ` the roughness and `u` uniform in the unit sphere. Light in directions below the surface is absorbed.
/// The back is black.
///
/// With `μ` the cosine to the mirror direction and `κ = μ² + ρ² - 1`, the pdf is `√κ (3 μ² + κ) / 2πρ³` for `ρ <= 1`,
/// where `κ > 0` and `μ > 0`, and `(μ + √κ)³ / 4πρ³` for `ρ > 1`. It is the integral of `s² ds` over the chord that the
/// direction cuts out of the sphere.
///
/// The model is not reciprocal: `f cos θ(wo)` is the pdf, so `f(a, b) / f(b, a) = cos a / cos b`. Paths from an emitter
/// therefore use the adjoint BSDF: the same directions with the weight `cos θ(wo) / cos θ(wi)`. Both transport modes
/// then estimate the same image. The adjoint reflects more light than arrives at grazing incidence; energy is conserved
/// only towards the camera.
#[derive(Clone, Debug)]
pub struct Metal {
    reflectance: Texture,
    roughness: f64,
}

/// A smaller roughness becomes a mirror: 64-bit floats could not represent its directions.
const MIN_ROUGHNESS: f64 = 1e-7;

impl Described for Metal {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("metal.rs": "Metal"),
        name: "metal",
        summary: "A mirror with reflected directions offset within a sphere; not reciprocal.",
        params: &[
            Param::new("reflectance", ParamKind::Texture, "1", "the fraction of light that is reflected")
                .within(Range::UNIT),
            Param::new(
                "roughness",
                ParamKind::Float,
                "0",
                "the radius of the sphere; below 1e-7 the surface is a mirror",
            )
            .within(Range { min: 0.0, max: 10.0, open: false }),
        ],
        examples: &[
            r#"<bsdf type="metal"><rgb name="reflectance" value="0.9, 0.7, 0.4"/><float name="roughness" value="0.3"/></bsdf>"#,
            r#"<bsdf type="metal"><float name="roughness" value="0.05"/></bsdf>"#,
            r#"<bsdf type="metal"><rgb name="reflectance" value="0.5, 0.6, 0.9"/><float name="roughness" value="1"/></bsdf>"#,
            r#"<bsdf type="metal"><float name="roughness" value="1.5"/></bsdf>"#,
            r#"<bsdf type="metal"><float name="roughness" value="10"/></bsdf>"#,
            r#"<bsdf type="metal"><rgb name="reflectance" value="0.4, 0.6, 0.8"/></bsdf>"#,
        ],
        evidence: &["bsdf/metal", "bsdf/*", "reference/materials"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let roughness = params.float("roughness")?;
        let roughness = if roughness < MIN_ROUGHNESS { 0.0 } else { roughness };
        Ok(Self { reflectance: Texture::of(params, "reflectance")?, roughness })
    }
}

impl Metal {
    /// The pdf of a direction, from the squared sine and the cosine to the mirror direction.
    pub(super) fn lobe(roughness: f64, sin_squared: f64, cos: f64) -> f64 {
        let kappa = roughness * roughness - sin_squared;
        if kappa <= 0.0 || (roughness <= 1.0 && cos <= 0.0) {
            return 0.0;
        }
        let root = kappa.sqrt();
        let volume = roughness * roughness * roughness;
        if roughness <= 1.0 {
            root * (3.0 * cos * cos + kappa) / (TAU * volume)
        } else {
            (cos + root).powi(3) / (2.0 * TAU * volume)
        }
    }

    fn lobe_between(&self, query: &Query, wo: DVec3) -> f64 {
        if cos_theta(query.wi) <= 0.0 || cos_theta(wo) <= 0.0 {
            return 0.0;
        }
        let mirror = reflect(query.wi);
        Self::lobe(self.roughness, mirror.cross(wo).length_squared(), mirror.dot(wo))
    }

    /// The factor by which importance transport differs from radiance transport.
    fn adjoint(query: &Query, wo: DVec3) -> f64 {
        match query.mode {
            TransportMode::Radiance => 1.0,
            TransportMode::Importance => cos_theta(wo) / cos_theta(query.wi),
        }
    }
}

impl BsdfModel for Metal {
    fn is_smooth(&self) -> bool {
        self.roughness > 0.0
    }

    fn is_glossy(&self) -> bool {
        self.is_smooth() && self.roughness < 0.5
    }

    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb {
        if !self.is_smooth() {
            return Rgb::ZERO;
        }
        let lobe = self.lobe_between(query, wo);
        if lobe == 0.0 {
            return Rgb::ZERO;
        }
        self.reflectance.eval(query.uv) * (lobe * Self::adjoint(query, wo))
    }

    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(if self.is_smooth() { self.lobe_between(query, wo) } else { 0.0 })
    }

    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<BsdfSample> {
        if cos_theta(query.wi) <= 0.0 {
            return None;
        }
        let mirror = reflect(query.wi);
        let weight = self.reflectance.eval(query.uv);
        if !self.is_smooth() {
            return Some(BsdfSample { wo: mirror, weight, pdf: PerSolidAngle(1.0), lobe: Lobe::Delta, eta: 1.0 });
        }
        // The offset is added in the frame of the mirror direction, so that narrow lobes keep their precision.
        let in_sphere = u1.cbrt() * warp::square_to_sphere(u2);
        let offset = self.roughness * in_sphere + DVec3::Z;
        let wo = Frame::from_normal(mirror).to_world(offset).try_normalize()?;
        let pdf = self.pdf(query, wo);
        if pdf.0 == 0.0 {
            return None;
        }
        Some(BsdfSample { wo, weight: weight * Self::adjoint(query, wo), pdf, lobe: Lobe::Smooth, eta: 1.0 })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.reflectance.eval(uv)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn the_lobe_is_highest_at_the_mirror_direction() {
        for roughness in [0.01, 0.3, 1.0_f64] {
            let peak = (3.0 + roughness * roughness) / (2.0 * PI * roughness * roughness);
            let highest = Metal::lobe(roughness, 0.0, 1.0);
            assert!((highest / peak - 1.0).abs() < 1e-12);
            assert!(Metal::lobe(roughness, 1e-5, (1.0 - 1e-5_f64).sqrt()) < highest);
        }
    }
}
