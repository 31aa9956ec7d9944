//! Integrators: estimators of the radiance that arrives at the camera.
//!
//! The life cycle of a render: an [`Integrator`] begins an [`Iteration`] of a scene ([`IntegratorModel::begin`]), which
//! prepares the data that its samples share, such as photon maps. The resulting [`Estimator`] estimates radiance sample
//! by sample. At the end it returns the state of the next iteration.

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

/// The interface of all integrators.
#[enum_dispatch]
pub trait IntegratorModel {
    /// The layers beside the beauty.
    fn layers(&self) -> Vec<LayerSpec> {
        Vec::new()
    }

    /// The parameter that makes the image not physical, if there is one.
    fn not_physical(&self) -> Option<&'static str> {
        None
    }

    /// Whether the image is black without light.
    fn needs_light(&self) -> bool {
        true
    }

    /// Checks that the integrator can render a scene.
    ///
    /// # Errors
    /// The reason why it cannot.
    fn check(&self, _scene: &Scene) -> Result<(), String> {
        Ok(())
    }

    /// How often the integrator begins an iteration.
    fn iterations(&self) -> IterationPlan {
        IterationPlan::Independent
    }

    /// The samples per pixel in the integrator's own parameters; None if it has no such parameter.
    fn samples(&self) -> Option<u32> {
        None
    }

    /// Whether the samples are independent, so that their scatter gives the variance of the image.
    fn has_variance(&self) -> bool {
        self.iterations() == IterationPlan::Independent
    }

    /// Whether the integrator traces a path from an emitter for each sample of each pixel.
    fn traces_light(&self) -> bool {
        false
    }

    /// Begins an iteration. The result depends on the scene, the address and the state alone.
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
