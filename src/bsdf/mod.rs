//! BSDFs: how surfaces scatter light.
//!
//! Directions are local: the shading normal is +z. As in Mitsuba, `wi` points back along the path (to the camera, in
//! path tracing), and `wo` is the direction that is evaluated or sampled. [`BsdfModel::eval_cos`] includes the cosine
//! of `wo`. All pdfs are per solid angle of `wo`.

mod blend;
mod conductor;
mod dielectric;
mod diffuse;
pub mod fresnel;
pub mod laws;
mod mask;
mod metal;
mod microfacet;
mod normals;
mod null;
mod phong;
mod polarization;
mod roughconductor;
mod twosided;

pub use blend::Blend;
pub use conductor::Conductor;
pub use dielectric::{Dielectric, Glass, Schlick};
pub use diffuse::Diffuse;
pub use mask::Mask;
pub use metal::Metal;
pub use normals::Normals;
pub use null::Null;
pub use phong::Phong;
pub use polarization::{Circular, Polarizer, Retarder, Sheet};
pub use roughconductor::RoughConductor;
pub use twosided::TwoSided;

use enum_dispatch::enum_dispatch;
use glam::{DVec2, DVec3};

use crate::{
    math::{PerSolidAngle, Rgb},
    scene_file::{Category, Params, SceneError, catalogue},
    shape::Surface,
};

/// The quantity that a path transports: radiance on paths from the camera, importance on paths from an emitter (the
/// flux of a particle). Refraction scales radiance by 1/η² but leaves importance unchanged (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// Paths that start at the camera.
    Radiance,
    /// Paths that start at an emitter.
    Importance,
}

/// The arguments that every query of a BSDF shares.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// The local unit direction back along the path.
    pub wi: DVec3,
    /// Texture coordinates.
    pub uv: DVec2,
    /// The quantity that the path transports.
    pub mode: TransportMode,
}

/// The type of the lobe that a direction was sampled from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// A lobe with a pdf over directions.
    Smooth,
    /// A delta lobe: specular reflection or refraction into one direction.
    Delta,
    /// A delta lobe in the direction `-wi`: the path continues straight.
    Null,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The local unit direction in which the path continues.
    pub wo: DVec3,
    /// `eval_cos / pdf`; for a delta lobe, the fraction of light that it scatters over the probability of choosing it.
    pub weight: Rgb,
    /// The pdf of `wo`; for a delta lobe, the probability of choosing it.
    pub pdf: PerSolidAngle,
    /// The type of the sampled lobe.
    pub lobe: Lobe,
    /// The index of refraction on the side of `wo` over that on the side of `wi`; 1 without refraction.
    pub eta: f64,
}

/// The interface of all BSDFs.
#[enum_dispatch]
pub trait BsdfModel {
    /// Whether the BSDF has a smooth lobe, so that emitter sampling can contribute.
    fn is_smooth(&self) -> bool;

    /// `f(wi, wo) |cos θ(wo)|` of the smooth lobes.
    fn eval_cos(&self, query: &Query, wo: DVec3) -> Rgb;

    /// The pdf with which [`BsdfModel::sample`] samples `wo` from the smooth lobes.
    fn pdf(&self, query: &Query, wo: DVec3) -> PerSolidAngle;

    /// Samples a direction. None if the light is absorbed or the sample fails; a failed sample counts as zero.
    fn sample(&self, query: &Query, u1: f64, u2: DVec2) -> Option<BsdfSample>;

    /// The colour for the `albedo` layer: an approximation of the reflectance.
    fn albedo(&self, uv: DVec2) -> Rgb;

    /// Whether its lobes are so narrow that a camera path should continue through the surface instead of estimating
    /// radiance from photons: hardly any photon arrives from within a narrow lobe.
    fn is_glossy(&self) -> bool {
        false
    }

    /// Whether the BSDF has a delta lobe.
    fn has_delta(&self) -> bool {
        !self.is_smooth()
    }

    /// Whether the BSDF transmits light to the other side.
    fn transmits(&self) -> bool {
        false
    }

    /// Whether the surface separates two media, so that its shape needs an inside and an outside.
    fn is_interface(&self) -> bool {
        false
    }

    /// The absorption coefficient of the medium below the normal, in 1/m.
    fn absorption(&self) -> Rgb {
        Rgb::ZERO
    }

    /// The transmittance of the surface for a straight line through it; None if it is opaque.
    fn straight_transmittance(&self, _query: &Query) -> Option<Rgb> {
        None
    }

    /// Whether the material has self-emission.
    fn has_self_emission(&self) -> bool {
        false
    }

    /// The self-emission: radiance that one side of the surface adds to the image, independent of illumination. Not
    /// physical.
    fn self_emission(&self, _surface: &Surface, _is_front: bool) -> Rgb {
        Rgb::ZERO
    }
}

catalogue! {
    /// A BSDF.
    pub enum Bsdf: BsdfModel in Category::Bsdf, {
        /// Lambertian reflection.
        Diffuse(Diffuse),
        /// Smooth glass.
        Dielectric(Glass<Dielectric>),
        /// Smooth glass with Schlick's approximation.
        Schlick(Glass<Schlick>),
        /// A smooth metal.
        Conductor(Conductor),
        /// A rough metal.
        RoughConductor(RoughConductor),
        /// A mirror whose reflection is blurred.
        Metal(Metal),
        /// A glossy lobe around the mirror direction over a diffuse base.
        Phong(Phong),
        /// A mixture of two BSDFs.
        Blend(Blend),
        /// A BSDF for each side of a surface.
        TwoSided(TwoSided),
        /// A BSDF with holes.
        Mask(Mask),
        /// An invisible surface.
        Null(Null),
        /// A linear polariser.
        Polarizer(Sheet<Polarizer>),
        /// A retarder.
        Retarder(Sheet<Retarder>),
        /// A circular polariser.
        Circular(Sheet<Circular>),
        /// The shading normal as a colour.
        Normals(Normals),
    }
}

/// Reads the only BSDF inside another.
fn only_child(params: &Params<'_>) -> Result<Bsdf, SceneError> {
    match params.children(Category::Bsdf)[..] {
        [child] => Bsdf::read(params.document(), child),
        ref children => {
            let what = format!("{} holds one bsdf, this has {}", params.called(), children.len());
            Err(SceneError::at(&params.object().place, what))
        }
    }
}

/// The direction of specular reflection.
fn reflect(wi: DVec3) -> DVec3 {
    DVec3::new(-wi.x, -wi.y, wi.z)
}
