use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};

use super::settings::{Direct, Settings};
use crate::{
    integrator::Notes,
    photon::{EmittedPhotons, EstimateParameters, PhotonMap, PhotonMapKind, ShadowMap, trace_photons},
    scene::Scene,
};

/// The photon maps of a replicate.
#[derive(Debug)]
pub(super) struct Maps {
    pub(super) global: PhotonMap,
    /// The caustic map; empty if nothing casts caustics.
    pub(super) caustic: PhotonMap,
    pub(super) shadow: Option<ShadowMap>,
    pub(super) global_lookup: EstimateParameters,
    pub(super) caustic_lookup: EstimateParameters,
    pub(super) shadow_rays: ShadowRays,
    notes: Notes,
}

/// The number of shadow tests, and the number of them that needed no ray.
#[derive(Debug, Default)]
pub(super) struct ShadowRays {
    all: AtomicU64,
    saved: AtomicU64,
}

impl ShadowRays {
    pub(super) fn count(&self, is_saved: bool) {
        self.all.fetch_add(1, Ordering::Relaxed);
        self.saved.fetch_add(u64::from(is_saved), Ordering::Relaxed);
    }

    fn fact(&self) -> Option<String> {
        let (all, saved) = (self.all.load(Ordering::Relaxed), self.saved.load(Ordering::Relaxed));
        (all > 0).then(|| {
            format!("shadow photons decided {saved} of {all} shadow rays ({:.1} %)", 100.0 * saved as f64 / all as f64)
        })
    }
}

// Identifiers of random streams: no two maps share one, and no map shares one with the samples of pixels.
const GLOBAL: u64 = 0x67_6c6f_6261_6c00;
const CAUSTIC: u64 = 0x63_6175_7374_6963;
const SHADOW: u64 = 0x73_6861_646f_7700;

impl Settings {
    /// Emits the photons of a map; None for the caustic map if nothing casts caustics.
    pub(super) fn trace_photons(
        &self,
        scene: &Scene,
        kind: PhotonMapKind,
        seed: u64,
        replicate: u64,
    ) -> Option<EmittedPhotons> {
        let (count, purpose) = match kind {
            PhotonMapKind::Global => (self.global_photons, GLOBAL),
            PhotonMapKind::Caustic => (self.caustic_photons, CAUSTIC),
        };
        // The connection to the camera path adds the last segment.
        let limits = self.limits.without_last();
        (kind == PhotonMapKind::Global || scene.has_specular())
            .then(|| trace_photons(scene, kind, count, limits, [seed, replicate, purpose]))
    }
}

impl Maps {
    /// Emits all photons of a replicate.
    pub(super) fn new(scene: &Scene, settings: &Settings, seed: u64, replicate: u64) -> Self {
        let [global_lookup, caustic_lookup] = settings.lookups(scene);
        let mut notes = Notes::default();
        let mut build = |kind: PhotonMapKind| {
            let start = Instant::now();
            let Some(emitted) = settings.trace_photons(scene, kind, seed, replicate) else {
                return PhotonMap::new(&[], Vec::new());
            };
            notes.warnings.extend(emitted.warning(kind));
            let traced = start.elapsed();
            let count = emitted.emitted;
            let map = PhotonMap::new(&emitted.positions, emitted.photons);
            let name = kind.name();
            let megabytes = map.bytes() as f64 / 1e6;
            let (traced, built) = (traced.as_secs_f64(), start.elapsed().as_secs_f64() - traced.as_secs_f64());
            notes.facts.push(format!(
                "{name} map: {} photons of {count} emitted, {megabytes:.1} MB, traced in {traced:.2} s, built in {built:.2} s",
                map.len()
            ));
            map
        };
        let (global, caustic) = (build(PhotonMapKind::Global), build(PhotonMapKind::Caustic));
        let shadow = (settings.direct == Direct::ShadowPhotons)
            .then(|| ShadowMap::new(scene, settings.global_photons, global_lookup, [seed, replicate, SHADOW]));
        if let Some(shadow) = &shadow {
            notes.facts.push(format!("shadow map: {} photons", shadow.len()));
        }
        Self { global, caustic, shadow, global_lookup, caustic_lookup, shadow_rays: ShadowRays::default(), notes }
    }

    /// Sizes and times of the maps, and the number of saved shadow rays.
    pub(super) fn notes(&self) -> Notes {
        let mut notes = self.notes.clone();
        notes.facts.extend(self.shadow_rays.fact());
        notes
    }
}
