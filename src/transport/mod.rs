//! The vocabulary of light transport that integrators share: weights, connections to lights, roulette.

mod class;
mod walk;

pub use class::{FromEye, FromLight, PathClass};
pub use walk::{Arrival, adjoint_of_shading, walk};

use glam::DVec3;

use crate::{
    bsdf::{Bsdf, Model as _, Query, Transport},
    emitter::Incident,
    math::{PerSolidAngle, Rgb},
    sampler::Numbers,
    scene::{Scene, Vertex},
};

/// How long paths may be, in segments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Depths {
    /// The longest.
    pub max: u32,
    /// After how many Russian roulette begins.
    pub roulette: u32,
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
    pub incident: Incident,
    /// The number of the light.
    pub light: usize,
    /// The direction to it in the shading frame.
    pub wo: DVec3,
    /// What goes on along the path, not yet divided by the density of the direction.
    pub scattered: Rgb,
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

    /// Draws a light to connect with, whether or not anything stands between; None if none is drawn that could be seen
    /// from here and be scattered along the path.
    #[inline]
    pub fn propose(&self, scene: &Scene, numbers: &mut impl Numbers) -> Option<Connection> {
        // A delta lobe cannot be found by connection: only a sampled ray reaches a light through it.
        if !self.bsdf.is_smooth() {
            return None;
        }
        let (incident, light) = scene.sample_light(self.p(), numbers.next_2d())?;
        let wo = self.vertex.surface.shading.to_local(incident.direction);
        let scattered = self.bsdf.eval_cos(&self.query, wo) * incident.value;
        (scattered != Rgb::ZERO).then_some(Connection { incident, light, wo, scattered })
    }

    /// Next event estimation: the radiance that a randomly drawn light sends back along the path, weighted as one of
    /// two strategies of which the other is to sample the BSDF. `shares` are the numbers of samples of both, of lights
    /// first, in any unit.
    #[inline]
    pub fn connect(&self, scene: &Scene, numbers: &mut impl Numbers, shares: [f64; 2], shadows: Shadows) -> Rgb {
        let Some(Connection { incident, wo, mut scattered, .. }) = self.propose(scene, numbers) else {
            return Rgb::ZERO;
        };
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

/// The greatest chance with which Russian roulette lets a path go on, so that one caught by total reflection ends.
const MOST_CERTAIN: f64 = 0.95;
/// Paths of light may survive roulette with certainty up to so many segments.
const LONGEST_CERTAIN: u32 = 32;

/// The chance with which Russian roulette lets a path go on: what it can still carry, at most 0.95, so that a path
/// caught by total reflection ends. Compression of radiance in dense media does not count as loss.
#[must_use]
pub fn survival(throughput: Rgb, eta: f64) -> f64 {
    (throughput.max_element() * eta * eta).min(MOST_CERTAIN)
}
