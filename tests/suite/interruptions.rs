//! Renders that end early: by a time limit, by a target error, by signals, and by being killed.

use std::{
    fs::{self, File},
    io::Read as _,
    os::unix::fs::MetadataExt as _,
    process::{Child, Command, ExitStatus, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use etendue::film::{Image, VARIANCE, exr};
use nix::{
    sys::signal::{Signal, kill},
    unistd::Pid,
};

use crate::kit::{self, BOX, Folder, bits, busy, run};

fn rendered(folder: &Folder, options: &str) -> Image {
    folder.etendue(&format!("render scene.xml -o other.exr {options}")).assert().success();
    exr::read(&folder.path("other.exr")).unwrap()
}

fn spp(image: &Image) -> u32 {
    image.attribute("etendue.spp").unwrap().parse().unwrap()
}

#[test]
fn time_ends_a_render() {
    let folder = Folder::with_scene(&busy("independent", BOX));
    let image = folder.render("--time-limit 0.3s");
    let seconds: f64 = image.attribute("etendue.seconds").unwrap().parse().unwrap();
    assert!(seconds >= 0.3, "{seconds} s with {} samples", spp(&image));
    assert!(bits(&image) == bits(&rendered(&folder, &format!("--spp {}", spp(&image)))));
    // A render takes at least one sample.
    let said = run(&mut folder.etendue("render scene.xml -o image.exr --time-limit 0s --spp 100"));
    assert_eq!((said.code, said.err.as_str()), (Some(0), "the time is up with 1 samples of each pixel\n"));
    let complete = folder.render("--time-limit 1000h --spp 3");
    assert_eq!(spp(&complete), 3);
}

/// The root of the mean variance, divided by the mean.
fn error(image: &Image) -> f64 {
    let mean = |names: [&str; 3]| {
        let sum: f64 = names.iter().flat_map(|name| image.channel(name).unwrap()).map(|&x| f64::from(x)).sum();
        sum / (3 * image.channels[0].1.len()) as f64
    };
    mean(VARIANCE).sqrt() / mean(["R", "G", "B"])
}

#[test]
fn a_small_error_ends_a_render_at_the_same_sample_always() {
    let folder = Folder::with_scene(&busy("independent", BOX));
    for integrator in ["path", "ptracer"] {
        let options = format!("--integrator {integrator} --target-error 15%");
        let image = folder.render(&options);
        assert!(error(&image) < 0.15 && spp(&image) > 20, "{integrator}: {} with {}", error(&image), spp(&image));
        // The render could not have ended much earlier.
        let before = spp(&image) - spp(&image) / 8;
        assert!(error(&rendered(&folder, &format!("--integrator {integrator} --spp {before}"))) > 0.14);
        assert!(bits(&image) == bits(&rendered(&folder, &format!("--integrator {integrator} --spp {}", spp(&image)))));
        rendered(&folder, &format!("--integrator {integrator} --spp 19 --checkpoint a.ck"));
        let resumed = format!("--resume a.ck --spp 100000 --threads 1 {options}");
        assert!(bits(&image) == bits(&rendered(&folder, &resumed)), "{integrator}");
        // The error is already small enough.
        assert!(bits(&image) == bits(&rendered(&folder, &resumed)), "{integrator}");
    }
    let limited = folder.render("--target-error 0.001% --spp 17");
    assert_eq!(spp(&limited), 17);
}

#[test]
fn an_error_that_is_out_of_reach_ends_a_render() {
    let dark = kit::scene_of(&[kit::INTEGRATOR, kit::SENSOR, r#"<shape type="sphere"/>"#]);
    let cases = [
        (dark, "1%", "the image is black, so that no error is small enough with 256 samples of each pixel\n"),
        (busy("independent", BOX), "0.0001%", " and without --spp or --time-limit no more than 1048576 are taken\n"),
    ];
    for (scene, target, why) in cases {
        let folder = Folder::with_scene(&scene);
        let said = run(&mut folder.etendue(&format!("render scene.xml -o image.exr --target-error {target}")));
        assert!(said.code == Some(1) && said.err.ends_with(why), "{:?} {}", said.code, said.err);
        let image = exr::read(&folder.path("image.exr")).unwrap();
        assert_eq!(spp(&image), 256);
        // Other conditions end a render even if the error is far from its target.
        for end in ["--spp 300", "--time-limit 0s"] {
            let image = folder.render(&format!("--target-error {target} {end}"));
            assert_eq!(spp(&image), if end.contains("300") { 300 } else { 1 });
        }
    }
}

/// The output of a render on a terminal.
fn on_terminal(folder: &Folder, options: &str) -> String {
    let size = nix::pty::Winsize { ws_row: 24, ws_col: 160, ws_xpixel: 0, ws_ypixel: 0 };
    let pty = nix::pty::openpty(Some(&size), None).unwrap();
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("etendue"));
    command.current_dir(folder.path("")).args(["render", "scene.xml", "-o", "image.exr"]);
    command.args(options.split_whitespace()).env("TERM", "xterm").stderr(pty.slave).stdout(Stdio::null());
    let mut child = command.spawn().unwrap();
    // The program holds the only other end now, so that reading ends when the program ends.
    drop(command);
    let mut text = Vec::new();
    let _ = File::from(pty.master).read_to_end(&mut text);
    assert!(child.wait().unwrap().success());
    String::from_utf8(text).unwrap()
}

#[test]
fn progress_is_shown_on_a_terminal() {
    let folder = Folder::with_scene(&busy("independent", BOX));
    let shown = on_terminal(&folder, "--spp 20");
    assert!(shown.contains(" of 20 spp, ") && shown.contains("samples/s, "), "{shown}");
    assert_eq!(on_terminal(&folder, "--spp 20 --quiet"), "");
    // There is no progress if standard error is not a terminal.
    assert_eq!(run(&mut folder.etendue("render scene.xml -o image.exr --spp 20")).err, "");
}

/// A running render, which is killed if the test fails.
struct Running(Child);

impl Running {
    fn start(folder: &Folder, options: &str) -> Self {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("etendue"));
        command
            .current_dir(folder.path(""))
            .args(["render", "scene.xml", "-o", "image.exr"])
            .args(options.split_whitespace());
        Self(command.stderr(Stdio::null()).spawn().unwrap())
    }

    fn has_ended(&mut self) -> bool {
        self.0.try_wait().unwrap().is_some()
    }

    /// Waits for a condition, however long it takes. Panics if the render ends before.
    fn wait_for(&mut self, what: &str, mut is_so: impl FnMut(&Self) -> bool) {
        while !is_so(self) {
            assert!(!self.has_ended(), "it ended before {what}");
            sleep(Duration::from_millis(2));
        }
    }

    fn send(&self, signal: Signal) {
        kill(Pid::from_raw(i32::try_from(self.0.id()).unwrap()), signal).unwrap();
    }

    fn kill(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }

    fn wait(&mut self) -> ExitStatus {
        self.0.wait().unwrap()
    }

    /// Whether a mask of signals in the kernel's status file contains a signal.
    #[cfg(target_os = "linux")]
    fn has(&self, mask: &str, signal: Signal) -> bool {
        let status = fs::read_to_string(format!("/proc/{}/status", self.0.id())).unwrap();
        let bits = status.lines().find_map(|line| line.strip_prefix(mask)?.strip_prefix(':')).unwrap();
        u64::from_str_radix(bits.trim(), 16).unwrap() & (1 << (signal as u64 - 1)) != 0
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn an_interrupted_render_writes_what_it_has_and_can_go_on() {
    for signal in [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP, Signal::SIGUSR1] {
        let folder = Folder::with_scene(&busy("independent", BOX));
        // The render cannot end before it receives a signal.
        let mut render = Running::start(&folder, "--spp 1000000000 --checkpoint a.ck --checkpoint-every 0s");
        render.wait_for("its first checkpoint", |_| folder.path("a.ck").exists());
        render.send(signal);
        assert_eq!(render.wait().code(), Some(130));
        let image = exr::read(&folder.path("image.exr")).unwrap();
        assert!(bits(&image) == bits(&rendered(&folder, &format!("--spp {}", spp(&image)))));
        let more = spp(&image) + 3;
        let resumed = rendered(&folder, &format!("--resume a.ck --spp {more}"));
        assert!(bits(&resumed) == bits(&rendered(&folder, &format!("--spp {more}"))));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_second_interruption_ends_it_at_once() {
    let folder = Folder::with_scene(&busy("independent", BOX));
    // The test holds the lock that the writer of the checkpoint waits for, so the render cannot end before the lock is
    // released.
    let gate = File::create(folder.path("a.ck.partial")).unwrap();
    gate.lock().unwrap();
    let mut render = Running::start(&folder, "--spp 1 --checkpoint a.ck");
    render.wait_for("it catches interruptions", |render| render.has("SigCgt", Signal::SIGINT));
    render.send(Signal::SIGINT);
    // Two pending signals of one kind would count as one.
    render.wait_for("the first one came", |render| !render.has("ShdPnd", Signal::SIGINT));
    assert!(!render.has_ended(), "the first does not end it");
    render.send(Signal::SIGINT);
    assert_eq!(render.wait().code(), Some(130));
    assert!(!folder.path("image.exr").exists());
}

#[test]
fn a_killed_render_goes_on_to_the_same_image() {
    for integrator in ["path", "ptracer"] {
        let folder = Folder::with_scene(&busy("independent", BOX));
        let options = format!("--integrator {integrator} --spp 300");
        let whole = rendered(&folder, &options);
        // Kills the render at its start, and after these numbers of checkpoints.
        for checkpoints in [0, 1, 4, 0, 9, 2] {
            let resume = if folder.path("a.ck").exists() { "--resume" } else { "--checkpoint" };
            let mut render = Running::start(&folder, &format!("{options} {resume} a.ck --checkpoint-every 0s"));
            let file = || fs::metadata(folder.path("a.ck")).ok().map(|data| (data.ino(), data.modified().unwrap()));
            let (mut last, mut seen) = (file(), 0);
            while seen < checkpoints && !render.has_ended() {
                if file() != last {
                    (last, seen) = (file(), seen + 1);
                }
            }
            render.kill();
        }
        assert!(bits(&whole) == bits(&rendered(&folder, &format!("{options} --resume a.ck"))), "{integrator}");
        let name = |path: std::path::PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
        let mut left: Vec<_> = folder.files().into_iter().map(name).collect();
        left.retain(|name| !["a.ck", "a.ck.partial", "image.exr", "other.exr", "scene.xml"].contains(&name.as_str()));
        assert!(left.iter().all(|name| name.starts_with(".etendue")), "{left:?}");
    }
}

#[test]
fn peak_memory_is_of_the_render_alone() {
    // The memory of the parent process does not count.
    let large = vec![1_u8; 600 << 20];
    let start = Instant::now();
    let image = kit::Folder::with_scene(&kit::ball()).render("--spp 4");
    let peak: f64 = image.attribute("etendue.peak_bytes").unwrap().parse().unwrap();
    assert!((1e6..3e8).contains(&peak) && large.iter().all(|byte| *byte == 1), "{peak} bytes");
    let (seconds, core) = ("etendue.seconds", "etendue.core_seconds");
    let [seconds, core]: [f64; 2] = [seconds, core].map(|name| image.attribute(name).unwrap().parse().unwrap());
    // Both times are rounded to a thousandth, and neither can exceed the elapsed time.
    let passed = start.elapsed().as_secs_f64() + 0.001;
    let cores = std::thread::available_parallelism().unwrap().get() as f64;
    assert!(core > 0.0 && core < passed * cores && seconds < passed, "{seconds} {core} of {passed}");
}
