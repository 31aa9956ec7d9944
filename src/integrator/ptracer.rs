use std::ops::ControlFlow;

use glam::DVec2;

use super::{
    CameraRay, Estimator, IntegratorModel, IntegratorState, Iteration, SampleOutput,
    params::{HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH, read_path_limits},
};
use crate::{
    bsdf::BsdfModel as _,
    film::splats,
    math::{Ray, Rgb},
    sampler::{PathSampler, SampleStream as _},
    scene::Scene,
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
    sensor::SensorModel as _,
    transport::{CameraPath, LightVertex, PathLimits, shading_normal_correction, trace_light_path},
};

/// Light tracing: paths start at the emitters, and each of their vertices is connected with the camera. Each sample of
/// each pixel traces one such path, which contributes `L(S|D)*DE`. The camera ray of the pixel contributes visible
/// emitters, `LE`. Mirrors and glass look black, because a connection cannot hit a delta lobe. Self-emission of
/// materials is visible, but does not illuminate other surfaces.
///
/// Light tracing is the adjoint of [`Path`](super::Path). It is efficient for caustics, above all from point lights,
/// where path tracing is not.
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
        summary: "Light tracing: paths from the emitters, connected with the camera.",
        params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS],
        examples: &[r#"<integrator type="ptracer"><integer name="max_depth" value="8"/></integrator>"#],
        evidence: &["light-tracing/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { limits: read_path_limits(params)?, hide_emitters: params.boolean(HIDE_EMITTERS.name)? })
    }
}

impl IntegratorModel for ParticleTracer {
    fn check(&self, scene: &Scene) -> Result<(), String> {
        scene.check_emission()
    }

    fn traces_light(&self) -> bool {
        true
    }

    fn begin<'s>(&'s self, scene: &'s Scene, _: &Iteration, _: &IntegratorState) -> Box<dyn Estimator + 's> {
        Box::new(LightTracing { integrator: self, scene })
    }
}

#[derive(Debug)]
struct LightTracing<'s> {
    integrator: &'s ParticleTracer,
    scene: &'s Scene,
}

impl Estimator for LightTracing<'_> {
    /// Returns the emission that the camera sees; light paths contribute everything else.
    fn radiance(&self, camera_ray: &CameraRay, _sampler: &mut PathSampler, _output: &mut SampleOutput<'_>) -> Rgb {
        let ParticleTracer { limits, hide_emitters } = *self.integrator;
        if limits.max_depth == 0 {
            return Rgb::ZERO;
        }
        CameraPath::along(self.scene, limits.rr_depth, &camera_ray.ray, hide_emitters).emission(1.0)
    }

    fn light_path(&self, sampler: &mut PathSampler, path: &mut splats::Path) {
        // The connection to the camera adds the last segment.
        let limits = self.integrator.limits.without_last();
        if limits.max_depth == 0 {
            return;
        }
        // Emission.
        let Some((emission, _)) = self.scene.emit(sampler) else { return };
        trace_light_path(self.scene, &emission, limits, sampler, |vertex, sampler| {
            // Sensor sampling.
            if let Some((position, value)) = self.sample_sensor(vertex, sampler) {
                path.splat(&self.scene.sensor.film, position, value);
            }
            ControlFlow::Continue(())
        });
    }
}

impl LightTracing<'_> {
    /// Connects a vertex with the camera. Returns a position on the film and its value.
    fn sample_sensor(&self, vertex: &LightVertex<'_>, sampler: &mut PathSampler) -> Option<(DVec2, Rgb)> {
        let (scene, point) = (self.scene, &vertex.point);
        if !point.bsdf.is_smooth() || self.integrator.hide_emitters && scene.is_emitter(&point.si) {
            return None;
        }
        let surface = &point.si.surface;
        let sensor_sample = scene.sensor.camera.sample_direction(surface.p, sampler.next_2d())?;
        // A position outside the film contributes to no pixel.
        scene.sensor.film.pixels_covering(sensor_sample.film).next()?;
        let wo = surface.shading.to_local(sensor_sample.direction);
        let mut scattered = point.bsdf.eval_cos(&point.query, wo);
        if scattered == Rgb::ZERO || self.is_hidden(&sensor_sample.ray) {
            return None;
        }
        if scene.absorbs() {
            scattered *= scene.transmittance(Some(&point.si), &sensor_sample.ray, None);
        }
        let correction = shading_normal_correction(surface, point.si.wi_world, sensor_sample.direction);
        Some((sensor_sample.film, vertex.flux * scattered * (correction * sensor_sample.importance)))
    }

    /// Whether a surface blocks a ray to the camera; hidden emitters do not.
    fn is_hidden(&self, ray: &Ray) -> bool {
        if !self.integrator.hide_emitters {
            return self.scene.occluded(ray);
        }
        let mut rest = *ray;
        while let Some(si) = self.scene.intersect(&rest) {
            if !self.scene.is_emitter(&si) {
                return true;
            }
            rest.t_min = si.t + Ray::leaving_distance(si.surface.p) / ray.direction.length();
        }
        false
    }
}
