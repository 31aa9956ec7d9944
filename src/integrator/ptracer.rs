use std::ops::ControlFlow;

use glam::DVec2;

use super::{EyeRay, HIDE_EMITTERS, MAX_DEPTH, Model, RR_DEPTH, first_vertex, read_depths};
use crate::{
    bsdf::Model as _,
    film::splats,
    math::{Ray, Rgb},
    node::{Category, Described, Params, Plugin, SceneError},
    sampler::{Numbers as _, PathNumbers},
    scene::Scene,
    sensor::Model as _,
    transport::{Arrival, Depths, adjoint_of_shading, walk},
};

/// Light tracing: paths start at the lights, and each of their vertices is connected with the sensor. One such path for
/// each sample of each pixel; it shows `L(S|D)*DE`, and lights themselves, `LE`, by a ray of the pixel's own. What a
/// mirror or glass shows to the sensor stays black, for no connection finds it. Surfaces that glow are seen, and light nothing.
///
/// It is the adjoint of [`Path`](super::Path), and good at what that is bad at: caustics, of points above all.
#[derive(Clone, Debug)]
pub struct ParticleTracer {
    depths: Depths,
    hide_emitters: bool,
}

impl Described for ParticleTracer {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        name: "ptracer",
        summary: "Light tracing: paths from the lights, connected with the sensor.",
        params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS],
        examples: &[r#"<integrator type="ptracer"><integer name="max_depth" value="8"/></integrator>"#],
        evidence: &["light-tracing/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { depths: read_depths(params)?, hide_emitters: params.boolean(HIDE_EMITTERS.name)? })
    }
}

impl ParticleTracer {
    /// What the sensor sees of light that arrives at a surface, as a position on the film and a value.
    fn connect(&self, scene: &Scene, arrival: &Arrival<'_>, numbers: &mut PathNumbers) -> Option<(DVec2, Rgb)> {
        if !arrival.bsdf.is_smooth() || self.hide_emitters && scene.is_light(&arrival.vertex) {
            return None;
        }
        let surface = &arrival.vertex.surface;
        let sight = scene.sensor.camera.see(surface.p, numbers.next_2d())?;
        // Beside the film there is nothing to see.
        scene.sensor.film.seen_by(sight.film).next()?;
        let wo = surface.shading.to_local(sight.direction);
        let mut scattered = arrival.bsdf.eval_cos(&arrival.query, wo);
        if scattered == Rgb::ZERO || self.is_hidden(scene, &sight.ray) {
            return None;
        }
        if scene.absorbs() {
            scattered *= scene.transmittance(Some(&arrival.vertex), &sight.ray, None);
        }
        let adjoint = adjoint_of_shading(surface, arrival.vertex.back, sight.direction);
        Some((sight.film, arrival.flux * scattered * (adjoint * sight.importance)))
    }

    /// Whether anything stands between a surface and the sensor that the sensor does not see through.
    fn is_hidden(&self, scene: &Scene, ray: &Ray) -> bool {
        if !self.hide_emitters {
            return scene.occluded(ray);
        }
        let mut rest = *ray;
        while let Some(vertex) = scene.intersect(&rest) {
            if !scene.is_light(&vertex) {
                return true;
            }
            rest.t_min = vertex.t + Ray::leaving_distance(vertex.surface.p) / ray.direction.length();
        }
        false
    }
}

impl Model for ParticleTracer {
    fn check(&self, scene: &Scene) -> Result<(), String> {
        scene.check_emission()
    }

    fn traces_light(&self) -> bool {
        true
    }

    fn light_path(&self, scene: &Scene, numbers: &mut PathNumbers, path: &mut splats::Path) {
        // The last segment is that to the sensor.
        let depths = Depths { max: self.depths.max.saturating_sub(1), ..self.depths };
        if depths.max == 0 {
            return;
        }
        let Some((emission, _)) = scene.emit(numbers) else { return };
        walk(scene, &emission, depths, numbers, |arrival, numbers| {
            if let Some((position, value)) = self.connect(scene, arrival, numbers) {
                path.splat(&scene.sensor.film, position, value);
            }
            ControlFlow::Continue(())
        });
    }

    fn radiance(&self, scene: &Scene, eye: &EyeRay, _numbers: &mut PathNumbers, _layers: &mut [f64]) -> Rgb {
        let ray = &eye.ray;
        if self.depths.max == 0 {
            return Rgb::ZERO;
        }
        let met = first_vertex(scene, ray, self.hide_emitters);
        let Some(vertex) = met else {
            return if self.hide_emitters { Rgb::ZERO } else { scene.sky(ray.direction) };
        };
        let emitted = if self.hide_emitters { Rgb::ZERO } else { scene.emitted(&vertex) };
        (emitted + scene.glow(&vertex)) * scene.transmittance(None, ray, Some(&vertex))
    }
}
