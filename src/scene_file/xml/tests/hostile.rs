use std::fmt::Write;

use proptest::prelude::*;

use super::{super::limit, parse_with, read, refused, scene};

/// The message for a text that is rejected before a tree is built. It runs on a thread with a small stack, which a
/// recursive check would overflow.
#[track_caller]
fn refused_at_once(text: String) -> String {
    let thread = std::thread::Builder::new().stack_size(1 << 20).spawn(move || (refused(&text), processor_seconds()));
    let (message, seconds) = thread.expect("a thread").join().expect("no panic");
    assert!(seconds < 20.0, "{seconds} s");
    message
}

/// The processor time of this thread. Unlike wall-clock time, it does not depend on what else the machine does.
#[cfg(target_os = "linux")]
fn processor_seconds() -> f64 {
    use nix::sys::{
        resource::{UsageWho, getrusage},
        time::TimeValLike as _,
    };
    let usage = getrusage(UsageWho::RUSAGE_THREAD).expect("a thread has a usage");
    (usage.user_time() + usage.system_time()).num_milliseconds() as f64 * 1e-3
}

/// Processor time is not measured on other systems.
#[cfg(not(target_os = "linux"))]
fn processor_seconds() -> f64 {
    0.0
}

#[test]
fn nesting() {
    let nested = |depth: usize| scene(&format!("{}{}", "<bsdf type=\"x\">".repeat(depth), "</bsdf>".repeat(depth)));
    read(&nested(limit::NESTING - 1));
    for depth in [limit::NESTING, 20_000, 1_000_000] {
        let message = refused_at_once(nested(depth));
        let column = 1 + 15 * (limit::NESTING - 1);
        let expected = "elements are nested more than 100 deep; put an inner object outside and refer to it by <ref>";
        assert_eq!(message, format!("s.xml:2:{column}: {expected}"));
    }
}

#[test]
fn element_counts() {
    let message = refused_at_once(scene(&"<a/>".repeat(limit::ELEMENTS)));
    let expected = format!("s.xml:2:{}: too many elements; a scene may have 1000000", 1 + 4 * (limit::ELEMENTS - 1));
    assert_eq!(message, expected);
    let message = refused_at_once(scene(&"<!---->".repeat(limit::PIECES)));
    assert_eq!(message, format!("s.xml:2:{}: too many attributes and comments", 1 + 7 * (limit::PIECES - 1)));
    let mut attributes = String::new();
    for i in 0..100_000 {
        write!(attributes, " a{i}=\"\"").expect("a string can be written to");
    }
    assert_eq!(
        refused_at_once(scene(&format!("<shape{attributes}/>"))),
        "s.xml:2:110: <shape> has more than 16 attributes"
    );
}

#[test]
fn sizes() {
    let text = scene(&" ".repeat(limit::BYTES));
    let expected = "s.xml: too large; a scene may take 64 MiB of XML, included files among them";
    assert_eq!(refused_at_once(text), expected);
    // A file that is too large is not even read.
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.as_file().set_len(1 << 40).expect("a sparse file");
    let message = super::super::read(file.path(), &[]).expect_err("it is refused").to_string();
    assert!(message.contains(": too large; a scene may take 64 MiB"), "{message}");
}

#[test]
fn document_types_and_entities() {
    let laughs = "<!DOCTYPE scene [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]>\n<scene version=\"3.0.0\"/>";
    assert_eq!(refused(laughs), "s.xml:1:1: a document type declaration is not read; remove it; scenes need none");
    assert_eq!(
        refused(&scene("<bsdf type=\"&b;\"/>")),
        "s.xml:2:13: not XML: unknown entity reference 'b'; write &amp; for &"
    );
    assert_eq!(
        refused(&scene("<bsdf type=\"&\"/>")),
        "s.xml:2:13: not XML: malformed entity reference; write &amp; for &"
    );
}

/// Values contain no parameters, so each `$` adds at most the length of one value, and the total is limited.
#[test]
fn parameters_that_grow() {
    let value = "x".repeat(1 << 20);
    let text = scene(&format!("<string name=\"a\" value=\"{}\"/>", "$p".repeat(100)));
    let message = parse_with(&text, &[("p", &value)]).expect_err("it is refused").to_string();
    assert_eq!(message, "s.xml:2:18: the parameters expand to too much text");
    let text = scene(&format!("<string name=\"a\" value=\"{}\"/>", "$p".repeat(limit::SUBSTITUTIONS + 1)));
    let message = parse_with(&text, &[("p", "")]).expect_err("it is refused").to_string();
    assert_eq!(message, "s.xml:2:18: the parameters expand to too much text");
}

/// Each object refers to the next, so that the nesting depth is proportional to the length of the file.
#[test]
fn chains_of_references() {
    let chain = |length: usize| {
        let mut body = String::new();
        for i in 0..length {
            write!(body, "<bsdf type=\"x\" id=\"{i}\"><ref id=\"{}\"/></bsdf>", i + 1)
                .expect("a string can be written to");
        }
        scene(&format!("{body}<bsdf type=\"x\" id=\"{length}\"/>"))
    };
    read(&chain(limit::LEVELS - 2));
    let message = refused_at_once(chain(100_000));
    assert!(
        message.ends_with("objects are nested through references more than 200 levels deep; use fewer levels"),
        "{message}"
    );
}

#[test]
fn many_faults() {
    let message = refused_at_once(scene(&"<float name=\"a\" value=\"x\"/>\n".repeat(100_000)));
    assert_eq!(message.lines().count(), crate::scene_file::fault::MAX_FAULTS + 1);
    assert_eq!(message.lines().last(), Some("more than 50 faults: the rest is not shown"));
}

/// A message is one line of bounded length, whatever it quotes, and does not depend on the order of a hash map.
#[test]
fn long_messages() {
    let message = refused_at_once(scene(&format!(
        "<bsdf type=\"x\"><rgb name=\"a\" value=\"{}\"/></bsdf>",
        "é,".repeat(1 << 20)
    )));
    let (start, end) =
        (format!("s.xml:2:30: could not parse RGB value \"{}", "é,".repeat(86)), "é,\"; give 1 or 3 numbers, ");
    assert!(message.starts_with(&start) && message.contains(end) && message.len() < 700, "{message}");
    assert_eq!(
        refused(&scene("<ref id=\"a&#10;b\"/>")),
        "s.xml:2:1: unresolved reference to \"a b\"; no object has id=\"a b\""
    );
    let ids = |count: usize| -> String { (0..count).map(|i| format!("<bsdf type=\"x\" id=\"id{i:04}\"/>")).collect() };
    let hint = |count: usize| refused(&scene(&format!("{}\n<ref id=\"id9999\"/>", ids(count))));
    assert_eq!(hint(100), "s.xml:3:1: unresolved reference to \"id9999\"; did you mean \"id0099\"?");
    assert_eq!(hint(1001), "s.xml:3:1: unresolved reference to \"id9999\"; no object has id=\"id9999\"");
}

/// The time for many children, names and parameters is linear.
#[test]
fn large_scenes_are_read_quickly() {
    let start = processor_seconds();
    let mut body = String::new();
    for i in 0..50_000 {
        write!(
            body,
            "<default name=\"p{i}\" value=\"{i}\"/><bsdf type=\"$p{i}\" name=\"n{i}\" id=\"n{i}\"/><ref id=\"n{i}\"/>"
        )
        .expect("a string can be written to");
    }
    // Everything is on one line, so that columns take time to count.
    assert_eq!(read(&scene(&body)).objects.len(), 50_001);
    let seconds = processor_seconds() - start;
    assert!(seconds < 20.0, "{seconds} s");
}

#[test]
fn text_that_is_no_xml() {
    let cases = [
        (
            "",
            "1:1: not XML: the document does not have a root node; a scene file begins with <scene version=\"3.0.0\">",
        ),
        ("hello", "1:1: not XML: unknown token"),
        ("<scene version=\"3.0.0\">\n<bsdf type=\"x\">", "2:1: <bsdf> is never closed; close it with </bsdf>"),
        ("<scene version=\"3.0.0\"><bsdf>\n</shape></scene>", "2:1: not XML: expected 'bsdf' tag, not 'shape'"),
        ("<scene version=\"3.0.0\"/>\n<scene/>", "2:1: not XML: unknown token"),
        ("<scene version=3/>", "1:16: not XML: expected a quote not '3'"),
        ("<scene version=\"3.0.0/>", "1:24: not XML: unexpected end of stream"),
        ("<scene version=\"3.0.0\">\n<!-- a", "2:1: a comment is never closed; close it with -->"),
        (
            "<scene version=\"3.0.0\">\n<!-- a -- b --></scene>",
            "2:1: not XML: comment contains '--'; write fewer dashes",
        ),
        (
            "<scene version=\"3.0.0\">\n<bsdf type=\"<\"/></scene>",
            "2:13: not XML: expected '\"' not '<'; write &lt; for < in an attribute, and close the quotes before a tag",
        ),
        ("<scene version=\"3.0.0\" version=\"3.0.0\"/>", "1:24: not XML: attribute 'version' is already defined"),
    ];
    for (text, expected) in cases {
        assert_eq!(refused(text), format!("s.xml:{expected}"), "{text}");
    }
}

/// Scenes to mutate: they use every element.
const SEEDS: [&str; 2] = [
    r#"<scene version="3.0.0"><default name="spp" value="64"/><integrator type="path"><integer name="max_depth"
    value="8"/></integrator><sensor type="perspective"><transform name="to_world"><lookat origin="0, 4.5, 8" target="0,
    0.6, 0" up="0, 1, 0"/><rotate x="1" angle="-90"/><matrix value="1 0 0 0 1 0 0 0 1"/></transform><film
    type="hdrfilm"><rfilter type="box"/></film><sampler type="independent"><integer name="sample_count"
    value="$spp"/></sampler></sensor><bsdf type="diffuse" id="a"><rgb name="reflectance" value="0.5, 0.5, 0.5"/></bsdf>
    <alias id="a" as="b"/><shape type="sphere"><point name="center" x="0" y="1.2" z="0"/><ref id="b"/><!-- é --></shape>
    <path value="."/><include filename="nope\$.xml"/></scene>"#,
    r#"<texture version="0.6.0" type="bitmap"><float name="uscale" value="inf"/><float name="vOffset" value="2"/>
    <boolean name="raw" value="true"/><string name="filename" value="&lt;x"/><spectrum name="s" value="400:1, 500:2"/>
    <vector name="v" value="1 2 3"/><spectrum type="d65"/></texture>"#,
];

proptest! {
    /// Any deletion, insertion or repetition gives a result without a panic, and every message has a place.
    #[test]
    fn damaged_scenes_are_answered(
        seed in 0..SEEDS.len(),
        edits in prop::collection::vec((0usize..1500, 0usize..40, "[<>/\"'&$\\\\=!\\-a-z0-9é \\[\\]?:]{0,6}"), 0..5),
    ) {
        let mut text: Vec<char> = SEEDS[seed].chars().collect();
        for (at, cut, new) in edits {
            let at = at.min(text.len());
            let end = (at + cut).min(text.len());
            text.splice(at..end, new.chars());
        }
        let text: String = text.into_iter().collect();
        if let Err(error) = parse_with(&text, &[]) {
            prop_assert!(!error.0.is_empty());
            prop_assert!(error.0.iter().all(|fault| fault.place.is_some() || fault.what.contains("faults")));
        }
    }

    #[test]
    fn truncated_scenes_are_refused(seed in 0..SEEDS.len(), length in 0usize..1400) {
        let text: String = SEEDS[seed].chars().take(length).collect();
        prop_assume!(text.len() < SEEDS[seed].len());
        prop_assert!(parse_with(&text, &[]).is_err());
    }

    #[test]
    fn noise_is_answered(text in "\\PC{0,80}", bytes in "[<>/\"=a $&!\\-\\[\\]?\n]{0,60}") {
        prop_assert!(parse_with(&text, &[]).is_err());
        let _ = parse_with(&scene(&bytes), &[]);
    }
}
