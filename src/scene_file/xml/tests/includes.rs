use std::{fs, path::Path};

use tempfile::TempDir;

use super::{
    super::{self as xml, limit},
    names, scene,
};
use crate::scene_file::{Document, SceneError, Spectrum, Value};

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a file is in a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }
    folder
}

fn read_in(folder: &TempDir, definitions: &[(&str, &str)]) -> Result<Document, SceneError> {
    let definitions: Vec<_> = definitions.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect();
    xml::read(&folder.path().join("s.xml"), &definitions)
}

#[track_caller]
fn read(files: &[(&str, &str)]) -> Document {
    read_in(&folder(files), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// The message, with file names relative to the folder.
#[track_caller]
fn refused(files: &[(&str, &str)]) -> String {
    let folder = folder(files);
    let message = read_in(&folder, &[]).expect_err("it is refused").to_string();
    message.replace(&format!("{}/", folder.path().display()), "")
}

fn include(name: &str) -> String {
    scene(&format!("<include filename=\"{name}\"/>"))
}

/// An included scene adds its objects to the surrounding one, which numbers them anew. An included object becomes a
/// child.
#[test]
fn scenes_are_spliced_and_objects_inserted() {
    let inner = scene(concat!(
        "<bsdf type=\"q\" id=\"q\"/><bsdf type=\"n\" name=\"named\"/><default name=\"p\" value=\"inner\"/>",
        "<include filename=\"object.xml\"/>"
    ));
    let outer = scene(concat!(
        "<shape type=\"a\"/><include filename=\"sub/inner.xml\"/><include filename=\"sub/object.xml\" name=\"o\"/>",
        "<shape type=\"$p\"><ref id=\"q\"/></shape>"
    ));
    let object = "<shape version=\"3.0.0\" type=\"sphere\"><string name=\"filename\" value=\"x.ply\"/></shape>";
    let folder = folder(&[("s.xml", &outer), ("sub/inner.xml", &inner), ("sub/object.xml", object)]);
    let document = read_in(&folder, &[]).expect("it is valid");
    assert_eq!(names(&document.objects[0]), ["_arg_0", "_arg_1", "named", "_arg_2", "o", "_arg_3"]);
    let plugins: Vec<_> = document.objects.iter().map(|object| &*object.plugin).collect();
    assert_eq!(plugins, ["", "a", "q", "n", "sphere", "sphere", "inner"]);
    // As in Mitsuba, the file names of plugins are relative to the scene's folder, not to the folder of the included
    // file.
    assert!(document.objects.iter().all(|object| *object.folder == folder.path()));
    let files: Vec<_> =
        document.files.iter().map(|file| file.strip_prefix(folder.path()).expect("it is there")).collect();
    assert_eq!(files, ["s.xml", "sub/inner.xml", "sub/object.xml"].map(Path::new));
    assert!(document.objects[2].place.to_string().ends_with("sub/inner.xml:2:1"));
}

#[test]
fn parameters_go_both_ways() {
    let outer = scene("<default name=\"a\" value=\"1\"/><include filename=\"$file.xml\"/><bsdf type=\"$b\"/>");
    let inner = scene("<default name=\"a\" value=\"2\"/><default name=\"b\" value=\"3\"/><bsdf type=\"$a\"/>");
    let folder = folder(&[("s.xml", &outer), ("inner.xml", &inner)]);
    let document = read_in(&folder, &[("file", "inner")]).expect("it is valid");
    assert_eq!((&*document.objects[1].plugin, &*document.objects[2].plugin), ("1", "3"));
}

/// Each file is upgraded by its own version; the name of a child belongs to the parent.
#[test]
fn versions_are_per_file() {
    let outer = scene("<shape type=\"s\"><include filename=\"old.xml\" name=\"aB\"/></shape>");
    let old = "<bsdf version=\"0.6.0\" type=\"x\"><float name=\"intIOR\" value=\"1\"/></bsdf>";
    let document = read(&[("s.xml", &outer), ("old.xml", old)]);
    assert_eq!((names(&document.objects[1]), names(&document.objects[2])), (vec!["aB"], vec!["int_ior"]));
}

#[test]
fn refused_includes() {
    let s = include("a.xml");
    let cases: [(&str, &str); 11] = [
        ("<scene/>", "a.xml:1:1: missing attribute \"version\" in <scene>; write <scene version=\"...\">"),
        (
            &include("b.xml"),
            "a.xml:2:10: included file \"b.xml\" not found; its name is relative to the including file",
        ),
        (&include("a.xml"), "a.xml:2:10: \"a.xml\" includes itself; remove one of the includes"),
        (&include("s.xml"), "a.xml:2:10: \"s.xml\" includes itself; remove one of the includes"),
        (&include("./"), "./: cannot read: it is not a file"),
        (
            &scene("<float name=\"x\" value=\"1\"/>"),
            "a.xml:2:1: a <float> directly in an included <scene> would be lost; write it in the including file",
        ),
        (
            &scene("<bsdf type=\"a\" id=\"a\"/>\n<ref id=\"a\"/>"),
            "a.xml:3:1: a <ref> directly in an included <scene> would be lost; write it in the including file",
        ),
        (
            &scene("<path value=\".\"/>"),
            "a.xml:2:1: a <path> in an included file does not reach the plugins; write it in the scene file",
        ),
        (
            "<bsdf version=\"3.0.0\" type=\"x\" name=\"n\"/>",
            "a.xml:1:32: the name of an included object has no effect; give the name to the <include>",
        ),
        (
            "<bsdf version=\"3.0.0\" type=\"x\">\n<float name=\"a\" value=\"b\"/></bsdf>",
            "a.xml:2:17: could not parse floating point value \"b\"; write a number like 1, -0.5 or 2e-3",
        ),
        ("<bsdf", "a.xml:1:1: <bsdf is never ended; end it with > or />"),
    ];
    for (text, expected) in cases {
        assert_eq!(refused(&[("s.xml", &s), ("a.xml", text)]), expected, "{text}");
    }
    let named = scene("<include filename=\"a.xml\" name=\"n\"/>");
    assert_eq!(
        refused(&[("s.xml", &named), ("a.xml", &scene(""))]),
        "a.xml:1:1: an included <scene> cannot have a name; remove the name of its <include>"
    );
}

#[test]
fn ids_are_global() {
    let outer = scene("<bsdf type=\"x\" id=\"a\"/><include filename=\"a.xml\"/>");
    assert_eq!(
        refused(&[("s.xml", &outer), ("a.xml", "<bsdf version=\"3.0.0\" type=\"y\" id=\"a\"/>")]),
        "a.xml:1:32: duplicate ID: \"a\"; previous was at s.xml:2:1"
    );
}

/// The last `<path>` is searched first, before the scene's own folder.
#[test]
fn paths() {
    let text = scene(concat!(
        "<texture type=\"t\"><string name=\"filename\" value=\"both\"/></texture>",
        "<path value=\"a\"/><path value=\"b\"/>",
        "<texture type=\"t\"><string name=\"filename\" value=\"own\"/><string name=\"other\" value=\"both\"/></texture>",
        "<include filename=\"part.xml\"/>"
    ));
    let part = "<texture version=\"3.0.0\" type=\"t\"><spectrum name=\"x\" filename=\"only-a\"/></texture>";
    let files =
        [("s.xml", &*text), ("a/both", ""), ("a/only-a", ""), ("b/both", ""), ("own", ""), ("a/part.xml", part)];
    let document = read(&files);
    let values: Vec<_> = document.objects[1..]
        .iter()
        .flat_map(|object| &object.properties)
        .map(|property| match &property.value {
            Value::String(name) | Value::Spectrum(Spectrum::File(name)) => &**name,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(values, ["b/both", "own", "both", "a/only-a"]);
    let cases = [
        ("<path value=\"nope\"/>", "s.xml:2:7: folder \"nope\" not found; it is relative to the scene file"),
        (
            "<bsdf type=\"x\">\n<path value=\"a\"/></bsdf>",
            "s.xml:3:1: a <path> can only stand directly in the outermost element; move it there",
        ),
    ];
    for (body, expected) in cases {
        assert_eq!(refused(&[("s.xml", &scene(body)), ("a/x", "")]), expected);
    }
}

#[test]
fn files_that_cannot_be_read() {
    let folder = folder(&[("latin1.xml", ""), ("bom.xml", "\u{feff}<scene version=\"3.0.0\" x=\"\"/>")]);
    let error = |name: &str| {
        let path = folder.path().join(name);
        let message = xml::read(&path, &[]).expect_err("it is refused").to_string();
        message.strip_prefix(&*path.display().to_string()).expect("it begins with the name").to_owned()
    };
    assert_eq!(error("none.xml"), ": cannot read: No such file or directory (os error 2)");
    assert_eq!(error(""), ": cannot read: it is not a file");
    fs::write(folder.path().join("latin1.xml"), b"<scene>\n\xc3\xa9 caf\xe9</scene>").expect("a file");
    assert_eq!(error("latin1.xml"), ":2:6: this is not UTF-8; save the file as UTF-8");
    assert_eq!(
        error("bom.xml"),
        ":1:24: unexpected attribute \"x\" in <scene>; <scene> may have version, type, id, name"
    );
}

#[test]
fn the_depth_and_number_of_includes_are_limited() {
    // Each file includes the next one twice: 2^k files without a limit.
    let twice = |next: usize| scene(&format!("<include filename=\"{next}.xml\"/>\n<include filename=\"{next}.xml\"/>"));
    let chain = |length: usize| -> Vec<(String, String)> {
        let last = (format!("{length}.xml"), scene("<bsdf type=\"x\"/>"));
        let links = (1..length).map(|i| (format!("{i}.xml"), twice(i + 1)));
        [("s.xml".to_owned(), twice(1))].into_iter().chain(links).chain([last]).collect()
    };
    let files = |list: &[(String, String)]| -> TempDir {
        folder(&list.iter().map(|(name, text)| (&**name, &**text)).collect::<Vec<_>>())
    };
    let document = read_in(&files(&chain(3)), &[]).expect("it is valid");
    assert_eq!(document.objects.len(), 1 + 8);
    assert_eq!(document.files.len(), 4);
    let message = read_in(&files(&chain(12)), &[]).expect_err("it is refused").to_string();
    assert!(message.ends_with("12.xml:2:10: more than 1000 includes") || message.ends_with("more than 1000 includes"));
    assert_eq!(message.lines().count(), 1, "{message}");
    // Fourteen nested files inside the first are allowed, fifteen are not; Mitsuba has the same limit.
    let once = |length: usize| -> Vec<(String, String)> {
        let mut list = chain(length);
        for (_, text) in &mut list[..length] {
            *text = text.lines().filter(|line| !line.contains("<include") || line.ends_with("/>")).collect();
            let at = text.rfind("<include").expect("it includes");
            let end = text[at..].find("/>").expect("it ends") + at + 2;
            text.replace_range(at..end, "");
        }
        list
    };
    read_in(&files(&once(14)), &[]).expect("it is valid");
    let message = read_in(&files(&once(15)), &[]).expect_err("it is refused").to_string();
    assert!(message.ends_with("files include one another more than 15 deep"), "{message}");
}

/// The limits for one file hold for all files together.
#[test]
fn the_limits_hold_across_files() {
    let twice = scene("<include filename=\"a.xml\"/>\n<include filename=\"a.xml\"/>");
    let elements = scene(&"<default name=\"a\" value=\"1\"/>".repeat(limit::ELEMENTS / 2));
    // Before the second file there are the scene, its includes, and the root of either: five elements.
    let column = 1 + 29 * (limit::ELEMENTS / 2 - 5);
    assert_eq!(
        refused(&[("s.xml", &twice), ("a.xml", &elements)]),
        format!("a.xml:2:{column}: too many elements; a scene may have 1000000")
    );
    assert_eq!(
        refused(&[("s.xml", &twice), ("a.xml", &scene(&" ".repeat(limit::BYTES / 2)))]),
        "a.xml: too large; a scene may take 64 MiB of XML, included files among them"
    );
    let nested = |inside: &str| scene(&format!("{}{inside}{}", "<bsdf type=\"x\">".repeat(40), "</bsdf>".repeat(40)));
    let (s, a, b) = (nested("<include filename=\"a.xml\"/>"), nested("<include filename=\"b.xml\"/>"), nested(""));
    // Around b.xml are two scenes, two includes and 80 objects: 16 elements are left, the scene among them.
    let message = refused(&[("s.xml", &s), ("a.xml", &a), ("b.xml", &b)]);
    let column = 1 + 15 * 15;
    assert!(message.starts_with(&format!("b.xml:2:{column}: elements are nested more than 100 deep")), "{message}");
}
