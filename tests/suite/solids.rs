//! Regression tests of solids and materials.

use crate::kit::{self, Folder, INTEGRATOR, SENSOR, SKY, image, image_in, pixel, run};

const GREY: &str = r#"<bsdf type="diffuse"/>"#;

/// The vertices of a cube, and two triangles for each of its faces except the last.
const VERTICES: &str = "-1 -1 -1\n1 -1 -1\n-1 1 -1\n1 1 -1\n-1 -1 1\n1 -1 1\n-1 1 1\n1 1 1\n";
const FACES: &str = "3 4 5 7\n3 4 7 6\n3 0 1 5\n3 0 5 4\n3 2 6 7\n3 2 7 3\n3 0 4 6\n3 0 6 2\n3 1 3 7\n3 1 7 5\n";

#[test]
fn a_sliver_closes_a_mesh() {
    // On the last face the edge from 0 to 2 is split at 8; a triangle of zero area closes the gap.
    let last = "3 8 3 1\n3 8 1 0\n3 8 2 3\n";
    let mesh = |faces: &str| {
        let count = 13 + usize::from(faces.len() > last.len());
        format!("kcply\nelement vertex 9\nelement face {count}\n{VERTICES}-1 0 -1\n{FACES}{faces}")
    };
    let glass = r#"<bsdf type="dielectric"/>"#;
    let shape = format!(r#"<shape type="kcply"><string name="filename" value="m.kcply"/>{glass}</shape>"#);
    let folder = Folder::with_scene(&kit::scene_of(&[INTEGRATOR, SENSOR, SKY, &shape]));
    folder.write("m.kcply", mesh(&format!("{last}3 0 2 8\n")));
    image_in(&folder, 1);
    folder.write("m.kcply", mesh(last));
    let said = run(&mut folder.etendue("render scene.xml -o image.exr"));
    assert_eq!(said.code, Some(2));
    assert!(said.err.contains("the mesh is open: 3 edges"), "{}", said.err);
}

#[test]
fn each_side_of_a_surface_glows_by_itself() {
    let square = |bsdfs: &str, angle: f64| {
        let map =
            format!(r#"<transform name="to_world"><scale value="9"/><rotate y="1" angle="{angle}"/></transform>"#);
        let shape = format!(r#"<shape type="rectangle">{map}<bsdf type="twosided">{bsdfs}</bsdf></shape>"#);
        pixel(&image(&kit::scene_of(&[INTEGRATOR, SENSOR, &shape]), 4), 8, 6)
    };
    let front_glows = format!(r#"<bsdf type="normals"/>{GREY}"#);
    let back_glows = format!(r#"{GREY}<bsdf type="normals"/>"#);
    for angle in [0.0, 180.0] {
        let shown = [&front_glows, &back_glows].map(|bsdfs| square(bsdfs, angle) != [0.0; 3]);
        assert!(shown[0] != shown[1], "one side shows it, the other does not: {shown:?} at {angle}");
    }
}

#[test]
fn metal_that_is_nearly_a_mirror_is_one() {
    let ball = |roughness: &str| {
        let metal = format!(r#"<bsdf type="metal"><float name="roughness" value="{roughness}"/></bsdf>"#);
        let shape = format!(r#"<shape type="sphere">{metal}</shape>"#);
        pixel(&image(&kit::scene_of(&[INTEGRATOR, SENSOR, SKY, &shape]), 4), 8, 6)
    };
    for roughness in ["1e-110", "1e-17", "1e-8"] {
        assert_eq!(ball(roughness), ball("0"), "{roughness}");
    }
}
