//! Builds a scene from the document of a scene file.

use std::collections::{HashMap, HashSet};

use super::{Scene, SceneEmitter, SceneShape};
use crate::{
    bsdf::{Bsdf, BsdfModel as _, Diffuse},
    emitter::{BoundingSphere, Emitter, EmitterModel as _},
    film::{FilmPlugin, Filter},
    math::{Aabb, Rgb},
    sampler::Sampler,
    scene_file::{
        Category, Document, FARTHEST, Manual, ObjectId, Param, ParamKind, Params, Plugin, SceneError, SourceLocation,
    },
    sensor::Sensor,
    shape::{Shape, ShapeModel as _, Shapes},
    texture::Texture,
};

/// The scene element. Its parameters are hints for acceleration structures that this renderer does not use.
pub(crate) const SCENE: Plugin = Plugin {
    category: Category::Scene,
    manual: Manual::NONE,
    name: "",
    summary: "The outermost element.",
    params: &[
        hint("embree_use_robust_intersections", ParamKind::Boolean),
        hint("allow_thread_reordering", ParamKind::Boolean),
        hint("kd_intersection_cost", ParamKind::Float),
        hint("kd_traversal_cost", ParamKind::Float),
        hint("kd_empty_space_bonus", ParamKind::Float),
        hint("kd_max_depth", ParamKind::Integer),
        hint("kd_min_max_bins", ParamKind::Integer),
        hint("kd_stop_prims", ParamKind::Integer),
        hint("kd_clip", ParamKind::Boolean),
        hint("kd_retract_bad_splits", ParamKind::Boolean),
        hint("kd_exact_primitive_threshold", ParamKind::Integer),
    ],
    examples: &[],
    evidence: &[],
};

const fn hint(name: &'static str, kind: ParamKind) -> Param {
    Param::ignored(name, kind, "the hierarchy of étendue has no such setting")
}

impl Scene {
    /// Builds the scene of a document whose root is a `<scene>`.
    ///
    /// # Errors
    /// All faults of its elements, and a missing sensor.
    pub fn build(document: &Document) -> Result<Self, SceneError> {
        let params = Params::of(document, document.root, Category::Scene, &[&SCENE])?;
        let mut builder = Builder::new(document);
        // The renderer reads the integrator.
        builder.keep(params.child(Category::Integrator));
        let sensor = builder.sensor(&params);
        builder.read_elements(&params);
        builder.keep(params.finish());
        if !builder.faults.is_empty() {
            return Err(SceneError(builder.faults).in_order(&document.files));
        }
        builder.finish(sensor.expect("without a sensor there is a fault"))
    }
}

/// Checks that the finite coordinates of a shape are small enough for accurate arithmetic.
fn check_extent(shape: &Shape, place: &SourceLocation) -> Result<(), SceneError> {
    let bounds = shape.bounds();
    let is_too_far = |x: f64| x.is_finite() && x.abs() > FARTHEST;
    let coordinates = [bounds.min, bounds.max].map(|corner| corner.to_array());
    if !coordinates.into_iter().flatten().any(is_too_far) {
        return Ok(());
    }
    let error = SceneError::at(place, "the shape extends too far");
    Err(error.hint(format!("no coordinate may exceed {FARTHEST:e}")))
}

/// Checks that a shape with an interface BSDF is closed.
fn check_closed<'b>(
    shape: &Shape,
    mut bsdfs: impl Iterator<Item = &'b Bsdf>,
    place: &SourceLocation,
) -> Result<(), SceneError> {
    if !bsdfs.any(Bsdf::is_interface) {
        return Ok(());
    }
    shape.open_edges().map_or(Ok(()), |edges| {
        let error = SceneError::at(place, format!("a shape of glass must be closed: {edges}"));
        Err(error.hint("close the mesh, or set allow_open to true if it is one surface between two media"))
    })
}

struct Builder<'d> {
    document: &'d Document,
    /// Whether the image depends on each object.
    used: Vec<bool>,
    shapes: Vec<Shape>,
    scene_shapes: Vec<SceneShape>,
    materials: Vec<usize>,
    bsdfs: Vec<Bsdf>,
    /// The index of the BSDF of each element, because several shapes may refer to an element.
    known_bsdfs: HashMap<ObjectId, usize>,
    emitters: Vec<SceneEmitter>,
    /// The elements of the emitters read so far.
    emitter_elements: HashSet<ObjectId>,
    environment: Option<usize>,
    warnings: Vec<String>,
    faults: Vec<crate::scene_file::Diagnostic>,
}

impl<'d> Builder<'d> {
    fn new(document: &'d Document) -> Self {
        Self {
            document,
            used: document.used(),
            shapes: Vec::new(),
            scene_shapes: Vec::new(),
            materials: Vec::new(),
            bsdfs: Vec::new(),
            known_bsdfs: HashMap::new(),
            emitters: Vec::new(),
            emitter_elements: HashSet::new(),
            environment: None,
            warnings: Vec::new(),
            faults: Vec::new(),
        }
    }

    /// Records the faults of a result, so that all are reported together. A fault of an element with several references
    /// is reported once.
    fn keep<T>(&mut self, result: Result<T, SceneError>) -> Option<T> {
        let note = |error: SceneError| {
            for fault in error.0 {
                if !self.faults.contains(&fault) {
                    self.faults.push(fault);
                }
            }
        };
        result.map_err(note).ok()
    }

    fn sensor(&mut self, params: &Params<'_>) -> Option<Sensor> {
        // As in Mitsuba, a scene may have several sensors, and the first is used.
        let sensors = params.children(Category::Sensor);
        if sensors.is_empty() {
            let error = SceneError::at(&params.object().place, "the scene has no sensor");
            return self.keep(Err(error.hint("give it a <sensor type=\"perspective\"> with a film")));
        }
        let document = self.document;
        let read: Vec<_> = sensors.into_iter().map(|id| self.keep(Sensor::read(document, id))).collect();
        read.into_iter().next().flatten()
    }

    fn read_elements(&mut self, params: &Params<'_>) {
        for id in params.children(Category::Shape) {
            let read = self.shape(id);
            self.keep(read);
        }
        for id in params.children(Category::Emitter) {
            let read = self.emitter(id, None);
            self.keep(read);
        }
        let parts = Category::ALL.into_iter().map(|(category, _)| category).filter(|category| category.is_part());
        for id in parts.flat_map(|category| params.children(category)) {
            if !self.used[id.0] {
                self.check_unused(id);
            }
        }
    }

    /// Checks an object that nothing uses. Its faults are warnings, because they do not change the image.
    fn check_unused(&mut self, id: ObjectId) {
        let (document, category) = (self.document, self.document.object(id).category);
        let read = match category {
            Category::Bsdf => Bsdf::read(document, id).map(drop),
            Category::Texture => Texture::read(document, id).map(drop),
            Category::Film => FilmPlugin::read(document, id).map(drop),
            Category::Filter => Filter::read(document, id).map(drop),
            Category::Sampler => Sampler::read(document, id).map(drop),
            _ => Ok(()),
        };
        for fault in read.err().into_iter().flat_map(|error| error.0) {
            let warning = format!("{fault}; nothing uses this {category}");
            // Another unused object may refer to this one.
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
    }

    fn shape(&mut self, id: ObjectId) -> Result<(), SceneError> {
        let params = Shape::params(self.document, id)?;
        let shape = Shape::read_from(&params)?;
        let place = &self.document.object(id).place;
        check_extent(&shape, place)?;
        if shape.dropped() > 0 {
            self.warnings.push(format!("{place}: triangles without area are ignored: {}", shape.dropped()));
        }
        let emitter = params.child(Category::Emitter)?;
        let own = params.child(Category::Bsdf)?;
        let first_material = self.push_materials(&shape, own, emitter.is_some())?;
        check_closed(&shape, self.materials[first_material..].iter().map(|&bsdf| &self.bsdfs[bsdf]), place)?;
        params.finish()?;
        let shape_index = self.scene_shapes.len();
        let not_an_emitter_because = shape.not_an_emitter_because();
        self.shapes.push(shape);
        self.scene_shapes.push(SceneShape { first_material, emitter: None });
        if let Some(emitter) = emitter {
            if let Some(hint) = not_an_emitter_because {
                let what = format!("a shape \"{}\" cannot be an area light", params.plugin().name);
                return Err(SceneError::at(&self.document.object(emitter).place, what).hint(hint));
            }
            self.emitter(emitter, Some(shape_index))?;
            self.scene_shapes[shape_index].emitter = Some(self.emitters.len() - 1);
        }
        Ok(())
    }

    /// Adds the materials of all operands of a shape, and returns the index of the first.
    fn push_materials(&mut self, shape: &Shape, own: Option<ObjectId>, is_emitter: bool) -> Result<usize, SceneError> {
        let default = match own {
            Some(id) => self.bsdf(id)?,
            // As in Mitsuba, area lights without a material are black, and other shapes grey.
            None => self.push_bsdf(Diffuse::new(if is_emitter { Rgb::ZERO } else { Rgb::splat(0.5) })),
        };
        let materials = shape.materials().iter().map(|material| material.map_or(Ok(default), |id| self.bsdf(id)));
        let materials = materials.collect::<Result<Vec<_>, _>>()?;
        let first = self.materials.len();
        self.materials.extend(materials);
        Ok(first)
    }

    fn push_bsdf(&mut self, bsdf: impl Into<Bsdf>) -> usize {
        self.bsdfs.push(bsdf.into());
        self.bsdfs.len() - 1
    }

    fn bsdf(&mut self, id: ObjectId) -> Result<usize, SceneError> {
        if let Some(&known) = self.known_bsdfs.get(&id) {
            return Ok(known);
        }
        let index = Bsdf::read(self.document, id).map(|bsdf| self.push_bsdf(bsdf))?;
        self.known_bsdfs.insert(id, index);
        Ok(index)
    }

    fn emitter(&mut self, id: ObjectId, shape_index: Option<usize>) -> Result<(), SceneError> {
        let emitter = Emitter::read(self.document, id)?;
        let place = &self.document.object(id).place;
        if shape_index.is_none() && emitter.is_of_surface() {
            // As in Mitsuba, it may be declared outside of the shape that uses it. Shapes were read before.
            if !self.emitter_elements.contains(&id) {
                self.warnings.push(format!("{place}: no shape uses this emitter, so it emits no light"));
            }
            return Ok(());
        }
        if !self.emitter_elements.insert(id) {
            let error = SceneError::at(place, "this emitter is used more than once");
            return Err(error.hint("give each shape its own emitter"));
        }
        if shape_index.is_some() && !emitter.is_of_surface() {
            let error = SceneError::at(place, "this emitter cannot belong to a shape");
            return Err(error.hint("only an area emitter can"));
        }
        if emitter.is_environment() && self.environment.replace(self.emitters.len()).is_some() {
            return Err(SceneError::at(place, "the scene has a second environment emitter").hint("give it only one"));
        }
        self.emitters.push(SceneEmitter { model: emitter, shape_index });
        Ok(())
    }

    fn finish(self, sensor: Sensor) -> Result<Scene, SceneError> {
        let shapes = Shapes::new(self.shapes);
        let sphere = |bounds: Aabb| {
            let (centre, radius) = bounds.bounding_sphere();
            BoundingSphere { centre, radius }
        };
        let scene_bounds = sphere(shapes.finite_bounds());
        let end =
            |index: usize| self.scene_shapes.get(index + 1).map_or(self.materials.len(), |next| next.first_material);
        let is_specular = |index: &usize| {
            let own = &self.materials[self.scene_shapes[*index].first_material..end(*index)];
            own.iter().any(|&material| self.bsdfs[material].has_delta())
        };
        let specular = (0..self.scene_shapes.len()).filter(is_specular).map(|index| sphere(shapes[index].bounds()));
        let specular: Vec<BoundingSphere> = specular.collect();
        let is_bounded = specular.iter().all(|sphere| sphere.radius.is_finite());
        let scene = Scene {
            sensor,
            shapes,
            scene_shapes: self.scene_shapes,
            materials: self.materials,
            absorbs: self.bsdfs.iter().any(|bsdf| bsdf.absorption() != Rgb::ZERO),
            has_self_emission: self.bsdfs.iter().any(Bsdf::has_self_emission),
            bsdfs: self.bsdfs,
            emitters: self.emitters,
            environment: self.environment,
            emitter_powers: None,
            power: 0.0,
            scene_bounds,
            specular: is_bounded.then_some(specular),
            warnings: self.warnings,
        };
        Ok(scene.with_emitter_powers())
    }
}
