//! From nodes to the scene.

use std::collections::{HashMap, HashSet};

use super::{Light, Part, Scene};
use crate::{
    bsdf::{Bsdf, BsdfModel as _, Diffuse},
    emitter::{BoundingSphere, Emitter, EmitterModel as _},
    math::{Aabb, Rgb},
    scene_file::{
        Category, Document, FARTHEST, Manual, ObjectId, Param, ParamKind, Params, Plugin, SceneError, SourceLocation,
    },
    sensor::Sensor,
    shape::{Shape, ShapeModel as _, Shapes},
};

/// What a scene element itself takes: hints for acceleration structures that are not ours.
pub(crate) const SCENE: Plugin = Plugin {
    category: Category::Scene,
    manual: Manual::NONE,
    name: "",
    summary: "The outermost element.",
    params: &[
        Param::new(
            "embree_use_robust_intersections",
            ParamKind::Boolean,
            "false",
            "read; intersections are always robust",
        ),
        Param::new("kd_intersection_cost", ParamKind::Float, "20", "read; makes no difference"),
        Param::new("kd_traversal_cost", ParamKind::Float, "15", "read; makes no difference"),
        Param::new("kd_empty_space_bonus", ParamKind::Float, "0.9", "read; makes no difference"),
        Param::new("kd_max_depth", ParamKind::Integer, "0", "read; makes no difference"),
        Param::new("kd_min_max_bins", ParamKind::Integer, "128", "read; makes no difference"),
        Param::new("kd_stop_prims", ParamKind::Integer, "3", "read; makes no difference"),
        Param::new("kd_clip", ParamKind::Boolean, "true", "read; makes no difference"),
        Param::new("kd_retract_bad_splits", ParamKind::Boolean, "true", "read; makes no difference"),
        Param::new("kd_exact_primitive_threshold", ParamKind::Integer, "65536", "read; makes no difference"),
    ],
    examples: &[],
    evidence: &[],
};

/// Categories that Mitsuba knows and this renderer does not.
const ABSENT: [Category; 3] = [Category::Medium, Category::Phase, Category::Volume];

impl Scene {
    /// Builds the scene of a document whose root is a `<scene>`.
    ///
    /// # Errors
    /// All that is wrong with its parts, and the lack of a sensor.
    pub fn build(document: &Document) -> Result<Self, SceneError> {
        let params = Params::of(document, document.root, Category::Scene, &[&SCENE])?;
        check_hints(&params)?;
        let mut builder = Builder::new(document);
        // The integrator is read by whoever renders.
        builder.keep(params.child(Category::Integrator));
        let sensor = builder.sensor(&params);
        builder.read_parts(&params);
        builder.keep(params.finish());
        if !builder.faults.is_empty() {
            return Err(SceneError(builder.faults).in_order(&document.files));
        }
        builder.finish(sensor.expect("without a sensor there is a fault"))
    }
}

/// Reads what makes no difference, so that a wrong type is still noticed.
fn check_hints(params: &Params<'_>) -> Result<(), SceneError> {
    for Param { name, kind, .. } in SCENE.params {
        match kind {
            ParamKind::Boolean => params.boolean(name).map(drop)?,
            ParamKind::Integer => params.integer(name).map(drop)?,
            _ => params.float(name).map(drop)?,
        }
    }
    Ok(())
}

/// Makes sure that a shape, as far as it is finite, lies where arithmetic is good.
fn check_reach(shape: &Shape, place: &SourceLocation) -> Result<(), SceneError> {
    let bounds = shape.bounds();
    let is_too_far = |x: f64| x.is_finite() && x.abs() > FARTHEST;
    let coordinates = [bounds.min, bounds.max].map(|corner| corner.to_array());
    if !coordinates.into_iter().flatten().any(is_too_far) {
        return Ok(());
    }
    let error = SceneError::at(place, "the shape reaches too far");
    Err(error.hint(format!("no coordinate may be beyond {FARTHEST:e}")))
}

/// Makes sure that glass has an inside.
fn check_closed<'b>(
    shape: &Shape,
    mut bsdfs: impl Iterator<Item = &'b Bsdf>,
    place: &SourceLocation,
) -> Result<(), SceneError> {
    if !bsdfs.any(Bsdf::is_interface) {
        return Ok(());
    }
    shape.open_edges().map_or(Ok(()), |edges| {
        let error = SceneError::at(place, format!("glass has no inside here: {edges}"));
        Err(error.hint("close the mesh, or set allow_open to true if it is only a surface between two media"))
    })
}

struct Builder<'d> {
    document: &'d Document,
    shapes: Vec<Shape>,
    parts: Vec<Part>,
    materials: Vec<usize>,
    bsdfs: Vec<Bsdf>,
    /// Which bsdf an element has become, for elements that several shapes refer to.
    known_bsdfs: HashMap<ObjectId, usize>,
    lights: Vec<Light>,
    /// The elements that have become lights.
    emitters: HashSet<ObjectId>,
    environment: Option<usize>,
    warnings: Vec<String>,
    faults: Vec<crate::scene_file::Diagnostic>,
}

impl<'d> Builder<'d> {
    fn new(document: &'d Document) -> Self {
        Self {
            document,
            shapes: Vec::new(),
            parts: Vec::new(),
            materials: Vec::new(),
            bsdfs: Vec::new(),
            known_bsdfs: HashMap::new(),
            lights: Vec::new(),
            emitters: HashSet::new(),
            environment: None,
            warnings: Vec::new(),
            faults: Vec::new(),
        }
    }

    /// Notes what went wrong and goes on, so that all faults are reported together; those of an element that several
    /// others refer to once.
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
        // As in Mitsuba, a scene may hold several, of which the first is used.
        let sensors = params.children(Category::Sensor);
        if sensors.is_empty() {
            let error = SceneError::at(&params.object().place, "the scene has no sensor");
            return self.keep(Err(error.hint("give it a <sensor type=\"perspective\"> with a film")));
        }
        let document = self.document;
        let read: Vec<_> = sensors.into_iter().map(|id| self.keep(Sensor::read(document, id))).collect();
        read.into_iter().next().flatten()
    }

    fn read_parts(&mut self, params: &Params<'_>) {
        let document = self.document;
        for id in params.children(Category::Shape) {
            let read = self.shape(id);
            self.keep(read);
        }
        for id in params.children(Category::Emitter) {
            let read = self.light(id, None);
            self.keep(read);
        }
        // Materials and textures that stand alone wait to be referred to; they are checked all the same.
        for id in params.children(Category::Bsdf) {
            let read = self.bsdf(id);
            self.keep(read);
        }
        for id in params.children(Category::Texture) {
            self.keep(crate::texture::Texture::read(document, id));
        }
        for category in ABSENT {
            for id in params.children(category) {
                let what = format!("a {category} is not supported");
                self.keep::<()>(Err(SceneError::at(&document.object(id).place, what)));
            }
        }
    }

    fn shape(&mut self, id: ObjectId) -> Result<(), SceneError> {
        let params = Shape::params(self.document, id)?;
        let shape = Shape::read_from(&params)?;
        let place = &self.document.object(id).place;
        check_reach(&shape, place)?;
        if shape.dropped() > 0 {
            self.warnings.push(format!("{place}: triangles without area are left out: {}", shape.dropped()));
        }
        let emitter = params.child(Category::Emitter)?;
        let own = params.child(Category::Bsdf)?;
        let first_material = self.push_materials(&shape, own, emitter.is_some())?;
        check_closed(&shape, self.materials[first_material..].iter().map(|&bsdf| &self.bsdfs[bsdf]), place)?;
        params.finish()?;
        let part = self.parts.len();
        let not_an_emitter_because = shape.not_an_emitter_because();
        self.shapes.push(shape);
        self.parts.push(Part { first_material, light: None });
        if let Some(emitter) = emitter {
            if let Some(hint) = not_an_emitter_because {
                let what = format!("a shape \"{}\" cannot be an area light", params.plugin().name);
                return Err(SceneError::at(&self.document.object(emitter).place, what).hint(hint));
            }
            self.light(emitter, Some(part))?;
            self.parts[part].light = Some(self.lights.len() - 1);
        }
        Ok(())
    }

    /// Adds the materials of all leaves of a shape and returns where they begin.
    fn push_materials(&mut self, shape: &Shape, own: Option<ObjectId>, is_light: bool) -> Result<usize, SceneError> {
        let usual = match own {
            Some(id) => self.bsdf(id)?,
            // Lights without a material are black, other shapes grey, as in Mitsuba.
            None => self.push_bsdf(Diffuse::new(if is_light { Rgb::ZERO } else { Rgb::splat(0.5) })),
        };
        let materials =
            shape.materials().iter().map(|operand_index| operand_index.map_or(Ok(usual), |id| self.bsdf(id)));
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

    fn light(&mut self, id: ObjectId, part: Option<usize>) -> Result<(), SceneError> {
        let emitter = Emitter::read(self.document, id)?;
        let place = &self.document.object(id).place;
        if !self.emitters.insert(id) {
            let error = SceneError::at(place, "this emitter stands in several places");
            return Err(error.hint("give each shape that shines an emitter of its own"));
        }
        let shines_from_a_shape = matches!(emitter, Emitter::Area(_));
        if shines_from_a_shape != part.is_some() {
            let (what, hint) = match part {
                Some(_) => ("this emitter cannot stand in a shape", "only an area emitter can"),
                None => ("an area emitter stands in no shape", "put it inside the shape that shines"),
            };
            return Err(SceneError::at(place, what).hint(hint));
        }
        if emitter.is_environment() && self.environment.replace(self.lights.len()).is_some() {
            return Err(SceneError::at(place, "a second emitter surrounds the scene").hint("only one can"));
        }
        self.lights.push(Light { emitter, part });
        Ok(())
    }

    fn finish(self, sensor: Sensor) -> Result<Scene, SceneError> {
        let shapes = Shapes::new(self.shapes);
        let sphere = |bounds: Aabb| {
            let (centre, radius) = bounds.bounding_sphere();
            BoundingSphere { centre, radius }
        };
        let scene_bounds = sphere(shapes.finite_bounds());
        let end = |part: usize| self.parts.get(part + 1).map_or(self.materials.len(), |next| next.first_material);
        let is_specular = |part: &usize| {
            let own = &self.materials[self.parts[*part].first_material..end(*part)];
            own.iter().any(|&material| self.bsdfs[material].has_delta())
        };
        let specular = (0..self.parts.len()).filter(is_specular).map(|part| sphere(shapes[part].bounds()));
        let specular: Vec<BoundingSphere> = specular.collect();
        let is_bounded = specular.iter().all(|sphere| sphere.radius.is_finite());
        let scene = Scene {
            sensor,
            shapes,
            parts: self.parts,
            materials: self.materials,
            absorbs: self.bsdfs.iter().any(|bsdf| bsdf.absorption() != Rgb::ZERO),
            has_self_emission: self.bsdfs.iter().any(Bsdf::has_self_emission),
            bsdfs: self.bsdfs,
            lights: self.lights,
            environment: self.environment,
            light_powers: None,
            power: 0.0,
            scene_bounds,
            specular: is_bounded.then_some(specular),
            warnings: self.warnings,
        };
        Ok(scene.weigh_lights())
    }
}
