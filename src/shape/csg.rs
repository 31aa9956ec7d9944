use glam::DAffine3;

use super::{
    Crossing, Crossings, Geometry, Hit, Line, Operation, ShapeModel, SolidModel, Span, Surface,
    affine::Affine,
    solid::{combine, combine_spans},
};
use crate::{
    math::{Aabb, Frame, Ray},
    scene_file::{Category, Described, ObjectId, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// Constructive solid geometry: the union or the intersection of solids, or the difference of the first solid and all
/// others.
///
/// The operands can be spheres, ellipsoids, cubes, closed meshes, planes (the half-space below the plane), cylinders
/// and other quadrics (closed by flat faces), and other csgs, nested as deeply as scene files can be. A csg with a
/// single operand is that solid, closed by flat faces. Normals point out of the result, so that rays enter and leave
/// glass in turn, and a union has no inner surfaces. The BSDF of an operand applies to the part of its surface that
/// remains. The BSDF of the csg applies to operands without their own.
///
/// Details thinner than the offset of spawned rays, 1e-9 of the coordinates, vanish: where faces of operands coincide
/// or touch, the result has neither a gap nor a skin, and the surface belongs to the first operand. The shells of a
/// mesh must face outwards. A shell that faces inwards within another shell bounds a cavity.
#[derive(Clone, Debug)]
pub struct Csg {
    operation: Operation,
    operands: Vec<Operand>,
    materials: Vec<Option<ObjectId>>,
    /// Whether the csg has exactly two operands and both are convex.
    is_convex_pair: bool,
    /// The csg's `to_world`, if it has one. Without it, the operands are in the space of the parent csg or of the
    /// world.
    transform: Option<Affine>,
    bounds: Aabb,
}

#[derive(Clone, Debug)]
struct Operand {
    geometry: Geometry,
    /// The operand index of its first operand that is not a csg.
    first_index: u32,
    /// Whether the operand is subtracted.
    is_subtracted: bool,
}

impl Described for Csg {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("csg.rs": "Csg"),
        name: "csg",
        summary: "The union, intersection or difference of solids: spheres, ellipsoids, cubes, closed meshes, planes \
                  (half-spaces), quadrics (closed by flat faces) and other csgs.",
        params: &[
            Param::required(
                "operation",
                ParamKind::Choice(&["union", "intersection", "difference"]),
                "the set operation; difference subtracts all other operands from the first",
            ),
            Param::required(
                "shape",
                ParamKind::Object(Category::Shape),
                "the operands in order, each optionally with its own bsdf",
            ),
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="csg"><string name="operation" value="intersection"/><shape type="sphere"/>
                <shape type="sphere"><point name="center" x="1" y="0" z="0"/><float name="radius" value="0.8"/></shape></shape>"#,
            r#"<shape type="csg"><string name="operation" value="difference"/><shape type="sphere"/>
                <shape type="sphere"><point name="center" x="1" y="0" z="0"/><float name="radius" value="0.8"/></shape></shape>"#,
            r#"<shape type="csg"><string name="operation" value="union"/><shape type="sphere"/>
                <shape type="sphere"><point name="center" x="1" y="0" z="0"/><float name="radius" value="0.8"/></shape>
                <transform name="to_world"><rotate y="1" angle="30"/><scale value="1.5"/><translate x="2" y="-1"/></transform></shape>"#,
        ],
        evidence: &["csg/*", "shape/*", "optics/lenses"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let operation = match params.string("operation")? {
            "union" => Operation::Union,
            "intersection" => Operation::Intersection,
            _ => Operation::Difference,
        };
        let transform = match params.find(super::TO_WORLD.name) {
            Some(_) => Some(Affine::read(params, DAffine3::IDENTITY)?),
            None => None,
        };
        let children = params.children(Category::Shape);
        if children.is_empty() {
            let error = SceneError::at(&params.object().place, "a shape \"csg\" has no operands");
            return Err(error.hint("put the operands inside it"));
        }
        let mut csg = Self {
            operation,
            operands: Vec::new(),
            materials: Vec::new(),
            is_convex_pair: false,
            transform,
            bounds: Aabb::EMPTY,
        };
        for id in children {
            csg.push(params, id)?;
        }
        csg.bounds = csg.find_bounds();
        csg.is_convex_pair = csg.operands.len() == 2 && csg.operands.iter().all(|operand| operand.geometry.is_convex());
        Ok(csg)
    }
}

impl Csg {
    /// Reads the next operand.
    fn push(&mut self, params: &Params<'_>, id: ObjectId) -> Result<(), SceneError> {
        let document = params.document();
        let child = Geometry::params(document, id)?;
        let geometry = Geometry::read_from(&child)?;
        let place = &document.object(id).place;
        geometry
            .check_solid()
            .map_err(|why| SceneError::at(place, format!("this shape cannot be an operand of a csg: {why}")))?;
        if child.find(super::FLIP_NORMALS.name).is_some() {
            let error = child.error(super::FLIP_NORMALS.name, "the normals of an operand cannot be flipped");
            return Err(error.hint("set flip_normals of the csg instead"));
        }
        if let Some(emitter) = child.child(Category::Emitter)? {
            let place = &document.object(emitter).place;
            return Err(SceneError::at(place, "an operand of a csg cannot be an area light"));
        }
        let own = child.child(Category::Bsdf)?;
        child.finish()?;
        let is_subtracted = self.operation == Operation::Difference && !self.operands.is_empty();
        self.operands.push(Operand { first_index: self.materials.len() as u32, is_subtracted, geometry });
        let geometry = &self.operands[self.operands.len() - 1].geometry;
        self.materials.extend(geometry.materials().iter().map(|operand_index| operand_index.or(own)));
        Ok(())
    }

    fn find_bounds(&self) -> Aabb {
        let mut boxes = self.operands.iter().map(|operand| operand.geometry.bounds());
        let first = boxes.next().unwrap_or(Aabb::EMPTY);
        let local = match self.operation {
            Operation::Union => boxes.fold(first, Aabb::union),
            Operation::Intersection => boxes.fold(first, Aabb::intersection),
            Operation::Difference => first,
        };
        match &self.transform {
            Some(affine) if !local.is_empty() => local.transformed(&affine.to_world),
            _ => local,
        }
    }

    /// The ray in the space of the operands.
    fn local(&self, ray: &Ray) -> Ray {
        self.transform.as_ref().map_or(*ray, |affine| affine.ray(ray))
    }

    /// The operand of this csg that contains the operand with this index.
    fn operand_of(&self, operand_index: u32) -> &Operand {
        let after = self.operands.partition_point(|operand| operand.first_index <= operand_index);
        &self.operands[after - 1]
    }
}

impl Operand {
    #[inline(always)]
    fn span(&self, line: &Line) -> Option<Span> {
        let span = self.geometry.span(line);
        span.map(|span| span.map(|crossing| Crossing { operand_index: self.first_index, ..crossing }))
    }

    fn cross(&self, line: &Line) -> Crossings {
        let mut crossings = self.geometry.cross(line);
        if self.first_index > 0 {
            crossings.iter_mut().for_each(|crossing| crossing.operand_index += self.first_index);
        }
        crossings
    }
}

impl Csg {
    /// Visits the crossings of a line in order, until `visit` returns true.
    #[inline(always)]
    fn visit(&self, line: &Line, visit: impl FnMut(Crossing) -> bool) {
        match &self.transform {
            Some(affine) => self.visit_local(&line.within(affine.ray(&line.ray)), visit),
            None => self.visit_local(line, visit),
        }
    }

    #[inline(always)]
    fn visit_local(&self, line: &Line, mut visit: impl FnMut(Crossing) -> bool) {
        let needs_first = self.operation != Operation::Union;
        if self.is_convex_pair {
            let first = self.operands[0].span(line);
            if first.is_none() && needs_first {
                return;
            }
            combine_spans(self.operation, first, self.operands[1].span(line), line, visit);
            return;
        }
        let mut found = self.operands[0].cross(line);
        let Some((last, others)) = self.operands[1..].split_last() else {
            found.into_iter().any(visit);
            return;
        };
        for operand in others {
            if found.is_empty() && needs_first {
                return;
            }
            let mut next = Crossings::new();
            combine(self.operation, &found, &operand.cross(line), line, |crossing| {
                next.push(crossing);
                false
            });
            found = next;
        }
        if found.is_empty() && needs_first {
            return;
        }
        combine(self.operation, &found, &last.cross(line), line, &mut visit);
    }
}

impl ShapeModel for Csg {
    fn bounds(&self) -> Aabb {
        self.bounds
    }

    #[inline(never)]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut first = None;
        self.visit(&Line::new(ray), |crossing| {
            if ray.contains(crossing.t) {
                first = Some(Hit::from(crossing));
            }
            first.is_some() || crossing.t >= ray.t_max
        });
        first
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let operand = self.operand_of(hit.operand_index);
        let own = Hit { operand_index: hit.operand_index - operand.first_index, ..*hit };
        let surface = operand.geometry.solid_surface(&self.local(ray), &own);
        let surface = if operand.is_subtracted { surface.flipped() } else { surface };
        let surface = Surface { operand_index: hit.operand_index, ..surface };
        let Some(affine) = &self.transform else { return surface };
        let shading = Frame::from_normal(affine.normal(surface.shading.n));
        Surface { p: affine.point(surface.p), n: affine.normal(surface.n), shading, ..surface }
    }

    fn not_an_emitter_because(&self) -> Option<&'static str> {
        Some("make a copy of one of its operands an area light instead")
    }

    fn materials(&self) -> &[Option<ObjectId>] {
        &self.materials
    }
}

impl SolidModel for Csg {
    fn check_solid(&self) -> Result<(), String> {
        Ok(())
    }

    fn cross(&self, line: &Line) -> Crossings {
        let mut crossings = Crossings::new();
        self.visit(line, |crossing| {
            crossings.push(crossing);
            false
        });
        crossings
    }
}
