mod estimator;
mod photon_pass;
mod settings;

use std::sync::Arc;

use estimator::ProgressiveEstimator;
use photon_pass::PhotonPass;
use settings::{PARAMS, Schedule, Settings};

use super::{Estimator, IntegratorModel, IntegratorState, Iteration, IterationPlan, photons::check_photons};
use crate::{
    film::LayerSpec,
    scene::Scene,
    scene_file::{Category, Described, Params, Plugin, SceneError},
    transport::PathClass,
};

/// Stochastic progressive photon mapping: each pass emits photons, sees them by one path from the eye for every pixel, and
/// forgets them, and the radius within which they are seen shrinks from pass to pass. So the image converges to the true
/// one, caustics in mirrors included, in memory that depends on the film and the photons of one pass alone. N samples per
/// pixel are N passes.
///
/// A path from the eye goes on through mirrors and glass, and where a surface is glossy, so that it shows what photons
/// from all around would miss; it ends where photons are gathered. Light that comes straight from lights is found by
/// connections (`direct` traced), or like all other light in photons (`map`). Photons count on their own side of their own
/// shape, and near the border of a rectangle or of a cube's face the disc is what lies within it.
///
/// The image is the mean over passes of the density of power around what a pixel sees. This is the flux of Hachisuka and
/// Jensen: they multiply what has been gathered, τ, by R'²/R² when R shrinks to R', so that τ/R² is a sum over passes, each
/// divided by the square of its own radius.
///
/// | `radius_schedule` | the square of the radius after n passes | passes |
/// |---|---|---|
/// | `per_pixel` | shrinks by the photons found: where light is even, it tends to `n^(α-1) / Γ(α)` times the first | build on one another |
/// | `error_driven` | halves where photons tell that the estimate is biased, else it stays; no `alpha` | build on one another |
/// | `per_pass` | `n^(α-1) / Γ(1+α)` times the first | are independent, and can be rendered anywhere in any order |
///
/// The radius of the first pass is `initial_radius`, or as far as two pixels reach where the path from the eye ends.
///
/// Hachisuka and Jensen 2009, "Stochastic Progressive Photon Mapping"; Knaus and Zwicker 2011, "Progressive Photon
/// Mapping: A Probabilistic Approach".
#[derive(Clone, Debug)]
pub struct Sppm {
    settings: Settings,
}

impl Described for Sppm {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        name: "sppm",
        summary: "Stochastic progressive photon mapping: photon maps that converge.",
        params: PARAMS,
        examples: &[
            r#"<integrator type="sppm"><integer name="photon_count" value="100000"/></integrator>"#,
            r#"<integrator type="sppm"><string name="radius_schedule" value="per_pass"/><float name="alpha" value="0.6667"/>
                <float name="initial_radius" value="0.05"/><string name="direct" value="map"/></integrator>"#,
        ],
        evidence: &["progressive/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { settings: Settings::read(params)? })
    }
}

impl IntegratorModel for Sppm {
    fn layers(&self) -> Vec<LayerSpec> {
        let classes = PathClass::ALL.iter().map(|class| LayerSpec::sampled(class.name()));
        if self.settings.shows_classes { classes.collect() } else { Vec::new() }
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        check_photons(scene)
    }

    fn iterations(&self) -> IterationPlan {
        match self.settings.schedule {
            Schedule::PerPixel | Schedule::ErrorDriven => IterationPlan::Chained,
            Schedule::PerPass => IterationPlan::PerSample,
        }
    }

    fn samples(&self) -> Option<u32> {
        self.settings.max_passes
    }

    fn begin<'s>(
        &'s self,
        scene: &'s Scene,
        iteration: &Iteration,
        state: &IntegratorState,
    ) -> Box<dyn Estimator + 's> {
        let radii = match state {
            IntegratorState::Empty => None,
            IntegratorState::PixelRadii(radii) => Some(Arc::clone(radii)),
        };
        let pass = PhotonPass::new(scene, &self.settings, iteration, radii);
        Box::new(ProgressiveEstimator { scene, settings: &self.settings, pass })
    }
}
