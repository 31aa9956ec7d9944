//! Shapes: the surfaces that rays intersect and that area lights emit from.
//!
//! The methods of a shape take and return world space. A shape is an affine image of a canonical geometry (the unit
//! sphere, the unit square, ...), so that every affine `to_world` is exact: a scaled sphere is an ellipsoid with exact
//! normals.

mod affine;
pub mod bvh;
mod csg;
mod cube;
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

/// The intersection of a ray with a shape, as the shape identifies it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The ray's parameter.
    pub t: f64,
    /// The index of the face of a cube or of the triangle of a mesh.
    pub primitive: u32,
    /// The index of the operand of a csg. All operands of nested csgs are counted, except the csgs themselves.
    pub operand_index: u32,
    /// Coordinates on the primitive: for triangles the barycentric coordinates of the second and third corner, for
    /// rectangles and disks the local x and y, else unused.
    pub coordinates: DVec2,
}

impl Hit {
    /// A hit with a shape that is not a csg.
    #[must_use]
    pub fn new(t: f64, primitive: u32, coordinates: DVec2) -> Self {
        Self { t, primitive, operand_index: 0, coordinates }
    }
}

/// A point of a surface, with its normals and texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The position.
    pub p: DVec3,
    /// The unit geometric normal.
    pub n: DVec3,
    /// The shading frame, in which BSDFs are evaluated. Its normal is interpolated on smooth meshes, else it is `n`.
    pub shading: Frame,
    /// The texture coordinates.
    pub uv: DVec2,
    /// The index of the face or triangle, as in [`Hit`].
    pub primitive: u32,
    /// The index of the operand of a csg, as in [`Hit`].
    pub operand_index: u32,
}

impl Surface {
    /// A point whose shading normal is the geometric normal.
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

/// A sampled point of a surface, with its pdf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeSample<Density> {
    /// The position.
    pub p: DVec3,
    /// The unit normal.
    pub n: DVec3,
    /// The texture coordinates.
    pub uv: DVec2,
    /// The pdf of the point, per area or per solid angle.
    pub pdf: Density,
}

/// The interface of shapes. Directions of rays need not have unit length.
#[enum_dispatch]
pub trait ShapeModel {
    /// A bounding box of the shape.
    fn bounds(&self) -> Aabb;

    /// The first hit with `t_min < t < t_max`.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// The shape's own hierarchy, if it has one. Its blocks can be intersected one by one.
    fn hierarchy(&self) -> Option<&Bvh> {
        None
    }

    /// The first hit with the primitives of a block of the hierarchy, or with the whole shape if it has no hierarchy.
    /// `shear` caches the shear of the ray; the first mesh that needs it computes it.
    #[inline]
    fn intersect_block(&self, _block: u32, ray: &Ray, _shear: &mut Option<Shear>) -> Option<Hit> {
        self.intersect(ray)
    }

    /// The surface point at a hit of this ray.
    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface;

    /// The reason why the shape cannot be an area light, or `None` if it can. Points are sampled only from shapes that
    /// can.
    fn not_an_emitter_because(&self) -> Option<&'static str> {
        None
    }

    /// Samples a point on the whole surface of a shape that can be an area light.
    fn sample_position(&self, _u: DVec2) -> ShapeSample<PerArea> {
        unreachable!("only shapes that can be area lights are sampled")
    }

    /// The pdf with which [`ShapeModel::sample_position`] samples this surface point.
    fn pdf_position(&self, _surface: &Surface) -> PerArea {
        unreachable!("only shapes that can be area lights are sampled")
    }

    /// Samples a point of the surface for the illumination of the point `from`. `None` if the surface at the sampled
    /// point is edge-on from there.
    fn sample_direction(&self, from: DVec3, u: DVec2) -> Option<ShapeSample<PerSolidAngle>> {
        let sample = self.sample_position(u);
        let pdf = to_solid_angle(sample.pdf, from, sample.p, sample.n)?;
        Some(ShapeSample { p: sample.p, n: sample.n, uv: sample.uv, pdf })
    }

    /// The pdf with which [`ShapeModel::sample_direction`] samples this surface point from `from`.
    fn pdf_direction(&self, from: DVec3, surface: &Surface) -> PerSolidAngle {
        to_solid_angle(self.pdf_position(surface), from, surface.p, surface.n).unwrap_or(PerSolidAngle(0.0))
    }

    /// The BSDF of each operand of a csg, by operand index; `None` for an operand without a BSDF of its own. Other
    /// shapes have the single entry `None`.
    fn materials(&self) -> &[Option<ObjectId>] {
        &[None]
    }

    /// The world distance from a surface point of a mesh to the nearest edge of its triangle. `None` for other shapes.
    fn edge_distance(&self, _surface: &Surface) -> Option<f64> {
        None
    }

    /// Whether the surface consists of parallelograms, each of which is a primitive.
    fn is_polyhedron(&self) -> bool {
        false
    }

    /// The corners, in order, of the parallelogram that contains a surface point. `None` if the surface is not made of
    /// parallelograms.
    fn polygon(&self, _surface: &Surface) -> Option<[DVec3; 4]> {
        None
    }

    /// The open edges of a mesh that does not enclose a solid, unless the mesh may be open.
    fn open_edges(&self) -> Option<OpenEdges> {
        None
    }

    /// Whether the normals point inwards although `flip_normals` is false.
    fn is_inside_out(&self) -> bool {
        false
    }

    /// The number of triangles of zero area that were left out when the shape was read.
    fn dropped(&self) -> usize {
        0
    }
}

/// The interface of the operands of a csg: the solid that a shape encloses.
#[enum_dispatch]
pub trait SolidModel: ShapeModel {
    /// Checks that the shape can be an operand of a csg.
    ///
    /// # Errors
    /// The reason why the shape does not enclose a solid.
    fn check_solid(&self) -> Result<(), String> {
        Err("it is an open surface".into())
    }

    /// Whether the solid is convex and implements [`SolidModel::span`].
    fn is_convex(&self) -> bool {
        false
    }

    /// The span of a line in a convex solid.
    fn span(&self, _line: &Line) -> Option<Span> {
        unreachable!("only convex solids have a single span")
    }

    /// The crossings of a line with the boundary of the solid.
    fn cross(&self, line: &Line) -> Crossings {
        self.span(line).into_iter().flatten().collect()
    }

    /// The surface point at a crossing, with a normal that points out of the solid.
    fn solid_surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        self.surface(ray, hit)
    }
}

/// The density per solid angle at `from` of a density per area at the surface point `p` with unit normal `n`.
fn to_solid_angle(pdf: PerArea, from: DVec3, p: DVec3, n: DVec3) -> Option<PerSolidAngle> {
    let offset = p - from;
    let distance_squared = offset.length_squared();
    pdf.to_solid_angle(n.dot(offset) / distance_squared.sqrt(), distance_squared)
}

catalogue! { ($)
    /// The geometry of a shape, without its BSDF and its `flip_normals`.
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
        /// The part of any quadric in a box.
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
        /// A union, intersection or difference of solids.
        Csg(Csg),
    }
}

/// Methods that are called for every ray. They are inherent methods here, so that the compiler inlines them for each
/// kind of shape.
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

// The parameters that every shape has.
const TO_WORLD: Param =
    Param::optional("to_world", ParamKind::Transform, "the identity", "transform from shape space to world space");
const FLAT: Param = Param::ignored("face_normals", ParamKind::Boolean, "the faces are flat anyway");
const FLIP_NORMALS: Param = Param::new("flip_normals", ParamKind::Boolean, "false", "whether to reverse the normals");

/// A geometry and the orientation of its normals.
#[derive(Clone, Debug)]
pub struct Shape {
    geometry: Geometry,
    flipped: bool,
}

impl Shape {
    /// Reads the parameters of a shape element. The caller reads its BSDF and its emitter.
    ///
    /// # Errors
    /// A parameter is wrong, or a file cannot be read.
    pub fn read_from(params: &Params<'_>) -> Result<Self, SceneError> {
        let geometry = Geometry::read_from(params)?;
        let flipped = params.boolean(FLIP_NORMALS.name)? ^ geometry.is_inside_out();
        Ok(Self { geometry, flipped })
    }

    /// The parameters of a shape element.
    ///
    /// # Errors
    /// The object is not a shape, or no shape plugin has its name.
    pub fn params(document: &Document, id: ObjectId) -> Result<Params<'_>, SceneError> {
        Geometry::params(document, id)
    }

    fn outward(&self, n: DVec3) -> DVec3 {
        if self.flipped { -n } else { n }
    }
}

/// Forwards to the geometry and reverses its normals if `flipped`. Every method is written out, because the default of
/// a new method would be wrong.
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
        let sample = self.geometry.sample_position(u);
        ShapeSample { n: self.outward(sample.n), ..sample }
    }

    fn pdf_position(&self, surface: &Surface) -> PerArea {
        self.geometry.pdf_position(surface)
    }

    #[inline]
    fn sample_direction(&self, from: DVec3, u: DVec2) -> Option<ShapeSample<PerSolidAngle>> {
        let sample = self.geometry.sample_direction(from, u)?;
        Some(ShapeSample { n: self.outward(sample.n), ..sample })
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
