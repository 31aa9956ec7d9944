//! Caustics: light that a mirror or a lens gathers on a diffuse surface.

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

/// Independent lots of photons.
#[derive(Clone, Copy)]
struct Lots {
    kind: PhotonMapKind,
    /// Photons of each.
    emitted: u64,
    count: u32,
    seed: u64,
}

impl Lots {
    /// Something about each lot.
    fn each<T>(&self, scene: &Scene, about: impl Fn(u64, EmittedPhotons) -> T) -> Vec<T> {
        const DEPTHS: PathLimits = PathLimits { max_depth: u32::MAX, rr_depth: 1 };
        let lot = |lot| about(lot, trace_photons(scene, self.kind, self.emitted, DEPTHS, [self.seed, lot, 0]));
        (0..u64::from(self.count)).map(lot).collect()
    }
}

/// The moments of one of several numbers that each lot has.
fn column<T: AsRef<[f64]>>(found: &[T], i: usize) -> Moments {
    found.iter().map(|numbers| numbers.as_ref()[i]).collect()
}
