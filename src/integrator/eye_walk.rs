use glam::DVec3;

use super::first_vertex;
use crate::{
    bsdf::Sample,
    math::{Ray, Rgb},
    sampler::{PathSampler, SampleStream as _},
    scene::{Scene, SurfaceInteraction},
    transport::{CameraPathClass, PathLimits, survival},
};

/// A path from the eye of an integrator that finds most light in photons, up to where it is.
pub(super) struct EyeWalk<'s> {
    scene: &'s Scene,
    rr_depth: u32,
    /// What it carries.
    pub(super) throughput: Rgb,
    /// The index of refraction where it is over that where it began.
    eta: f64,
    pub(super) state: CameraPathClass,
    direction: DVec3,
    /// Where it is; None if it has left the scene.
    pub(super) met: Option<SurfaceInteraction>,
}

/// Paths from the eye are rolled for from this segment on at the earliest: photons are many, and alike in power if they are
/// rolled for at once, but each path of these is seen.
const FIRST_ROULETTE: u32 = 5;

impl<'s> EyeWalk<'s> {
    /// A path that has met nothing.
    pub(super) fn new(scene: &'s Scene, limits: PathLimits) -> Self {
        let rr_depth = limits.rr_depth.max(FIRST_ROULETTE);
        let (state, direction) = (CameraPathClass::START, DVec3::ZERO);
        Self { scene, rr_depth, throughput: Rgb::ONE, eta: 1.0, state, direction, met: None }
    }

    /// A path along a camera's ray up to what that meets first.
    pub(super) fn along(scene: &'s Scene, limits: PathLimits, ray: &Ray, hide_emitters: bool) -> Self {
        let met = first_vertex(scene, ray, hide_emitters);
        let throughput = if scene.absorbs() { scene.transmittance(None, ray, met.as_ref()) } else { Rgb::ONE };
        Self { throughput, direction: ray.direction, met, ..Self::new(scene, limits) }
    }

    /// The radiance of the light that it has met, be it the sky.
    pub(super) fn emitted(&self) -> Rgb {
        self.met.map_or_else(|| self.scene.environment(self.direction), |si| self.scene.emitted(&si))
    }

    /// Goes on from a vertex after so many segments, if it survives: with what it carries there, less what the medium absorbs
    /// on the way.
    pub(super) fn advance(
        &mut self,
        from: &SurfaceInteraction,
        sample: &Sample,
        depth: u32,
        sampler: &mut PathSampler,
    ) -> bool {
        self.throughput *= sample.weight;
        self.eta *= sample.eta;
        if depth >= self.rr_depth {
            let survival = survival(self.throughput, self.eta);
            if sampler.next_1d() >= survival {
                return false;
            }
            self.throughput /= survival;
        }
        if self.throughput == Rgb::ZERO {
            return false;
        }
        self.state = self.state.scattered(sample.lobe);
        self.direction = from.surface.shading.to_world(sample.wo);
        let ray = Ray::leaving(from.surface.p, self.direction);
        self.met = self.scene.intersect(&ray);
        if self.scene.absorbs() {
            self.throughput *= self.scene.transmittance(Some(from), &ray, self.met.as_ref());
        }
        true
    }
}
