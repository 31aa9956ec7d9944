//! Renders that end early: by time, by their error, by signals, and by being killed.

use std::{
    fs,
    process::{Child, Command, Stdio},
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
    let image = folder.render("--time 0.3s");
    let seconds: f64 = image.attribute("etendue.seconds").unwrap().parse().unwrap();
    assert!(seconds >= 0.3 && spp(&image) > 1, "{seconds} s with {} samples", spp(&image));
    assert!(bits(&image) == bits(&rendered(&folder, &format!("--spp {}", spp(&image)))));
    let said = run(&mut folder.etendue("render scene.xml -o image.exr --time 0s --spp 100"));
    assert_eq!((said.code, said.err.as_str()), (Some(0), "the time is up with 1 samples of each pixel\n"));
    let complete = folder.render("--time 1h --spp 3");
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
        // It could not have ended much earlier.
        let before = spp(&image) - spp(&image) / 8;
        assert!(error(&rendered(&folder, &format!("--integrator {integrator} --spp {before}"))) > 0.14);
        assert!(bits(&image) == bits(&rendered(&folder, &format!("--integrator {integrator} --spp {}", spp(&image)))));
        rendered(&folder, &format!("--integrator {integrator} --spp 19 --checkpoint a.ck"));
        let resumed = format!("--resume a.ck --spp 100000 --threads 1 {options}");
        assert!(bits(&image) == bits(&rendered(&folder, &resumed)), "{integrator}");
        // It is small enough already.
        assert!(bits(&image) == bits(&rendered(&folder, &resumed)), "{integrator}");
    }
    let limited = folder.render("--target-error 0.001% --spp 17");
    assert_eq!(spp(&limited), 17);
}

fn start(folder: &Folder, options: &str) -> Child {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("etendue"));
    command
        .current_dir(folder.path(""))
        .args(["render", "scene.xml", "-o", "image.exr"])
        .args(options.split_whitespace());
    command.stderr(Stdio::null()).spawn().unwrap()
}

/// Waits until something is so.
fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what} never came");
        sleep(Duration::from_millis(2));
    }
}

fn send(child: &Child, signal: Signal) {
    kill(Pid::from_raw(i32::try_from(child.id()).unwrap()), signal).unwrap();
}

#[test]
fn an_interrupted_render_writes_what_it_has_and_can_go_on() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let folder = Folder::with_scene(&busy("independent", BOX));
        let mut child = start(&folder, "--spp 1000000000 --checkpoint a.ck --every 0s");
        wait_for("a checkpoint", || folder.path("a.ck").exists());
        send(&child, signal);
        assert_eq!(child.wait().unwrap().code(), Some(130));
        let image = exr::read(&folder.path("image.exr")).unwrap();
        assert!(bits(&image) == bits(&rendered(&folder, &format!("--spp {}", spp(&image)))));
        let more = spp(&image) + 3;
        let resumed = rendered(&folder, &format!("--resume a.ck --spp {more}"));
        assert!(bits(&resumed) == bits(&rendered(&folder, &format!("--spp {more}"))));
    }
}

/// Whether a process waits for an interruption, as its mask of signals says.
#[cfg(target_os = "linux")]
fn is_waiting(child: &Child) -> bool {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
    u64::from_str_radix(mask.trim(), 16).unwrap() & (1 << (Signal::SIGINT as u64 - 1)) != 0
}

#[cfg(target_os = "linux")]
#[test]
fn a_second_interruption_ends_it_at_once() {
    let folder = Folder::with_scene(&busy("independent", BOX));
    // It emits photons for a minute or more before the first sample.
    let mut child = start(&folder, "--integrator photonmapper --param global_photons=100000000 --spp 1");
    wait_for("the handler", || is_waiting(&child));
    send(&child, Signal::SIGINT);
    sleep(Duration::from_millis(300));
    assert!(child.try_wait().unwrap().is_none(), "the first does not end it");
    send(&child, Signal::SIGINT);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!folder.path("image.exr").exists());
}

#[test]
fn a_killed_render_goes_on_to_the_same_image() {
    for integrator in ["path", "ptracer"] {
        let folder = Folder::with_scene(&busy("independent", BOX));
        let options = format!("--integrator {integrator} --spp 1500");
        let whole = rendered(&folder, &options);
        for delay in [3, 60, 11, 150, 35, 90] {
            let resume = if folder.path("a.ck").exists() { "--resume" } else { "--checkpoint" };
            let mut child = start(&folder, &format!("{options} {resume} a.ck --every 0s"));
            sleep(Duration::from_millis(delay));
            child.kill().unwrap();
            child.wait().unwrap();
        }
        wait_for("a checkpoint", || {
            folder.path("a.ck").exists() || {
                let mut child = start(&folder, &format!("{options} --checkpoint a.ck --every 0s"));
                sleep(Duration::from_millis(200));
                child.kill().unwrap();
                child.wait().is_err()
            }
        });
        assert!(bits(&whole) == bits(&rendered(&folder, &format!("{options} --resume a.ck"))), "{integrator}");
        let name = |path: std::path::PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
        let mut left: Vec<_> = folder.files().into_iter().map(name).collect();
        left.retain(|name| !["a.ck", "a.ck.partial", "image.exr", "other.exr", "scene.xml"].contains(&name.as_str()));
        assert!(left.iter().all(|name| name.starts_with(".etendue")), "{left:?}");
    }
}

#[test]
fn peak_memory_is_of_the_render_alone() {
    // Memory of whoever starts the program is not the program's.
    let large = vec![1_u8; 600 << 20];
    let image = kit::Folder::with_scene(&kit::ball()).render("--spp 4");
    let peak: f64 = image.attribute("etendue.peak_bytes").unwrap().parse().unwrap();
    assert!((1e6..3e8).contains(&peak) && large.iter().all(|byte| *byte == 1), "{peak} bytes");
    let (seconds, core) = ("etendue.seconds", "etendue.core_seconds");
    let [seconds, core]: [f64; 2] = [seconds, core].map(|name| image.attribute(name).unwrap().parse().unwrap());
    assert!(core > 0.0 && core < 60.0 && seconds < 60.0, "{seconds} {core}");
}
