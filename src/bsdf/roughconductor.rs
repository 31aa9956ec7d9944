use glam::{DVec2, DVec3};

use super::{
    BsdfModel, BsdfSample, Lobe, Query,
    conductor::{self, ComplexIndex},
    microfacet::{DistributionKind as Distribution, MicrofacetDistribution},
};
use crate::{
    math::{PerSolidAngle, Rgb, cos_theta},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    texture::{Texture, TextureModel as _},
};

/// A rough metal: a microfacet model of smooth conductors with Smith's masking and shadowing. Light that hits a second
/// facet is lost, so a white metal of GGX roughness 0.3 reflects 0.877 of the light at normal incidence. The back is
/// black.
///
/// Walter et al. 2007, eq. (20): `f = F D G / 4 |cos θi| |cos θo|`.
#[derive(Clone, Debug)]
pub struct RoughConductor {
    distribution: MicrofacetDistribution,
    index: ComplexIndex,
    specular_reflectance: Texture,
}

const ALPHA: Range = Range { min: 1e-4, max: 1e3, open: false };

impl Described for RoughConductor {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("roughconductor.rs": "RoughConductor"),
        name: "roughconductor",
        summary: "A rough metal, with a microfacet model.",
        params: &[
            conductor::MATERIAL,
            conductor::ETA,
            conductor::K,
            conductor::SPECULAR_REFLECTANCE,
            Param::new(
                "distribution",
                ParamKind::Choice(&["beckmann", "ggx"]),
                "beckmann",
                "the distribution of microfacet normals",
            ),
            Param::new("alpha", ParamKind::Float, "0.1", "the roughness, about the root mean square slope")
                .within(ALPHA),
            Param::optional("alpha_u", ParamKind::Float, "alpha", "the roughness along the first tangent")
                .within(ALPHA),
            Param::optional("alpha_v", ParamKind::Float, "alpha", "the roughness along the second tangent")
                .within(ALPHA),
            Param::new(
                "sample_visible",
                ParamKind::Boolean,
                "true",
                "samples only the GGX normals that are visible; less noise",
            ),
        ],
        examples: &[
            r#"<bsdf type="roughconductor"><string name="material" value="Au"/><string name="distribution" value="ggx"/>
                <float name="alpha" value="0.15"/></bsdf>"#,
            r#"<bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha_u" value="0.6"/>
                <float name="alpha_v" value="0.2"/></bsdf>"#,
            r#"<bsdf type="roughconductor"><string name="material" value="Al"/><float name="alpha" value="0.3"/></bsdf>"#,
            r#"<bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha" value="0.4"/>
                <boolean name="sample_visible" value="false"/></bsdf>"#,
        ],
        evidence: &["bsdf/rough-albedo", "radiometry/direct-strategies"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let kind = if params.string("distribution")? == "ggx" { Distribution::Ggx } else { Distribution::Beckmann };
        let alpha = params.float("alpha")?;
        let alpha_u = params.optional_float("alpha_u")?.unwrap_or(alpha);
        let alpha_v = params.optional_float("alpha_v")?.unwrap_or(alpha);
        Ok(Self {
            distribution: MicrofacetDistribution {
                kind,
                alpha: DVec2::new(alpha_u, alpha_v),
                visible: params.boolean("sample_visible")?,
            },
            index: ComplexIndex::read(params)?,
            specular_reflectance: Texture::of(params, conductor::SPECULAR_REFLECTANCE.name)?,
        })
    }
}

impl RoughConductor {
    fn fresnel(&self, query: &Query, m: DVec3) -> Rgb {
        self.index.reflectance(query.wi.dot(m)) * self.specular_reflectance.eval(query.uv)
    }
}

impl BsdfModel for RoughConductor {
    fn is_smooth(&self) -> bool {
        true
    }

    fn is_glossy(&self) -> bool {
        self.distribution.alpha.x * self.distribution.alpha.y < 0.3 * 0.3
    }

    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb {
        let wi = query.wi;
        if cos_theta(wi) <= 0.0 || cos_theta(wo) <= 0.0 {
            return Rgb::ZERO;
        }
        let m = (wi + wo).normalize();
        let geometry = self.distribution.masking(wi, m) * self.distribution.masking(wo, m);
        self.fresnel(query, m) * (self.distribution.distribution(m) * geometry / (4.0 * cos_theta(wi)))
    }

    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle {
        let wi = query.wi;
        if cos_theta(wi) <= 0.0 || cos_theta(wo) <= 0.0 {
            return PerSolidAngle(0.0);
        }
        let m = (wi + wo).normalize();
        // The Jacobian of the mirror map, Walter et al. 2007, eq. (14).
        PerSolidAngle(self.distribution.pdf(wi, m) / (4.0 * wo.dot(m)))
    }

    fn sample(&self, query: &Query, _u1: f64, u2: DVec2) -> Option<BsdfSample> {
        let wi = query.wi;
        if cos_theta(wi) <= 0.0 {
            return None;
        }
        let m = self.distribution.sample(wi, u2);
        let wo = 2.0 * wi.dot(m) * m - wi;
        if cos_theta(wo) <= 0.0 {
            return None;
        }
        let pdf = self.pdf(query, wo);
        let weight = self.eval_cos(query, wo) / pdf.0;
        (pdf.0 > 0.0).then_some(BsdfSample { wo, weight, pdf, lobe: Lobe::Smooth, eta: 1.0 })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.index.reflectance(1.0) * self.specular_reflectance.eval(uv)
    }
}
