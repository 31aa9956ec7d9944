use std::{io::IsTerminal as _, path::PathBuf, process::ExitCode, time::Instant};

use clap::Args;
use etendue::{
    film::{Film, splats},
    integrator::{IntegratorModel as _, IntegratorState, IterationPlan},
    render::{
        Renderer, Rendering, Replicate,
        checkpoint::{Checkpoint, RenderRecord, ResourceUse, in_words},
        drive::{self, End, Plan},
    },
    sampler::SamplerModel as _,
    scene_file::Document,
};
use indicatif::{ProgressBar, ProgressStyle};
use rangemap::RangeSet;

use super::{
    checkpoint_options::{CheckpointOptions, INTERRUPTED, interruptions},
    outputs::{Outputs, Picture},
    say,
    source::SceneOptions,
    usage,
};

/// Renders a scene into an OpenEXR file.
///
/// The file has R, G and B as 32-bit floats, the layers that the integrator makes, the variance of the mean as
/// variance.R, .G and .B, and says in its header how it was made.
///
/// Ctrl-C ends a render early: what there is, is written, with exit code 130. A second Ctrl-C ends it at once.
#[derive(Debug, Args)]
pub(crate) struct Render {
    #[command(flatten)]
    source: SceneOptions,
    /// Replace the scene's integrator, keeping what parameters both have, such as max_depth and rr_depth.
    #[arg(long, value_name = "NAME")]
    integrator: Option<String>,
    /// Samples per pixel, which are passes of integrators that work in passes [default: the scene's sample_count].
    #[arg(long, visible_alias = "passes", value_name = "N", allow_negative_numbers = true)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// The image to write.
    #[arg(short, long, value_name = "OUT.exr", required_unless_present_any = ["replay", "checkpoint", "resume"])]
    output: Option<PathBuf>,
    #[command(flatten)]
    picture: Picture,
    /// Print one sample of one pixel instead of rendering: its column and row in the image, and its number, from 0.
    #[arg(long, value_name = "X,Y,SAMPLE", allow_hyphen_values = true, value_parser = address)]
    replay: Option<[u32; 3]>,
    #[command(flatten)]
    checkpoint_options: CheckpointOptions,
}

fn address(text: &str) -> Result<[u32; 3], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| "write three whole numbers like 3,4,0".into())
}

impl Render {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let document = self.source.read()?;
        let renderer = self.source.renderer(&document, self.integrator.clone())?;
        if let Some(at) = self.replay {
            let samples = self.spp.unwrap_or(renderer.samples());
            return replay(&renderer, self.replicate(&renderer, samples), at);
        }
        self.checkpoint_options.check(&renderer)?;
        let work = self.work(&document, &renderer)?;
        let outputs = self.output.as_deref().map(|exr| self.picture.beside(exr, &work.film)).transpose()?;
        self.checkpoint_options.check_file()?;
        if let (Some(outputs), Some(file)) = (&outputs, self.checkpoint_options.file()) {
            outputs.are_not(file)?;
        }
        self.finish(&renderer, work, outputs.as_ref())
    }

    fn replicate(&self, renderer: &Renderer, samples: u32) -> Replicate {
        Replicate { seed: self.source.seed(&renderer.scene), number: 0, samples }
    }

    /// What is there and what there is to do.
    fn work(&self, document: &Document, renderer: &Renderer) -> anyhow::Result<Work> {
        let sampler = &renderer.scene.sensor.sampler;
        let resumed = self.checkpoint_options.resumed()?;
        let goal =
            self.checkpoint_options.goal(self.spp, resumed.as_ref(), sampler.is_open_ended(), renderer.samples())?;
        let replicate = self.replicate(renderer, goal.unwrap_or(u32::MAX));
        let identity = self.source.identity(document, self.integrator.clone(), renderer, replicate)?;
        let range = self.checkpoint_options.range(goal)?;
        let attributes = self.source.attributes(&identity, renderer);
        let empty = RenderRecord { identity, attributes, goal, taken: RangeSet::new(), cost: ResourceUse::default() };
        let checkpoint = match resumed {
            Some(resumed) => self.continued(resumed, empty, &range, renderer)?,
            None => Checkpoint { record: empty, film: renderer.film(), state: IntegratorState::Empty },
        };
        let ranges = checkpoint.record.taken.gaps(&range).collect();
        let Checkpoint { record, film, state } = checkpoint;
        Ok(Work { replicate, record, film, state, ranges })
    }

    /// The checkpoint with what is told of this run, if it is of the same render and of no samples but those of the range.
    fn continued(
        &self,
        resumed: Checkpoint,
        empty: RenderRecord,
        range: &std::ops::Range<u32>,
        renderer: &Renderer,
    ) -> anyhow::Result<Checkpoint> {
        let file = self.checkpoint_options.resume.as_deref().expect("it was read").display();
        if let Some(difference) = empty.identity.difference(&resumed.record.identity) {
            anyhow::bail!("{file}: is of {difference}");
        }
        let RenderRecord { taken, cost, .. } = resumed.record;
        let is_within = taken.iter().all(|part| range.start <= part.start && part.end <= range.end);
        let there: Vec<_> = taken.iter().cloned().collect();
        anyhow::ensure!(
            is_within,
            "{file}: has {}, of which not all are among those that are asked for, {}",
            in_words(&there),
            in_words(std::slice::from_ref(range))
        );
        let is_chained = renderer.integrator.iterations() == IterationPlan::Chained;
        let is_prefix = there.len() <= 1 && there.iter().all(|part| part.start == 0);
        let follows = !is_chained || is_prefix && there.is_empty() == (resumed.state == IntegratorState::Empty);
        anyhow::ensure!(follows, "{file}: has not what the next sample follows from");
        Ok(Checkpoint { record: RenderRecord { taken, cost, ..empty }, ..resumed })
    }

    /// Renders, and writes what there is to write.
    fn finish(&self, renderer: &Renderer, mut work: Work, outputs: Option<&Outputs<'_>>) -> anyhow::Result<ExitCode> {
        let pool = self.source.threads()?;
        let interrupted = interruptions()?;
        let plan = Plan {
            ranges: std::mem::take(&mut work.ranges),
            start: Instant::now(),
            time: self.checkpoint_options.time,
            target_error: self.checkpoint_options.target_error,
            interrupted: &interrupted,
            every: self.checkpoint_options.every,
        };
        let (end, record, film, state) = pool.install(|| self.gather(renderer, work, &plan));
        tell(end, &record);
        let kept = self.checkpoint_options.file().map(|file| record.write(file, &film, &state)).transpose();
        if let Some(outputs) = outputs {
            let mut image = film.image();
            image.attributes = record.header();
            outputs.write(&image)?;
        }
        kept?;
        Ok(if end == End::Interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
    }

    /// Renders with a progress bar, which is silent when nobody watches.
    fn gather(&self, renderer: &Renderer, work: Work, plan: &Plan<'_>) -> (End, RenderRecord, Film, IntegratorState) {
        let Work { replicate, mut record, film, state, .. } = work;
        let Some(first) = plan.ranges.first() else { return (End::Complete, record, film, state) };
        let bar = progress_bar(renderer, plan, record.goal);
        let cost = record.cost;
        let mut taken = std::mem::take(&mut record.taken);
        let mut rendering = renderer.resume(replicate, first.start, film, state);
        let now = |taken: &RangeSet<u32>| {
            let (taken, cost) = (taken.clone(), cost.and(usage::since(plan.start)));
            RenderRecord { taken, cost, ..record.clone() }
        };
        let mut keep = |rendering: &Rendering<'_>, taken: &RangeSet<u32>| {
            let Some(file) = self.checkpoint_options.file() else { return };
            // A disk that is full now may have room at the end.
            if let Err(error) = now(taken).write(file, rendering.film(), rendering.state()) {
                bar.suspend(|| super::warn(&[error.to_string()]));
            }
        };
        let end = drive::drive(&mut rendering, &mut taken, plan, &|samples| bar.inc(samples), &mut keep);
        bar.finish_and_clear();
        let notes = rendering.notes();
        notes.facts.iter().for_each(|fact| eprintln!("{fact}"));
        super::warn(&notes.warnings);
        let state = rendering.state().clone();
        (end, now(&taken), rendering.into_film(), state)
    }
}

/// A render between what is there and what there is to do.
struct Work {
    replicate: Replicate,
    record: RenderRecord,
    film: Film,
    state: IntegratorState,
    /// The samples to take.
    ranges: Vec<std::ops::Range<u32>>,
}

fn progress_bar(renderer: &Renderer, plan: &Plan<'_>, goal: Option<u32>) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let crop = renderer.scene.sensor.film.rendered();
    let samples: u64 = plan.ranges.iter().map(|range| u64::from(range.end - range.start)).sum();
    let total = u64::from(crop.width) * u64::from(crop.height) * samples;
    let (bar, template) = match goal {
        Some(_) => (ProgressBar::new(total), "{wide_bar} {percent}% {per_sec} samples, {eta} left"),
        None => (ProgressBar::no_length(), "{elapsed} {human_pos} samples, {per_sec}"),
    };
    bar.with_style(ProgressStyle::with_template(template).expect("the template is right"))
}

/// Why there are not all samples.
fn tell(end: End, record: &RenderRecord) {
    let why = match end {
        End::Complete => return,
        End::Time => "the time is up",
        End::Error => "the error is small enough",
        End::Interrupted => "interrupted",
    };
    eprintln!("{why} with {} samples of each pixel", drive::count(&record.taken));
}

fn replay(renderer: &Renderer, replicate: Replicate, [x, y, sample]: [u32; 3]) -> anyhow::Result<ExitCode> {
    let crop = renderer.scene.sensor.film.rendered();
    anyhow::ensure!(
        x < crop.width && y < crop.height,
        "pixel {x},{y} is outside of the {} x {} film",
        crop.width,
        crop.height
    );
    anyhow::ensure!(sample < replicate.samples, "sample {sample} is not among the {} of a pixel", replicate.samples);
    let mut values = vec![0.0; renderer.film().stride()];
    let mut path = splats::Path::default();
    let mut rendering = renderer.begin(replicate);
    super::warn(&rendering.notes().warnings);
    let radiance = rendering.sample((x, y), sample, &mut values, &mut path);
    say(format_args!("{:?} {:?} {:?}", radiance.x, radiance.y, radiance.z))?;
    for ((x, y), value) in path.pixels() {
        say(format_args!("splat {x},{y}: {:?} {:?} {:?}", value.x, value.y, value.z))?;
    }
    Ok(ExitCode::SUCCESS)
}
