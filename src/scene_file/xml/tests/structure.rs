use super::{super::parse_element, first, names, parse_with, read, refused, refused_in_shape, scene};
use crate::scene_file::{Category, ObjectId, Value};

/// The scene that has one of everything.
const WHOLE: &str = r#"<?xml version="1.0"?>
<!-- text and comments are ignored -->
<scene version="3.0.0" id="all">
  words
  <default name="spp" value="64"/>
  <integrator type="path"><integer name="max_depth" value="8"/></integrator>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0, 4.5, 8" target="0, 0.6, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><rfilter type="box"/></film>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
  </sensor>
  <shape type="sphere"><ref id="glass"/><ref name="inside" id="fog"/><emitter type="area"/></shape>
  <bsdf type="dielectric" id="glass"/>
  <bsdf type="diffuse"><texture type="bitmap" name="reflectance"/></bsdf>
  <bsdf type="diffuse"><spectrum type="d65" name="reflectance"/></bsdf>
  <medium type="homogeneous" id="fog"><phase type="hg"/><volume type="constvolume" name="albedo"/></medium>
</scene>"#;

#[test]
fn every_kind_of_object() {
    let document = read(WHOLE);
    let mut found: Vec<_> = document.objects.iter().map(|object| object.category).collect();
    found.sort();
    found.dedup();
    assert_eq!(found, Category::ALL.map(|(category, _)| category));
    assert_eq!(document.root, ObjectId(0));
    assert_eq!((&*document.objects[0].plugin, document.objects[0].id.as_deref()), ("", Some("all")));
    let sphere = document.objects.iter().find(|object| object.plugin == "sphere").expect("there is a sphere");
    assert_eq!(sphere.place.to_string(), "s.xml:12:3");
    assert_eq!(sphere.properties[1].place.to_string(), "s.xml:12:41");
}

/// Children are in document order. Children without a name are numbered, references included.
#[test]
fn names_of_children() {
    let document = read(WHOLE);
    assert_eq!(names(&document.objects[0]).join(" "), "_arg_0 _arg_1 _arg_2 _arg_3 _arg_4 _arg_5 _arg_6");
    let sphere = document.objects.iter().find(|object| object.plugin == "sphere").expect("there is a sphere");
    assert_eq!(names(sphere), ["_arg_0", "inside", "_arg_1"]);
    // The reference resolves to the object itself, which is defined later.
    let glass = document.objects.iter().position(|object| object.plugin == "dielectric").expect("there is glass");
    assert_eq!(sphere.properties[0].value, Value::Object(ObjectId(glass)));
}

/// A scene as users write them, with its transforms on one line.
const CAUSTIC: &str = r#"<scene version="3.0.0">
  <default name="spp" value="64"/>
  <default name="integrator" value="path"/>
  <integrator type="$integrator"><integer name="max_depth" value="8"/><integer name="rr_depth" value="5"/></integrator>
  <sensor type="perspective">
    <string name="fov_axis" value="x"/><float name="fov" value="45"/>
    <float name="near_clip" value="0.01"/><float name="far_clip" value="100"/>
    <transform name="to_world"><lookat origin="0, 4.5, 8" target="0, 0.6, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="256"/><integer name="height" value="256"/>
      <string name="component_format" value="float32"/><rfilter type="box"/>
    </film>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
  </sensor>
  <bsdf type="diffuse" id="floor"><rgb name="reflectance" value="0.5, 0.5, 0.5"/></bsdf>
  <bsdf type="dielectric" id="glass"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1.0"/></bsdf>
  <shape type="rectangle"><transform name="to_world"><scale x="5" y="5" z="5"/><rotate x="1" angle="-90"/></transform>
    <ref id="floor"/></shape>
  <shape type="sphere"><point name="center" x="0" y="1.2" z="0"/><float name="radius" value="1"/><ref id="glass"/></shape>
  <emitter type="point"><point name="position" x="0" y="5" z="0"/><rgb name="intensity" value="25, 25, 25"/></emitter>
</scene>"#;

#[test]
fn a_whole_scene() {
    let definitions = [("spp", "16")];
    let document = parse_with(CAUSTIC, &definitions).expect("it is valid");
    let plugins: Vec<_> = document.objects.iter().map(|object| &*object.plugin).collect();
    let expected = ["", "path", "perspective", "hdrfilm", "box", "independent", "diffuse", "dielectric", "rectangle"];
    assert_eq!(plugins, [&expected[..], &["sphere", "point"]].concat());
    assert_eq!(document.objects[5].properties[0].value, Value::Integer(16));
    assert_eq!(names(&document.objects[9]), ["center", "radius", "_arg_0"]);
    assert_eq!(document.objects[9].properties[2].value, Value::Object(ObjectId(7)));
}

#[test]
fn the_root_may_be_any_object() {
    let document = read("<bsdf version=\"3.0.0\" type=\"diffuse\" id=\"a\"><float name=\"x\" value=\"1\"/></bsdf>");
    assert_eq!((document.objects.len(), &*document.object(document.root).plugin), (1, "diffuse"));
    read("<scene version=\"3.0.0\" type=\"scene\"/>");
    read("<spectrum version=\"3.0.0\" type=\"d65\"/>");
    let cases = [
        (
            "<float version=\"3.0.0\" name=\"a\" value=\"1\"/>",
            "1:1: <float> cannot be the outermost element; put it into a <scene version=\"3.0.0\">",
        ),
        (
            "<Scene version=\"3.0.0\"/>",
            "1:1: <Scene> cannot be the outermost element; put it into a <scene version=\"3.0.0\">",
        ),
        ("<bsdf version=\"3.0.0\"/>", "1:1: missing attribute \"type\" in <bsdf>; write <bsdf type=\"...\">"),
        ("<scene/>", "1:1: missing attribute \"version\" in <scene>; write <scene version=\"...\">"),
        ("<scene version=\"3.0.0\" type=\"x\"/>", "1:24: no scene is called \"x\"; a <scene> needs no type"),
    ];
    for (text, expected) in cases {
        assert_eq!(refused(text), format!("s.xml:{expected}"));
    }
}

#[test]
fn an_element_alone_needs_no_version() {
    let document = parse_element("<bsdf type=\"a\"><bsdf type=\"b\"/></bsdf>").expect("it is valid");
    assert_eq!((&*document.object(document.root).plugin, document.objects.len()), ("a", 2));
}

#[test]
fn versions() {
    for version in ["0.6.0", "2.0.0", "3.9.1", "04.0.0"] {
        read(&format!("<scene version=\"{version}\"/>"));
    }
    for version in ["", "3", "3.0", "3.0.0.0", "3.0.0a", "-1.0.0", "3..0", " 3.0.0", "$v"] {
        let expected = format!("s.xml:1:8: invalid version number \"{version}\"; write three numbers like 3.0.0");
        assert_eq!(refused(&format!("<scene version=\"{version}\"/>")), expected);
    }
    let message = refused(&scene("<bsdf version=\"3.0.0\" type=\"diffuse\"/>"));
    assert_eq!(message, "s.xml:2:7: unexpected attribute \"version\" in <bsdf>; <bsdf> may have type, id, name");
}

#[test]
fn tags_and_attributes() {
    let cases = [
        (
            "<foo/>",
            concat!(
                "1: unknown element <foo>; known are scene, integrator, sensor, film, rfilter, sampler, shape, bsdf, ",
                "texture, emitter, medium, phase, volume, float, integer, boolean, string, rgb, spectrum, point, vector, ",
                "transform, ref, default, include, alias, path"
            ),
        ),
        ("<Shape type=\"s\"/>", "1: unknown element <Shape>; did you mean <shape>?"),
        ("<emmiter type=\"s\"/>", "1: unknown element <emmiter>; did you mean <emitter>?"),
        ("<srgb name=\"a\" value=\"1\"/>", "1: unknown element <srgb>; write <rgb>, whose values are linear"),
        (
            "<scale x=\"1\"/>",
            concat!(
                "1: <scale> can only stand inside a <transform>; ",
                "write <transform name=\"to_world\"><scale .../></transform>"
            ),
        ),
        ("<shape/>", "1: missing attribute \"type\" in <shape>; write <shape type=\"...\">"),
        (
            "<shape type=\"s\" foo=\"1\"/>",
            "17: unexpected attribute \"foo\" in <shape>; <shape> may have type, id, name",
        ),
        ("<shape type=\"s\" nmae=\"1\"/>", "17: unexpected attribute \"nmae\" in <shape>; did you mean \"name\"?"),
        ("<float name=\"a\"/>", "1: missing attribute \"value\" in <float>; write <float value=\"...\">"),
        ("<float value=\"1\"/>", "1: missing attribute \"name\" in <float>; write <float name=\"...\">"),
        ("<float name=\"\" value=\"1\"/>", "8: the name is empty; name the property"),
        (
            "<float name=\"a\" value=\"1\"><bsdf type=\"b\"/></float>",
            "27: <bsdf> cannot stand inside <float>; <float> holds no elements",
        ),
        (
            "<default name=\"a\" value=\"1\"><ref id=\"b\"/></default>",
            "29: <ref> cannot stand inside <default>; <default> holds no elements",
        ),
        ("<scene type=\"scene\"/>", "1: a <scene> inside another object; <include> it from a file of its own"),
        ("<ref name=\"a\"/>", "1: missing attribute \"id\" in <ref>; write <ref id=\"...\">"),
        ("<q:float/>", "1: the element \"q:float\" has a namespace; scene files have none"),
        ("<float xmlns=\"u\"/>", "8: unexpected attribute \"xmlns\" in <float>"),
        ("<float xml:space=\"u\"/>", "8: the attribute \"xml:space\" has a namespace; scene files have none"),
    ];
    for (body, expected) in cases {
        assert_eq!(refused_in_shape(body), format!("s.xml:3:{expected}"));
    }
    // Two faults of one element, and the position of a character after others that take several bytes.
    assert_eq!(
        refused(&scene("<!-- é漢 --><shape tpye=\"s\" foo=\"\"/>")),
        "s.xml:2:12: missing attribute \"type\" in <shape>; write <shape type=\"...\">\n\
         s.xml:2:19: unexpected attribute \"tpye\" in <shape>; did you mean \"type\"?\n\
         s.xml:2:28: unexpected attribute \"foo\" in <shape>; <shape> may have type, id, name"
    );
}

#[test]
fn names_are_unique() {
    let first = "<float name=\"a\" value=\"2\"/>";
    let again = "\"a\" is given twice; previous was at s.xml:3:1";
    for second in [
        "<float name=\"a\" value=\"2\"/>",
        "<integer name=\"a\" value=\"2\"/>",
        "<bsdf name=\"a\" type=\"b\"/>",
        "<transform name=\"a\"/>",
        "<ref name=\"a\" id=\"x\"/>",
    ] {
        let message = refused_in_shape(&format!("{first}\n{second}<bsdf type=\"x\" id=\"x\"/>"));
        assert_eq!(message, format!("s.xml:4:1: {again}"));
    }
    assert_eq!(
        refused_in_shape("<bsdf type=\"a\" name=\"_arg_0\"/><bsdf type=\"b\"/>"),
        "s.xml:3:31: \"_arg_0\" is given twice; previous was at s.xml:3:1"
    );
    // Objects may have the same names in them.
    read(&scene(&format!("<shape type=\"s\">{first}</shape><shape type=\"s\">{first}</shape>")));
}

#[test]
fn ids_and_references() {
    read(&scene("<bsdf type=\"a\" id=\"\"/><bsdf type=\"b\" id=\"\"/>"));
    let cases = [
        (
            "<bsdf type=\"a\" id=\"a\"/>\n<bsdf type=\"b\" id=\"a\"/>",
            "3:16: duplicate ID: \"a\"; previous was at s.xml:2:1",
        ),
        (
            "<shape type=\"s\">\n<ref id=\"nope\"/></shape>",
            "3:1: unresolved reference to \"nope\"; no object has id=\"nope\"",
        ),
        (
            "<bsdf type=\"a\" id=\"glas\"/>\n<ref id=\"glass\"/>",
            "3:1: unresolved reference to \"glass\"; did you mean \"glas\"?",
        ),
        (
            "<bsdf type=\"a\" id=\"a\">\n<ref id=\"a\"/></bsdf>",
            "3:1: circular reference: a -> a; an object cannot contain itself",
        ),
        (
            "<bsdf type=\"a\" id=\"a\"><ref id=\"b\"/></bsdf>\n<bsdf type=\"b\" id=\"b\"><bsdf type=\"c\"><ref id=\"a\"/></bsdf></bsdf>",
            "3:38: circular reference: a -> b -> <bsdf> -> a; an object cannot contain itself",
        ),
    ];
    for (body, expected) in cases {
        assert_eq!(refused(&scene(body)), format!("s.xml:{expected}"));
    }
    // The same object twice is not a cycle.
    let document = read(&scene("<ref id=\"a\"/><ref id=\"a\"/><bsdf type=\"a\" id=\"a\"/>"));
    assert_eq!(document.objects.len(), 2);
}

#[test]
fn aliases() {
    let document = read(&scene("<bsdf type=\"a\" id=\"a\"/><alias id=\"a\" as=\"b\"/><ref id=\"b\"/>"));
    assert_eq!(document.objects[0].properties[1].value, Value::Object(ObjectId(1)));
    let cases = [
        (
            "<alias id=\"a\" as=\"b\"/>\n<bsdf type=\"a\" id=\"a\"/>",
            "2:8: alias source ID \"a\" not found; an alias stands after its object; no object has id=\"a\"",
        ),
        (
            "<bsdf type=\"a\" id=\"a\"/>\n<alias id=\"a\" as=\"a\"/>",
            "3:15: duplicate ID: \"a\"; previous was at s.xml:2:1",
        ),
        (
            "<bsdf type=\"a\" id=\"a\"/><alias id=\"a\" as=\"b\"/>\n<bsdf type=\"a\" id=\"b\"/>",
            "3:16: duplicate ID: \"b\"; previous was at s.xml:2:24",
        ),
    ];
    for (body, expected) in cases {
        assert_eq!(refused(&scene(body)), format!("s.xml:{expected}"));
    }
}

/// The text of the string `a` in a shape, after these elements.
fn substituted(before: &str, text: &str, definitions: &[(&str, &str)]) -> Result<String, String> {
    let text = scene(&format!("<shape type=\"s\"><string name=\"a\" value=\"{text}\"/></shape>"));
    let text = text.replacen(">\n", &format!(">\n{before}"), 1);
    let document = parse_with(&text, definitions).map_err(|error| error.to_string())?;
    match &first(&document).properties[0].value {
        Value::String(text) => Ok(text.clone()),
        other => panic!("{other:?}"),
    }
}

/// The elements before, the text, the definitions of the command line, and the result.
type Case = (&'static str, &'static str, &'static [(&'static str, &'static str)], &'static str);

#[test]
fn parameters() {
    let cases: [Case; 9] = [
        ("<default name=\"a\" value=\"1\"/><default name=\"ab\" value=\"2\"/>", "$a $ab $abc x$a.", &[], "1 2 2c x1."),
        // The first definition wins, and the command line comes first.
        ("<default name=\"a\" value=\"1\"/><default name=\"a\" value=\"2\"/>", "$a", &[], "1"),
        ("<default name=\"a\" value=\"1\"/>", "$a", &[("a", "9")], "9"),
        ("<default name=\"a\" value=\"1\"/><default name=\"b\" value=\"$a$a\"/>", "$b", &[], "11"),
        // A parameter may be used in a default only.
        ("<default name=\"b\" value=\"$c\"/>", "x", &[("c", "1")], "x"),
        ("", r"\$a\\$ \x", &[], r"$a\$ \x"),
        ("", "$a", &[("a", "")], ""),
        ("<default name=\"unused\" value=\"1\"/>", "x", &[], "x"),
        ("<default name=\"größe\" value=\"1\"/>", "$größe", &[], "1"),
    ];
    for (before, text, definitions, expected) in cases {
        assert_eq!(substituted(before, text, definitions).as_deref(), Ok(expected), "{before} {text}");
    }
}

#[test]
fn parameters_stand_in_every_attribute() {
    let document = parse_with(
        &scene("<bsdf type=\"$t\" id=\"$t\" name=\"$t\"/><ref id=\"$t\"/><shape type=\"s\"><transform name=\"t\"><scale x=\"$n\"/></transform></shape>"),
        &[("t", "diffuse"), ("n", "2")],
    )
    .expect("it is valid");
    assert_eq!((&*first(&document).plugin, first(&document).id.as_deref()), ("diffuse", Some("diffuse")));
    assert_eq!(names(&document.objects[0]), ["diffuse", "_arg_0", "_arg_1"]);
}

/// Uses of parameters that are rejected.
const REFUSED_PARAMETERS: [Case; 12] = [
    ("", "$r", &[], "s.xml:2:34: undefined parameter: $r; define it before with <default name=\"r\" value=\"...\"/>"),
    (
        "<default name=\"size\" value=\"1\"/>",
        "$sise",
        &[],
        "s.xml:2:66: undefined parameter: $sise; did you mean $size?",
    ),
    (
        "<default name=\"size\" value=\"1\"/>",
        "$n",
        &[],
        "s.xml:2:66: undefined parameter: $n; defined before this place: $size",
    ),
    ("", "5$", &[], "s.xml:2:34: undefined parameter: $; write \\$ for a dollar sign"),
    ("", "x", &[("r", "1")], "unused parameter: $r=1; the scene mentions $r nowhere"),
    (
        "<default name=\"size\" value=\"1\"/>",
        "$size",
        &[("sizes", "1")],
        "unused parameter: $sizes=1; did you mean $size?",
    ),
    // A default of the same name does not help.
    ("<default name=\"r\" value=\"2\"/>", "x", &[("r", "1")], "unused parameter: $r=1; the scene mentions $r nowhere"),
    ("", "$r", &[("r", "1"), ("r", "2")], "parameter $r is defined twice; give it one value"),
    ("", "$r", &[("r", "$s")], "\"$s\" cannot be the value of a parameter; it may not contain $ nor end in \\"),
    (
        "",
        "x",
        &[("$r", "1")],
        "\"$r\" cannot be the name of a parameter; a name has 1 to 64 letters, digits or underscores",
    ),
    (
        "<default name=\"r\" value=\"\\$s\"/>",
        "x",
        &[],
        "s.xml:2:19: \"$s\" cannot be the value of a parameter; it may not contain $ nor end in \\",
    ),
    (
        "<default name=\"\" value=\"1\"/>",
        "x",
        &[],
        "s.xml:2:10: \"\" cannot be the name of a parameter; a name has 1 to 64 letters, digits or underscores",
    ),
];

#[test]
fn refused_parameters() {
    for (before, text, definitions, expected) in REFUSED_PARAMETERS {
        assert_eq!(substituted(before, text, definitions), Err(expected.to_owned()), "{before} {text}");
    }
    // An attribute with a fault is not checked further.
    assert_eq!(
        refused_in_shape("<float name=\"a\" value=\"$b\"/>"),
        "s.xml:3:17: undefined parameter: $b; define it before with <default name=\"b\" value=\"...\"/>"
    );
    // A default applies only after its place.
    assert_eq!(
        refused(&scene("<bsdf type=\"$t\"/>\n<default name=\"t\" value=\"diffuse\"/>")),
        "s.xml:2:7: undefined parameter: $t; define it before with <default name=\"t\" value=\"...\"/>"
    );
}

#[test]
fn several_faults_are_told_at_once_in_document_order() {
    let text = scene(concat!(
        "<shape type=\"s\"><ref id=\"nope\"/>\n<float name=\"a\" value=\"x\"/>\n<integer name=\"b\" value=\"1.5\"/>\n",
        "<transform name=\"t\"><scale x=\"0\"/></transform>\n<boolean name=\"a\" value=\"true\"/>\n",
        "<boolean name=\"a\" value=\"true\"/></shape>"
    ));
    assert_eq!(
        refused(&text),
        "s.xml:2:17: unresolved reference to \"nope\"; no object has id=\"nope\"\n\
         s.xml:3:17: could not parse floating point value \"x\"; write a number like 1, -0.5 or 2e-3\n\
         s.xml:4:19: could not parse integer value \"1.5\"; write a whole number of 64 bits like 3 or -1\n\
         s.xml:5:1: the transform is singular; it must not flatten space; no scale may be 0\n\
         s.xml:7:1: \"a\" is given twice; previous was at s.xml:6:1"
    );
    // An id is not reported as missing if a skipped part may define it.
    let text = scene("<bsfd type=\"x\"><bsdf type=\"x\" id=\"a\"/></bsfd><ref id=\"a\"/>");
    assert_eq!(refused(&text), "s.xml:2:1: unknown element <bsfd>; did you mean <bsdf>?");
}

#[test]
fn old_names() {
    let old = |body: &str| format!("<scene version=\"1.9.9\">\n{body}\n</scene>");
    let document = read(&old(concat!(
        "<bsdf type=\"diffuse\" name=\"myBSDF\"><rgb name=\"diffuseReflectance\" value=\"1\"/></bsdf>",
        "<bsdf type=\"phong\"><rgb name=\"diffuseReflectance\" value=\"1\"/><float name=\"intIOR\" value=\"1\"/>",
        "<float name=\"IORint\" value=\"1\"/><float name=\"uScale\" value=\"1\"/><float name=\"a1B\" value=\"1\"/></bsdf>"
    )));
    assert_eq!(names(&document.objects[0]), ["my_bsdf", "_arg_0"]);
    assert_eq!(names(&document.objects[1]), ["reflectance"]);
    assert_eq!(names(&document.objects[2]), ["diffuse_reflectance", "int_ior", "IORint", "u_scale", "a1B"]);
    // Files of version 2.0.0 or newer are not upgraded.
    let document = read("<bsdf version=\"2.0.0\" type=\"diffuse\"><float name=\"toWorld\" value=\"1\"/></bsdf>");
    assert_eq!(names(&document.objects[0]), ["toWorld"]);
    assert_eq!(
        refused(&old(
            "<shape type=\"s\"><float name=\"toWorld\" value=\"1\"/>\n<float name=\"to_world\" value=\"1\"/></shape>"
        )),
        "s.xml:3:1: \"to_world\" is given twice; previous was at s.xml:2:17"
    );
    assert_eq!(
        refused(&old("<shape type=\"s\"><transform name=\"t\">\n<lookAt/></transform></shape>")),
        "s.xml:3:1: unexpected <lookAt> inside <transform>; did you mean <lookat>?"
    );
}

/// `to_uv` translates first and then scales: `4 (u + 0.25) = 4 u + 1`.
#[test]
fn old_textures() {
    let old = |body: &str| format!("<texture version=\"0.6.0\" type=\"bitmap\">\n{body}\n</texture>");
    let document = read(&old(concat!(
        "<float name=\"uoffset\" value=\"0.25\"/><integer name=\"uscale\" value=\"4\"/>",
        "<float name=\"voffset\" value=\"0.5\"/><float name=\"vscale\" value=\"2\"/><float name=\"x\" value=\"2\"/>"
    )));
    assert_eq!(names(&document.objects[0]), ["x", "to_uv"]);
    let Value::Transform(to_uv) = document.objects[0].properties[1].value else { panic!("to_uv is a transform") };
    assert_eq!(to_uv.matrix3.to_cols_array(), [4., 0., 0., 0., 2., 0., 0., 0., 1.]);
    assert_eq!(to_uv.translation.to_array(), [1.0, 1.0, 0.0]);
    let cases = [
        ("<string name=\"uscale\" value=\"1\"/>", "2:1: \"uscale\" is not a number; write it as <float>"),
        (
            "<float name=\"uscale\" value=\"0\"/>",
            "2:1: the transform is singular; it must not flatten space; no scale may be 0",
        ),
        (
            "<float name=\"uscale\" value=\"2\"/>\n<transform name=\"toUv\"/>",
            "3:1: \"to_uv\" beside \"uoffset\", \"voffset\", \"uscale\" or \"vscale\"; keep one of them",
        ),
    ];
    for (body, expected) in cases {
        assert_eq!(refused(&old(body)), format!("s.xml:{expected}"));
    }
}
