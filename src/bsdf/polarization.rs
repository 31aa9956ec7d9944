use std::marker::PhantomData;

use glam::{DVec2, DVec3};

use super::{BsdfModel, BsdfSample, Lobe, Query};
use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, Described, Manual, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    texture::{Texture, TextureModel as _},
};

/// A sheet that changes the polarisation of the light that passes straight through it. Light has no polarisation here,
/// as in Mitsuba's variants without polarisation, so the sheet only scales it.
#[derive(Clone, Debug)]
pub struct Sheet<K> {
    transmittance: Texture,
    kind: PhantomData<K>,
}

/// The kind of a sheet.
pub trait SheetKind {
    /// The fraction of unpolarised light that a sheet of transmittance 1 transmits.
    const FRACTION: f64;
    /// The description of the plugin.
    const PLUGIN: Plugin;
}

const TRANSMITTANCE: Param =
    Param::new("transmittance", ParamKind::Texture, "1", "scales the transmitted light").within(Range::UNIT);
const UNPOLARIZED: &str = "light has no polarisation here";

const fn plugin(
    name: &'static str,
    manual: Manual,
    summary: &'static str,
    params: &'static [Param],
    examples: &'static [&'static str],
) -> Plugin {
    Plugin {
        category: Category::Bsdf,
        manual,
        name,
        summary,
        params,
        examples,
        evidence: &["bsdf/*", "reference/wrappers"],
    }
}

/// A linear polariser: a sheet that transmits half of the light straight on. As in Mitsuba's variants without
/// polarisation, the angle has no effect.
#[derive(Clone, Debug)]
pub struct Polarizer;

impl SheetKind for Polarizer {
    const FRACTION: f64 = 0.5;
    const PLUGIN: Plugin = plugin(
        "polarizer",
        manual!("polarization.rs": "Polarizer"),
        "A linear polariser, which transmits half of the light.",
        &[
            TRANSMITTANCE,
            Param::ignored("theta", ParamKind::Texture, UNPOLARIZED),
            Param::ignored("polarizing", ParamKind::Boolean, UNPOLARIZED),
        ],
        &[r#"<bsdf type="polarizer"><rgb name="transmittance" value="0.8, 0.9, 0.6"/></bsdf>"#],
    );
}

/// A retarder, such as a wave plate: a sheet that transmits all light straight on. As in Mitsuba's variants without
/// polarisation, its angle and its retardance have no effect.
#[derive(Clone, Debug)]
pub struct Retarder;

impl SheetKind for Retarder {
    const FRACTION: f64 = 1.0;
    const PLUGIN: Plugin = plugin(
        "retarder",
        manual!("polarization.rs": "Retarder"),
        "A retarder, which transmits all light.",
        &[
            TRANSMITTANCE,
            Param::ignored("theta", ParamKind::Texture, UNPOLARIZED),
            Param::ignored("delta", ParamKind::Texture, UNPOLARIZED),
        ],
        &[r#"<bsdf type="retarder"><rgb name="transmittance" value="0.8, 0.9, 0.6"/></bsdf>"#],
    );
}

/// A circular polariser: a sheet that transmits half of the light straight on.
#[derive(Clone, Debug)]
pub struct Circular;

impl SheetKind for Circular {
    const FRACTION: f64 = 0.5;
    const PLUGIN: Plugin = plugin(
        "circular",
        manual!("polarization.rs": "Circular"),
        "A circular polariser, which transmits half of the light.",
        &[TRANSMITTANCE, Param::ignored("left_handed", ParamKind::Boolean, UNPOLARIZED)],
        &[r#"<bsdf type="circular"/>"#],
    );
}

impl<K: SheetKind> Described for Sheet<K> {
    const PLUGIN: Plugin = K::PLUGIN;

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { transmittance: Texture::of(params, TRANSMITTANCE.name)?, kind: PhantomData })
    }
}

impl<K: SheetKind> Sheet<K> {
    fn transmittance(&self, uv: DVec2) -> Rgb {
        K::FRACTION * self.transmittance.eval(uv)
    }
}

impl<K: SheetKind> BsdfModel for Sheet<K> {
    fn is_smooth(&self) -> bool {
        false
    }

    fn eval_cos(&self, _query: &Query, _wo: DVec3) -> Rgb {
        Rgb::ZERO
    }

    fn pdf(&self, _query: &Query, _wo: DVec3) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    fn sample(&self, query: &Query, _u1: f64, _u2: DVec2) -> Option<BsdfSample> {
        let weight = self.transmittance(query.uv);
        Some(BsdfSample { wo: -query.wi, weight, pdf: PerSolidAngle(1.0), lobe: Lobe::Null, eta: 1.0 })
    }

    fn albedo(&self, uv: DVec2) -> Rgb {
        self.transmittance(uv)
    }

    fn transmits(&self) -> bool {
        true
    }

    fn straight_transmittance(&self, query: &Query) -> Option<Rgb> {
        Some(self.transmittance(query.uv))
    }
}
