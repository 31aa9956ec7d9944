//! Triangles as the mesh files give them, checked, and what can be wrong with such a file.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Triangles with shared vertices, in the units of their file.
///
/// [`MeshData::new`] and the readers promise: every index is in range, every number is finite, no triangle has zero
/// area, at least one triangle is left, and `normals` and `uvs`, where present, are as long as `positions`.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshData {
    /// One place for each vertex.
    pub positions: Vec<[f32; 3]>,
    /// One normal for each vertex, of any length, as the file has it. A zero normal says nothing: where the
    /// interpolated normal vanishes, the normal of the triangle stands in.
    pub normals: Option<Vec<[f32; 3]>>,
    /// One pair of texture coordinates for each vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Three indices into `positions` for each triangle, anticlockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// The triangles of zero area, which are left out of `triangles`.
    pub slivers: Vec<[u32; 3]>,
}

impl MeshData {
    /// Checks the parts of a mesh and leaves out its triangles of zero area, counting them.
    ///
    /// # Errors
    ///
    /// A list of normals or texture coordinates of another length than `positions`, more than `u32::MAX` vertices, a
    /// number that is not finite, an index without its vertex, no triangle left.
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

/// A mesh file that cannot be used, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", file.display())]
pub struct MeshError {
    /// The file as the caller named it.
    pub file: PathBuf,
    /// What is wrong with it.
    pub fault: MeshFault,
}

/// What is wrong with a mesh, in one line. Vertices and faces count from 0, lines from 1.
#[derive(Debug, thiserror::Error)]
pub enum MeshFault {
    /// The operating system does not give the file's bytes.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// A folder, a device or a pipe.
    #[error("is not a regular file")]
    NotAFile,
    /// A line says something else than its format allows.
    #[error("line {line}: {what}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// What the line says and what it should say.
        what: String,
    },
    /// The header promises more than a file of this size can hold; found before memory is taken.
    #[error("the header promises {promised} {}, the file has room for {room} at most", plural(element))]
    NoRoom {
        /// The kind of element, as the header calls it.
        element: String,
        /// The number of elements in the header.
        promised: u64,
        /// The number of elements of their least size that fit into the file.
        room: u64,
    },
    /// The file ends before the last element that its header promises.
    #[error("the header promises {promised} {}, the file ends after {read}", plural(element))]
    Truncated {
        /// The kind of element, as the header calls it.
        element: String,
        /// The number of elements in the header.
        promised: u64,
        /// The number of whole elements found.
        read: u64,
    },
    /// A list whose length is negative or beyond the end of the file.
    #[error(
        "element {} {number} (counted from 0) has a list of {length} entries, the file has room for {room} at most",
        quoted(element.as_bytes())
    )]
    ListLength {
        /// The kind of element, as the header calls it.
        element: String,
        /// The element's number.
        number: u64,
        /// The length the file gives.
        length: i64,
        /// The number of entries that fit into the rest of the file.
        room: usize,
    },
    /// Bytes are left after the last element that the header promises.
    #[error(
        "the data should end at byte {end}, where the last element that the header promises ends; the file has {size} bytes"
    )]
    Trailing {
        /// The offset of the first byte too many.
        end: usize,
        /// The size of the file in bytes.
        size: usize,
    },
    /// More vertices than an index can tell apart.
    #[error("{count} vertices are too many: at most {} can be numbered", u32::MAX)]
    TooManyVertices {
        /// The number of vertices.
        count: u64,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} (counted from 0) uses vertex {index} (counted from 0), the mesh has {vertices} vertices")]
    Index {
        /// The face's number.
        face: u64,
        /// The index it gives.
        index: i64,
        /// The number of vertices.
        vertices: usize,
    },
    /// Indices from 0 to the number of vertices, which no base fits.
    #[error("the indices of the faces include both 0 and {vertices}, the number of vertices: they fit no base")]
    TwoBases {
        /// The number of vertices.
        vertices: usize,
    },
    /// Indices that do not show what they count from.
    #[error(
        "the indices of the faces go from {least} to {greatest} for {vertices} vertices, which does not show whether they \
         count from 0 or 1: set index_base to 0 or 1"
    )]
    AmbiguousBase {
        /// The least index.
        least: i64,
        /// The greatest.
        greatest: i64,
        /// The number of vertices.
        vertices: usize,
    },
    /// A face with fewer than three corners.
    #[error("face {face} (counted from 0) has {corners} corners, a face needs 3 or more")]
    Corners {
        /// The face's number.
        face: u64,
        /// The number of its corners.
        corners: usize,
    },
    /// A vertex has an infinite number, or none.
    #[error("vertex {vertex} (counted from 0) has the {attribute} {values:?}, which is not finite in single precision")]
    NotFinite {
        /// The vertex's number.
        vertex: usize,
        /// Its attribute: position, normal, texture coordinate.
        attribute: &'static str,
        /// What the attribute holds.
        values: Vec<f32>,
    },
    /// An attribute is not there for each vertex, or for more.
    #[error("the mesh has {vertices} vertices, but {given} times a {attribute}")]
    AttributeCount {
        /// The attribute: normal, texture coordinate.
        attribute: &'static str,
        /// How often it is given.
        given: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// Nothing to see.
    #[error("the mesh has no triangle{}", if *dropped == 0 { String::new() } else { format!(" but {dropped} of zero area") })]
    NoTriangle {
        /// The number of triangles of zero area.
        dropped: usize,
    },
}

/// Reads a whole file and makes a mesh of its bytes; what is wrong is told with the file's name.
///
/// The whole file is taken into memory because every format is checked against the file's size, and because an
/// offset then is a place in the file. A device or a pipe has no size and is refused.
pub(super) fn read(
    path: &Path,
    parse: impl FnOnce(&[u8]) -> Result<MeshData, MeshFault>,
) -> Result<MeshData, MeshError> {
    contents(path).and_then(|bytes| parse(&bytes)).map_err(|fault| MeshError { file: path.to_owned(), fault })
}

/// Refuses more vertices than `u32` can number.
pub(super) fn check_vertex_count(count: u64) -> Result<(), MeshFault> {
    if count > u64::from(u32::MAX) { Err(MeshFault::TooManyVertices { count }) } else { Ok(()) }
}

/// The vertex that a face names, counted from 0, where it exists.
pub(super) fn check_index(face: u64, index: i64, vertices: usize) -> Result<u32, MeshFault> {
    match u32::try_from(index) {
        Ok(vertex) if (vertex as usize) < vertices => Ok(vertex),
        _ => Err(MeshFault::Index { face, index, vertices }),
    }
}

/// A word of the file for a message: short, and with its control characters escaped.
pub(super) fn quoted(word: &[u8]) -> String {
    const MAX_LENGTH: usize = 40;
    let cut = &word[..word.len().min(MAX_LENGTH)];
    let dots = if word.len() > MAX_LENGTH { "..." } else { "" };
    format!("{:?}{dots}", String::from_utf8_lossy(cut))
}

fn contents(path: &Path) -> Result<Vec<u8>, MeshFault> {
    // Asked before it is opened: to open a pipe would wait for its writer.
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

/// Whether the corners lie on one line, in double precision: there the area of a small triangle does not underflow.
fn has_zero_area(corners: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.map(f64::from));
    let along = |to: [f64; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
    let (u, v) = (along(b), along(c));
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
    fn zero_area_is_a_repeated_corner_or_three_on_a_line() {
        let kept = mesh(&[[0, 0, 1], [0, 1, 3], [0, 1, 2], [3, 2, 3]]).expect("one is left");
        assert_eq!((kept.triangles, kept.slivers), (vec![[0, 1, 2]], vec![[0, 0, 1], [0, 1, 3], [3, 2, 3]]));
    }

    /// Its area in square units is below the least number of single precision, by far.
    #[test]
    fn a_small_triangle_is_kept() {
        let positions = CORNERS.map(|corner| corner.map(|x| x * 1e-38)).to_vec();
        assert_eq!(MeshData::new(positions, None, None, vec![[0, 1, 2]]).expect("it has an area").slivers, [[0; 3]; 0]);
    }

    #[test]
    fn an_index_out_of_range_is_named() {
        let message = mesh(&[[0, 1, 2], [0, 1, 4]]).expect_err("there are four").to_string();
        assert_eq!(message, "face 1 (counted from 0) uses vertex 4 (counted from 0), the mesh has 4 vertices");
        assert_eq!(mesh(&[]).expect_err("none").to_string(), "the mesh has no triangle");
    }

    #[test]
    fn an_attribute_is_for_all_vertices_and_finite() {
        let short = MeshData::new(CORNERS.to_vec(), Some(vec![[0.0; 3]; 3]), None, vec![[0, 1, 2]]);
        assert_eq!(short.expect_err("one less").to_string(), "the mesh has 4 vertices, but 3 times a normal");
        let long = MeshData::new(CORNERS.to_vec(), None, Some(vec![[0.0; 2]; 5]), vec![[0, 1, 2]]);
        assert!(long.expect_err("one more").to_string().ends_with("5 times a texture coordinate"));
        let uvs = Some(vec![[0.0, 1.0], [0.0, f32::NAN], [0.0; 2], [0.0; 2]]);
        let message = MeshData::new(CORNERS.to_vec(), None, uvs, vec![[0, 1, 2]]).expect_err("NaN").to_string();
        assert!(message.starts_with("vertex 1 (counted from 0) has the texture coordinate [0.0, NaN], "), "{message}");
    }

    #[test]
    fn more_vertices_than_an_index_can_name() {
        assert!(check_vertex_count(u64::from(u32::MAX)).is_ok());
        let message = check_vertex_count(1 << 32).expect_err("one too many").to_string();
        assert_eq!(message, "4294967296 vertices are too many: at most 4294967295 can be numbered");
    }

    #[test]
    fn quoted_words_are_short_and_plain() {
        assert_eq!(quoted(b"a\x1b[31m\n"), "\"a\\u{1b}[31m\\n\"");
        assert_eq!(quoted(&[b'x'; 41]), format!("\"{}\"...", "x".repeat(40)));
    }
}
