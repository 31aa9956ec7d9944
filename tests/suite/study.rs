//! `etendue study`: from its file to a page, restarts, and invalid input.

use std::{collections::BTreeMap, fs, path::PathBuf};

use etendue::film::exr;

use crate::kit::{Folder, INTEGRATOR, Said, run, scene_of};

/// A floor under a uniform environment and a lamp: cheap, and different in every sample.
fn room() -> String {
    let sensor = r#"<default name="size" value="12"/><sensor type="perspective">
    <transform name="to_world"><lookat origin="0, 2, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="$size"/><integer name="height" value="12"/><rfilter type="box"/></film>
    <sampler type="independent"/></sensor>"#;
    let floor = r#"<shape type="rectangle"><transform name="to_world"><scale value="9"/><rotate x="1" angle="-90"/></transform>
    <bsdf type="diffuse"/></shape><shape type="sphere"><float name="radius" value="0.8"/></shape>"#;
    scene_of(&[INTEGRATOR, sensor, floor, r#"<emitter type="constant"/>"#])
}

const STUDY: &str = r#"
title = "A small study"
about = "The error of independent samples falls as one over the root of their number."
seeds = 8
[[scene]]
name = "room"
file = "scene.xml"
reference = {render = {integrator = "path", spp = 4096}}
mask = {y = [4, 12]}
[[method]]
name = "path"
integrator = "path"
vary = {name = "spp", values = [4, 16, 64, 256]}
[[fit]]
y = "rmse"
slope = -0.5
half_width = 0.06
[[fit]]
y = "variance"
masked = true
finite_n = ["independent"]
"#;

/// A folder with the scene and the study.
fn folder(study: &str) -> Folder {
    let folder = Folder::with_scene(&room());
    folder.write("study.toml", study);
    folder
}

fn study(folder: &Folder, options: &str) -> Said {
    run(&mut folder.etendue(&format!("study study.toml --out out {options}")))
}

fn read(folder: &Folder, name: &str) -> String {
    fs::read_to_string(folder.path(&format!("out/{name}"))).unwrap()
}

/// The images of all runs, with their modification times.
fn images(folder: &Folder) -> BTreeMap<PathBuf, std::time::SystemTime> {
    let files = folder.files().into_iter().filter(|path| path.extension().is_some_and(|extension| extension == "exr"));
    files.map(|path| (path.clone(), fs::metadata(path).unwrap().modified().unwrap())).collect()
}

/// The rows without the cost of a run.
fn rows(folder: &Folder) -> Vec<serde_json::Value> {
    let line = |line: &str| {
        let mut row: serde_json::Value = serde_json::from_str(line).unwrap();
        for cost in ["seconds", "core_seconds", "peak_bytes"] {
            row.as_object_mut().unwrap().remove(cost);
        }
        row
    };
    read(folder, "rows.jsonl").lines().map(line).collect()
}

#[test]
fn a_study_from_one_end_to_the_other() {
    let folder = folder(STUDY);
    let planned = study(&folder, "--plan");
    assert_eq!((planned.code, planned.out.lines().count()), (Some(0), 4 * 8 + 1), "{}", planned.err);
    let first: serde_json::Value = serde_json::from_str(planned.out.lines().next().unwrap()).unwrap();
    assert_eq!((first["cell"].as_str(), first["method"].as_str()), (Some("room.reference"), Some("reference")));
    assert!(!folder.path("out").exists(), "a plan makes nothing");

    let said = study(&folder, "--jobs 2");
    assert_eq!(said.code, Some(0), "{}{}", said.out, said.err);
    assert_eq!(said.out.lines().filter(|line| line.starts_with("holds")).count(), 2, "{}", said.out);
    assert_eq!((rows(&folder).len(), read(&folder, "rows.csv").lines().count()), (32, 33));
    assert_eq!((read(&folder, "cells.jsonl").lines().count(), read(&folder, "cells.csv").lines().count()), (4, 5));
    let fits: serde_json::Value = serde_json::from_str(&read(&folder, "fits.json")).unwrap();
    assert_eq!(fits["fits"][0]["holds"], true);
    let page = read(&folder, "index.html");
    for part in ["A small study", "All 2 predictions hold", "room.rmse.spp.svg", "room.variance-masked.spp.svg"] {
        assert!(page.contains(part), "{part}");
    }
    for svg in ["room.rmse.spp.svg", "room.rmse.core-seconds.svg"] {
        assert!(read(&folder, svg).starts_with("<svg"), "{svg}");
    }
    // RMSE and variance over samples, and RMSE over time.
    assert_eq!(page.matches(r#"<svg class="chart""#).count(), 3);
    let cell: serde_json::Value = serde_json::from_str(read(&folder, "cells.jsonl").lines().last().unwrap()).unwrap();
    for known in
        ["rmse_se", "variance_se", "bias_squared_se", "rmse_masked", "flip", "ssim", "efficiency", "peak_bytes"]
    {
        assert!(cell[known].is_number(), "{known}: {cell}");
    }

    // A second run has nothing to do and changes nothing.
    assert_eq!(study(&folder, "--plan").out, "");
    assert_eq!(study(&folder, "--plan --all").out, planned.out);
    let (before, table) = (images(&folder), read(&folder, "rows.jsonl"));
    assert_eq!(study(&folder, "").code, Some(0));
    assert_eq!((images(&folder), read(&folder, "rows.jsonl")), (before, table));

    // Another folder and other threads give the same rows.
    let other = self::folder(STUDY);
    assert_eq!(study(&other, "--jobs 1 --threads 1").code, Some(0));
    assert_eq!(rows(&folder), rows(&other));
}

/// A study without fits, for which a single seed is enough.
fn short() -> String {
    STUDY[..STUDY.find("[[fit]]").unwrap()]
        .replace("seeds = 8", "seeds = 2")
        .replace("4096", "64")
        .replace(", 64, 256", "")
}

#[test]
fn a_study_that_was_killed_goes_on() {
    let folder = folder(&short());
    assert_eq!(study(&folder, "--only room.path.4").code, Some(0));
    let first = images(&folder);
    assert_eq!(first.len(), 3, "the reference and one cell");
    // A partial line and a partial image, as after kill -9, and an image of another plan.
    let table = read(&folder, "rows.jsonl");
    folder.write("out/rows.jsonl", &table[..table.len() - 20]);
    folder.write("out/rows.csv", read(&folder, "rows.csv").trim_end());
    let torn = first.keys().find(|path| path.to_string_lossy().contains("path.4")).unwrap();
    // Headers contain times, which vary in length.
    let channels = || exr::read(torn).expect("an image").channels;
    let (bytes, whole) = (fs::read(torn).unwrap(), channels());
    fs::write(torn, &bytes[..bytes.len() / 3]).unwrap();
    let planned = study(&folder, "--plan");
    assert_eq!(planned.out.lines().count(), 3, "{}", planned.out);
    assert_eq!(study(&folder, "").code, Some(0));
    assert_eq!((rows(&folder).len(), read(&folder, "rows.csv").lines().count()), (4, 5));
    assert_eq!(channels(), whole);
    for (path, time) in &first {
        assert!(path == torn || images(&folder)[path] == *time, "{} was made again", path.display());
    }
}

#[test]
fn images_of_another_plan_are_made_again() {
    let folder = folder(&short());
    assert_eq!(study(&folder, "").code, Some(0));
    let before = images(&folder);
    folder.write("scene.xml", room().replace("0.8", "0.7"));
    assert_eq!(study(&folder, "--plan").out.lines().count(), before.len());
    assert_eq!(study(&folder, "--evaluate").code, Some(0));
    assert_eq!((images(&folder), rows(&folder).len()), (before, 0), "evaluation makes nothing and takes nothing stale");
}

#[test]
fn a_wrong_prediction_fails() {
    let folder = folder(&STUDY.replace("slope = -0.5", "slope = -0.65"));
    let said = study(&folder, "");
    assert_eq!(said.code, Some(1), "{}", said.out);
    assert!(
        said.out.contains("FAILS  RMSE, path on room") && said.out.contains("outside of the interval"),
        "{}",
        said.out
    );
    assert!(read(&folder, "index.html").contains("1 of 2 predictions fails"));
}

#[test]
fn a_fit_without_power_fails() {
    let folder = folder(&STUDY.replace("half_width = 0.06", "half_width = 0.0001"));
    let said = study(&folder, "");
    assert!(said.code == Some(1) && said.out.contains("0.0001 or more, too wide to decide"), "{}", said.out);
}

#[test]
fn invalid_studies_are_reported_in_one_line() {
    let other_size = short()
        .replace("reference = {render = {integrator = \"path\", spp = 64}}", "reference = {image = \"other.exr\"}");
    let cases = [
        (short().replace("seeds", "seedz"), "study.toml:4:1: unknown field `seedz`"),
        (short().replace("seeds = 2", "seeds = 0"), "study.toml:4:9: seeds is 0; write 1 to 1024"),
        (
            STUDY.replace("seeds = 8", "seeds = 1"),
            "study.toml:4:9: seeds is 1, but [[fit]] and [[compare]] need the scatter",
        ),
        (short().replace("scene.xml", "missing.xml"), "study.toml:7:8: there is no scene missing.xml"),
        (short().replace("[4, 16]", "[4, inf]"), "the values of vary must be whole numbers from 1"),
        (
            short().replace("integrator = \"path\"\nvary", "integrator = \"pth\"\nvary"),
            "no integrator is called \"pth\"",
        ),
        (short().replace("y = [4, 12]", "above = 1e9"), "study.toml:9:8: the mask contains no pixel"),
        (other_size, "is 12x12 pixels; the reference has 10x12"),
        ("title = ".into(), "study.toml:1:"),
    ];
    for (text, expected) in cases {
        let folder = folder(&text);
        run(&mut folder.etendue("render scene.xml -o other.exr --spp 2 -D size=10"));
        let said = study(&folder, "");
        assert_eq!(said.code, Some(2), "{expected}: {}{}", said.out, said.err);
        assert!(said.err.contains(expected), "{expected}: {}", said.err);
        assert_eq!(said.err.trim_end().lines().count(), 1, "{}", said.err);
    }
    let folder = folder(&short());
    assert_eq!(run(&mut folder.etendue("study nothing.toml")).code, Some(2));
}

#[test]
fn studies_of_one_name_do_not_share_a_folder() {
    let folder = folder(&short());
    fs::create_dir(folder.path("other")).unwrap();
    folder.write("other/study.toml", short().replace("scene.xml", "../scene.xml"));
    assert_eq!(study(&folder, "").code, Some(0));
    let before = folder.files();
    for options in ["", "--plan", "--evaluate"] {
        let said = run(&mut folder.etendue(&format!("study other/study.toml --out out {options}")));
        assert_eq!(said.code, Some(2), "{}", said.out);
        assert!(said.err.starts_with("out: holds the results of /"), "{}", said.err);
        assert!(said.err.ends_with("/study.toml; choose another folder with --out\n"), "{}", said.err);
        assert_eq!(folder.files(), before);
    }
    // A study that no longer exists, perhaps because its file was moved, does not count.
    fs::remove_file(folder.path("study.toml")).unwrap();
    let said = run(&mut folder.etendue("study other/study.toml --out out --plan"));
    assert_eq!(said.code, Some(0), "{}", said.err);
}

#[test]
fn runs_of_mitsuba_are_planned_and_left_out() {
    let method = "[[method]]\nname = \"mi\"\nrenderer = \"mitsuba\"\nvariant = \"llvm_ad_rgb\"\nintegrator = \"path\"\n\
                  vary = {name = \"spp\", values = [4, 16, 64]}\n[[fit]]\nmethods = \"mi\"\ny = \"rmse\"\nslope = -0.5\n";
    let folder = folder(&(short().replace("seeds = 2", "seeds = 3") + method));
    let said = study(&folder, "");
    assert_eq!(said.code, Some(0), "{}{}", said.out, said.err);
    assert!(said.err.contains("9 runs are missing"), "{}", said.err);
    let planned = study(&folder, "--plan");
    assert_eq!(planned.out.lines().count(), 9);
    let run: serde_json::Value = serde_json::from_str(planned.out.lines().next().unwrap()).unwrap();
    assert_eq!((run["integrator"].as_str(), run["spp"].as_u64(), run.get("arguments")), (Some("path"), Some(4), None));
}
