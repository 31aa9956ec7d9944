//! Triangle meshes from files.

mod data;
pub mod laws;
mod normals;
mod obj;
mod ply;
mod triangles;

pub use data::{MeshData, MeshError, MeshFault};
pub use obj::read_obj;
pub use ply::read_ply;
pub use triangles::{Shear, TriangleHit, Triangles};

use std::{marker::PhantomData, path::Path};

use glam::{DAffine3, DVec2, DVec3};

use super::{Drawn, Hit, Model, Surface, bvh::Bvh};
use crate::{
    math::{Aabb, Frame, PerArea, Ray, warp},
    node::{Category, Described, Kind, Param, Params, Plugin, SceneError},
};

/// A file format that holds triangles.
pub trait Format: Clone + std::fmt::Debug {
    /// The manual page of its plugin.
    const PLUGIN: Plugin;

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read or is not a valid mesh.
    fn load(path: &Path, flip_tex_coords: bool) -> Result<MeshData, MeshError>;
}

/// The Stanford polygon format.
#[derive(Clone, Debug)]
pub struct Ply;

/// The Wavefront format.
#[derive(Clone, Debug)]
pub struct Obj;

const FILENAME: Param = Param::required("filename", Kind::File, "the file, relative to the scene's");
const FACE_NORMALS: Param =
    Param::new("face_normals", Kind::Boolean, "false", "whether triangles look flat, whatever normals the file has");

impl Format for Ply {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        name: "ply",
        summary: "A mesh from a PLY file: ascii or binary, with normals and texture coordinates if it has them.",
        params: &[
            FILENAME,
            FACE_NORMALS,
            Param::new("flip_tex_coords", Kind::Boolean, "false", "whether v counts from the other end"),
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[],
        evidence: &["mesh/round-trip", "mesh/shading-normals", "shape/*", "reference/mesh-lamp"],
    };

    fn load(path: &Path, flip_tex_coords: bool) -> Result<MeshData, MeshError> {
        read_ply(path, flip_tex_coords)
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
            Param::new("flip_tex_coords", Kind::Boolean, "true", "whether v counts from the other end"),
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[],
        evidence: &["mesh/round-trip", "mesh/shading-normals", "shape/*", "reference/faceted-and-smooth"],
    };

    fn load(path: &Path, flip_tex_coords: bool) -> Result<MeshData, MeshError> {
        read_obj(path, flip_tex_coords)
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
    /// The area of all triangles up to and including each.
    cumulative_area: Vec<f64>,
    dropped: usize,
    format: PhantomData<F>,
}

impl<F: Format> Described for Mesh<F> {
    const PLUGIN: Plugin = F::PLUGIN;

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let path = params.file("filename")?;
        let to_world = params.transform(super::TO_WORLD.name)?;
        let flip_tex_coords = params.boolean("flip_tex_coords")?;
        let data = F::load(&path, flip_tex_coords).map_err(|error| params.error("filename", error.to_string()))?;
        Ok(Self::new(data, &to_world, params.boolean("face_normals")?))
    }
}

impl<F> Mesh<F> {
    /// A mesh in the world. Vertices are rounded to `f32` there, as in Mitsuba.
    #[must_use]
    pub fn new(data: MeshData, to_world: &DAffine3, face_normals: bool) -> Self {
        let MeshData { mut positions, normals, uvs, triangles, dropped } = data;
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
        let mut total = 0.0;
        let cumulative_area = (0..triangles.indices().len() as u32)
            .map(|i| {
                let [a, b, c] = triangles.triangle(i);
                total += 0.5 * (b - a).cross(c - a).length();
                total
            })
            .collect();
        Self { triangles, normals, uvs, cumulative_area, dropped, format: PhantomData }
    }

    fn area(&self) -> f64 {
        self.cumulative_area.last().copied().unwrap_or(0.0)
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
        Surface { p: mix(corners), n, shading: Frame::from_normal(shading), uv, primitive: triangle }
    }
}

impl From<TriangleHit> for Hit {
    #[inline]
    fn from(hit: TriangleHit) -> Self {
        Self { t: hit.t, primitive: hit.triangle, coordinates: DVec2::new(hit.b1, hit.b2) }
    }
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn narrow(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}

impl<F> Model for Mesh<F> {
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

    fn sample_area(&self, u: DVec2) -> Drawn<PerArea> {
        let at = u.x * self.area();
        let last = self.cumulative_area.len() - 1;
        let triangle = self.cumulative_area.partition_point(|&sum| sum <= at).min(last);
        let below = if triangle == 0 { 0.0 } else { self.cumulative_area[triangle - 1] };
        let share = (at - below) / (self.cumulative_area[triangle] - below);
        let point = self.point(triangle as u32, warp::square_to_triangle(DVec2::new(share.min(1.0), u.y)));
        Drawn { p: point.p, n: point.n, uv: point.uv, density: PerArea(1.0 / self.area()) }
    }

    fn area_density(&self, _surface: &Surface) -> PerArea {
        PerArea(1.0 / self.area())
    }

    fn dropped(&self) -> usize {
        self.dropped
    }
}
