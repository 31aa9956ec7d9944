//! The checked triangles of a mesh file, and the errors of such files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Triangles with shared vertices, in the units of their file.
///
/// [`MeshData::new`] and the readers guarantee that every index is in range, every number is finite, no triangle has
/// zero area, there is at least one triangle, and `normals` and `uvs`, if present, are as long as `positions`.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshData {
    /// The position of each vertex.
    pub positions: Vec<[f32; 3]>,
    /// The normal of each vertex as in the file, of any length. Where the interpolated normal is zero, the normal of
    /// the triangle is used.
    pub normals: Option<Vec<[f32; 3]>>,
    /// The texture coordinates of each vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Three indices into `positions` for each triangle, anticlockwise from its front side.
    pub triangles: Vec<[u32; 3]>,
    /// The triangles of zero area, which are left out of `triangles`.
    pub slivers: Vec<[u32; 3]>,
}

impl MeshData {
    /// Checks the lists of a mesh and moves its triangles of zero area to `slivers`.
    ///
    /// # Errors
    ///
    /// The list of normals or of texture coordinates is not as long as `positions`, there are more than `u32::MAX`
    /// vertices, a number is not finite, an index is out of range, or no triangle has an area.
    pub fn new(
        positions: Vec<[f32; 3]>,
        normals: Option<Vec<[f32; 3]>>,
        uvs: Option<Vec<[f32; 2]>>,
        mut triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshFault> {
        check_vertex_count(positions.len() as u64)?;
        check_attribute("position", &positions, positions.len())?;
        if let Some(normals) = &normals {
            check_attribute("normal", normals, positions.len())?;
        }
        if let Some(uvs) = &uvs {
            check_attribute("texture coordinate", uvs, positions.len())?;
        }
        for (face, corners) in triangles.iter().enumerate() {
            for &corner in corners {
                check_index(face as u64, i64::from(corner), positions.len())?;
            }
        }
        let is_sliver = |corners: &mut [u32; 3]| has_zero_area(corners.map(|corner| positions[corner as usize]));
        let slivers: Vec<_> = triangles.extract_if(.., is_sliver).collect();
        if triangles.is_empty() {
            return Err(MeshFault::NoTriangle { dropped: slivers.len() });
        }
        Ok(Self { positions, normals, uvs, triangles, slivers })
    }
}

/// A mesh file that cannot be used, and the reason.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", file.display())]
pub struct MeshError {
    /// The file as the caller named it.
    pub file: PathBuf,
    /// What is wrong with it.
    pub fault: MeshFault,
}

/// A fault of a mesh. Its message is a single line. Vertices and faces count from 0, lines from 1.
#[derive(Debug, thiserror::Error)]
pub enum MeshFault {
    /// The operating system reports an error.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// The path is a folder, a device or a pipe.
    #[error("is not a regular file")]
    NotAFile,
    /// A line does not follow the format.
    #[error("line {line}: {what}")]
    Syntax {
        /// The line number, from 1.
        line: usize,
        /// What the line contains and what is expected.
        what: String,
    },
    /// The header declares more elements than a file of this size can hold. This is checked before memory is allocated.
    #[error("the header declares {declared} {}, the file has room for {room} at most", plural(element))]
    NoRoom {
        /// The name of the element in the header.
        element: String,
        /// The number of elements in the header.
        declared: u64,
        /// The number of elements of the least possible size that fit into the file.
        room: u64,
    },
    /// The file ends before the last element that its header declares.
    #[error("the header declares {declared} {}, the file ends after {read}", plural(element))]
    Truncated {
        /// The name of the element in the header.
        element: String,
        /// The number of elements in the header.
        declared: u64,
        /// The number of complete elements in the file.
        read: u64,
    },
    /// The length of a list is negative, or the list does not fit into the file.
    #[error(
        "element {} {number} (counted from 0) has a list of {length} entries, the file has room for {room} at most",
        quoted(element.as_bytes())
    )]
    ListLength {
        /// The name of the element in the header.
        element: String,
        /// The index of the element.
        number: u64,
        /// The length in the file.
        length: i64,
        /// The number of entries that fit into the rest of the file.
        room: usize,
    },
    /// The file continues after the last element that the header declares.
    #[error(
        "the data should end at byte {end}, after the last element that the header declares; the file has {size} bytes"
    )]
    Trailing {
        /// The offset of the first excess byte.
        end: usize,
        /// The size of the file in bytes.
        size: usize,
    },
    /// There are more vertices than 32-bit indices.
    #[error("{count} vertices are too many: at most {} can be indexed", u32::MAX)]
    TooManyVertices {
        /// The number of vertices.
        count: u64,
    },
    /// A face refers to a vertex that does not exist.
    #[error("face {face} (counted from 0) uses vertex {index} (counted from 0), the mesh has {vertices} vertices")]
    Index {
        /// The index of the face.
        face: u64,
        /// The index of the vertex in the file.
        index: i64,
        /// The number of vertices.
        vertices: usize,
    },
    /// The indices range from 0 to the number of vertices, which is impossible with either base.
    #[error("the indices of the faces include both 0 and {vertices}, the number of vertices: they fit neither base")]
    TwoBases {
        /// The number of vertices.
        vertices: usize,
    },
    /// The indices fit both bases.
    #[error(
        "the indices of the faces range from {least} to {greatest} for {vertices} vertices, which fits both index bases: \
         set index_base to 0 or 1"
    )]
    AmbiguousBase {
        /// The least index.
        least: i64,
        /// The greatest index.
        greatest: i64,
        /// The number of vertices.
        vertices: usize,
    },
    /// A face with fewer than three corners.
    #[error("face {face} (counted from 0) has {corners} corners, a face needs 3 or more")]
    Corners {
        /// The index of the face.
        face: u64,
        /// The number of its corners.
        corners: usize,
    },
    /// An attribute of a vertex is infinite or NaN in single precision.
    #[error("vertex {vertex} (counted from 0) has the {attribute} {values:?}, which is not finite in single precision")]
    NotFinite {
        /// The index of the vertex.
        vertex: usize,
        /// The attribute: position, normal, texture coordinate.
        attribute: &'static str,
        /// The components of the attribute.
        values: Vec<f32>,
    },
    /// The number of values of an attribute is not the number of vertices.
    #[error("the mesh has {vertices} vertices, but the number of {attribute}s is {given}")]
    AttributeCount {
        /// The attribute: normal, texture coordinate.
        attribute: &'static str,
        /// The number of values.
        given: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// No triangle has an area.
    #[error("the mesh has no triangle{}", if *dropped == 0 { String::new() } else { format!(" but {dropped} of zero area") })]
    NoTriangle {
        /// The number of triangles of zero area.
        dropped: usize,
    },
}

/// Reads a whole file and parses a mesh from its bytes. Errors contain the name of the file.
///
/// The whole file is read into memory, because every format is checked against the file's size, and because an offset
/// into the bytes is then an offset into the file. Devices and pipes have no size and are refused.
pub(super) fn read(
    path: &Path,
    parse: impl FnOnce(&[u8]) -> Result<MeshData, MeshFault>,
) -> Result<MeshData, MeshError> {
    contents(path).and_then(|bytes| parse(&bytes)).map_err(|fault| MeshError { file: path.to_owned(), fault })
}

/// Checks that `u32` can index this number of vertices.
pub(super) fn check_vertex_count(count: u64) -> Result<(), MeshFault> {
    if count > u64::from(u32::MAX) { Err(MeshFault::TooManyVertices { count }) } else { Ok(()) }
}

/// Checks an index, counted from 0, that a face contains.
pub(super) fn check_index(face: u64, index: i64, vertices: usize) -> Result<u32, MeshFault> {
    match u32::try_from(index) {
        Ok(vertex) if (vertex as usize) < vertices => Ok(vertex),
        _ => Err(MeshFault::Index { face, index, vertices }),
    }
}

/// Quotes a word of the file for a message: truncated, with escaped control characters.
pub(super) fn quoted(word: &[u8]) -> String {
    const MAX_LENGTH: usize = 40;
    let cut = &word[..word.len().min(MAX_LENGTH)];
    let dots = if word.len() > MAX_LENGTH { "..." } else { "" };
    format!("{:?}{dots}", String::from_utf8_lossy(cut))
}

fn contents(path: &Path) -> Result<Vec<u8>, MeshFault> {
    // Checked before the file is opened, because opening a pipe waits for its writer.
    if !fs::metadata(path).map_err(MeshFault::Io)?.is_file() {
        return Err(MeshFault::NotAFile);
    }
    fs::read(path).map_err(MeshFault::Io)
}

fn check_attribute<const N: usize>(
    attribute: &'static str,
    given: &[[f32; N]],
    vertices: usize,
) -> Result<(), MeshFault> {
    if given.len() != vertices {
        return Err(MeshFault::AttributeCount { attribute, given: given.len(), vertices });
    }
    match given.iter().position(|values| values.iter().any(|x| !x.is_finite())) {
        Some(vertex) => Err(MeshFault::NotFinite { vertex, attribute, values: given[vertex].to_vec() }),
        None => Ok(()),
    }
}

/// Whether the corners are collinear. In double precision the area of a small triangle does not underflow.
fn has_zero_area(corners: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.map(f64::from));
    let from_a = |to: [f64; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
    let (u, v) = (from_a(b), from_a(c));
    u[1] * v[2] == u[2] * v[1] && u[2] * v[0] == u[0] * v[2] && u[0] * v[1] == u[1] * v[0]
}

fn plural(element: &str) -> String {
    match element {
        "vertex" => "vertices".to_owned(),
        "face" => "faces".to_owned(),
        other => format!("elements {}", quoted(other.as_bytes())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]];

    fn mesh(triangles: &[[u32; 3]]) -> Result<MeshData, MeshFault> {
        MeshData::new(CORNERS.to_vec(), None, None, triangles.to_vec())
    }

    #[test]
    fn repeated_and_collinear_corners_have_zero_area() {
        let kept = mesh(&[[0, 0, 1], [0, 1, 3], [0, 1, 2], [3, 2, 3]]).expect("one triangle has an area");
        assert_eq!((kept.triangles, kept.slivers), (vec![[0, 1, 2]], vec![[0, 0, 1], [0, 1, 3], [3, 2, 3]]));
    }

    /// The area of the triangle is far below the least positive number of single precision.
    #[test]
    fn a_small_triangle_is_kept() {
        let positions = CORNERS.map(|corner| corner.map(|x| x * 1e-38)).to_vec();
        assert_eq!(MeshData::new(positions, None, None, vec![[0, 1, 2]]).expect("it has an area").slivers, [[0; 3]; 0]);
    }

    #[test]
    fn an_index_out_of_range_is_an_error() {
        let message = mesh(&[[0, 1, 2], [0, 1, 4]]).expect_err("there are four vertices").to_string();
        assert_eq!(message, "face 1 (counted from 0) uses vertex 4 (counted from 0), the mesh has 4 vertices");
        assert_eq!(mesh(&[]).expect_err("none").to_string(), "the mesh has no triangle");
    }

    #[test]
    fn an_attribute_is_finite_and_has_one_value_per_vertex() {
        let short = MeshData::new(CORNERS.to_vec(), Some(vec![[0.0; 3]; 3]), None, vec![[0, 1, 2]]);
        assert_eq!(short.expect_err("one less").to_string(), "the mesh has 4 vertices, but the number of normals is 3");
        let long = MeshData::new(CORNERS.to_vec(), None, Some(vec![[0.0; 2]; 5]), vec![[0, 1, 2]]);
        assert!(long.expect_err("one more").to_string().ends_with("the number of texture coordinates is 5"));
        let uvs = Some(vec![[0.0, 1.0], [0.0, f32::NAN], [0.0; 2], [0.0; 2]]);
        let message = MeshData::new(CORNERS.to_vec(), None, uvs, vec![[0, 1, 2]]).expect_err("NaN").to_string();
        assert!(message.starts_with("vertex 1 (counted from 0) has the texture coordinate [0.0, NaN], "), "{message}");
    }

    #[test]
    fn too_many_vertices_are_an_error() {
        assert!(check_vertex_count(u64::from(u32::MAX)).is_ok());
        let message = check_vertex_count(1 << 32).expect_err("one too many").to_string();
        assert_eq!(message, "4294967296 vertices are too many: at most 4294967295 can be indexed");
    }

    #[test]
    fn quoted_words_are_truncated_and_escaped() {
        assert_eq!(quoted(b"a\x1b[31m\n"), "\"a\\u{1b}[31m\\n\"");
        assert_eq!(quoted(&[b'x'; 41]), format!("\"{}\"...", "x".repeat(40)));
    }
}
