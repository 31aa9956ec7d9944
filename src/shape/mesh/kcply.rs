//! kcply, a text format of triangles: the line `kcply`, the lines `element vertex N` and `element face M`, then N lines
//! `x y z` and M lines `3 i j k`.
//!
//! The file does not state whether indices count from 0 or from 1. The base is 0 if the least index is 0, and 1 if the
//! greatest index is N. If neither is the case, the user has to state the base.

use std::path::Path;

use super::data::{self, MeshData, MeshError, MeshFault, check_vertex_count, quoted};

/// The index of the first vertex of a kcply file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexBase {
    /// Determined from the indices.
    Auto,
    /// The first vertex has index 0.
    Zero,
    /// The first vertex has index 1.
    One,
}

/// Reads a kcply file.
///
/// # Errors
///
/// The file cannot be read, its header is wrong, it has fewer or more lines than its header declares, a word is not a
/// number, a face does not have three corners, the index base cannot be determined, or its mesh does not pass
/// [`MeshData::new`].
pub fn read_kcply(path: &Path, base: IndexBase) -> Result<MeshData, MeshError> {
    data::read(path, |bytes| parse(bytes, base))
}

fn syntax(line: usize, what: impl Into<String>) -> MeshFault {
    MeshFault::Syntax { line, what: what.into() }
}

/// The lines of a file, numbered from 1, without blank lines at the end.
struct Lines<'b> {
    rest: Option<&'b [u8]>,
    number: usize,
}

impl<'b> Lines<'b> {
    fn new(bytes: &'b [u8]) -> Self {
        Self { rest: Some(bytes.trim_ascii_end()), number: 0 }
    }

    /// The next line with its number.
    fn next(&mut self) -> Option<(usize, &'b [u8])> {
        let rest = self.rest?;
        let end = rest.iter().position(|byte| *byte == b'\n');
        self.rest = end.map(|end| &rest[end + 1..]);
        self.number += 1;
        Some((self.number, rest[..end.unwrap_or(rest.len())].trim_ascii()))
    }
}

fn parse(bytes: &[u8], base: IndexBase) -> Result<MeshData, MeshFault> {
    let mut lines = Lines::new(bytes);
    match lines.next() {
        Some((_, b"kcply")) => {}
        other => {
            let found = quoted(other.map_or(b"".as_slice(), |(_, line)| line));
            return Err(syntax(1, format!("found {found}; a kcply file begins with the line \"kcply\"")));
        }
    }
    let vertices = count(&mut lines, "vertex", bytes.len(), 6)?;
    let faces = count(&mut lines, "face", bytes.len(), 8)?;
    check_vertex_count(vertices)?;
    let mut positions = Vec::with_capacity(vertices as usize);
    for read in 0..vertices {
        let (line, text) = lines.next().ok_or_else(|| truncated("vertex", vertices, read))?;
        positions.push(position(text).map_err(|what| syntax(line, what))?);
    }
    let mut corners = Vec::with_capacity(faces as usize);
    for read in 0..faces {
        let (line, text) = lines.next().ok_or_else(|| truncated("face", faces, read))?;
        corners.push(face(text).map_err(|what| syntax(line, what))?);
    }
    if let Some((line, text)) = lines.next() {
        return Err(syntax(line, format!("{} follows the last face that the header declares", quoted(text))));
    }
    let first = first_index(&corners, positions.len(), base)?;
    let last = first + positions.len() as i64 - 1;
    let rebase = |(face, corners): (usize, &[i64; 3])| match corners.iter().find(|i| !(first..=last).contains(i)) {
        None => Ok(corners.map(|index| (index - first) as u32)),
        Some(index) => {
            let line = 4 + positions.len() + face;
            Err(syntax(line, format!("no vertex has the index {index}; the indices range from {first} to {last}")))
        }
    };
    let triangles = corners.iter().enumerate().map(rebase).collect::<Result<_, MeshFault>>()?;
    MeshData::new(positions, None, None, triangles)
}

/// The number in a line `element NAME N`. A file of `size` bytes must have room for the elements, each of which takes
/// at least `least` bytes.
fn count(lines: &mut Lines<'_>, element: &str, size: usize, least: usize) -> Result<u64, MeshFault> {
    let Some((line, text)) = lines.next() else {
        return Err(syntax(1, format!("the file ends before its line \"element {element} N\"")));
    };
    let words: Vec<&[u8]> = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
    let declared = match words[..] {
        [b"element", name, number] if name == element.as_bytes() => parse_word::<u64>(number),
        _ => None,
    };
    let declared =
        declared.ok_or_else(|| syntax(line, format!("found {}; expected \"element {element} N\"", quoted(text))))?;
    let room = (size / least) as u64 + 1;
    if declared > room {
        return Err(MeshFault::NoRoom { element: element.into(), declared, room });
    }
    Ok(declared)
}

fn truncated(element: &str, declared: u64, read: u64) -> MeshFault {
    MeshFault::Truncated { element: element.into(), declared, read }
}

fn parse_word<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn numbers<T: std::str::FromStr>(text: &[u8], expected: &str) -> Result<Vec<T>, String> {
    let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    words
        .map(|word| parse_word(word).ok_or_else(|| format!("{} is not a number; expected {expected}", quoted(word))))
        .collect()
}

fn position(text: &[u8]) -> Result<[f32; 3], String> {
    let found = numbers::<f32>(text, "\"x y z\"")?;
    <[f32; 3]>::try_from(found.as_slice()).map_err(|_| format!("a vertex has {} numbers, not 3", found.len()))
}

fn face(text: &[u8]) -> Result<[i64; 3], String> {
    match numbers::<i64>(text, "\"3 i j k\"")?[..] {
        [3, i, j, k] => Ok([i, j, k]),
        [corners, ..] if corners != 3 => Err(format!("a face has {corners} corners; only triangles are allowed")),
        ref other => Err(format!("a face has {} numbers, not 4: \"3 i j k\"", other.len())),
    }
}

/// The index of the first vertex.
fn first_index(corners: &[[i64; 3]], vertices: usize, base: IndexBase) -> Result<i64, MeshFault> {
    let indices = || corners.iter().flatten().copied();
    let (least, greatest) = (indices().min().unwrap_or(0), indices().max().unwrap_or(0));
    let has_last = usize::try_from(greatest).is_ok_and(|greatest| greatest == vertices);
    match base {
        IndexBase::Zero => Ok(0),
        IndexBase::One => Ok(1),
        IndexBase::Auto if least == 0 && has_last => Err(MeshFault::TwoBases { vertices }),
        IndexBase::Auto if least <= 0 => Ok(0),
        IndexBase::Auto if has_last => Ok(1),
        IndexBase::Auto => Err(MeshFault::AmbiguousBase { least, greatest, vertices }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: &str = "0 0 0\n1 0 0 \n0 1 0\n0 0 1\n";

    fn read(faces: &str, base: IndexBase) -> Result<MeshData, String> {
        let text = format!("kcply\nelement vertex 4\nelement face {}\n{CORNERS}{faces}", faces.lines().count());
        parse(text.as_bytes(), base).map_err(|fault| fault.to_string())
    }

    fn error(text: &str) -> String {
        parse(text.as_bytes(), IndexBase::Auto).expect_err("it is wrong").to_string()
    }

    #[test]
    fn the_base_is_determined_from_the_indices() {
        let zero = read("3 0 1 2\n3 1 2 3\n", IndexBase::Auto).expect("0 is the least");
        let one = read("3 1 2 3\r\n3 2 3 4  \n", IndexBase::Auto).expect("4 is the greatest");
        assert_eq!(zero, one);
        assert_eq!(zero.triangles, [[0, 1, 2], [1, 2, 3]]);
        assert_eq!(zero.positions[3], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn an_ambiguous_base_must_be_stated() {
        let message = read("3 1 2 3\n", IndexBase::Auto).expect_err("either base");
        assert!(message.contains("index_base") && message.contains("from 1 to 3"), "{message}");
        assert_eq!(read("3 1 2 3\n", IndexBase::Zero).expect("stated").triangles, [[1, 2, 3]]);
        assert_eq!(read("3 1 2 3\n", IndexBase::One).expect("stated").triangles, [[0, 1, 2]]);
    }

    #[test]
    fn indices_that_fit_neither_base_are_errors() {
        assert!(read("3 0 1 4\n", IndexBase::Auto).expect_err("both").contains("both 0 and 4"));
        assert!(
            read("3 0 1 5\n", IndexBase::Auto)
                .expect_err("outside")
                .contains("line 8: no vertex has the index 5; the indices range from 0 to 3")
        );
        assert!(read("3 -1 1 2\n", IndexBase::Auto).expect_err("outside").contains("index -1"));
        assert!(
            read("3 1 2 4\n", IndexBase::Zero).expect_err("outside").contains("index 4; the indices range from 0 to 3")
        );
        assert!(
            read("3 0 2 1\n", IndexBase::One).expect_err("outside").contains("index 0; the indices range from 1 to 4")
        );
    }

    #[test]
    fn errors_name_the_line_and_the_fault() {
        assert_eq!(error("ply\n"), "line 1: found \"ply\"; a kcply file begins with the line \"kcply\"");
        assert!(error("kcply\nelement face 3\n").starts_with("line 2: found \"element face 3\"; expected"));
        assert!(error("kcply\nelement vertex 1\ncomment x\n").starts_with("line 3: found \"comment x\""));
        let head = "kcply\nelement vertex 3\nelement face 1\n";
        assert_eq!(error(&format!("{head}0 0 0\n1 0 0\n")), "the header declares 3 vertices, the file ends after 2");
        let body = format!("{head}0 0 0\n1 0 0\n0 1 0\n");
        assert_eq!(error(&body), "the header declares 1 faces, the file ends after 0");
        assert_eq!(error(&format!("{body}4 0 1 2 1\n")), "line 7: a face has 4 corners; only triangles are allowed");
        assert_eq!(error(&format!("{body}3 0 1\n")), "line 7: a face has 3 numbers, not 4: \"3 i j k\"");
        assert!(error(&format!("{body}3 0 1 x\n")).starts_with("line 7: \"x\" is not a number"));
        assert!(error(&format!("{body}3 0 1 2\n3 0 1 2\n")).starts_with("line 8: \"3 0 1 2\" follows"));
        assert!(error(&format!("{head}0 0\n")).starts_with("line 4: a vertex has 2 numbers"));
        assert!(error(&format!("{head}0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n")).contains("not finite"));
        assert!(error("kcply\nelement vertex 99999999\nelement face 1\n").contains("has room for"));
    }
}
