//! PLY, the Stanford triangle format, in its three encodings.
//!
//! The reader supports `ascii`, `binary_little_endian` and `binary_big_endian`; LF and CRLF headers; `comment` and
//! `obj_info` lines; every scalar type by its old and its new name (`float`, `float32`); and 64-bit integers. Of the
//! element `vertex` it reads `x y z`, `nx ny nz`, and `u v`, else `texture_u texture_v`, else `s t`. Normals and
//! texture coordinates are used only if all their components are present. Of the element `face` it reads the list
//! `vertex_indices` or `vertex_index`, of any integer types. It skips other properties and elements. Integers are not
//! scaled by the range of their type.
//!
//! A face with more than three corners becomes a fan around its first corner, which is correct for convex polygons.
//! Mitsuba refuses all faces but triangles. Mitsuba also refuses `obj_info` and accepts indices out of range.
//!
//! As in Mitsuba, the numbers of an ascii file may be broken into lines arbitrarily. Data after the last element is an
//! error, except blanks in an ascii file: as in Mitsuba, and because it indicates wrong counts in the header. An ascii
//! file that is truncated within the digits of its last number cannot be distinguished from a complete one.
//!
//! We have our own reader because the crate `ply-rs-bw` reads from a stream: it cannot compare the counts of a header
//! with the size of the file, and it does not detect trailing data.

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
/// The file cannot be read, is not a PLY file, has fewer or more elements than its header declares, or its mesh does
/// not pass [`MeshData::new`]. For any input, memory stays within a fixed multiple of the file's size.
pub fn read_ply(path: &Path, flip_tex_coords: bool) -> Result<MeshData, MeshError> {
    data::read(path, |bytes| parse(bytes, flip_tex_coords))
}

fn parse(bytes: &[u8], flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
    let header = Header::parse(bytes)?;
    match header.encoding {
        Encoding::Ascii => read_mesh(&header, Ascii { bytes, at: header.end }, flip_tex_coords),
        Encoding::LittleEndian => read_mesh(&header, Binary { bytes, at: header.end, swap: false }, flip_tex_coords),
        Encoding::BigEndian => read_mesh(&header, Binary { bytes, at: header.end, swap: true }, flip_tex_coords),
    }
}

/// Reads the elements in the order of the file and builds the mesh.
fn read_mesh<S: DataReader>(header: &Header, mut source: S, flip_tex_coords: bool) -> Result<MeshData, MeshFault> {
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
            // The header contains the number of vertices, so that faces may precede vertices.
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

/// The least number of bytes of an element: its scalars and empty lists.
fn min_size<S: DataReader>(element: &Element) -> usize {
    element.properties.iter().map(|property| S::min_size(property.kind.first())).sum()
}

/// Checks that the file has room for the elements that the header declares, before memory is allocated for them.
fn check_room<S: DataReader>(header: &Header, source: &S) -> Result<(), MeshFault> {
    let mut left = source.left() as u64;
    for element in &header.elements {
        let size = min_size::<S>(element) as u64;
        // Elements without properties take no bytes, so that any count is possible.
        let room = left.checked_div(size).unwrap_or(element.count);
        if element.count > room {
            return Err(MeshFault::NoRoom { element: element.name.clone(), declared: element.count, room });
        }
        left -= size * element.count;
    }
    Ok(())
}

// ---------------------------------------------------------------------------------------------------- the elements

/// The attributes of the vertices. A list stays empty if the layout does not have the attribute.
#[derive(Default)]
struct Vertices {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
}

/// The meaning of each property of a vertex.
struct VertexLayout {
    /// For each property its index in x y z nx ny nz u v, or `None` if it is skipped.
    components: Vec<Option<usize>>,
    has_normals: bool,
    has_uvs: bool,
}

impl VertexLayout {
    fn of(vertex: &Element) -> Result<Self, MeshFault> {
        let mut layout = Self { components: vec![None; vertex.properties.len()], has_normals: false, has_uvs: false };
        if !layout.assign(vertex, &["x", "y", "z"], 0) {
            return Err(vertex.fault("needs the properties x, y and z, each a single number"));
        }
        layout.has_normals = layout.assign(vertex, &["nx", "ny", "nz"], 3);
        let uvs = [["u", "v"], ["texture_u", "texture_v"], ["s", "t"]];
        layout.has_uvs = uvs.iter().any(|names| layout.assign(vertex, names, 6));
        Ok(layout)
    }

    /// Assigns the properties with these names to the components from `first` on, if all of them exist.
    fn assign(&mut self, vertex: &Element, names: &[&str], first: usize) -> bool {
        let scalar = |name: &&str| {
            vertex.properties.iter().position(|p| p.name == *name && matches!(p.kind, ElementType::Scalar(_)))
        };
        let Some(found) = names.iter().map(scalar).collect::<Option<Vec<usize>>>() else { return false };
        for (offset, property) in found.into_iter().enumerate() {
            self.components[property] = Some(first + offset);
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
        for (property, component) in element.properties.iter().zip(&layout.components) {
            match (property.kind, component) {
                (ElementType::Scalar(scalar), Some(component)) => row[*component] = source.real(scalar)?,
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
    /// The index of the property.
    property: usize,
    /// The type of the list's length.
    count: Integer,
    /// The type of the list's entries.
    item: Integer,
}

impl IndexList {
    fn of(face: &Element) -> Result<Self, MeshFault> {
        let named = |property: &Property| matches!(property.name.as_str(), "vertex_indices" | "vertex_index");
        let list = |(index, property): (usize, &Property)| match property.kind {
            ElementType::List { count, item: Scalar::Integer(item) } if named(property) => {
                Some(Self { property: index, count, item })
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
    // `check_room` takes the lists as empty, but a valid face has at least three indices.
    let min_size = min_size::<S>(element) + 3 * S::min_size(Scalar::Integer(list.item));
    triangles.reserve_exact((element.count as usize).min(source.left() / min_size));
    read_element(source, element, |source, number| {
        for (index, property) in element.properties.iter().enumerate() {
            if index == list.property {
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

/// Appends the triangles of one polygon, as a fan around its first corner. `corner` returns the corners in order.
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

/// Calls `read_one` for each element of one kind. If the file ends early, the error states how many elements were read.
fn read_element<S: DataReader>(
    source: &mut S,
    element: &Element,
    mut read_one: impl FnMut(&mut S, u64) -> Result<(), ReadError>,
) -> Result<(), MeshFault> {
    for number in 0..element.count {
        read_one(source, number).map_err(|error| match error {
            ReadError::End => {
                MeshFault::Truncated { element: element.name.clone(), declared: element.count, read: number }
            }
            ReadError::Mesh(fault) => fault,
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

/// Reads the length of a list and checks that the rest of the file has room for it.
fn list_length<S: DataReader>(
    source: &mut S,
    count: Integer,
    item: Scalar,
    element: &Element,
    number: u64,
) -> Result<usize, ReadError> {
    let length = source.whole(count)?;
    let room = source.left() / S::min_size(item);
    match usize::try_from(length) {
        Ok(fits) if fits <= room => Ok(fits),
        _ => Err(MeshFault::ListLength { element: element.name.clone(), number, length, room }.into()),
    }
}

#[cfg(test)]
mod tests;
