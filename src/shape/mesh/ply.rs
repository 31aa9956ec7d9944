//! PLY, the Stanford triangle format, in its three encodings.
//!
//! Read: `ascii`, `binary_little_endian`, `binary_big_endian`; LF and CRLF headers; `comment` and `obj_info` lines;
//! every scalar type by its old and its new name (`float`, `float32`), and the 64-bit integers. Of the element
//! `vertex`: `x y z`, `nx ny nz`, and `u v`, else `texture_u texture_v`, else `s t`; normals and texture coordinates
//! count only with all their components. Of the element `face`: the list `vertex_indices` or `vertex_index`, of any
//! integer types. Other properties and elements are skipped. Integers are taken as they are, never as fractions of
//! their type's range.
//!
//! A face with more than three corners becomes a fan around its first corner, which is right for convex polygons;
//! Mitsuba refuses all but triangles. Mitsuba also refuses `obj_info` and accepts indices out of range.
//!
//! The numbers of an ascii file may be broken into lines anyhow, as Mitsuba allows. What follows the last element is
//! an error, but for blanks in an ascii file: as in Mitsuba, and because it shows a header that counts wrongly. An
//! ascii file that is cut inside the digits of its last number cannot be told from a whole one.
//!
//! The reader is our own: the crate `ply-rs-bw` reads from a stream, and so can neither weigh what a header promises
//! against the size of the file nor see what trails.

use std::path::Path;

use super::data::{self, MeshData, MeshError, MeshFault, check_index, quoted};

/// Reads a PLY file. With `flip_tex_coords` (Mitsuba's default for PLY: false) v becomes 1 - v.
///
/// # Errors
///
/// The file cannot be read, is no PLY file, promises more than it holds or holds more than it promises, or its mesh
/// does not pass [`MeshData::new`]. Whatever the bytes, memory stays within a fixed multiple of the file's size.
pub fn read_ply(path: &Path, flip_tex_coords: bool) -> Result<MeshData, MeshError> {
    data::read(path, |bytes| parse(bytes, flip_tex_coords))
}

/// The longest header, in bytes: far beyond any in use, and what keeps a hostile one from costing time.
const HEADER_LIMIT: usize = 1 << 16;

fn parse(bytes: &[u8], flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
    let header = Header::parse(bytes)?;
    match header.encoding {
        Encoding::Ascii => gather(&header, Ascii { bytes, at: header.end }, flip_tex_coords),
        Encoding::LittleEndian => gather(&header, Binary { bytes, at: header.end, swap: false }, flip_tex_coords),
        Encoding::BigEndian => gather(&header, Binary { bytes, at: header.end, swap: true }, flip_tex_coords),
    }
}

/// Walks through the elements in the order of the file and keeps what makes a mesh.
fn gather<S: Source>(header: &Header, mut source: S, flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
    let vertex = header.element("vertex")?;
    let face = header.element("face")?;
    let layout = VertexLayout::of(vertex)?;
    let list = IndexList::of(face)?;
    check_room(header, &source)?;

    let mut vertices = Vertices::default();
    let mut triangles = Vec::new();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => vertices = read_vertices(&mut source, element, &layout)?,
            // The number of vertices is in the header, whichever element comes first.
            "face" => triangles = read_faces(&mut source, element, &list, vertex.count as usize)?,
            _ => skip_element(&mut source, element)?,
        }
    }
    source.finish()?;

    let Vertices { positions, normals, mut uvs } = vertices;
    if flip_tex_coords {
        uvs.iter_mut().for_each(|uv| uv[1] = 1.0 - uv[1]);
    }
    MeshData::new(positions, layout.has_normals.then_some(normals), layout.has_uvs.then_some(uvs), triangles)
}

/// Compares what the header promises with the bytes there are, before any memory is taken for it.
fn check_room<S: Source>(header: &Header, source: &S) -> Result<(), MeshFault> {
    let mut left = source.left() as u64;
    for element in &header.elements {
        let least = element.least::<S>() as u64;
        // An element without properties takes no room, however often it is promised.
        let room = left.checked_div(least).unwrap_or(element.count);
        if element.count > room {
            return Err(MeshFault::NoRoom { element: element.name.clone(), promised: element.count, room });
        }
        left -= least * element.count;
    }
    Ok(())
}

// ---------------------------------------------------------------------------------------------------- the elements

/// What the vertices bring; a list that their layout lacks stays empty.
#[derive(Default)]
struct Vertices {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
}

/// Where each property of a vertex goes.
struct VertexLayout {
    /// For each property its place in x y z nx ny nz u v, or none for one to skip.
    places: Vec<Option<usize>>,
    has_normals: bool,
    has_uvs: bool,
}

impl VertexLayout {
    fn of(vertex: &Element) -> Result<Self, MeshFault> {
        let mut layout = Self { places: vec![None; vertex.properties.len()], has_normals: false, has_uvs: false };
        if !layout.place(vertex, &["x", "y", "z"], 0) {
            return Err(vertex.fault("needs the properties x, y and z, each a single number"));
        }
        layout.has_normals = layout.place(vertex, &["nx", "ny", "nz"], 3);
        let uvs = [["u", "v"], ["texture_u", "texture_v"], ["s", "t"]];
        layout.has_uvs = uvs.iter().any(|names| layout.place(vertex, names, 6));
        Ok(layout)
    }

    /// Finds all the properties of these names or none.
    fn place(&mut self, vertex: &Element, names: &[&str], first: usize) -> bool {
        let scalar =
            |name: &&str| vertex.properties.iter().position(|p| p.name == *name && matches!(p.kind, Kind::Scalar(_)));
        let Some(found) = names.iter().map(scalar).collect::<Option<Vec<usize>>>() else { return false };
        for (offset, property) in found.into_iter().enumerate() {
            self.places[property] = Some(first + offset);
        }
        true
    }
}

fn read_vertices<S: Source>(source: &mut S, element: &Element, layout: &VertexLayout) -> Result<Vertices, MeshFault> {
    let count = element.count as usize;
    let mut vertices = Vertices::default();
    vertices.positions.reserve_exact(count);
    vertices.normals.reserve_exact(if layout.has_normals { count } else { 0 });
    vertices.uvs.reserve_exact(if layout.has_uvs { count } else { 0 });
    read_element(source, element, |source, number| {
        let mut row = [0.0; 8];
        for (property, place) in element.properties.iter().zip(&layout.places) {
            match (property.kind, place) {
                (Kind::Scalar(scalar), Some(place)) => row[*place] = source.real(scalar)?,
                (kind, _) => skip(source, kind, element, number)?,
            }
        }
        let [x, y, z, nx, ny, nz, u, v] = row;
        vertices.positions.push([x, y, z]);
        if layout.has_normals {
            vertices.normals.push([nx, ny, nz]);
        }
        if layout.has_uvs {
            vertices.uvs.push([u, v]);
        }
        Ok(())
    })?;
    Ok(vertices)
}

/// The property that lists a face's vertices.
struct IndexList {
    /// Its place among the properties.
    place: usize,
    count: Integer,
    item: Integer,
}

impl IndexList {
    fn of(face: &Element) -> Result<Self, MeshFault> {
        let named = |property: &Property| matches!(property.name.as_str(), "vertex_indices" | "vertex_index");
        let list = |(place, property): (usize, &Property)| match property.kind {
            Kind::List { count, item: Scalar::Integer(item) } if named(property) => Some(Self { place, count, item }),
            _ => None,
        };
        let found = face.properties.iter().enumerate().find_map(list);
        found.ok_or_else(|| face.fault("needs a list of integers called vertex_indices or vertex_index"))
    }
}

fn read_faces<S: Source>(
    source: &mut S,
    element: &Element,
    list: &IndexList,
    vertices: usize,
) -> Result<Vec<[u32; 3]>, MeshFault> {
    let mut triangles = Vec::new();
    // The check of room let a face be an empty list; here it takes three indices at least, or it is an error.
    let least = element.least::<S>() + 3 * S::least(Scalar::Integer(list.item));
    triangles.reserve_exact((element.count as usize).min(source.left() / least));
    read_element(source, element, |source, number| {
        for (place, property) in element.properties.iter().enumerate() {
            if place == list.place {
                let corners = list_length(source, list.count, Scalar::Integer(list.item), element, number)?;
                if corners < 3 {
                    return Err(MeshFault::Corners { face: number, corners }.into());
                }
                fan(corners, &mut triangles, || Ok(check_index(number, source.whole(list.item)?, vertices)?))?;
            } else {
                skip(source, property.kind, element, number)?;
            }
        }
        Ok(())
    })?;
    Ok(triangles)
}

/// The triangles of one polygon, a fan around its first corner; `corner` gives the corners in their order.
fn fan(
    corners: usize,
    triangles: &mut Vec<[u32; 3]>,
    mut corner: impl FnMut() -> Result<u32, Halt>,
) -> Result<(), Halt> {
    let (first, mut last) = (corner()?, corner()?);
    for _ in 2..corners {
        let next = corner()?;
        triangles.push([first, last, next]);
        last = next;
    }
    Ok(())
}

fn skip_element<S: Source>(source: &mut S, element: &Element) -> Result<(), MeshFault> {
    if element.properties.is_empty() {
        return Ok(());
    }
    read_element(source, element, |source, number| {
        element.properties.iter().try_for_each(|property| skip(source, property.kind, element, number))
    })
}

/// Reads one kind of element, and says how far it came where the file ends too early.
fn read_element<S: Source>(
    source: &mut S,
    element: &Element,
    mut one: impl FnMut(&mut S, u64) -> Result<(), Halt>,
) -> Result<(), MeshFault> {
    for number in 0..element.count {
        one(source, number).map_err(|halt| match halt {
            Halt::End => MeshFault::Truncated { element: element.name.clone(), promised: element.count, read: number },
            Halt::Fault(fault) => fault,
        })?;
    }
    Ok(())
}

fn skip<S: Source>(source: &mut S, kind: Kind, element: &Element, number: u64) -> Result<(), Halt> {
    match kind {
        Kind::Scalar(scalar) => source.skip(scalar, 1),
        Kind::List { count, item } => {
            let length = list_length(source, count, item, element, number)?;
            source.skip(item, length)
        }
    }
}

/// The length of a list that the rest of the file can hold.
fn list_length<S: Source>(
    source: &mut S,
    count: Integer,
    item: Scalar,
    element: &Element,
    number: u64,
) -> Result<usize, Halt> {
    let length = source.whole(count)?;
    let room = source.left() / S::least(item);
    match usize::try_from(length) {
        Ok(fits) if fits <= room => Ok(fits),
        _ => Err(MeshFault::ListLength { element: element.name.clone(), number, length, room }.into()),
    }
}

// ------------------------------------------------------------------------------------------------------- the header

#[derive(Debug)]
struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// The number of the line that ends the header.
    last_line: usize,
    /// The offset of the first byte after it.
    end: usize,
}

#[derive(Clone, Copy, Debug)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
    /// Where the header introduces it.
    line: usize,
}

#[derive(Debug)]
struct Property {
    name: String,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Scalar(Scalar),
    List { count: Integer, item: Scalar },
}

#[derive(Clone, Copy, Debug)]
enum Scalar {
    Integer(Integer),
    F32,
    F64,
}

#[derive(Clone, Copy, Debug)]
enum Integer {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
}

/// Each type by its old and its new name.
const SCALARS: [(&str, &str, Scalar); 10] = [
    ("char", "int8", Scalar::Integer(Integer::I8)),
    ("uchar", "uint8", Scalar::Integer(Integer::U8)),
    ("short", "int16", Scalar::Integer(Integer::I16)),
    ("ushort", "uint16", Scalar::Integer(Integer::U16)),
    ("int", "int32", Scalar::Integer(Integer::I32)),
    ("uint", "uint32", Scalar::Integer(Integer::U32)),
    ("long", "int64", Scalar::Integer(Integer::I64)),
    ("ulong", "uint64", Scalar::Integer(Integer::U64)),
    ("float", "float32", Scalar::F32),
    ("double", "float64", Scalar::F64),
];

const ENCODINGS: [(&str, Encoding); 3] = [
    ("ascii", Encoding::Ascii),
    ("binary_little_endian", Encoding::LittleEndian),
    ("binary_big_endian", Encoding::BigEndian),
];

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, MeshFault> {
        let mut lines = HeaderLines { bytes, at: 0, line: 0 };
        if !bytes.starts_with(b"ply") || lines.next()? != "ply" {
            return Err(syntax(1, "a PLY file begins with the line \"ply\""));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let text = lines.next()?;
            let line = lines.line;
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            match words[..] {
                [] | ["comment", ..] | ["obj_info", ..] => {}
                ["format", name, version] if encoding.is_none() => encoding = Some(parse_format(name, version, line)?),
                ["format", ..] if encoding.is_some() => return Err(syntax(line, "a second format line")),
                ["element", name, count] => elements.push(parse_element(&elements, name, count, line)?),
                ["property", "list", count, item, name] => {
                    let Scalar::Integer(count) = Scalar::named(count, line)? else {
                        return Err(syntax(line, "the length of a list must have an integer type"));
                    };
                    let item = Scalar::named(item, line)?;
                    push_property(&mut elements, name, Kind::List { count, item }, line)?;
                }
                ["property", scalar, name] => {
                    push_property(&mut elements, name, Kind::Scalar(Scalar::named(scalar, line)?), line)?;
                }
                ["end_header"] => {
                    let encoding = encoding.ok_or_else(|| syntax(line, "the header ends without a format line"))?;
                    return Ok(Self { encoding, elements, last_line: line, end: lines.at });
                }
                _ => return Err(syntax(line, &unknown_line(&text))),
            }
        }
    }

    fn element(&self, name: &str) -> Result<&Element, MeshFault> {
        let found = self.elements.iter().find(|element| element.name == name);
        found.ok_or_else(|| syntax(self.last_line, &format!("the header ends without an element called {name}")))
    }
}

impl Element {
    /// The least number of bytes it takes: its numbers, and lists that are empty.
    fn least<S: Source>(&self) -> usize {
        self.properties.iter().map(|property| S::least(property.kind.first())).sum()
    }

    fn fault(&self, what: &str) -> MeshFault {
        syntax(self.line, &format!("element {} {what}", quoted(self.name.as_bytes())))
    }
}

impl Kind {
    /// What is there of the property in any case: its number, or the length of its list.
    fn first(self) -> Scalar {
        match self {
            Self::Scalar(scalar) => scalar,
            Self::List { count, .. } => Scalar::Integer(count),
        }
    }
}

impl Scalar {
    fn named(name: &str, line: usize) -> Result<Self, MeshFault> {
        SCALARS.iter().find(|(old, new, _)| name == *old || name == *new).map(|entry| entry.2).ok_or_else(|| {
            let known = SCALARS.map(|(old, new, _)| format!("{old} ({new})"));
            syntax(line, &format!("no type is called {}; known: {}", quoted(name.as_bytes()), known.join(", ")))
        })
    }

    /// In bytes.
    fn size(self) -> usize {
        match self {
            Self::Integer(Integer::I8 | Integer::U8) => 1,
            Self::Integer(Integer::I16 | Integer::U16) => 2,
            Self::Integer(Integer::I32 | Integer::U32) | Self::F32 => 4,
            Self::Integer(Integer::I64 | Integer::U64) | Self::F64 => 8,
        }
    }
}

fn parse_format(name: &str, version: &str, line: usize) -> Result<Encoding, MeshFault> {
    let known = ENCODINGS.iter().find(|(known, _)| *known == name);
    match (known, version) {
        (Some((_, encoding)), "1.0") => Ok(*encoding),
        (Some(_), _) => Err(syntax(line, &format!("version {} is not known; known: 1.0", quoted(version.as_bytes())))),
        (None, _) => {
            let known = ENCODINGS.map(|(known, _)| known).join(", ");
            Err(syntax(line, &format!("no format is called {}; known: {known}", quoted(name.as_bytes()))))
        }
    }
}

fn parse_element(before: &[Element], name: &str, count: &str, line: usize) -> Result<Element, MeshFault> {
    if before.iter().any(|element| element.name == name) {
        return Err(syntax(line, &format!("a second element is called {}", quoted(name.as_bytes()))));
    }
    let count = count.parse().map_err(|_| {
        syntax(line, &format!("the number of elements must be an integer from 0, not {}", quoted(count.as_bytes())))
    })?;
    Ok(Element { name: name.to_owned(), count, properties: Vec::new(), line })
}

fn push_property(elements: &mut [Element], name: &str, kind: Kind, line: usize) -> Result<(), MeshFault> {
    let Some(element) = elements.last_mut() else {
        return Err(syntax(line, "a property before the first element"));
    };
    if element.properties.iter().any(|property| property.name == name) {
        return Err(syntax(line, &format!("a second property of the element is called {}", quoted(name.as_bytes()))));
    }
    element.properties.push(Property { name: name.to_owned(), kind });
    Ok(())
}

/// The lines of a header, with LF or CRLF.
struct HeaderLines<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl HeaderLines<'_> {
    fn next(&mut self) -> Result<String, MeshFault> {
        self.line += 1;
        let rest = &self.bytes[self.at..self.bytes.len().min(HEADER_LIMIT)];
        let Some(length) = rest.iter().position(|&byte| byte == b'\n') else {
            return Err(syntax(self.line, &self.without_end()));
        };
        self.at += length + 1;
        let line = &rest[..length];
        // A comment may be in any encoding; all else is ASCII.
        Ok(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)).into_owned())
    }

    fn without_end(&self) -> String {
        if self.bytes.len() > HEADER_LIMIT {
            format!("no end_header in the first {HEADER_LIMIT} bytes")
        } else {
            "the file ends inside its header, without end_header".to_owned()
        }
    }
}

fn unknown_line(text: &str) -> String {
    format!(
        "{} is no line of a PLY header; known: format ENCODING 1.0, comment, obj_info, element NAME COUNT, \
         property TYPE NAME, property list TYPE TYPE NAME, end_header",
        quoted(text.as_bytes())
    )
}

fn syntax(line: usize, what: &str) -> MeshFault {
    MeshFault::Syntax { line, what: what.to_owned() }
}

// -------------------------------------------------------------------------------------------------------- the bytes

/// Why an element cannot be read.
enum Halt {
    /// The file is at its end.
    End,
    Fault(MeshFault),
}

impl From<MeshFault> for Halt {
    fn from(fault: MeshFault) -> Self {
        Self::Fault(fault)
    }
}

/// The data after the header, number by number.
trait Source {
    /// The least number of bytes that a number of this type takes.
    fn least(scalar: Scalar) -> usize;
    /// The number of bytes that are left.
    fn left(&self) -> usize;
    /// The next number, of any type.
    fn real(&mut self, scalar: Scalar) -> Result<f32, Halt>;
    /// The next integer; unsigned ones beyond `i64::MAX` become that.
    fn whole(&mut self, integer: Integer) -> Result<i64, Halt>;
    /// Passes over numbers.
    fn skip(&mut self, scalar: Scalar, times: usize) -> Result<(), Halt>;
    /// Makes sure that nothing is left.
    fn finish(self) -> Result<(), MeshFault>;
}

struct Binary<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Whether the most significant byte comes first.
    swap: bool,
}

impl Binary<'_> {
    /// The next bytes, the least significant one first.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Halt> {
        let mut taken = *self.bytes[self.at..].first_chunk::<N>().ok_or(Halt::End)?;
        self.at += N;
        if self.swap {
            taken.reverse();
        }
        Ok(taken)
    }
}

impl Source for Binary<'_> {
    fn least(scalar: Scalar) -> usize {
        scalar.size()
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn real(&mut self, scalar: Scalar) -> Result<f32, Halt> {
        Ok(match scalar {
            Scalar::F32 => f32::from_le_bytes(self.take()?),
            Scalar::F64 => f64::from_le_bytes(self.take()?) as f32,
            Scalar::Integer(integer) => self.whole(integer)? as f32,
        })
    }

    fn whole(&mut self, integer: Integer) -> Result<i64, Halt> {
        Ok(match integer {
            Integer::I8 => i64::from(i8::from_le_bytes(self.take()?)),
            Integer::U8 => i64::from(u8::from_le_bytes(self.take()?)),
            Integer::I16 => i64::from(i16::from_le_bytes(self.take()?)),
            Integer::U16 => i64::from(u16::from_le_bytes(self.take()?)),
            Integer::I32 => i64::from(i32::from_le_bytes(self.take()?)),
            Integer::U32 => i64::from(u32::from_le_bytes(self.take()?)),
            Integer::I64 => i64::from_le_bytes(self.take()?),
            Integer::U64 => i64::try_from(u64::from_le_bytes(self.take()?)).unwrap_or(i64::MAX),
        })
    }

    fn skip(&mut self, scalar: Scalar, times: usize) -> Result<(), Halt> {
        // A list is skipped only where it fits, so the product is at most the file's size.
        let size = scalar.size() * times;
        if size > self.left() {
            return Err(Halt::End);
        }
        self.at += size;
        Ok(())
    }

    fn finish(self) -> Result<(), MeshFault> {
        if self.left() == 0 {
            return Ok(());
        }
        Err(MeshFault::Trailing { end: self.at, size: self.bytes.len() })
    }
}

struct Ascii<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Ascii<'a> {
    fn word(&mut self) -> Result<&'a [u8], Halt> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or(Halt::End)?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Ok(&rest[start..start + length])
    }

    /// A fault in the word just read, with its line.
    fn fault(&self, word: &[u8], what: &str) -> MeshFault {
        let line = 1 + self.bytes[..self.at].iter().filter(|&&byte| byte == b'\n').count();
        syntax(line, &format!("{} {what}", quoted(word)))
    }

    /// The next word as a number.
    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, Halt> {
        let word = self.word()?;
        let number = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
        number.ok_or_else(|| self.fault(word, what).into())
    }
}

impl Source for Ascii<'_> {
    /// A blank and a digit. The first number after the header lacks the blank, which makes no difference: the check of
    /// room takes lists as empty, and a mesh has at least one that is not.
    fn least(_: Scalar) -> usize {
        2
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn real(&mut self, scalar: Scalar) -> Result<f32, Halt> {
        match scalar {
            Scalar::F32 => self.number("is not a number"),
            // Rounded twice, as from the binary form of the same file.
            Scalar::F64 => Ok(self.number::<f64>("is not a number")? as f32),
            Scalar::Integer(integer) => Ok(self.whole(integer)? as f32),
        }
    }

    fn whole(&mut self, integer: Integer) -> Result<i64, Halt> {
        match integer {
            Integer::I8 => Ok(i64::from(self.number::<i8>("is not an integer from -128 to 127")?)),
            Integer::U8 => Ok(i64::from(self.number::<u8>("is not an integer from 0 to 255")?)),
            Integer::I16 => Ok(i64::from(self.number::<i16>("is not an integer of 16 bits")?)),
            Integer::U16 => Ok(i64::from(self.number::<u16>("is not an integer of 16 bits from 0")?)),
            Integer::I32 => Ok(i64::from(self.number::<i32>("is not an integer of 32 bits")?)),
            Integer::U32 => Ok(i64::from(self.number::<u32>("is not an integer of 32 bits from 0")?)),
            Integer::I64 => self.number("is not an integer of 64 bits"),
            Integer::U64 => {
                Ok(i64::try_from(self.number::<u64>("is not an integer of 64 bits from 0")?).unwrap_or(i64::MAX))
            }
        }
    }

    fn skip(&mut self, _: Scalar, times: usize) -> Result<(), Halt> {
        (0..times).try_for_each(|_| self.word().map(drop))
    }

    fn finish(mut self) -> Result<(), MeshFault> {
        match self.word() {
            Ok(word) => Err(self.fault(word, "follows the last element that the header promises")),
            Err(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

    /// A number with its type, as a test writes it.
    #[derive(Clone, Copy)]
    enum Put {
        U8(u8),
        I16(i16),
        U16(u16),
        I32(i32),
        F32(f32),
        F64(f64),
    }
    use Put::{F32, F64, I16, I32, U8, U16};

    /// Writes rows of numbers after a header, in one of the three encodings.
    fn file(header: &str, encoding: &str, rows: &[&[Put]]) -> Vec<u8> {
        let mut bytes = header.replace("ENCODING", encoding).into_bytes();
        for row in rows {
            for (i, &number) in row.iter().enumerate() {
                let (text, mut number) = match number {
                    U8(x) => (x.to_string(), x.to_be_bytes().to_vec()),
                    I16(x) => (x.to_string(), x.to_be_bytes().to_vec()),
                    U16(x) => (x.to_string(), x.to_be_bytes().to_vec()),
                    I32(x) => (x.to_string(), x.to_be_bytes().to_vec()),
                    F32(x) => (x.to_string(), x.to_be_bytes().to_vec()),
                    F64(x) => (x.to_string(), x.to_be_bytes().to_vec()),
                };
                match encoding {
                    "ascii" => bytes.extend(format!("{}{text}", if i == 0 { "" } else { " " }).bytes()),
                    "binary_big_endian" => bytes.extend(number),
                    _ => {
                        number.reverse();
                        bytes.extend(number);
                    }
                }
            }
            if encoding == "ascii" {
                bytes.push(b'\n');
            }
        }
        bytes
    }

    /// All that may be in a file: unknown elements and properties between what is read, a triangle, a pentagon.
    const RICH: &str = "ply\nformat ENCODING 1.0\ncomment by hand\nobj_info none\nelement camera 2\n\
        property float fov\nproperty list uint8 int16 tags\nelement vertex 5\nproperty uchar red\n\
        property double x\nproperty float y\nproperty float32 z\nproperty list uchar short bones\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n\
        element face 2\nproperty uchar flag\nproperty list ushort int vertex_index\nproperty float area\n\
        element nothing 18446744073709551615\nelement edge 1\nproperty int a\nproperty int b\nend_header\n";

    fn rich(encoding: &str) -> Vec<u8> {
        file(
            RICH,
            encoding,
            &[
                &[F32(40.0), U8(2), I16(-1), I16(300)],
                &[F32(50.0), U8(0)],
                &[U8(255), F64(0.0), F32(0.0), F32(0.5), U8(0), F32(0.0), F32(0.0), F32(1.0), F32(0.0), F32(0.25)],
                &[U8(0), F64(2.0), F32(0.0), F32(0.5), U8(1), I16(7), F32(0.0), F32(1.0), F32(1.0), F32(1.0), F32(0.0)],
                &[U8(1), F64(2.5), F32(1.0), F32(0.5), U8(0), F32(1.0), F32(0.0), F32(1.0), F32(1.0), F32(0.5)],
                &[U8(1), F64(1.0), F32(1.5), F32(0.5), U8(0), F32(0.0), F32(0.0), F32(2.0), F32(0.5), F32(1.0)],
                &[U8(1), F64(-0.1), F32(1.0), F32(0.5), U8(0), F32(0.0), F32(0.0), F32(0.0), F32(0.0), F32(1.0)],
                &[U8(0), U16(3), I32(0), I32(1), I32(3), F32(9.0)],
                &[U8(0), U16(5), I32(0), I32(1), I32(2), I32(3), I32(4), F32(9.0)],
                &[I32(0), I32(1)],
            ],
        )
    }

    fn rich_mesh() -> MeshData {
        MeshData {
            positions: vec![[0.0, 0.0, 0.5], [2.0, 0.0, 0.5], [2.5, 1.0, 0.5], [1.0, 1.5, 0.5], [-0.1, 1.0, 0.5]],
            normals: Some(vec![[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0; 3]]),
            uvs: Some(vec![[0.0, 0.25], [1.0, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 1.0]]),
            triangles: vec![[0, 1, 3], [0, 1, 2], [0, 2, 3], [0, 3, 4]],
            dropped: 0,
        }
    }

    const PLAIN: &str = "ply\nformat ENCODING 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";

    fn plain(encoding: &str) -> Vec<u8> {
        file(
            PLAIN,
            encoding,
            &[
                &[F32(0.0), F32(0.0), F32(0.0)],
                &[F32(1.0), F32(0.0), F32(0.0)],
                &[F32(1.0), F32(1.0), F32(0.0)],
                &[F32(0.0), F32(1.0), F32(0.25)],
                &[U8(3), I32(0), I32(1), I32(2)],
                &[U8(3), I32(0), I32(2), I32(3)],
            ],
        )
    }

    /// The plain ascii file with one passage replaced; the passage must be there.
    fn broken(from: &str, to: &str) -> String {
        let text = String::from_utf8(plain("ascii")).expect("the test writes ASCII");
        assert!(text.contains(from), "{from}");
        error(text.replacen(from, to, 1).as_bytes())
    }

    fn error(bytes: &[u8]) -> String {
        let message = parse(bytes, false).expect_err("the file is broken").to_string();
        assert!(!message.contains(['\n', '\r']), "more than a line: {message}");
        message
    }

    #[test]
    fn the_three_encodings_give_the_same_mesh() {
        for encoding in ENCODINGS {
            assert_eq!(parse(&rich(encoding), false).expect(encoding), rich_mesh(), "{encoding}");
        }
    }

    /// Written byte by byte, so that no helper can be wrong in the same way as the reader.
    #[test]
    fn a_big_endian_file_byte_by_byte() {
        let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty short y\n\
            property double z\nelement face 1\nproperty list uint ushort vertex_indices\nend_header\n"
            .to_vec();
        bytes.extend(b"\x3f\x80\x00\x00\xff\xfe\x40\x00\x00\x00\x00\x00\x00\x00"); // 1, -2, 2
        bytes.extend(b"\x00\x00\x00\x00\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00"); // 0, 256, 0
        bytes.extend(b"\xbf\x00\x00\x00\x00\x03\x3f\xf8\x00\x00\x00\x00\x00\x00"); // -0.5, 3, 1.5
        bytes.extend(b"\x00\x00\x00\x03\x00\x02\x00\x00\x00\x01");
        let mesh = parse(&bytes, false).expect("a whole file");
        assert_eq!(mesh.positions, [[1.0, -2.0, 2.0], [0.0, 256.0, 0.0], [-0.5, 3.0, 1.5]]);
        assert_eq!(mesh.triangles, [[2, 0, 1]]);
        assert_eq!((mesh.normals, mesh.uvs, mesh.dropped), (None, None, 0));
    }

    #[test]
    fn every_type_by_both_names() {
        let types: [(&str, &str, &[u8], f32); 10] = [
            ("char", "int8", &(-3_i8).to_le_bytes(), -3.0),
            ("uchar", "uint8", &203_u8.to_le_bytes(), 203.0),
            ("short", "int16", &(-300_i16).to_le_bytes(), -300.0),
            ("ushort", "uint16", &65_000_u16.to_le_bytes(), 65_000.0),
            ("int", "int32", &(-70_000_i32).to_le_bytes(), -70_000.0),
            ("uint", "uint32", &4_000_000_000_u32.to_le_bytes(), 4e9),
            ("long", "int64", &(-1_i64 << 40).to_le_bytes(), -1_099_511_627_776.0),
            ("ulong", "uint64", &(1_u64 << 40).to_le_bytes(), 1_099_511_627_776.0),
            ("float", "float32", &1.5_f32.to_le_bytes(), 1.5),
            ("double", "float64", &(-0.125_f64).to_le_bytes(), -0.125),
        ];
        for (old, new, encoded, value) in types {
            for name in [old, new] {
                let header = PLAIN.replace("float x", &format!("{name} x"));
                let x = file(&header, "binary_little_endian", &[]).into_iter().chain(encoded.to_vec());
                let corners = [0.0_f32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(f32::to_le_bytes);
                let zero = vec![0; encoded.len()];
                let mut bytes: Vec<u8> = x.chain(corners[..2].concat()).chain(zero.clone()).collect();
                bytes.extend([corners[7], corners[0]].concat().into_iter().chain(zero.clone()));
                bytes.extend([corners[0], corners[7]].concat().into_iter().chain(zero));
                bytes.extend([corners[7], corners[7]].concat());
                bytes.extend(b"\x03\0\0\0\0\x01\0\0\0\x02\0\0\0\x03\x01\0\0\0\x02\0\0\0\x03\0\0\0");
                assert_eq!(parse(&bytes, false).expect(name).positions[0], [value, 0.0, 0.0], "{name}");
                let ascii = file(&header, "ascii", &[]).into_iter();
                let ascii: Vec<u8> =
                    ascii.chain(format!("{value} 0 0\n0 1 0\n0 0 1\n0 1 1\n3 0 1 2\n3 1 2 3").into_bytes()).collect();
                assert_eq!(parse(&ascii, false).expect(name).positions[0], [value, 0.0, 0.0], "{name}");
            }
        }
    }

    #[test]
    fn headers_with_crlf_and_latin_comments() {
        for encoding in ENCODINGS {
            let crlf = PLAIN.replace("end_header", "comment \u{e9}\nend_header").replace('\n', "\r\n");
            let body = plain(encoding).split_off(PLAIN.replace("ENCODING", encoding).len());
            let mut bytes = crlf.replace("ENCODING", encoding).into_bytes();
            // As Latin-1 has it, which is no UTF-8.
            let accent = bytes.windows(2).position(|pair| pair == "\u{e9}".as_bytes()).expect("the comment");
            bytes.splice(accent..accent + 2, [0xe9]);
            bytes.extend(body);
            assert_eq!(parse(&bytes, false).ok(), parse(&plain(encoding), false).ok(), "{encoding}");
        }
    }

    #[test]
    fn texture_coordinates_by_each_name_and_flipped() {
        for (u, v) in [("u", "v"), ("s", "t"), ("texture_u", "texture_v")] {
            let header =
                RICH.replace("float s\n", &format!("float {u}\n")).replace("float t\n", &format!("float {v}\n"));
            let bytes = rich("ascii").split_off(RICH.len() - "ENCODING".len() + "ascii".len());
            let bytes = [header.replace("ENCODING", "ascii").into_bytes(), bytes].concat();
            assert_eq!(parse(&bytes, false).expect(u), rich_mesh());
            let flipped = parse(&bytes, true).expect(u).uvs.expect("they are there");
            assert_eq!(flipped, [[0.0, 0.75], [1.0, 1.0], [1.0, 0.5], [0.5, 0.0], [0.0, 0.0]]);
        }
    }

    #[test]
    fn normals_and_texture_coordinates_count_only_whole() {
        let text = String::from_utf8(rich("ascii")).expect("the test writes ASCII");
        let mesh = parse(text.replace("float nz", "float n").replace("float t\n", "float v\n").as_bytes(), false);
        assert_eq!(mesh.expect("unknown properties are skipped"), MeshData { normals: None, uvs: None, ..rich_mesh() });
    }

    #[test]
    fn faces_may_come_before_the_vertices() {
        let header = "ply\nformat ENCODING 1.0\nelement face 1\nproperty list uchar uchar vertex_indices\n\
            element vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar z\nend_header\n";
        for encoding in ENCODINGS {
            let rows: [&[Put]; 4] =
                [&[U8(3), U8(0), U8(1), U8(2)], &[U8(0), U8(0), U8(0)], &[U8(1), U8(0), U8(0)], &[U8(0), U8(1), U8(0)]];
            assert_eq!(parse(&file(header, encoding, &rows), false).expect(encoding).triangles, [[0, 1, 2]]);
        }
    }

    #[test]
    fn triangles_of_zero_area_are_left_out_and_counted() {
        let text = String::from_utf8(plain("ascii")).expect("the test writes ASCII");
        let mesh = parse(text.replace("3 0 2 3", "3 0 2 2").as_bytes(), false).expect("one triangle is left");
        assert_eq!((mesh.triangles, mesh.dropped), (vec![[0, 1, 2]], 1));
        let none = error(text.replace("3 0 2 3", "3 0 2 2").replace("3 0 1 2", "3 1 1 0").as_bytes());
        assert_eq!(none, "the mesh has no triangle but 2 of zero area");
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        for encoding in ENCODINGS {
            for whole in [plain(encoding), rich(encoding)] {
                // The newline at the end of an ascii file may be missing.
                let whole = whole.strip_suffix(b"\n").unwrap_or(&whole);
                assert!(parse(whole, false).is_ok());
                for length in 0..whole.len() {
                    error(&whole[..length]);
                }
            }
        }
        let whole = plain("binary_big_endian");
        assert_eq!(error(&whole[..30]), "line 2: the file ends inside its header, without end_header");
        let message = error(&whole[..whole.len() - 26]);
        assert_eq!(message, "the header promises 2 faces, the file has room for 0 at most");
        let message = error(&whole[..whole.len() - 5]);
        let expected = "element \"face\" 1 (counted from 0) has a list of 3 entries, the file has room for 1 at most";
        assert_eq!(message, expected);
    }

    #[test]
    fn the_header_says_where_it_is_wrong() {
        let cases = [
            ("ply\n", "plx\n", "line 1: a PLY file begins with the line \"ply\""),
            ("ply\n", "ply 2\n", "line 1: a PLY file begins with the line \"ply\""),
            (
                "ascii",
                "utf8",
                "line 2: no format is called \"utf8\"; known: ascii, binary_little_endian, binary_big_endian",
            ),
            ("1.0", "1.1", "line 2: version \"1.1\" is not known; known: 1.0"),
            ("format ascii 1.0", "comment", "line 9: the header ends without a format line"),
            ("format ascii 1.0", "format ascii 1.0\nformat ascii 1.0", "line 3: a second format line"),
            (
                "element vertex",
                "elements vertex",
                "line 3: \"elements vertex 4\" is no line of a PLY header; known: format",
            ),
            ("element vertex 4", "comment", "line 4: a property before the first element"),
            ("vertex 4", "vertex -4", "line 3: the number of elements must be an integer from 0, not \"-4\""),
            ("vertex 4", "vertex 99999999999999999999", "line 3: the number of elements must be an integer from 0"),
            ("vertex 4", "points 4", "line 9: the header ends without an element called vertex"),
            ("element face", "element tristrips", "line 9: the header ends without an element called face"),
            ("element face", "element vertex", "line 7: a second element is called \"vertex\""),
            ("float x", "flaot x", "line 4: no type is called \"flaot\"; known: char (int8), uchar (uint8), short"),
            ("float x", "float X", "line 3: element \"vertex\" needs the properties x, y and z, each a single number"),
            ("float y", "float x", "line 5: a second property of the element is called \"x\""),
            (
                "float x",
                "list uchar float x",
                "line 3: element \"vertex\" needs the properties x, y and z, each a single",
            ),
            ("list uchar int", "list float int", "line 8: the length of a list must have an integer type"),
            (
                "list uchar int",
                "list uchar float",
                "line 7: element \"face\" needs a list of integers called vertex_ind",
            ),
            (
                "list uchar int",
                "int",
                "line 7: element \"face\" needs a list of integers called vertex_indices or vertex_",
            ),
            ("end_header", "end_headers", "line 9: \"end_headers\" is no line of a PLY header; known"),
        ];
        for (from, to, expected) in cases {
            let message = broken(from, to);
            assert!(message.starts_with(expected), "{message}\n{expected}");
        }
    }

    #[test]
    fn the_data_say_where_they_are_wrong() {
        let cases = [
            ("1 1 0", "1 one 0", "line 12: \"one\" is not a number"),
            ("1 1 0", "1 nan 0", "vertex 2 (counted from 0) has the position [1.0, NaN, 0.0], which is not finite"),
            ("1 1 0", "1 1e39 0", "vertex 2 (counted from 0) has the position [1.0, inf, 0.0], which is not finite"),
            ("3 0 1 2", "3 0 1 4", "face 0 (counted from 0) uses vertex 4 (counted from 0), the mesh has 4 vertices"),
            ("3 0 2 3", "3 0 -1 3", "face 1 (counted from 0) uses vertex -1 (counted from 0), the mesh has 4 vertices"),
            ("3 0 2 3", "3 0 2.0 3", "line 15: \"2.0\" is not an integer of 32 bits"),
            ("3 0 2 3", "2 0 2 3", "face 1 (counted from 0) has 2 corners, a face needs 3 or more"),
            ("3 0 2 3", "0", "face 1 (counted from 0) has 0 corners, a face needs 3 or more"),
            ("3 0 2 3", "256 0 2 3", "line 15: \"256\" is not an integer from 0 to 255"),
            (
                "3 0 2 3",
                "255 0 2 3",
                "element \"face\" 1 (counted from 0) has a list of 255 entries, the file has room for",
            ),
            ("3 0 2 3", "3 0 2 3\n5", "line 16: \"5\" follows the last element that the header promises"),
            ("face 2", "face 1", "line 15: \"3\" follows the last element that the header promises"),
            ("vertex 4", "vertex 3", "face 0 (counted from 0) has 0 corners, a face needs 3 or more"),
            ("face 2", "face 0", "line 14: \"3\" follows the last element that the header promises"),
        ];
        for (from, to, expected) in cases {
            let message = broken(from, to);
            assert!(message.starts_with(expected), "{message}\n{expected}");
        }
        let infinite = String::from_utf8(rich("ascii")).expect("the test writes ASCII");
        let message = error(infinite.replace("0 0 2 0.5 1", "0 0 inf 0.5 1").as_bytes());
        assert!(message.starts_with("vertex 3 (counted from 0) has the normal [0.0, 0.0, inf], which"), "{message}");
        let message = error(infinite.replace("0 0 2 0.5 1", "0 0 2 0.5 nan").as_bytes());
        assert!(
            message.starts_with("vertex 3 (counted from 0) has the texture coordinate [0.5, NaN], which"),
            "{message}"
        );
    }

    #[test]
    fn trailing_bytes_are_an_error() {
        let mut bytes = plain("binary_little_endian");
        bytes.push(b'\n');
        let end = bytes.len() - 1;
        let expected =
            format!("the data should end at byte {end}, where the last element that the header promises ends");
        assert!(error(&bytes).starts_with(&expected));
        let mut bytes = plain("ascii");
        bytes.extend(b" \n\t\r\n");
        assert!(parse(&bytes, false).is_ok());
    }

    #[test]
    fn promises_beyond_the_file_are_refused_before_memory_is_taken() {
        for encoding in ENCODINGS {
            for count in [4_000_000_000_u64, 4_294_967_296, u64::MAX] {
                for (element, named) in [("vertex 4", "vertex"), ("face 2", "face")] {
                    let header = PLAIN.replace(element, &format!("{named} {count}"));
                    let fault = parse(&file(&header, encoding, &[&[U8(3); 64]]), false).expect_err(encoding);
                    let expected = matches!(
                        fault,
                        MeshFault::NoRoom { promised, room, .. } if promised == count && room < 64
                    );
                    assert!(expected, "{encoding} {count} {fault}");
                }
            }
            let header = PLAIN.replace("list uchar int", "list uint int");
            let body: Vec<[Put; 3]> = vec![[F32(0.5), F32(0.5), F32(0.5)]; 4];
            let rows: Vec<&[Put]> = body.iter().map(|row| &row[..]).chain([&[I32(2_000_000_000); 6][..]]).collect();
            let fault = parse(&file(&header, encoding, &rows), false).expect_err(encoding);
            assert!(matches!(fault, MeshFault::ListLength { length: 2_000_000_000, .. }), "{encoding} {fault}");
        }
        let negative = file(&PLAIN.replace("list uchar", "list char"), "binary_little_endian", &[&[U8(200); 80]]);
        assert!(matches!(parse(&negative, false), Err(MeshFault::ListLength { length: -56, .. })));
    }

    #[test]
    fn a_vertex_count_says_how_many_fit() {
        let bytes = file(&PLAIN.replace("vertex 4", "vertex 40962"), "binary_little_endian", &[&[F32(0.0); 3600]]);
        assert_eq!(error(&bytes), "the header promises 40962 vertices, the file has room for 1200 at most");
        // Lists make an element longer than its least size: then the file ends on the way.
        let header = PLAIN.replace("property float x", "property list uchar int bones\nproperty float x");
        let rows: [&[Put]; 4] = [&[U8(1), I32(5), F32(1.0), F32(2.0), F32(3.0)]; 4];
        let message = error(&file(&header.replace("vertex 4", "vertex 5"), "binary_big_endian", &rows));
        assert_eq!(message, "the header promises 5 vertices, the file ends after 4");
    }

    #[test]
    fn an_endless_header_is_cut_short() {
        let many = PLAIN.replace("end_header", &format!("{}end_header", "comment and so on\n".repeat(10_000)));
        let whole = String::from_utf8(plain("ascii")).expect("the test writes ASCII");
        let body = &whole[PLAIN.len() - "ENCODING".len() + "ascii".len()..];
        let message = error((many.replace("ENCODING", "ascii") + body).as_bytes());
        assert!(message.ends_with("no end_header in the first 65536 bytes"), "{message}");
        let line = [&b"ply\nformat ascii 1.0\ncomment "[..], &[b'x'; 1 << 20]].concat();
        assert!(error(&line).ends_with("no end_header in the first 65536 bytes"));
    }

    #[test]
    fn a_message_stays_short_and_plain_whatever_the_file_says() {
        let name = "\u{1b}".repeat(50_000);
        for (count, body) in [("20", ""), ("1", "9 1"), ("1", "x"), ("one", "")] {
            let text = format!(
                "ply\nformat ascii 1.0\nelement {name} {count}\nproperty list uchar uchar a\nelement vertex 0\n\
                property float x\nproperty float y\nproperty float z\nelement face 0\n\
                property list uchar int vertex_indices\nend_header\n{body}"
            );
            let message = error(text.as_bytes());
            assert!(message.len() < 500 && !message.contains('\u{1b}'), "{} bytes", message.len());
        }
    }

    #[test]
    fn errors_name_the_file() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("blob.ply");
        std::fs::write(&path, plain("ascii")).expect("a file for the test");
        assert_eq!(read_ply(&path, false).ok(), parse(&plain("ascii"), false).ok());
        std::fs::write(&path, "obj").expect("a file for the test");
        let message = read_ply(&path, false).expect_err("no PLY").to_string();
        assert_eq!(message, format!("{}: line 1: a PLY file begins with the line \"ply\"", path.display()));
        let message = read_ply(folder.path(), false).expect_err("a folder").to_string();
        assert_eq!(message, format!("{}: is not a regular file", folder.path().display()));
        let absent = read_ply(&folder.path().join("absent.ply"), false).expect_err("no file").to_string();
        assert!(absent.contains("absent.ply: cannot be read: "), "{absent}");
    }

    /// Reads bytes that may be anything: no panic, a mesh that keeps its promises, memory in proportion.
    fn read_anything(bytes: &[u8]) {
        let Ok(mesh) = parse(bytes, false) else { return };
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < vertices));
        assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
        let taken = 12 * mesh.positions.capacity() + 12 * mesh.triangles.capacity();
        assert!(taken <= 64 * bytes.len(), "{taken} bytes for {}", bytes.len());
    }

    proptest! {
        #[test]
        fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..600), encoding in 0..3_usize) {
            read_anything(&bytes);
            read_anything(&[PLAIN.replace("ENCODING", ENCODINGS[encoding]).into_bytes(), bytes.clone()].concat());
            read_anything(&[RICH.replace("ENCODING", ENCODINGS[encoding]).into_bytes(), bytes].concat());
        }

        #[test]
        fn mutated_files_never_panic(
            encoding in 0..3_usize,
            of_rich in any::<bool>(),
            mutations in prop::collection::vec((any::<prop::sample::Index>(), 0..4_u8, any::<u8>()), 1..8),
        ) {
            let mut bytes = if of_rich { rich(ENCODINGS[encoding]) } else { plain(ENCODINGS[encoding]) };
            for (place, how, byte) in mutations {
                let at = place.index(bytes.len());
                match how {
                    0 => bytes[at] = byte,
                    1 => bytes[at] = b'0' + byte % 10,
                    2 => bytes.insert(at, byte),
                    _ => drop(bytes.remove(at)),
                }
            }
            read_anything(&bytes);
        }

        /// Numbers of a header that grow by digits: the promises of a hostile file.
        #[test]
        fn any_count_is_weighed_against_the_file(encoding in 0..3_usize, vertices in any::<u64>(), faces in any::<u64>()) {
            let header = PLAIN.replace("vertex 4", &format!("vertex {vertices}"));
            let header = header.replace("face 2", &format!("face {faces}"));
            read_anything(&file(&header, ENCODINGS[encoding], &[&[U8(1); 200]]));
        }
    }
}
