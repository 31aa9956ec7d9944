//! What surfaces do with light.
//!
//! Directions are local: the shading normal is +z. As in Mitsuba, `wi` points back to where the path comes from (to
//! the camera, in path tracing) and `wo` along the one that is asked for. [`BsdfModel::eval_cos`] includes the cosine at
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

/// Where and from which side a BSDF is asked.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// The local unit direction to where the path comes from.
    pub wi: DVec3,
    /// Texture coordinates.
    pub uv: DVec2,
    /// What travels.
    pub mode: TransportMode,
}

/// The kind of scattering that a sample stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// It has a density over directions.
    Smooth,
    /// A single direction: a mirror or a refraction.
    Delta,
    /// A single direction, the straight one: nothing happened.
    Null,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// The local unit direction in which the path goes on.
    pub wo: DVec3,
    /// `eval_cos / pdf`; for a single direction, what is left of the light per chance of choosing it.
    pub weight: Rgb,
    /// The density of `wo`; for a single direction, the chance of choosing it.
    pub pdf: PerSolidAngle,
    /// What kind of scattering it was.
    pub lobe: Lobe,
    /// The relative index of refraction that was crossed, of the side of `wo` to that of `wi`; 1 otherwise.
    pub eta: f64,
}

/// What a BSDF answers.
#[enum_dispatch]
pub trait BsdfModel {
    /// Whether there is anything but single directions, so that connecting to a light can find light.
    fn is_smooth(&self) -> bool;

    /// `f(wi, wo) |cos θ(wo)|`, without single directions.
    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb;

    /// The density with which [`BsdfModel::sample`] draws `wo`, without single directions.
    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle;

    /// Draws a direction; None if the light is absorbed or the draw failed, which then carries nothing.
    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<Sample>;

    /// The colour that the `albedo` layer shows: the reflectance, as good as the model knows it.
    fn albedo(&self, uv: DVec2) -> Rgb;

    /// Whether it scatters over so few directions that a path from the eye should rather go on than look around for
    /// photons, of which next to none would come from there.
    fn is_glossy(&self) -> bool {
        false
    }

    /// Whether there are single directions.
    fn has_delta(&self) -> bool {
        !self.is_smooth()
    }

    /// Whether light gets to the other side.
    fn transmits(&self) -> bool {
        false
    }

    /// Whether there are two different media at its sides, so that it needs an inside and an outside.
    fn is_interface(&self) -> bool {
        false
    }

    /// The absorption coefficient of the medium below the normal, per unit of length.
    fn absorption(&self) -> Rgb {
        Rgb::ZERO
    }

    /// What a straight line through the surface keeps of its light; None if it is opaque.
    fn straight_transmittance(&self, _query: &Query) -> Option<Rgb> {
        None
    }

    /// Whether it ever shows radiance by itself.
    fn has_self_emission(&self) -> bool {
        false
    }

    /// Radiance that a side of the surface shows by itself, whatever the light; not physical.
    fn self_emission(&self, _surface: &Surface, _is_front: bool) -> Rgb {
        Rgb::ZERO
    }
}

catalogue! {
    /// A surface's way with light.
    pub enum Bsdf: BsdfModel in Category::Bsdf, {
        /// Lambert's.
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
        /// Two at once.
        Blend(Blend),
        /// The same from behind.
        TwoSided(TwoSided),
        /// Nothing at all.
        Null(Null),
        /// The shading normal as a colour.
        Normals(Normals),
    }
}

/// The mirror direction.
fn reflect(wi: DVec3) -> DVec3 {
    DVec3::new(-wi.x, -wi.y, wi.z)
}
