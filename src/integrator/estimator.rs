use std::{fmt::Debug, sync::Arc};

use crate::{
    film::splats,
    math::{Ray, Rgb},
    photon::radius::{PassCounts, PixelRadius},
    sampler::PathSampler,
};

/// Messages about a render for the user.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    /// Sizes, counts and times, one line each.
    pub facts: Vec<String>,
    /// Reasons why the image may differ from what was intended.
    pub warnings: Vec<String>,
}

/// How often an integrator begins an iteration, which prepares the data that samples share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IterationPlan {
    /// Nothing is shared: all samples are independent.
    Independent,
    /// One iteration for all samples of a replicate.
    PerReplicate,
    /// One iteration for each sample of all pixels, independent of the others.
    PerSample,
    /// One iteration for each sample of all pixels, which depends on the iterations before.
    Chained,
}

impl IterationPlan {
    /// Whether each sample of all pixels has its own iteration.
    #[must_use]
    pub fn is_per_sample(self) -> bool {
        matches!(self, Self::PerSample | Self::Chained)
    }
}

/// The address of an iteration, which its random numbers depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Iteration {
    /// The user's seed.
    pub seed: u64,
    /// The number of the replicate.
    pub replicate: u64,
    /// The number of the sample; 0 if one iteration serves all samples of a replicate.
    pub sample: u32,
}

/// The state that an iteration depends on, besides the scene and its address: the result of the iterations before.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum IntegratorState {
    /// No state: this is the first iteration, or iterations are independent.
    #[default]
    Empty,
    /// The radius of each pixel of the film, row by row (progressive photon mapping).
    PixelRadii(Arc<[PixelRadius]>),
}

/// A ray from the camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// The index of its pixel in the rendered part of the film, row by row.
    pub pixel: usize,
}

impl CameraRay {
    /// A ray of the first pixel.
    #[must_use]
    pub fn alone(ray: Ray) -> Self {
        Self { ray, pixel: 0 }
    }
}

/// The output of a sample of a pixel, besides its radiance.
#[derive(Debug)]
pub struct SampleOutput<'l> {
    /// The values of the sampled layers, all 0 at first.
    pub layers: &'l mut [f64],
    /// The photons that the sample found, for the state of the next iteration.
    pub photons: PassCounts,
}

impl<'l> SampleOutput<'l> {
    /// An empty output with room for layers.
    #[must_use]
    pub fn new(layers: &'l mut [f64]) -> Self {
        Self { layers, photons: PassCounts::default() }
    }
}

/// An integrator in one iteration. It estimates radiance with the data of the iteration, such as photon maps.
pub trait Estimator: Debug + Sync {
    /// Estimates the radiance that arrives along a camera ray.
    fn radiance(&self, camera_ray: &CameraRay, sampler: &mut PathSampler, output: &mut SampleOutput<'_>) -> Rgb;

    /// Traces a path from an emitter, and adds its contributions to the film.
    fn light_path(&self, _sampler: &mut PathSampler, _path: &mut splats::Path) {}

    /// The state of the next iteration, from the photons that the samples of this iteration found, pixel by pixel.
    fn next_state(&self, _found: &[PassCounts]) -> IntegratorState {
        IntegratorState::Empty
    }

    /// Messages about the data of the iteration.
    fn notes(&self) -> Notes {
        Notes::default()
    }
}
