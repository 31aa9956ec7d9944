use std::ops::ControlFlow;

use super::{LightPathClass, MAX_CERTAIN_DEPTH, MAX_SURVIVAL, PathLimits};
use crate::{
    bsdf::{Bsdf, BsdfModel as _, Query, TransportMode},
    emitter::Emission,
    math::{Ray, Rgb},
    sampler::SampleStream,
    scene::{Scene, SurfaceInteraction},
    shape::Surface,
};

/// Light that arrives at a surface on its way from its source.
pub struct LightVertex<'s> {
    /// Where.
    pub si: SurfaceInteraction,
    /// The material there.
    pub bsdf: &'s Bsdf,
    /// From where it comes, in the shading frame.
    pub query: Query,
    /// The power in W that it carries, if it is the only light that is emitted.
    pub flux: Rgb,
    /// Segments from the light to here.
    pub depth: u32,
    /// Which surfaces it has met before.
    pub before: LightPathClass,
}

/// Follows light from its source through the scene, and shows each of its arrivals to `visit`, until that breaks off, the
/// light is absorbed or leaves, or the longest path is reached.
///
/// From the segment on with which roulette begins, the light survives with a chance that keeps the greatest channel of
/// its power, so that those that arrive are of equal power; one channel may gain what others lose (Jensen 2001,
/// section 5.2.3).
#[inline]
pub fn walk<'s, N: SampleStream>(
    scene: &'s Scene,
    emission: &Emission,
    limits: PathLimits,
    sampler: &mut N,
    mut visit: impl FnMut(&LightVertex<'s>, &mut N) -> ControlFlow<()>,
) {
    let mut flux = emission.flux;
    let mut before = LightPathClass::START;
    let mut ray = emission.ray;
    let mut left: Option<SurfaceInteraction> = None;
    for depth in 1..=limits.max_depth {
        let Some(si) = scene.intersect(&ray) else { return };
        if scene.absorbs() {
            flux *= scene.transmittance(left.as_ref(), &ray, Some(&si));
        }
        if flux == Rgb::ZERO {
            return;
        }
        let wi = si.surface.shading.to_local(si.wi_world);
        let query = Query { wi, uv: si.surface.uv, mode: TransportMode::Importance };
        let light_vertex = LightVertex { bsdf: scene.bsdf(&si), si, query, flux, depth, before };
        if visit(&light_vertex, sampler).is_break() || depth == limits.max_depth {
            return;
        }
        let Some(sample) = light_vertex.bsdf.sample(&query, sampler.next_1d(), sampler.next_2d()) else { return };
        let direction = si.surface.shading.to_world(sample.wo);
        let mut scattered = flux * sample.weight;
        scattered *= shading_normal_correction(&si.surface, si.wi_world, direction);
        if depth >= limits.rr_depth {
            let kept = scattered.max_element() / flux.max_element();
            let survival = kept.min(if depth < MAX_CERTAIN_DEPTH { 1.0 } else { MAX_SURVIVAL });
            if sampler.next_1d() >= survival {
                return;
            }
            scattered /= survival;
        }
        flux = scattered;
        before = before.scattered(sample.lobe);
        ray = Ray::leaving(si.surface.p, direction);
        left = Some(si);
    }
}

/// What light that is followed from its source carries more where the shading normal is not the true one, from a
/// direction and into another: the true surface's cosines over those of the BSDF. Veach 1997, eq. (5.19).
#[inline]
#[must_use]
pub fn shading_normal_correction(surface: &Surface, from: glam::DVec3, to: glam::DVec3) -> f64 {
    let (true_n, shading_n) = (surface.n, surface.shading.n);
    if true_n == shading_n {
        return 1.0;
    }
    let cosines = (from.dot(shading_n) * to.dot(true_n), from.dot(true_n) * to.dot(shading_n));
    if cosines.1 == 0.0 { 0.0 } else { (cosines.0 / cosines.1).abs() }
}
