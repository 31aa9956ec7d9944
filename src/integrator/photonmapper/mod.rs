mod estimator;
mod final_gather;
mod histogram;
mod maps;
mod settings;

use estimator::PhotonMapping;
use maps::Maps;
use settings::{PARAMS, Settings};

use super::{Estimator, IntegratorModel, IntegratorState, Iteration, IterationPlan, photons::check_photons};
use crate::{
    film::LayerSpec,
    photon::{EmittedPhotons, PhotonMapKind},
    scene::Scene,
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
    transport::PathClass,
};

/// Jensen's photon mapping in two steps. The first step emits photons for two maps. The *global* map holds all light on
/// surfaces with a smooth lobe, `L(S|D)*D`. The *caustic* map holds `LS+D`; its photons are aimed at mirrors and glass.
/// The second step follows camera paths through mirrors and glass; where a surface has several delta lobes, it samples
/// one. At the first surface with a smooth lobe it estimates light in three parts. So the image has four layers, which
/// add up to it:
///
/// | layer | paths | found by |
/// |---|---|---|
/// | `direct` | `LE`, `LDE` | emitter sampling and gather rays that hit an emitter, weighted by the power heuristic; or the global map; or emitter sampling with shadow photons in place of most shadow rays, which sharpens penumbras |
/// | `specular` | `L(S\|D)*SE` | the other three, seen in a mirror or through glass |
/// | `caustic` | `LS+DE` | the caustic map alone |
/// | `indirect` | `L(S\|D)*DS*DE` | final gathering: gather rays through mirrors and glass to a surface where the global map gives the light; or the global map alone |
///
/// Each path belongs to one layer. An invisible surface (`null`) counts as `S`. Self-emission of materials emits no
/// photons.
///
/// Estimates are biased, because they are means over discs. With `lookup_size` k the disc reaches to the k-th nearest
/// photon, at most to the maximum radius, and the k - 1 nearer photons count. With 0 it always has the maximum radius.
/// Photons count only on their own side of their own shape, which is identified by 14 bits of a hash. Near the border
/// of a rectangle or of a cube's face the disc is cut at the border; other shapes look dark within a radius of their
/// border. Photon counts are numbers of emitted photons, and powers are divided by them. In Mitsuba 0.6 they are
/// numbers of stored photons.
///
/// All pixels of an image share their photons, so the image has no variance layers.
///
/// Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*, chapters 5 to 9.
#[derive(Clone, Debug)]
pub struct PhotonMapper {
    settings: Settings,
}

impl Described for PhotonMapper {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        manual: manual!("mod.rs": "PhotonMapper"),
        name: "photonmapper",
        summary: "Photon mapping in two steps, with a separate map for caustics.",
        params: PARAMS,
        examples: &[
            r#"<integrator type="photonmapper"><integer name="max_depth" value="8"/></integrator>"#,
            r#"<integrator type="photonmapper"><string name="direct" value="map"/><string name="indirect" value="map"/>
                <integer name="global_photons" value="100000"/><integer name="lookup_size" value="0"/>
                <float name="global_lookup_radius" value="0.1"/></integrator>"#,
        ],
        evidence: &["photon-map/*", "caustic/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { settings: Settings::read(params)? })
    }
}

impl PhotonMapper {
    /// Emits the photons of one map, the same ones that a render of this replicate uses. None for the caustic map if
    /// nothing in the scene casts caustics.
    #[must_use]
    pub fn trace_photons(
        &self,
        scene: &Scene,
        kind: PhotonMapKind,
        seed: u64,
        replicate: u64,
    ) -> Option<EmittedPhotons> {
        self.settings.trace_photons(scene, kind, seed, replicate)
    }
}

impl IntegratorModel for PhotonMapper {
    fn layers(&self) -> Vec<LayerSpec> {
        let classes = PathClass::ALL.iter().map(|class| class.name());
        classes.chain(self.settings.shows_raw.then_some("raw")).map(LayerSpec::sampled).collect()
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        check_photons(scene)
    }

    fn iterations(&self) -> IterationPlan {
        IterationPlan::PerReplicate
    }

    fn begin<'s>(&'s self, scene: &'s Scene, iteration: &Iteration, _: &IntegratorState) -> Box<dyn Estimator + 's> {
        let maps = Maps::new(scene, &self.settings, iteration.seed, iteration.replicate);
        Box::new(PhotonMapping { scene, settings: &self.settings, maps })
    }
}
