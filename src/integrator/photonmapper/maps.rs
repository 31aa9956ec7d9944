use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};

use super::settings::{Direct, Settings};
use crate::{
    integrator::Notes,
    photon::{Aim, Harvest, Lookup, Map, ShadowMap, harvest},
    scene::Scene,
    transport::Depths,
};

/// What is gathered before a pass.
#[derive(Debug)]
pub(super) struct Maps {
    pub(super) global: Map,
    /// Empty if nothing casts caustics.
    pub(super) caustic: Map,
    pub(super) shadow: Option<ShadowMap>,
    pub(super) global_lookup: Lookup,
    pub(super) caustic_lookup: Lookup,
    pub(super) shadow_rays: ShadowRays,
    notes: Notes,
}

/// How many connections with lights there were, and how many of them needed no ray.
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

/// What streams of random numbers are for, so that no two maps share any, nor a map and the samples of pixels.
const GLOBAL: u64 = 0x67_6c6f_6261_6c00;
const CAUSTIC: u64 = 0x63_6175_7374_6963;
const SHADOW: u64 = 0x73_6861_646f_7700;

impl Maps {
    /// Emits all photons of a pass.
    pub(super) fn new(scene: &Scene, settings: &Settings, seed: u64, pass: u64) -> Self {
        // The last segment is that to the eye.
        let depths = Depths { max: settings.depths.max.saturating_sub(1), ..settings.depths };
        let [global_lookup, caustic_lookup] = settings.lookups(scene);
        let mut notes = Notes::default();
        let mut build = |aim, count, purpose| {
            let start = Instant::now();
            let harvest = harvest(scene, aim, count, depths, [seed, pass, purpose]);
            note(&mut notes, aim, &harvest);
            let traced = start.elapsed();
            let map = Map::new(&harvest.positions, harvest.photons);
            let name = name(aim);
            let megabytes = map.bytes() as f64 / 1e6;
            let (traced, built) = (traced.as_secs_f64(), start.elapsed().as_secs_f64() - traced.as_secs_f64());
            notes.facts.push(format!(
                "{name} map: {} photons of {count} emitted, {megabytes:.1} MB, traced in {traced:.2} s, built in {built:.2} s",
                map.len()
            ));
            map
        };
        let global = build(Aim::Everywhere, settings.global_photons, GLOBAL);
        let caustic = if scene.has_specular() {
            build(Aim::Specular, settings.caustic_photons, CAUSTIC)
        } else {
            Map::new(&[], Vec::new())
        };
        let shadow = (settings.direct == Direct::ShadowPhotons)
            .then(|| ShadowMap::new(scene, settings.global_photons, global_lookup, [seed, pass, SHADOW]));
        if let Some(shadow) = &shadow {
            notes.facts.push(format!("shadow map: {} photons", shadow.map().len()));
        }
        Self { global, caustic, shadow, global_lookup, caustic_lookup, shadow_rays: ShadowRays::default(), notes }
    }

    /// What was gathered, and what was saved by it.
    pub(super) fn notes(&self) -> Notes {
        let mut notes = self.notes.clone();
        notes.facts.extend(self.shadow_rays.fact());
        notes
    }
}

fn name(aim: Aim) -> &'static str {
    match aim {
        Aim::Everywhere => "global",
        Aim::Specular => "caustic",
    }
}

/// Warns of a map without photons where there should be some.
fn note(notes: &mut Notes, aim: Aim, harvest: &Harvest) {
    if !harvest.photons.is_empty() {
        return;
    }
    let emitted = harvest.emitted;
    notes.warnings.push(match aim {
        Aim::Everywhere => {
            format!("none of {emitted} photons met a surface that could keep it: there is no light in the global map")
        }
        Aim::Specular => format!("none of {emitted} photons was cast on a surface by mirrors or glass: no caustics"),
    });
}
