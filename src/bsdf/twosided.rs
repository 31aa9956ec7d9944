use glam::{DVec2, DVec3};

use super::{Bsdf, BsdfModel, BsdfSample, Query};
use crate::{
    math::{PerSolidAngle, Rgb, cos_theta},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
    shape::Surface,
};

/// Gives the back of a surface the BSDF of its front, or a second BSDF.
#[derive(Clone, Debug)]
pub struct TwoSided {
    front: Box<Bsdf>,
    back: Box<Bsdf>,
}

impl Described for TwoSided {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("twosided.rs": "TwoSided"),
        name: "twosided",
        summary: "Gives the back of a surface the bsdf of its front, or a second bsdf.",
        params: &[
            Param::required(
                "bsdf",
                ParamKind::Object(Category::Bsdf),
                "one bsdf for both sides, or one for the front and one for the back",
            ),
            Param::new(
                "allow_transmission",
                ParamKind::Boolean,
                "false",
                "whether they may transmit light; either side is then the outside",
            ),
        ],
        examples: &[
            r#"<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.6, 0.9"/></bsdf></bsdf>"#,
            r#"<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.6, 0.9"/></bsdf>
                <bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>"#,
        ],
        evidence: &["radiometry/direct-strategies", "reference/sun-and-bulb"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let children = params.children(Category::Bsdf);
        let location = &params.object().place;
        if !matches!(children.len(), 1 | 2) {
            let what = format!("a bsdf \"twosided\" holds one or two bsdfs, this has {}", children.len());
            return Err(SceneError::at(location, what));
        }
        let allows_transmission = params.boolean("allow_transmission")?;
        let mut sides = Vec::new();
        for id in children {
            let side = Bsdf::read(params.document(), id)?;
            if side.transmits() && !allows_transmission {
                let error = SceneError::at(&params.document().object(id).place, "this bsdf transmits light");
                return Err(error.hint("only bsdfs that reflect can be two-sided, unless allow_transmission is true"));
            }
            sides.push(side);
        }
        let back = Box::new(sides[sides.len() - 1].clone());
        Ok(Self { front: Box::new(sides.swap_remove(0)), back })
    }
}

impl TwoSided {
    /// The BSDF of the side of `wi`, the query in that side's frame, and the sign that maps its z back.
    fn side(&self, query: &Query) -> (&Bsdf, Query, f64) {
        if cos_theta(query.wi) > 0.0 {
            return (&self.front, *query, 1.0);
        }
        (&self.back, Query { wi: flip(query.wi, -1.0), ..*query }, -1.0)
    }
}

fn flip(v: DVec3, sign: f64) -> DVec3 {
    DVec3::new(v.x, v.y, sign * v.z)
}

/// Every method is written out, so that a new method cannot fall back to its default.
#[deny(clippy::missing_trait_methods)]
impl BsdfModel for TwoSided {
    fn is_smooth(&self) -> bool {
        self.front.is_smooth() || self.back.is_smooth()
    }

    fn is_glossy(&self) -> bool {
        self.front.is_glossy() || self.back.is_glossy()
    }

    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb {
        let (side, query, sign) = self.side(query);
        side.eval_cos(&query, flip(wo, sign))
    }

    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle {
        let (side, query, sign) = self.side(query);
        side.pdf(&query, flip(wo, sign))
    }

    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<BsdfSample> {
        let (side, query, sign) = self.side(query);
        let sample = side.sample(&query, u1, u2)?;
        Some(BsdfSample { wo: flip(sample.wo, sign), ..sample })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.front.albedo(uv)
    }

    fn has_delta(&self) -> bool {
        self.front.has_delta() || self.back.has_delta()
    }

    fn transmits(&self) -> bool {
        self.front.transmits() || self.back.transmits()
    }

    /// Both sides are outside.
    fn is_interface(&self) -> bool {
        false
    }

    fn absorption(&self) -> Rgb {
        Rgb::ZERO
    }

    fn straight_transmittance(&self, query: &Query) -> Option<Rgb> {
        let (side, query, _) = self.side(query);
        side.straight_transmittance(&query)
    }

    fn has_self_emission(&self) -> bool {
        self.front.has_self_emission() || self.back.has_self_emission()
    }

    fn self_emission(&self, surface: &Surface, is_front: bool) -> Rgb {
        if is_front { self.front.self_emission(surface, true) } else { self.back.self_emission(surface, true) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bsdf::TransportMode, scene_file::xml};

    #[test]
    fn both_sides_of_glass_are_outside_if_transmission_is_allowed() {
        let element = r#"<bsdf type="twosided"><boolean name="allow_transmission" value="true"/><bsdf type="dielectric"/></bsdf>"#;
        let document = xml::parse_element(element).expect("valid XML");
        let glass = Bsdf::read(&document, document.root).expect("a BSDF");
        assert!(!glass.is_interface() && glass.transmits());
        for z in [1.0, -1.0] {
            let query = Query { wi: DVec3::new(0.0, 0.0, z), uv: DVec2::ZERO, mode: TransportMode::Radiance };
            let sample = glass.sample(&query, 0.5, DVec2::splat(0.5)).expect("refracted light");
            // Mitsuba 3.9.1: an index of 1.504183 from both sides, and a weight of 0.441976.
            assert_eq!(sample.wo, -query.wi);
            assert!((sample.eta - 1.504_183).abs() < 1e-6 && (sample.weight.x - 0.441_976).abs() < 1e-6, "{sample:?}");
        }
    }
}
