use std::ops::ControlFlow;

use glam::DVec2;

use super::{EyeRay, HIDE_EMITTERS, IntegratorModel, MAX_DEPTH, RR_DEPTH, first_vertex, read_path_limits};
use crate::{
    bsdf::BsdfModel as _,
    film::splats,
    math::{Ray, Rgb},
    sampler::{PathSampler, SampleStream as _},
    scene::Scene,
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
    sensor::SensorModel as _,
    transport::{LightVertex, PathLimits, shading_normal_correction, walk},
};

/// Light tracing: paths start at the lights, and each of their vertices is connected with the sensor. One such path for
/// each sample of each pixel; it shows `L(S|D)*DE`, and lights themselves, `LE`, by a ray of the pixel's own. What a
/// mirror or glass shows to the sensor stays black, for no connection finds it. Surfaces that glow are seen, and light nothing.
///
/// It is the adjoint of [`Path`](super::Path), and good at what that is bad at: caustics, of points above all.
#[derive(Clone, Debug)]
pub struct ParticleTracer {
    limits: PathLimits,
    hide_emitters: bool,
}

impl Described for ParticleTracer {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        manual: manual!("ptracer.rs": "ParticleTracer"),
        name: "ptracer",
        summary: "Light tracing: paths from the lights, connected with the sensor.",
        params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS],
        examples: &[r#"<integrator type="ptracer"><integer name="max_depth" value="8"/></integrator>"#],
        evidence: &["light-tracing/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { limits: read_path_limits(params)?, hide_emitters: params.boolean(HIDE_EMITTERS.name)? })
    }
}

impl ParticleTracer {
    /// What the sensor sees of light that arrives at a surface, as a position on the film and a value.
    fn connect(
        &self,
        scene: &Scene,
        light_vertex: &LightVertex<'_>,
        sampler: &mut PathSampler,
    ) -> Option<(DVec2, Rgb)> {
        if !light_vertex.bsdf.is_smooth() || self.hide_emitters && scene.is_light(&light_vertex.si) {
            return None;
        }
        let surface = &light_vertex.si.surface;
        let sensor_sample = scene.sensor.camera.sample_direction(surface.p, sampler.next_2d())?;
        // Beside the film there is nothing to see.
        scene.sensor.film.seen_by(sensor_sample.film).next()?;
        let wo = surface.shading.to_local(sensor_sample.direction);
        let mut scattered = light_vertex.bsdf.eval_cos(&light_vertex.query, wo);
        if scattered == Rgb::ZERO || self.is_hidden(scene, &sensor_sample.ray) {
            return None;
        }
        if scene.absorbs() {
            scattered *= scene.transmittance(Some(&light_vertex.si), &sensor_sample.ray, None);
        }
        let adjoint = shading_normal_correction(surface, light_vertex.si.wi_world, sensor_sample.direction);
        Some((sensor_sample.film, light_vertex.flux * scattered * (adjoint * sensor_sample.importance)))
    }

    /// Whether anything stands between a surface and the sensor that the sensor does not see through.
    fn is_hidden(&self, scene: &Scene, ray: &Ray) -> bool {
        if !self.hide_emitters {
            return scene.occluded(ray);
        }
        let mut rest = *ray;
        while let Some(si) = scene.intersect(&rest) {
            if !scene.is_light(&si) {
                return true;
            }
            rest.t_min = si.t + Ray::leaving_distance(si.surface.p) / ray.direction.length();
        }
        false
    }
}

impl IntegratorModel for ParticleTracer {
    fn check(&self, scene: &Scene) -> Result<(), String> {
        scene.check_emission()
    }

    fn traces_light(&self) -> bool {
        true
    }

    fn light_path(&self, scene: &Scene, sampler: &mut PathSampler, path: &mut splats::Path) {
        // The last segment is that to the sensor.
        let limits = PathLimits { max_depth: self.limits.max_depth.saturating_sub(1), ..self.limits };
        if limits.max_depth == 0 {
            return;
        }
        let Some((emission, _)) = scene.emit(sampler) else { return };
        walk(scene, &emission, limits, sampler, |light_vertex, sampler| {
            if let Some((position, value)) = self.connect(scene, light_vertex, sampler) {
                path.splat(&scene.sensor.film, position, value);
            }
            ControlFlow::Continue(())
        });
    }

    fn radiance(&self, scene: &Scene, eye: &EyeRay, _numbers: &mut PathSampler, _layers: &mut [f64]) -> Rgb {
        let ray = &eye.ray;
        if self.limits.max_depth == 0 {
            return Rgb::ZERO;
        }
        let met = first_vertex(scene, ray, self.hide_emitters);
        let Some(si) = met else {
            return if self.hide_emitters { Rgb::ZERO } else { scene.environment(ray.direction) };
        };
        let emitted = if self.hide_emitters { Rgb::ZERO } else { scene.emitted(&si) };
        (emitted + scene.self_emission(&si)) * scene.transmittance(None, ray, Some(&si))
    }
}
