//! Estimators of the radiance along a ray.

mod aov;
mod depth;
mod direct;
mod eye_walk;
pub mod laws;
mod moment;
mod path;
mod photonmapper;
mod photons;
mod ptracer;
mod sppm;

pub use aov::Aov;
pub use depth::Depth;
pub use direct::Direct;
pub use moment::Moment;
pub use path::Path;
pub use photonmapper::PhotonMapper;
pub use ptracer::ParticleTracer;
pub use sppm::Sppm;

use crate::{
    film::{LayerSpec, splats},
    math::{Ray, Rgb},
    sampler::PathSampler,
    scene::{Scene, SurfaceInteraction},
    scene_file::{
        Category, Document, Object, ObjectId, Override, Param, ParamKind, Params, Property, Range, SceneError,
        SourceLocation, Value, catalogue, whole_number,
    },
    transport::{PathLimits, Shadows},
};

/// What a user may want to know of a rendering.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    /// Sizes, counts and times.
    pub facts: Vec<String>,
    /// What may make the image other than it was meant.
    pub warnings: Vec<String>,
}

/// When an integrator gathers what it needs before it can estimate radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preprocess {
    /// Never: its samples know nothing of one another.
    None,
    /// Once for a pass, whose samples share it.
    Replicate,
    /// Anew for each sample of all pixels.
    Sample,
    /// Anew for each sample of all pixels, and it depends on what the samples before have found.
    Chain,
}

impl Preprocess {
    /// Whether each sample of all pixels is prepared for by itself.
    #[must_use]
    pub fn is_for_each_sample(self) -> bool {
        matches!(self, Self::Sample | Self::Chain)
    }
}

/// What is prepared for: which sample of all pixels, in which pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Iteration {
    /// The user's seed.
    pub seed: u64,
    /// Which estimate of the image.
    pub replicate: u64,
    /// Which sample; 0 where all samples of a pass are prepared for at once.
    pub sample: u32,
}

/// A ray from the camera.
#[derive(Clone, Copy, Debug)]
pub struct EyeRay {
    /// The ray.
    pub ray: Ray,
    /// The number of its pixel in the rendered part of the film, row by row.
    pub pixel: usize,
}

impl EyeRay {
    /// A ray that belongs to no pixel in particular.
    #[must_use]
    pub fn alone(ray: Ray) -> Self {
        Self { ray, pixel: 0 }
    }
}

/// What an integrator answers.
pub trait IntegratorModel {
    /// Layers beside the beauty.
    fn layers(&self) -> Vec<LayerSpec> {
        Vec::new()
    }

    /// What about its image is not physical, if anything.
    fn not_physical(&self) -> Option<&'static str> {
        None
    }

    /// Whether its image is black without light.
    fn needs_light(&self) -> bool {
        true
    }

    /// Makes sure that it can treat a scene.
    ///
    /// # Errors
    /// Why it cannot.
    fn check(&self, _scene: &Scene) -> Result<(), String> {
        Ok(())
    }

    /// When it has to be prepared.
    fn preprocess(&self) -> Preprocess {
        Preprocess::None
    }

    /// The same integrator with what it gathers before a round, if it does: a pure function of the scene and the round,
    /// and with [`Preprocess::Chain`] of what `self` found in the round before.
    fn prepared(&self, _scene: &Scene, _round: &Iteration) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// What the next round depends on, with [`Preprocess::Chain`]: so many numbers for each pixel. It is empty before the
    /// first round.
    fn state(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Makes it go on from what [`IntegratorModel::state`] gave.
    fn restore_state(&mut self, _memory: Vec<f64>) {}

    /// Samples of each pixel that it asks for, if it does.
    fn samples(&self) -> Option<u32> {
        None
    }

    /// What it has gathered and done.
    fn notes(&self) -> Notes {
        Notes::default()
    }

    /// Whether its samples are independent, so that their scatter tells the variance of the image.
    fn has_variance(&self) -> bool {
        self.preprocess() == Preprocess::None
    }

    /// Whether it follows light from its sources, a path for each sample of each pixel.
    fn traces_light(&self) -> bool {
        false
    }

    /// Follows light from its source, and adds to the film what the sensor sees of it on the way.
    fn light_path(&self, _scene: &Scene, _numbers: &mut PathSampler, _path: &mut splats::Path) {}

    /// An estimate of the radiance that comes back along a camera's ray. What its sampled layers show of this ray goes
    /// into `layers`, as many values as they have channels.
    fn radiance(&self, scene: &Scene, eye: &EyeRay, sampler: &mut PathSampler, layers: &mut [f64]) -> Rgb;
}

catalogue! { ($)
    /// An integrator.
    pub enum Integrator in Category::Integrator, each_integrator {
        /// Path tracing.
        Path(Path),
        /// Light tracing.
        ParticleTracer(ParticleTracer),
        /// Photon mapping.
        PhotonMapper(PhotonMapper),
        /// Stochastic progressive photon mapping.
        Sppm(Sppm),
        /// Direct light only.
        Direct(Direct),
        /// The distance to the first surface.
        Depth(Depth),
        /// Layers of what the first surface is like.
        Aov(Aov),
        /// The second moment beside the mean.
        Moment(Moment),
    }
}

impl IntegratorModel for Integrator {
    fn layers(&self) -> Vec<LayerSpec> {
        each_integrator!(self, integrator => integrator.layers())
    }

    fn not_physical(&self) -> Option<&'static str> {
        each_integrator!(self, integrator => integrator.not_physical())
    }

    fn needs_light(&self) -> bool {
        each_integrator!(self, integrator => integrator.needs_light())
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        each_integrator!(self, integrator => integrator.check(scene))
    }

    fn preprocess(&self) -> Preprocess {
        each_integrator!(self, integrator => integrator.preprocess())
    }

    fn prepared(&self, scene: &Scene, iteration: &Iteration) -> Option<Self> {
        each_integrator!(self, integrator => integrator.prepared(scene, iteration).map(Self::from))
    }

    fn state(&self) -> Vec<f64> {
        each_integrator!(self, integrator => integrator.state())
    }

    fn restore_state(&mut self, state: Vec<f64>) {
        each_integrator!(self, integrator => integrator.restore_state(state))
    }

    fn samples(&self) -> Option<u32> {
        each_integrator!(self, integrator => integrator.samples())
    }

    fn has_variance(&self) -> bool {
        each_integrator!(self, integrator => integrator.has_variance())
    }

    fn notes(&self) -> Notes {
        each_integrator!(self, integrator => integrator.notes())
    }

    fn traces_light(&self) -> bool {
        each_integrator!(self, integrator => integrator.traces_light())
    }

    fn light_path(&self, scene: &Scene, sampler: &mut PathSampler, path: &mut splats::Path) {
        each_integrator!(self, integrator => integrator.light_path(scene, sampler, path))
    }

    fn radiance(&self, scene: &Scene, eye: &EyeRay, sampler: &mut PathSampler, layers: &mut [f64]) -> Rgb {
        each_integrator!(self, integrator => integrator.radiance(scene, eye, sampler, layers))
    }
}

const HIDE_EMITTERS: Param = Param::new(
    "hide_emitters",
    ParamKind::Boolean,
    "false",
    "whether the camera sees through lights, and a black environment",
);
const TRANSPARENT_SHADOWS: Param = Param::new(
    "transparent_shadows",
    ParamKind::Boolean,
    "false",
    "whether shadow rays pass glass, unbent and weighted by its transmittance; not physical",
);
/// Whether layers show the four classes of paths apart.
const PATH_CLASSES: Param = Param::new(
    "path_classes",
    ParamKind::Boolean,
    "false",
    "whether layers direct, specular, caustic, indirect add up to the image",
);
const MAX_DEPTH: Param =
    Param::new("max_depth", ParamKind::Integer, "-1", "segments of the longest path; 1 is emission only, -1 no limit")
        .within(Range { min: -1.0, max: 4_294_967_295.0, open: false });
const RR_DEPTH: Param = Param::new("rr_depth", ParamKind::Integer, "5", "segments after which Russian roulette begins")
    .within(Range { min: 1.0, max: 4_294_967_295.0, open: false });

/// How long paths may be.
fn read_path_limits(params: &Params<'_>) -> Result<PathLimits, SceneError> {
    let max = params.integer(MAX_DEPTH.name)?;
    let rr_depth = params.integer(RR_DEPTH.name)?.unsigned_abs() as u32;
    Ok(PathLimits { max_depth: u32::try_from(max).unwrap_or(u32::MAX), rr_depth })
}

/// Whether shadows of glass are transparent.
fn read_shadows(params: &Params<'_>) -> Result<Shadows, SceneError> {
    let transparent = params.boolean(TRANSPARENT_SHADOWS.name)?;
    Ok(if transparent { Shadows::Transparent } else { Shadows::Opaque })
}

/// What an image with such shadows says of itself.
fn not_physical(shadows: Shadows) -> Option<&'static str> {
    (shadows == Shadows::Transparent).then_some(TRANSPARENT_SHADOWS.name)
}

/// What the camera sees first. With `hide_emitters` it looks through every light.
fn first_vertex(scene: &Scene, ray: &Ray, hide_emitters: bool) -> Option<SurfaceInteraction> {
    let mut si = scene.intersect(ray)?;
    while hide_emitters && scene.is_light(&si) {
        let beyond = Ray { t_max: ray.t_max - si.t, ..Ray::leaving(si.surface.p, ray.direction) };
        let next = scene.intersect(&beyond)?;
        si = SurfaceInteraction { t: si.t + next.t, ..next };
    }
    Some(si)
}

/// What is wrong with a scene that has no integrator.
pub const NO_INTEGRATOR: &str = "the scene has no integrator";

/// What a render changes about its scene's integrator.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// The name of another integrator, which keeps the parameters that both have, such as `max_depth`.
    pub name: Option<String>,
    /// Parameters, as name and text.
    pub params: Vec<(String, String)>,
}

impl Integrator {
    /// The name of a scene's own integrator, if it has one.
    #[must_use]
    pub fn name_in(document: &Document) -> Option<&str> {
        let id = document.child(document.root, Category::Integrator)?;
        Some(&document.object(id).plugin)
    }

    /// The integrator of a scene's document.
    ///
    /// # Errors
    /// If the scene has none and none is named, or it is wrong.
    pub fn of_scene(document: &Document, overrides: &Overrides) -> Result<Self, SceneError> {
        let (document, id) = overrides.applied(document)?;
        Self::read(&document, id)
    }

    /// The same as text: its name, and the parameters that are set.
    ///
    /// # Errors
    /// If the scene has none and none is named.
    pub fn described(document: &Document, overrides: &Overrides) -> Result<String, SceneError> {
        let (document, id) = overrides.applied(document)?;
        Ok(document.describe(id, &[]))
    }
}

impl Overrides {
    /// The document with its integrator as it is asked for.
    fn applied(&self, document: &Document) -> Result<(Document, ObjectId), SceneError> {
        let own = document.child(document.root, Category::Integrator);
        let mut document = document.clone();
        let id = match (own, &self.name) {
            (None, None) => {
                let root = document.object(document.root);
                let error = SceneError::at(&root.place, NO_INTEGRATOR);
                return Err(error.hint("give it one, or choose one for this render"));
            }
            (Some(id), None) => id,
            (own, Some(name)) => document.add_stand_in(own, Category::Integrator, name, Integrator::PLUGINS),
        };
        for (name, text) in &self.params {
            set(&mut document.objects[id.0], name, text);
        }
        Ok((document, id))
    }
}

/// Sets a parameter from text, of the type that the text looks like.
fn set(object: &mut Object, name: &str, text: &str) {
    let value = if let Some(integer) = whole_number(text).and_then(|number| number.try_into().ok()) {
        Value::Integer(integer)
    } else if let Ok(float) = text.parse() {
        Value::Float(float)
    } else if let Ok(boolean) = text.parse() {
        Value::Boolean(boolean)
    } else {
        Value::String(text.to_owned())
    };
    object.properties.retain(|property| property.name != name);
    let place = SourceLocation::Override(Override::Parameter { name: name.to_owned(), value: text.to_owned() });
    object.properties.push(Property { name: name.to_owned(), value, place });
}
