//! Helpers of the tests: small scenes, temporary folders, and ways to run the program.

use std::{
    fs,
    io::BufReader,
    path::{Path, PathBuf},
};

use assert_cmd::Command;
use etendue::{
    film::{Image, exr},
    integrator::Overrides,
    render::{Renderer, Replicate},
    scene_file::xml,
};
use tempfile::TempDir;

pub(crate) const INTEGRATOR: &str = r#"<integrator type="path"><integer name="max_depth" value="4"/></integrator>"#;

/// A camera on the +z axis that looks at the origin.
pub(crate) const SENSOR: &str = r#"<sensor type="perspective">
    <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="16"/><integer name="height" value="12"/><rfilter type="box"/>
    </film>
    <sampler type="independent"/>
  </sensor>"#;

pub(crate) const SKY: &str = r#"<emitter type="constant"><rgb name="radiance" value="0.5, 0.7, 1"/></emitter>"#;

/// A scene with these parts and nothing else.
pub(crate) fn scene_of(parts: &[&str]) -> String {
    format!("<scene version=\"3.0.0\">\n  {}\n</scene>\n", parts.join("\n  "))
}

/// A scene that is complete except for its objects.
pub(crate) fn scene(parts: &str) -> String {
    scene_of(&[INTEGRATOR, SENSOR, SKY, parts])
}

/// The smallest scene with a visible object.
pub(crate) fn ball() -> String {
    scene(r#"<shape type="sphere"/>"#)
}

pub(crate) const BOX: &str = r#"<rfilter type="box"/>"#;

pub(crate) const BUSY_INTEGRATOR: &str = r#"<integrator type="path"><integer name="rr_depth" value="2"/></integrator>"#;

/// A scene with every kind of randomness: lens, filter, lights, Russian roulette.
pub(crate) fn busy(sampler: &str, film: &str) -> String {
    let sensor = format!(
        r#"<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><float name="focus_distance" value="5"/>
        <transform name="to_world"><lookat origin="0, 1, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <sampler type="{sampler}"/>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="20"/>{film}</film></sensor>"#
    );
    scene_of(&[
        BUSY_INTEGRATOR,
        &sensor,
        SKY,
        r#"<shape type="sphere"><bsdf type="dielectric"/></shape>"#,
        r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-2"/></transform></shape>"#,
        r#"<shape type="disk"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
           <emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>"#,
    ])
}

/// The root folder of the repository.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The scene files of the repository.
pub(crate) fn scenes() -> Vec<PathBuf> {
    let folders = ["assets/scenes", "assets/scenes/figures"].map(|folder| fs::read_dir(root().join(folder)).unwrap());
    let mut scenes: Vec<_> = folders.into_iter().flatten().map(|entry| entry.unwrap().path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "xml"));
    scenes.sort();
    assert!(!scenes.is_empty());
    scenes
}

/// A temporary folder, which is removed at the end of the test.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    /// A folder with the scene `scene.xml` in it.
    pub(crate) fn with_scene(text: &str) -> Self {
        let folder = Self::new();
        folder.write("scene.xml", text);
        folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    /// All files in the folder and below, including hidden ones.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let (mut files, mut folders) = (Vec::new(), vec![self.0.path().to_owned()]);
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() { folders.push(path) } else { files.push(path) }
            }
        }
        files.sort();
        files
    }

    /// The program, run in this folder; arguments are separated by blanks.
    pub(crate) fn etendue(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("etendue").unwrap();
        command.current_dir(self.0.path()).args(arguments.split_whitespace());
        command
    }

    /// Renders `scene.xml` and reads the image.
    pub(crate) fn render(&self, options: &str) -> Image {
        self.etendue(&format!("render scene.xml -o image.exr {options}")).assert().success();
        exr::read(&self.path("image.exr")).unwrap()
    }
}

/// The program, run in a folder by a shell that first sets limits; the caller adds arguments. It also limits the
/// processor time to ten seconds, of which a test needs a fraction. Unlike wall-clock time, processor time does not
/// depend on the load of the machine.
pub(crate) fn limited(folder: &Folder, limits: &str) -> Command {
    let mut command = std::process::Command::new("sh");
    command.current_dir(folder.path("")).arg("-c").arg(format!("ulimit -t 10; {limits}; exec \"$0\" \"$@\""));
    // Each thread takes address space.
    command.env("RAYON_NUM_THREADS", "2").arg(assert_cmd::cargo::cargo_bin("etendue"));
    Command::from_std(command)
}

/// The width and height of a PNG file, and its bytes row by row.
pub(crate) fn read_png(path: &Path) -> ((u32, u32), Vec<u8>) {
    let mut reader = png::Decoder::new(BufReader::new(fs::File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    ((info.width, info.height), bytes)
}

/// The exit code and the output of a finished run.
pub(crate) struct Said {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

/// Runs a command to its end, whether it succeeds or not.
pub(crate) fn run(command: &mut Command) -> Said {
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Said { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// The image of a scene in a folder, rendered without the command line.
pub(crate) fn image_in(folder: &Folder, samples: u32) -> Image {
    let document = xml::read(&folder.path("scene.xml"), &[]).unwrap_or_else(|error| panic!("{error}"));
    let renderer = Renderer::new(&document, &Overrides::default()).unwrap_or_else(|error| panic!("{error}"));
    renderer.render(Replicate { seed: 1, number: 0, samples }, &|_| {}).image()
}

/// The image of a scene.
pub(crate) fn image(text: &str, samples: u32) -> Image {
    image_in(&Folder::with_scene(text), samples)
}

/// Every bit of every channel.
pub(crate) fn bits(image: &Image) -> Vec<(&str, Vec<u32>)> {
    image.channels.iter().map(|(name, values)| (name.as_str(), values.iter().map(|x| x.to_bits()).collect())).collect()
}

/// Red, green and blue of a pixel.
pub(crate) fn pixel(image: &Image, x: u32, y: u32) -> [f32; 3] {
    image.rgb(["R", "G", "B"]).unwrap()[(y * image.crop.width + x) as usize]
}
