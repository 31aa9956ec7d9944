//! The command line: its input, its output, and its exit codes.

use std::{collections::BTreeMap, fs, path::Path, time::Instant};

use ::exr::prelude::{MetaData, SampleType};
use etendue::{
    catalogue,
    film::{Image, VARIANCE, exr},
    provenance,
    scene_file::DefaultValue,
};

use crate::kit::{self, Folder, bits, run};

#[test]
fn help_names_the_exit_codes_and_every_option() {
    let options: [(&str, &[&str]); 7] = [
        ("", &["render", "merge", "photons", "compare", "verify", "plugins", "--version"]),
        (
            "render",
            &[
                "-D",
                "--integrator",
                "--param",
                "--spp",
                "--seed",
                "--threads",
                "--output",
                "--png",
                "--exposure",
                "--replay",
                "--sampler",
                "--passes",
                "--checkpoint",
                "--resume",
                "--checkpoint-every",
                "--time-limit",
                "--target-error",
                "--shard",
                "--quiet",
                "--tonemap",
            ],
        ),
        ("merge", &["--output", "--checkpoint", "--partial", "--png", "--layer", "--exposure"]),
        ("photons", &["-D", "--param", "--seed", "--threads", "--ply", "--npy", "numpy.load"]),
        ("compare", &["--json", "--pictures"]),
        ("verify", &["--only", "--standard", "--full", "--verbose", "--times", "--threads", "--root"]),
        ("plugins", &["[NAME]", "--mitsuba"]),
    ];
    for (command, options) in options {
        let said = run(&mut Folder::new().etendue(&format!("{command} --help")));
        assert_eq!(said.code, Some(0));
        for word in options.iter().copied().chain([
            "Exit codes:",
            "0  success",
            "1  a check failed",
            "2  bad input",
            "130  interrupted",
        ]) {
            assert!(said.out.contains(word), "{command} --help does not mention {word}:\n{}", said.out);
        }
    }
}

#[test]
fn completions_and_the_man_page_are_printed() {
    let folder = Folder::new();
    let printed = |words: &str| {
        let said = run(&mut folder.etendue(words));
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{words}");
        said.out
    };
    assert!(printed("completions bash").contains("--checkpoint-every"));
    assert!(printed("completions zsh").starts_with("#compdef etendue"));
    assert!(printed("man").contains(".TH etendue 1"));
}

#[test]
fn images_say_how_they_were_made() {
    let folder = Folder::with_scene(&kit::ball());
    let start = Instant::now();
    let image = folder.render("--spp 3 --seed 18446744073709551615 --param max_depth=3");
    let passed = start.elapsed().as_secs_f64();
    let meta = MetaData::read_from_file(folder.path("image.exr"), true).unwrap();
    let types: Vec<_> = meta.headers[0].channels.list.iter().map(|c| (c.name.to_string(), c.sample_type)).collect();
    let expected = ["B", "G", "R", VARIANCE[2], VARIANCE[1], VARIANCE[0]];
    assert_eq!(types, expected.map(|name| (name.to_owned(), SampleType::F32)), "files are sorted by name");
    assert_eq!(image.channels.iter().map(|(name, _)| name.as_str()).take(3).collect::<Vec<_>>(), ["R", "G", "B"]);

    let document = etendue::scene_file::xml::read(&folder.path("scene.xml"), &[]).unwrap();
    let header = [
        ("version", provenance::version()),
        ("scene", "scene.xml".into()),
        ("scene_sha256", provenance::scene_hash(&document).unwrap()),
        ("integrator", "path".into()),
        ("sampler", "independent".into()),
        ("parameters", "max_depth=3".into()),
        ("spp", "3".into()),
        ("seed", u64::MAX.to_string()),
    ];
    for (name, value) in header {
        assert_eq!(image.attribute(&format!("etendue.{name}")), Some(value.as_str()), "{name}");
    }
    assert_eq!(image.attribute("etendue.not_physical"), None);
    let marked = folder.render("--spp 3 --param transparent_shadows=true");
    assert_eq!(marked.attribute("etendue.not_physical"), Some("transparent_shadows"));
    assert!(provenance::version().starts_with(env!("CARGO_PKG_VERSION")));
    let seconds: f64 = image.attribute("etendue.seconds").unwrap().parse().unwrap();
    assert!((0.0..=passed + 0.001).contains(&seconds), "{seconds} of {passed}");
}

#[test]
fn old_names_of_options_are_known() {
    let folder = Folder::with_scene(&kit::ball());
    let image = folder.render("--passes 2 --time 1000h --checkpoint a.ck --every 0s");
    assert_eq!(image.attribute("etendue.spp"), Some("2"));
    let help = run(&mut folder.etendue("render --help")).out;
    assert!(!help.contains("--every") && !help.contains("--time "), "{help}");
}

#[test]
fn whole_numbers_may_have_an_exponent() {
    let folder = Folder::with_scene(&kit::ball().replace(
        r#"<integer name="width" value="16"/>"#,
        r#"<default name="size" value="16"/><integer name="width" value="$size"/>"#,
    ));
    let image = folder.render("--spp 1e1 --seed 2.5e3 --threads 1e0 --param max_depth=1e1 -D size=2e1");
    let number = |name: &str| image.attribute(&format!("etendue.{name}")).unwrap().to_owned();
    assert_eq!((number("spp"), number("seed"), image.crop.width), ("10".into(), "2500".into(), 20));
    let plain = folder.render("--spp 10 --seed 2500 --param max_depth=10 -D size=20");
    assert!(bits(&image) == bits(&plain));
    for (option, fault) in [
        ("--spp 1e-1", "error: invalid value '1e-1' for '--spp <N>': write a whole number from 1 to 4294967295"),
        ("--param max_depth=1.5", "--param max_depth=1.5: \"max_depth\" is a float; must be an integer"),
        ("-D size=1.5e0", "could not parse integer value \"1.5e0\""),
    ] {
        let said = run(&mut folder.etendue(&format!("render scene.xml -o image.exr {option}")));
        assert!(said.code == Some(2) && said.err.contains(fault), "{option}: {}", said.err);
    }
}

#[test]
fn names_may_have_any_letters() {
    let folder = Folder::new();
    folder.write("Bücher/場面.xml", kit::ball());
    folder.etendue("render Bücher/場面.xml -o Bücher/絵.exr --spp 1 --png").assert().success();
    let image = exr::read(&folder.path("Bücher/絵.exr")).unwrap();
    assert_eq!(image.attribute("etendue.scene"), Some("Bücher/場面.xml"));
    assert!(folder.path("Bücher/絵.png").exists());
}

#[test]
fn definitions_reach_the_scene() {
    let shape = r#"<default name="r" value="1"/><shape type="sphere"><float name="radius" value="$r"/></shape>"#;
    let folder = Folder::with_scene(&kit::scene(shape));
    let default = folder.render("-D r=1");
    assert_eq!(bits(&default), bits(&folder.render("")));
    assert_ne!(bits(&default), bits(&folder.render("-D r=0.5")));
}

/// The image of a folder's scene with another integrator in the file.
fn written(integrator: &str) -> Image {
    let text = kit::scene(FURNISHED).replace(kit::INTEGRATOR, integrator);
    Folder::with_scene(&text).render("--spp 4")
}

const FURNISHED: &str = r#"<shape type="sphere"/><shape type="rectangle">
    <transform name="to_world"><scale value="3"/><translate z="-1"/></transform></shape>"#;

#[test]
fn options_change_the_integrator() {
    let deep = r#"<integrator type="path"><integer name="max_depth" value="3"/><integer name="rr_depth" value="1"/></integrator>"#;
    let wrapped = format!(r#"<integrator type="moment">{deep}</integrator>"#);
    let cases = [
        // The integrator in the scene, the options, and an equivalent integrator.
        (deep, "--param max_depth=2", deep.replace('3', "2")),
        (deep, "--param hide_emitters=true", deep.replace("</", r#"<boolean name="hide_emitters" value="true"/></"#)),
        (deep, "--integrator depth", r#"<integrator type="depth"/>"#.into()),
        (deep, "--integrator direct --param hide_emitters=true", DIRECT.into()),
        (r#"<integrator type="depth"/>"#, "--integrator path --param max_depth=3 --param rr_depth=1", deep.into()),
        (&wrapped, "--integrator path", deep.into()),
        (DIRECT, "--integrator path", DIRECT.replace("direct", "path")),
        ("", "--integrator path --param max_depth=3 --param rr_depth=1", deep.into()),
    ];
    for (own, options, instead) in cases {
        let folder = Folder::with_scene(&kit::scene(FURNISHED).replace(kit::INTEGRATOR, own));
        let image = folder.render(&format!("--spp 4 {options}"));
        assert_eq!(bits(&image), bits(&written(&instead)), "{own} {options}");
    }
    assert_ne!(bits(&written(deep)), bits(&written(&deep.replace('3', "2"))), "the cases above can fail");
}

const DIRECT: &str = r#"<integrator type="direct"><boolean name="hide_emitters" value="true"/></integrator>"#;

#[test]
fn another_integrator_keeps_both_depths() {
    let scene = r#"<integrator type="path"><integer name="max_depth" value="3"/><integer name="rr_depth" value="1"/></integrator>"#;
    let folder = Folder::with_scene(&kit::scene(FURNISHED).replace(kit::INTEGRATOR, scene));
    let image = folder.render("--spp 4 --integrator path");
    assert_eq!(image.attribute("etendue.integrator"), Some("path"));
    assert_eq!(bits(&image), bits(&written(scene)));
    for (name, value) in [("max_depth", "4"), ("rr_depth", "2")] {
        let other = folder.render(&format!("--spp 4 --param {name}={value}"));
        assert_ne!(bits(&image), bits(&other), "{name} matters in this scene");
    }
}

#[test]
fn pictures_lie_beside_the_image() {
    let folder = Folder::with_scene(&kit::ball());
    let grey = |options: &str| {
        folder.render(&format!("--png {options}"));
        let ((width, height), bytes) = kit::read_png(&folder.path("image.png"));
        assert_eq!((width, height, bytes.len()), (16, 12, 3 * 16 * 12));
        bytes.chunks(3).map(|pixel| u64::from(pixel[1])).sum::<u64>()
    };
    let (automatic, darker, brighter) = (grey(""), grey("--exposure -3"), grey("--exposure 0.5"));
    assert!(darker < automatic && darker < brighter);
    // Green of the environment, times 2^-1: sRGB(0.35) = 160.
    folder.render("--png --exposure -1");
    assert_eq!(kit::read_png(&folder.path("image.png")).1[1], 160);
}

#[test]
fn a_picture_says_its_exposure_and_its_curve() {
    let folder = Folder::with_scene(&kit::ball());
    let said = run(&mut folder.etendue("render scene.xml -o image.exr --png"));
    let (_, told) =
        said.out.trim_end().split_once("; image.png at exposure ").unwrap_or_else(|| panic!("{}", said.out));
    let image = exr::read(&folder.path("image.exr")).unwrap();
    let exposure: f64 = image.attribute("etendue.exposure").unwrap().parse().unwrap();
    assert_eq!(format!("{exposure:.3}"), told);
    assert_eq!(image.attribute("etendue.tonemap"), Some("clip"));
    let texts = |name: &str| {
        let file = std::io::BufReader::new(fs::File::open(folder.path(name)).unwrap());
        let reader = png::Decoder::new(file).read_info().unwrap();
        let texts = &reader.info().utf8_text;
        texts.iter().map(|text| (text.keyword.clone(), text.get_text().unwrap())).collect::<BTreeMap<_, _>>()
    };
    let attributes: BTreeMap<_, _> = image.attributes.iter().cloned().collect();
    assert_eq!(texts("image.png"), attributes, "the picture says what the image says");
    // The automatic exposure, given explicitly, gives the same picture.
    let pixels = || kit::read_png(&folder.path("image.png")).1;
    let chosen = pixels();
    folder.render(&format!("--png --exposure {exposure}"));
    assert_eq!(pixels(), chosen);
    // Green of the environment, times 2^-1, on the curve: 0.35 becomes 0.4936, sRGB(0.4936) = 186.
    let filmic = folder.render("--png --exposure -1 --tonemap filmic");
    assert_eq!((pixels()[1], filmic.attribute("etendue.tonemap")), (186, Some("filmic")));
    folder.etendue("render scene.xml --checkpoint a.ck").assert().success();
    let merged = run(&mut folder.etendue("merge a.ck -o merged.exr --png --exposure 2"));
    assert_eq!((merged.code, merged.out.as_str()), (Some(0), "merged.png at exposure 2.000\n"));
}

#[test]
fn a_render_ends_with_one_line() {
    let folder = Folder::with_scene(&noisy());
    let said = run(&mut folder.etendue("render scene.xml -o image.exr --spp 64 --checkpoint a.ck"));
    let (spp, error) = said.out.split_once(" s, error ").unwrap_or_else(|| panic!("{}", said.out));
    assert!(spp.starts_with("image.exr: 64 spp in ") && error.ends_with(" %\n"), "{}", said.out);
    assert_eq!((said.out.lines().count(), said.err.as_str()), (1, ""));
    let said = run(&mut folder.etendue("render scene.xml --resume a.ck"));
    assert!(said.out.starts_with("a.ck: 64 spp in "), "{}", said.out);
    // One sample has no scatter, and the scatter of samples that share photons does not show the error.
    for options in ["--spp 1", "--spp 8 --integrator photonmapper --param global_photons=100"] {
        let said = run(&mut folder.etendue(&format!("render scene.xml -o image.exr {options}")));
        assert!(said.out.ends_with(" s\n"), "{}", said.out);
    }
}

#[test]
fn a_quiet_render_only_warns() {
    let folder = Folder::with_scene(&kit::scene_of(&[kit::INTEGRATOR, kit::SENSOR, r#"<shape type="sphere"/>"#]));
    let said = run(&mut folder.etendue("render scene.xml -o image.exr -q --time-limit 0s"));
    let warning = "warning: the scene has no light: the image will be black\n";
    assert_eq!((said.code, said.out.as_str(), said.err.as_str()), (Some(0), "", warning));
}

#[test]
fn wrapping_integrators_add_layers() {
    let aov = r#"<integrator type="aov"><string name="aovs" value="d:depth, n:sh_normal, c:sample_count"/>
        <integrator type="moment"><integrator type="path"/></integrator></integrator>"#;
    let folder = Folder::with_scene(&kit::ball().replace(kit::INTEGRATOR, aov));
    let image = folder.render("--spp 8");
    let names: Vec<_> = image.channels.iter().map(|(name, _)| name.as_str()).collect();
    for name in ["R", "G", "B", "d.T", "n.X", "n.Y", "n.Z", "c.N", "m2.R", "m2.G", "m2.B", VARIANCE[0]] {
        assert!(names.contains(&name), "{name} is not among {names:?}");
    }
    assert!(image.channel("c.N").unwrap().iter().all(|&n| n == 8.0));
    // The camera is 5 from the centre of the unit ball, and depth starts at the near plane.
    let middle = 6 * 16 + 8;
    assert!((image.channel("d.T").unwrap()[middle] - 3.99).abs() < 0.05);
    assert!(image.channel("n.Z").unwrap()[middle] > 0.95);
    // E[x²] = E[x]² + (n - 1) Var[mean].
    for (m2, (mean, variance)) in [("m2.R", ("R", VARIANCE[0])), ("m2.B", ("B", VARIANCE[2]))] {
        let plane = |name| f64::from(image.channel(name).unwrap()[middle]);
        let expected = plane(mean).powi(2) + 7.0 * plane(variance);
        assert!((plane(m2) - expected).abs() < 1e-6, "{m2}: {} {expected}", plane(m2));
    }
}

#[test]
fn plugins_lists_everything() {
    let text = run(&mut Folder::new().etendue("plugins")).out;
    for plugin in catalogue::plugins() {
        let head = format!("{} {}\n    {}\n", plugin.category, plugin.name, plugin.summary);
        let (_, after) = text.split_once(&head).unwrap_or_else(|| panic!("{head} is missing"));
        let page = after.split("\n\n").next().unwrap();
        for param in plugin.params {
            let row = page.lines().find(|line| line.trim_start().starts_with(&format!("{} ", param.name)));
            let row = row.unwrap_or_else(|| panic!("{head} lacks {}", param.name));
            let default = match param.default {
                DefaultValue::Required => "required",
                DefaultValue::Absent(text) | DefaultValue::Value(text) => text,
            };
            assert!(row.contains(default) && row.contains(param.description), "{row}");
        }
    }
}

#[test]
fn plugins_can_be_filtered() {
    let heads = |filter| {
        let said = run(&mut Folder::new().etendue(&format!("plugins {filter}")));
        let heads = said.out.lines().filter(|line| !line.starts_with(' ') && !line.is_empty());
        (said.code, heads.map(str::to_owned).collect::<Vec<_>>())
    };
    assert_eq!(heads("ldsamp"), (Some(0), vec!["sampler ldsampler".into()]));
    assert_eq!(heads("sensor"), (Some(0), vec!["sensor perspective".into(), "sensor thinlens".into()]));
    assert_eq!(heads("nothing"), (Some(2), vec![]));
}

#[test]
fn a_plugin_has_a_manual_page() {
    let page = run(&mut Folder::new().etendue("plugins roughconductor"));
    assert_eq!(page.code, Some(0));
    let sections = ["bsdf roughconductor\n", "\nParameters\n", "\nExample\n  <bsdf type=", "\nEvidence\n"];
    let mut rest = page.out.as_str();
    for section in sections {
        (_, rest) = rest.split_once(section).unwrap_or_else(|| panic!("{section} is missing in {}", page.out));
    }
    for part in ["Walter", "alpha (float, a number", "default 0.1)"] {
        assert!(page.out.contains(part), "{part}: {}", page.out);
    }
    let cases = [
        ("dielctric", "no plugin is called \"dielctric\"; did you mean \"dielectric\"?\n"),
        ("principled", "no bsdf is called \"principled\" here; Mitsuba 3.9 has it, étendue does not yet\n"),
        (
            "volpath",
            "no integrator is called \"volpath\" here; Mitsuba 3.9 has it; it is out of étendue's scope (media)\n",
        ),
        ("xyzzy", "no plugin is called \"xyzzy\"; etendue plugins lists all\n"),
    ];
    for (name, message) in cases {
        let said = run(&mut Folder::new().etendue(&format!("plugins {name}")));
        assert_eq!((said.code, said.err.as_str(), said.out.as_str()), (Some(2), message, ""));
    }
}

#[test]
fn the_table_of_mitsubas_plugins_is_current() {
    let said = run(&mut Folder::new().etendue("plugins --mitsuba"));
    let page = fs::read_to_string(kit::root().join("docs/mitsuba-plugins.md")).unwrap();
    let (_, table) = page.split_once("<!-- etendue plugins --mitsuba -->\n").expect("the table begins");
    let (table, _) = table.split_once("<!-- end -->").expect("the table ends");
    assert!(table == said.out, "docs/mitsuba-plugins.md is not what `etendue plugins --mitsuba` prints:\n{}", said.out);
}

#[test]
fn a_reader_may_leave_early() {
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("etendue"));
    let mut child = command.arg("plugins").stdout(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

/// A surface under two lamps covers the film. Each sample samples one lamp, so every pixel has noise.
fn noisy() -> String {
    kit::scene_of(&[
        r#"<integrator type="direct"/>"#,
        kit::SENSOR,
        r#"<shape type="rectangle"><transform name="to_world"><scale value="9"/></transform></shape>"#,
        r#"<shape type="sphere"><point name="center" x="0" y="0" z="9"/><emitter type="area"/></shape>"#,
        r#"<emitter type="point"><point name="position" x="2" y="3" z="8"/></emitter>"#,
    ])
}

/// Writes `image.exr` under another name, with changed values.
fn changed(folder: &Folder, name: &str, change: impl Fn(&str, f32) -> f32) {
    let mut image = exr::read(&folder.path("image.exr")).unwrap();
    for (channel, values) in &mut image.channels {
        values.iter_mut().for_each(|value| *value = change(channel, *value));
    }
    exr::write(&folder.path(name), &image).unwrap();
}

#[test]
fn compare_agrees_differs_and_asks_for_samples() {
    let folder = Folder::with_scene(&noisy());
    folder.render("--spp 8192 --seed 1");
    changed(&folder, "reference.exr", |_, x| x);
    folder.render("--spp 8192 --seed 2");
    changed(&folder, "brighter.exr", |name, x| if VARIANCE.contains(&name) { x * 1.005 * 1.005 } else { x * 1.005 });
    changed(&folder, "mute.exr", |name, x| if VARIANCE.contains(&name) { f32::INFINITY } else { x });
    folder.etendue("render scene.xml -o short.exr --spp 2").assert().success();
    let cases = [
        ("image.exr", 0, "agrees"),
        ("brighter.exr", 1, "differs"),
        ("short.exr", 1, "undecided (not enough samples: needs about "),
        (
            "mute.exr",
            1,
            "undecided: no variances (render two samples per pixel or more; layers variance.R, .G, .B): mute.exr",
        ),
        ("reference.exr", 0, "identical, pixel by pixel"),
    ];
    for (test, code, conclusion) in cases {
        let said = run(&mut folder.etendue(&format!("compare {test} reference.exr")));
        assert_eq!(said.code, Some(code), "{test}: {}{}", said.out, said.err);
        assert!(said.out.lines().any(|line| line.starts_with(conclusion)), "{test}: {}", said.out);
    }
}

#[test]
fn compare_refuses_variances_that_cannot_be() {
    let folder = Folder::with_scene(&noisy());
    folder.render("--spp 4");
    for (value, number) in [("negative", -1.0), ("nan", f32::NAN)] {
        changed(&folder, "bad.exr", |name, x| if name == "variance.G" { number } else { x });
        let said = run(&mut folder.etendue("compare bad.exr image.exr"));
        let message = "bad.exr: the variance of the pixel in column 0, row 0 is negative or not finite\n";
        assert_eq!((said.code, said.err.as_str()), (Some(2), message), "{value}");
    }
}

#[test]
fn the_samples_that_compare_asks_for_are_enough() {
    let folder = Folder::with_scene(&noisy());
    folder.render("--spp 16384 --seed 1");
    changed(&folder, "reference.exr", |_, x| x);
    let judge = |spp: u32| {
        folder.render(&format!("--spp {spp} --seed 2"));
        run(&mut folder.etendue("compare image.exr reference.exr")).out
    };
    let (_, needed) = judge(4).split_once("needs about ").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    let needed: u32 = needed.split_whitespace().next().unwrap().parse().unwrap();
    assert!((8..16384).contains(&needed), "{needed}");
    // The needed number is estimated from few samples; one and a half times as many are certainly enough.
    assert!(judge(needed * 3 / 2).ends_with("agrees\n"));
}

#[test]
fn compare_names_the_command_that_decides() {
    let folder = Folder::with_scene(&noisy());
    folder.render("--spp 16384 --seed 3");
    changed(&folder, "reference.exr", |_, x| x);
    // The same seed as the reference, so the two are not independent.
    folder.render("--spp 4 --seed 3 --param shading_samples=1");
    let said = run(&mut folder.etendue("compare image.exr reference.exr"));
    let last = said.out.lines().last().unwrap();
    let next = last.strip_prefix("next: etendue ").unwrap_or_else(|| panic!("{}", said.out));
    assert!(next.contains("--param shading_samples=1 --spp ") && next.ends_with(" --seed 4"), "{next}");
    folder.etendue(next).assert().success();
    let said = run(&mut folder.etendue("compare image.exr reference.exr"));
    assert!(said.out.lines().any(|line| line == "agrees"), "{}", said.out);
    assert!(!said.out.contains("next: "), "{}", said.out);
}

#[test]
fn compare_prints_means_and_bias_of_one_quantity() {
    let folder = Folder::with_scene(&noisy());
    folder.render("--spp 64");
    changed(&folder, "reference.exr", |_, x| x);
    let same = run(&mut folder.etendue("compare image.exr reference.exr")).out;
    assert!(same.contains(", bias 0 (0 %)\n") && same.contains("RMSE 0, relative MSE 0\n"), "{same}");
    changed(&folder, "reference.exr", |name, x| if name == "R" { 0.5 * x } else { x });
    let other = run(&mut folder.etendue("compare image.exr reference.exr")).out;
    let number = |before: &str| -> f64 {
        let (_, after) = other.split_once(before).unwrap_or_else(|| panic!("{before}: {other}"));
        after.split([',', ' ']).next().unwrap().parse().unwrap()
    };
    let (test, reference, bias) = (number("test "), number("reference "), number("bias "));
    // Each number is rounded for printing.
    assert!(bias > 0.0 && (test - reference - bias).abs() < 1.1e-6 + 5e-4 * bias, "{other}");
    for text in [same, other] {
        assert!(!text.contains("0.000e0") && !text.contains("0.0000e0"), "{text}");
    }
}

#[test]
fn compare_writes_json_and_pictures() {
    let folder = Folder::with_scene(&noisy());
    folder.render("--spp 64");
    let said = run(&mut folder.etendue("compare image.exr image.exr --json --pictures a/b"));
    let json: serde_json::Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(json["metrics"]["rmse"], 0.0);
    assert_eq!(json["spp"], 64);
    for name in ["test", "reference", "difference", "p-values"] {
        let (size, _) = kit::read_png(&folder.path("a/b").join(name).with_extension("png"));
        assert_eq!(size, (16, 12), "{name}");
    }
}

/// A root with one scene and its reference.
fn small_root() -> Folder {
    let folder = Folder::new();
    let copy = |from: &str| folder.write(from, fs::read(kit::root().join(from)).unwrap());
    copy("assets/scenes/depth-crop.xml");
    for file in ["PROVENANCE.toml", "reference.exr", "tiles.npy"] {
        copy(&format!("reference/depth-crop/{file}"));
    }
    for mesh in fs::read_dir(kit::root().join("assets/meshes")).unwrap() {
        copy(&format!("assets/meshes/{}", mesh.unwrap().file_name().to_str().unwrap()));
    }
    folder
}

#[test]
fn verify_ends_with_0_1_or_2() {
    let folder = small_root();
    let verify = |only: &str| run(&mut folder.etendue(&format!("verify --only {only}")));
    let said = verify("reference/*");
    assert_eq!(said.code, Some(0), "{}{}", said.out, said.err);
    assert!(said.out.contains("1 rows, 0 failed") && said.out.contains("part.html"), "{}", said.out);
    assert!(!said.out.contains("reference/depth-crop"), "{}", said.out);
    let said = verify("reference/* --verbose --times");
    assert!(said.out.contains("holds  reference/depth-crop") && said.out.contains("in seconds"), "{}", said.out);
    // A run of some rows does not replace the page of all rows.
    assert!(folder.path("reports/verify/part.html").exists() && !folder.path("reports/verify/index.html").exists());

    let said = verify("nothing/*");
    assert_eq!((said.code, said.err.as_str()), (Some(2), "no law and no scene matches \"nothing/*\"\n"));
    assert_eq!(verify("[").code, Some(2));

    let reference = folder.path("reference/depth-crop/reference.exr");
    tamper(&reference);
    let said = verify("reference/*");
    assert_eq!(said.code, Some(1), "{}{}", said.out, said.err);
    assert!(said.out.contains("FAILS  reference/depth-crop") && said.out.contains("1 rows, 1 failed"), "{}", said.out);
}

/// Makes an image 1 % brighter.
fn tamper(path: &Path) {
    let mut image = exr::read(path).unwrap();
    for (_, values) in image.channels.iter_mut().filter(|(name, _)| ["R", "G", "B"].contains(&name.as_str())) {
        values.iter_mut().for_each(|value| *value *= 1.01);
    }
    exr::write(path, &image).unwrap();
}

#[test]
fn verify_states_its_effort_and_what_it_could_have_detected() {
    let folder = small_root();
    for (options, effort, required) in [("", "quick", "2"), (" --standard", "standard", "0.5")] {
        let said = run(&mut folder.etendue(&format!("verify --only reference/*{options}")));
        assert_eq!(said.code, Some(0), "{}{}", said.out, said.err);
        assert!(said.out.contains(&format!("{required}\u{202f}% was required")), "{}", said.out);
        assert!(said.out.contains(&format!("{effort} effort")), "{}", said.out);
    }
    let said = run(&mut folder.etendue("verify --standard --full"));
    assert_eq!(said.code, Some(2), "{}", said.err);
}

#[test]
fn a_selection_of_laws_holds_where_all_hold() {
    let folder = small_root();
    let said = run(&mut folder.etendue("verify --standard --only transport/*"));
    assert_eq!(said.code, Some(0), "{}{}", said.out, said.err);
}

#[test]
fn verify_refuses_references_that_are_stale_or_broken() {
    for (file, what) in [
        ("assets/scenes/depth-crop.xml", "is stale: depth-crop.xml has changed"),
        ("reference/depth-crop/PROVENANCE.toml", "PROVENANCE.toml: "),
        ("reference/depth-crop/reference.exr", "reference.exr: "),
        ("reference/depth-crop/tiles.npy", "tiles.npy: "),
    ] {
        let folder = small_root();
        let bytes = fs::read(folder.path(file)).unwrap();
        if file.ends_with("xml") {
            folder.write(file, [bytes.as_slice(), b"\n"].concat());
        } else {
            folder.write(file, &bytes[..bytes.len() / 3]);
        }
        let said = run(&mut folder.etendue("verify --only reference/*"));
        assert_eq!((said.code, said.err.lines().count()), (Some(2), 1), "{file}: {}", said.err);
        assert!(said.err.contains(what), "{}", said.err);
    }
    let said = run(&mut Folder::new().etendue("verify"));
    assert_eq!(said.code, Some(2));
    assert!(said.err.starts_with("assets/scenes: "), "{}", said.err);
}
