//! Progressive photon mapping against what finitely many passes must make of it.

pub mod finite;
pub mod flux;
pub mod glossy;
pub mod pane;
pub mod pixel;
pub mod radius;

use crate::{
    integrator::{EyeRay, Integrator, IntegratorModel as _, Iteration},
    math::{Ray, Rgb, rng::Stream},
    sampler::PathSampler,
    validation::setup::Setup,
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

/// An image while it is made, pass by pass. It is one of many that are independent, by its number.
struct Image<'s> {
    setup: &'s Setup,
    integrator: Integrator,
    seed: u64,
    number: u64,
}

impl<'s> Image<'s> {
    fn new(setup: &'s Setup, seed: u64, number: u64) -> Self {
        Self { setup, integrator: setup.integrator.clone(), seed, number }
    }

    /// Sends out the photons of a pass.
    fn pass(&mut self, sample: u32) {
        let iteration = Iteration { seed: self.seed, replicate: self.number, sample };
        self.integrator =
            self.integrator.prepared(&self.setup.scene, &iteration).expect("there are photons to send out");
    }

    /// What a pixel sees in this pass; `which` tells passes apart.
    fn radiance(&self, pixel: usize, ray: &Ray, which: u32) -> Rgb {
        let address = [self.seed, self.number, u64::from(which), pixel as u64, 1];
        let mut numbers = PathSampler::Independent(Stream::at(&address));
        self.integrator.radiance(&self.setup.scene, &EyeRay { ray: *ray, pixel }, &mut numbers, &mut [])
    }

    /// The squares of the radii of the next pass over those of the first, of all pixels; empty with a radius for each pass.
    fn squares(&self) -> Vec<f64> {
        let state = self.integrator.state();
        let pixels = self.setup.scene.sensor.film.rendered().width as usize;
        state.chunks(state.len().div_ceil(pixels).max(1)).map(|of_pixel| of_pixel[0]).collect()
    }
}
