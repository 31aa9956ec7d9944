use std::path::Path;

use glam::{DAffine3, DVec3};

use super::*;
use crate::scene_file::{MeshArrays, Object, Property, Spectrum, Transform, Value, xml};

/// A scene with a value of every type that XML has, nested objects, references and unnamed children.
const TEXT: &str = r#"<scene version="3.0.0">
    <integrator type="path" id="walk"><integer name="max_depth" value="-1"/><boolean name="hide_emitters" value="true"/></integrator>
    <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.8, 0.1, 0.1"/></bsdf>
    <shape type="sphere">
        <float name="radius" value="0.3"/>
        <point name="center" x="1" y="-2" z="0.1"/>
        <ref id="red"/>
        <ref name="other" id="walk"/>
        <transform name="to_world">
            <scale x="2" y="3" z="0.7"/><scale value="0.3"/><rotate x="0.6" y="0.8" angle="33"/><translate x="1" y="0.1" z="-4"/>
            <lookat origin="1, 2, 3" target="0, 0.5, 0.1" up="0, 1, 0"/><matrix value="1 0.5 0 4 0 1 0 5 0 0.25 1 6 0 0 0 1"/>
        </transform>
    </shape>
    <shape type="rectangle">
        <bsdf type="diffuse">
            <texture type="bitmap" name="reflectance"><string name="filename" value="wood.png"/></texture>
        </bsdf>
        <emitter type="area">
            <spectrum name="radiance" value="400:0.5, 700:2"/><spectrum name="grey" value="0.2"/>
            <spectrum name="file" filename="lamp.spd"/>
        </emitter>
    </shape>
</scene>"#;

fn built() -> ObjectBuilder {
    let to_world = Transform::new()
        .scale([2.0, 3.0, 0.7])
        .scale_uniformly(0.3)
        .rotate([0.6, 0.8, 0.0], 33.0)
        .translate([1.0, 0.1, -4.0])
        .look_at([1.0, 2.0, 3.0], [0.0, 0.5, 0.1], [0.0, 1.0, 0.0])
        .matrix([[1.0, 0.5, 0.0, 4.0], [0.0, 1.0, 0.0, 5.0], [0.0, 0.25, 1.0, 6.0]]);
    let ball = shape("sphere")
        .with("radius", 0.3)
        .with("center", [1.0, -2.0, 0.1])
        .child(reference("red"))
        .with("other", reference("walk"))
        .with("to_world", to_world);
    let wood = bsdf("diffuse").with("reflectance", texture("bitmap").with("filename", Path::new("wood.png")));
    let lamp = emitter("area")
        .with("radiance", Spectrum::Tabulated(vec![(400.0, 0.5), (700.0, 2.0)]))
        .with("grey", Spectrum::Uniform(0.2))
        .with("file", Spectrum::File("lamp.spd".into()));
    scene()
        .child(integrator("path").with("max_depth", -1).with("hide_emitters", true).id("walk"))
        .child(bsdf("diffuse").with("reflectance", rgb(0.8, 0.1, 0.1)).id("red"))
        .children([ball, shape("rectangle").child(wood).child(lamp)])
}

/// All of an object except its place.
fn content(object: &Object) -> (Category, &str, Option<&str>, Vec<(&str, &Value)>) {
    let properties = object.properties.iter().map(|Property { name, value, .. }| (name.as_str(), value)).collect();
    (object.category, &object.plugin, object.id.as_deref(), properties)
}

#[test]
fn a_built_document_is_that_of_its_xml() {
    let folder = Path::new("some/where");
    let from_text = xml::parse(TEXT, "scene.xml", folder, &[]).expect("valid XML");
    let from_code = built().build_in(folder).expect("a valid scene");
    assert_eq!(from_code.objects.len(), from_text.objects.len());
    for (code, text) in from_code.objects.iter().zip(&from_text.objects) {
        assert_eq!(content(code), content(text));
        assert_eq!(code.folder, text.folder);
    }
    assert_eq!((from_code.root, from_code.files), (from_text.root, Vec::new()));
}

#[test]
fn numbers_of_all_types_become_values() {
    let object = shape("p")
        .with("a", 0.5_f32)
        .with("b", u32::MAX)
        .with("c", i64::MIN)
        .with("d", 7_usize)
        .with("e", String::from("text"))
        .with("f", DVec3::X)
        .with("g", DAffine3::IDENTITY)
        .with("h", f64::INFINITY)
        .with("i", MeshArrays::new(Vec::new(), Vec::new()));
    let document = object.build().expect("valid values");
    let values: Vec<_> = document.object(document.root).properties.iter().map(|p| p.value.clone()).collect();
    let expected = [
        Value::Float(0.5),
        Value::Integer(4_294_967_295),
        Value::Integer(i64::MIN),
        Value::Integer(7),
        Value::String("text".into()),
        Value::Vector(DVec3::X),
        Value::Transform(DAffine3::IDENTITY),
        Value::Float(f64::INFINITY),
        Value::Mesh(MeshArrays::default().into()),
    ];
    assert_eq!(values, expected);
}

/// The lines of the faults, without file, line and column.
fn faults(object: ObjectBuilder) -> Vec<String> {
    let error = object.build().expect_err("there is a fault");
    let line = |text: &str| {
        let (place, rest) = text.split_once(": ").expect("a place comes first");
        assert!(place.starts_with(&format!("{}:", file!())), "{place}");
        rest.to_owned()
    };
    error.to_string().lines().map(line).collect()
}

#[test]
fn a_fault_names_line_object_and_parameter() {
    let line = line!() + 1;
    let ball = shape("sphere").with("to_world", Transform::new().scale([1.0, 0.0, 1.0]));
    let message = scene().child(ball).build().expect_err("it is flat").to_string();
    let expected = format!(
        "{}:{line}:32: shape \"sphere\": \"to_world\": the transform is singular; it must not flatten space; no scale may be 0",
        file!()
    );
    assert_eq!(message, expected);
}

#[test]
fn every_fault_is_reported() {
    let lamp = || shape("disk").child(emitter("area").with("radiance", rgb(1.0, f64::NAN, 0.0)));
    let balls = [
        shape("sphere").with("radius", 1.0).with("radius", 2.0),
        shape("sphere").id("ball").with("radius", f64::NAN),
        shape("cube").id("ball").with("to_world", Transform::new().rotate([0.0; 3], 1.0)),
    ];
    let messages = faults(scene().child(lamp()).children(balls).child(reference("bal")).with("", 1));
    let expected = [
        r#"shape "disk" #1 > emitter "area": "radiance": [1.0, NaN, 0.0] is not finite; give finite numbers"#,
        r#"shape "sphere" #2: "radius" is given twice; previous was at "#,
        r#"shape "sphere" with the id "ball": "radius": NaN is not a number; give a number"#,
        r#"shape "cube" with the id "ball": duplicate ID: "ball"; previous was at "#,
        r#"shape "cube" with the id "ball": "to_world": the rotation axis is zero; give it a direction such as 1, 0, 0"#,
        r#"the scene: the name is empty; name the parameter"#,
        r#"the scene: unresolved reference to "bal"; did you mean "ball"?"#,
    ];
    assert_eq!(messages.len(), expected.len(), "{messages:#?}");
    for (message, expected) in messages.iter().zip(expected) {
        assert!(message.starts_with(expected), "{message}\ninstead of\n{expected}");
    }
}

#[test]
fn spectra_are_checked_as_in_files() {
    let spectrum = |pairs: &[(f64, f64)]| emitter("area").with("radiance", Spectrum::Tabulated(pairs.to_vec()));
    let fault = |pairs: &[(f64, f64)]| faults(spectrum(pairs)).concat();
    assert!(fault(&[(1.0, 1.0)]).contains("\"radiance\": a spectrum needs 2 pairs of wavelength and value, got 1"));
    assert!(fault(&[(1.0, 1.0), (1.0, 2.0)]).contains("\"radiance\": the wavelength 1 does not rise above 1"));
    assert!(fault(&[(1.0, 1.0), (2.0, f64::INFINITY)]).contains("\"radiance\": (2.0, inf) is not finite"));
}

#[test]
fn an_object_cannot_contain_itself_nor_a_scene() {
    let cycle = faults(scene().child(shape("csg").id("a").child(shape("csg").child(reference("a")))));
    assert_eq!(cycle.len(), 1);
    assert!(
        cycle[0].starts_with(r#"shape "csg" with the id "a" > shape "csg": circular reference: a -> "#),
        "{cycle:?}"
    );
    let nested = faults(scene().child(scene()));
    assert_eq!(nested, ["the scene: a scene inside another object; add its objects one by one"]);
}
