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
    scene_file::{Category, Described, Params, Plugin, SceneError},
    transport::PathClass,
};

/// Jensen's photon mapping in two steps. The first emits photons: some for a *global* map of all light on surfaces that
/// scatter over more than single directions, `L(S|D)*D`, others, aimed at mirrors and glass, for a map of *caustics*,
/// `LS+D`. The second follows paths from the camera through mirrors and glass, by chance where there is a choice, and
/// finds what the first other surface shows in three parts. So the image has four layers, which add up to it:
///
/// | layer | paths | found |
/// |---|---|---|
/// | `direct` | `LE`, `LDE` | by connections with lights, and by the rays of gathering that meet a light, weighted by the power heuristic; or from the global map; or like the first, but without rays where shadow photons nearby are of one mind, which sharpens penumbras |
/// | `specular` | `L(S\|D)*SE` | the other three, seen in a mirror or through glass |
/// | `caustic` | `LS+DE` | from the caustic map alone |
/// | `indirect` | `L(S\|D)*DS*DE` | by final gathering: rays that go on through mirrors and glass up to a surface that the global map tells the light of; or from the global map alone |
///
/// Each path belongs to one part alone. A surface that is not there (`null`) counts as `S`. Surfaces that glow send out no
/// photons.
///
/// Estimates are biased: they are means over discs. With `lookup_size` k the disc is that of the k nearest photons, and
/// the k - 1 within it count, up to the greatest radius; with 0 it is always that radius. Photons count only on their own
/// side of their own shape (told by 14 bits of a hash), and near the border of a rectangle or of a cube's face the disc is what lies within it; other
/// shapes look dark within a radius of their border. In Mitsuba 0.6 the numbers of photons are those that are stored;
/// here they are those that are emitted, which powers are divided by.
///
/// Within an image the samples of a pixel share their photons, and so do all pixels: there are no variances.
///
/// Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*, chapters 5 to 9.
#[derive(Clone, Debug)]
pub struct PhotonMapper {
    settings: Settings,
}

impl Described for PhotonMapper {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        name: "photonmapper",
        summary: "Photon mapping in two steps, with a map of its own for caustics.",
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
    /// Emits the photons of one of its maps: those with which it renders a replicate. None if it is the map of caustics and
    /// nothing in the scene casts any.
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
