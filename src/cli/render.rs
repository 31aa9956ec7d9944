use std::{io::IsTerminal as _, path::PathBuf, process::ExitCode, time::Instant};

use clap::Args;
use etendue::{
    film::splats,
    render::{
        Renderer, Rendering, Replicate,
        checkpoint::{Checkpoint, Controls, JobError, JobResult, RenderJob, RenderRecord, RenderSource},
        drive::{self, End},
    },
    sampler::SamplerModel as _,
};
use indicatif::{ProgressBar, ProgressStyle};

use super::{
    checkpoint_options::{CheckpointOptions, INTERRUPTED, interruptions},
    faults, numbers,
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
    #[arg(value_parser = numbers::samples)]
    spp: Option<u32>,
    /// The image to write.
    #[arg(short, long, value_name = "OUT.exr", required_unless_present_any = ["replay", "checkpoint", "resume"])]
    output: Option<PathBuf>,
    #[command(flatten)]
    picture: Picture,
    /// Print one sample of one pixel instead of rendering: its column and row in the image, and its number, from 0.
    #[arg(long, value_name = "X,Y,SAMPLE", allow_hyphen_values = true, value_parser = numbers::address)]
    replay: Option<[u32; 3]>,
    #[command(flatten)]
    checkpoint_options: CheckpointOptions,
}

impl Render {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        // Meshes are made ready by several threads too.
        self.source.threads()?.install(|| self.render())
    }

    fn render(&self) -> anyhow::Result<ExitCode> {
        let document = self.source.read()?;
        let overrides = self.source.overrides(self.integrator.clone());
        let renderer = self.source.renderer(&document, &overrides)?;
        if let Some(at) = self.replay {
            return self.replay(&renderer, at);
        }
        let source = self.source.source(&document, &overrides, &renderer);
        let job = self.job(&source)?;
        let outputs = self.output.as_deref().map(|exr| self.picture.beside(exr, &job.checkpoint.film)).transpose()?;
        self.checkpoint_options.check_file()?;
        if let (Some(outputs), Some(file)) = (&outputs, self.checkpoint_options.file()) {
            outputs.are_not(file)?;
        }
        self.finish(&renderer, job, outputs.as_ref())
    }

    /// What there is and what there is to do.
    fn job(&self, source: &RenderSource<'_>) -> anyhow::Result<RenderJob> {
        let request = self.checkpoint_options.request(self.source.seed(), self.spp);
        let resumed = self.checkpoint_options.resume.as_deref();
        let explained = |error: &JobError| faults::of_job(error, resumed);
        // Checked before a checkpoint is read, which may take long.
        request.check(source.renderer).map_err(|error| explained(&error))?;
        let mut job =
            RenderJob::new(source, &request, self.checkpoint_options.resumed()?).map_err(|error| explained(&error))?;
        let record = &mut job.checkpoint.record;
        record.attributes = self.source.attributes(&record.identity, source.renderer);
        Ok(job)
    }

    /// Renders, and writes what there is to write.
    fn finish(&self, renderer: &Renderer, job: RenderJob, outputs: Option<&Outputs<'_>>) -> anyhow::Result<ExitCode> {
        let interrupted = interruptions()?;
        let checkpoint_every = self.checkpoint_options.checkpoint_every;
        let controls = Controls { start: Instant::now(), interrupted: &interrupted, checkpoint_every };
        let (end, Checkpoint { record, film, state }) = self.gather(renderer, job, &controls);
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
    fn gather(&self, renderer: &Renderer, job: RenderJob, controls: &Controls<'_>) -> (End, Checkpoint) {
        let (bar, is_to_do) = (progress_bar(renderer, &job), !job.ranges.is_empty());
        let with_cost = |record: &RenderRecord| {
            let cost = if is_to_do { record.cost.and(usage::since(controls.start)) } else { record.cost };
            RenderRecord { cost, ..record.clone() }
        };
        let mut keep = |record: &RenderRecord, rendering: &Rendering<'_>| {
            let Some(file) = self.checkpoint_options.file() else { return };
            // A disk that is full now may have room at the end.
            if let Err(error) = with_cost(record).write(file, rendering.film(), rendering.state()) {
                bar.suspend(|| super::warn(&[error.to_string()]));
            }
        };
        let JobResult { end, checkpoint, notes } = job.run(renderer, controls, &|samples| bar.inc(samples), &mut keep);
        bar.finish_and_clear();
        notes.facts.iter().for_each(|fact| eprintln!("{fact}"));
        super::warn(&notes.warnings);
        (end, Checkpoint { record: with_cost(&checkpoint.record), ..checkpoint })
    }

    /// Prints one sample of a pixel.
    fn replay(&self, renderer: &Renderer, [x, y, sample]: [u32; 3]) -> anyhow::Result<ExitCode> {
        let crop = renderer.scene.sensor.film.rendered();
        anyhow::ensure!(
            x < crop.width && y < crop.height,
            "pixel {x},{y} is outside of the {} x {} film",
            crop.width,
            crop.height
        );
        let samples = self.spp.unwrap_or(renderer.samples());
        anyhow::ensure!(sample < samples, "sample {sample} is not among the {samples} of a pixel");
        let seed = self.source.seed().unwrap_or_else(|| renderer.scene.sensor.sampler.seed());
        let mut values = vec![0.0; renderer.film().stride()];
        let mut path = splats::Path::default();
        let mut rendering = renderer.begin(Replicate { seed, number: 0, samples });
        super::warn(&rendering.notes().warnings);
        let radiance = rendering.sample((x, y), sample, &mut values, &mut path);
        say(format_args!("{:?} {:?} {:?}", radiance.x, radiance.y, radiance.z))?;
        for ((x, y), value) in path.pixels() {
            say(format_args!("splat {x},{y}: {:?} {:?} {:?}", value.x, value.y, value.z))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn progress_bar(renderer: &Renderer, job: &RenderJob) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let crop = renderer.scene.sensor.film.rendered();
    let samples: u64 = job.ranges.iter().map(|range| u64::from(range.end - range.start)).sum();
    let total = u64::from(crop.width) * u64::from(crop.height) * samples;
    let (bar, template) = match job.checkpoint.record.goal {
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
