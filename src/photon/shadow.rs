use rayon::prelude::*;

use super::{EstimateParameters, Kernel, MAX_PHOTON_DEPTH, Map, Photon, map::GatherPoint};
use crate::{
    math::{Ray, Rgb, rng::Stream},
    scene::{Scene, SurfaceInteraction},
    transport::PathClass,
};

/// Where lights shine and where they do not: photons that arrive first, and shadow photons wherever their way would have
/// gone on, behind what stopped them. Jensen and Christensen 1995, "Efficiently Rendering Shadows using the Photon Map".
#[derive(Debug)]
pub struct ShadowMap {
    map: Map,
    lookup: EstimateParameters,
}

/// What nearby photons say of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// All have arrived.
    Lit,
    /// None has.
    Dark,
    /// Both kinds, or too few to tell.
    Unknown,
}

/// Photons that are followed together.
const BATCH: u64 = 2048;
/// Fewer photons of a light nearby say nothing of it.
const MIN_COUNT: usize = 8;

impl ShadowMap {
    /// Emits so many photons, each a function of the address and its number alone.
    #[must_use]
    pub fn new(scene: &Scene, emitted: u64, lookup: EstimateParameters, address: [u64; 3]) -> Self {
        let batch = |batch: u64| {
            let mut found = Vec::new();
            for index in batch * BATCH..emitted.min((batch + 1) * BATCH) {
                let [seed, replicate, purpose] = address;
                let mut sampler = Stream::at(&[seed, replicate, purpose, index]);
                if let Some((emission, light)) = scene.emit(&mut sampler) {
                    pierce(scene, emission.ray, |si, is_first| {
                        found.push((si.surface.p.as_vec3().to_array(), mark(scene, si, light, is_first)));
                    });
                }
            }
            found
        };
        let batches: Vec<_> = (0..emitted.div_ceil(BATCH)).into_par_iter().map(batch).collect();
        let (positions, photons): (Vec<_>, Vec<_>) = batches.into_iter().flatten().unzip();
        Self { map: Map::new(&positions, photons), lookup: EstimateParameters { kernel: Kernel::Constant, ..lookup } }
    }

    /// The photons.
    #[must_use]
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// What the photons around a place say of a light.
    #[must_use]
    pub fn shade(&self, point: &GatherPoint, light: usize) -> Visibility {
        let (mut lit, mut dark) = (0, 0);
        self.map.gather(point, &self.lookup, |photon, _| {
            if photon.depth() as usize == light {
                *(if photon.class() == PathClass::Direct { &mut lit } else { &mut dark }) += 1;
            }
        });
        // Lights beyond the last that photons can name share its number.
        match (lit, dark) {
            _ if light >= MAX_PHOTON_DEPTH as usize => Visibility::Unknown,
            (lit, 0) if lit >= MIN_COUNT => Visibility::Lit,
            (0, dark) if dark >= MIN_COUNT => Visibility::Dark,
            _ => Visibility::Unknown,
        }
    }
}

/// Shows all surfaces that a ray meets, and which of them is the first.
fn pierce(scene: &Scene, mut ray: Ray, mut show: impl FnMut(&SurfaceInteraction, bool)) {
    const MAX_COUNT: u32 = 64;
    for number in 0..MAX_COUNT {
        let Some(si) = scene.intersect(&ray) else { return };
        show(&si, number == 0);
        ray = Ray::leaving(si.surface.p, ray.direction);
    }
}

/// A photon that names a light by its depth, and by its class whether it has arrived.
fn mark(scene: &Scene, si: &SurfaceInteraction, light: usize, is_first: bool) -> Photon {
    let class = if is_first { PathClass::Direct } else { PathClass::Indirect };
    let light = light.min(MAX_PHOTON_DEPTH as usize) as u32;
    Photon::new(Rgb::ZERO, si.wi_world, si.facing(), scene.surface_id(si), light, class)
}
