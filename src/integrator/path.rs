use super::{
    CameraRay, Estimator, IntegratorModel, IntegratorState, Iteration, SampleOutput,
    params::{
        HIDE_EMITTERS, MAX_DEPTH, PATH_CLASSES, RR_DEPTH, TRANSPARENT_SHADOWS, not_physical, read_path_limits,
        read_shadows,
    },
};
use crate::{
    bsdf::BsdfSample,
    film::LayerSpec,
    math::Rgb,
    sampler::PathSampler,
    scene::Scene,
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
    transport::{CameraPath, ClassRadiance, PathClass, PathLimits, SampleCounts, ShadingPoint, Shadows},
};

/// Path tracing with next event estimation and multiple importance sampling by the power heuristic, the same
/// estimator as Mitsuba's `path`. It finds the paths `L(S|D)*E`. Light of delta emitters (points, spots, directions) is
/// missing where the vertex next to the emitter is a mirror or glass.
///
/// `transparent_shadows` is not physical. With it, light reaches a surface straight through glass, weighted by the
/// transmittance at every face. Paths that are refracted by the same glass then omit this light.
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

    fn begin<'s>(&'s self, scene: &'s Scene, _: &Iteration, _: &IntegratorState) -> Box<dyn Estimator + 's> {
        Box::new(PathTracing { integrator: self, scene })
    }
}

#[derive(Debug)]
struct PathTracing<'s> {
    integrator: &'s Path,
    scene: &'s Scene,
}

impl Estimator for PathTracing<'_> {
    fn radiance(&self, camera_ray: &CameraRay, sampler: &mut PathSampler, output: &mut SampleOutput<'_>) -> Rgb {
        let Path { limits, hide_emitters, shadows, shows_classes } = *self.integrator;
        let mut radiance = ClassRadiance::default();
        if limits.max_depth == 0 {
            return radiance.total;
        }
        let mut path = CameraPath::along(self.scene, limits.rr_depth, &camera_ray.ray, hide_emitters);
        let mut past_glass = PastGlass { is_on: shadows == Shadows::Transparent, is_found: false };
        loop {
            // Emission, weighted against emitter sampling.
            let weight = if past_glass.is_found_by_shadow_rays(&path) {
                0.0
            } else {
                path.emission_weight(SampleCounts::ONE_EACH)
            };
            radiance.add(path.class.if_emitter(), path.emission(weight));

            // End the path where it left the scene, or at the maximum depth.
            let Some(point) = path.shading_point() else { break };
            if path.depth >= limits.max_depth {
                break;
            }

            // Emitter sampling.
            let direct = point.sample_direct(self.scene, sampler, SampleCounts::ONE_EACH, shadows);
            radiance.add(path.class.if_direct(), path.throughput * direct);

            // BSDF sampling.
            let Some(sample) = point.sample_bsdf(sampler) else { break };

            // Russian roulette, and the ray to the next point.
            if !path.extend(&point, &sample, sampler) {
                break;
            }
            past_glass.scatter(&point, &sample, &path);
        }
        if shows_classes {
            radiance.write(output.layers);
        }
        radiance.total
    }
}

/// The state of transparent shadows. Shadow rays find emitters straight through glass, so paths that continue through
/// the same glass must omit these emitters.
struct PastGlass {
    is_on: bool,
    /// Whether shadow rays of an earlier point reach emitters in the current direction.
    is_found: bool,
}

impl PastGlass {
    fn scatter(&mut self, point: &ShadingPoint<'_>, sample: &BsdfSample, path: &CameraPath<'_>) {
        if self.is_on {
            let passes = sample.wo.z * point.query.wi.z < 0.0;
            self.is_found = path.is_from_smooth_lobe() || self.is_found && passes;
        }
    }

    /// Whether shadow rays from a point before the glass found the emission at the current point.
    fn is_found_by_shadow_rays(&self, path: &CameraPath<'_>) -> bool {
        self.is_found && !path.is_from_smooth_lobe()
    }
}
