use super::{
    CameraRay, Estimator, IntegratorModel, IntegratorState, Iteration, SampleOutput,
    params::{HIDE_EMITTERS, TRANSPARENT_SHADOWS, not_physical, read_shadows},
};
use crate::{
    math::Rgb,
    sampler::PathSampler,
    scene::Scene,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    transport::{CameraPath, SampleCounts, Shadows},
};

/// Direct illumination: light that reaches the camera from an emitter, or after one scattering. Emitter sampling and
/// BSDF sampling are combined by the power heuristic.
#[derive(Clone, Debug)]
pub struct Direct {
    emitter_samples: u32,
    bsdf_samples: u32,
    hide_emitters: bool,
    shadows: Shadows,
}

const COUNT: Range = Range { min: 0.0, max: 1e6, open: false };

impl Described for Direct {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        manual: manual!("direct.rs": "Direct"),
        name: "direct",
        summary: "Direct illumination: light that is scattered at most once.",
        params: &[
            Param::new("shading_samples", ParamKind::Integer, "1", "samples of emitters, and as many of the bsdf")
                .within(COUNT),
            Param::optional("emitter_samples", ParamKind::Integer, "shading_samples", "samples of emitters")
                .within(COUNT),
            Param::optional("bsdf_samples", ParamKind::Integer, "shading_samples", "samples of the bsdf").within(COUNT),
            HIDE_EMITTERS,
            TRANSPARENT_SHADOWS,
        ],
        examples: &[r#"<integrator type="direct"><integer name="emitter_samples" value="2"/></integrator>"#],
        evidence: &["radiometry/direct-strategies", "reference/sun-and-bulb"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let is_given = |name| params.find(name).is_some();
        if is_given("shading_samples") && (is_given("emitter_samples") || is_given("bsdf_samples")) {
            let error = params.error("shading_samples", "\"shading_samples\" is given beside a number that it sets");
            return Err(error.hint("give it alone, or emitter_samples and bsdf_samples"));
        }
        let shared = params.integer("shading_samples")?;
        let count =
            |name| Ok(if params.find(name).is_some() { params.integer(name)? } else { shared }.unsigned_abs() as u32);
        let (emitter_samples, bsdf_samples) = (count("emitter_samples")?, count("bsdf_samples")?);
        if emitter_samples + bsdf_samples == 0 {
            return Err(SceneError::at(&params.object().place, "the integrator has no samples at all"));
        }
        let shadows = read_shadows(params)?;
        if shadows == Shadows::Transparent && emitter_samples == 0 {
            let error = params.error(TRANSPARENT_SHADOWS.name, "transparent shadows need emitter samples");
            return Err(error.hint("set emitter_samples to 1 or more"));
        }
        Ok(Self { emitter_samples, bsdf_samples, hide_emitters: params.boolean(HIDE_EMITTERS.name)?, shadows })
    }
}

impl IntegratorModel for Direct {
    fn not_physical(&self) -> Option<&'static str> {
        not_physical(self.shadows)
    }

    fn begin<'s>(&'s self, scene: &'s Scene, _: &Iteration, _: &IntegratorState) -> Box<dyn Estimator + 's> {
        Box::new(DirectIllumination { integrator: self, scene })
    }
}

#[derive(Debug)]
struct DirectIllumination<'s> {
    integrator: &'s Direct,
    scene: &'s Scene,
}

impl Estimator for DirectIllumination<'_> {
    fn radiance(&self, camera_ray: &CameraRay, sampler: &mut PathSampler, _output: &mut SampleOutput<'_>) -> Rgb {
        let Direct { emitter_samples, bsdf_samples, hide_emitters, shadows } = *self.integrator;
        let path = CameraPath::along(self.scene, u32::MAX, &camera_ray.ray, hide_emitters);
        let mut radiance = path.emission(1.0);
        let Some(point) = path.shading_point() else { return radiance };
        let counts = SampleCounts { emitter: f64::from(emitter_samples), bsdf: f64::from(bsdf_samples) };

        // Emitter sampling.
        for _ in 0..emitter_samples {
            let direct = point.sample_direct(self.scene, sampler, counts, shadows);
            radiance += path.throughput * direct / counts.emitter;
        }

        // BSDF sampling.
        for _ in 0..bsdf_samples {
            let Some(sample) = point.sample_bsdf(sampler) else { continue };
            let Some(next) = path.branch(&point, &sample) else { continue };
            let emission = next.emission(next.emission_weight(counts));
            radiance += path.throughput * emission / counts.bsdf;
        }
        radiance
    }
}
