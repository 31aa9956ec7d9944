use glam::DVec3;

use super::{refused_in_shape, value};
use crate::scene_file::{Spectrum, Value};

fn prop(tag: &str, text: &str) -> String {
    format!("<{tag} name=\"a\" value=\"{text}\"/>")
}

#[test]
fn numbers() {
    let cases = [
        ("1", 1.0),
        ("+1e0", 1.0),
        (" 2 ", 2.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("-0.25E2", -25.0),
        ("1e-400", 0.0),
        ("inf", f64::INFINITY),
        ("-Infinity", f64::NEG_INFINITY),
    ];
    for (text, expected) in cases {
        assert_eq!(value(&prop("float", text)), Value::Float(expected), "{text}");
    }
    for text in ["", " ", "1.0x", "1f", "0x10", "1,", "1 2", "nan", "one", "--1", "1_0"] {
        let expected =
            format!("s.xml:3:17: could not parse floating point value \"{text}\"; write a number like 1, -0.5 or 2e-3");
        assert_eq!(refused_in_shape(&prop("float", text)), expected);
    }
    assert_eq!(
        refused_in_shape(&prop("float", "1e999")),
        "s.xml:3:17: \"1e999\" is too large for a double; write inf for infinity"
    );
}

#[test]
fn integers() {
    for (text, expected) in [("5", 5), (" -7 ", -7), ("-0", 0), ("9223372036854775807", i64::MAX)] {
        assert_eq!(value(&prop("integer", text)), Value::Integer(expected), "{text}");
    }
    for text in ["", "1.5", "+5", "5,", "1e3", "0x1", "9223372036854775808", "1 2"] {
        let expected = format!(
            "s.xml:3:19: could not parse integer value \"{text}\"; write a whole number of 64 bits like 3 or -1"
        );
        assert_eq!(refused_in_shape(&prop("integer", text)), expected);
    }
}

#[test]
fn booleans() {
    for (text, expected) in [("true", true), ("False", false), ("TRUE", true)] {
        assert_eq!(value(&prop("boolean", text)), Value::Boolean(expected));
    }
    for text in ["1", "", "yes", " true"] {
        let expected = format!("s.xml:3:19: could not parse boolean value \"{text}\"; write true or false");
        assert_eq!(refused_in_shape(&prop("boolean", text)), expected);
    }
}

#[test]
fn strings() {
    for text in ["", "a b", " x ", "..\\y"] {
        assert_eq!(value(&prop("string", text)), Value::String(text.into()));
    }
    assert_eq!(value(&prop("string", "&lt;&#65;&amp;")), Value::String("<A&".into()));
}

#[test]
fn colours() {
    for text in ["1,2,3", "1 2 3", " 1 , 2,3 ", "1,,2,3,", "1\n2\t3"] {
        assert_eq!(value(&prop("rgb", text)), Value::Rgb(DVec3::new(1.0, 2.0, 3.0)), "{text}");
    }
    assert_eq!(value(&prop("rgb", "0.5")), Value::Rgb(DVec3::splat(0.5)));
    for text in ["", "1 2", "1 2 3 4", "#ff0000", "1;2;3", "inf", "nan"] {
        let expected = format!(
            "s.xml:3:15: could not parse RGB value \"{text}\"; give 1 or 3 numbers, separated by commas or blanks"
        );
        assert_eq!(refused_in_shape(&prop("rgb", text)), expected);
    }
}

#[test]
fn spectra() {
    assert_eq!(value(&prop("spectrum", "2 ")), Value::Spectrum(Spectrum::Uniform(2.0)));
    let pairs = Spectrum::Tabulated(vec![(400.0, 0.1), (700.0, 0.25)]);
    assert_eq!(value(&prop("spectrum", "400:0.1, 700:.25")), Value::Spectrum(pairs));
    assert_eq!(value("<spectrum name=\"a\" filename=\"a.spd\"/>"), Value::Spectrum(Spectrum::File("a.spd".into())));
    let cases = [
        ("1,2", "20: could not parse spectrum value \"1\"; write one number, or pairs like 400:0.1, 700:0.2"),
        (
            "400:1",
            "20: a spectrum needs 2 pairs of wavelength and value, got 1; write one number, or pairs like 400:0.1, 700:0.2, sorted by wavelength",
        ),
        (
            " ",
            "20: a spectrum needs 2 pairs of wavelength and value, got 0; write one number, or pairs like 400:0.1, 700:0.2, sorted by wavelength",
        ),
        (
            "500:1,400:2",
            "20: the wavelength 400 does not rise above 500; write one number, or pairs like 400:0.1, 700:0.2, sorted by wavelength",
        ),
        (
            "400:1,400:2",
            "20: the wavelength 400 does not rise above 400; write one number, or pairs like 400:0.1, 700:0.2, sorted by wavelength",
        ),
        ("400:1,5:0:2", "20: could not parse floating point value \"0:2\"; write a number like 1, -0.5 or 2e-3"),
        ("", "1: a <spectrum> needs either \"value\" or \"filename\"; give one of them"),
        ("1\" filename=\"b", "1: a <spectrum> needs either \"value\" or \"filename\"; give one of them"),
    ];
    for (text, expected) in cases {
        assert_eq!(refused_in_shape(&prop("spectrum", text)), format!("s.xml:3:{expected}"), "{text}");
    }
}

#[test]
fn points_and_vectors() {
    for tag in ["point", "vector"] {
        let expected = Value::Vector(DVec3::new(1.0, -2.0, 0.5));
        assert_eq!(value(&format!("<{tag} name=\"a\" x=\"1\" y=\" -2\" z=\".5\"/>")), expected);
        assert_eq!(value(&prop(tag, "1, -2 .5")), expected);
        assert_eq!(value(&prop(tag, "3")), Value::Vector(DVec3::splat(3.0)));
    }
    let cases = [
        ("x=\"1\" z=\"1\"", "1: missing attribute \"y\" in <point>; write <point y=\"...\">"),
        ("value=\"1 2\"", "17: \"value\" has 2 numbers; give 1 or 3, separated by commas or blanks"),
        ("value=\"\"", "17: \"value\" has 0 numbers; give 1 or 3, separated by commas or blanks"),
        ("value=\"1\" y=\"1\"", "1: cannot mix \"value\" with \"y\" in <point>; give \"value\" or \"x\", \"y\", \"z\""),
        (
            "x=\"1\" y=\"\" z=\"1\"",
            "23: could not parse floating point value \"\"; write a number like 1, -0.5 or 2e-3",
        ),
        ("x=\"1\" y=\"1\" z=\"inf\"", "29: \"inf\" is not finite; write a number like 1, -0.5 or 2e-3"),
        ("value=\"1 x 1\"", "17: could not parse floating point value \"x\"; write a number like 1, -0.5 or 2e-3"),
    ];
    for (attributes, expected) in cases {
        let message = refused_in_shape(&format!("<point name=\"a\" {attributes}/>"));
        assert_eq!(message, format!("s.xml:3:{expected}"), "{attributes}");
    }
}
