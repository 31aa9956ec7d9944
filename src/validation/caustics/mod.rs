//! The laws of caustics: light that mirrors and glass focus on diffuse surfaces.

pub mod ball;
pub mod cylinder;
pub mod density;
pub mod pane;
pub mod profile;

use crate::{
    photon::{EmittedPhotons, PhotonMapKind, trace_photons},
    scene::Scene,
    stats::Moments,
    transport::PathLimits,
};

/// Settings of independent sets of photons.
#[derive(Clone, Copy)]
struct PhotonSets {
    kind: PhotonMapKind,
    /// The number of photons that each set emits.
    emitted: u64,
    /// The number of sets.
    count: u32,
    seed: u64,
}

impl PhotonSets {
    /// Applies `measure` to the index and the photons of each set.
    fn each<T>(&self, scene: &Scene, measure: impl Fn(u64, EmittedPhotons) -> T) -> Vec<T> {
        const LIMITS: PathLimits = PathLimits { max_depth: u32::MAX, rr_depth: 1 };
        let set = |set| measure(set, trace_photons(scene, self.kind, self.emitted, LIMITS, [self.seed, set, 0]));
        (0..u64::from(self.count)).map(set).collect()
    }
}

/// The moments, over the sets, of the `i`-th of the values measured for each.
fn column<T: AsRef<[f64]>>(found: &[T], i: usize) -> Moments {
    found.iter().map(|numbers| numbers.as_ref()[i]).collect()
}
