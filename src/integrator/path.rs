use super::{
    EyeRay, HIDE_EMITTERS, MAX_DEPTH, Model, PATH_CLASSES, RR_DEPTH, TRANSPARENT_SHADOWS, first_vertex, not_physical,
    read_depths, read_shadows,
};
use crate::{
    bsdf::{Lobe, Model as _},
    film::LayerSpec,
    math::{PerSolidAngle, Ray, Rgb},
    node::{Category, Described, Params, Plugin, SceneError},
    sampler::{Numbers as _, PathNumbers},
    scene::{Scene, Vertex},
    transport::{Depths, FromEye, Junction, PathClass, Shadows, power_heuristic, survival},
};

/// Path tracing with next event estimation and multiple importance sampling by the power heuristic, the same
/// estimator as Mitsuba's `path`. Paths `L(S|D)*E`, but light from a point or a direction only where the vertex next
/// to it is not a mirror or glass.
///
/// With `transparent_shadows`, which is not physical, light reaches a surface straight through glass, weighted by the
/// transmittance at every face; what paths find through the same glass on their bent ways is left out instead.
#[derive(Clone, Debug)]
pub struct Path {
    depths: Depths,
    hide_emitters: bool,
    shadows: Shadows,
    shows_classes: bool,
}

impl Described for Path {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        name: "path",
        summary: "Path tracing with next event estimation and multiple importance sampling.",
        params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS, TRANSPARENT_SHADOWS, PATH_CLASSES],
        examples: &[r#"<integrator type="path"><integer name="max_depth" value="8"/></integrator>"#],
        evidence: &["radiometry/*", "fresnel/slab", "fresnel/etendue", "transport/*", "reference/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self {
            depths: read_depths(params)?,
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
    drawn: Option<(&'j Junction<'j>, PerSolidAngle)>,
}

impl Segment<'_> {
    fn weight(&self, scene: &Scene, met: Option<&Vertex>) -> f64 {
        let Some((junction, density)) = self.drawn else { return 1.0 };
        power_heuristic(density, scene.light_density(junction.p(), met))
    }
}

impl Model for Path {
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

    fn radiance(&self, scene: &Scene, eye: &EyeRay, numbers: &mut PathNumbers, layers: &mut [f64]) -> Rgb {
        let ray = &eye.ray;
        if self.depths.max == 0 {
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
        let mut state = FromEye::START;
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
            let Some(vertex) = met else {
                add(state.at_light(), emission_weight * throughput * scene.sky(direction));
                break;
            };
            add(state.at_light(), emission_weight * throughput * scene.emitted(&vertex));
            if scene.glows() {
                add(state.at_light(), throughput * scene.glow(&vertex));
            }
            if depth >= self.depths.max {
                break;
            }

            // Light that is sought.
            let junction = Junction::new(scene, vertex);
            add(state.lit(), throughput * junction.connect(scene, numbers, [1.0, 1.0], self.shadows));

            // Go on.
            let Some(sample) = junction.bsdf.sample(&junction.query, numbers.next_1d(), numbers.next_2d()) else {
                break;
            };
            state = state.scattered(sample.lobe);
            throughput *= sample.weight;
            eta *= sample.eta;
            if throughput == Rgb::ZERO {
                break;
            }
            if depth >= self.depths.roulette {
                let survival = survival(throughput, eta);
                if numbers.next_1d() >= survival {
                    break;
                }
                throughput /= survival;
            }
            direction = vertex.surface.shading.to_world(sample.wo);
            let next = Ray::leaving(junction.p(), direction);
            met = scene.intersect(&next);
            if scene.absorbs() {
                throughput *= scene.transmittance(Some(&vertex), &next, met.as_ref());
            }
            let drawn = (sample.lobe == Lobe::Smooth).then_some((&junction, sample.density));
            emission_weight = Segment { drawn }.weight(scene, met.as_ref());
            if self.shadows == Shadows::Transparent {
                let passes = sample.wo.z * junction.query.wi.z < 0.0;
                is_sought = drawn.is_some() || is_sought && passes;
                if is_sought && drawn.is_none() {
                    emission_weight = 0.0;
                }
            }
        }
        radiance
    }
}
