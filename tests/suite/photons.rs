//! The command `photons`.

use std::fs;

use crate::kit::{self, Folder, Said, run};

const ROOM: &str = r#"<shape type="rectangle"><transform name="to_world"><scale value="4"/><translate z="-2"/></transform></shape>
    <shape type="sphere"><bsdf type="dielectric"/></shape>
    <emitter type="point"><point name="position" x="0" y="1" z="3"/><rgb name="intensity" value="3, 2, 1"/></emitter>"#;

fn room(integrator: &str) -> Folder {
    Folder::with_scene(&kit::scene_of(&[integrator, kit::SENSOR, ROOM]))
}

fn photons(folder: &Folder, options: &str) -> Said {
    let said = run(&mut folder.etendue(&format!("photons scene.xml {options}")));
    assert_eq!(said.code, Some(0), "{}", said.err);
    said
}

const FEW: &str = "--param global_photons=5000 --param caustic_photons=3000";
const MAPPER: &str = r#"<integrator type="photonmapper"><integer name="max_depth" value="4"/></integrator>"#;

/// The numbers in the row of a class, from the first map that has it.
fn row(said: &Said, class: &str) -> Vec<f64> {
    let line = said.out.lines().find(|line| line.trim_start().starts_with(class)).unwrap();
    line.split_whitespace().skip(1).map(|number| number.parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn the_table_counts_what_the_renderer_keeps() {
    let folder = room(MAPPER);
    let said = photons(&folder, FEW);
    let flux = 4.0 * std::f64::consts::PI;
    let head: Vec<_> = said.out.lines().next().unwrap().split_whitespace().collect();
    assert_eq!(head[..4], ["global", "map:", "5000", "emitted"]);
    let power: Vec<f64> = head[5..8].iter().map(|number| number.parse().unwrap()).collect();
    for (power, intensity) in power.iter().zip([3.0, 2.0, 1.0]) {
        assert!((power / (flux * intensity) - 1.0).abs() < 1e-4, "{power}");
    }
    let rows = ["direct", "caustic", "indirect"].map(|class| row(&said, class)[0]);
    let stored: f64 = rows.iter().sum();
    assert!(rows[0] > 100.0 && rows[1] > 10.0, "{}", said.out);
    let rendered = run(&mut folder.etendue(&format!("render scene.xml -o a.exr --spp 1 {FEW}")));
    assert!(rendered.err.contains(&format!("global map: {stored} photons of 5000 emitted")), "{}", rendered.err);
    // Light straight from an emitter has hit no surface before; light through glass has hit one or two.
    assert_eq!(row(&said, "direct")[5], 0.0);
    assert!(row(&said, "caustic")[5] > 1.0);
}

#[test]
fn other_integrators_are_replaced_and_keep_their_depths() {
    let path = MAPPER.replace("photonmapper", "path");
    let aov = format!(r#"<integrator type="aov"><string name="aovs" value="d:depth"/>{MAPPER}</integrator>"#);
    let out = |integrator: &str, more: &str| photons(&room(integrator), &format!("{FEW} {more}")).out;
    let own = out(MAPPER, "");
    for other in [path.as_str(), aov.as_str()] {
        assert_eq!(own, out(other, ""), "{other}");
    }
    assert_eq!(own, out("", "--param max_depth=4"), "a scene without an integrator");
    assert_ne!(own, out("", ""));
    assert_ne!(own, out(MAPPER, "--seed 1"));
    assert_eq!(own, out(MAPPER, "--threads 7"));
}

#[test]
fn files_hold_all_photons() {
    let folder = room(MAPPER);
    let said = photons(&folder, &format!("{FEW} --ply a.ply --npy a.npy --threads 1"));
    let stored: Vec<usize> =
        said.out.lines().filter_map(|line| line.strip_suffix(" stored")?.rsplit(' ').next()?.parse().ok()).collect();
    assert_eq!(stored.len(), 2, "{}", said.out);
    let (ply, npy) = (fs::read(folder.path("a.ply")).unwrap(), fs::read(folder.path("a.npy")).unwrap());
    let total: usize = stored.iter().sum();
    assert!(String::from_utf8_lossy(&ply[..400]).contains(&format!("element vertex {total}\n")));
    let rows = &npy[npy.len() - 40 * total..];
    let float = |row: &[u8], at: usize| f32::from_le_bytes(row[at..at + 4].try_into().unwrap());
    let power: f64 =
        rows.chunks(40).filter(|row| row[36] == 0 && row[39] == 0).map(|row| f64::from(float(row, 12))).sum();
    assert!((power / row(&said, "direct")[2] - 1.0).abs() < 1e-4, "{power}: {}", said.out);
    for row in rows.chunks(40) {
        let length = (24..36).step_by(4).map(|at| float(row, at).powi(2)).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-6);
    }
    let other = photons(&folder, &format!("{FEW} --ply b.ply --npy b.npy --threads 7"));
    assert_eq!(said.out, other.out);
    assert!(ply == fs::read(folder.path("b.ply")).unwrap() && npy == fs::read(folder.path("b.npy")).unwrap());
}

#[test]
fn bad_input_leaves_no_file() {
    let folder = room(MAPPER);
    folder.write("folder/file", "");
    let before = folder.files();
    let cases = [
        ("--ply none/a.ply", "none/a.ply: cannot be written: No such file"),
        ("--npy folder", "folder: is a folder"),
        ("--ply a --npy a", "a: is named twice"),
        ("--param global_photons=0", "--param global_photons=0: \"global_photons\" is 0; must be a number from 1"),
        ("--param global_photon=1", "--param global_photon=1: an integrator \"photonmapper\" has no parameter"),
        ("--seed -1", "error: invalid value '-1' for '--seed <N>'"),
    ];
    for (options, message) in cases {
        let said = run(&mut folder.etendue(&format!("photons scene.xml --ply a.ply --npy b.npy {options}")));
        let said = if said.err.contains("cannot be used multiple times") {
            run(&mut folder.etendue(&format!("photons scene.xml {options}")))
        } else {
            said
        };
        assert_eq!(said.code, Some(2), "{options}: {}", said.err);
        assert!(said.err.starts_with(message), "{options}: {}", said.err);
        assert_eq!(folder.files(), before, "{options}");
    }
}
