use glam::{DVec2, DVec3};

use super::{Bsdf, BsdfModel, BsdfSample, Lobe, Query};
use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::Surface,
    texture::Texture,
};

/// A mixture of two BSDFs: `(1 - weight)` of the first and `weight` of the second, with the same weight in all
/// channels.
///
/// Mitsuba 3.9.1's `path` renders mixtures with a mirror or glass too dark under area lights and environments. In a
/// constant environment, 0.65 of a diffuse reflectance of 0.2 and 0.35 of a mirror of 0.9 give 0.354 there instead of
/// 0.445.
#[derive(Clone, Debug)]
pub struct Blend {
    weight: Texture,
    bsdfs: Box<[Bsdf; 2]>,
}

impl Described for Blend {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("blend.rs": "Blend"),
        name: "blendbsdf",
        summary: "A mixture of two bsdfs.",
        params: &[
            Param::new("weight", ParamKind::Texture, "0.5", "the fraction of the second bsdf, by luminance")
                .within(Range::UNIT),
            Param::required("bsdf", ParamKind::Object(Category::Bsdf), "the two bsdfs to mix"),
        ],
        examples: &[
            r#"<bsdf type="blendbsdf"><float name="weight" value="0.3"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.4, 0.1"/></bsdf>
                <bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>"#,
            r#"<bsdf type="blendbsdf"><float name="weight" value="0.6"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.4, 0.1"/></bsdf>
                <bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></bsdf>"#,
        ],
        evidence: &["bsdf/*", "radiometry/blend", "reference/materials"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let children = params.children(Category::Bsdf);
        let [first, second] = children[..] else {
            let what = format!("a bsdf \"blendbsdf\" holds two bsdfs, this has {}", children.len());
            return Err(SceneError::at(&params.object().place, what));
        };
        let read = |id| Bsdf::read(params.document(), id);
        Ok(Self { weight: Texture::of(params, "weight")?, bsdfs: Box::new([read(first)?, read(second)?]) })
    }
}

impl Blend {
    /// The weights of both BSDFs.
    fn weights(&self, uv: DVec2) -> [f64; 2] {
        let weight = self.weight.value(uv);
        [1.0 - weight, weight]
    }

    fn components(&self, uv: DVec2) -> impl Iterator<Item = (f64, &Bsdf)> {
        self.weights(uv).into_iter().zip(self.bsdfs.iter()).filter(|(weight, _)| *weight > 0.0)
    }
}

/// Every method is written out, so that a new method cannot fall back to its default.
#[deny(clippy::missing_trait_methods)]
impl BsdfModel for Blend {
    fn is_smooth(&self) -> bool {
        self.bsdfs.iter().any(Bsdf::is_smooth)
    }

    fn is_glossy(&self) -> bool {
        // If one lobe is diffuse, photons can estimate its radiance.
        self.is_smooth() && self.bsdfs.iter().filter(|bsdf| bsdf.is_smooth()).all(Bsdf::is_glossy)
    }

    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb {
        self.components(query.uv).map(|(weight, bsdf)| weight * bsdf.eval_cos(query, wo)).sum()
    }

    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(self.components(query.uv).map(|(weight, bsdf)| weight * bsdf.pdf(query, wo).0).sum())
    }

    /// Samples one of the two BSDFs, and reuses the rest of `u1` for it.
    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<BsdfSample> {
        let [first, second] = self.weights(query.uv);
        let (weight, rest, bsdf) = if u1 < first {
            (first, u1 / first, &self.bsdfs[0])
        } else {
            (second, ((u1 - first) / second).min(1.0 - f64::EPSILON), &self.bsdfs[1])
        };
        let sample = bsdf.sample(query, rest, u2)?;
        if sample.lobe != Lobe::Smooth {
            return Some(BsdfSample { pdf: PerSolidAngle(weight * sample.pdf.0), ..sample });
        }
        let pdf = self.pdf(query, sample.wo);
        Some(BsdfSample { weight: self.eval_cos(query, sample.wo) / pdf.0, pdf, ..sample })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.components(uv).map(|(weight, bsdf)| weight * bsdf.albedo(uv)).sum()
    }

    fn has_delta(&self) -> bool {
        self.bsdfs.iter().any(Bsdf::has_delta)
    }

    fn transmits(&self) -> bool {
        self.bsdfs.iter().any(Bsdf::transmits)
    }

    fn is_interface(&self) -> bool {
        self.bsdfs.iter().any(Bsdf::is_interface)
    }

    /// Both interfaces bound the same medium, so the weights do not apply.
    fn absorption(&self) -> Rgb {
        self.bsdfs[0].absorption().max(self.bsdfs[1].absorption())
    }

    fn straight_transmittance(&self, query: &Query) -> Option<Rgb> {
        let through = |(weight, bsdf): (f64, &Bsdf)| Some(weight * bsdf.straight_transmittance(query)?);
        self.components(query.uv).filter_map(through).reduce(|one, other| one + other)
    }

    fn has_self_emission(&self) -> bool {
        self.bsdfs.iter().any(Bsdf::has_self_emission)
    }

    fn self_emission(&self, surface: &Surface, is_front: bool) -> Rgb {
        self.components(surface.uv).map(|(weight, bsdf)| weight * bsdf.self_emission(surface, is_front)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene_file::xml;

    #[test]
    fn the_weight_of_a_colour_is_its_luminance() {
        let element = r#"<bsdf type="blendbsdf"><rgb name="weight" value="0.9, 0.2, 0.1"/>
            <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
            <bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></bsdf>"#;
        let document = xml::parse_element(element).expect("valid XML");
        let blend = Bsdf::read(&document, document.root).expect("a BSDF");
        assert!((blend.albedo(DVec2::ZERO) - 0.341_652_8).abs().max_element() < 1e-7);
    }
}
