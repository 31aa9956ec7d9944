use std::ops::ControlFlow;

use rayon::prelude::*;

use super::{MAX_PHOTON_DEPTH, Photon, SurfaceSide};
use crate::{
    bsdf::BsdfModel as _,
    emitter::Emission,
    math::{Rgb, rng::Stream},
    scene::Scene,
    transport::{LightVertex, PathClass, PathLimits, trace_light_path},
};

/// The photon maps of Jensen's method, by the light that they hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonMapKind {
    /// All light; photons are stored on every surface with a smooth lobe.
    Global,
    /// Light that hits mirrors or glass first; photons are stored on the first surfaces with a smooth lobe after them.
    Caustic,
}

impl PhotonMapKind {
    /// Both kinds.
    pub const ALL: [Self; 2] = [Self::Global, Self::Caustic];

    /// The name of the map.
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

    /// Whether a path can still store photons in the map once it has reached a vertex.
    fn follows(self, vertex: &LightVertex<'_>) -> bool {
        match (self, vertex.class.class()) {
            (Self::Global, _) | (Self::Caustic, PathClass::Caustic) => true,
            (Self::Caustic, PathClass::Direct) => vertex.point.bsdf.has_delta(),
            (Self::Caustic, _) => false,
        }
    }

    fn stores(self, vertex: &LightVertex<'_>) -> bool {
        vertex.point.bsdf.is_smooth() && (self == Self::Global || vertex.class.class() == PathClass::Caustic)
    }
}

/// Statistics of photons of one class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonStatistics {
    /// The number of photons.
    pub stored: u64,
    /// The sum of their powers in W.
    pub power: Rgb,
    /// The total number of surfaces that scattered them before.
    pub bounces: u64,
}

impl PhotonStatistics {
    /// The mean number of surfaces that scattered a photon before; None without photons.
    #[must_use]
    pub fn mean_bounces(&self) -> Option<f64> {
        (self.stored > 0).then(|| self.bounces as f64 / self.stored as f64)
    }
}

/// The stored photons of some emitted ones, with their positions.
#[derive(Debug, Default)]
pub struct EmittedPhotons {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// Photons; each has the power of its path over the number of emitted photons.
    pub photons: Vec<Photon>,
    /// The number of emitted photons, by which powers are divided.
    pub emitted: u64,
    /// The power in W that was emitted.
    pub power: Rgb,
    /// The maximum depth of their paths.
    pub max_depth: u32,
}

impl EmittedPhotons {
    /// Statistics of the photons of a class.
    #[must_use]
    pub fn statistics(&self, class: PathClass) -> PhotonStatistics {
        let of_class = self.photons.iter().filter(|photon| photon.class() == class);
        of_class.fold(PhotonStatistics::default(), |statistics, photon| PhotonStatistics {
            stored: statistics.stored + 1,
            power: statistics.power + photon.power(),
            bounces: statistics.bounces + u64::from(photon.bounces()),
        })
    }

    /// All photons of some batches, in their order.
    #[must_use]
    pub fn join(batches: Vec<Self>) -> Self {
        let count = batches.iter().map(|batch| batch.photons.len()).sum();
        let (positions, photons) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut all = Self { positions, photons, ..Self::default() };
        for batch in batches {
            all.positions.extend(batch.positions);
            all.photons.extend(batch.photons);
            all.emitted += batch.emitted;
            all.power += batch.power;
            all.max_depth = all.max_depth.max(batch.max_depth);
        }
        all
    }

    /// A warning if no photon was stored although some could have been.
    #[must_use]
    pub fn warning(&self, kind: PhotonMapKind) -> Option<String> {
        let emitted = self.emitted;
        if self.max_depth == 0 || !self.photons.is_empty() {
            return None;
        }
        Some(match kind {
            PhotonMapKind::Global if self.power == Rgb::ZERO => format!("none of {emitted} photons carried any light"),
            PhotonMapKind::Global => {
                format!("none of {emitted} photons hit a surface that can store it: the global map is empty")
            }
            PhotonMapKind::Caustic => {
                format!(
                    "none of {emitted} photons reached a surface through mirrors or glass: the image has no caustics"
                )
            }
        })
    }
}

/// The address of the random numbers of some photons: the seed, the replicate, and an identifier of the photons'
/// purpose. Each photon appends its own index.
pub type PhotonAddress = [u64; 3];

/// The number of photons that are traced together.
const BATCH: u64 = 2048;

/// Calls `trace` for each of `count` photons with its own random numbers, on all threads. Each batch has its own
/// result. The batches, and the photons of each batch, are in the order of the photons' indices.
pub(super) fn in_batches<T: Default + Send>(
    count: u64,
    address: PhotonAddress,
    trace: impl Fn(&mut Stream, &mut T) + Sync,
) -> Vec<T> {
    let batch = |batch: u64| {
        let mut result = T::default();
        for number in batch * BATCH..count.min((batch + 1) * BATCH) {
            let [seed, replicate, purpose] = address;
            trace(&mut Stream::at(&[seed, replicate, purpose, number]), &mut result);
        }
        result
    };
    (0..count.div_ceil(BATCH)).into_par_iter().map(batch).collect()
}

/// Emits and traces `count` photons. Each depends only on the address and its own index, and they are stored in the
/// order of their indices.
#[must_use]
pub fn trace_photons(
    scene: &Scene,
    kind: PhotonMapKind,
    count: u64,
    limits: PathLimits,
    address: PhotonAddress,
) -> EmittedPhotons {
    EmittedPhotons::join(trace_photon_batches(scene, kind, count, limits, address))
}

/// The photons of [`trace_photons`], as the batches in which they were traced.
#[must_use]
pub fn trace_photon_batches(
    scene: &Scene,
    kind: PhotonMapKind,
    count: u64,
    limits: PathLimits,
    address: PhotonAddress,
) -> Vec<EmittedPhotons> {
    let limits = PathLimits { max_depth: limits.max_depth.min(MAX_PHOTON_DEPTH), ..limits };
    let per_photon = 1.0 / count as f64;
    in_batches(count, address, |sampler, batch: &mut EmittedPhotons| {
        batch.emitted += 1;
        batch.max_depth = limits.max_depth;
        let Some(emission) = kind.emit(scene, sampler) else { return };
        batch.power += per_photon * emission.flux;
        trace_light_path(scene, &emission, limits, sampler, |vertex, _| {
            if !kind.follows(vertex) {
                return ControlFlow::Break(());
            }
            if kind.stores(vertex) {
                batch.positions.push(vertex.point.p().as_vec3().to_array());
                batch.photons.push(photon(scene, vertex, per_photon));
            }
            ControlFlow::Continue(())
        });
    })
}

fn photon(scene: &Scene, vertex: &LightVertex<'_>, per_photon: f64) -> Photon {
    let si = &vertex.point.si;
    let side = SurfaceSide::facing(scene, si);
    Photon::new(per_photon * vertex.flux, si.wi_world, side, vertex.depth, vertex.class.class())
}
