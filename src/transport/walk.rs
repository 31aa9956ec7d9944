use std::ops::ControlFlow;

use super::{Depths, FromLight, LONGEST_CERTAIN, MOST_CERTAIN};
use crate::{
    bsdf::{Bsdf, Model as _, Query, Transport},
    emitter::Emission,
    math::{Ray, Rgb},
    sampler::Numbers,
    scene::{Scene, Vertex},
    shape::Surface,
};

/// Light that arrives at a surface on its way from its source.
pub struct Arrival<'s> {
    /// Where.
    pub vertex: Vertex,
    /// The material there.
    pub bsdf: &'s Bsdf,
    /// From where it comes, in the shading frame.
    pub query: Query,
    /// The power in W that it carries, if it is the only light that is emitted.
    pub flux: Rgb,
    /// Segments from the light to here.
    pub depth: u32,
    /// Which surfaces it has met before.
    pub before: FromLight,
}

/// Follows light from its source through the scene, and shows each of its arrivals to `visit`, until that breaks off, the
/// light is absorbed or leaves, or the longest path is reached.
///
/// From the segment on with which roulette begins, the light survives with a chance that keeps the greatest channel of
/// its power, so that those that arrive are of equal power; one channel may gain what others lose (Jensen 2001,
/// section 5.2.3).
#[inline]
pub fn walk<'s, N: Numbers>(
    scene: &'s Scene,
    emission: &Emission,
    depths: Depths,
    numbers: &mut N,
    mut visit: impl FnMut(&Arrival<'s>, &mut N) -> ControlFlow<()>,
) {
    let mut flux = emission.flux;
    let mut before = FromLight::START;
    let mut ray = emission.ray;
    let mut left: Option<Vertex> = None;
    for depth in 1..=depths.max {
        let Some(vertex) = scene.intersect(&ray) else { return };
        if scene.absorbs() {
            flux *= scene.transmittance(left.as_ref(), &ray, Some(&vertex));
        }
        if flux == Rgb::ZERO {
            return;
        }
        let wi = vertex.surface.shading.to_local(vertex.back);
        let query = Query { wi, uv: vertex.surface.uv, transport: Transport::Flux };
        let arrival = Arrival { bsdf: scene.bsdf(&vertex), vertex, query, flux, depth, before };
        if visit(&arrival, numbers).is_break() || depth == depths.max {
            return;
        }
        let Some(sample) = arrival.bsdf.sample(&query, numbers.next_1d(), numbers.next_2d()) else { return };
        let direction = vertex.surface.shading.to_world(sample.wo);
        let mut scattered = flux * sample.weight;
        scattered *= adjoint_of_shading(&vertex.surface, vertex.back, direction);
        if depth >= depths.roulette {
            let kept = scattered.max_element() / flux.max_element();
            let survival = kept.min(if depth < LONGEST_CERTAIN { 1.0 } else { MOST_CERTAIN });
            if numbers.next_1d() >= survival {
                return;
            }
            scattered /= survival;
        }
        flux = scattered;
        before = before.scattered(sample.lobe);
        ray = Ray::leaving(vertex.surface.p, direction);
        left = Some(vertex);
    }
}

/// What light that is followed from its source carries more where the shading normal is not the true one, from a
/// direction and into another: the true surface's cosines over those of the BSDF. Veach 1997, eq. (5.19).
#[inline]
#[must_use]
pub fn adjoint_of_shading(surface: &Surface, from: glam::DVec3, to: glam::DVec3) -> f64 {
    let (true_n, shading_n) = (surface.n, surface.shading.n);
    if true_n == shading_n {
        return 1.0;
    }
    let cosines = (from.dot(shading_n) * to.dot(true_n), from.dot(true_n) * to.dot(shading_n));
    if cosines.1 == 0.0 { 0.0 } else { (cosines.0 / cosines.1).abs() }
}
