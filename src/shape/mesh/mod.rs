//! Triangle meshes, from files and from arrays.

mod data;
mod kcply;
pub mod laws;
mod normals;
mod obj;
mod ply;
mod solid;
mod triangles;

pub use data::{MeshData, MeshError, MeshFault};
pub use kcply::{IndexBase, read_kcply};
pub use obj::read_obj;
pub use ply::read_ply;
pub use solid::OpenEdges;
pub use triangles::{Shear, TriangleHit, Triangles};

use std::marker::PhantomData;

use glam::{DAffine3, DVec2, DVec3};

use super::{Crossings, Hit, Line, ShapeModel, ShapeSample, SolidModel, Surface, bvh::Bvh};
use crate::{
    math::{Aabb, Distribution1D, Draw, Frame, PerArea, Ray, warp},
    scene_file::{Category, Described, MeshArrays, Param, ParamKind, Params, Plugin, SceneError},
};

/// A way to give triangles in a scene.
pub trait Format: Clone + std::fmt::Debug {
    /// The manual page of its plugin.
    const PLUGIN: Plugin;

    /// The triangles, in the shape's space.
    ///
    /// # Errors
    /// If a file cannot be read or is not a valid mesh.
    fn load(params: &Params<'_>) -> Result<MeshData, SceneError>;
}

/// The Stanford polygon format.
#[derive(Clone, Debug)]
pub struct Ply;

/// The Wavefront format.
#[derive(Clone, Debug)]
pub struct Obj;

/// A text of triangles.
#[derive(Clone, Debug)]
pub struct Kcply;

/// A mesh from arrays, see [`MeshArrays`]. Only a scene that is built in code can hold one: an XML file names a `ply`, `obj` or
/// `kcply` file instead, which gives the same shape for the same vertices and triangles.
#[derive(Clone, Debug)]
pub struct Arrays;

/// A single triangle. Its corners are rounded to single precision, as those of all meshes.
#[derive(Clone, Debug)]
pub struct Triangle;

const FILENAME: Param = Param::required("filename", ParamKind::File, "the file, relative to the scene's");
const FACE_NORMALS: Param = Param::new(
    "face_normals",
    ParamKind::Boolean,
    "false",
    "whether triangles look flat, whatever normals the file has",
);
const ALLOW_OPEN: Param = Param::new(
    "allow_open",
    ParamKind::Boolean,
    "false",
    "whether glass on it may have an edge, as the surface of a lake has",
);

/// The triangles of a file that a function reads.
fn from_file(
    params: &Params<'_>,
    read: impl FnOnce(&std::path::Path) -> Result<MeshData, MeshError>,
) -> Result<MeshData, SceneError> {
    read(&params.file(FILENAME.name)?).map_err(|error| params.error(FILENAME.name, error.to_string()))
}

impl Format for Ply {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        name: "ply",
        summary: "A mesh from a PLY file: ascii or binary, with normals and texture coordinates if it has them.",
        params: &[
            FILENAME,
            FACE_NORMALS,
            Param::new("flip_tex_coords", ParamKind::Boolean, "false", "whether v counts from the other end"),
            ALLOW_OPEN,
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[],
        evidence: &["mesh/round-trip", "mesh/shading-normals", "shape/*", "reference/mesh-lamp"],
    };

    fn load(params: &Params<'_>) -> Result<MeshData, SceneError> {
        let flip_tex_coords = params.boolean("flip_tex_coords")?;
        from_file(params, |path| read_ply(path, flip_tex_coords))
    }
}

impl Format for Obj {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        name: "obj",
        summary: "A mesh from a Wavefront OBJ file.",
        params: &[
            FILENAME,
            FACE_NORMALS,
            Param::new("flip_tex_coords", ParamKind::Boolean, "true", "whether v counts from the other end"),
            ALLOW_OPEN,
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[],
        evidence: &["mesh/round-trip", "mesh/shading-normals", "shape/*", "reference/faceted-and-smooth"],
    };

    fn load(params: &Params<'_>) -> Result<MeshData, SceneError> {
        let flip_tex_coords = params.boolean("flip_tex_coords")?;
        from_file(params, |path| read_obj(path, flip_tex_coords))
    }
}

impl Format for Kcply {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        name: "kcply",
        summary: "A mesh from a kcply file: a text of vertices and triangles.",
        params: &[
            FILENAME,
            Param::new("index_base", ParamKind::Choice(&["auto", "0", "1"]), "auto", "the number of the first vertex"),
            FACE_NORMALS,
            ALLOW_OPEN,
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[],
        evidence: &["mesh/round-trip", "mesh/shading-normals", "shape/*", "reference/figure-1-teapots"],
    };

    fn load(params: &Params<'_>) -> Result<MeshData, SceneError> {
        let base = match params.string("index_base")? {
            "0" => IndexBase::Zero,
            "1" => IndexBase::One,
            _ => IndexBase::Auto,
        };
        from_file(params, |path| read_kcply(path, base))
    }
}

impl Format for Arrays {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        name: "mesh",
        summary: "A mesh from arrays, in a scene that is built in code; a scene file names a ply, obj or kcply file instead.",
        params: &[
            Param::required("arrays", ParamKind::Mesh, "vertices and triangles, which only code can give"),
            FACE_NORMALS,
            ALLOW_OPEN,
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[],
        evidence: &["mesh/shading-normals", "shape/*"],
    };

    fn load(params: &Params<'_>) -> Result<MeshData, SceneError> {
        let MeshArrays { positions, triangles, normals, uvs } = params.mesh("arrays")?.as_ref().clone();
        let data = MeshData::new(positions, normals, uvs, triangles);
        data.map_err(|fault| params.error("arrays", fault.to_string()))
    }
}

impl Format for Triangle {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        name: "triangle",
        summary: "One triangle, its front where its corners go anticlockwise; smooth if it has normals.",
        params: &[
            Param::required("p0", ParamKind::Point, "the first corner"),
            Param::required("p1", ParamKind::Point, "the second corner"),
            Param::required("p2", ParamKind::Point, "the third corner"),
            Param::optional("n0", ParamKind::Point, "that of the triangle", "the normal at the first corner"),
            Param::optional("n1", ParamKind::Point, "that of the triangle", "the normal at the second corner"),
            Param::optional("n2", ParamKind::Point, "that of the triangle", "the normal at the third corner"),
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="triangle"><point name="p0" x="0" y="0" z="0"/><point name="p1" x="2" y="0" z="0.5"/>
                <point name="p2" x="0.5" y="1.5" z="0"/></shape>"#,
            r#"<shape type="triangle"><point name="p0" x="-1" y="0" z="0"/><point name="p1" x="1" y="0" z="0.5"/>
                <point name="p2" x="0" y="1.5" z="0"/><vector name="n0" x="-1" y="-1" z="2"/><vector name="n1" x="1" y="-1" z="2"/>
                <vector name="n2" x="0" y="1" z="3"/><transform name="to_world"><scale x="1" y="2" z="0.5"/></transform></shape>"#,
        ],
        evidence: &["mesh/shading-normals", "shape/*", "reference/quadrics"],
    };

    fn load(params: &Params<'_>) -> Result<MeshData, SceneError> {
        let corners = [params.point("p0")?, params.point("p1")?, params.point("p2")?];
        let given = [params.optional_point("n0")?, params.optional_point("n1")?, params.optional_point("n2")?];
        let normals = match given {
            [None, None, None] => None,
            [Some(a), Some(b), Some(c)] => Some([a, b, c].map(narrow).to_vec()),
            _ => return Err(params.error("n0", "a triangle has normals at all corners or at none")),
        };
        let data = MeshData::new(corners.map(narrow).to_vec(), normals, None, vec![[0, 1, 2]]);
        data.map_err(|fault| params.error("p0", fault.to_string()))
    }
}

/// Triangles, smooth where they have normals at their vertices. A file without normals gets them from its faces
/// unless `face_normals` says otherwise, as in Mitsuba. As a light, every point is drawn with the same density.
#[derive(Clone, Debug)]
pub struct Mesh<F> {
    triangles: Triangles,
    /// Unit vectors, or zero where there is none, by vertex.
    normals: Option<Vec<[f32; 3]>>,
    uvs: Option<Vec<[f32; 2]>>,
    /// The triangles by their areas.
    areas: Distribution1D,
    /// Triangles without area.
    slivers: Vec<[u32; 3]>,
    /// Of a closed mesh, 1 if the corners of its triangles turn anticlockwise from outside, else -1.
    outward: f64,
    /// Whether glass on it may have an edge.
    allow_open: bool,
    format: PhantomData<F>,
}

impl<F: Format> Described for Mesh<F> {
    const PLUGIN: Plugin = F::PLUGIN;

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let to_world = params.transform(super::TO_WORLD.name)?;
        let has = |param: &Param| F::PLUGIN.params.iter().any(|known| known.name == param.name);
        let face_normals = has(&FACE_NORMALS) && params.boolean(FACE_NORMALS.name)?;
        // A single triangle is no solid that somebody forgot to close.
        let allow_open = !has(&ALLOW_OPEN) || params.boolean(ALLOW_OPEN.name)?;
        Ok(Self { allow_open, ..Self::new(F::load(params)?, &to_world, face_normals) })
    }
}

impl<F> Mesh<F> {
    /// A mesh in the world. Vertices are rounded to `f32` there, as in Mitsuba.
    #[must_use]
    pub fn new(data: MeshData, to_world: &DAffine3, face_normals: bool) -> Self {
        let MeshData { mut positions, normals, uvs, triangles, slivers } = data;
        for p in &mut positions {
            *p = narrow(to_world.transform_point3(wide(*p)));
        }
        let normals = match normals {
            _ if face_normals => None,
            Some(mut normals) => {
                let map = to_world.matrix3.inverse().transpose();
                normals.iter_mut().for_each(|n| *n = narrow((map * wide(*n)).normalize_or_zero()));
                Some(normals)
            }
            None => Some(normals::of_vertices(&positions, &triangles)),
        };
        let triangles = Triangles::new(positions, triangles);
        let area = |i: u32| {
            let [a, b, c] = triangles.triangle(i);
            0.5 * (b - a).cross(c - a).length()
        };
        let areas = Distribution1D::new((0..triangles.indices().len() as u32).map(area).collect::<Vec<_>>());
        let outward = solid::signed_volume(&triangles).signum();
        Self { triangles, normals, uvs, areas, slivers, outward, allow_open: false, format: PhantomData }
    }

    fn point(&self, triangle: u32, b: DVec2) -> Surface {
        let corners = self.triangles.triangle(triangle);
        let weights = [1.0 - b.x - b.y, b.x, b.y];
        let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let vertices = self.triangles.indices()[triangle as usize];
        let mix = |values: [DVec3; 3]| weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2];
        let smooth = self.normals.as_ref().map(|normals| mix(vertices.map(|v| wide(normals[v as usize]))));
        let uv = self.uvs.as_ref().map_or(b, |uvs| {
            let [x, y, z] = vertices.map(|v| DVec2::from_array(uvs[v as usize].map(f64::from)));
            weights[0] * x + weights[1] * y + weights[2] * z
        });
        let shading = smooth.and_then(DVec3::try_normalize).unwrap_or(n);
        // The front is where the file's normals say, whichever way the corners turn, in a mirror too.
        let n = if n.dot(shading) < 0.0 { -n } else { n };
        Surface { p: mix(corners), n, shading: Frame::from_normal(shading), uv, primitive: triangle, operand_index: 0 }
    }
}

impl From<TriangleHit> for Hit {
    #[inline]
    fn from(hit: TriangleHit) -> Self {
        Self::new(hit.t, hit.triangle, DVec2::new(hit.b1, hit.b2))
    }
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn narrow(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}

impl<F> ShapeModel for Mesh<F> {
    fn bounds(&self) -> Aabb {
        self.triangles.bounds()
    }

    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.triangles.closest(ray).map(Hit::from)
    }

    fn hierarchy(&self) -> Option<&Bvh> {
        Some(self.triangles.bvh())
    }

    #[inline(always)]
    fn intersect_block(&self, block: u32, ray: &Ray, shear: &mut Option<Shear>) -> Option<Hit> {
        let shear = shear.get_or_insert_with(|| Shear::new(ray));
        self.triangles.closest_in_block(block, ray, shear).map(Hit::from)
    }

    fn surface(&self, _ray: &Ray, hit: &Hit) -> Surface {
        self.point(hit.primitive, hit.coordinates)
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let Draw { index, rest } = self.areas.sample(u.x);
        let point = self.point(index as u32, warp::square_to_triangle(DVec2::new(rest, u.y)));
        ShapeSample { p: point.p, n: point.n, uv: point.uv, pdf: PerArea(1.0 / self.areas.total()) }
    }

    fn pdf_position(&self, _surface: &Surface) -> PerArea {
        PerArea(1.0 / self.areas.total())
    }

    fn dropped(&self) -> usize {
        self.slivers.len()
    }

    fn edge_distance(&self, surface: &Surface) -> Option<f64> {
        let [a, b, c] = self.triangles.triangle(surface.primitive);
        let beside = |p: DVec3, q: DVec3| (q - p).normalize().cross(surface.p - p).length();
        Some(beside(a, b).min(beside(b, c)).min(beside(c, a)))
    }

    fn open_edges(&self) -> Option<OpenEdges> {
        if self.allow_open { None } else { solid::open_edges(&self.triangles, &self.slivers) }
    }
}

impl<F> SolidModel for Mesh<F> {
    fn check_solid(&self) -> Result<(), String> {
        match solid::open_edges(&self.triangles, &self.slivers) {
            Some(edges) => Err(edges.to_string()),
            None if solid::signed_volume(&self.triangles) == 0.0 => Err("the mesh has no volume".into()),
            None => Ok(()),
        }
    }

    fn cross(&self, line: &Line) -> Crossings {
        solid::cross(&self.triangles, self.outward, line)
    }

    fn solid_surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let [a, b, c] = self.triangles.triangle(hit.primitive);
        let n = (b - a).cross(c - a);
        let p = ray.at(hit.t);
        // Areas opposite to the second and third corner, over the whole.
        let share = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(n) / n.length_squared();
        let weights = DVec2::new(share(c, a), share(a, b)).max(DVec2::ZERO);
        let surface = self.point(hit.primitive, weights / (weights.x + weights.y).max(1.0));
        if surface.n.dot(self.outward * n) < 0.0 { surface.flipped() } else { surface }
    }
}
