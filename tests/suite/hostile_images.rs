//! Images that `compare` rejects.

use etendue::film::exr;

use crate::kit::{self, Folder, run};

/// A folder with `image.exr` and damaged or different versions of it.
fn folder() -> Folder {
    let folder = Folder::with_scene(&kit::ball());
    let image = folder.render("--spp 4");
    let bytes = std::fs::read(folder.path("image.exr")).unwrap();
    folder.write("half.exr", &bytes[..bytes.len() / 2]);
    folder.write("head.exr", &bytes[..100]);
    folder.write("empty.exr", "");
    folder.write("garbage.exr", "not an image at all\n");
    for (name, size) in [("huge", 2_000_000_000_i32), ("large", 100_000)] {
        folder.write(&format!("{name}.exr"), promising(&bytes, size));
    }
    let mut other = image.clone();
    other.channels.retain(|(name, _)| name != "G");
    exr::write(&folder.path("no-green.exr"), &other).unwrap();
    let mut other = image;
    other.channels[1].1[17] = f32::NAN;
    exr::write(&folder.path("nan.exr"), &other).unwrap();
    folder.etendue("render scene.xml -o other.exr --spp 4 --integrator depth").assert().success();
    let small = kit::ball().replace("value=\"12\"", "value=\"11\"");
    folder.write("small.xml", small);
    folder.etendue("render small.xml -o small.exr --spp 4").assert().success();
    folder
}

/// The same file with another data window in its header.
fn promising(bytes: &[u8], size: i32) -> Vec<u8> {
    let key = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = bytes.windows(key.len()).position(|window| window == key).unwrap() + key.len();
    let mut bytes = bytes.to_vec();
    for (i, number) in [0, 0, size, size].into_iter().enumerate() {
        bytes[at + 4 * i..at + 4 * (i + 1)].copy_from_slice(&number.to_le_bytes());
    }
    bytes
}

#[test]
fn images_that_cannot_be_compared_are_refused() {
    let folder = folder();
    let cases = [
        ("missing.exr", "missing.exr: No such file"),
        ("half.exr", "half.exr: "),
        ("head.exr", "head.exr: "),
        ("empty.exr", "empty.exr: "),
        ("garbage.exr", "garbage.exr: "),
        ("huge.exr", "huge.exr: "),
        ("large.exr", "large.exr: "),
        ("scene.xml", "scene.xml: "),
        ("no-green.exr", "no-green.exr: has no channels R, G and B"),
        ("nan.exr", "nan.exr: the pixel in column 1, row 1 is not finite"),
    ];
    let mut all: Vec<(String, &str)> = Vec::new();
    for (name, what) in cases {
        all.push((format!("{name} image.exr"), what));
        all.push((format!("image.exr {name}"), what));
    }
    all.push(("small.exr image.exr".into(), "small.exr: is 16x11 pixels; the reference has 16x12"));
    all.push((". image.exr".into(), ".: "));
    all.push(("image.exr .".into(), "./PROVENANCE.toml: No such file"));
    for (arguments, what) in all {
        let before = folder.files();
        let mut command = kit::limited(&folder, "ulimit -v 1048576");
        command.arg("compare").args(arguments.split_whitespace()).args(["--pictures", "pictures"]);
        let said = run(&mut command);
        assert_eq!((said.code, said.err.lines().count()), (Some(2), 1), "{arguments}: {}{}", said.out, said.err);
        assert!(said.err.starts_with(what) && said.out.is_empty(), "{arguments}: {}", said.err);
        assert_eq!(folder.files(), before, "{arguments}");
    }
}
