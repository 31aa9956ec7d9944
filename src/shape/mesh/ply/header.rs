//! The header of a PLY file: its elements and their properties.

use crate::shape::mesh::data::{MeshFault, quoted};

/// The maximum size of a header, in bytes: far above the size of real headers. It limits the time that a hostile file
/// can cost.
pub(super) const HEADER_LIMIT: usize = 1 << 16;

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// The number of the header's last line.
    pub(super) last_line: usize,
    /// The offset of the first byte after the header.
    pub(super) end: usize,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    /// The line of the header that declares the element.
    pub(super) line: usize,
}

#[derive(Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: ElementType,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum ElementType {
    Scalar(Scalar),
    List { count: Integer, item: Scalar },
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Scalar {
    Integer(Integer),
    F32,
    F64,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Integer {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
}

/// The old and the new name of each type.
pub(super) const SCALARS: [(&str, &str, Scalar); 10] = [
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

pub(super) const ENCODINGS: [(&str, Encoding); 3] = [
    ("ascii", Encoding::Ascii),
    ("binary_little_endian", Encoding::LittleEndian),
    ("binary_big_endian", Encoding::BigEndian),
];

impl Header {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, MeshFault> {
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
                    push_property(&mut elements, name, ElementType::List { count, item }, line)?;
                }
                ["property", scalar, name] => {
                    push_property(&mut elements, name, ElementType::Scalar(Scalar::named(scalar, line)?), line)?;
                }
                ["end_header"] => {
                    let encoding = encoding.ok_or_else(|| syntax(line, "the header ends without a format line"))?;
                    return Ok(Self { encoding, elements, last_line: line, end: lines.at });
                }
                _ => return Err(syntax(line, &unknown_line(&text))),
            }
        }
    }

    pub(super) fn element(&self, name: &str) -> Result<&Element, MeshFault> {
        let found = self.elements.iter().find(|element| element.name == name);
        found.ok_or_else(|| syntax(self.last_line, &format!("the header ends without an element called {name}")))
    }
}

impl Element {
    pub(super) fn fault(&self, what: &str) -> MeshFault {
        syntax(self.line, &format!("element {} {what}", quoted(self.name.as_bytes())))
    }
}

impl ElementType {
    /// The type of the first number of the property: the scalar itself, or the length of the list.
    pub(super) fn first(self) -> Scalar {
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

    /// The size in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::Integer(Integer::I8 | Integer::U8) => 1,
            Self::Integer(Integer::I16 | Integer::U16) => 2,
            Self::Integer(Integer::I32 | Integer::U32) | Self::F32 => 4,
            Self::Integer(Integer::I64 | Integer::U64) | Self::F64 => 8,
        }
    }
}

pub(super) fn parse_format(name: &str, version: &str, line: usize) -> Result<Encoding, MeshFault> {
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

pub(super) fn parse_element(before: &[Element], name: &str, count: &str, line: usize) -> Result<Element, MeshFault> {
    if before.iter().any(|element| element.name == name) {
        return Err(syntax(line, &format!("a second element is called {}", quoted(name.as_bytes()))));
    }
    let count = count.parse().map_err(|_| {
        syntax(line, &format!("the number of elements must be an integer from 0, not {}", quoted(count.as_bytes())))
    })?;
    Ok(Element { name: name.to_owned(), count, properties: Vec::new(), line })
}

pub(super) fn push_property(
    elements: &mut [Element],
    name: &str,
    kind: ElementType,
    line: usize,
) -> Result<(), MeshFault> {
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
pub(super) struct HeaderLines<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    pub(super) line: usize,
}

impl HeaderLines<'_> {
    fn next(&mut self) -> Result<String, MeshFault> {
        self.line += 1;
        let rest = &self.bytes[self.at..self.bytes.len().min(HEADER_LIMIT)];
        let Some(length) = rest.iter().position(|&byte| byte == b'\n') else {
            return Err(syntax(self.line, &self.missing_end()));
        };
        self.at += length + 1;
        let line = &rest[..length];
        // A comment may have any encoding. Everything else is ASCII.
        Ok(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)).into_owned())
    }

    fn missing_end(&self) -> String {
        if self.bytes.len() > HEADER_LIMIT {
            format!("no end_header in the first {HEADER_LIMIT} bytes")
        } else {
            "the file ends inside its header, without end_header".to_owned()
        }
    }
}

pub(super) fn unknown_line(text: &str) -> String {
    format!(
        "{} is not a line of a PLY header; known: format ENCODING 1.0, comment, obj_info, element NAME COUNT, \
         property TYPE NAME, property list TYPE TYPE NAME, end_header",
        quoted(text.as_bytes())
    )
}

pub(super) fn syntax(line: usize, what: &str) -> MeshFault {
    MeshFault::Syntax { line, what: what.to_owned() }
}
