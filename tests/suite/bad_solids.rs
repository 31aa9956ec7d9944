//! Bad input of `render` in extensions to Mitsuba: shapes that are not solids, quadrics without a surface, kcply files.

use crate::{
    bad_input::{check_all, scene, shapes},
    kit::{self, SENSOR, SKY},
};

const GLASS: &str =
    r#"<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>"#;
const KCPLY: &str = r#"<shape type="kcply"><string name="filename" value="m.kcply"/></shape>"#;

const OPEN: &str = "the mesh is open: 96 edges have no matching triangle on the other side: (";
const SIDES: &str = "the quadric has no surface with two sides";

fn teapot() -> Vec<u8> {
    std::fs::read(kit::root().join("assets/meshes/teapot-coarse.kcply")).unwrap()
}

fn with_glass(mesh: &str) -> String {
    mesh.replace("</shape>", &format!("{GLASS}</shape>"))
}

fn csg(inner: &str) -> String {
    format!(r#"<shape type="csg"><string name="operation" value="difference"/>{inner}</shape>"#)
}

#[test]
fn open_meshes_are_no_solids() {
    let flat = "kcply\nelement vertex 3\nelement face 2\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n";
    check_all(vec![
        ("an open teapot of glass", shapes(&with_glass(KCPLY), &[OPEN]).with("m.kcply", teapot())),
        (
            "an open teapot as an operand",
            shapes(
                &csg(&format!("<shape type=\"sphere\"/>{KCPLY}")),
                &["this shape cannot be an operand of a csg: the mesh is open: 96"],
            )
            .with("m.kcply", teapot()),
        ),
        ("a mesh without volume", shapes(&csg(KCPLY), &["the mesh has no volume"]).with("m.kcply", flat)),
    ]);
}

#[test]
fn glass_on_an_open_mesh_can_be_meant() {
    let lake = with_glass(KCPLY).replace("<bsdf", r#"<boolean name="allow_open" value="true"/><bsdf"#);
    let folder = kit::Folder::with_scene(&kit::scene(&lake));
    folder.write("m.kcply", teapot());
    kit::image_in(&folder, 1);
}

#[test]
fn operands_that_are_no_solids() {
    let lamp = r#"<emitter type="area"/>"#;
    check_all(vec![
        ("nothing", shapes(&csg(""), &["a shape \"csg\" has no operands; put the operands inside it"])),
        (
            "a rectangle",
            shapes(&csg(r#"<shape type="rectangle"/>"#), &["cannot be an operand of a csg: it is an open surface"]),
        ),
        (
            "a triangle",
            shapes(
                &csg(r#"<shape type="triangle"><point name="p0" value="0"/><point name="p1" x="1" y="0" z="0"/>
            <point name="p2" x="0" y="1" z="0"/></shape>"#),
                &["cannot be an operand of a csg: the mesh is open: 3 edges"],
            ),
        ),
        (
            "a lamp",
            shapes(
                &csg(&format!(r#"<shape type="sphere">{lamp}</shape>"#)),
                &["an operand of a csg cannot be an area light"],
            ),
        ),
        (
            "flipped",
            shapes(
                &csg(r#"<shape type="sphere"><boolean name="flip_normals" value="true"/></shape>"#),
                &["the normals of an operand cannot be flipped"],
            ),
        ),
        ("an unknown operand", shapes(&csg(r#"<shape type="ball"/>"#), &["no shape is called \"ball\""])),
        (
            "a parameter of an operand",
            shapes(
                &csg(r#"<shape type="sphere"><float name="radiu" value="1"/></shape>"#),
                &["a shape \"sphere\" has no parameter \"radiu\""],
            ),
        ),
        (
            "a csg that shines",
            shapes(&csg(&format!(r#"<shape type="sphere"/>{lamp}"#)), &["a shape \"csg\" cannot be an area light"]),
        ),
        (
            "a plane that shines",
            shapes(
                &format!(r#"<shape type="plane">{lamp}</shape>"#),
                &["a shape \"plane\" cannot be an area light; its area"],
            ),
        ),
    ]);
}

fn quadric(coefficients: &str) -> String {
    format!(
        r#"<shape type="quadric"><string name="coefficients" value="{coefficients}"/><point name="bbox_min" value="-1"/>
           <point name="bbox_max" value="1"/></shape>"#
    )
}

#[test]
fn quadrics_without_a_surface() {
    check_all(vec![
        ("zeros", shapes(&quadric("0 0 0 0 0 0 0 0 0 0"), &[SIDES])),
        ("a constant", shapes(&quadric("0 0 0 0 0 0 0 0 0 3"), &[SIDES])),
        ("a double plane", shapes(&quadric("1 4 1 4 -2 -4 6 12 -6 9"), &[SIDES])),
        ("NaN", shapes(&quadric("1 1 nan 0 0 0 0 0 0 -1"), &["\"nan\" in \"coefficients\" is not a finite number"])),
        (
            "infinite",
            shapes(&quadric("1 1 inf 0 0 0 0 0 0 -1"), &["\"inf\" in \"coefficients\" is not a finite number"]),
        ),
        ("nine", shapes(&quadric("1 1 1 0 0 0 0 0 -1"), &["\"coefficients\" has 9 numbers; give ten numbers"])),
        ("words", shapes(&quadric("one"), &["\"one\" in \"coefficients\" is not a finite number"])),
        (
            "an empty box",
            shapes(&quadric("1 1 1 0 0 0 0 0 0 -1").replace("value=\"-1\"/>", "value=\"1\"/>"), &["the box is empty"]),
        ),
        (
            "sheets outside the heights",
            shapes(
                r#"<shape type="hyperboloid"><integer name="sheets" value="2"/><float name="axis" value="2"/></shape>"#,
                &["both sheets lie outside z_min to z_max: their vertices are at ±2"],
            ),
        ),
        (
            "three sheets",
            shapes(r#"<shape type="hyperboloid"><integer name="sheets" value="3"/></shape>"#, &["\"sheets\" is 3"]),
        ),
        ("a flat cone", shapes(r#"<shape type="cone"><float name="height" value="0"/></shape>"#, &["\"height\" is 0"])),
        (
            "an ellipsoid without a radius",
            shapes(r#"<shape type="ellipsoid"><vector name="radii" x="1" y="0" z="1"/></shape>"#, &["\"radii\" is 0"]),
        ),
    ]);
}

#[test]
fn kcply_files_that_are_wrong() {
    let mesh = |faces: &str| {
        format!("kcply\nelement vertex 4\nelement face {}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n{faces}", faces.lines().count())
    };
    check_all(vec![
        (
            "an ambiguous base",
            shapes(
                KCPLY,
                &["m.kcply: the indices of the faces range from 1 to 3 for 4 vertices, which fits both index bases"],
            )
            .with("m.kcply", mesh("3 1 2 3\n")),
        ),
        (
            "both bases",
            shapes(KCPLY, &["m.kcply: the indices of the faces include both 0 and 4"])
                .with("m.kcply", mesh("3 0 1 4\n")),
        ),
        (
            "short",
            shapes(KCPLY, &["m.kcply: the header declares 4 vertices, the file ends after 2"])
                .with("m.kcply", "kcply\nelement vertex 4\nelement face 1\n0 0 0\n1 0 0\n"),
        ),
        (
            "quads",
            shapes(KCPLY, &["m.kcply: line 8: a face has 4 corners; only triangles are allowed"])
                .with("m.kcply", mesh("4 0 1 2 3\n")),
        ),
        ("junk", shapes(KCPLY, &["m.kcply: line 8: \"x\" is not a number"]).with("m.kcply", mesh("3 0 1 x\n"))),
        (
            "a PLY file",
            shapes(KCPLY, &["m.kcply: line 1: found \"ply\"; a kcply file begins"]).with("m.kcply", "ply\n"),
        ),
    ]);
}

#[test]
fn materials_lights_and_shadows_that_are_wrong() {
    let ball = |bsdf: &str| format!(r#"<shape type="sphere">{bsdf}</shape>"#);
    let phong = r#"<bsdf type="phong"><float name="diffuse_reflectance" value="0.7"/><float name="specular_reflectance" value="0.6"/></bsdf>"#;
    let spot = r#"<emitter type="spot"><float name="cutoff_angle" value="20"/><float name="beam_width" value="30"/></emitter>"#;
    let direct = r#"<integrator type="direct"><integer name="emitter_samples" value="0"/><boolean name="transparent_shadows" value="true"/></integrator>"#;
    let smooth = r#"<shape type="triangle"><point name="p0" value="0"/><point name="p1" x="1" y="0" z="0"/><point name="p2" x="0" y="1" z="0"/>
        <vector name="n0" x="0" y="0" z="1"/></shape>"#;
    check_all(vec![
        ("bright phong", shapes(&ball(phong), &["diffuse and specular reflectance add up to 1.29"])),
        (
            "one part",
            shapes(&ball(r#"<bsdf type="blendbsdf"><bsdf type="diffuse"/></bsdf>"#), &["holds two bsdfs, this has 1"]),
        ),
        ("a wide beam", shapes(spot, &["beam_width 30 is beyond cutoff_angle 20"])),
        (
            "no emitter samples",
            scene(kit::scene_of(&[direct, SENSOR, SKY]), &["transparent shadows need emitter samples"]),
        ),
        ("one normal of three", shapes(smooth, &["a triangle needs normals at all corners or at none"])),
        (
            "a model that is none",
            shapes(
                &ball(r#"<bsdf type="schlick"><string name="reflectance_model" value="fresnel"/></bsdf>"#),
                &["\"reflectance_model\" cannot be \"fresnel\"; known: schlick, none"],
            ),
        ),
    ]);
}
