//! The library from a user's view: scenes built in code, the prelude, and the examples.

use std::{path::Path, process::Command};

use etendue::{prelude::*, provenance};

use crate::kit::{self, Folder};

fn rendered(document: &Document) -> Image {
    let renderer = Renderer::new(document, &Overrides::default()).unwrap();
    renderer.render(Replicate { seed: 1, number: 0, samples: 4 }, &|_| {}).image()
}

/// [`kit::busy`] in code.
fn busy() -> ObjectBuilder {
    let camera = sensor("thinlens")
        .with("aperture_radius", 0.1)
        .with("focus_distance", 5)
        .with("to_world", Transform::new().look_at([0.0, 1.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0]))
        .child(sampler("stratified"))
        .child(film("hdrfilm").with("width", 24).with("height", 20));
    let wall = Transform::new().scale_uniformly(3.0).translate([0.0, 0.0, -2.0]);
    let lamp = Transform::new().rotate([1.0, 0.0, 0.0], 90.0).translate([0.0, 3.0, 0.0]);
    scene()
        .child(integrator("path").with("rr_depth", 2))
        .child(camera)
        .child(emitter("constant").with("radiance", rgb(0.5, 0.7, 1.0)))
        .child(shape("sphere").child(bsdf("dielectric")))
        .child(shape("rectangle").with("to_world", wall))
        .child(shape("disk").with("to_world", lamp).child(emitter("area").with("radiance", rgb(9.0, 9.0, 9.0))))
}

#[test]
fn code_and_xml_give_the_same_bits() {
    let from_xml = kit::image(&kit::busy("stratified", ""), 4);
    assert_eq!(kit::bits(&rendered(&busy().build().unwrap())), kit::bits(&from_xml));
}

/// Two triangles at an angle, with normals and texture coordinates that differ from the computed ones.
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n\
    -1 -1 0 0 0.1 1 0 0\n1 -1 0.3 0.2 0 1 1 0\n1 1 0 0 0 1 1 1\n-1 1 0.3 0 -0.1 1 0 1\n3 0 1 2\n3 0 2 3\n";

#[test]
fn a_mesh_of_arrays_is_that_of_its_file() {
    let positions = vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.3], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.3]];
    let normals = vec![[0.0, 0.1, 1.0], [0.2, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, -0.1, 1.0]];
    let arrays = MeshArrays::new(positions, vec![[0, 1, 2], [0, 2, 3]]).with_normals(normals).with_uvs(vec![
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
    ]);
    let folder = Folder::new();
    folder.write("square.ply", PLY);
    let from_file = shape("ply").with("filename", folder.path("square.ply").as_path());
    let images = [shape("mesh").with("arrays", arrays), from_file].map(|mesh| {
        let mesh = mesh.child(bsdf("diffuse").with("reflectance", texture("checkerboard")));
        rendered(&busy().child(mesh).build().unwrap())
    });
    assert_eq!(kit::bits(&images[0]), kit::bits(&images[1]));
    assert_ne!(kit::bits(&images[0]), kit::bits(&rendered(&busy().build().unwrap())));
}

#[test]
fn faults_of_built_scenes_name_line_object_and_parameter() {
    let line = line!() + 3;
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let faulty = busy()
        .child(shape("mesh").with("arrays", MeshArrays::new(corners, vec![[0, 1, 3]])))
        .child(shape("sphere").with("radios", 1.0))
        .child(shape("cube").id("box").child(bsdf("difuse")))
        .child(shape("ply"));
    let error = Renderer::new(&faulty.build().unwrap(), &Overrides::default()).unwrap_err().to_string();
    let expected = [
        r#"30: shape "mesh" #4: face 0 (counted from 0) uses vertex 3 (counted from 0), the mesh has 3 vertices"#,
        r#"32: shape "sphere" #5: a shape "sphere" has no parameter "radios""#,
        r#"46: shape "cube" with the id "box" > bsdf "difuse": no bsdf is called "difuse""#,
        r#"16: shape "ply" #7: a shape "ply" needs "filename""#,
    ];
    for (i, expected) in expected.into_iter().enumerate() {
        let place = format!("{}:{}:", file!(), line + i as u32);
        assert!(error.contains(&format!("{place}{expected}")), "{error}\nlacks\n{place}{expected}");
    }
    // A program whose `main` returns the error prints the same lines.
    assert_eq!(format!("{:?}", SceneError::nowhere("nothing")), "nothing");
}

#[test]
fn the_hash_of_a_built_scene_is_that_of_its_parameters() {
    let hash = |scene: ObjectBuilder| provenance::scene_hash(&scene.build().unwrap()).unwrap();
    let ball = |radius: f64| busy().child(shape("sphere").with("radius", radius));
    assert_eq!(hash(ball(0.5)), hash(ball(0.5)));
    assert_ne!(hash(ball(0.5)), hash(ball(0.500_000_000_000_000_1)));
    assert_ne!(hash(busy()), hash(ball(1.0)));
}

/// The output of an example. It is built in the same profile as the tests, and only if it is not up to date.
fn printed(example: &str, argument: &Path) -> String {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
    cargo.current_dir(kit::root()).args(["run", "--quiet", "--example", example]);
    if !cfg!(debug_assertions) {
        cargo.arg("--release");
    }
    let output = cargo.arg("--").arg(argument).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_examples_do_what_they_say() {
    let folder = Folder::with_scene(&kit::ball());
    let array = printed("render_to_array", &folder.path("scene.xml"));
    assert!(array.starts_with("shape (12, 16, 3), "), "{array}");

    let caustic = printed("sppm_caustic", &folder.path(""));
    assert!(caustic.contains("wrote caustic.exr and caustic.png"), "{caustic}");
    let image = exr::read(&folder.path("caustic.exr")).unwrap();
    assert_eq!((image.crop.width, image.crop.height), (160, 120));
    assert_eq!(image.attribute("passes"), Some("32"));
    assert!(folder.path("caustic.png").is_file());

    let compared = printed("compare_films", Path::new("."));
    let verdicts: Vec<_> = compared.lines().filter(|line| !line.starts_with(' ') && !line.is_empty()).collect();
    for (verdict, expected) in verdicts.iter().zip(["undecided", "agrees", "differs"]) {
        assert!(verdict.contains(&format!(": {expected}")), "{compared}");
    }
    assert_eq!(verdicts.len(), 3, "{compared}");
}
