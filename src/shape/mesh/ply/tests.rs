use proptest::prelude::*;

use super::*;

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// A number with its type, for writing test files.
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

/// A header with unknown elements and properties among those that are read, for a triangle and a pentagon.
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
        slivers: vec![],
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

/// The error of the plain ascii file after replacing `from` by `to`.
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

/// The file is written byte by byte, so that no helper function can share an error with the reader.
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
    assert_eq!((mesh.normals, mesh.uvs, mesh.slivers.len()), (None, None, 0));
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
        // The Latin-1 encoding, which is not valid UTF-8.
        let accent = bytes.windows(2).position(|pair| pair == "\u{e9}".as_bytes()).expect("the comment");
        bytes.splice(accent..accent + 2, [0xe9]);
        bytes.extend(body);
        assert_eq!(parse(&bytes, false).ok(), parse(&plain(encoding), false).ok(), "{encoding}");
    }
}

#[test]
fn texture_coordinates_by_each_name_and_flipped() {
    for (u, v) in [("u", "v"), ("s", "t"), ("texture_u", "texture_v")] {
        let header = RICH.replace("float s\n", &format!("float {u}\n")).replace("float t\n", &format!("float {v}\n"));
        let bytes = rich("ascii").split_off(RICH.len() - "ENCODING".len() + "ascii".len());
        let bytes = [header.replace("ENCODING", "ascii").into_bytes(), bytes].concat();
        assert_eq!(parse(&bytes, false).expect(u), rich_mesh());
        let flipped = parse(&bytes, true).expect(u).uvs.expect("the file has texture coordinates");
        assert_eq!(flipped, [[0.0, 0.75], [1.0, 1.0], [1.0, 0.5], [0.5, 0.0], [0.0, 0.0]]);
    }
}

#[test]
fn incomplete_normals_and_texture_coordinates_are_ignored() {
    let text = String::from_utf8(rich("ascii")).expect("the test writes ASCII");
    let mesh = parse(text.replace("float nz", "float n").replace("float t\n", "float v\n").as_bytes(), false);
    assert_eq!(mesh.expect("unknown properties are skipped"), MeshData { normals: None, uvs: None, ..rich_mesh() });
}

#[test]
fn faces_may_precede_vertices() {
    let header = "ply\nformat ENCODING 1.0\nelement face 1\nproperty list uchar uchar vertex_indices\n\
        element vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar z\nend_header\n";
    for encoding in ENCODINGS {
        let rows: [&[Put]; 4] =
            [&[U8(3), U8(0), U8(1), U8(2)], &[U8(0), U8(0), U8(0)], &[U8(1), U8(0), U8(0)], &[U8(0), U8(1), U8(0)]];
        assert_eq!(parse(&file(header, encoding, &rows), false).expect(encoding).triangles, [[0, 1, 2]]);
    }
}

#[test]
fn triangles_of_zero_area_become_slivers() {
    let text = String::from_utf8(plain("ascii")).expect("the test writes ASCII");
    let mesh = parse(text.replace("3 0 2 3", "3 0 2 2").as_bytes(), false).expect("one triangle is left");
    assert_eq!((mesh.triangles, mesh.slivers.len()), (vec![[0, 1, 2]], 1));
    let none = error(text.replace("3 0 2 3", "3 0 2 2").replace("3 0 1 2", "3 1 1 0").as_bytes());
    assert_eq!(none, "the mesh has no triangle but 2 of zero area");
}

#[test]
fn a_file_truncated_anywhere_is_an_error() {
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
    assert_eq!(message, "the header declares 2 faces, the file has room for 0 at most");
    let message = error(&whole[..whole.len() - 5]);
    let expected = "element \"face\" 1 (counted from 0) has a list of 3 entries, the file has room for 1 at most";
    assert_eq!(message, expected);
}

#[test]
fn errors_in_the_header_name_the_line() {
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
            "line 3: \"elements vertex 4\" is not a line of a PLY header; known: format",
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
        ("float x", "list uchar float x", "line 3: element \"vertex\" needs the properties x, y and z, each a single"),
        ("list uchar int", "list float int", "line 8: the length of a list must have an integer type"),
        ("list uchar int", "list uchar float", "line 7: element \"face\" needs a list of integers called vertex_ind"),
        ("list uchar int", "int", "line 7: element \"face\" needs a list of integers called vertex_indices or vertex_"),
        ("end_header", "end_headers", "line 9: \"end_headers\" is not a line of a PLY header; known"),
    ];
    for (from, to, expected) in cases {
        let message = broken(from, to);
        assert!(message.starts_with(expected), "{message}\n{expected}");
    }
}

#[test]
fn errors_in_the_data_name_the_element_or_the_line() {
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
        ("3 0 2 3", "3 0 2 3\n5", "line 16: \"5\" follows the last element that the header declares"),
        ("face 2", "face 1", "line 15: \"3\" follows the last element that the header declares"),
        ("vertex 4", "vertex 3", "face 0 (counted from 0) has 0 corners, a face needs 3 or more"),
        ("face 2", "face 0", "line 14: \"3\" follows the last element that the header declares"),
    ];
    for (from, to, expected) in cases {
        let message = broken(from, to);
        assert!(message.starts_with(expected), "{message}\n{expected}");
    }
    let infinite = String::from_utf8(rich("ascii")).expect("the test writes ASCII");
    let message = error(infinite.replace("0 0 2 0.5 1", "0 0 inf 0.5 1").as_bytes());
    assert!(message.starts_with("vertex 3 (counted from 0) has the normal [0.0, 0.0, inf], which"), "{message}");
    let message = error(infinite.replace("0 0 2 0.5 1", "0 0 2 0.5 nan").as_bytes());
    assert!(message.starts_with("vertex 3 (counted from 0) has the texture coordinate [0.5, NaN], which"), "{message}");
}

#[test]
fn trailing_bytes_are_an_error() {
    let mut bytes = plain("binary_little_endian");
    bytes.push(b'\n');
    let end = bytes.len() - 1;
    let expected = format!("the data should end at byte {end}, after the last element that the header declares");
    assert!(error(&bytes).starts_with(&expected));
    let mut bytes = plain("ascii");
    bytes.extend(b" \n\t\r\n");
    assert!(parse(&bytes, false).is_ok());
}

#[test]
fn counts_beyond_the_file_are_refused_before_memory_is_allocated() {
    for encoding in ENCODINGS {
        for count in [4_000_000_000_u64, 4_294_967_296, u64::MAX] {
            for (element, named) in [("vertex 4", "vertex"), ("face 2", "face")] {
                let header = PLAIN.replace(element, &format!("{named} {count}"));
                let fault = parse(&file(&header, encoding, &[&[U8(3); 64]]), false).expect_err(encoding);
                let expected = matches!(
                    fault,
                    MeshFault::NoRoom { declared, room, .. } if declared == count && room < 64
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
fn an_excessive_vertex_count_is_compared_with_the_room_in_the_file() {
    let bytes = file(&PLAIN.replace("vertex 4", "vertex 40962"), "binary_little_endian", &[&[F32(0.0); 3600]]);
    assert_eq!(error(&bytes), "the header declares 40962 vertices, the file has room for 1200 at most");
    // Lists make elements larger than their least size, so that the file ends while they are read.
    let header = PLAIN.replace("property float x", "property list uchar int bones\nproperty float x");
    let rows: [&[Put]; 4] = [&[U8(1), I32(5), F32(1.0), F32(2.0), F32(3.0)]; 4];
    let message = error(&file(&header.replace("vertex 4", "vertex 5"), "binary_big_endian", &rows));
    assert_eq!(message, "the header declares 5 vertices, the file ends after 4");
}

#[test]
fn the_size_of_a_header_is_limited() {
    let many = PLAIN.replace("end_header", &format!("{}end_header", "comment and so on\n".repeat(10_000)));
    let whole = String::from_utf8(plain("ascii")).expect("the test writes ASCII");
    let body = &whole[PLAIN.len() - "ENCODING".len() + "ascii".len()..];
    let message = error((many.replace("ENCODING", "ascii") + body).as_bytes());
    assert!(message.ends_with("no end_header in the first 65536 bytes"), "{message}");
    let line = [&b"ply\nformat ascii 1.0\ncomment "[..], &[b'x'; 1 << 20]].concat();
    assert!(error(&line).ends_with("no end_header in the first 65536 bytes"));
}

#[test]
fn messages_are_short_and_escaped() {
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
    let message = read_ply(&path, false).expect_err("it is not a PLY file").to_string();
    assert_eq!(message, format!("{}: line 1: a PLY file begins with the line \"ply\"", path.display()));
    let message = read_ply(folder.path(), false).expect_err("a folder").to_string();
    assert_eq!(message, format!("{}: is not a regular file", folder.path().display()));
    let absent = read_ply(&folder.path().join("absent.ply"), false).expect_err("no file").to_string();
    assert!(absent.contains("absent.ply: cannot be read: "), "{absent}");
}

/// Parses arbitrary bytes: the parser does not panic, the mesh keeps its guarantees, and memory is proportional to the
/// file's size.
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
        for (position, kind, byte) in mutations {
            let at = position.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes[at] = b'0' + byte % 10,
                2 => bytes.insert(at, byte),
                _ => drop(bytes.remove(at)),
            }
        }
        read_anything(&bytes);
    }

    /// The counts of a hostile header.
    #[test]
    fn any_count_is_compared_with_the_size_of_the_file(encoding in 0..3_usize, vertices in any::<u64>(), faces in any::<u64>()) {
        let header = PLAIN.replace("vertex 4", &format!("vertex {vertices}"));
        let header = header.replace("face 2", &format!("face {faces}"));
        read_anything(&file(&header, ENCODINGS[encoding], &[&[U8(1); 200]]));
    }
}
