//! The samples that a render still has to take: the requested ones without those that a checkpoint has.

use std::{
    ops::Range,
    sync::atomic::AtomicBool,
    time::{Duration, Instant},
};

use rangemap::RangeSet;
use thiserror::Error;

use super::{Checkpoint, Identity, RenderRecord, RenderSource, ResourceUse, in_words};
use crate::{
    integrator::{IntegratorModel as _, IntegratorState, IterationPlan, Notes},
    memory::NoMemory,
    render::{
        Renderer, Rendering, Replicate,
        drive::{self, End, Plan},
    },
    sampler::SamplerModel as _,
    scene_file::SceneError,
};

/// One of several parts of the samples of every pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    part: u32,
    parts: u32,
}

impl Shard {
    /// The part with this number, counted from 1; None if the number is not from 1 to `parts`.
    #[must_use]
    pub fn new(part: u32, parts: u32) -> Option<Self> {
        (1..=parts).contains(&part).then_some(Self { part, parts })
    }

    /// The samples of this part, of `all` samples of a pixel. The parts differ by one sample at most.
    #[must_use]
    pub fn range(self, all: u32) -> Range<u32> {
        let cut = |part: u32| (u64::from(all) * u64::from(part) / u64::from(self.parts)) as u32;
        cut(self.part - 1)..cut(self.part)
    }
}

/// The requested samples of a render, and the conditions that end it early.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleRequest {
    /// The seed; None means the scene's seed.
    pub seed: Option<u64>,
    /// Samples of each pixel in all. None means the number of the checkpoint, or without a checkpoint the number of the
    /// scene. A render that ends by a time limit or a target error needs no number.
    pub spp: Option<u32>,
    /// The part of these samples to take; None means all of them.
    pub shard: Option<Shard>,
    /// The render ends after this time.
    pub time_limit: Option<Duration>,
    /// The render ends once [`crate::film::Film::relative_error`] is below this value.
    pub target_error: Option<f64>,
}

/// Why a render cannot be done as requested, or cannot continue from a checkpoint.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum JobError {
    /// The request has a target error, but the integrator shares photons between all samples.
    #[error(
        "all samples of the integrator {integrator} share one set of photons, so their scatter does not show the error"
    )]
    NoErrorEstimate {
        /// The integrator's name.
        integrator: &'static str,
    },
    /// The request has a shard, but each sample of the integrator depends on those before.
    #[error("each sample of the integrator {integrator} depends on those before, so they cannot be rendered in parts")]
    DependentSamples {
        /// The integrator's name.
        integrator: &'static str,
    },
    /// Neither the request nor the checkpoint has a number of samples.
    #[error("the number of samples is not known")]
    UnknownGoal,
    /// The sampler needs the number of samples, which is unknown.
    #[error("the samples of the sampler {sampler} depend on their number, which is not known")]
    ClosedSampler {
        /// The sampler's name.
        sampler: &'static str,
    },
    /// There are more parts than samples.
    #[error("{samples} samples cannot be divided into {parts} parts")]
    TooManyParts {
        /// Samples of each pixel.
        samples: u32,
        /// Parts that were requested.
        parts: u32,
    },
    /// The checkpoint belongs to another render; the text says what differs.
    #[error("is of {0}")]
    OtherRender(String),
    /// The checkpoint has samples that were not requested.
    #[error("has {taken}, but only {asked} are requested")]
    OtherSamples {
        /// The samples of the checkpoint, in words.
        taken: String,
        /// The requested samples, in words.
        asked: String,
    },
    /// The checkpoint cannot be continued.
    #[error("lacks the integrator's state, which the next sample depends on")]
    MissingState,
    /// There is not enough memory for the film.
    #[error("{0}; a film with fewer pixels or layers needs less")]
    Memory(#[from] NoMemory),
    /// A file of the scene cannot be read any more.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl JobError {
    /// Whether the checkpoint is at fault, rather than the request.
    #[must_use]
    pub fn is_of_checkpoint(&self) -> bool {
        matches!(self, Self::OtherRender(_) | Self::OtherSamples { .. } | Self::MissingState)
    }
}

impl SampleRequest {
    /// Checks that the integrator can fulfil the request.
    ///
    /// # Errors
    /// If the request has a target error but the integrator's samples do not show one, or if it has a shard but the
    /// samples depend on each other.
    pub fn check(&self, renderer: &Renderer) -> Result<(), JobError> {
        let (integrator, iterations) = (renderer.integrator.plugin().name, renderer.integrator.iterations());
        if self.target_error.is_some() && iterations == IterationPlan::PerReplicate {
            return Err(JobError::NoErrorEstimate { integrator });
        }
        if self.shard.is_some() && iterations == IterationPlan::Chained {
            return Err(JobError::DependentSamples { integrator });
        }
        Ok(())
    }

    /// Samples of each pixel in all; None if the time or the error alone ends the render.
    fn goal(&self, renderer: &Renderer, resumed: Option<&Checkpoint>) -> Result<Option<u32>, JobError> {
        let has_other_end = self.time_limit.is_some() || self.target_error.is_some();
        let goal = match (self.spp, resumed) {
            (Some(spp), _) => Some(spp),
            (None, Some(resumed)) => resumed.record.goal,
            (None, None) if has_other_end => None,
            (None, None) => Some(renderer.samples()),
        };
        let sampler = &renderer.scene.sensor.sampler;
        if goal.is_none() && (!has_other_end || self.shard.is_some()) {
            return Err(JobError::UnknownGoal);
        }
        if goal.is_none() && !sampler.is_open_ended() {
            return Err(JobError::ClosedSampler { sampler: sampler.plugin().name });
        }
        Ok(goal)
    }

    /// The requested samples of each pixel.
    fn range(&self, goal: Option<u32>) -> Result<Range<u32>, JobError> {
        let all = goal.unwrap_or(u32::MAX);
        match self.shard {
            None => Ok(0..all),
            Some(Shard { parts, .. }) if parts > all => Err(JobError::TooManyParts { samples: all, parts }),
            Some(shard) => Ok(shard.range(all)),
        }
    }
}

/// A render that can be run: the samples that exist, and those to take.
#[derive(Debug)]
pub struct RenderJob {
    /// What is rendered.
    pub replicate: Replicate,
    /// The existing samples: none, or those of the checkpoint to continue from.
    pub checkpoint: Checkpoint,
    /// The samples of each pixel to take.
    pub ranges: Vec<Range<u32>>,
    request: SampleRequest,
}

/// The controls of a running render: when to interrupt it, and when to write checkpoints.
#[derive(Clone, Copy, Debug)]
pub struct Controls<'a> {
    /// When the work began.
    pub start: Instant,
    /// The render ends when this becomes true.
    pub interrupted: &'a AtomicBool,
    /// The time from one checkpoint to the next.
    pub checkpoint_every: Duration,
}

/// The result of a render that ended.
#[derive(Debug)]
pub struct JobResult {
    /// Why the render ended.
    pub end: End,
    /// The samples. The cost in the record does not include this job.
    pub checkpoint: Checkpoint,
    /// Statistics that the integrator collected.
    pub notes: Notes,
}

impl RenderJob {
    /// The job of a request: its samples without those that the checkpoint has.
    ///
    /// # Errors
    /// If the integrator or the sampler cannot fulfil the request, or the checkpoint belongs to another render or has
    /// samples that were not requested.
    pub fn new(
        source: &RenderSource<'_>,
        request: &SampleRequest,
        resumed: Option<Checkpoint>,
    ) -> Result<Self, JobError> {
        let renderer = source.renderer;
        request.check(renderer)?;
        let goal = request.goal(renderer, resumed.as_ref())?;
        let seed = request.seed.unwrap_or_else(|| renderer.scene.sensor.sampler.seed());
        let replicate = Replicate { seed, number: 0, samples: goal.unwrap_or(u32::MAX) };
        let identity = Identity::new(source, replicate)?;
        let range = request.range(goal)?;
        let cost = ResourceUse::default();
        let record = RenderRecord { identity, attributes: Vec::new(), goal, taken: RangeSet::new(), cost };
        let checkpoint = match resumed {
            Some(resumed) => resumed.continued(record, &range, renderer)?,
            None => Checkpoint { record, film: renderer.frame().film()?, state: IntegratorState::Empty },
        };
        let ranges = checkpoint.record.taken.gaps(&range).collect();
        Ok(Self { replicate, checkpoint, ranges, request: *request })
    }

    /// Renders. `progress` receives the number of samples that were added, from any thread. `keep` receives the record
    /// and the rendering when it is time to write a checkpoint.
    pub fn run(
        self,
        renderer: &Renderer,
        controls: &Controls<'_>,
        progress: &(dyn Fn(u64) + Sync),
        keep: &mut dyn FnMut(&RenderRecord, &Rendering<'_>),
    ) -> JobResult {
        let Self { replicate, checkpoint, ranges, request } = self;
        let Some(first) = ranges.first().map(|range| range.start) else {
            return JobResult { end: End::Complete, checkpoint, notes: Notes::default() };
        };
        let Checkpoint { mut record, film, state } = checkpoint;
        let mut rendering = renderer.resume(replicate, first, film, state);
        let plan = Plan {
            ranges,
            start: controls.start,
            time: request.time_limit.or(renderer.timeout),
            target_error: request.target_error,
            interrupted: controls.interrupted,
            every: controls.checkpoint_every,
        };
        let mut taken = std::mem::take(&mut record.taken);
        let mut keep = |rendering: &Rendering<'_>, taken: &RangeSet<u32>| {
            record.taken.clone_from(taken);
            keep(&record, rendering);
        };
        let end = drive::drive(&mut rendering, &mut taken, &plan, progress, &mut keep);
        record.taken = taken;
        let (state, notes) = (rendering.state().clone(), rendering.notes());
        JobResult { end, checkpoint: Checkpoint { record, film: rendering.into_film(), state }, notes }
    }
}

impl Checkpoint {
    /// The same samples with the record of the render that continues them.
    fn continued(self, record: RenderRecord, range: &Range<u32>, renderer: &Renderer) -> Result<Self, JobError> {
        if let Some(difference) = record.identity.difference(&self.record.identity) {
            return Err(JobError::OtherRender(difference));
        }
        let RenderRecord { taken, cost, .. } = self.record;
        let there: Vec<_> = taken.iter().cloned().collect();
        if there.iter().any(|part| part.start < range.start || range.end < part.end) {
            let asked = in_words(std::slice::from_ref(range));
            return Err(JobError::OtherSamples { taken: in_words(&there), asked });
        }
        let is_chained = renderer.integrator.iterations() == IterationPlan::Chained;
        let is_prefix = there.len() <= 1 && there.iter().all(|part| part.start == 0);
        if is_chained && !(is_prefix && there.is_empty() == (self.state == IntegratorState::Empty)) {
            return Err(JobError::MissingState);
        }
        Ok(Self { record: RenderRecord { taken, cost, ..record }, ..self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_nearly_equal_and_make_the_whole() {
        for (part, parts) in [(0, 3), (4, 3), (1, 0)] {
            assert_eq!(Shard::new(part, parts), None);
        }
        for (samples, parts) in [(10, 3), (7, 7), (1_000_000_000, 6), (64, 1)] {
            let shards = (1..=parts).map(|part| Shard::new(part, parts).expect("there is such a part"));
            let ranges: Vec<_> = shards.map(|shard| shard.range(samples)).collect();
            assert_eq!((ranges[0].start, ranges[ranges.len() - 1].end), (0, samples));
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            let lengths = || ranges.iter().map(|range| range.end - range.start);
            assert!(lengths().max() <= lengths().min().map(|least| least + 1), "{ranges:?}");
        }
    }
}
