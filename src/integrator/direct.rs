use super::{EyeRay, HIDE_EMITTERS, IntegratorModel, TRANSPARENT_SHADOWS, first_vertex, not_physical, read_shadows};
use crate::{
    bsdf::{BsdfModel as _, Lobe},
    math::{PerSolidAngle, Ray, Rgb},
    sampler::{PathSampler, SampleStream as _},
    scene::Scene,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    transport::{ShadingPoint, Shadows, power_heuristic},
};

/// Light that is emitted towards the camera or scattered once, with so many samples of lights and of the BSDF,
/// combined by the power heuristic.
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
        summary: "Light that is scattered at most once.",
        params: &[
            Param::new("shading_samples", ParamKind::Integer, "1", "samples of lights, and as many of the bsdf")
                .within(COUNT),
            Param::optional("emitter_samples", ParamKind::Integer, "shading_samples", "samples of lights")
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
            let error = params.error("shading_samples", "\"shading_samples\" stands beside a number that it sets");
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
            let error = params.error(TRANSPARENT_SHADOWS.name, "transparent shadows need samples of lights");
            return Err(error.hint("set emitter_samples to 1 or more"));
        }
        Ok(Self { emitter_samples, bsdf_samples, hide_emitters: params.boolean(HIDE_EMITTERS.name)?, shadows })
    }
}

impl IntegratorModel for Direct {
    fn not_physical(&self) -> Option<&'static str> {
        not_physical(self.shadows)
    }

    fn radiance(&self, scene: &Scene, eye: &EyeRay, sampler: &mut PathSampler, _layers: &mut [f64]) -> Rgb {
        let ray = &eye.ray;
        let Some(si) = first_vertex(scene, ray, self.hide_emitters) else {
            return if self.hide_emitters { Rgb::ZERO } else { scene.environment(ray.direction) };
        };
        let mut radiance = scene.self_emission(&si) + if self.hide_emitters { Rgb::ZERO } else { scene.emitted(&si) };
        let sample_counts = [f64::from(self.emitter_samples), f64::from(self.bsdf_samples)];
        let shading_point = ShadingPoint::new(scene, si);
        for _ in 0..self.emitter_samples {
            radiance += shading_point.sample_direct(scene, sampler, sample_counts, self.shadows) / sample_counts[0];
        }
        for _ in 0..self.bsdf_samples {
            radiance += by_bsdf(scene, &shading_point, sampler, sample_counts) / sample_counts[1];
        }
        radiance * scene.transmittance(None, ray, Some(&si))
    }
}

/// The light in a direction that the BSDF draws.
fn by_bsdf(scene: &Scene, shading_point: &ShadingPoint<'_>, sampler: &mut PathSampler, sample_counts: [f64; 2]) -> Rgb {
    let Some(sample) = shading_point.bsdf.sample(&shading_point.query, sampler.next_1d(), sampler.next_2d()) else {
        return Rgb::ZERO;
    };
    let direction = shading_point.si.surface.shading.to_world(sample.wo);
    let ray = Ray::leaving(shading_point.p(), direction);
    let met = scene.intersect(&ray);
    let light = met.map_or_else(|| scene.environment(direction), |si| scene.emitted(&si));
    let self_emission = met.map_or(Rgb::ZERO, |si| scene.self_emission(&si));
    let weight = match sample.lobe {
        Lobe::Smooth => {
            let by_light = scene.pdf_emitter_direction(shading_point.p(), met.as_ref());
            power_heuristic(
                PerSolidAngle(sample_counts[1] * sample.pdf.0),
                PerSolidAngle(sample_counts[0] * by_light.0),
            )
        }
        Lobe::Delta | Lobe::Null => 1.0,
    };
    sample.weight * (weight * light + self_emission) * scene.transmittance(Some(&shading_point.si), &ray, met.as_ref())
}
