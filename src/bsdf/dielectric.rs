use std::{fmt::Debug, marker::PhantomData};

use glam::{DVec2, DVec3};

use super::{
    BsdfModel, BsdfSample, Lobe, Query, TransportMode,
    fresnel::{self, Interface},
    reflect,
};
use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, Value, manual},
    texture::{Texture, TextureModel as _},
};

/// A smooth interface between two transparent media. The inside is below the normal. Refraction scales radiance by the
/// square of the ratio of the indices, because it conserves étendue `n² A Ω`. It does not scale flux.
///
/// The transmittance of a distance `t` in the medium inside is `exp(-absorption t)` (Beer-Lambert law). The medium
/// outside does not absorb. Two touching media need a single interface between them; its inside is the absorbing
/// medium, or either if none absorbs. Absorption is known at interfaces only: a segment between two surfaces of other
/// materials, or between such a surface and a camera or emitter in the medium, is not attenuated.
#[derive(Clone, Debug)]
pub struct Glass<K> {
    /// The index of refraction inside, divided by the index outside.
    eta: f64,
    /// Computes reflectance and refraction from the cosine of `wi` and the relative index.
    interface: fn(f64, f64) -> Interface,
    specular_reflectance: Texture,
    specular_transmittance: Texture,
    /// The absorption coefficient of the medium inside, in 1/m.
    absorption: Rgb,
    kind: PhantomData<K>,
}

/// Models of the reflectance of a smooth interface.
pub trait Reflectance: Clone + Debug {
    /// The manual page of the plugin.
    const PLUGIN: Plugin;

    /// The function that computes the interface from the cosine of `wi` and the relative index.
    ///
    /// # Errors
    /// If a parameter is invalid.
    fn read(params: &Params<'_>) -> Result<fn(f64, f64) -> Interface, SceneError>;
}

const INT_IOR: Param = Param::new(
    "int_ior",
    ParamKind::Float,
    "1.5046",
    "the index of refraction inside, as a number or a name in any case",
)
.within(Range::POSITIVE);
const EXT_IOR: Param = Param::new(
    "ext_ior",
    ParamKind::Float,
    "1.000277",
    "the index of refraction outside, as a number or a name in any case",
)
.within(Range::POSITIVE);
const SPECULAR_REFLECTANCE: Param =
    Param::new("specular_reflectance", ParamKind::Texture, "1", "scales the reflected light; not physical")
        .within(Range::UNIT);
const SPECULAR_TRANSMITTANCE: Param =
    Param::new("specular_transmittance", ParamKind::Texture, "1", "scales the refracted light; not physical")
        .within(Range::UNIT);
const ABSORPTION: Param =
    Param::new("absorption", ParamKind::Rgb, "0", "the absorption coefficient of the medium inside, in 1/m")
        .within(Range::NON_NEGATIVE);

/// Fresnel's equations for unpolarised light.
#[derive(Clone, Debug)]
pub struct Dielectric;

impl Reflectance for Dielectric {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("dielectric.rs": "Glass", "Dielectric"),
        name: "dielectric",
        summary: "A smooth interface between transparent media, with Fresnel's equations.",
        params: &[INT_IOR, EXT_IOR, SPECULAR_REFLECTANCE, SPECULAR_TRANSMITTANCE, ABSORPTION],
        examples: &[
            r#"<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>"#,
            r#"<bsdf type="dielectric"><string name="int_ior" value="air"/><string name="ext_ior" value="diamond"/>
                <rgb name="specular_reflectance" value="0.9, 0.7, 0.5"/><rgb name="absorption" value="0.1, 0.5, 2"/></bsdf>"#,
        ],
        evidence: &["fresnel/table", "fresnel/slab", "fresnel/etendue", "fresnel/hemispherical", "absorption/*"],
    };

    fn read(_params: &Params<'_>) -> Result<fn(f64, f64) -> Interface, SceneError> {
        Ok(fresnel::dielectric)
    }
}

/// Schlick's approximation, or total internal reflection alone, for comparison with Fresnel's equations.
#[derive(Clone, Debug)]
pub struct Schlick;

impl Reflectance for Schlick {
    const PLUGIN: Plugin = Plugin {
        category: Category::Bsdf,
        manual: manual!("dielectric.rs": "Glass", "Schlick"),
        name: "schlick",
        summary: "A dielectric with Schlick's approximation of Fresnel's equations.",
        params: &[
            INT_IOR,
            EXT_IOR,
            Param::new(
                "reflectance_model",
                ParamKind::Choice(&["schlick", "none"]),
                "schlick",
                "the reflectance; with none, only total internal reflection reflects",
            ),
            SPECULAR_REFLECTANCE,
            SPECULAR_TRANSMITTANCE,
            ABSORPTION,
        ],
        examples: &[
            r#"<bsdf type="schlick"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>"#,
            r#"<bsdf type="schlick"><float name="int_ior" value="1.33"/><float name="ext_ior" value="1"/>
                <string name="reflectance_model" value="none"/><rgb name="specular_transmittance" value="0.9, 0.7, 0.5"/></bsdf>"#,
        ],
        evidence: &["fresnel/schlick", "bsdf/*", "reference/figure-3-glass-balls", "reference/absorbing-glass"],
    };

    fn read(params: &Params<'_>) -> Result<fn(f64, f64) -> Interface, SceneError> {
        let is_schlick = params.string("reflectance_model")? == "schlick";
        Ok(if is_schlick { fresnel::schlick } else { fresnel::refracting })
    }
}

impl<K: Reflectance> Described for Glass<K> {
    const PLUGIN: Plugin = K::PLUGIN;

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self {
            eta: index(params, INT_IOR.name)? / index(params, EXT_IOR.name)?,
            interface: K::read(params)?,
            specular_reflectance: Texture::of(params, SPECULAR_REFLECTANCE.name)?,
            specular_transmittance: Texture::of(params, SPECULAR_TRANSMITTANCE.name)?,
            absorption: params.rgb(ABSORPTION.name)?,
            kind: PhantomData,
        })
    }
}

/// Indices of refraction by name, at the sodium D line, with Mitsuba's names and values.
const INDICES: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

fn index(params: &Params<'_>, name: &str) -> Result<f64, SceneError> {
    let Some(Value::String(medium)) = params.find(name).map(|property| &property.value) else {
        return params.float(name);
    };
    let known = INDICES.iter().find(|(known, _)| known.eq_ignore_ascii_case(medium));
    known.map(|(_, index)| *index).ok_or_else(|| {
        let names: Vec<_> = INDICES.iter().map(|(name, _)| *name).collect();
        params.error(name, format!("no medium is called \"{medium}\"")).hint(format!("known: {}", names.join(", ")))
    })
}

impl<K: Reflectance> BsdfModel for Glass<K> {
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
    fn sample(&self, query: &Query, u1: f64, _u2: DVec2) -> Option<BsdfSample> {
        let interface = (self.interface)(query.wi.z, self.eta);
        if u1 < interface.reflectance {
            let pdf = PerSolidAngle(interface.reflectance);
            let weight = self.specular_reflectance.eval(query.uv);
            return Some(BsdfSample { wo: reflect(query.wi), weight, pdf, lobe: Lobe::Delta, eta: 1.0 });
        }
        let compression = match query.mode {
            TransportMode::Radiance => 1.0 / (interface.eta * interface.eta),
            TransportMode::Importance => 1.0,
        };
        Some(BsdfSample {
            wo: fresnel::refract(query.wi, &interface),
            weight: self.specular_transmittance.eval(query.uv) * compression,
            pdf: PerSolidAngle(1.0 - interface.reflectance),
            lobe: Lobe::Delta,
            eta: interface.eta,
        })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.specular_transmittance.eval(uv)
    }

    fn transmits(&self) -> bool {
        true
    }

    fn is_interface(&self) -> bool {
        true
    }

    fn absorption(&self) -> Rgb {
        self.absorption
    }

    /// Uses the outside angle of incidence at both faces. This is exact for a plane-parallel slab, where the refracted
    /// ray has the same reflectance at both faces.
    fn straight_transmittance(&self, query: &Query) -> Option<Rgb> {
        let reflectance = (self.interface)(query.wi.z.abs(), self.eta).reflectance;
        Some(self.specular_transmittance.eval(query.uv) * (1.0 - reflectance))
    }
}
