use glam::{DVec2, DVec3};

use super::{Bsdf, BsdfModel, BsdfSample, Lobe, Query};
use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
    shape::Surface,
    texture::Texture,
};

/// A surface with holes, or a partly transparent one: the fraction `opacity` of the light meets the BSDF, and the rest
/// continues straight. As with Mitsuba's `path`, shadow rays are blocked, and passing through counts as a bounce.
///
/// In a scene without an environment, Mitsuba 3.9.1's `path` loses the light that a mask reflects on every path that
/// then leaves the scene through the mask: an opacity of 0.6 before nothing gives 0.36 of the BSDF's radiance there.
///
/// As in Mitsuba, an opacity beyond 0 or 1 is clamped, and that of a colour is its luminance. A constant colour's
/// opacity is the mean of its channels there.
#[derive(Clone, Debug)]
pub struct Mask {
    opacity: Texture,
    bsdf: Box<Bsdf>,
}

impl Described for Mask {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("mask.rs": "Mask"),
        name: "mask",
        summary: "A bsdf with an opacity: light passes straight through the rest.",
        params: &[
            Param::new("opacity", ParamKind::Texture, "0.5", "the fraction of light that meets the bsdf, by luminance"),
            Param::required("bsdf", ParamKind::Object(Category::Bsdf), "the bsdf of the opaque part"),
        ],
        examples: &[
            r#"<bsdf type="mask"><float name="opacity" value="0.7"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.4, 0.1"/></bsdf></bsdf>"#,
            r#"<bsdf type="mask"><rgb name="opacity" value="0.9, 0.2, 0.1"/>
                <bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>"#,
            r#"<bsdf type="mask"><float name="opacity" value="0.4"/><bsdf type="conductor"/></bsdf>"#,
        ],
        evidence: &["bsdf/*", "bsdf/mask", "reference/wrappers"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let bsdf = Box::new(super::only_child(params)?);
        Ok(Self { opacity: Texture::of(params, "opacity")?, bsdf })
    }
}

impl Mask {
    fn opacity(&self, uv: DVec2) -> f64 {
        self.opacity.value(uv).clamp(0.0, 1.0)
    }
}

/// Every method is written out, so that a new method cannot fall back to its default.
#[deny(clippy::missing_trait_methods)]
impl BsdfModel for Mask {
    fn is_smooth(&self) -> bool {
        self.bsdf.is_smooth()
    }

    fn is_glossy(&self) -> bool {
        self.bsdf.is_glossy()
    }

    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb {
        self.opacity(query.uv) * self.bsdf.eval_cos(query, wo)
    }

    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(self.opacity(query.uv) * self.bsdf.pdf(query, wo).0)
    }

    /// Samples the BSDF or the hole, and reuses the rest of `u1` for the BSDF.
    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<BsdfSample> {
        let opacity = self.opacity(query.uv);
        if u1 >= opacity {
            let pdf = PerSolidAngle(1.0 - opacity);
            return Some(BsdfSample { wo: -query.wi, weight: Rgb::ONE, pdf, lobe: Lobe::Null, eta: 1.0 });
        }
        let sample = self.bsdf.sample(query, u1 / opacity, u2)?;
        Some(BsdfSample { pdf: PerSolidAngle(opacity * sample.pdf.0), ..sample })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.opacity(uv) * self.bsdf.albedo(uv)
    }

    fn has_delta(&self) -> bool {
        true
    }

    fn transmits(&self) -> bool {
        true
    }

    fn is_interface(&self) -> bool {
        self.bsdf.is_interface()
    }

    fn absorption(&self) -> Rgb {
        self.bsdf.absorption()
    }

    fn straight_transmittance(&self, query: &Query) -> Option<Rgb> {
        let opacity = self.opacity(query.uv);
        let inner = self.bsdf.straight_transmittance(query);
        Some(Rgb::splat(1.0 - opacity) + opacity * inner.unwrap_or(Rgb::ZERO))
    }

    fn has_self_emission(&self) -> bool {
        self.bsdf.has_self_emission()
    }

    fn self_emission(&self, surface: &Surface, is_front: bool) -> Rgb {
        self.opacity(surface.uv) * self.bsdf.self_emission(surface, is_front)
    }
}
