//! Renders with checkpoints, resumed, split into shards and merged. The result must be the image of a single run, to
//! the last bit, or one clear error.

use std::{
    fs,
    ops::Range,
    sync::atomic::AtomicBool,
    time::{Duration, Instant},
};

use etendue::{
    film::{Image, exr},
    integrator::{IntegratorState, Overrides},
    render::{
        Renderer, Replicate,
        checkpoint::{
            Checkpoint, Controls, Identity, JobError, MergeError, RenderJob, RenderRecord, RenderSource, ResourceUse,
            SampleRequest, Shard, in_words,
        },
        drive::{self, End, Plan},
    },
    scene_file::{Document, xml},
};
use proptest::prelude::*;
use rangemap::RangeSet;
use sha2::{Digest as _, Sha256};

use crate::kit::{self, BOX, BUSY_INTEGRATOR, Folder, bits, busy, run};

const CROPPED: &str = r#"<rfilter type="gaussian"/>
    <integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>
    <integer name="crop_width" value="13"/><integer name="crop_height" value="11"/>"#;

/// All kinds of sampling: integrators with their samplers.
const FAMILIES: [(&str, &str); 10] = [
    (BUSY_INTEGRATOR, "independent"),
    (BUSY_INTEGRATOR, "stratified"),
    (BUSY_INTEGRATOR, "ldsampler"),
    (r#"<integrator type="direct"/>"#, "independent"),
    (r#"<integrator type="ptracer"/>"#, "independent"),
    (
        r#"<integrator type="photonmapper"><integer name="global_photons" value="5000"/>
           <integer name="caustic_photons" value="5000"/></integrator>"#,
        "independent",
    ),
    (
        r#"<integrator type="aov"><string name="aovs" value="d:depth,n:sh_normal,c:sample_count"/>
           <integrator type="path"/></integrator>"#,
        "independent",
    ),
    (r#"<integrator type="moment"><integrator type="path"/></integrator>"#, "stratified"),
    (
        r#"<integrator type="sppm"><integer name="photon_count" value="2000"/>
           <string name="radius_schedule" value="per_pass"/></integrator>"#,
        "independent",
    ),
    (CHAINED, "independent"),
];

/// An integrator whose samples depend on the samples before.
const CHAINED: &str = r#"<integrator type="sppm"><integer name="photon_count" value="2000"/></integrator>"#;

fn family((integrator, sampler): (&str, &str), film: &str) -> Folder {
    Folder::with_scene(&busy(sampler, film).replace(BUSY_INTEGRATOR, integrator))
}

/// Runs the program, which must succeed.
fn succeed(folder: &Folder, arguments: &str) {
    let said = run(&mut folder.etendue(arguments));
    assert_eq!(said.code, Some(0), "{arguments}: {}", said.err);
}

fn image(folder: &Folder, name: &str) -> Image {
    exr::read(&folder.path(name)).unwrap()
}

fn number(image: &Image, name: &str) -> f64 {
    image.attribute(&format!("etendue.{name}")).unwrap().parse().unwrap()
}

#[test]
fn a_resumed_render_is_that_without_interruption() {
    for (i, of) in FAMILIES.into_iter().enumerate() {
        for film in [BOX, CROPPED] {
            let folder = family(of, film);
            let whole = folder.render("--spp 7 --threads 1");
            // Takes the first samples alone, then the samples after them, on other numbers of threads.
            let few = 2 + i % 2;
            let first = if of.1 == "independent" { format!("--spp {few}") } else { format!("--spp 7 --shard 1/{few}") };
            succeed(&folder, &format!("render scene.xml {first} --checkpoint a.ck --threads 3"));
            succeed(&folder, "render scene.xml --spp 7 --resume a.ck --threads 2 -o resumed.exr --checkpoint-every 0s");
            let resumed = image(&folder, "resumed.exr");
            assert!(bits(&whole) == bits(&resumed), "{of:?} {film}");
            assert_eq!(resumed.attribute("etendue.spp"), Some("7"));
            // Nothing is left to do, and the number of samples is known.
            succeed(&folder, "render scene.xml --resume a.ck -o again.exr");
            let again = image(&folder, "again.exr");
            assert!(bits(&whole) == bits(&again), "{of:?} {film}");
            for cost in ["seconds", "core_seconds", "peak_bytes"] {
                assert_eq!(again.attribute(&format!("etendue.{cost}")), resumed.attribute(&format!("etendue.{cost}")));
            }
        }
    }
}

#[test]
fn merged_shards_are_one_render() {
    let apart = FAMILIES.into_iter().filter(|(integrator, _)| *integrator != CHAINED);
    for (i, of) in apart.enumerate() {
        let folder = family(of, if i % 2 == 0 { CROPPED } else { BOX });
        let whole = folder.render("--spp 6 --seed 3");
        for shards in [1, 2, 4] {
            let mut costs = [Vec::new(), Vec::new(), Vec::new()];
            for shard in 1..=shards {
                let threads = 1 + shard % 3;
                let options =
                    format!("--shard {shard}/{shards} --checkpoint {shard}.ck -o {shard}.exr --threads {threads}");
                succeed(&folder, &format!("render scene.xml --spp 6 --seed 3 {options}"));
                let part = image(&folder, &format!("{shard}.exr"));
                for (costs, name) in costs.iter_mut().zip(["seconds", "core_seconds", "peak_bytes"]) {
                    costs.push(number(&part, name));
                }
            }
            let mut files: Vec<_> = (1..=shards).map(|shard| format!("{shard}.ck")).collect();
            files.rotate_left(shards / 2);
            succeed(&folder, &format!("merge {} -o merged.exr --checkpoint all.ck --png", files.join(" ")));
            let merged = image(&folder, "merged.exr");
            assert!(bits(&whole) == bits(&merged), "{of:?} in {shards}");
            assert!(folder.path("merged.png").exists());
            for name in ["version", "scene", "scene_sha256", "integrator", "sampler", "parameters", "seed", "spp"] {
                let name = format!("etendue.{name}");
                assert_eq!(merged.attribute(&name), whole.attribute(&name), "{name}");
            }
            // Each number is rounded to a thousandth.
            let rounding = 0.000_5 * (shards as f64 + 1.0) + 1e-9;
            assert!((number(&merged, "seconds") - costs[0].iter().sum::<f64>()).abs() <= rounding);
            assert!((number(&merged, "core_seconds") - costs[1].iter().sum::<f64>()).abs() <= rounding);
            assert_eq!(number(&merged, "peak_bytes"), costs[2].iter().copied().fold(0.0, f64::max));
            // The merged file is a checkpoint like any other.
            succeed(&folder, "merge all.ck -o again.exr");
            assert!(bits(&whole) == bits(&image(&folder, "again.exr")));
        }
    }
}

#[test]
fn what_is_missing_is_named_and_can_be_rendered() {
    let folder = family(FAMILIES[0], BOX);
    let whole = folder.render("--spp 10");
    for shard in [2, 4] {
        succeed(&folder, &format!("render scene.xml --spp 10 --shard {shard}/5 --checkpoint {shard}.ck"));
    }
    let before = folder.files();
    let said = run(&mut folder.etendue("merge 2.ck 4.ck -o some.exr"));
    let expected =
        "samples 0 to 1, 4 to 5, 8 to 9 of 10 are missing; give the checkpoints that have them, or --partial\n";
    assert_eq!((said.code, said.err.as_str()), (Some(2), expected));
    assert_eq!(folder.files(), before);
    succeed(&folder, "merge 2.ck 4.ck -o some.exr --partial --checkpoint some.ck");
    assert_eq!(image(&folder, "some.exr").attribute("etendue.spp"), Some("4"));
    succeed(&folder, "render scene.xml --resume some.ck -o all.exr");
    assert!(bits(&whole) == bits(&image(&folder, "all.exr")));
}

#[test]
fn more_samples_can_follow_where_they_are_independent() {
    let folder = family(FAMILIES[0], BOX);
    let whole = folder.render("--spp 8");
    succeed(&folder, "render scene.xml --spp 3 --checkpoint a.ck");
    succeed(&folder, "render scene.xml --spp 8 --resume a.ck --checkpoint b.ck -o more.exr");
    assert!(bits(&whole) == bits(&image(&folder, "more.exr")));
    succeed(&folder, "render scene.xml --resume a.ck -o few.exr");
    assert!(bits(&folder.render("--spp 3")) == bits(&image(&folder, "few.exr")), "the first checkpoint is as it was");
}

/// A run with faulty options: it must print one line with the fault and change no file.
fn fail(folder: &Folder, arguments: &str, fault: &str) {
    let contents = || folder.files().into_iter().map(|file| (fs::read(&file).unwrap(), file)).collect::<Vec<_>>();
    let before = contents();
    let said = run(&mut folder.etendue(arguments));
    assert_eq!((said.code, said.err.lines().count()), (Some(2), 1), "{arguments}: {}", said.err);
    assert!(said.err.contains(fault) && !said.err.contains("panicked"), "{arguments}: {} lacks {fault}", said.err);
    assert!(contents() == before, "{arguments} changed a file");
}

/// Options of renders that are rejected, with the reason.
const REFUSED: [(&str, &str); 23] = [
    ("--seed 2 --resume a.ck", "a.ck: is of another seed: \"1\" instead of \"2\""),
    ("--seed 1 -D r=2 --resume a.ck", "a.ck: is of another value of the scene's parameters"),
    ("--seed 1 --param max_depth=3 --resume a.ck", "a.ck: is of another integrator: \"path max_depth=4\" instead of"),
    ("--seed 1 --integrator direct --resume a.ck", "a.ck: is of another integrator"),
    ("--seed 1 --sampler stratified --spp 4 --resume a.ck", "a.ck: is of another sampler"),
    (
        "--seed 1 --sampler stratified --spp 8 --resume strata.ck",
        "another number of samples, on which its sampler depends",
    ),
    ("--seed 1 --spp 3 --resume a.ck", "a.ck: has samples 0 to 3, but only samples 0 to 2 are requested"),
    ("--seed 1 --spp 4 --shard 1/2 --resume half.ck", "half.ck: has samples 2 to 3, but only samples 0 to 1"),
    ("--seed 1 --resume none.ck", "none.ck: No such file"),
    ("--seed 1 --resume folder", "folder: is a folder"),
    ("--seed 1 --resume scene.xml", "scene.xml: is not a checkpoint of etendue"),
    ("--seed 1 --checkpoint scene.xml", "scene.xml: is not a checkpoint"),
    ("--seed 1 --checkpoint folder", "folder: is a folder"),
    ("--seed 1 --checkpoint folder/none/a.ck", "folder/none/a.ck: cannot be written"),
    ("--seed 1 --checkpoint image.exr", "image.exr: is named twice"),
    ("--sampler sobol", "--sampler sobol: no sampler is called \"sobol\""),
    ("--spp 4 --shard 1/2", "--shard: etendue merge needs a checkpoint of each part, not an image"),
    ("--spp 4 --shard 3/8", "--shard: 4 samples cannot be divided into 8 parts"),
    ("--shard 1/2 --time-limit 1s", "the number of samples is not known; give --spp"),
    (
        "--sampler ldsampler --time-limit 1s",
        "ldsampler depend on their number, which is not known; give --spp too, or --sampler independent",
    ),
    ("--integrator photonmapper --target-error 1%", "share one set of photons"),
    ("--integrator sppm --spp 4 --shard 1/2", "each sample of the integrator sppm depends on those before"),
    ("--integrator sppm --seed 1 --resume a.ck", "a.ck: is of another integrator"),
];

#[test]
fn checkpoints_of_other_renders_are_refused() {
    let folder = Folder::with_scene(&kit::scene(
        r#"<default name="r" value="1"/><shape type="sphere"><float name="radius" value="$r"/></shape>"#,
    ));
    succeed(&folder, "render scene.xml --spp 4 --seed 1 --checkpoint a.ck");
    succeed(&folder, "render scene.xml --spp 4 --seed 1 --sampler stratified --checkpoint strata.ck");
    succeed(&folder, "render scene.xml --spp 4 --seed 1 --shard 2/2 --checkpoint half.ck");
    folder.write("folder/file", "");
    for (options, fault) in REFUSED {
        fail(&folder, &format!("render scene.xml -o image.exr {options}"), fault);
    }
    let text = fs::read_to_string(folder.path("scene.xml")).unwrap();
    folder.write("scene.xml", text.replace("0.5, 0.7", "0.5, 0.8"));
    fail(&folder, "render scene.xml -o image.exr --seed 1 --resume a.ck", "a.ck: is of another scene");
    fail(&folder, "merge a.ck a.ck -o image.exr", "a.ck: has samples that were already added: samples 0 to 3");
    fail(&folder, "merge a.ck half.ck -o image.exr", "half.ck: has samples that were already added: samples 2 to 3");
    fail(&folder, "merge half.ck strata.ck -o image.exr", "strata.ck: is of another sampler");
    fail(&folder, "merge a.ck none.ck -o image.exr", "none.ck: No such file");
    fail(&folder, "merge a.ck -o image.png", "images are OpenEXR files");
    fail(&folder, "merge a.ck -o a.exr --png --layer direct", "no such layer");
    fail(&folder, "merge a.ck -o a.exr --checkpoint folder", "folder: is a folder");
    succeed(&folder, "merge a.ck -o image.exr");
}

#[test]
fn damaged_checkpoints_are_refused() {
    let folder = Folder::with_scene(&kit::ball());
    succeed(&folder, "render scene.xml --spp 2 --checkpoint good.ck");
    let good = fs::read(folder.path("good.ck")).unwrap();
    let mut changed = good.clone();
    changed[good.len() / 2] ^= 4;
    let cases: [(&[u8], &str); 9] = [
        (&[], "is empty"),
        (b"etendue", "ends after 7 bytes"),
        (b"something else altogether", "is not a checkpoint of etendue"),
        (&good[..30], "ends after 30 bytes"),
        (&good[..200], &format!("ends after 200 of {} bytes", good.len())),
        (&good[..good.len() - 1], &format!("ends after {} of {} bytes", good.len() - 1, good.len())),
        (&[&good[..], b"x"].concat(), &format!("continues after its {} bytes", good.len())),
        (&changed, "is damaged: its SHA-256 is not right"),
        (&[b"etendue checkpoint 2", &good[20..]].concat(), "is a checkpoint of format 2; this program reads format 1"),
    ];
    for (bytes, fault) in cases {
        folder.write("bad.ck", bytes);
        fail(&folder, "render scene.xml --spp 4 --resume bad.ck -o image.exr", &format!("bad.ck: {fault}"));
        fail(&folder, "merge good.ck bad.ck -o image.exr", &format!("bad.ck: {fault}"));
    }
}

/// A render of a tiny film without the command line.
struct Tiny {
    folder: Folder,
    document: Document,
    renderer: Renderer,
    overrides: Overrides,
    identity: Identity,
}

const TINY: &str = r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="3"/>
    <integer name="height" value="2"/></film></sensor>"#;

impl Tiny {
    fn new(integrator: &str) -> Self {
        let wall = r#"<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/><translate z="3"/></transform></shape>"#;
        let folder = Folder::with_scene(&kit::scene_of(&[integrator, TINY, kit::SKY, wall]));
        let document = xml::read(&folder.path("scene.xml"), &[]).unwrap();
        let renderer = Renderer::new(&document, &Overrides::default()).unwrap();
        let overrides = Overrides::default();
        let source = RenderSource { renderer: &renderer, document: &document, definitions: &[], overrides: &overrides };
        let identity = Identity::new(&source, PASS).unwrap();
        Self { folder, document, renderer, overrides, identity }
    }

    /// The job of a render without the command line.
    fn job(&self, request: SampleRequest, resumed: Option<Checkpoint>) -> Result<RenderJob, JobError> {
        let Self { document, renderer, overrides, .. } = self;
        RenderJob::new(&RenderSource { renderer, document, definitions: &[], overrides }, &request, resumed)
    }

    /// The checkpoint after running a job.
    fn run(&self, request: SampleRequest, resumed: Option<Checkpoint>) -> Checkpoint {
        let interrupted = AtomicBool::new(false);
        let controls = Controls { start: Instant::now(), interrupted: &interrupted, checkpoint_every: Duration::MAX };
        let job = self.job(request, resumed).unwrap();
        let result = job.run(&self.renderer, &controls, &|_| {}, &mut |_, _| {});
        assert_eq!(result.end, End::Complete);
        result.checkpoint
    }

    /// The checkpoint of some samples, after writing and reading it.
    fn kept(&self, ranges: Vec<Range<u32>>) -> Checkpoint {
        let (mut rendering, mut taken) = (self.renderer.begin(PASS), RangeSet::new());
        let (interrupted, start, every) = (AtomicBool::new(false), Instant::now(), Duration::ZERO);
        let plan = Plan { ranges, start, time: None, target_error: None, interrupted: &interrupted, every };
        assert_eq!(drive::drive(&mut rendering, &mut taken, &plan, &|_| {}, &mut |_, _| {}), End::Complete);
        let record = RenderRecord {
            identity: self.identity.clone(),
            attributes: vec![("etendue.scene".into(), "scène".into())],
            goal: Some(PASS.samples),
            taken,
            cost: ResourceUse { seconds: 0.1, core_seconds: 0.2, peak_bytes: 3 },
        };
        let file = self.folder.path("tiny.ck");
        record.write(&file, rendering.film(), rendering.state()).unwrap();
        let read = Checkpoint::read(&file).unwrap();
        assert_eq!(read.record, record);
        read
    }

    /// The error of reading these bytes as a checkpoint.
    fn fault(&self, bytes: &[u8]) -> String {
        self.folder.write("bad.ck", bytes);
        Checkpoint::read(&self.folder.path("bad.ck")).map(|_| ()).expect_err("it is bad").to_string()
    }
}

const PASS: Replicate = Replicate { seed: 5, number: 0, samples: 24 };

/// A request for samples of each pixel, always with the same seed.
fn samples(spp: u32) -> SampleRequest {
    SampleRequest { seed: Some(5), spp: Some(spp), ..SampleRequest::default() }
}

#[test]
fn the_library_resumes_renders_as_the_command_line_does() {
    for integrator in [kit::INTEGRATOR, CHAINED] {
        let tiny = Tiny::new(integrator);
        let (some, whole) = (tiny.run(samples(4), None), tiny.run(samples(9), None));
        let resumed = tiny.run(samples(9), Some(some));
        assert!(bits(&whole.film.image()) == bits(&resumed.film.image()), "{integrator}");
        assert_eq!((whole.record.check_complete(), resumed.record), (Ok(()), whole.record));
    }
}

#[test]
fn the_library_refuses_what_cannot_go_on() {
    let tiny = Tiny::new(kit::INTEGRATOR);
    let some = || tiny.run(samples(4), None);
    let fault = |tiny: &Tiny, request, resumed| tiny.job(request, resumed).map(drop).expect_err("it cannot go on");
    let other_seed = SampleRequest { seed: Some(6), ..samples(8) };
    assert_eq!(
        fault(&tiny, other_seed, Some(some())),
        JobError::OtherRender("another seed: \"5\" instead of \"6\"".into())
    );
    assert!(matches!(fault(&tiny, samples(3), Some(some())), JobError::OtherSamples { .. }));
    let half = SampleRequest { shard: Shard::new(2, 2), ..samples(8) };
    assert!(matches!(fault(&tiny, half, Some(some())), JobError::OtherSamples { .. }));
    let ranges = tiny.job(samples(8), Some(some())).unwrap().ranges;
    assert_eq!(in_words(&ranges), "samples 4 to 7", "the cases above can succeed");
    let too_many = SampleRequest { shard: Shard::new(1, 9), ..samples(8) };
    assert_eq!(fault(&tiny, too_many, None), JobError::TooManyParts { samples: 8, parts: 9 });
    let unknown = SampleRequest { spp: None, time_limit: Some(Duration::ZERO), ..half };
    assert_eq!(fault(&tiny, unknown, None), JobError::UnknownGoal);
    assert_eq!(some().add(some()), Err(MergeError::Overlap("samples 0 to 3".into())));
    assert_eq!(
        tiny.run(half, None).record.check_complete().unwrap_err().to_string(),
        "samples 0 to 3 of 8 are missing"
    );

    let chained = Tiny::new(CHAINED);
    assert_eq!(fault(&chained, half, None), JobError::DependentSamples { integrator: "sppm" });
    let without_state = Checkpoint { state: IntegratorState::Empty, ..chained.run(samples(4), None) };
    assert_eq!(fault(&chained, samples(8), Some(without_state)), JobError::MissingState);
    let mapped = Tiny::new(r#"<integrator type="photonmapper"/>"#);
    let exact = SampleRequest { target_error: Some(0.1), ..samples(8) };
    assert_eq!(fault(&mapped, exact, None), JobError::NoErrorEstimate { integrator: "photonmapper" });
}

#[test]
fn no_byte_can_be_missing_or_wrong() {
    let tiny = Tiny::new(kit::INTEGRATOR);
    tiny.kept(vec![2..4, 4..5]);
    let good = fs::read(tiny.folder.path("tiny.ck")).unwrap();
    for length in 0..good.len() {
        tiny.fault(&good[..length]);
    }
    for at in 0..good.len() {
        let mut changed = good.clone();
        changed[at] ^= 1 << (at % 8);
        tiny.fault(&changed);
    }
}

/// The length of the first line in bytes.
const FIRST: usize = 49;

/// A checkpoint with a changed header, and the right length and hash.
fn forged(good: &[u8], from: &str, to: &str) -> Vec<u8> {
    let header = String::from_utf8_lossy(good).lines().nth(1).unwrap().to_owned() + "\n";
    let json = FIRST + header.len();
    assert!(header.contains(from), "{header}");
    let body = [header.replace(from, to).as_bytes(), &good[json..good.len() - 32]].concat();
    let first = format!("etendue checkpoint 1, {:020} bytes\n", FIRST + body.len() + 32);
    let all = [first.as_bytes(), &body].concat();
    let hash = Sha256::digest(&all);
    [&all[..], &hash[..]].concat()
}

#[test]
fn headers_are_believed_only_as_far_as_the_file_goes() {
    let tiny = Tiny::new(kit::INTEGRATOR);
    tiny.kept(vec![2..4, 4..5]);
    let good = fs::read(tiny.folder.path("tiny.ck")).unwrap();
    let cases = [
        (r#""width":3"#, r#""width":4294967295"#),
        (r#""width":3"#, r#""width":0"#),
        (r#""pixel_radii":0"#, r#""pixel_radii":18446744073709551615"#),
        (r#""pixel_radii":0"#, r#""pixel_radii":1"#),
        (r#""has_splats":false"#, r#""has_splats":true"#),
        (r#""taken":[[2,5]]"#, r#""taken":[[2,6]]"#),
        (r#""taken":[[2,5]]"#, r#""taken":[[5,2]]"#),
        (r#""taken":[[2,5]]"#, r#""taken":[[2,2]]"#),
        (r#""name":"","#, r#""name":"x","#),
        (r#"["R","G","B"]"#, r#"["R","G"]"#),
        (r#"{"record""#, r#"{"recrd""#),
    ];
    for (from, to) in cases {
        let fault = tiny.fault(&forged(&good, from, to));
        assert!(fault.contains("its header is wrong"), "{to}: {fault}");
    }
    let other = forged(&good, &tiny.identity.version, "0.0.1");
    tiny.folder.write("other.ck", other);
    let other = Checkpoint::read(&tiny.folder.path("other.ck")).unwrap();
    let difference = tiny.identity.difference(&other.record.identity).unwrap();
    assert!(difference.starts_with("another version of this program: \"0.0.1\""), "{difference}");
}

/// Samples cut at random points, divided among shards, and an order to merge the shards in.
fn parts() -> impl Strategy<Value = Vec<Vec<Range<u32>>>> {
    let cuts = prop::collection::btree_set(1..PASS.samples, 0..8);
    let dealt = prop::collection::vec(0..4_usize, 9);
    (cuts, dealt, Just(vec![0, 1, 2, 3]).prop_shuffle()).prop_map(|(cuts, dealt, order)| {
        let edges: Vec<u32> = [0].into_iter().chain(cuts).chain([PASS.samples]).collect();
        let mut shards = vec![Vec::new(); 4];
        for (pair, shard) in edges.windows(2).zip(dealt) {
            shards[shard].push(pair[0]..pair[1]);
        }
        order.into_iter().map(|shard: usize| shards[shard].clone()).collect()
    })
}

#[test]
fn any_partition_merges_to_the_whole() {
    for integrator in [kit::INTEGRATOR, r#"<integrator type="ptracer"/>"#] {
        let tiny = Tiny::new(integrator);
        let whole = tiny.renderer.render(PASS, &|_| {}).image();
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let check = |parts: Vec<Vec<Range<u32>>>| {
            let mut shards = parts.into_iter().map(|ranges| tiny.kept(ranges));
            let mut merged = shards.next().unwrap();
            for shard in shards {
                prop_assert_eq!(merged.add(shard), Ok(()));
            }
            prop_assert!(merged.record.missing().is_empty(), "{}", in_words(&merged.record.missing()));
            prop_assert!(bits(&merged.film.image()) == bits(&whole));
            Ok(())
        };
        runner.run(&parts(), check).unwrap();
    }
}
