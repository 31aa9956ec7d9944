//! Wavefront OBJ.
//!
//! The reader supports the statements `v`, `vt`, `vn`, and `f` with corners `v`, `v/vt`, `v//vn` or `v/vt/vn`. A
//! negative index counts back from the last value above its line. A vertex of the mesh is a distinct triple of indices;
//! the vertices are numbered in the order in which the faces first use them. Unused values are left out. A polygon
//! becomes a fan around its first corner, which is correct for convex polygons. Other statements (`g`, `o`, `s`,
//! `usemtl`, `l`, ...) and further numbers on a line, such as colours, are ignored.
//!
//! If only some corners have texture coordinates, the others get (0, 0). If only some have normals, the others get the
//! zero normal; a face with zero normals is flat. Mitsuba does not support negative indices, and reads uninitialised
//! memory for a corner without a normal in a file with normals. As in Mitsuba, an index must refer to a value above its
//! line. Lines that continue after a backslash are not supported; they are an error in statements that the reader uses.
//!
//! We have our own reader because the errors of the crate `tobj` do not state the line of the file.

use std::collections::HashMap;
use std::path::Path;

use super::data::{self, MeshData, MeshError, MeshFault, check_vertex_count, quoted};

/// Reads an OBJ file. With `flip_tex_coords` (Mitsuba's default for OBJ: true) v becomes 1 - v.
///
/// # Errors
///
/// The file cannot be read, a line is not valid (the error states its number), or the mesh does not pass
/// [`MeshData::new`].
pub fn read_obj(path: &Path, flip_tex_coords: bool) -> Result<MeshData, MeshError> {
    data::read(path, |bytes| parse(bytes, flip_tex_coords))
}

fn parse(bytes: &[u8], flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
    // A byte order mark is not part of the first statement.
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let mut reader = Reader::default();
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        reader.statement(line).map_err(|what| MeshFault::Syntax { line: number + 1, what })?;
    }
    reader.finish(flip_tex_coords)
}

/// The indices of one corner of a face, counted from 0.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    v: u32,
    vt: Option<u32>,
    vn: Option<u32>,
}

/// The values and faces that have been read so far.
#[derive(Default)]
struct Reader {
    positions: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// The distinct corners in the order in which the faces first use them: the vertices of the mesh.
    corners: Vec<Corner>,
    vertex_of: HashMap<Corner, u32>,
    triangles: Vec<[u32; 3]>,
}

impl Reader {
    /// Reads one line. The error describes its fault.
    fn statement(&mut self, line: &[u8]) -> Result<(), String> {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        match words.next() {
            Some(b"v") => self.positions.push(numbers("v", words)?),
            Some(b"vt") => self.uvs.push(numbers("vt", words)?),
            Some(b"vn") => self.normals.push(numbers("vn", words)?),
            Some(b"f") => self.face(words.take_while(|word| !word.starts_with(b"#")))?,
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), String> {
        let mut count = 0;
        let (mut first, mut last) = (0, 0);
        for word in words {
            let vertex = self.vertex(word)?;
            match count {
                0 => first = vertex,
                1 => {}
                _ => self.triangles.push([first, last, vertex]),
            }
            last = vertex;
            count += 1;
        }
        if count < 3 { Err(format!("the face has {count} corners; it needs 3 or more")) } else { Ok(()) }
    }

    /// The vertex of the mesh for a corner such as `3/1/2`. A new vertex is added when a corner occurs for the first
    /// time.
    fn vertex(&mut self, word: &[u8]) -> Result<u32, String> {
        let mut parts = word.split(|&byte| byte == b'/');
        let mut part = |of, count| index(of, parts.next().unwrap_or_default(), count);
        let v = part("vertex", self.positions.len())?;
        let vt = part("texture coordinate", self.uvs.len())?;
        let vn = part("normal", self.normals.len())?;
        let (Some(v), None) = (v, parts.next()) else {
            return Err(format!("{} is not a corner of a face; known: v, v/vt, v//vn, v/vt/vn", quoted(word)));
        };
        let corner = Corner { v, vt, vn };
        if let Some(&vertex) = self.vertex_of.get(&corner) {
            return Ok(vertex);
        }
        check_vertex_count(self.corners.len() as u64 + 1).map_err(|fault| fault.to_string())?;
        let vertex = self.corners.len() as u32;
        self.corners.push(corner);
        self.vertex_of.insert(corner, vertex);
        Ok(vertex)
    }

    fn finish(self, flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
        let Self { positions, uvs, normals, corners, .. } = self;
        let uv = |corner: &Corner| corner.vt.map_or([0.0; 2], |vt| flip(uvs[vt as usize], flip_tex_coords));
        let normal = |corner: &Corner| corner.vn.map_or([0.0; 3], |vn| normals[vn as usize]);
        let has_uvs = corners.iter().any(|corner| corner.vt.is_some());
        let has_normals = corners.iter().any(|corner| corner.vn.is_some());
        MeshData::new(
            corners.iter().map(|corner| positions[corner.v as usize]).collect(),
            has_normals.then(|| corners.iter().map(normal).collect()),
            has_uvs.then(|| corners.iter().map(uv).collect()),
            self.triangles,
        )
    }
}

fn flip([u, v]: [f32; 2], flip_tex_coords: bool) -> [f32; 2] {
    if flip_tex_coords { [u, 1.0 - v] } else { [u, v] }
}

/// The first `N` numbers of a statement.
fn numbers<'a, const N: usize>(statement: &str, mut words: impl Iterator<Item = &'a [u8]>) -> Result<[f32; N], String> {
    let mut numbers = [0.0; N];
    for (read, number) in numbers.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| format!("{statement} needs {N} numbers, but has {read}"))?;
        let parsed: Option<f32> = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
        *number = parsed.ok_or_else(|| format!("{} is not a number", quoted(word)))?;
        if !number.is_finite() {
            return Err(format!("{} is not finite in single precision", quoted(word)));
        }
    }
    Ok(numbers)
}

/// The position, from 0, to which an index word refers among the `count` values so far. `None` for an empty word.
fn index(of: &str, word: &[u8], count: usize) -> Result<Option<u32>, String> {
    if word.is_empty() {
        return Ok(None);
    }
    let parsed: Option<i64> = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
    let index = parsed.ok_or_else(|| format!("{} is not the index of a {of}", quoted(word)))?;
    // 1 is the first value and -1 the last. An index of 0 gives `count`, which is out of range.
    let position = if index > 0 { index.checked_sub(1) } else { index.checked_add(count as i64) };
    match position.and_then(|position| u32::try_from(position).ok()).filter(|&position| (position as usize) < count) {
        Some(position) => Ok(Some(position)),
        None => Err(format!(
            "the face uses {of} {index}, but {count} are defined above it (indices start at 1, or at -1 backwards)"
        )),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn read(text: &str) -> MeshData {
        parse(text.as_bytes(), false).expect(text)
    }

    fn error(text: &str) -> String {
        let message = parse(text.as_bytes(), false).expect_err(text).to_string();
        assert!(!message.contains(['\n', '\r']), "more than a line: {message}");
        message
    }

    fn square(faces: &str) -> MeshData {
        read(&format!("{SQUARE}vt 0 0.25\nvt 1 0.5\nvn 0 0 1\nvn 0 1 1\n{faces}\n"))
    }

    #[test]
    fn corners_may_omit_texture_coordinates_and_normals() {
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
        let uvs = Some(vec![[0.0, 0.25], [1.0, 0.5], [0.0, 0.25]]);
        let normals = Some(vec![[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]);
        let mesh = |normals: &Option<_>, uvs: &Option<_>| MeshData {
            positions: positions.clone(),
            normals: normals.clone(),
            uvs: uvs.clone(),
            triangles: vec![[0, 1, 2]],
            slivers: vec![],
        };
        assert_eq!(square("f 1 2 3"), mesh(&None, &None));
        assert_eq!(square("f 1/1 2/2 3/1"), mesh(&None, &uvs));
        assert_eq!(square("f 1/1/ 2/2/ 3/1/"), mesh(&None, &uvs));
        assert_eq!(square("f 1//1 2//2 3//1"), mesh(&normals, &None));
        assert_eq!(square("f 1/1/1 2/2/2 3/1/1"), mesh(&normals, &uvs));
        assert_eq!(square("f -4/-2/-2 -3/-1/-1 -2/-2/-2"), mesh(&normals, &uvs));
    }

    #[test]
    fn negative_indices_count_back_from_their_line() {
        let mesh = read("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nf -4 -3 -1\n");
        assert_eq!(mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 5.0]]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 3]]);
    }

    #[test]
    fn a_vertex_is_a_distinct_triple_of_indices() {
        let mesh = square("f 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/1\nf 1/2/1 2/1/2 3/1/1");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 2]]);
        assert_eq!(mesh.positions[4], mesh.positions[0]);
        assert_eq!(mesh.uvs.expect("given")[4], [1.0, 0.5]);
        assert_eq!(mesh.normals.expect("given")[5], [0.0, 1.0, 1.0]);
    }

    #[test]
    fn a_polygon_becomes_a_fan() {
        assert_eq!(square("f 1 2 3 4").triangles, [[0, 1, 2], [0, 2, 3]]);
        let pentagon = read(&format!("{SQUARE}v -1 0.5 0\nf 2 3 4 5 1"));
        assert_eq!(pentagon.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        assert_eq!(pentagon.positions[0], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn omitted_attributes_of_a_corner_are_zero() {
        let mesh = square("f 1/2/1 2/1/1 3/1/1\nf 1 3 4");
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(mesh.normals.expect("given")[3..], [[0.0; 3]; 3]);
        assert_eq!(mesh.uvs.expect("given")[3..], [[0.0; 2]; 3]);
    }

    #[test]
    fn texture_coordinates_can_be_flipped() {
        let text = format!("{SQUARE}vt 0 0.25\nvt 1 0.5 7\nf 1/1 2/2 3");
        let flipped = parse(text.as_bytes(), true).expect("a mesh").uvs.expect("given");
        assert_eq!(flipped, [[0.0, 0.75], [1.0, 0.5], [0.0, 0.0]]);
    }

    #[test]
    fn other_statements_and_blanks_are_ignored() {
        let text = "\u{feff}v 0 0 0 1.0\r\n# comment\r\no thing\r\ng a b\r\ns off\r\nmtllib a.mtl\r\nusemtl red\r\n\r\n\
            \tv  1\t0 0 0.5 0.5 0.5\r\n  v 0 1 0\r\nvp 1 2\r\nl 1 2\r\nf 1 2 3 # front\r\n";
        let mesh = read(text);
        assert_eq!(mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn triangles_of_zero_area_become_slivers() {
        let mesh = square("f 1 1 2\nf 1 2 3");
        assert_eq!((mesh.triangles, mesh.slivers.len()), (vec![[0, 1, 2]], 1));
        assert_eq!(error(SQUARE), "the mesh has no triangle");
        assert_eq!(error(""), "the mesh has no triangle");
    }

    #[test]
    fn errors_name_the_line() {
        let cases = [
            (
                "f 1 2 5",
                "line 5: the face uses vertex 5, but 4 are defined above it (indices start at 1, or at -1 backwards)",
            ),
            ("f 0 1 2", "line 5: the face uses vertex 0, but 4 are defined above it"),
            ("f -5 1 2", "line 5: the face uses vertex -5, but 4 are defined above it"),
            ("f 1/1 2/1 3/1", "line 5: the face uses texture coordinate 1, but 0 are defined above it"),
            ("vn 0 0 1\nf 1//1 2//2 3//1", "line 6: the face uses normal 2, but 1 are defined above it"),
            ("f 9223372036854775807 -9223372036854775808 1", "line 5: the face uses vertex 9223372036854775807, but"),
            (
                "f -9223372036854775808 1 2",
                "line 5: the face uses vertex -9223372036854775808, but 4 are defined above it",
            ),
            ("f 9223372036854775808 1 2", "line 5: \"9223372036854775808\" is not the index of a vertex"),
            ("f 1 2 x", "line 5: \"x\" is not the index of a vertex"),
            ("f 1 2 3 \\", "line 5: \"\\\\\" is not the index of a vertex"),
            ("f 1/a 2 3", "line 5: \"a\" is not the index of a texture coordinate"),
            ("f 1//0 2 3", "line 5: the face uses normal 0, but 0 are defined above it"),
            ("f /1 2 3", "line 5: the face uses texture coordinate 1, but"),
            ("f //", "line 5: \"//\" is not a corner of a face; known: v, v/vt, v//vn, v/vt/vn"),
            ("f 1//// 2 3", "line 5: \"1////\" is not a corner of a face; known: v, v/vt, v//vn, v/vt/vn"),
            ("f 1 2", "line 5: the face has 2 corners; it needs 3 or more"),
            ("f", "line 5: the face has 0 corners; it needs 3 or more"),
            ("\n\nv 1 2", "line 7: v needs 3 numbers, but has 2"),
            ("vt 1", "line 5: vt needs 2 numbers, but has 1"),
            ("vn 1 2 three", "line 5: \"three\" is not a number"),
            ("v 1 nan 2", "line 5: \"nan\" is not finite in single precision"),
            ("v 1 1e39 2", "line 5: \"1e39\" is not finite in single precision"),
        ];
        for (line, expected) in cases {
            let message = error(&format!("{SQUARE}{line}\nf 1 2 3\n"));
            assert!(message.starts_with(expected), "{message}\n{expected}");
        }
    }

    #[test]
    fn errors_name_the_file() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("box.obj");
        std::fs::write(&path, format!("{SQUARE}f 1 2 3")).expect("a file for the test");
        assert_eq!(read_obj(&path, true).expect("a mesh").triangles, [[0, 1, 2]]);
        std::fs::write(&path, "v 1 2").expect("a file for the test");
        let message = read_obj(&path, true).expect_err("broken").to_string();
        assert_eq!(message, format!("{}: line 1: v needs 3 numbers, but has 2", path.display()));
    }

    /// Parses arbitrary bytes: the parser does not panic, the mesh keeps its guarantees, and memory is proportional to
    /// the file's size.
    fn read_anything(bytes: &[u8]) {
        let Ok(mesh) = parse(bytes, true) else { return };
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < vertices));
        assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
        assert!(mesh.normals.is_none_or(|normals| normals.len() == vertices));
        assert!(12 * (mesh.positions.capacity() + mesh.triangles.capacity()) <= 64 * bytes.len());
    }

    proptest! {
        #[test]
        fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            read_anything(&bytes);
        }

        #[test]
        fn random_faces_never_panic(text in "(f( -?[0-9]{1,2}(/-?[0-5]?(/-?[0-5]?)?)?){1,6}\n|vt 0 1\n|vn 0 1 0\n){0,9}") {
            read_anything(format!("{SQUARE}{text}").as_bytes());
        }

        /// A face with negative indices equals the face with the corresponding positive indices.
        #[test]
        fn negative_and_positive_indices_agree(v in prop::array::uniform3(1..=4_i64), below in 0..3_usize) {
            let face = |v: [i64; 3]| format!("{SQUARE}f {} {} {}\n{}f 1 2 3\n", v[0], v[1], v[2], "v 1 2 3\n".repeat(below));
            prop_assert_eq!(read(&face(v)), read(&face(v.map(|v| v - 5))));
        }

        #[test]
        fn mutated_files_never_panic(
            mutations in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>(), any::<u8>()), 1..8),
        ) {
            let mut bytes = format!("{SQUARE}vt 0 1\nvn 0 0 1\nf 1/1/1 2/1/1 3//1 4\nf -1 -2 -3\n").into_bytes();
            for (position, is_plausible, byte) in mutations {
                let at = position.index(bytes.len());
                bytes[at] = if is_plausible { b" \n/-0123456789vftn"[usize::from(byte) % 17] } else { byte };
            }
            read_anything(&bytes);
        }
    }
}
