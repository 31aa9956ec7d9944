//! kcply, a text format of triangles: the line `kcply`, the lines `element vertex N` and `element face M`, then N lines
//! `x y z` and M lines `3 i j k`.
//!
//! Whether indices count from 0 or from 1 does not stand in the file. A least index of 0 says the one, a greatest index
//! of N the other; if neither occurs the user has to say.

use std::path::Path;

use super::data::{self, MeshData, MeshError, MeshFault, check_vertex_count, quoted};

/// What the vertices of a kcply file are numbered from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexBase {
    /// As the indices show.
    Auto,
    /// The first vertex is number 0.
    Zero,
    /// The first vertex is number 1.
    One,
}

/// Reads a kcply file.
///
/// # Errors
///
/// The file cannot be read, its header has other lines, it holds fewer or more lines than its header says, a number is
/// none, a face has other than three corners, it does not show what its indices count from, or its mesh does not pass
/// [`MeshData::new`].
pub fn read_kcply(path: &Path, base: IndexBase) -> Result<MeshData, MeshError> {
    data::read(path, |bytes| parse(bytes, base))
}

fn syntax(line: usize, what: impl Into<String>) -> MeshFault {
    MeshFault::Syntax { line, what: what.into() }
}

/// The lines of a file, numbered from 1; blank ones at the end do not count.
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
            return Err(syntax(1, format!("{found} stands where a kcply file has \"kcply\"")));
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
        return Err(syntax(line, format!("{} stands behind the last face that the header promises", quoted(text))));
    }
    let first = first_index(&corners, positions.len(), base)?;
    let last = first + positions.len() as i64 - 1;
    let number = |(face, corners): (usize, &[i64; 3])| match corners.iter().find(|i| !(first..=last).contains(i)) {
        None => Ok(corners.map(|index| (index - first) as u32)),
        Some(index) => {
            let line = 4 + positions.len() + face;
            Err(syntax(line, format!("no vertex has the number {index}; they go from {first} to {last}")))
        }
    };
    let triangles = corners.iter().enumerate().map(number).collect::<Result<_, MeshFault>>()?;
    MeshData::new(positions, None, None, triangles)
}

/// The number in a line `element NAME N`, not more than a file of this size has room for.
fn count(lines: &mut Lines<'_>, element: &str, size: usize, least: usize) -> Result<u64, MeshFault> {
    let Some((line, text)) = lines.next() else {
        return Err(syntax(1, format!("the file ends before its line \"element {element} N\"")));
    };
    let words: Vec<&[u8]> = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
    let promised = match words[..] {
        [b"element", name, number] if name == element.as_bytes() => parse_word::<u64>(number),
        _ => None,
    };
    let promised = promised.ok_or_else(|| {
        syntax(line, format!("{} stands where a kcply file has \"element {element} N\"", quoted(text)))
    })?;
    let room = (size / least) as u64 + 1;
    if promised > room {
        return Err(MeshFault::NoRoom { element: element.into(), promised, room });
    }
    Ok(promised)
}

fn truncated(element: &str, promised: u64, read: u64) -> MeshFault {
    MeshFault::Truncated { element: element.into(), promised, read }
}

fn parse_word<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn numbers<T: std::str::FromStr>(text: &[u8], expected: &str) -> Result<Vec<T>, String> {
    let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    words
        .map(|word| parse_word(word).ok_or_else(|| format!("{} is no number; expected {expected}", quoted(word))))
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

/// What the indices count from.
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
    fn the_base_shows_in_the_indices() {
        let zero = read("3 0 1 2\n3 1 2 3\n", IndexBase::Auto).expect("0 is the least");
        let one = read("3 1 2 3\r\n3 2 3 4  \n", IndexBase::Auto).expect("4 is the greatest");
        assert_eq!(zero, one);
        assert_eq!(zero.triangles, [[0, 1, 2], [1, 2, 3]]);
        assert_eq!(zero.positions[3], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn an_ambiguous_base_must_be_said() {
        let message = read("3 1 2 3\n", IndexBase::Auto).expect_err("either");
        assert!(message.contains("index_base") && message.contains("from 1 to 3"), "{message}");
        assert_eq!(read("3 1 2 3\n", IndexBase::Zero).expect("said").triangles, [[1, 2, 3]]);
        assert_eq!(read("3 1 2 3\n", IndexBase::One).expect("said").triangles, [[0, 1, 2]]);
    }

    #[test]
    fn indices_that_fit_no_base() {
        assert!(read("3 0 1 4\n", IndexBase::Auto).expect_err("both").contains("both 0 and 4"));
        assert!(
            read("3 0 1 5\n", IndexBase::Auto)
                .expect_err("outside")
                .contains("line 8: no vertex has the number 5; they go from 0 to 3")
        );
        assert!(read("3 -1 1 2\n", IndexBase::Auto).expect_err("outside").contains("number -1"));
        assert!(read("3 1 2 4\n", IndexBase::Zero).expect_err("outside").contains("number 4; they go from 0 to 3"));
        assert!(read("3 0 2 1\n", IndexBase::One).expect_err("outside").contains("number 0; they go from 1 to 4"));
    }

    #[test]
    fn errors_say_where_and_what() {
        assert_eq!(error("ply\n"), "line 1: \"ply\" stands where a kcply file has \"kcply\"");
        assert!(error("kcply\nelement face 3\n").starts_with("line 2: \"element face 3\" stands where"));
        assert!(error("kcply\nelement vertex 1\ncomment x\n").starts_with("line 3: \"comment x\""));
        let head = "kcply\nelement vertex 3\nelement face 1\n";
        assert_eq!(error(&format!("{head}0 0 0\n1 0 0\n")), "the header promises 3 vertices, the file ends after 2");
        let body = format!("{head}0 0 0\n1 0 0\n0 1 0\n");
        assert_eq!(error(&body), "the header promises 1 faces, the file ends after 0");
        assert_eq!(error(&format!("{body}4 0 1 2 1\n")), "line 7: a face has 4 corners; only triangles are allowed");
        assert_eq!(error(&format!("{body}3 0 1\n")), "line 7: a face has 3 numbers, not 4: \"3 i j k\"");
        assert!(error(&format!("{body}3 0 1 x\n")).starts_with("line 7: \"x\" is no number"));
        assert!(error(&format!("{body}3 0 1 2\n3 0 1 2\n")).starts_with("line 8: \"3 0 1 2\" stands behind"));
        assert!(error(&format!("{head}0 0\n")).starts_with("line 4: a vertex has 2 numbers"));
        assert!(error(&format!("{head}0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n")).contains("not finite"));
        assert!(error("kcply\nelement vertex 99999999\nelement face 1\n").contains("has room for"));
    }
}
