use super::{EyeRay, HIDE_EMITTERS, Model, TRANSPARENT_SHADOWS, first_vertex, not_physical, read_shadows};
use crate::{
    bsdf::{Lobe, Model as _},
    math::{PerSolidAngle, Ray, Rgb},
    node::{Category, Described, Kind, Param, Params, Plugin, Range, SceneError},
    sampler::{Numbers as _, PathNumbers},
    scene::Scene,
    transport::{Junction, Shadows, power_heuristic},
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
        name: "direct",
        summary: "Light that is scattered at most once.",
        params: &[
            Param::new("shading_samples", Kind::Integer, "1", "samples of lights, and as many of the bsdf")
                .within(COUNT),
            Param::optional("emitter_samples", Kind::Integer, "shading_samples", "samples of lights").within(COUNT),
            Param::optional("bsdf_samples", Kind::Integer, "shading_samples", "samples of the bsdf").within(COUNT),
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

impl Model for Direct {
    fn not_physical(&self) -> Option<&'static str> {
        not_physical(self.shadows)
    }

    fn radiance(&self, scene: &Scene, eye: &EyeRay, numbers: &mut PathNumbers, _layers: &mut [f64]) -> Rgb {
        let ray = &eye.ray;
        let Some(vertex) = first_vertex(scene, ray, self.hide_emitters) else {
            return if self.hide_emitters { Rgb::ZERO } else { scene.sky(ray.direction) };
        };
        let mut radiance = scene.glow(&vertex) + if self.hide_emitters { Rgb::ZERO } else { scene.emitted(&vertex) };
        let shares = [f64::from(self.emitter_samples), f64::from(self.bsdf_samples)];
        let junction = Junction::new(scene, vertex);
        for _ in 0..self.emitter_samples {
            radiance += junction.connect(scene, numbers, shares, self.shadows) / shares[0];
        }
        for _ in 0..self.bsdf_samples {
            radiance += by_bsdf(scene, &junction, numbers, shares) / shares[1];
        }
        radiance * scene.transmittance(None, ray, Some(&vertex))
    }
}

/// The light in a direction that the BSDF draws.
fn by_bsdf(scene: &Scene, junction: &Junction<'_>, numbers: &mut PathNumbers, shares: [f64; 2]) -> Rgb {
    let Some(sample) = junction.bsdf.sample(&junction.query, numbers.next_1d(), numbers.next_2d()) else {
        return Rgb::ZERO;
    };
    let direction = junction.vertex.surface.shading.to_world(sample.wo);
    let ray = Ray::leaving(junction.p(), direction);
    let met = scene.intersect(&ray);
    let light = met.map_or_else(|| scene.sky(direction), |vertex| scene.emitted(&vertex));
    let glow = met.map_or(Rgb::ZERO, |vertex| scene.glow(&vertex));
    let weight = match sample.lobe {
        Lobe::Smooth => {
            let by_light = scene.light_density(junction.p(), met.as_ref());
            power_heuristic(PerSolidAngle(shares[1] * sample.density.0), PerSolidAngle(shares[0] * by_light.0))
        }
        Lobe::Delta | Lobe::Null => 1.0,
    };
    sample.weight * (weight * light + glow) * scene.transmittance(Some(&junction.vertex), &ray, met.as_ref())
}
