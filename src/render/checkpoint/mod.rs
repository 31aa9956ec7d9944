//! The state of an unfinished render: its exact sums, the samples in them, and the identity of the render.

mod draft;
mod file;
mod job;

pub use job::{Controls, JobError, JobResult, RenderJob, SampleRequest, Shard};

use std::fmt::Write as _;

use rangemap::RangeSet;
use serde::{Deserialize, Deserializer, Serialize, de::Error as _};
use thiserror::Error;

use super::{Renderer, Replicate, drive::count};
use crate::{
    film::{Film, Frame},
    integrator::{Integrator, IntegratorState, Overrides},
    provenance,
    sampler::{Sampler, SamplerModel as _},
    scene_file::{Document, SceneError},
};

/// What a render is made from: a renderer, and the scene description that it was built from.
#[derive(Clone, Copy, Debug)]
pub struct RenderSource<'a> {
    /// The scene with its integrator.
    pub renderer: &'a Renderer,
    /// The document that the scene was built from.
    pub document: &'a Document,
    /// The values of the scene's `$parameters`.
    pub definitions: &'a [(String, String)],
    /// The changes to the scene's integrator.
    pub overrides: &'a Overrides,
}

/// Everything that determines the samples of a render, besides their numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// The version of the program.
    pub version: String,
    /// The hash of the scene's files.
    pub scene_sha256: String,
    /// The values of `$parameters`.
    pub definitions: Vec<(String, String)>,
    /// The integrator with its parameters, as text.
    pub integrator: String,
    /// The sampler with its parameters, as text.
    pub sampler: String,
    /// The number of samples of a pixel in all, if the samples depend on it.
    pub samples: Option<u32>,
    /// The seed.
    pub seed: u64,
    /// The number of the replicate.
    pub replicate: u64,
    /// The crop, size and layers of the film.
    pub frame: Frame,
}

impl Identity {
    /// The identity of a replicate of the image of a source.
    ///
    /// # Errors
    /// If a file of the scene can no longer be read.
    pub fn new(source: &RenderSource<'_>, replicate: Replicate) -> Result<Self, SceneError> {
        let RenderSource { renderer, document, definitions, overrides } = *source;
        let unread = |error| SceneError::nowhere(format!("a file of the scene cannot be read any more: {error}"));
        let is_open_ended = renderer.scene.sensor.sampler.is_open_ended();
        Ok(Self {
            version: provenance::version(),
            scene_sha256: provenance::scene_hash(document).map_err(unread)?,
            definitions: definitions.to_vec(),
            integrator: Integrator::described(document, overrides)?,
            sampler: Sampler::described(document),
            samples: (!is_open_ended).then_some(replicate.samples),
            seed: replicate.seed,
            replicate: replicate.number,
            frame: renderer.frame(),
        })
    }

    /// The first difference between two identities, in words; None if they are equal.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        let (own, others) = (self.aspects(), other.aspects());
        let different = own.into_iter().zip(others).find(|(own, other)| own != other);
        different.map(|((what, own), (_, other))| format!("another {what}: \"{other}\" instead of \"{own}\""))
    }

    /// All parts of the identity, with their names.
    fn aspects(&self) -> [(&'static str, String); 9] {
        let definitions: Vec<_> = self.definitions.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let crop = self.frame.crop;
        let mut frame = format!("{} x {} from {},{} of {:?}", crop.width, crop.height, crop.x, crop.y, self.frame.size);
        for layer in &self.frame.layers {
            // Writing to a string cannot fail.
            let _ = write!(frame, ", {}[{}] {:?}", layer.name, layer.channels.join(","), layer.source);
        }
        let _ = write!(frame, ", variance: {}", self.frame.has_variance);
        [
            ("version of this program", self.version.clone()),
            ("scene (SHA-256 of its files)", self.scene_sha256.clone()),
            ("value of the scene's parameters", definitions.join(" ")),
            ("integrator", self.integrator.clone()),
            ("sampler", self.sampler.clone()),
            ("number of samples, on which its sampler depends", self.samples.map_or("any".into(), |n| n.to_string())),
            ("seed", self.seed.to_string()),
            ("replicate", self.replicate.to_string()),
            ("film", frame),
        ]
    }
}

/// The time and memory that a render used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResourceUse {
    /// Wall time.
    pub seconds: f64,
    /// CPU time of all cores, user and system; 0 if unknown.
    pub core_seconds: f64,
    /// The peak resident memory in bytes; 0 if unknown.
    pub peak_bytes: u64,
}

impl ResourceUse {
    /// The use of two runs, one after the other.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            seconds: self.seconds + other.seconds,
            core_seconds: self.core_seconds + other.core_seconds,
            peak_bytes: self.peak_bytes.max(other.peak_bytes),
        }
    }
}

/// A checkpoint without its sums.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderRecord {
    /// The identity of the render.
    pub identity: Identity,
    /// The attributes in the header of its image other than samples and cost, as names and texts.
    pub attributes: Vec<(String, String)>,
    /// The number of samples of each pixel when the render is complete, if known.
    pub goal: Option<u32>,
    /// The samples of each pixel that were taken.
    #[serde(deserialize_with = "ranges")]
    pub taken: RangeSet<u32>,
    /// The cost of the samples.
    pub cost: ResourceUse,
}

/// Reads ranges and checks them. The deserializer of the crate panics at invalid ranges.
fn ranges<'de, D: Deserializer<'de>>(from: D) -> Result<RangeSet<u32>, D::Error> {
    let pairs: Vec<(u32, u32)> = Vec::deserialize(from)?;
    if let Some((start, end)) = pairs.iter().find(|(start, end)| start >= end) {
        return Err(D::Error::custom(format!("{start} to {end} is not a range of samples")));
    }
    Ok(pairs.into_iter().map(|(start, end)| start..end).collect())
}

/// The state of an unfinished render.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// The identity of the render, and the samples that were taken.
    pub record: RenderRecord,
    /// The sums of the samples.
    pub film: Film,
    /// The [`super::Rendering::state`] of the integrator.
    pub state: IntegratorState,
}

impl RenderRecord {
    /// All attributes in the header of the image.
    #[must_use]
    pub fn header(&self) -> Vec<(String, String)> {
        let ResourceUse { seconds, core_seconds, peak_bytes } = self.cost;
        let measured = [
            ("etendue.spp", count(&self.taken).to_string()),
            ("etendue.seconds", format!("{seconds:.3}")),
            ("etendue.core_seconds", format!("{core_seconds:.3}")),
            ("etendue.peak_bytes", peak_bytes.to_string()),
        ];
        self.attributes.iter().cloned().chain(measured.map(|(name, value)| (name.to_owned(), value))).collect()
    }

    /// The samples before the goal that were not taken; without a goal, those before the last sample that was taken.
    #[must_use]
    pub fn missing(&self) -> Vec<std::ops::Range<u32>> {
        let end = self.goal.or_else(|| self.taken.last().map(|range| range.end)).unwrap_or(0);
        self.taken.gaps(&(0..end)).collect()
    }

    /// Checks that no sample is missing.
    ///
    /// # Errors
    /// If a sample is missing. The error names all missing samples.
    pub fn check_complete(&self) -> Result<(), MissingSamples> {
        let (missing, goal) = (self.missing(), self.goal);
        if missing.is_empty() { Ok(()) } else { Err(MissingSamples { missing, goal }) }
    }
}

/// The samples that a render lacks.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}{} are missing", in_words(missing), goal.map_or(String::new(), |goal| format!(" of {goal}")))]
pub struct MissingSamples {
    /// The missing samples of each pixel.
    pub missing: Vec<std::ops::Range<u32>>,
    /// Samples of each pixel in all, if the number is known.
    pub goal: Option<u32>,
}

/// Why the samples of one checkpoint cannot be added to those of another.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MergeError {
    /// The checkpoints belong to different renders; the text says what differs.
    #[error("is of {0}")]
    OtherRender(String),
    /// Both checkpoints have some of the same samples.
    #[error("has samples that were already added: {0}")]
    Overlap(String),
    /// Each sample of the integrator depends on those before.
    #[error("is of an integrator whose samples depend on those before, so they cannot be rendered in parts")]
    DependentSamples,
}

impl Checkpoint {
    /// Adds the samples of another checkpoint of the same render.
    ///
    /// # Errors
    /// If the other checkpoint belongs to another render, has samples that this one has too, or its samples depend on
    /// each other.
    pub fn add(&mut self, other: Self) -> Result<(), MergeError> {
        if let Some(difference) = self.record.identity.difference(&other.record.identity) {
            return Err(MergeError::OtherRender(difference));
        }
        if let Some(twice) = other.record.taken.iter().find(|range| self.record.taken.overlaps(range)) {
            return Err(MergeError::Overlap(in_words(std::slice::from_ref(twice))));
        }
        if self.state != IntegratorState::Empty || other.state != IntegratorState::Empty {
            return Err(MergeError::DependentSamples);
        }
        self.record.taken.extend(other.record.taken);
        self.record.goal = self.record.goal.max(other.record.goal);
        self.record.cost = self.record.cost.and(other.record.cost);
        self.film.merge(&other.film);
        Ok(())
    }
}

/// Ranges of samples as text: first and last numbers.
#[must_use]
pub fn in_words(ranges: &[std::ops::Range<u32>]) -> String {
    let ranges: Vec<_> = ranges.iter().map(|range| format!("{} to {}", range.start, range.end - 1)).collect();
    format!("samples {}", ranges.join(", "))
}
