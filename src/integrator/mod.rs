//! Integrators: estimators of the radiance that arrives at the camera.
//!
//! The life cycle of a render: an [`Integrator`] begins an [`Iteration`] of a scene ([`IntegratorModel::begin`]), which
//! gathers what its samples share, such as photon maps. The [`Estimator`] that it yields estimates radiance sample by
//! sample and yields the state of the next iteration.

mod aov;
mod depth;
mod direct;
mod estimator;
mod moment;
mod overrides;
mod params;
mod path;
mod photonmapper;
mod photons;
mod ptracer;
mod sppm;

pub use aov::Aov;
pub use depth::Depth;
pub use direct::Direct;
pub use estimator::{CameraRay, Estimator, IntegratorState, Iteration, IterationPlan, Notes, SampleOutput};
pub use moment::Moment;
pub use overrides::{NO_INTEGRATOR, Overrides};
pub use path::Path;
pub use photonmapper::PhotonMapper;
pub use ptracer::ParticleTracer;
pub use sppm::Sppm;

use enum_dispatch::enum_dispatch;

use crate::{
    film::LayerSpec,
    scene::Scene,
    scene_file::{Category, catalogue},
};

/// What an integrator answers.
#[enum_dispatch]
pub trait IntegratorModel {
    /// Layers beside the beauty.
    fn layers(&self) -> Vec<LayerSpec> {
        Vec::new()
    }

    /// The parameter that makes its image not physical, if there is one.
    fn not_physical(&self) -> Option<&'static str> {
        None
    }

    /// Whether its image is black without light.
    fn needs_light(&self) -> bool {
        true
    }

    /// Makes sure that it can render a scene.
    ///
    /// # Errors
    /// Why it cannot.
    fn check(&self, _scene: &Scene) -> Result<(), String> {
        Ok(())
    }

    /// How often it begins an iteration.
    fn iterations(&self) -> IterationPlan {
        IterationPlan::Independent
    }

    /// The samples per pixel that it asks for, if it does.
    fn samples(&self) -> Option<u32> {
        None
    }

    /// Whether its samples are independent, so that their scatter gives the variance of the image.
    fn has_variance(&self) -> bool {
        self.iterations() == IterationPlan::Independent
    }

    /// Whether it traces paths from emitters, one for each sample of each pixel.
    fn traces_light(&self) -> bool {
        false
    }

    /// Begins an iteration. What it gathers is a function of the scene, the address and the state alone.
    fn begin<'s>(&'s self, scene: &'s Scene, iteration: &Iteration, state: &IntegratorState)
    -> Box<dyn Estimator + 's>;
}

catalogue! {
    /// An integrator.
    pub enum Integrator: IntegratorModel in Category::Integrator, {
        /// Path tracing.
        Path(Path),
        /// Light tracing.
        ParticleTracer(ParticleTracer),
        /// Photon mapping.
        PhotonMapper(PhotonMapper),
        /// Stochastic progressive photon mapping.
        Sppm(Sppm),
        /// Direct illumination only.
        Direct(Direct),
        /// The distance to the first surface.
        Depth(Depth),
        /// Layers of properties of the first surface.
        Aov(Aov),
        /// The second moment beside the mean.
        Moment(Moment),
    }
}
