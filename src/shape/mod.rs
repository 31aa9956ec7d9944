//! Shapes: the surfaces that rays meet and area lights emit from.
//!
//! All results are in world space. A shape is an affine image of a canonical form (the unit sphere, the unit square, ...), so
//! that every affine `to_world` is exact: a scaled sphere is an ellipsoid with the right normals.

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

/// A point where a ray meets a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The ray's parameter.
    pub t: f64,
    /// The number of the face of a cube or of the triangle of a mesh, from 0; else 0.
    pub primitive: u32,
    /// The number of the operand of a csg, counting all solids in it that are not csgs themselves; else 0.
    pub operand_index: u32,
    /// The barycentric coordinates of the second and third corner of a triangle; unused for other shapes.
    pub coordinates: DVec2,
}

impl Hit {
    /// A hit with a shape that is not a csg.
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
    /// The unit normal of the geometric surface.
    pub n: DVec3,
    /// The frame that BSDFs work in; its normal is interpolated on smooth meshes, else it is `n`.
    pub shading: Frame,
    /// Texture coordinates.
    pub uv: DVec2,
    /// The number of the face of a cube or of the triangle of a mesh.
    pub primitive: u32,
    /// The number of the operand of a csg.
    pub operand_index: u32,
}

impl Surface {
    /// A point where the shading normal is the geometric one.
    #[must_use]
    pub fn flat(p: DVec3, n: DVec3, uv: DVec2, primitive: u32) -> Self {
        Self { p, n, shading: Frame::from_normal(n), uv, primitive, operand_index: 0 }
    }

    /// The same point with its normals reversed.
    #[must_use]
    pub fn flipped(self) -> Self {
        Self { n: -self.n, shading: Frame::from_normal(-self.shading.n), ..self }
    }
}

/// A sampled point of a surface, with its density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeSample<Density> {
    /// The position.
    pub p: DVec3,
    /// The unit normal.
    pub n: DVec3,
    /// Texture coordinates.
    pub uv: DVec2,
    /// The density with which the point was sampled.
    pub pdf: Density,
}

/// The interface of all shapes. The direction of a ray may have any length but 0.
#[enum_dispatch]
pub trait ShapeModel {
    /// A box around the shape, in world space.
    fn bounds(&self) -> Aabb;

    /// The first hit with `t_min < t < t_max`.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// The bounding volume hierarchy of a shape of many parts, whose blocks can be intersected one by one.
    fn hierarchy(&self) -> Option<&Bvh> {
        None
    }

    /// The first hit with a block of the hierarchy; for a shape without one, with the whole shape. `shear` caches the ray's shear
    /// for triangles.
    #[inline]
    fn intersect_block(&self, _block: u32, ray: &Ray, _shear: &mut Option<Shear>) -> Option<Hit> {
        self.intersect(ray)
    }

    /// The surface at a hit of this ray.
    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface;

    /// The reason why it cannot be an area light, if it cannot. Its surface is then not sampled.
    fn not_an_emitter_because(&self) -> Option<&'static str> {
        None
    }

    /// Samples a point of the surface of a shape that can be an area light.
    fn sample_position(&self, _u: DVec2) -> ShapeSample<PerArea> {
        unreachable!("no point is drawn from a shape that cannot shine")
    }

    /// The density with which [`ShapeModel::sample_position`] samples a point.
    fn pdf_position(&self, _surface: &Surface) -> PerArea {
        unreachable!("no point is drawn from a shape that cannot shine")
    }

    /// Samples a point to light `from` from, with its density per solid angle there; None if the surface is seen edge-on.
    fn sample_direction(&self, from: DVec3, u: DVec2) -> Option<ShapeSample<PerSolidAngle>> {
        let drawn = self.sample_position(u);
        let pdf = as_seen(drawn.pdf, from, drawn.p, drawn.n)?;
        Some(ShapeSample { p: drawn.p, n: drawn.n, uv: drawn.uv, pdf })
    }

    /// The density with which [`ShapeModel::sample_direction`] draws a point.
    fn pdf_direction(&self, from: DVec3, surface: &Surface) -> PerSolidAngle {
        as_seen(self.pdf_position(surface), from, surface.p, surface.n).unwrap_or(PerSolidAngle(0.0))
    }

    /// The material of each operand of a csg, or of the whole shape; None where it has none of its own.
    fn materials(&self) -> &[Option<ObjectId>] {
        &[None]
    }

    /// For a mesh, the distance in m from a point of its surface to the nearest edge of its triangle.
    fn edge_distance(&self, _surface: &Surface) -> Option<f64> {
        None
    }

    /// Whether its surface consists of numbered parallelograms.
    fn is_polyhedron(&self) -> bool {
        false
    }

    /// The corners, in order, of the parallelogram around a point of a surface that consists of such.
    fn polygon(&self, _surface: &Surface) -> Option<[DVec3; 4]> {
        None
    }

    /// The open edges of a mesh that does not enclose a solid.
    fn open_edges(&self) -> Option<OpenEdges> {
        None
    }

    /// Whether its normals point inwards by default.
    fn is_inside_out(&self) -> bool {
        false
    }

    /// The number of triangles without area that were left out when it was read.
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

catalogue! {
    /// The geometry of a shape, without material and emitter.
    pub enum Geometry: ShapeModel + SolidModel in Category::Shape, {
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
        /// Triangles from arrays.
        Mesh(mesh::Mesh<mesh::Arrays>),
        /// Union, intersection and difference.
        Csg(Csg),
    }
}

/// Parameters that every shape has.
const TO_WORLD: Param =
    Param::optional("to_world", ParamKind::Transform, "the identity", "from the shape's space to the world's");
const FLIP_NORMALS: Param =
    Param::new("flip_normals", ParamKind::Boolean, "false", "whether its normals point the other way");

/// A geometry, and the direction of its normals.
#[derive(Clone, Debug)]
pub struct Shape {
    geometry: Geometry,
    flipped: bool,
}

impl Shape {
    /// Reads the parameters of a shape. The caller reads the bsdf and the emitter in it.
    ///
    /// # Errors
    /// If a parameter is wrong or its file cannot be read.
    pub fn read_from(params: &Params<'_>) -> Result<Self, SceneError> {
        let geometry = Geometry::read_from(params)?;
        let flipped = params.boolean(FLIP_NORMALS.name)? ^ geometry.is_inside_out();
        Ok(Self { geometry, flipped })
    }

    /// The view of a shape object.
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
