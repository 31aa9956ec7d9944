mod materials;

use glam::{DVec2, DVec3};

use super::{BsdfModel, BsdfSample, Lobe, Query, fresnel, reflect};
use crate::{
    math::{PerSolidAngle, Rgb, cos_theta},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    texture::{Texture, TextureModel as _},
};

/// A smooth metal or another absorbing material, with Fresnel's equations for a complex index. The back is black.
#[derive(Clone, Debug)]
pub struct Conductor {
    index: ComplexIndex,
    specular_reflectance: Texture,
}

/// The complex index of refraction `eta + i k`, in linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ComplexIndex {
    eta: Rgb,
    k: Rgb,
}

/// Metals have indices below 100. The bound keeps fourth powers in Fresnel's equations finite.
const INDEX: Range = Range { min: 0.0, max: 1e6, open: false };

/// The parameters of [`ComplexIndex::read`].
pub(super) const MATERIAL: Param = Param::new(
    "material",
    ParamKind::String,
    "none",
    "a name in any case (Au, Ag, Al, Cu, ...), or none for a perfect mirror",
);
pub(super) const ETA: Param = Param::optional(
    "eta",
    ParamKind::Index,
    "taken from the material",
    "the real part of the index of refraction, linear RGB",
)
.within(INDEX);
pub(super) const K: Param =
    Param::optional("k", ParamKind::Index, "taken from the material", "the imaginary part of the index, linear RGB")
        .within(INDEX);
pub(super) const SPECULAR_REFLECTANCE: Param =
    Param::new("specular_reflectance", ParamKind::Texture, "1", "scales the reflected light; not physical")
        .within(Range::UNIT);

impl ComplexIndex {
    /// Reads `eta` and `k` if both are given, else `material`.
    pub(super) fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let given = [params.find(ETA.name).is_some(), params.find(K.name).is_some()];
        match given {
            [_, _] if params.find(MATERIAL.name).is_some() && given != [false; 2] => {
                Err(params.error(MATERIAL.name, "both a material and its index are given").hint("give one"))
            }
            [true, true] => Ok(Self { eta: params.rgb(ETA.name)?, k: params.rgb(K.name)? }),
            [false, false] => Self::named(params),
            _ => {
                Err(SceneError::at(&params.object().place, "only one of \"eta\" and \"k\" is given").hint("give both"))
            }
        }
    }

    fn named(params: &Params<'_>) -> Result<Self, SceneError> {
        let name = params.string(MATERIAL.name)?;
        if name.eq_ignore_ascii_case("none") {
            return Ok(Self { eta: Rgb::ZERO, k: Rgb::ONE });
        }
        let known = materials::MATERIALS.iter().find(|(known, ..)| known.eq_ignore_ascii_case(name));
        known.map(|(_, eta, k)| Self { eta: Rgb::from(*eta), k: Rgb::from(*k) }).ok_or_else(|| {
            let names: Vec<_> = materials::MATERIALS.iter().map(|(name, ..)| *name).collect();
            let error = params.error(MATERIAL.name, format!("no material is called \"{name}\""));
            error.hint(format!("known: none, {}", names.join(", ")))
        })
    }

    /// The reflectance at an angle of incidence with the given cosine.
    #[inline]
    pub(super) fn reflectance(&self, cos: f64) -> Rgb {
        fresnel::conductor(cos, self.eta, self.k)
    }
}

impl Described for Conductor {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("mod.rs": "Conductor"),
        name: "conductor",
        summary: "A smooth metal, with Fresnel's equations for a complex index.",
        params: &[MATERIAL, ETA, K, SPECULAR_REFLECTANCE],
        examples: &[
            r#"<bsdf type="conductor"><string name="material" value="Au"/></bsdf>"#,
            r#"<bsdf type="conductor"><rgb name="eta" value="1.1, 0.9, 0.5"/><rgb name="k" value="3, 2, 1"/></bsdf>"#,
        ],
        evidence: &["fresnel/conductor"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self {
            index: ComplexIndex::read(params)?,
            specular_reflectance: Texture::of(params, SPECULAR_REFLECTANCE.name)?,
        })
    }
}

impl BsdfModel for Conductor {
    fn is_smooth(&self) -> bool {
        false
    }

    fn eval_cos(&self, _query: &Query, _wo: DVec3) -> Rgb {
        Rgb::ZERO
    }

    fn pdf(&self, _query: &Query, _wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    #[inline]
    fn sample(&self, query: &Query, _u1: f64, _u2: DVec2) -> Option<BsdfSample> {
        let cos = cos_theta(query.wi);
        if cos <= 0.0 {
            return None;
        }
        let weight = self.index.reflectance(cos) * self.specular_reflectance.eval(query.uv);
        Some(BsdfSample { wo: reflect(query.wi), weight, pdf: PerSolidAngle(1.0), lobe: Lobe::Delta, eta: 1.0 })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.index.reflectance(1.0) * self.specular_reflectance.eval(uv)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_material_reflects_a_fraction_at_every_angle() {
        for (name, eta, k) in materials::MATERIALS {
            let index = ComplexIndex { eta: Rgb::from(eta), k: Rgb::from(k) };
            for cos in [1.0, 0.999, 0.5, 1e-3, 1e-9] {
                let reflectance = index.reflectance(cos);
                let is_fraction = |x: f64| (0.0..=1.0 + 1e-12).contains(&x);
                assert!(reflectance.to_array().into_iter().all(is_fraction), "{name}, {cos}: {reflectance}");
            }
        }
    }
}
