//! Bad input of `render`. It must give exit code 2 and one line for each fault: the place, what is wrong, and how to
//! correct it. There must be no panic and no leftover file, and it must take little time and memory.

use crate::kit::{self, Folder, INTEGRATOR, SENSOR, SKY, Said, run};

pub(crate) struct Case {
    scene: String,
    files: Vec<(&'static str, Vec<u8>)>,
    options: &'static str,
    /// A part of each line on stderr, after its place.
    faults: &'static [&'static str],
    /// Whether the faults have a place in a file.
    placed: bool,
}

/// A scene with faults in it.
pub(crate) fn scene(text: String, faults: &'static [&'static str]) -> Case {
    Case { scene: text, files: Vec::new(), options: "", faults, placed: true }
}

/// A scene with faulty shapes in it.
pub(crate) fn shapes(parts: &str, faults: &'static [&'static str]) -> Case {
    scene(kit::scene(parts), faults)
}

/// A good scene with faulty options.
fn options(options: &'static str, faults: &'static [&'static str]) -> Case {
    Case { options, placed: false, ..scene(kit::ball(), faults) }
}

impl Case {
    pub(crate) fn with(mut self, name: &'static str, bytes: impl Into<Vec<u8>>) -> Self {
        self.files.push((name, bytes.into()));
        self
    }
}

/// Renders with an address space of at most 512 MiB.
fn bounded(folder: &Folder, options: &str) -> Said {
    let mut command = kit::limited(folder, "ulimit -v 524288");
    command.args(["render", "scene.xml", "-o", "image.exr", "--png"]).args(options.split_whitespace());
    run(&mut command)
}

fn check(name: &str, case: &Case) {
    let folder = Folder::with_scene(&case.scene);
    for (name, bytes) in &case.files {
        folder.write(name, bytes);
    }
    let before = folder.files();
    let said = bounded(&folder, case.options);
    let lines: Vec<_> = said.err.lines().collect();
    let told = format!("{name}: code {:?}\n{}", said.code, said.err);
    assert_eq!(said.code, Some(2), "{told}");
    assert!(said.out.is_empty() && !said.err.contains("panicked"), "{told}");
    assert_eq!(lines.len(), case.faults.len(), "{told}");
    for (line, fault) in lines.iter().zip(case.faults) {
        assert!(line.contains(fault), "lacks {fault}: {told}");
        assert_eq!(has_place(line), case.placed, "{told}");
    }
    assert_eq!(folder.files(), before, "{told}");
}

pub(crate) fn check_all(cases: Vec<(&str, Case)>) {
    cases.iter().for_each(|(name, case)| check(name, case));
}

/// Whether a line begins with a file of the scene, a line and a column.
fn has_place(text: &str) -> bool {
    let mut parts = text.splitn(4, ':');
    let file = parts.next().is_some_and(|file| file.ends_with(".xml"));
    file && (0..2).all(|_| parts.next().is_some_and(|part| part.parse::<u32>().is_ok())) && parts.next().is_some()
}

#[test]
fn what_mitsuba_refuses_too() {
    let lamp = r#"<emitter type="area" id="l"/>"#;
    let crop = SENSOR.replace("<rfilter", r#"<integer name="crop_offset_x" value="3"/><rfilter"#);
    let both = r#"<integrator type="direct"><integer name="shading_samples" value="2"/><integer name="bsdf_samples" value="1"/></integrator>"#;
    let metal = r#"<shape type="sphere"><bsdf type="conductor"><string name="material" value="Au"/><rgb name="eta" value="1"/>
        <rgb name="k" value="1"/></bsdf></shape>"#;
    let layers = r#"<integrator type="aov"><string name="aovs" value="a:depth,b:uv,a:position"/></integrator>"#;
    check_all(vec![
        (
            "a shape used twice",
            shapes(
                &format!(r#"<shape type="sphere" id="s">{lamp}</shape><ref id="s"/>"#),
                &["this emitter is used more than once"],
            ),
        ),
        (
            "a crop beyond the film",
            scene(kit::scene_of(&[INTEGRATOR, &crop, SKY]), &["the crop of 16 from 3 is not within the film's 16"]),
        ),
        ("samples twice", scene(kit::scene_of(&[both, SENSOR, SKY]), &["\"shading_samples\" is given beside"])),
        ("a material and its index", shapes(metal, &["both a material and its index are given"])),
        ("a hint of another type", shapes(r#"<string name="kd_stop_prims" value="3"/>"#, &["kd_stop_prims"])),
        ("layers of one name", scene(kit::scene_of(&[layers, SENSOR]), &["another layer is also called \"a\""])),
    ]);
}

#[test]
fn text_that_is_no_scene() {
    let deep = |n: usize| format!("{}{}", "<shape type=\"sphere\">".repeat(n), "</shape>".repeat(n));
    check_all(vec![
        (
            "malformed",
            scene("<scene version=\"3.0.0\"><shape></scene>".into(), &["not XML: expected 'shape' tag, not 'scene'"]),
        ),
        ("empty", scene(String::new(), &["not XML: "])),
        (
            "unfinished",
            scene(kit::ball().replace("</scene>", ""), &["<scene> is never closed; close it with </scene>"]),
        ),
        ("no version", scene("<scene/>".into(), &["missing attribute \"version\" in <scene>; write <scene version="])),
        (
            "entity bomb",
            scene(
                format!("<!DOCTYPE s [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;\">]>{}", kit::ball()),
                &["a document type declaration is not read; remove it; scenes need none"],
            ),
        ),
        (
            "20,000 deep",
            shapes(
                &deep(20_000),
                &["elements are nested more than 100 deep; put an inner object outside and refer to it by <ref>"],
            ),
        ),
        ("element", shapes("<shap type=\"sphere\"/>", &["unknown element <shap>; did you mean <shape>?"])),
        ("attribute", shapes("<shape typ=\"sphere\" type=\"cube\"/>", &["unexpected attribute \"typ\" in <shape>"])),
        ("reference", shapes("<shape type=\"sphere\"><ref id=\"gone\"/></shape>", &["\"gone\""])),
        (
            "cycle",
            shapes("<include filename=\"a.xml\"/>", &["\"scene.xml\" includes itself; remove one of the includes"])
                .with("a.xml", "<scene version=\"3.0.0\"><include filename=\"scene.xml\"/></scene>"),
        ),
        (
            "include",
            shapes("<include filename=\"a.xml\"/>", &["included file \"a.xml\" not found; its name is relative"]),
        ),
    ]);
}

#[test]
fn scenes_that_lack_parts_or_have_too_many() {
    let sensor = |from: &str, to: &str| kit::ball().replace(from, to);
    check_all(vec![
        ("no sensor", scene(kit::scene_of(&[INTEGRATOR, SKY]), &["the scene has no sensor; give it a <sensor type="])),
        (
            "no integrator",
            scene(sensor(INTEGRATOR, ""), &["the scene has no integrator; give it one, or name one with --integrator"]),
        ),
        (
            "two integrators",
            scene(
                sensor(INTEGRATOR, &INTEGRATOR.repeat(2)),
                &["a scene can have only one integrator, this has 2; keep one of them"],
            ),
        ),
        (
            "second sensor",
            shapes("<sensor type=\"pinhole\"/>", &["no sensor is called \"pinhole\"; known: perspective, thinlens"]),
        ),
        (
            "two bsdfs",
            shapes(
                r#"<shape type="sphere"><bsdf type="diffuse"/><bsdf type="null"/></shape>"#,
                &["a shape \"sphere\" can have only one bsdf, this has 2"],
            ),
        ),
        ("two skies", shapes(SKY, &["the scene has a second environment emitter; give it only one"])),
        (
            "medium",
            shapes(
                r#"<shape type="sphere"><medium name="interior" type="homogeneous"/></shape>"#,
                &["a shape \"sphere\" takes no medium \"homogeneous\""],
            ),
        ),
        (
            "glass with two sides",
            shapes(
                r#"<shape type="sphere"><bsdf type="twosided"><bsdf type="dielectric"/></bsdf></shape>"#,
                &[
                    "this bsdf transmits light; only bsdfs that reflect can be two-sided, unless allow_transmission is true",
                ],
            ),
        ),
    ]);
}

const LOOKAT: &str = r#"<lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/>"#;

fn float(name: &str, value: &str) -> String {
    format!("<shape type=\"sphere\"><float name=\"{name}\" value=\"{value}\"/></shape>")
}

#[test]
fn plugins_that_are_unknown() {
    check_all(vec![
        ("plugin", shapes("<shape type=\"spere\"/>", &["no shape is called \"spere\"; did you mean \"sphere\"?"])),
        (
            "no plugin that is known",
            shapes(
                "<shape type=\"torus\"/>",
                &["no shape is called \"torus\"; known: sphere, ellipsoid, rectangle, cube"],
            ),
        ),
        (
            "a plugin of Mitsuba",
            shapes(
                r#"<shape type="sphere"><bsdf type="principled"/></shape>"#,
                &["no bsdf is called \"principled\" here; Mitsuba 3.9 has it, étendue does not yet"],
            ),
        ),
        (
            "a plugin of Mitsuba that is out of scope",
            shapes(
                r#"<shape type="sphere"><bsdf type="pplastic"/></shape>"#,
                &[
                    "no bsdf is called \"pplastic\" here; Mitsuba 3.9 has it; it is out of étendue's scope (polarisation)",
                ],
            ),
        ),
    ]);
}

#[test]
fn parameters_that_are_wrong() {
    check_all(vec![
        (
            "a word",
            scene(
                kit::ball().replace(
                    INTEGRATOR,
                    r#"<integrator type="sppm"><string name="kernel" value="cones"/></integrator>"#,
                ),
                &["\"kernel\" cannot be \"cones\"; did you mean \"cone\"?"],
            ),
        ),
        (
            "parameter",
            shapes(&float("radiu", "1"), &["a shape \"sphere\" has no parameter \"radiu\"; did you mean \"radius\"?"]),
        ),
        (
            "type",
            shapes(
                "<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>",
                &["\"radius\" is a string; must be a float"],
            ),
        ),
        ("range", shapes(&float("radius", "-1"), &["\"radius\" is -1; must be a number above 0"])),
        ("NaN", shapes(&float("radius", "nan"), &["could not parse floating point value \"nan\""])),
        ("infinite", shapes(&float("radius", "inf"), &["\"radius\" is inf; must be a number above 0"])),
    ]);
}

#[test]
fn values_out_of_range() {
    let radiance = |emitter: &str| kit::ball().replace(SKY, emitter);
    check_all(vec![
        (
            "reflectance",
            shapes(
                r#"<shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0.5, 2, 0.5"/></bsdf></shape>"#,
                &["\"reflectance\" is [0.5, 2, 0.5]; each channel must be a number from 0 to 1"],
            ),
        ),
        (
            "blinding",
            scene(
                radiance(r#"<emitter type="constant"><rgb name="radiance" value="1e300"/></emitter>"#),
                &["\"radiance\" is [1e300, 1e300, 1e300]; each channel must be a number from 0 to 1e30"],
            ),
        ),
        (
            "metal",
            shapes(
                r#"<shape type="sphere"><bsdf type="conductor"><rgb name="eta" value="1e200"/><rgb name="k" value="1"/></bsdf></shape>"#,
                &["\"eta\" is [1e200, 1e200, 1e200]; each channel must be a number from 0 to 1000000"],
            ),
        ),
        (
            "depth",
            scene(
                kit::ball().replace("value=\"4\"", "value=\"-2\""),
                &["\"max_depth\" is -2; must be a number from -1 to 4294967295"],
            ),
        ),
    ]);
}

#[test]
fn places_and_sizes_out_of_range() {
    let integer = |name: &str, value: &str| format!("<integer name=\"{name}\" value=\"{value}\"/>");
    let camera = |operation: &str| kit::ball().replace(LOOKAT, operation);
    let film = |width: &str, height: &str| {
        kit::ball()
            .replace(&integer("width", "16"), &integer("width", width))
            .replace(&integer("height", "12"), &integer("height", height))
    };
    check_all(vec![
        (
            "singular",
            shapes(
                r#"<shape type="cube"><transform name="to_world"><scale x="0"/></transform></shape>"#,
                &["the transform is singular; it must not flatten space"],
            ),
        ),
        (
            "far",
            shapes(
                r#"<shape type="cube"><transform name="to_world"><scale value="1e90"/></transform></shape>"#,
                &["the shape extends too far; no coordinate may exceed 1e15"],
            ),
        ),
        (
            "scaled sensor",
            scene(
                camera("<scale value=\"2\"/>"),
                &["the sensor's to_world scales or shears; a camera can only be rotated, moved and mirrored"],
            ),
        ),
        ("far sensor", scene(camera("<translate z=\"1e90\"/>"), &["the sensor is too far away"])),
        ("wide film", scene(film("2000000", "2000000"), &["\"width\" is 2000000; must be a number from 1 to 1000000"])),
        (
            "large film",
            scene(
                film("1000000", "1000000"),
                &["the film has 1000000 x 1000000 pixels; at most 100000000 pixels can be rendered at once"],
            ),
        ),
    ]);
}

#[test]
fn several_faults_at_once() {
    check_all(vec![
        (
            "a shared fault",
            shapes(
                r#"<bsdf type="diffuse" id="a"><float name="albedo" value="1"/></bsdf><shape type="sphere"><ref id="a"/></shape><shape type="cube"><ref id="a"/></shape>"#,
                &["a bsdf \"diffuse\" has no parameter \"albedo\"; known: reflectance"],
            ),
        ),
        (
            "three faults",
            shapes(
                &[float("r", "1"), float("radius", "0"), r#"<shape type="cube"><bsdf type="x"/></shape>"#.into()]
                    .concat(),
                &["\"r\"", "\"radius\"", "\"x\""],
            ),
        ),
    ]);
}

#[test]
fn files_that_are_missing_or_broken() {
    const PLY: &str = r#"<shape type="ply"><string name="filename" value="m.ply"/></shape>"#;
    const BITMAP: &str = r#"<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="t.png"/></texture></bsdf></shape>"#;
    let mesh = |vertices: &str, faces: &str, promised: u64| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {promised}\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n{vertices}{faces}"
        )
    };
    const TRIANGLE: &str = "0 0 0\n1 0 0\n0 1 0\n";
    let binary = mesh("", "", 4_000_000_000).replace("ascii", "binary_little_endian");
    check_all(vec![
        ("no mesh", shapes(PLY, &["m.ply: cannot be read: No such file"])),
        ("a folder", shapes(PLY, &["m.ply: is not a regular file"]).with("m.ply/file", "")),
        ("empty mesh", shapes(PLY, &["m.ply: "]).with("m.ply", "")),
        ("truncated mesh", shapes(PLY, &["m.ply: "]).with("m.ply", mesh("0 0 0\n1 0", "", 3))),
        (
            "index",
            shapes(PLY, &["face 0 (counted from 0) uses vertex 3 (counted from 0), the mesh has 3 vertices"])
                .with("m.ply", mesh(TRIANGLE, "3 0 1 3\n", 3)),
        ),
        (
            "NaN",
            shapes(PLY, &["vertex 1 (counted from 0) has the position [1.0, NaN, 0.0], which is not finite"])
                .with("m.ply", mesh("0 0 0\n1 nan 0\n0 1 0\n", "3 0 1 2\n", 3)),
        ),
        (
            "infinite",
            shapes(PLY, &["vertex 1 (counted from 0) has the position [1.0, inf, 0.0], which is not finite"])
                .with("m.ply", mesh("0 0 0\n1 inf 0\n0 1 0\n", "3 0 1 2\n", 3)),
        ),
        (
            "no area at all",
            shapes(PLY, &["the mesh has no triangle but 1 of zero area"])
                .with("m.ply", mesh("0 0 0\n1 0 0\n2 0 0\n", "3 0 1 2\n", 3)),
        ),
        (
            "4e9 vertices",
            shapes(PLY, &["the header declares 4000000000 vertices, the file has room for "])
                .with("m.ply", mesh(TRIANGLE, "3 0 1 2\n", 4_000_000_000)),
        ),
        (
            "4e9 binary vertices",
            shapes(PLY, &["the header declares 4000000000 vertices, the file has room for 0 at most"])
                .with("m.ply", binary),
        ),
        ("no texture", shapes(BITMAP, &["t.png: No such file"])),
        ("garbage texture", shapes(BITMAP, &["t.png: "]).with("t.png", "garbage")),
        (
            "half a texture",
            shapes(BITMAP, &["t.png: "])
                .with("t.png", &std::fs::read(kit::root().join("assets/textures/weave.png")).unwrap()[..2000]),
        ),
    ]);
}

#[test]
fn options_that_are_wrong() {
    check_all(vec![
        ("unused", options("-D a=1", &["unused parameter: $a=1; the scene mentions $a nowhere"])),
        ("twice", options("-D a=1 -D a=2", &["parameter $a is defined twice; give it one value"])),
        (
            "integrator",
            options("--integrator pat", &["--integrator pat: no integrator is called \"pat\"; did you mean \"path\"?"]),
        ),
        (
            "parameter of an integrator",
            options(
                "--integrator sppm --param phton_count=1",
                &[
                    "--param phton_count=1: an integrator \"sppm\" has no parameter \"phton_count\"; did you mean \"photon_count\"?",
                ],
            ),
        ),
        (
            "wrapper",
            options(
                "--integrator moment",
                &["--integrator moment: an integrator \"moment\" needs another integrator inside"],
            ),
        ),
        (
            "parameter",
            options(
                "--param max_dept=3",
                &[
                    "--param max_dept=3: an integrator \"path\" has no parameter \"max_dept\"; did you mean \"max_depth\"?",
                ],
            ),
        ),
        (
            "type",
            options(
                "--param max_depth=deep",
                &["--param max_depth=deep: \"max_depth\" is a string; must be an integer"],
            ),
        ),
        (
            "range",
            options("--param max_depth=-2", &["--param max_depth=-2: \"max_depth\" is -2; must be a number from -1"]),
        ),
        (
            "NaN",
            options("--param max_depth=nan", &["--param max_depth=nan: \"max_depth\" is a float; must be an integer"]),
        ),
        ("pixel", options("--replay 16,0,0", &["pixel 16,0 is outside of the 16 x 12 film"])),
        ("sample", options("--replay 0,0,4", &["sample 4 is outside of the 4 samples of a pixel"])),
    ]);
}

#[test]
fn arguments_that_are_wrong() {
    let folder = Folder::with_scene(&kit::ball());
    folder.write("folder/file", "");
    folder.write("image.png/file", "");
    let before = folder.files();
    // Errors that are not about a scene have no place. clap adds a line with help.
    let cases = [
        ("scene.xml", "error: the following required arguments were not provided"),
        ("scene.xml -o a.exr --spp 0", "error: invalid value '0' for '--spp <N>'"),
        ("scene.xml -o a.exr --threads 0", "error: invalid value '0' for '--threads <N>'"),
        ("scene.xml -o a.exr --seed -1", "error: invalid value '-1' for '--seed <N>': write a whole number from 0"),
        ("scene.xml -o a.exr -D size", "error: invalid value 'size' for '-D <NAME=VALUE>': write it as name=value"),
        (
            "scene.xml -o a.exr --param size",
            "error: invalid value 'size' for '--param <NAME=VALUE>': write it as name=value",
        ),
        (
            "scene.xml -o a.exr --replay 1,2",
            "error: invalid value '1,2' for '--replay <X,Y,SAMPLE>': write three whole numbers",
        ),
        ("scene.xml -o a.exr --exposure 1", "error: the following required arguments were not provided"),
        ("missing.xml -o a.exr", "missing.xml: cannot read: No such file"),
        ("folder -o a.exr", "folder: cannot read: it is not a file"),
        ("scene.xml -o none/a.exr", "none/a.exr: cannot be written: No such file"),
        ("scene.xml -o scene.xml/a.exr", "scene.xml/a.exr: cannot be written: Not a directory"),
        ("scene.xml -o folder", "folder: images are OpenEXR files"),
        ("scene.xml -o a.png --png", "a.png: images are OpenEXR files; give it a name that ends in .exr"),
        ("scene.xml -o a.jpg", "a.jpg: images are OpenEXR files"),
        (
            "scene.xml -o a.exr --png --exposure nan",
            "error: invalid value 'nan' for '--exposure <STOPS>': write a number",
        ),
        ("scene.xml -o image.exr --png", "image.png: is a folder"),
    ];
    for (arguments, message) in cases {
        let said = run(&mut folder.etendue(&format!("render {arguments}")));
        assert_eq!(said.code, Some(2), "{arguments}: {}", said.err);
        assert!(said.err.starts_with(message), "{arguments}: {}", said.err);
        assert!(message.starts_with("error: ") || said.err.lines().count() == 1, "{arguments}: {}", said.err);
        assert_eq!(folder.files(), before, "{arguments}");
    }
}

#[test]
fn places_point_at_the_fault() {
    let text = "<scene version=\"3.0.0\">\n  <shape type=\"spere\"/>\n  <shape type=\"cube\"><float\n    name=\"side\" value=\"2\"/></shape>\n</scene>";
    let folder = Folder::new();
    folder.write("a/b.xml", text);
    let said = run(&mut folder.etendue("render a/../a/b.xml -o image.exr"));
    let places: Vec<_> = said.err.lines().map(|line| line.split(": ").next().unwrap()).collect();
    assert_eq!(
        places,
        ["a/../a/b.xml:1:1", "a/../a/b.xml:1:1", "a/../a/b.xml:2:3", "a/../a/b.xml:3:22"],
        "{}",
        said.err
    );
}

#[test]
fn faults_come_in_the_order_of_their_lines() {
    let folder = Folder::new();
    let part = "<scene version=\"3.0.0\">\n<shape type=\"cub\"/>\n<emitter type=\"pint\"/>\n</scene>";
    folder.write("part.xml", part);
    let sensor = SENSOR.replace("\n", "").replace("\"width\"", "\"widht\"");
    let parts = [
        "<emitter type=\"sunny\"/>",
        "<include filename=\"part.xml\"/>",
        "<shape type=\"cube\"><bsdf type=\"difuse\"/></shape>",
        "<shape type=\"spere\"/>",
        &sensor,
        "<integrator type=\"pth\"/>",
        "<sensor type=\"batsh\"/>",
    ];
    folder.write("scene.xml", kit::scene_of(&parts));
    let places = || {
        let said = run(&mut folder.etendue("render scene.xml -o image.exr"));
        let place = |line: &str| line.split(':').take(2).collect::<Vec<_>>().join(":");
        said.err.lines().map(place).collect::<Vec<_>>()
    };
    let own = [2, 4, 5, 6, 7, 8].map(|line| format!("scene.xml:{line}"));
    let included = [2, 3].map(|line| format!("part.xml:{line}"));
    let included = included.map(|place| places().into_iter().find(|found| found.ends_with(&place)).unwrap());
    assert_eq!(places(), [&own[..], &included[..]].concat());
    // Faults that the reader of the file finds, references among them.
    let parts = ["<ref id=\"a\"/>", "<float name=\"f\" value=\"x\"/>", "<ref id=\"b\"/>", "<bsdf/>"];
    folder.write("scene.xml", kit::scene_of(&parts));
    let lines = places();
    assert!(lines.len() > 1 && lines.is_sorted(), "{lines:?}");
}

#[test]
fn triangles_without_area_are_counted_in_one_warning() {
    let folder =
        Folder::with_scene(&kit::scene(r#"<shape type="obj"><string name="filename" value="m.obj"/></shape>"#));
    folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 2\nf 1 2 4\nf 1 1 1\n");
    let said = run(&mut folder.etendue("render scene.xml -o image.exr"));
    assert_eq!(said.code, Some(0));
    assert!(said.err.starts_with("warning: scene.xml:"), "{}", said.err);
    assert!(
        said.err.ends_with("triangles without area are ignored: 3\n") && said.err.lines().count() == 1,
        "{}",
        said.err
    );
}
