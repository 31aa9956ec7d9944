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

mod header;
mod source;

use std::path::Path;

use super::data::{self, MeshData, MeshError, MeshFault, check_index};
use header::{Element, ElementType, Encoding, Header, Integer, Property, Scalar};
use source::{Ascii, Binary, DataReader, ReadError};

/// Reads a PLY file. With `flip_tex_coords` (Mitsuba's default for PLY: false) v becomes 1 - v.
///
/// # Errors
///
/// The file cannot be read, is no PLY file, promises more than it holds or holds more than it promises, or its mesh
/// does not pass [`MeshData::new`]. Whatever the bytes, memory stays within a fixed multiple of the file's size.
pub fn read_ply(path: &Path, flip_tex_coords: bool) -> Result<MeshData, MeshError> {
    data::read(path, |bytes| parse(bytes, flip_tex_coords))
}

fn parse(bytes: &[u8], flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
    let header = Header::parse(bytes)?;
    match header.encoding {
        Encoding::Ascii => gather(&header, Ascii { bytes, at: header.end }, flip_tex_coords),
        Encoding::LittleEndian => gather(&header, Binary { bytes, at: header.end, swap: false }, flip_tex_coords),
        Encoding::BigEndian => gather(&header, Binary { bytes, at: header.end, swap: true }, flip_tex_coords),
    }
}

/// Walks through the elements in the order of the file and keeps what makes a mesh.
fn gather<S: DataReader>(header: &Header, mut source: S, flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
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

/// The least number of bytes an element takes: its numbers, and lists that are empty.
fn least<S: DataReader>(element: &Element) -> usize {
    element.properties.iter().map(|property| S::least(property.kind.first())).sum()
}

/// Compares what the header promises with the bytes there are, before any memory is taken for it.
fn check_room<S: DataReader>(header: &Header, source: &S) -> Result<(), MeshFault> {
    let mut left = source.left() as u64;
    for element in &header.elements {
        let least = least::<S>(element) as u64;
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
        let scalar = |name: &&str| {
            vertex.properties.iter().position(|p| p.name == *name && matches!(p.kind, ElementType::Scalar(_)))
        };
        let Some(found) = names.iter().map(scalar).collect::<Option<Vec<usize>>>() else { return false };
        for (offset, property) in found.into_iter().enumerate() {
            self.places[property] = Some(first + offset);
        }
        true
    }
}

fn read_vertices<S: DataReader>(
    source: &mut S,
    element: &Element,
    layout: &VertexLayout,
) -> Result<Vertices, MeshFault> {
    let count = element.count as usize;
    let mut vertices = Vertices::default();
    vertices.positions.reserve_exact(count);
    vertices.normals.reserve_exact(if layout.has_normals { count } else { 0 });
    vertices.uvs.reserve_exact(if layout.has_uvs { count } else { 0 });
    read_element(source, element, |source, number| {
        let mut row = [0.0; 8];
        for (property, place) in element.properties.iter().zip(&layout.places) {
            match (property.kind, place) {
                (ElementType::Scalar(scalar), Some(place)) => row[*place] = source.real(scalar)?,
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
            ElementType::List { count, item: Scalar::Integer(item) } if named(property) => {
                Some(Self { place, count, item })
            }
            _ => None,
        };
        let found = face.properties.iter().enumerate().find_map(list);
        found.ok_or_else(|| face.fault("needs a list of integers called vertex_indices or vertex_index"))
    }
}

fn read_faces<S: DataReader>(
    source: &mut S,
    element: &Element,
    list: &IndexList,
    vertices: usize,
) -> Result<Vec<[u32; 3]>, MeshFault> {
    let mut triangles = Vec::new();
    // The check of room let a face be an empty list; here it takes three indices at least, or it is an error.
    let least = least::<S>(element) + 3 * S::least(Scalar::Integer(list.item));
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
    mut corner: impl FnMut() -> Result<u32, ReadError>,
) -> Result<(), ReadError> {
    let (first, mut last) = (corner()?, corner()?);
    for _ in 2..corners {
        let next = corner()?;
        triangles.push([first, last, next]);
        last = next;
    }
    Ok(())
}

fn skip_element<S: DataReader>(source: &mut S, element: &Element) -> Result<(), MeshFault> {
    if element.properties.is_empty() {
        return Ok(());
    }
    read_element(source, element, |source, number| {
        element.properties.iter().try_for_each(|property| skip(source, property.kind, element, number))
    })
}

/// Reads one kind of element, and says how far it came where the file ends too early.
fn read_element<S: DataReader>(
    source: &mut S,
    element: &Element,
    mut one: impl FnMut(&mut S, u64) -> Result<(), ReadError>,
) -> Result<(), MeshFault> {
    for number in 0..element.count {
        one(source, number).map_err(|halt| match halt {
            ReadError::End => {
                MeshFault::Truncated { element: element.name.clone(), promised: element.count, read: number }
            }
            ReadError::Fault(fault) => fault,
        })?;
    }
    Ok(())
}

fn skip<S: DataReader>(source: &mut S, kind: ElementType, element: &Element, number: u64) -> Result<(), ReadError> {
    match kind {
        ElementType::Scalar(scalar) => source.skip(scalar, 1),
        ElementType::List { count, item } => {
            let length = list_length(source, count, item, element, number)?;
            source.skip(item, length)
        }
    }
}

/// The length of a list that the rest of the file can hold.
fn list_length<S: DataReader>(
    source: &mut S,
    count: Integer,
    item: Scalar,
    element: &Element,
    number: u64,
) -> Result<usize, ReadError> {
    let length = source.whole(count)?;
    let room = source.left() / S::least(item);
    match usize::try_from(length) {
        Ok(fits) if fits <= room => Ok(fits),
        _ => Err(MeshFault::ListLength { element: element.name.clone(), number, length, room }.into()),
    }
}

#[cfg(test)]
mod tests;
