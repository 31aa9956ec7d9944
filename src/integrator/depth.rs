use super::{CameraRay, Estimator, IntegratorModel, IntegratorState, Iteration, SampleOutput};
use crate::{
    math::Rgb,
    sampler::PathSampler,
    scene::Scene,
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// The distance from the near clipping plane to the first surface along the ray, or 0 without a surface. All three
/// channels are equal.
#[derive(Clone, Debug)]
pub struct Depth;

impl Described for Depth {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        manual: manual!("depth.rs": "Depth"),
        name: "depth",
        summary: "The distance to the first surface, from the near clipping plane.",
        params: &[],
        examples: &[r#"<integrator type="depth"/>"#],
        evidence: &["reference/depth-crop"],
    };

    fn read(_params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self)
    }
}

impl IntegratorModel for Depth {
    fn needs_light(&self) -> bool {
        false
    }

    fn begin<'s>(&'s self, scene: &'s Scene, _: &Iteration, _: &IntegratorState) -> Box<dyn Estimator + 's> {
        Box::new(DepthEstimator { scene })
    }
}

#[derive(Debug)]
struct DepthEstimator<'s> {
    scene: &'s Scene,
}

impl Estimator for DepthEstimator<'_> {
    fn radiance(&self, camera_ray: &CameraRay, _sampler: &mut PathSampler, _output: &mut SampleOutput<'_>) -> Rgb {
        Rgb::splat(self.scene.intersect(&camera_ray.ray).map_or(0.0, |si| si.t))
    }
}
