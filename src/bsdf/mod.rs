//! Materials: bidirectional scattering distribution functions (BSDFs).
//!
//! Directions are local unit vectors; the shading normal is +z. As in Mitsuba, `wi` points back along the path (to the camera,
//! in path tracing), and `wo` is the direction that is sampled or evaluated. [`BsdfModel::eval_cos`] includes the cosine of
//! `wo`; all densities are per solid angle of `wo`.

mod blend;
mod conductor;
mod dielectric;
mod diffuse;
pub mod fresnel;
pub mod laws;
mod metal;
mod microfacet;
mod normals;
mod null;
mod phong;
mod roughconductor;
mod twosided;

pub use blend::Blend;
pub use conductor::Conductor;
pub use dielectric::{Dielectric, Glass, Schlick};
pub use diffuse::Diffuse;
pub use metal::Metal;
pub use normals::Normals;
pub use null::Null;
pub use phong::Phong;
pub use roughconductor::RoughConductor;
pub use twosided::TwoSided;

use enum_dispatch::enum_dispatch;
use glam::{DVec2, DVec3};

use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, catalogue},
    shape::Surface,
};

/// What travels along the path: radiance from a camera, or importance from a light (the flux of a particle).
/// Radiance is scaled by 1/η² where it is refracted; importance is not (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// Paths that start at the camera.
    Radiance,
    /// Paths that start at a light.
    Importance,
}

/// The point and the direction for which a BSDF is evaluated or sampled.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// The local unit direction back along the path.
    pub wi: DVec3,
    /// Texture coordinates.
    pub uv: DVec2,
    /// The quantity that travels along the path.
    pub mode: TransportMode,
}

/// The kind of scattering of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// A density over directions.
    Smooth,
    /// A delta (specular) direction: a reflection or a refraction.
    Delta,
    /// A delta direction straight on: the surface changes nothing.
    Null,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// The local unit direction in which the path continues.
    pub wo: DVec3,
    /// `eval_cos / pdf`; for a delta direction, its reflectance or transmittance divided by the probability of choosing it.
    pub weight: Rgb,
    /// The density of `wo` in 1/sr; for a delta direction, the probability of choosing it.
    pub pdf: PerSolidAngle,
    /// The kind of scattering.
    pub lobe: Lobe,
    /// The index of refraction on the side of `wo` relative to that on the side of `wi`; 1 without refraction.
    pub eta: f64,
}

/// The interface of all BSDFs.
#[enum_dispatch]
pub trait BsdfModel {
    /// Whether it has a component that is not a delta direction, so that emitter sampling can find light.
    fn is_smooth(&self) -> bool;

    /// `f(wi, wo) |cos θ(wo)|` in 1/sr, without delta directions.
    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb;

    /// The density with which [`BsdfModel::sample`] samples `wo`, without delta directions.
    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle;

    /// Samples a direction with the numbers `u1` and `u2`, uniform on [0, 1). None if the light is absorbed or the sample has
    /// a weight of 0.
    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<Sample>;

    /// The reflectance, from 0 to 1 in each channel. An approximation, for the albedo layer of `aov`.
    fn albedo(&self, uv: DVec2) -> Rgb;

    /// Whether its lobe is so narrow that a camera path should continue rather than gather photons, of which almost none lie
    /// in the lobe.
    fn is_glossy(&self) -> bool {
        false
    }

    /// Whether it has delta directions.
    fn has_delta(&self) -> bool {
        !self.is_smooth()
    }

    /// Whether light passes to the other side.
    fn transmits(&self) -> bool {
        false
    }

    /// Whether it separates two media, so that its shape needs an inside and an outside.
    fn is_interface(&self) -> bool {
        false
    }

    /// The absorption coefficient of the medium on the side opposite to the normal, in 1/m.
    fn absorption(&self) -> Rgb {
        Rgb::ZERO
    }

    /// The transmittance along a straight line through the surface, from 0 to 1; None if it is opaque.
    fn straight_transmittance(&self, _query: &Query) -> Option<Rgb> {
        None
    }

    /// Whether it emits radiance anywhere.
    fn has_self_emission(&self) -> bool {
        false
    }

    /// The radiance that one side of the surface emits. It is added when a path hits the surface, but it is never sampled as an
    /// emitter; not physical.
    fn self_emission(&self, _surface: &Surface, _is_front: bool) -> Rgb {
        Rgb::ZERO
    }
}

catalogue! {
    /// A material.
    pub enum Bsdf: BsdfModel in Category::Bsdf, {
        /// Diffuse reflection after Lambert.
        Diffuse(Diffuse),
        /// Smooth glass.
        Dielectric(Glass<Dielectric>),
        /// Smooth glass after Schlick.
        Schlick(Glass<Schlick>),
        /// A smooth metal.
        Conductor(Conductor),
        /// A rough metal.
        RoughConductor(RoughConductor),
        /// A fuzzy mirror.
        Metal(Metal),
        /// A glossy lobe around the mirror direction over a diffuse base.
        Phong(Phong),
        /// A mixture of two materials.
        Blend(Blend),
        /// A material that has the same properties on both sides, or another one on its back.
        TwoSided(TwoSided),
        /// An interface without effect.
        Null(Null),
        /// The shading normal as a colour.
        Normals(Normals),
    }
}

/// The mirror direction.
fn reflect(wi: DVec3) -> DVec3 {
    DVec3::new(-wi.x, -wi.y, wi.z)
}
