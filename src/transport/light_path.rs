use std::ops::ControlFlow;

use super::{LightPathClass, MAX_CERTAIN_DEPTH, MAX_SURVIVAL, PathLimits, ShadingPoint};
use crate::{
    bsdf::TransportMode,
    emitter::Emission,
    math::{Ray, Rgb},
    sampler::SampleStream,
    scene::{Scene, SurfaceInteraction},
    shape::Surface,
};

/// A vertex of a path from an emitter: light that arrives at a surface.
pub struct LightVertex<'s> {
    /// The surface point and the direction from which the light arrives.
    pub point: ShadingPoint<'s>,
    /// The power in W that it carries, if it is the only light that is emitted.
    pub flux: Rgb,
    /// The depth: 1 for the first surface that the emitted ray hits.
    pub depth: u32,
    /// The class, by the lobes of the vertices before.
    pub class: LightPathClass,
}

/// Traces a path of emitted light through the scene and calls `visit` for each of its vertices, until `visit` returns
/// `Break`, the light is absorbed or leaves the scene, or the path reaches the maximum depth.
///
/// From `rr_depth` on, Russian roulette continues a path with probability equal to the ratio of its greatest channel
/// after and before scattering. So stored photons have similar power; one channel may gain while others lose (Jensen
/// 2001, section 5.2.3).
#[inline]
pub fn trace_light_path<'s, S: SampleStream>(
    scene: &'s Scene,
    emission: &Emission,
    limits: PathLimits,
    sampler: &mut S,
    mut visit: impl FnMut(&LightVertex<'s>, &mut S) -> ControlFlow<()>,
) {
    let mut flux = emission.flux;
    let mut class = LightPathClass::START;
    let mut ray = emission.ray;
    let mut previous: Option<SurfaceInteraction> = None;
    for depth in 1..=limits.max_depth {
        // Intersection and absorption.
        let Some(si) = scene.intersect(&ray) else { return };
        if scene.absorbs() {
            flux *= scene.transmittance(previous.as_ref(), &ray, Some(&si));
        }
        if flux == Rgb::ZERO {
            return;
        }
        let vertex = LightVertex { point: ShadingPoint::new(scene, si, TransportMode::Importance), flux, depth, class };
        if visit(&vertex, sampler).is_break() || depth == limits.max_depth {
            return;
        }

        // BSDF sampling.
        let Some(sample) = vertex.point.sample_bsdf(sampler) else { return };
        let direction = si.surface.shading.to_world(sample.wo);
        let mut scattered = flux * sample.weight;
        scattered *= shading_normal_correction(&si.surface, si.wi_world, direction);

        // Russian roulette.
        if depth >= limits.rr_depth {
            let kept = scattered.max_element() / flux.max_element();
            let survival = kept.min(if depth < MAX_CERTAIN_DEPTH { 1.0 } else { MAX_SURVIVAL });
            if sampler.next_1d() >= survival {
                return;
            }
            scattered /= survival;
        }
        flux = scattered;
        class = class.scattered(sample.lobe);
        ray = Ray::leaving(si.surface.p, direction);
        previous = Some(si);
    }
}

/// The factor by which importance transport differs from radiance transport where the shading normal is not the
/// geometric normal, for light from the direction `from` that is scattered into the direction `to`. Veach 1997, eq.
/// (5.19).
#[inline]
#[must_use]
pub fn shading_normal_correction(surface: &Surface, from: glam::DVec3, to: glam::DVec3) -> f64 {
    let (geometric_n, shading_n) = (surface.n, surface.shading.n);
    if geometric_n == shading_n {
        return 1.0;
    }
    let cosines = (from.dot(shading_n) * to.dot(geometric_n), from.dot(geometric_n) * to.dot(shading_n));
    if cosines.1 == 0.0 { 0.0 } else { (cosines.0 / cosines.1).abs() }
}
