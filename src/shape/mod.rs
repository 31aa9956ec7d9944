//! Surfaces that rays meet and lights shine from.
//!
//! A shape answers in world space. Its own frame is an affine image of a canonical form (the unit sphere, the unit
//! square, ...), so that every affine `to_world` is exact: a squeezed sphere is an ellipsoid, with the right normals.

mod affine;
pub mod bvh;
mod cube;
mod csg;
mod disk;
pub mod laws;
pub mod mesh;
mod plane;
pub mod quadric;
mod rectangle;
mod shapes;
mod solid;
mod sphere;

pub use csg::Csg;
pub use cube::Cube;
pub use disk::Disk;
pub use plane::Plane;
pub use rectangle::Rectangle;
pub use shapes::Shapes;
pub use solid::{Crossing, Crossings, Line, Operation, Span};
pub use sphere::{Ellipsoid, EllipsoidShape, Sphere};

use bvh::Bvh;
use enum_dispatch::enum_dispatch;
use glam::{DVec2, DVec3};
use mesh::{OpenEdges, Shear};

use crate::{
    math::{Aabb, Frame, PerArea, PerSolidAngle, Ray},
    scene_file::{Category, Document, ObjectId, Param, ParamKind, Params, SceneError, catalogue},
};

/// Where a ray meets a shape, in the shape's own terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The ray's parameter.
    pub t: f64,
    /// Which face of a cube or triangle of a mesh.
    pub primitive: u32,
    /// Which operand of a csg, counting all solids in it that are none themselves.
    pub operand_index: u32,
    /// Coordinates on the primitive: barycentric of the second and third corner for triangles, else unused.
    pub coordinates: DVec2,
}

impl Hit {
    /// A hit with a shape that is no csg.
    #[must_use]
    pub fn new(t: f64, primitive: u32, coordinates: DVec2) -> Self {
        Self { t, primitive, operand_index: 0, coordinates }
    }
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The position.
    pub p: DVec3,
    /// The unit normal of the true surface.
    pub n: DVec3,
    /// The frame that BSDFs work in; its normal is interpolated on smooth meshes, else it is `n`.
    pub shading: Frame,
    /// Texture coordinates.
    pub uv: DVec2,
    /// Which face of a cube or triangle of a mesh.
    pub primitive: u32,
    /// Which operand of a csg.
    pub operand_index: u32,
}

impl Surface {
    /// A point where the shading normal is the true one.
    #[must_use]
    pub fn flat(p: DVec3, n: DVec3, uv: DVec2, primitive: u32) -> Self {
        Self { p, n, shading: Frame::from_normal(n), uv, primitive, operand_index: 0 }
    }

    /// The same point of the other side's surface.
    #[must_use]
    pub fn flipped(self) -> Self {
        Self { n: -self.n, shading: Frame::from_normal(-self.shading.n), ..self }
    }
}

/// A point of a surface that was drawn at random, with its density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeSample<Density> {
    /// The position.
    pub p: DVec3,
    /// The unit normal.
    pub n: DVec3,
    /// Texture coordinates.
    pub uv: DVec2,
    /// How densely such points are drawn.
    pub pdf: Density,
}

/// What a shape answers. A ray's direction need not have unit length.
#[enum_dispatch]
pub trait ShapeModel {
    /// A box around all of it.
    fn bounds(&self) -> Aabb;

    /// The first hit with `t_min < t < t_max`.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// The hierarchy of a shape of many parts: what is in one of its blocks can be hit alone.
    fn hierarchy(&self) -> Option<&Bvh> {
        None
    }

    /// The first hit with what is in a block of the hierarchy; without one, with the whole shape. `shear` is that of
    /// the ray, once something needs it.
    #[inline]
    fn intersect_block(&self, _block: u32, ray: &Ray, _shear: &mut Option<Shear>) -> Option<Hit> {
        self.intersect(ray)
    }

    /// The surface at a hit of this ray.
    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface;

    /// Why it cannot be a light, if it cannot: no points are drawn from its surface then.
    fn not_an_emitter_because(&self) -> Option<&'static str> {
        None
    }

    /// Draws a point from all of the surface of a shape that can shine.
    fn sample_position(&self, _u: DVec2) -> ShapeSample<PerArea> {
        unreachable!("no point is drawn from a shape that cannot shine")
    }

    /// The density with which [`ShapeModel::sample_position`] draws a point.
    fn pdf_position(&self, _surface: &Surface) -> PerArea {
        unreachable!("no point is drawn from a shape that cannot shine")
    }

    /// Draws a point to be lit from, as seen from `from`; None where the drawn point is seen edge-on.
    fn sample_direction(&self, from: DVec3, u: DVec2) -> Option<ShapeSample<PerSolidAngle>> {
        let drawn = self.sample_position(u);
        let pdf = as_seen(drawn.pdf, from, drawn.p, drawn.n)?;
        Some(ShapeSample { p: drawn.p, n: drawn.n, uv: drawn.uv, pdf })
    }

    /// The density with which [`ShapeModel::sample_direction`] draws a point.
    fn pdf_direction(&self, from: DVec3, surface: &Surface) -> PerSolidAngle {
        as_seen(self.pdf_position(surface), from, surface.p, surface.n).unwrap_or(PerSolidAngle(0.0))
    }

    /// The materials of its leaves as far as they have their own: more than one in a csg.
    fn materials(&self) -> &[Option<ObjectId>] {
        &[None]
    }

    /// Of a mesh, the distance in the world from a point of its surface to the nearest edge of its triangle.
    fn edge_distance(&self, _surface: &Surface) -> Option<f64> {
        None
    }

    /// Whether its surface is made of parallelograms, which have a number each.
    fn is_polyhedron(&self) -> bool {
        false
    }

    /// The flat piece of surface around a point, all of it, if it is a parallelogram: its corners, in order.
    fn polygon(&self, _surface: &Surface) -> Option<[DVec3; 4]> {
        None
    }

    /// Of a mesh that does not enclose a solid, which edges lie open.
    fn open_edges(&self) -> Option<OpenEdges> {
        None
    }

    /// Whether its normals point inwards without being told to.
    fn is_inside_out(&self) -> bool {
        false
    }

    /// How many parts without area were left out when it was read.
    fn dropped(&self) -> usize {
        0
    }
}

/// What an operand of a csg answers about the solid that it encloses.
#[enum_dispatch]
pub trait SolidModel: ShapeModel {
    /// Makes sure that it can be an operand of a csg.
    ///
    /// # Errors
    /// Why it encloses nothing.
    fn check_solid(&self) -> Result<(), String> {
        Err("it is a surface that encloses nothing".into())
    }

    /// Whether the solid that it encloses is convex, ends closed.
    fn is_convex(&self) -> bool {
        false
    }

    /// Where a line enters and leaves the solid, if it is convex.
    fn span(&self, _line: &Line) -> Option<Span> {
        unreachable!("only convex solids answer with a single span")
    }

    /// Where a line enters and leaves the solid that it encloses.
    fn cross(&self, line: &Line) -> Crossings {
        self.span(line).into_iter().flatten().collect()
    }

    /// The surface at a crossing, with a normal that points out of the solid.
    fn solid_surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        self.surface(ray, hit)
    }
}

fn as_seen(pdf: PerArea, from: DVec3, p: DVec3, n: DVec3) -> Option<PerSolidAngle> {
    let way = p - from;
    let distance_squared = way.length_squared();
    pdf.to_solid_angle(n.dot(way) / distance_squared.sqrt(), distance_squared)
}

catalogue! { ($)
    /// A shape without its material: the form alone.
    pub enum Geometry: ShapeModel + SolidModel in Category::Shape, each_geometry {
        /// A sphere or an ellipsoid.
        Sphere(EllipsoidShape<Sphere>),
        /// An ellipsoid.
        Ellipsoid(EllipsoidShape<Ellipsoid>),
        /// A parallelogram.
        Rectangle(Rectangle),
        /// A parallelepiped.
        Cube(Cube),
        /// A disc or an ellipse.
        Disk(Disk),
        /// An infinite plane.
        Plane(Plane),
        /// An open cylinder.
        Cylinder(quadric::Clipped<quadric::Cylinder>),
        /// An open cone.
        Cone(quadric::Clipped<quadric::Cone>),
        /// An open paraboloid.
        Paraboloid(quadric::Clipped<quadric::Paraboloid>),
        /// An open hyperboloid of one sheet or two.
        Hyperboloid(quadric::Clipped<quadric::Hyperboloid>),
        /// Any quadric in a box.
        Quadric(quadric::Clipped<quadric::General>),
        /// One triangle.
        Triangle(mesh::Mesh<mesh::Triangle>),
        /// Triangles from a PLY file.
        Ply(mesh::Mesh<mesh::Ply>),
        /// Triangles from an OBJ file.
        Obj(mesh::Mesh<mesh::Obj>),
        /// Triangles from a kcply file.
        Kcply(mesh::Mesh<mesh::Kcply>),
        /// Union, intersection and difference.
        Csg(Csg),
    }
}

/// Answers of the traits that are asked for all along a ray: by these names they are inlined, kind by kind.
impl Geometry {
    #[inline(always)]
    fn intersect_block(&self, block: u32, ray: &Ray, shear: &mut Option<Shear>) -> Option<Hit> {
        each_geometry!(self, geometry => geometry.intersect_block(block, ray, shear))
    }

    #[inline(always)]
    fn span(&self, line: &Line) -> Option<Span> {
        each_geometry!(self, geometry => geometry.span(line))
    }
}

/// Parameters that every shape has.
const TO_WORLD: Param =
    Param::optional("to_world", ParamKind::Transform, "the identity", "from the shape's space to the world's");
const FLIP_NORMALS: Param =
    Param::new("flip_normals", ParamKind::Boolean, "false", "whether its normals point the other way");

/// A form and which way its normals point.
#[derive(Clone, Debug)]
pub struct Shape {
    geometry: Geometry,
    flipped: bool,
}

impl Shape {
    /// Reads a shape element's own parameters; its bsdf and its emitter are the caller's.
    ///
    /// # Errors
    /// If a parameter is wrong or its file cannot be read.
    pub fn read_from(params: &Params<'_>) -> Result<Self, SceneError> {
        let geometry = Geometry::read_from(params)?;
        let flipped = params.boolean(FLIP_NORMALS.name)? ^ geometry.is_inside_out();
        Ok(Self { geometry, flipped })
    }

    /// The view of a shape element.
    ///
    /// # Errors
    /// If no shape has its name.
    pub fn params(document: &Document, id: ObjectId) -> Result<Params<'_>, SceneError> {
        Geometry::params(document, id)
    }

    fn outward(&self, n: DVec3) -> DVec3 {
        if self.flipped { -n } else { n }
    }
}

/// Turns normals around if it is flipped, and else answers as its geometry does. Every method is written out, so that a new
/// one is not answered by its default.
#[deny(clippy::missing_trait_methods)]
impl ShapeModel for Shape {
    fn bounds(&self) -> Aabb {
        self.geometry.bounds()
    }

    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.geometry.intersect(ray)
    }

    fn hierarchy(&self) -> Option<&Bvh> {
        self.geometry.hierarchy()
    }

    #[inline(always)]
    fn intersect_block(&self, block: u32, ray: &Ray, shear: &mut Option<Shear>) -> Option<Hit> {
        self.geometry.intersect_block(block, ray, shear)
    }

    #[inline]
    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let surface = self.geometry.surface(ray, hit);
        if self.flipped { surface.flipped() } else { surface }
    }

    fn not_an_emitter_because(&self) -> Option<&'static str> {
        self.geometry.not_an_emitter_because()
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let drawn = self.geometry.sample_position(u);
        ShapeSample { n: self.outward(drawn.n), ..drawn }
    }

    fn pdf_position(&self, surface: &Surface) -> PerArea {
        self.geometry.pdf_position(surface)
    }

    #[inline]
    fn sample_direction(&self, from: DVec3, u: DVec2) -> Option<ShapeSample<PerSolidAngle>> {
        let drawn = self.geometry.sample_direction(from, u)?;
        Some(ShapeSample { n: self.outward(drawn.n), ..drawn })
    }

    #[inline]
    fn pdf_direction(&self, from: DVec3, surface: &Surface) -> PerSolidAngle {
        self.geometry.pdf_direction(from, surface)
    }

    fn materials(&self) -> &[Option<ObjectId>] {
        self.geometry.materials()
    }

    fn edge_distance(&self, surface: &Surface) -> Option<f64> {
        self.geometry.edge_distance(surface)
    }

    #[inline]
    fn is_polyhedron(&self) -> bool {
        self.geometry.is_polyhedron()
    }

    fn polygon(&self, surface: &Surface) -> Option<[DVec3; 4]> {
        self.geometry.polygon(surface)
    }

    fn open_edges(&self) -> Option<OpenEdges> {
        self.geometry.open_edges()
    }

    fn is_inside_out(&self) -> bool {
        self.geometry.is_inside_out()
    }

    fn dropped(&self) -> usize {
        self.geometry.dropped()
    }
}
