use super::{
    EyeRay, HIDE_EMITTERS, IntegratorModel, MAX_DEPTH, PATH_CLASSES, RR_DEPTH, TRANSPARENT_SHADOWS, first_vertex,
    not_physical, read_path_limits, read_shadows,
};
use crate::{
    bsdf::{BsdfModel as _, Lobe},
    film::LayerSpec,
    math::{PerSolidAngle, Ray, Rgb},
    sampler::{PathSampler, SampleStream as _},
    scene::{Scene, SurfaceInteraction},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
    transport::{CameraPathClass, PathClass, PathLimits, ShadingPoint, Shadows, power_heuristic, survival},
};

/// Path tracing with next event estimation and multiple importance sampling by the power heuristic, the same
/// estimator as Mitsuba's `path`. Paths `L(S|D)*E`, but light from a point or a direction only where the vertex next
/// to it is not a mirror or glass.
///
/// With `transparent_shadows`, which is not physical, light reaches a surface straight through glass, weighted by the
/// transmittance at every face; what paths find through the same glass on their bent ways is left out instead.
#[derive(Clone, Debug)]
pub struct Path {
    limits: PathLimits,
    hide_emitters: bool,
    shadows: Shadows,
    shows_classes: bool,
}

impl Described for Path {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        manual: manual!("path.rs": "Path"),
        name: "path",
        summary: "Path tracing with next event estimation and multiple importance sampling.",
        params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS, TRANSPARENT_SHADOWS, PATH_CLASSES],
        examples: &[r#"<integrator type="path"><integer name="max_depth" value="8"/></integrator>"#],
        evidence: &["radiometry/*", "fresnel/slab", "fresnel/etendue", "transport/*", "reference/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self {
            limits: read_path_limits(params)?,
            hide_emitters: params.boolean(HIDE_EMITTERS.name)?,
            shadows: read_shadows(params)?,
            shows_classes: params.boolean(PATH_CLASSES.name)?,
        })
    }
}

/// How the last segment of a path was found, for the weight of what it meets.
struct Segment<'j> {
    /// Where it starts and the density of its direction; None if it starts at the camera or at a delta lobe, which no
    /// connection to a light could have replaced.
    drawn: Option<(&'j ShadingPoint<'j>, PerSolidAngle)>,
}

impl Segment<'_> {
    fn weight(&self, scene: &Scene, met: Option<&SurfaceInteraction>) -> f64 {
        let Some((shading_point, pdf)) = self.drawn else { return 1.0 };
        power_heuristic(pdf, scene.pdf_emitter_direction(shading_point.p(), met))
    }
}

impl IntegratorModel for Path {
    fn not_physical(&self) -> Option<&'static str> {
        not_physical(self.shadows)
    }

    fn layers(&self) -> Vec<LayerSpec> {
        if self.shows_classes {
            PathClass::ALL.iter().map(|class| LayerSpec::sampled(class.name())).collect()
        } else {
            Vec::new()
        }
    }

    fn radiance(&self, scene: &Scene, eye: &EyeRay, sampler: &mut PathSampler, layers: &mut [f64]) -> Rgb {
        let ray = &eye.ray;
        if self.limits.max_depth == 0 {
            return Rgb::ZERO;
        }
        let mut radiance = Rgb::ZERO;
        let mut add = |class: PathClass, light: Rgb| {
            radiance += light;
            if self.shows_classes {
                let layer = &mut layers[3 * class as usize..][..3];
                layer.iter_mut().zip(light.to_array()).for_each(|(sum, light)| *sum += light);
            }
        };
        let mut state = CameraPathClass::START;
        let mut throughput = Rgb::ONE;
        let mut eta = 1.0;
        let mut met = first_vertex(scene, ray, self.hide_emitters);
        if scene.absorbs() {
            throughput *= scene.transmittance(None, ray, met.as_ref());
        }
        let mut direction = ray.direction;
        let mut emission_weight = if self.hide_emitters { 0.0 } else { 1.0 };
        // Whether a connection has looked for the light in this direction past all glass.
        let mut is_sought = false;
        for depth in 1.. {
            // Light that is met by chance.
            let Some(si) = met else {
                add(state.if_emitter(), emission_weight * throughput * scene.environment(direction));
                break;
            };
            add(state.if_emitter(), emission_weight * throughput * scene.emitted(&si));
            if scene.has_self_emission() {
                add(state.if_emitter(), throughput * scene.self_emission(&si));
            }
            if depth >= self.limits.max_depth {
                break;
            }

            // Light that is sought.
            let shading_point = ShadingPoint::new(scene, si);
            add(state.if_direct(), throughput * shading_point.sample_direct(scene, sampler, [1.0, 1.0], self.shadows));

            // Go on.
            let Some(sample) = shading_point.bsdf.sample(&shading_point.query, sampler.next_1d(), sampler.next_2d())
            else {
                break;
            };
            state = state.scattered(sample.lobe);
            throughput *= sample.weight;
            eta *= sample.eta;
            if throughput == Rgb::ZERO {
                break;
            }
            if depth >= self.limits.rr_depth {
                let survival = survival(throughput, eta);
                if sampler.next_1d() >= survival {
                    break;
                }
                throughput /= survival;
            }
            direction = si.surface.shading.to_world(sample.wo);
            let next = Ray::leaving(shading_point.p(), direction);
            met = scene.intersect(&next);
            if scene.absorbs() {
                throughput *= scene.transmittance(Some(&si), &next, met.as_ref());
            }
            let drawn = (sample.lobe == Lobe::Smooth).then_some((&shading_point, sample.pdf));
            emission_weight = Segment { drawn }.weight(scene, met.as_ref());
            if self.shadows == Shadows::Transparent {
                let passes = sample.wo.z * shading_point.query.wi.z < 0.0;
                is_sought = drawn.is_some() || is_sought && passes;
                if is_sought && drawn.is_none() {
                    emission_weight = 0.0;
                }
            }
        }
        radiance
    }
}
