//! The meaning of values, and different ways to write the same scene.

use std::fs;

use crate::kit::{self, Folder, INTEGRATOR, SENSOR, SKY, bits, image, image_in, pixel, run};

/// A square in the middle of the film, 2 in front of the origin.
fn square(inner: &str, turn: &str) -> String {
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="0.5"/>{turn}<translate z="2"/></transform>{inner}</shape>"#
    )
}

const LAMP: &str = r#"<emitter type="area"><rgb name="radiance" value="3, 2, 1"/></emitter>"#;
const BLACK: &str = r#"<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>"#;
const AROUND: &str = r#"<rotate y="1" angle="180"/>"#;

#[test]
fn a_lamp_without_a_bsdf_is_black_and_another_shape_is_grey() {
    let of = |inner: &str| bits_of(&kit::scene(&square(inner, "")));
    let grey = r#"<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>"#;
    assert_eq!(of(LAMP), of(&format!("{BLACK}{LAMP}")));
    assert_ne!(of(LAMP), of(&format!("{grey}{LAMP}")));
    assert_eq!(of(""), of(grey));
    assert_eq!(of("<bsdf type=\"diffuse\"/>"), of(grey));
}

fn bits_of(text: &str) -> Vec<(String, Vec<u32>)> {
    let image = image(text, 4);
    bits(&image).into_iter().map(|(name, values)| (name.to_owned(), values)).collect()
}

#[test]
fn mirrors_turn_spheres_inside_out_as_in_mitsuba() {
    let ball = |scale: &str, flip: bool| {
        let map = format!(r#"<transform name="to_world"><scale {scale}/></transform>"#);
        format!(r#"<shape type="sphere">{map}<boolean name="flip_normals" value="{flip}"/>{LAMP}</shape>"#)
    };
    let of = |ball: String| bits_of(&kit::scene(&ball));
    assert_eq!(of(ball(r#"x="-1""#, false)), of(ball(r#"x="-1" y="-1" z="-1""#, false)));
    assert_eq!(of(ball(r#"x="-1" y="-1""#, false)), of(ball("", false)));
    let middle = |ball: String| pixel(&image(&kit::scene_of(&[INTEGRATOR, SENSOR, &ball]), 4), 8, 6);
    assert_eq!(middle(ball(r#"y="-1""#, false)), [0.0; 3]);
    assert_eq!(middle(ball(r#"y="-1""#, true)), [3.0, 2.0, 1.0]);
}

#[test]
fn meshes_with_normals_shine_to_their_side_in_mirrors_too() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
        property float ny\nproperty float nz\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        -2 -2 0 0 0 1\n2 -2 0 0 0 1\n0 3 0 0 0 1\n3 0 1 2\n";
    let middle = |scale: &str, face_normals: bool| {
        let shape = format!(
            r#"<shape type="ply"><string name="filename" value="a.ply"/><boolean name="face_normals" value="{face_normals}"/>
               <transform name="to_world"><scale {scale}/></transform>{LAMP}</shape>"#
        );
        let folder = Folder::with_scene(&kit::scene_of(&[INTEGRATOR, SENSOR, &shape]));
        folder.write("a.ply", ply);
        pixel(&image_in(&folder, 4), 8, 6)
    };
    assert_eq!(middle("", false), [3.0, 2.0, 1.0]);
    assert_eq!(middle(r#"x="-1""#, false), [3.0, 2.0, 1.0]);
    assert_eq!(middle(r#"x="-1""#, true), [0.0; 3]);
    assert_eq!(middle(r#"z="-1""#, false), [0.0; 3]);
}

#[test]
fn what_is_hidden_does_not_move_the_far_plane() {
    let hiding = INTEGRATOR.replace("</", r#"<boolean name="hide_emitters" value="true"/></"#);
    let lamp = |z: f64| {
        format!(r#"<shape type="rectangle"><transform name="to_world"><translate z="{z}"/></transform>{LAMP}</shape>"#)
    };
    let wall = r#"<shape type="rectangle"><transform name="to_world"><scale value="9"/><translate z="-4"/></transform></shape>"#;
    // The wall is at a distance of 9.
    for (far, seen) in [(8.5, false), (9.5, true)] {
        let sensor = SENSOR.replace("<transform", &format!(r#"<float name="far_clip" value="{far}"/><transform"#));
        let plain = pixel(&image(&kit::scene_of(&[&hiding, &sensor, wall, SKY]), 4), 8, 6);
        for lamps in [lamp(2.0), lamp(2.0) + &lamp(-1.0)] {
            let hidden = pixel(&image(&kit::scene_of(&[&hiding, &sensor, &lamps, wall, SKY]), 4), 8, 6);
            assert_eq!((hidden != [0.0; 3], plain != [0.0; 3]), (seen, seen), "{far}");
        }
    }
}

#[test]
fn a_sensor_without_a_film_has_the_default_one() {
    let sensor = r#"<sensor type="perspective"><float name="fov" value="1"/></sensor>"#;
    let image = image(&kit::scene_of(&[r#"<integrator type="depth"/>"#, sensor]), 1);
    assert_eq!((image.crop.width, image.crop.height), (768, 576));
}

#[test]
fn lamps_shine_from_their_front_alone() {
    let middle = |turn: &str| pixel(&image(&kit::scene_of(&[INTEGRATOR, SENSOR, &square(LAMP, turn)]), 4), 8, 6);
    assert_eq!(middle(""), [3.0, 2.0, 1.0]);
    assert_eq!(middle(AROUND), [0.0; 3]);
    // Flipped normals change the side.
    let flipped = square(&format!(r#"<boolean name="flip_normals" value="true"/>{LAMP}"#), AROUND);
    assert_eq!(pixel(&image(&kit::scene_of(&[INTEGRATOR, SENSOR, &flipped]), 4), 8, 6), [3.0, 2.0, 1.0]);
}

#[test]
fn hidden_emitters_are_looked_through_but_still_shine() {
    let hiding = INTEGRATOR.replace("</", r#"<boolean name="hide_emitters" value="true"/></"#);
    let wall = |bsdf: &str| {
        format!(r#"<shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform>{bsdf}</shape>"#)
    };
    let scene = |integrator: &str, parts: &str| image(&kit::scene_of(&[integrator, SENSOR, SKY, parts]), 64);
    let (lamp, environment) = ([3.0, 2.0, 1.0], [0.5, 0.7, 1.0]);
    let both = format!("{}{}", square(LAMP, ""), wall(BLACK));
    let shown = scene(INTEGRATOR, &both);
    assert_eq!((pixel(&shown, 8, 6), pixel(&shown, 0, 0)), (lamp, environment));
    // A black wall is visible through the lamp, and a black environment.
    let black = scene(&hiding, &both);
    assert!(black.rgb(["R", "G", "B"]).unwrap().iter().all(|rgb| *rgb == [0.0; 3]));
    // A mirror reflects the back of the lamp, which is black, or its front if the lamp is turned around.
    for (turn, reflected) in [("", [0.0; 3]), (AROUND, lamp)] {
        let mirror = scene(&hiding, &format!("{}{}", square(LAMP, turn), wall(r#"<bsdf type="conductor"/>"#)));
        assert_eq!(pixel(&mirror, 8, 6), reflected);
    }
}

#[test]
fn defaults_are_the_documented_ones() {
    let text = run(&mut Folder::new().etendue("plugins")).out;
    let cases = [
        ("bsdf dielectric", "int_ior", "1.5046"),
        ("bsdf dielectric", "ext_ior", "1.000277"),
        ("bsdf diffuse", "reflectance", "0.5"),
        ("bsdf conductor", "material", "none"),
        ("bsdf roughconductor", "distribution", "beckmann"),
        ("bsdf roughconductor", "alpha", "0.1"),
        ("texture checkerboard", "color0", "0.4"),
        ("texture checkerboard", "color1", "0.2"),
        ("film hdrfilm", "width", "768"),
        ("film hdrfilm", "height", "576"),
        ("film hdrfilm", "rfilter", "[gaussian]"),
        ("rfilter gaussian", "stddev", "0.5"),
        ("sampler independent", "sample_count", "4"),
        ("integrator path", "max_depth", "-1"),
        ("integrator path", "rr_depth", "5"),
        ("integrator path", "hide_emitters", "false"),
        ("sensor perspective", "fov_axis", "x"),
        ("sensor perspective", "near_clip", "0.01"),
        ("sensor perspective", "far_clip", "10000"),
        ("sensor thinlens", "aperture_radius", "required"),
        ("sensor thinlens", "focus_distance", "[far_clip]"),
        ("shape obj", "flip_tex_coords", "true"),
        ("shape ply", "flip_tex_coords", "false"),
    ];
    for (plugin, param, value) in cases {
        let (_, page) = text.split_once(&format!("{plugin}\n")).unwrap_or_else(|| panic!("no {plugin}"));
        let row = page.lines().find(|line| line.split_whitespace().next() == Some(param)).unwrap();
        assert_eq!(row.split_whitespace().nth(2), Some(value), "{plugin}: {row}");
    }
}

#[test]
fn a_scene_of_version_0_6_equals_its_twin() {
    let meshes = kit::root().join("assets/meshes").display().to_string();
    let old =
        fs::read_to_string(kit::root().join("assets/scenes/version-0-6.xml")).unwrap().replace("../meshes", &meshes);
    let names = [
        ("0.6.0", "3.0.0"),
        ("maxDepth", "max_depth"),
        ("rrDepth", "rr_depth"),
        ("hideEmitters", "hide_emitters"),
        ("fovAxis", "fov_axis"),
        ("nearClip", "near_clip"),
        ("farClip", "far_clip"),
        ("toWorld", "to_world"),
        ("pixelFormat", "pixel_format"),
        ("componentFormat", "component_format"),
        ("sampleCount", "sample_count"),
        ("diffuseReflectance", "reflectance"),
        ("specularReflectance", "specular_reflectance"),
        ("intIOR", "int_ior"),
        ("extIOR", "ext_ior"),
        ("faceNormals", "face_normals"),
        ("flipNormals", "flip_normals"),
    ];
    let mut new = old.clone();
    for (from, to) in names {
        assert!(new.contains(from), "{from}");
        new = new.replace(&format!("\"{from}\""), &format!("\"{to}\""));
    }
    for line in ["uscale", "vscale", "uoffset"] {
        new = without_line(&new, line);
    }
    let to_uv = r#"<transform name="to_uv"><translate x="0.2" y="0.3"/><scale x="6" y="4"/></transform>"#;
    new = new.replace(r#"<float name="voffset" value="0.3"/>"#, to_uv);
    assert!(new.contains(to_uv));
    assert_eq!(bits_of(&old), bits_of(&new));
}

fn without_line(text: &str, word: &str) -> String {
    let word = format!("\"{word}\"");
    assert!(text.contains(&word), "{word}");
    text.lines().filter(|line| !line.contains(&word)).map(|line| format!("{line}\n")).collect()
}

#[test]
fn ways_to_write_the_same_scene() {
    let shape = |bsdf: &str| format!(r#"<shape type="sphere"><float name="radius" value="1.25"/>{bsdf}</shape>"#);
    let red = |attributes: &str| {
        format!(r#"<bsdf type="diffuse" {attributes}><rgb name="reflectance" value="0.6, 0.3, 0.2"/></bsdf>"#)
    };
    let plain = bits_of(&kit::scene(&shape(&red(""))));
    let ways = [
        ("named", shape(&red("name=\"material\""))),
        ("ref backward", red("id=\"a\"") + &shape("<ref id=\"a\"/>")),
        ("ref forward", shape("<ref id=\"a\"/>") + &red("id=\"a\"")),
        ("alias", red("id=\"a\"") + "<alias id=\"a\" as=\"b\"/>" + &shape("<ref id=\"b\"/>")),
        ("default", "<default name=\"r\" value=\"1.25\"/>".to_owned() + &shape(&red("")).replace("1.25", "$r")),
        (
            "first default",
            "<default name=\"r\" value=\"1.25\"/><default name=\"r\" value=\"9\"/>".to_owned()
                + &shape(&red("")).replace("1.25", "$r"),
        ),
        ("default inside", "<default name=\"g\" value=\"0.3\"/>".to_owned() + &shape(&red("")).replace("0.3", "$g")),
        ("include of a scene", "<include filename=\"scene-part.xml\"/>".into()),
        ("include of an object", "<include filename=\"object.xml\"/>".into()),
        ("include twice", "<include filename=\"outer.xml\"/>".into()),
        (
            "transform",
            shape(&red("")).replace(
                r#"<float name="radius" value="1.25"/>"#,
                r#"<transform name="to_world"><scale value="1.25"/></transform>"#,
            ),
        ),
    ];
    for (name, text) in ways {
        let folder = Folder::with_scene(&kit::scene(&text));
        folder.write("scene-part.xml", kit::scene_of(&[&shape(&red(""))]));
        folder.write("object.xml", shape(&red("")).replacen("<shape", "<shape version=\"3.0.0\"", 1));
        folder.write("outer.xml", kit::scene_of(&["<include filename=\"scene-part.xml\"/>"]));
        let image = image_in(&folder, 4);
        let found: Vec<_> = bits(&image).into_iter().map(|(name, values)| (name.to_owned(), values)).collect();
        assert!(found == plain, "{name}");
    }
}

/// A tetrahedron in one of PLY's three encodings.
fn tetrahedron(format: &str) -> Vec<u8> {
    let vertices: [[f32; 3]; 4] = [[0.1, 1.3, 0.0], [-1.0, -0.7, 0.9], [1.1, -0.6, 0.8], [0.0, -0.5, -1.2]];
    let faces: [[i32; 3]; 4] = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment a tetrahedron\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let little = format == "binary_little_endian";
    for vertex in vertices {
        match format {
            "ascii" => bytes.extend(format!("{} {} {}\n", vertex[0], vertex[1], vertex[2]).bytes()),
            _ => vertex.iter().for_each(|x| bytes.extend(if little { x.to_le_bytes() } else { x.to_be_bytes() })),
        }
    }
    for [a, b, c] in faces {
        if format == "ascii" {
            bytes.extend(format!("3 {a} {b} {c}\n").bytes());
            continue;
        }
        bytes.push(3);
        [a, b, c].iter().for_each(|i| bytes.extend(if little { i.to_le_bytes() } else { i.to_be_bytes() }));
    }
    bytes
}

#[test]
fn encodings_of_a_mesh_show_the_same() {
    let scene = kit::scene(r#"<shape type="ply"><string name="filename" value="mesh.ply"/></shape>"#);
    let images = ["ascii", "binary_little_endian", "binary_big_endian"].map(|format| {
        let folder = Folder::with_scene(&scene);
        folder.write("mesh.ply", tetrahedron(format));
        image_in(&folder, 4)
    });
    assert_eq!(bits(&images[0]), bits(&images[1]));
    assert_eq!(bits(&images[0]), bits(&images[2]));
    assert_ne!(bits(&images[0]), bits(&image(&kit::ball(), 4)));
}
