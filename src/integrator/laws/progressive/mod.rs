//! Progressive photon mapping against what finitely many passes must make of it.

pub mod finite;
pub mod flux;
pub mod glossy;
pub mod pane;
pub mod pixel;
pub mod radius;

use super::Setup;
use crate::{
    integrator::{CameraRay, Estimator, IntegratorModel as _, IntegratorState, Iteration, SampleOutput},
    math::{Ray, Rgb, rng::Stream},
    photon::radius::PassCounts,
    sampler::PathSampler,
};

const PER_PASS: &str = "per_pass";
const PER_PIXEL: &str = "per_pixel";
const ERROR_DRIVEN: &str = "error_driven";

/// The squares of the radii of passes over that of the first, as a product.
fn squares_of_passes(alpha: f64) -> impl Iterator<Item = f64> {
    let ratio = move |(i, squared): &(f64, f64)| Some((i + 1.0, squared * (i + alpha) / (i + 1.0)));
    std::iter::successors(Some((1.0, 1.0)), ratio).map(|(_, squared)| squared)
}

/// An integrator with these parameters, each `type name=value`.
fn sppm(params: &str) -> String {
    let param = |text: &str| {
        let (kind, (name, value)) = text
            .split_once(' ')
            .and_then(|(kind, rest)| Some((kind, rest.split_once('=')?)))
            .expect("a parameter has a type, a name and a value");
        format!(r#"<{kind} name="{name}" value="{value}"/>"#)
    };
    let params: String = params.split(',').map(|text| param(text.trim())).collect();
    format!(r#"<integrator type="sppm">{params}</integrator>"#)
}

/// An image while it is rendered, pass by pass. It is one of many independent ones, by its number.
struct Image<'s> {
    setup: &'s Setup,
    seed: u64,
    number: u64,
    state: IntegratorState,
    estimator: Option<Box<dyn Estimator + 's>>,
    /// What each pixel has found in the current pass.
    found: Vec<PassCounts>,
}

impl<'s> Image<'s> {
    fn new(setup: &'s Setup, seed: u64, number: u64) -> Self {
        Self::resumed(setup, seed, number, IntegratorState::Empty)
    }

    /// An image that continues from the state that another one has reached.
    fn resumed(setup: &'s Setup, seed: u64, number: u64, state: IntegratorState) -> Self {
        let found = vec![PassCounts::default(); setup.scene.sensor.film.rendered().width as usize];
        Self { setup, seed, number, state, estimator: None, found }
    }

    /// Emits the photons of a pass.
    fn pass(&mut self, sample: u32) {
        self.state = self.next_state();
        self.found.fill(PassCounts::default());
        let iteration = Iteration { seed: self.seed, replicate: self.number, sample };
        self.estimator = Some(self.setup.integrator.begin(&self.setup.scene, &iteration, &self.state));
    }

    /// The radiance that a pixel shows in this pass; `which` tells passes apart.
    fn radiance(&mut self, pixel: usize, ray: &Ray, which: u32) -> Rgb {
        let address = [self.seed, self.number, u64::from(which), pixel as u64, 1];
        let mut sampler = PathSampler::Independent(Stream::at(&address));
        let mut output = SampleOutput::new(&mut []);
        let estimator = self.estimator.as_ref().expect("a pass has begun");
        let radiance = estimator.radiance(&CameraRay { ray: *ray, pixel }, &mut sampler, &mut output);
        if let Some(found) = self.found.get_mut(pixel) {
            found.photons += output.photons.photons;
            found.squared_distances += output.photons.squared_distances;
        }
        radiance
    }

    /// The state of the next pass.
    fn next_state(&self) -> IntegratorState {
        self.estimator.as_ref().map_or_else(|| self.state.clone(), |estimator| estimator.next_state(&self.found))
    }

    /// The squares of the radii of the next pass over those of the first, of all pixels; empty with a radius for each pass.
    fn squares(&self) -> Vec<f64> {
        match self.next_state() {
            IntegratorState::Empty => Vec::new(),
            IntegratorState::PixelRadii(radii) => radii.iter().map(|radius| radius.squared).collect(),
        }
    }
}
