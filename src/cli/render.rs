use std::{
    path::PathBuf,
    process::ExitCode,
    sync::atomic::AtomicBool,
    time::{Duration, Instant},
};

use clap::Args;
use etendue::{
    film::{Film, splats},
    integrator::{IntegratorModel as _, IterationPlan},
    render::{
        Renderer, Rendering, Replicate,
        checkpoint::{Checkpoint, Controls, JobError, JobResult, RenderJob, RenderRecord, RenderSource},
        drive::{self, End},
        reach::{MAX_OPEN_SAMPLES, samples_needed},
    },
    sampler::SamplerModel as _,
};

use super::{
    FAILED,
    checkpoint_options::{CheckpointOptions, INTERRUPTED, interruptions},
    faults, numbers,
    outputs::{Outputs, Picture},
    progress::{self, Progress},
    say,
    source::SceneOptions,
    usage,
};

/// Renders a scene into an OpenEXR file.
///
/// The file has R, G and B as 32-bit floats, the layers of the integrator, and the variance of each pixel's mean as
/// variance.R, .G and .B. Its header records how it was made.
///
/// Ctrl-C ends a render early, writes the image and the checkpoint, and exits with 130. A second Ctrl-C ends it at
/// once.
#[derive(Debug, Args)]
pub(crate) struct Render {
    #[command(flatten)]
    source: SceneOptions,
    /// Replace the scene's integrator; parameters that both have, such as max_depth and rr_depth, stay
    #[arg(long, value_name = "NAME")]
    integrator: Option<String>,
    /// Samples per pixel; passes of sppm [default: the scene's sample_count]
    #[arg(long, visible_alias = "passes", value_name = "N", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::samples)]
    spp: Option<u32>,
    /// The image to write
    #[arg(short, long, value_name = "OUT.exr", required_unless_present_any = ["replay", "checkpoint", "resume"])]
    output: Option<PathBuf>,
    #[command(flatten)]
    picture: Picture,
    /// Print one sample of one pixel instead of rendering: column, row and number, all from 0
    #[arg(long, value_name = "X,Y,SAMPLE", allow_hyphen_values = true, value_parser = numbers::address)]
    replay: Option<[u32; 3]>,
    #[command(flatten)]
    checkpoint_options: CheckpointOptions,
    /// Show no progress and no summary; warnings are still shown.
    #[arg(short, long)]
    quiet: bool,
}

impl Render {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        // Meshes are also prepared by several threads.
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
        self.checkpoint_options.check_shard()?;
        self.checkpoint_options.check_file()?;
        if let (Some(outputs), Some(file)) = (&outputs, self.checkpoint_options.file()) {
            outputs.are_not(file)?;
        }
        self.finish(&renderer, job, outputs.as_ref())
    }

    /// The existing samples and the samples to take.
    fn job(&self, source: &RenderSource<'_>) -> anyhow::Result<RenderJob> {
        let request = self.checkpoint_options.request(self.source.seed(), self.spp);
        let resumed = self.checkpoint_options.resume.as_deref();
        let explained = |error: &JobError| faults::of_job(error, resumed);
        // This check comes before the checkpoint is read, which may take long.
        request.check(source.renderer).map_err(|error| explained(&error))?;
        let mut job =
            RenderJob::new(source, &request, self.checkpoint_options.resumed()?).map_err(|error| explained(&error))?;
        let record = &mut job.checkpoint.record;
        record.attributes = self.source.attributes(&record.identity, source);
        Ok(job)
    }

    /// Renders, and writes the image and the checkpoint.
    fn finish(&self, renderer: &Renderer, job: RenderJob, outputs: Option<&Outputs<'_>>) -> anyhow::Result<ExitCode> {
        let interrupted = interruptions()?;
        let (end, Checkpoint { record, film, state }) = self.gather(renderer, job, &interrupted);
        let checkpoint = self.checkpoint_options.file();
        let kept = checkpoint.map(|file| record.write(file, &film, &state)).transpose();
        let mut picture = None;
        if let Some(outputs) = outputs {
            let mut image = film.image();
            image.attributes = record.header();
            picture = outputs.write(&mut image)?;
        }
        kept?;
        let (samples, error) = (drive::count(&record.taken), relative_error(renderer, &film));
        if !self.quiet {
            if let Some(why) = self.why(end, samples, error) {
                eprintln!("{why}");
            }
            let file = self.output.as_deref().or(checkpoint).expect("clap asks for one");
            let picture = picture.map_or(String::new(), |picture| format!("; {picture}"));
            say(progress::summary(file, samples, record.cost.seconds, error) + &picture)?;
        }
        Ok(match end {
            End::Interrupted => ExitCode::from(INTERRUPTED),
            End::OutOfReach => ExitCode::from(FAILED),
            End::Complete | End::Time | End::Error => ExitCode::SUCCESS,
        })
    }

    /// Renders, shows the progress, and writes checkpoints.
    fn gather(&self, renderer: &Renderer, job: RenderJob, interrupted: &AtomicBool) -> (End, Checkpoint) {
        let (start, options) = (Instant::now(), &self.checkpoint_options);
        let progress = Progress::new(renderer, &job, options, self.quiet);
        let is_to_do = !job.ranges.is_empty();
        let with_cost = |record: &RenderRecord| {
            let cost = if is_to_do { record.cost.and(usage::since(start)) } else { record.cost };
            RenderRecord { cost, ..record.clone() }
        };
        let mut last = start;
        let mut keep = |record: &RenderRecord, rendering: &Rendering<'_>| {
            if progress.is_shown() {
                progress.set_error(relative_error(renderer, rendering.film()));
            }
            let Some(file) = options.file().filter(|_| last.elapsed() >= options.checkpoint_every) else { return };
            // The disk may have space again at the end, so a failure here is a warning.
            if let Err(error) = with_cost(record).write(file, rendering.film(), rendering.state()) {
                progress.warn(error.to_string());
            }
            last = Instant::now();
        };
        let every = if progress.is_shown() { Progress::EVERY } else { Duration::MAX };
        let controls = Controls { start, interrupted, checkpoint_every: options.checkpoint_every.min(every) };
        let JobResult { end, checkpoint, notes } =
            job.run(renderer, &controls, &|samples| progress.add(samples), &mut keep);
        progress.finish();
        if !self.quiet {
            notes.facts.iter().for_each(|fact| eprintln!("{fact}"));
        }
        super::warn(&notes.warnings);
        (end, Checkpoint { record: with_cost(&checkpoint.record), ..checkpoint })
    }

    /// Why the render ended with fewer samples than requested; None if it has all of them.
    fn why(&self, end: End, samples: u64, error: f64) -> Option<String> {
        let target = self.checkpoint_options.target_error.unwrap_or(0.0);
        let why = match end {
            End::Complete => return None,
            End::Time => "the time is up",
            End::Error => "the error is small enough",
            End::Interrupted => "interrupted",
            End::OutOfReach if error.is_infinite() => "the image is black, so that no error is small enough",
            End::OutOfReach => {
                return Some(format!(
                    "the error is {} with {samples} samples of each pixel; {} would take about {:.0e}, and without --spp or \
                     --time-limit no more than {MAX_OPEN_SAMPLES} are taken",
                    progress::percent(error),
                    progress::percent(target),
                    samples_needed(samples, error, target)
                ));
            }
        };
        Some(format!("{why} with {samples} samples of each pixel"))
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
        anyhow::ensure!(sample < samples, "sample {sample} is outside of the {samples} samples of a pixel");
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

/// The relative error of an image; infinite if its scatter does not show it.
fn relative_error(renderer: &Renderer, film: &Film) -> f64 {
    let is_shared = renderer.integrator.iterations() == IterationPlan::PerReplicate;
    if is_shared { f64::INFINITY } else { film.relative_error() }
}
