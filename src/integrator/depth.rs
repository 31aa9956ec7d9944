use super::{EyeRay, IntegratorModel};
use crate::{
    math::Rgb,
    sampler::PathSampler,
    scene::Scene,
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// The distance from the near clipping plane to the first surface along the ray, 0 where there is none; the same in
/// all three channels.
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

    fn radiance(&self, scene: &Scene, eye: &EyeRay, _numbers: &mut PathSampler, _layers: &mut [f64]) -> Rgb {
        Rgb::splat(scene.intersect(&eye.ray).map_or(0.0, |si| si.t))
    }
}
