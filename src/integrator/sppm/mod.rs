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
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
    transport::PathClass,
};

/// Stochastic progressive photon mapping. Each pass emits photons, gathers them once from every pixel, and discards
/// them. The gather radius shrinks from pass to pass, so the image converges to the true one, caustics in mirrors
/// included. The memory depends only on the film and the photons of one pass. N samples per pixel are N passes.
///
/// A camera path continues through mirrors and glass, and from glossy surfaces, whose narrow lobes few photons reach.
/// It ends where photons are gathered. Direct light is found by emitter sampling (`direct` traced) or from photons like
/// all other light (`map`). Photons count only on their own side of their own shape. Near the border of a rectangle or
/// of a cube's face the disc is cut at the border.
///
/// The image is the mean over passes of the density of power around the gather points. This is equal to the estimate of
/// Hachisuka and Jensen. They multiply the gathered flux τ by R'²/R² when the radius R shrinks to R', so τ/R² is a sum
/// over passes, each divided by the square of its own radius.
///
/// | `radius_schedule` | the squared radius after n passes | passes |
/// |---|---|---|
/// | `per_pixel` | shrinks with the photons found; in even light it tends to `n^(α-1) / Γ(α)` times the first | depend on each other |
/// | `error_driven` | halves where the photons indicate a biased estimate, else stays; ignores `alpha` | depend on each other |
/// | `per_pass` | `n^(α-1) / Γ(1+α)` times the first | are independent, and can be rendered anywhere in any order |
///
/// The radius of the first pass is `initial_radius`, or two pixel footprints at the end of the camera path.
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
        manual: manual!("mod.rs": "Sppm"),
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
