//! A lack of memory is reported like other faults: one line, exit code 2, and no file.

use crate::kit::{self, Folder, run};

/// Renders with too little address space, in megabytes.
fn short(folder: &Folder, megabytes: u64, options: &str) -> kit::Said {
    let mut command = kit::limited(folder, &format!("ulimit -v {}", megabytes * 1000));
    command.args(["render", "scene.xml", "-o", "image.exr"]).args(options.split_whitespace());
    let before = folder.files();
    let said = run(&mut command);
    assert_eq!(folder.files(), before, "{}", said.err);
    said
}

#[test]
fn a_film_without_room_is_an_error() {
    let large = kit::ball().replace(r#""16""#, r#""9000""#).replace(r#""12""#, r#""9000""#);
    let said = short(&Folder::with_scene(&large), 1500, "");
    let expected =
        "out of memory: 11.7 GB of memory are not available; a film with fewer pixels or layers needs less\n";
    assert_eq!((said.code, said.err.as_str(), said.out.as_str()), (Some(2), expected, ""));
}

#[test]
fn other_things_without_room_end_the_program_with_one_line() {
    // Photons are stored until memory runs out.
    let folder = Folder::with_scene(&kit::busy("independent", kit::BOX));
    let said = short(&folder, 400, "--integrator photonmapper --param global_photons=100000000");
    assert_eq!((said.code, said.out.as_str()), (Some(2), ""), "{}", said.err);
    assert!(said.err.starts_with("out of memory: ") && said.err.lines().count() == 1, "{}", said.err);
}
