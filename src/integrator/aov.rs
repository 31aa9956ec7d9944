use super::{
    CameraRay, Estimator, Integrator, IntegratorModel, IntegratorState, Iteration, IterationPlan, Notes, SampleOutput,
};
use crate::{
    bsdf::BsdfModel as _,
    film::{LayerSource, LayerSpec, splats},
    math::{Ray, Rgb},
    photon::radius::PassCounts,
    sampler::PathSampler,
    scene::{Scene, SurfaceInteraction},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// Layers with properties of the first surface, beside the image of a nested integrator if there is one. Each layer is
/// the mean over the pixel's samples; a sample without a surface counts as 0. `wireframe` is 1 within half a pixel of
/// an edge of a mesh triangle, so that edges between triangles are lines one pixel wide. It is 0 elsewhere, and on
/// operands of a csg.
#[derive(Clone, Debug)]
pub struct Aov {
    layers: Vec<(String, Quantity)>,
    child: Option<Box<Integrator>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    Depth,
    Position,
    Uv,
    GeoNormal,
    ShNormal,
    Albedo,
    PrimIndex,
    ShapeIndex,
    Wireframe,
    SampleCount,
}

/// All quantities: the word in `aovs`, the quantity, and its channels.
const QUANTITIES: [(&str, Quantity, &[&str]); 10] = [
    ("depth", Quantity::Depth, &["T"]),
    ("position", Quantity::Position, &["X", "Y", "Z"]),
    ("uv", Quantity::Uv, &["U", "V"]),
    ("geo_normal", Quantity::GeoNormal, &["X", "Y", "Z"]),
    ("sh_normal", Quantity::ShNormal, &["X", "Y", "Z"]),
    ("albedo", Quantity::Albedo, &["R", "G", "B"]),
    ("prim_index", Quantity::PrimIndex, &["I"]),
    ("shape_index", Quantity::ShapeIndex, &["I"]),
    ("wireframe", Quantity::Wireframe, &["Y"]),
    ("sample_count", Quantity::SampleCount, &["N"]),
];

impl Quantity {
    fn channels(self) -> &'static [&'static str] {
        QUANTITIES.iter().find(|(_, quantity, _)| *quantity == self).expect("every quantity is in the list").2
    }

    fn write(self, scene: &Scene, si: &SurfaceInteraction, out: &mut [f64]) {
        let surface = &si.surface;
        match self {
            Self::Depth => out[0] = si.t,
            Self::Position => surface.p.write_to_slice(out),
            Self::Uv => surface.uv.write_to_slice(out),
            Self::GeoNormal => surface.n.write_to_slice(out),
            Self::ShNormal => surface.shading.n.write_to_slice(out),
            Self::Albedo => scene.bsdf(si).albedo(surface.uv).write_to_slice(out),
            Self::PrimIndex => out[0] = f64::from(surface.primitive),
            Self::ShapeIndex => out[0] = si.shape_index as f64,
            Self::Wireframe => out[0] = f64::from(scene.is_on_edge(si)),
            Self::SampleCount => {}
        }
    }
}

impl Described for Aov {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        manual: manual!("aov.rs": "Aov"),
        name: "aov",
        summary: "Layers with properties of the first surface, beside another integrator's image.",
        params: &[
            Param::required(
                "aovs",
                ParamKind::String,
                "layers as name:quantity, separated by commas; quantities: depth, position, uv, geo_normal, sh_normal, \
                 albedo, prim_index, shape_index, wireframe, sample_count",
            ),
            Param::optional(
                "integrator",
                ParamKind::Object(Category::Integrator),
                "a black image",
                "the integrator that renders",
            ),
        ],
        examples: &[
            r#"<integrator type="aov"><string name="aovs" value="dd:depth,nn:sh_normal,edges:wireframe"/><integrator type="path"/></integrator>"#,
        ],
        evidence: &["reference/aov-still-life", "film/aov"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let layers: Vec<_> =
            params.string("aovs")?.split(',').map(|item| layer(params, item.trim())).collect::<Result<_, _>>()?;
        let child =
            params.child(Category::Integrator)?.map(|id| Integrator::read(params.document(), id)).transpose()?;
        let taken = child.iter().flat_map(Integrator::layers).map(|layer| layer.name);
        check_names(params, &layers, taken.chain(["variance".to_owned()]).collect())?;
        Ok(Self { layers, child: child.map(Box::new) })
    }
}

fn layer(params: &Params<'_>, item: &str) -> Result<(String, Quantity), SceneError> {
    let found = item.split_once(':').and_then(|(name, word)| {
        let known = QUANTITIES.iter().find(|(known, ..)| *known == word.trim())?;
        (!name.is_empty()).then(|| (name.trim().to_owned(), known.1))
    });
    found.ok_or_else(|| {
        let words: Vec<_> = QUANTITIES.iter().map(|(word, ..)| *word).collect();
        let error = params.error("aovs", format!("\"{item}\" is not a layer"));
        error.hint(format!("write name:quantity, with one of {}", words.join(", ")))
    })
}

/// Checks that all layers of the image have different names.
fn check_names(params: &Params<'_>, layers: &[(String, Quantity)], mut taken: Vec<String>) -> Result<(), SceneError> {
    for (name, _) in layers {
        if taken.contains(name) {
            return Err(params
                .error("aovs", format!("another layer is also called \"{name}\""))
                .hint("name each differently"));
        }
        taken.push(name.clone());
    }
    Ok(())
}

/// Every method is written out, so that a new method cannot fall back to its default.
#[deny(clippy::missing_trait_methods)]
impl IntegratorModel for Aov {
    fn not_physical(&self) -> Option<&'static str> {
        self.child.as_ref().and_then(|child| child.not_physical())
    }

    fn needs_light(&self) -> bool {
        self.child.as_ref().is_some_and(|child| child.needs_light())
    }

    fn layers(&self) -> Vec<LayerSpec> {
        let own = self.layers.iter().map(|(name, quantity)| LayerSpec {
            name: name.clone(),
            channels: quantity.channels().iter().map(|channel| (*channel).to_owned()).collect(),
            source: if *quantity == Quantity::SampleCount { LayerSource::Count } else { LayerSource::Sampled },
        });
        own.chain(self.child.iter().flat_map(|child| child.layers())).collect()
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        self.child.as_ref().map_or(Ok(()), |child| child.check(scene))
    }

    fn iterations(&self) -> IterationPlan {
        self.child.as_ref().map_or(IterationPlan::Independent, |child| child.iterations())
    }

    fn samples(&self) -> Option<u32> {
        self.child.as_ref().and_then(|child| child.samples())
    }

    fn has_variance(&self) -> bool {
        self.child.as_ref().is_none_or(|child| child.has_variance())
    }

    fn traces_light(&self) -> bool {
        self.child.as_ref().is_some_and(|child| child.traces_light())
    }

    fn begin<'s>(
        &'s self,
        scene: &'s Scene,
        iteration: &Iteration,
        state: &IntegratorState,
    ) -> Box<dyn Estimator + 's> {
        let child = self.child.as_ref().map(|child| child.begin(scene, iteration, state));
        Box::new(AovEstimator { layers: &self.layers, scene, child })
    }
}

#[derive(Debug)]
struct AovEstimator<'s> {
    layers: &'s [(String, Quantity)],
    scene: &'s Scene,
    child: Option<Box<dyn Estimator + 's>>,
}

impl AovEstimator<'_> {
    /// Writes the layers of the first surface, and returns the layers of the child.
    fn write<'l>(&self, ray: &Ray, layers: &'l mut [f64]) -> &'l mut [f64] {
        let sampled = self.layers.iter().filter(|(_, quantity)| *quantity != Quantity::SampleCount);
        let mut rest = layers;
        let si = self.scene.intersect(ray);
        for (_, quantity) in sampled {
            let (own, others) = rest.split_at_mut(quantity.channels().len());
            if let Some(si) = &si {
                quantity.write(self.scene, si, own);
            }
            rest = others;
        }
        rest
    }
}

#[deny(clippy::missing_trait_methods)]
impl Estimator for AovEstimator<'_> {
    fn radiance(&self, camera_ray: &CameraRay, sampler: &mut PathSampler, output: &mut SampleOutput<'_>) -> Rgb {
        let rest = self.write(&camera_ray.ray, output.layers);
        let Some(child) = &self.child else { return Rgb::ZERO };
        let mut of_child = SampleOutput::new(rest);
        let radiance = child.radiance(camera_ray, sampler, &mut of_child);
        output.photons = of_child.photons;
        radiance
    }

    fn light_path(&self, sampler: &mut PathSampler, path: &mut splats::Path) {
        if let Some(child) = &self.child {
            child.light_path(sampler, path);
        }
    }

    fn next_state(&self, found: &[PassCounts]) -> IntegratorState {
        self.child.as_ref().map_or(IntegratorState::Empty, |child| child.next_state(found))
    }

    fn notes(&self) -> Notes {
        self.child.as_ref().map(|child| child.notes()).unwrap_or_default()
    }
}
