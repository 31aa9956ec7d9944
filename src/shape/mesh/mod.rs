//! Triangle meshes, from files or as a single triangle.

mod data;
mod kcply;
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
    math::{Aabb, DiscreteSample, Distribution1D, Frame, PerArea, Ray, warp},
    scene_file::{Category, Described, MeshArrays, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// A plugin that provides the triangles of a mesh.
pub trait Format: Clone + std::fmt::Debug {
    /// The manual page.
    const PLUGIN: Plugin;

    /// Loads the triangles, in shape space.
    ///
    /// # Errors
    /// A file cannot be read or is not a valid mesh, or the parameters of the triangle are wrong.
    fn load(params: &Params<'_>) -> Result<MeshData, SceneError>;
}

/// The plugin `ply`: a file in the Stanford polygon format.
#[derive(Clone, Debug)]
pub struct Ply;

/// The plugin `obj`: a file in the Wavefront format.
#[derive(Clone, Debug)]
pub struct Obj;

/// The plugin `kcply`: a text file of vertices and triangles.
#[derive(Clone, Debug)]
pub struct Kcply;

/// A mesh from arrays, see [`MeshArrays`]. Only a scene that is built in code can hold one: an XML file names a `ply`,
/// `obj` or `kcply` file instead, which gives the same shape for the same vertices and triangles.
#[derive(Clone, Debug)]
pub struct Arrays;

/// The plugin `triangle`: a single triangle. Its corners are rounded to single precision, as in all meshes.
#[derive(Clone, Debug)]
pub struct Triangle;

const FILENAME: Param =
    Param::required("filename", ParamKind::File, "the mesh file, relative to the folder of the scene file");
const FACE_NORMALS: Param = Param::new(
    "face_normals",
    ParamKind::Boolean,
    "false",
    "whether to shade triangles flat and ignore the normals of the file",
);
const ALLOW_OPEN: Param = Param::new(
    "allow_open",
    ParamKind::Boolean,
    "false",
    "whether a dielectric bsdf is allowed although the mesh is open, as for the surface of a lake",
);

/// Reads the triangles from the file that the parameter `filename` names.
fn from_file(
    params: &Params<'_>,
    read: impl FnOnce(&std::path::Path) -> Result<MeshData, MeshError>,
) -> Result<MeshData, SceneError> {
    read(&params.file(FILENAME.name)?).map_err(|error| params.error(FILENAME.name, error.to_string()))
}

impl Format for Ply {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("mod.rs": "Mesh", "Ply"),
        name: "ply",
        summary: "A mesh from a PLY file, ascii or binary, with its normals and texture coordinates if it has them.",
        params: &[
            FILENAME,
            FACE_NORMALS,
            Param::new("flip_tex_coords", ParamKind::Boolean, "false", "whether to replace v by 1 - v"),
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
        manual: manual!("mod.rs": "Mesh", "Obj"),
        name: "obj",
        summary: "A mesh from a Wavefront OBJ file.",
        params: &[
            FILENAME,
            FACE_NORMALS,
            Param::new("flip_tex_coords", ParamKind::Boolean, "true", "whether to replace v by 1 - v"),
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
        manual: manual!("mod.rs": "Mesh", "Kcply"),
        name: "kcply",
        summary: "A mesh from a kcply file: a text file of vertices and triangles.",
        params: &[
            FILENAME,
            Param::new("index_base", ParamKind::Choice(&["auto", "0", "1"]), "auto", "the index of the first vertex"),
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
        manual: manual!("mod.rs": "Mesh", "Arrays"),
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
        manual: manual!("mod.rs": "Mesh", "Triangle"),
        name: "triangle",
        summary: "A triangle. From its front side the corners run anticlockwise; it is smooth if it has normals.",
        params: &[
            Param::required("p0", ParamKind::Point, "the first corner"),
            Param::required("p1", ParamKind::Point, "the second corner"),
            Param::required("p2", ParamKind::Point, "the third corner"),
            Param::optional("n0", ParamKind::Point, "the normal of the triangle", "the normal at the first corner"),
            Param::optional("n1", ParamKind::Point, "the normal of the triangle", "the normal at the second corner"),
            Param::optional("n2", ParamKind::Point, "the normal of the triangle", "the normal at the third corner"),
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
            _ => return Err(params.error("n0", "a triangle needs normals at all corners or at none")),
        };
        let data = MeshData::new(corners.map(narrow).to_vec(), normals, None, vec![[0, 1, 2]]);
        data.map_err(|fault| params.error("p0", fault.to_string()))
    }
}

/// A triangle mesh. Its shading normals are interpolated from vertex normals. As in Mitsuba, vertex normals are
/// computed from the faces if the file has none, and with `face_normals` the triangles are flat. An area light samples
/// all points with the same pdf.
#[derive(Clone, Debug)]
pub struct Mesh<F> {
    triangles: Triangles,
    /// A unit vector per vertex, or zero for a vertex without a normal.
    normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates per vertex.
    uvs: Option<Vec<[f32; 2]>>,
    /// Samples triangles in proportion to their areas.
    areas: Distribution1D,
    /// The triangles of zero area, which cannot be hit.
    slivers: Vec<[u32; 3]>,
    /// For a closed mesh, 1 if the corners of its triangles run anticlockwise from outside, else -1.
    outward: f64,
    /// Whether a dielectric BSDF is allowed although the mesh is open.
    allow_open: bool,
    format: PhantomData<F>,
}

impl<F: Format> Described for Mesh<F> {
    const PLUGIN: Plugin = F::PLUGIN;

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let to_world = params.transform(super::TO_WORLD.name)?;
        let has = |param: &Param| F::PLUGIN.params.iter().any(|known| known.name == param.name);
        let face_normals = has(&FACE_NORMALS) && params.boolean(FACE_NORMALS.name)?;
        // A plugin without `allow_open` (the single triangle) is meant to be open.
        let allow_open = !has(&ALLOW_OPEN) || params.boolean(ALLOW_OPEN.name)?;
        Ok(Self { allow_open, ..Self::new(F::load(params)?, &to_world, face_normals) })
    }
}

impl<F> Mesh<F> {
    /// A mesh transformed to world space, where its vertices are rounded to `f32`, as in Mitsuba.
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

    /// The surface point of a triangle at the barycentric coordinates `b` of its second and third corner.
    fn point(&self, triangle: u32, b: DVec2) -> Surface {
        let corners = self.triangles.triangle(triangle);
        let weights = [1.0 - b.x - b.y, b.x, b.y];
        let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let vertices = self.triangles.indices()[triangle as usize];
        let interpolate = |values: [DVec3; 3]| weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2];
        let smooth = self.normals.as_ref().map(|normals| interpolate(vertices.map(|v| wide(normals[v as usize]))));
        let uv = self.uvs.as_ref().map_or(b, |uvs| {
            let [x, y, z] = vertices.map(|v| DVec2::from_array(uvs[v as usize].map(f64::from)));
            weights[0] * x + weights[1] * y + weights[2] * z
        });
        let shading = smooth.and_then(DVec3::try_normalize).unwrap_or(n);
        // The file's normals determine the front, not the orientation of the corners, which a reflection reverses.
        let n = if n.dot(shading) < 0.0 { -n } else { n };
        Surface {
            p: interpolate(corners),
            n,
            shading: Frame::from_normal(shading),
            uv,
            primitive: triangle,
            operand_index: 0,
        }
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
        let DiscreteSample { index, remapped } = self.areas.sample(u.x);
        let point = self.point(index as u32, warp::square_to_triangle(DVec2::new(remapped, u.y)));
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
        let distance = |p: DVec3, q: DVec3| (q - p).normalize().cross(surface.p - p).length();
        Some(distance(a, b).min(distance(b, c)).min(distance(c, a)))
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
        // The barycentric coordinates of the second and third corner: areas opposite to them over the whole area.
        let weight = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(n) / n.length_squared();
        let weights = DVec2::new(weight(c, a), weight(a, b)).max(DVec2::ZERO);
        let surface = self.point(hit.primitive, weights / (weights.x + weights.y).max(1.0));
        if surface.n.dot(self.outward * n) < 0.0 { surface.flipped() } else { surface }
    }
}
