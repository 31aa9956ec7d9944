use super::{EyeRay, Integrator, Model, Notes, Preparation, Round};
use crate::{
    film::{LayerSpec, Source, splats},
    math::Rgb,
    node::{Category, Described, Kind, Param, Params, Plugin, SceneError},
    sampler::PathNumbers,
    scene::Scene,
};

/// Renders another integrator's image and writes the mean of the squares of its samples as the layer `m2`. (Every
/// image has the variance of its mean as a layer anyway; Mitsuba's channels `m2_*` are of X, Y and Z, these of R, G, B.)
#[derive(Clone, Debug)]
pub struct Moment {
    child: Box<Integrator>,
}

impl Described for Moment {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        name: "moment",
        summary: "Another integrator's image with the second moment of its samples.",
        params: &[Param::required("integrator", Kind::Object(Category::Integrator), "the integrator that renders")],
        examples: &[r#"<integrator type="moment"><integrator type="path"/></integrator>"#],
        evidence: &["reference/moment-still-life"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let Some(child) = params.child(Category::Integrator)? else {
            return Err(SceneError::at(&params.object().place, "an integrator \"moment\" holds another integrator"));
        };
        Ok(Self { child: Box::new(Integrator::read(params.document(), child)?) })
    }
}

impl Model for Moment {
    fn not_physical(&self) -> Option<&'static str> {
        self.child.not_physical()
    }

    fn needs_light(&self) -> bool {
        self.child.needs_light()
    }

    fn layers(&self) -> Vec<LayerSpec> {
        let second = LayerSpec { source: Source::SecondMoment, ..LayerSpec::sampled("m2") };
        self.child.layers().into_iter().chain([second]).collect()
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        self.child.check(scene)
    }

    fn preparation(&self) -> Preparation {
        self.child.preparation()
    }

    fn prepared(&self, scene: &Scene, round: &Round) -> Option<Self> {
        Some(Self { child: Box::new(self.child.prepared(scene, round)?) })
    }

    fn memory(&self) -> Vec<f64> {
        self.child.memory()
    }

    fn remember(&mut self, memory: Vec<f64>) {
        self.child.remember(memory);
    }

    fn samples(&self) -> Option<u32> {
        self.child.samples()
    }

    fn notes(&self) -> Notes {
        self.child.notes()
    }

    fn traces_light(&self) -> bool {
        self.child.traces_light()
    }

    fn light_path(&self, scene: &Scene, numbers: &mut PathNumbers, path: &mut splats::Path) {
        self.child.light_path(scene, numbers, path);
    }

    fn radiance(&self, scene: &Scene, eye: &EyeRay, numbers: &mut PathNumbers, layers: &mut [f64]) -> Rgb {
        self.child.radiance(scene, eye, numbers, layers)
    }
}
