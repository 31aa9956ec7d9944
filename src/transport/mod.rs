//! The vocabulary of light transport that integrators share: weights, connections to lights, roulette.

mod class;
mod walk;

pub use class::{CameraPathClass, LightPathClass, PathClass};
pub use walk::{LightVertex, shading_normal_correction, walk};

use glam::DVec3;

use crate::{
    bsdf::{Bsdf, BsdfModel as _, Query, TransportMode},
    emitter::EmitterSample,
    math::{PerSolidAngle, Rgb},
    sampler::SampleStream,
    scene::{Scene, SurfaceInteraction},
};

/// How long paths may be, in segments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathLimits {
    /// The longest.
    pub max_depth: u32,
    /// After how many Russian roulette begins.
    pub rr_depth: u32,
}

/// The power heuristic with exponent 2 for `ours` of two densities of the same direction, Veach 1997, eq. (9.14).
#[must_use]
pub fn power_heuristic(ours: PerSolidAngle, other: PerSolidAngle) -> f64 {
    let (ours, other) = (ours.0 * ours.0, other.0 * other.0);
    if ours > 0.0 { ours / (ours + other) } else { 0.0 }
}

/// What stands in the way of a connection to a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shadows {
    /// Every surface.
    Opaque,
    /// Opaque surfaces alone; transparent ones let their transmittance through, and do not bend light. Not physical.
    Transparent,
}

/// A connection with a light that may yet be blocked.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// What the light sends.
    pub emitter_sample: EmitterSample,
    /// The number of the light.
    pub light: usize,
    /// The direction to it in the shading frame.
    pub wo: DVec3,
    /// What goes on along the path, not yet divided by the density of the direction.
    pub scattered: Rgb,
}

/// A vertex of a path that comes from the camera, seen in its shading frame.
pub struct ShadingPoint<'s> {
    /// The vertex.
    pub si: SurfaceInteraction,
    /// Its material.
    pub bsdf: &'s Bsdf,
    /// From which side the path comes.
    pub query: Query,
}

impl<'s> ShadingPoint<'s> {
    /// The shading_point at a vertex.
    #[inline]
    #[must_use]
    pub fn new(scene: &'s Scene, si: SurfaceInteraction) -> Self {
        let wi = si.surface.shading.to_local(si.wi_world);
        let query = Query { wi, uv: si.surface.uv, mode: TransportMode::Radiance };
        Self { bsdf: scene.bsdf(&si), si, query }
    }

    /// The position.
    #[must_use]
    pub fn p(&self) -> DVec3 {
        self.si.surface.p
    }

    /// Draws a light to connect with, whether or not anything stands between; None if none is drawn that could be seen
    /// from here and be scattered along the path.
    #[inline]
    pub fn sample_emitter(&self, scene: &Scene, sampler: &mut impl SampleStream) -> Option<Connection> {
        // A delta lobe cannot be found by connection: only a sampled ray reaches a light through it.
        if !self.bsdf.is_smooth() {
            return None;
        }
        let (emitter_sample, light) = scene.sample_emitter_direction(self.p(), sampler.next_2d())?;
        let wo = self.si.surface.shading.to_local(emitter_sample.direction);
        let scattered = self.bsdf.eval_cos(&self.query, wo) * emitter_sample.value;
        (scattered != Rgb::ZERO).then_some(Connection { emitter_sample, light, wo, scattered })
    }

    /// Next event estimation: the radiance that a randomly drawn light sends back along the path, weighted as one of
    /// two strategies of which the other is to sample the BSDF. `sample_counts` are the numbers of samples of both, of lights
    /// first, in any unit.
    #[inline]
    pub fn sample_direct(
        &self,
        scene: &Scene,
        sampler: &mut impl SampleStream,
        sample_counts: [f64; 2],
        shadows: Shadows,
    ) -> Rgb {
        let Some(Connection { emitter_sample, wo, mut scattered, .. }) = self.sample_emitter(scene, sampler) else {
            return Rgb::ZERO;
        };
        let mut is_crossed = false;
        match shadows {
            Shadows::Opaque if scene.occluded(&emitter_sample.shadow_ray) => return Rgb::ZERO,
            Shadows::Opaque if scene.absorbs() => {
                scattered *= scene.transmittance(Some(&self.si), &emitter_sample.shadow_ray, None);
            }
            Shadows::Opaque => {}
            Shadows::Transparent => {
                let share;
                (share, is_crossed) = scene.straight_transmittance(&self.si, &emitter_sample.shadow_ray);
                scattered *= share;
            }
        }
        match emitter_sample.pdf {
            None => scattered,
            // A sampled direction does not find light straight through glass.
            Some(pdf) if is_crossed => scattered / pdf.0,
            Some(pdf) => {
                let by_bsdf = self.bsdf.pdf(&self.query, wo);
                let weight = power_heuristic(
                    PerSolidAngle(sample_counts[0] * pdf.0),
                    PerSolidAngle(sample_counts[1] * by_bsdf.0),
                );
                scattered * (weight / pdf.0)
            }
        }
    }
}

/// The greatest chance with which Russian roulette lets a path go on, so that one caught by total reflection ends.
const MAX_SURVIVAL: f64 = 0.95;
/// Paths of light may survive roulette with certainty up to so many segments.
const MAX_CERTAIN_DEPTH: u32 = 32;

/// The chance with which Russian roulette lets a path go on: what it can still carry, at most 0.95, so that a path
/// caught by total reflection ends. Compression of radiance in dense media does not count as loss.
#[must_use]
pub fn survival(throughput: Rgb, eta: f64) -> f64 {
    (throughput.max_element() * eta * eta).min(MAX_SURVIVAL)
}
