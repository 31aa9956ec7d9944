/// Triangles with shared vertices, as arrays: the data of a shape `mesh` in a scene that is built in code.
///
/// Lengths are in units of the shape's own space; `to_world` maps it to the world. The arrays are checked when the
/// scene is read: every index must name a vertex, every number must be finite, and at least one triangle must have an
/// area.
///
/// ```
/// # use etendue::prelude::*;
/// let square = MeshArrays::new(
///     vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
///     vec![[0, 1, 2], [0, 2, 3]],
/// );
/// let square = shape("mesh").with("arrays", square).child(bsdf("diffuse"));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshArrays {
    /// The position of each vertex.
    pub positions: Vec<[f32; 3]>,
    /// Three indices into `positions` for each triangle, from 0, anticlockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// The normal of each vertex, of any length; None for normals averaged from the faces around a vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// The texture coordinates (u, v) of each vertex; None for the barycentric coordinates of each triangle.
    pub uvs: Option<Vec<[f32; 2]>>,
}

impl MeshArrays {
    /// Triangles with neither normals nor texture coordinates of their own.
    #[must_use]
    pub fn new(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, normals: None, uvs: None }
    }

    /// The same triangles with a normal for each vertex.
    #[must_use]
    pub fn with_normals(self, normals: Vec<[f32; 3]>) -> Self {
        Self { normals: Some(normals), ..self }
    }

    /// The same triangles with texture coordinates for each vertex.
    #[must_use]
    pub fn with_uvs(self, uvs: Vec<[f32; 2]>) -> Self {
        Self { uvs: Some(uvs), ..self }
    }
}
