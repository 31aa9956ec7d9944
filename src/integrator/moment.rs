use super::{Estimator, Integrator, IntegratorModel, IntegratorState, Iteration, IterationPlan};
use crate::{
    film::{LayerSource, LayerSpec},
    scene::Scene,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// Renders another integrator's image, and writes the mean of the squares of its samples as the layer `m2`. Every image
/// already has the variance of its mean as a layer. Mitsuba's channels `m2_*` hold X, Y and Z; the channels of `m2`
/// hold R, G and B.
#[derive(Clone, Debug)]
pub struct Moment {
    child: Box<Integrator>,
}

impl Described for Moment {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        manual: manual!("moment.rs": "Moment"),
        name: "moment",
        summary: "Another integrator's image with the second moment of its samples.",
        params: &[Param::required(
            "integrator",
            ParamKind::Object(Category::Integrator),
            "the integrator that renders",
        )],
        examples: &[r#"<integrator type="moment"><integrator type="path"/></integrator>"#],
        evidence: &["reference/moment-still-life"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let Some(child) = params.child(Category::Integrator)? else {
            return Err(SceneError::at(
                &params.object().place,
                "an integrator \"moment\" needs another integrator inside",
            ));
        };
        Ok(Self { child: Box::new(Integrator::read(params.document(), child)?) })
    }
}

/// Every method is written out, so that a new method cannot fall back to its default.
#[deny(clippy::missing_trait_methods)]
impl IntegratorModel for Moment {
    fn not_physical(&self) -> Option<&'static str> {
        self.child.not_physical()
    }

    fn needs_light(&self) -> bool {
        self.child.needs_light()
    }

    fn layers(&self) -> Vec<LayerSpec> {
        let second = LayerSpec { source: LayerSource::SecondMoment, ..LayerSpec::sampled("m2") };
        self.child.layers().into_iter().chain([second]).collect()
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        self.child.check(scene)
    }

    fn iterations(&self) -> IterationPlan {
        self.child.iterations()
    }

    fn samples(&self) -> Option<u32> {
        self.child.samples()
    }

    fn has_variance(&self) -> bool {
        self.child.has_variance()
    }

    fn traces_light(&self) -> bool {
        self.child.traces_light()
    }

    fn begin<'s>(
        &'s self,
        scene: &'s Scene,
        iteration: &Iteration,
        state: &IntegratorState,
    ) -> Box<dyn Estimator + 's> {
        // The film computes the second moment from the samples of the child.
        self.child.begin(scene, iteration, state)
    }
}
