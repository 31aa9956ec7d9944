//! The vocabulary of light transport that integrators share: weights, connections to lights, roulette.

use glam::DVec3;

use crate::{
    bsdf::{Bsdf, Model as _, Query, Transport},
    math::{PerSolidAngle, Rgb},
    sampler::Numbers,
    scene::{Scene, Vertex},
};

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

/// A vertex of a path that comes from the camera, seen in its shading frame.
pub struct Junction<'s> {
    /// The vertex.
    pub vertex: Vertex,
    /// Its material.
    pub bsdf: &'s Bsdf,
    /// From which side the path comes.
    pub query: Query,
}

impl<'s> Junction<'s> {
    /// The junction at a vertex.
    #[inline]
    #[must_use]
    pub fn new(scene: &'s Scene, vertex: Vertex) -> Self {
        let wi = vertex.surface.shading.to_local(vertex.back);
        let query = Query { wi, uv: vertex.surface.uv, transport: Transport::Radiance };
        Self { bsdf: scene.bsdf(&vertex), vertex, query }
    }

    /// The position.
    #[must_use]
    pub fn p(&self) -> DVec3 {
        self.vertex.surface.p
    }

    /// Next event estimation: the radiance that a randomly drawn light sends back along the path, weighted as one of
    /// two strategies of which the other is to sample the BSDF. `shares` are the numbers of samples of both, of lights
    /// first, in any unit.
    #[inline]
    pub fn connect(&self, scene: &Scene, numbers: &mut impl Numbers, shares: [f64; 2], shadows: Shadows) -> Rgb {
        // A delta lobe cannot be found by connection: only a sampled ray reaches a light through it.
        if !self.bsdf.is_smooth() {
            return Rgb::ZERO;
        }
        let Some(incident) = scene.sample_light(self.p(), numbers.next_2d()) else {
            return Rgb::ZERO;
        };
        let wo = self.vertex.surface.shading.to_local(incident.direction);
        let mut scattered = self.bsdf.eval_cos(&self.query, wo) * incident.value;
        if scattered == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let mut is_crossed = false;
        match shadows {
            Shadows::Opaque if scene.occluded(&incident.shadow_ray) => return Rgb::ZERO,
            Shadows::Opaque if scene.absorbs() => {
                scattered *= scene.transmittance(Some(&self.vertex), &incident.shadow_ray, None);
            }
            Shadows::Opaque => {}
            Shadows::Transparent => {
                let share;
                (share, is_crossed) = scene.straight_transmittance(&self.vertex, &incident.shadow_ray);
                scattered *= share;
            }
        }
        match incident.density {
            None => scattered,
            // A sampled direction does not find light straight through glass.
            Some(density) if is_crossed => scattered / density.0,
            Some(density) => {
                let by_bsdf = self.bsdf.density(&self.query, wo);
                let weight =
                    power_heuristic(PerSolidAngle(shares[0] * density.0), PerSolidAngle(shares[1] * by_bsdf.0));
                scattered * (weight / density.0)
            }
        }
    }
}

/// The chance with which Russian roulette lets a path go on: what it can still carry, at most 0.95, so that a path
/// caught by total reflection ends. Compression of radiance in dense media does not count as loss.
#[must_use]
pub fn survival(throughput: Rgb, eta: f64) -> f64 {
    (throughput.max_element() * eta * eta).min(0.95)
}
