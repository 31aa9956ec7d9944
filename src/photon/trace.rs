use std::ops::ControlFlow;

use rayon::prelude::*;

use super::{MAX_PHOTON_DEPTH, Photon};
use crate::{
    bsdf::BsdfModel as _,
    emitter::Emission,
    math::{Rgb, rng::Stream},
    scene::Scene,
    transport::{LightVertex, PathClass, PathLimits, walk},
};

/// Which light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonMapKind {
    /// All of it; photons are kept wherever they meet a surface that scatters over more than single directions.
    Global,
    /// Light that meets mirrors or glass first; photons are kept where it leaves them.
    Caustic,
}

impl PhotonMapKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Global, Self::Caustic];

    /// The name of the map that such light makes.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Global => "global",
            Self::Caustic => "caustic",
        }
    }

    /// The classes that photons of the map can have.
    #[must_use]
    pub fn classes(self) -> &'static [PathClass] {
        match self {
            Self::Global => &[PathClass::Direct, PathClass::Caustic, PathClass::Indirect],
            Self::Caustic => &[PathClass::Caustic],
        }
    }

    fn emit(self, scene: &Scene, sampler: &mut Stream) -> Option<Emission> {
        match self {
            Self::Global => scene.emit(sampler).map(|(emission, _)| emission),
            Self::Caustic => scene.emit_at_specular(sampler),
        }
    }

    /// Whether a path is still one that is followed when it arrives.
    fn follows(self, light_vertex: &LightVertex<'_>) -> bool {
        match (self, light_vertex.before.class()) {
            (Self::Global, _) | (Self::Caustic, PathClass::Caustic) => true,
            (Self::Caustic, PathClass::Direct) => light_vertex.bsdf.has_delta(),
            (Self::Caustic, _) => false,
        }
    }

    fn keeps(self, light_vertex: &LightVertex<'_>) -> bool {
        light_vertex.bsdf.is_smooth() && (self == Self::Global || light_vertex.before.class() == PathClass::Caustic)
    }
}

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonStatistics {
    /// Photons.
    pub stored: u64,
    /// The sum of their powers in W.
    pub power: Rgb,
    /// The sum of the numbers of surfaces that they had met before.
    pub bounces: u64,
}

impl PhotonStatistics {
    /// How many surfaces a photon had met before, on average; None without photons.
    #[must_use]
    pub fn mean_bounces(&self) -> Option<f64> {
        (self.stored > 0).then(|| self.bounces as f64 / self.stored as f64)
    }
}

/// Photons with where they arrived.
#[derive(Debug, Default)]
pub struct EmittedPhotons {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// Photons; each has the power of its path over the number of emitted ones.
    pub photons: Vec<Photon>,
    /// How many photons were emitted, which is what powers are divided by.
    pub emitted: u64,
    /// The power in W that was emitted.
    pub power: Rgb,
    /// The longest path that was followed, in segments.
    pub longest: u32,
}

impl EmittedPhotons {
    /// The counts of the photons of a class.
    #[must_use]
    pub fn statistics(&self, class: PathClass) -> PhotonStatistics {
        let of_class = self.photons.iter().filter(|photon| photon.class() == class);
        of_class.fold(PhotonStatistics::default(), |statistics, photon| PhotonStatistics {
            stored: statistics.stored + 1,
            power: statistics.power + photon.power(),
            bounces: statistics.bounces + u64::from(photon.bounces()),
        })
    }

    /// All of some, in their order.
    #[must_use]
    pub fn join(parts: Vec<Self>) -> Self {
        let count = parts.iter().map(|part| part.photons.len()).sum();
        let (positions, photons) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut all = Self { positions, photons, ..Self::default() };
        for part in parts {
            all.positions.extend(part.positions);
            all.photons.extend(part.photons);
            all.emitted += part.emitted;
            all.power += part.power;
            all.longest = all.longest.max(part.longest);
        }
        all
    }

    /// What is strange about it, if it holds no photon.
    #[must_use]
    pub fn warning(&self, kind: PhotonMapKind) -> Option<String> {
        let emitted = self.emitted;
        // Without a segment beyond that to the eye there is nothing to keep.
        if self.longest == 0 || !self.photons.is_empty() {
            return None;
        }
        Some(match kind {
            PhotonMapKind::Global if self.power == Rgb::ZERO => format!("none of {emitted} photons carried any light"),
            PhotonMapKind::Global => {
                format!(
                    "none of {emitted} photons met a surface that could keep it: there is no light in the global map"
                )
            }
            PhotonMapKind::Caustic => {
                format!("none of {emitted} photons was cast on a surface by mirrors or glass: no caustics")
            }
        })
    }
}

/// Photons that are followed together.
const BATCH: u64 = 2048;

/// Emits so many photons and follows them. Each is a function of the address and its number alone, and they are kept in
/// the order of their numbers.
#[must_use]
pub fn trace_photons(
    scene: &Scene,
    kind: PhotonMapKind,
    emitted: u64,
    limits: PathLimits,
    address: [u64; 3],
) -> EmittedPhotons {
    EmittedPhotons::join(trace_photon_batches(scene, kind, emitted, limits, address))
}

/// What [`emitted`] gives, in the pieces in which it was made.
#[must_use]
pub fn trace_photon_batches(
    scene: &Scene,
    kind: PhotonMapKind,
    emitted: u64,
    limits: PathLimits,
    address: [u64; 3],
) -> Vec<EmittedPhotons> {
    let limits = PathLimits { max_depth: limits.max_depth.min(MAX_PHOTON_DEPTH), ..limits };
    let share = 1.0 / emitted as f64;
    let batch = |batch: u64| {
        let sampler = batch * BATCH..emitted.min((batch + 1) * BATCH);
        let mut found = EmittedPhotons {
            emitted: sampler.end - sampler.start,
            longest: limits.max_depth,
            ..EmittedPhotons::default()
        };
        for index in sampler {
            let [seed, replicate, purpose] = address;
            let mut sampler = Stream::at(&[seed, replicate, purpose, index]);
            let Some(emission) = kind.emit(scene, &mut sampler) else { continue };
            found.power += share * emission.flux;
            walk(scene, &emission, limits, &mut sampler, |light_vertex, _| {
                if !kind.follows(light_vertex) {
                    return ControlFlow::Break(());
                }
                if kind.keeps(light_vertex) {
                    found.positions.push(light_vertex.si.surface.p.as_vec3().to_array());
                    found.photons.push(photon(scene, light_vertex, share));
                }
                ControlFlow::Continue(())
            });
        }
        found
    };
    (0..emitted.div_ceil(BATCH)).into_par_iter().map(batch).collect()
}

fn photon(scene: &Scene, light_vertex: &LightVertex<'_>, share: f64) -> Photon {
    let si = &light_vertex.si;
    let (depth, class) = (light_vertex.depth, light_vertex.before.class());
    Photon::new(share * light_vertex.flux, si.wi_world, si.facing(), scene.surface_id(si), depth, class)
}
