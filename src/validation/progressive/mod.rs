//! The laws of progressive photon mapping, with predictions for finitely many passes.

pub mod finite;
pub mod flux;
pub mod glossy;
pub mod pane;
pub mod pixel;
pub mod radius;

use crate::{
    integrator::IntegratorState,
    math::Rgb,
    render::{Renderer, Rendering, Replicate},
};

const PER_PASS: &str = "per_pass";
const PER_PIXEL: &str = "per_pixel";
const ERROR_DRIVEN: &str = "error_driven";

/// The squared radius of each pass divided by the one of the first, computed as a product.
fn squares_of_passes(alpha: f64) -> impl Iterator<Item = f64> {
    let ratio = move |(i, squared): &(f64, f64)| Some((i + 1.0, squared * (i + alpha) / (i + 1.0)));
    std::iter::successors(Some((1.0, 1.0)), ratio).map(|(_, squared)| squared)
}

/// The XML of an `sppm` integrator with comma-separated parameters, each `type name=value`.
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

/// An image that is rendered pass by pass. Images with different numbers are independent.
struct Image<'r> {
    renderer: &'r Renderer,
    replicate: Replicate,
    rendering: Rendering<'r>,
    /// The number of passes that the film has accumulated.
    passes: u32,
    /// The sum of these passes in each pixel.
    sums: Vec<Rgb>,
}

impl<'r> Image<'r> {
    fn new(renderer: &'r Renderer, passes: u32, seed: u64, number: u64) -> Self {
        let replicate = Replicate { seed, number, samples: passes };
        let rendering = renderer.begin(replicate);
        let sums = vec![Rgb::ZERO; rendering.film().means().len()];
        Self { renderer, replicate, rendering, passes: 0, sums }
    }

    /// Skips to a later pass, if passes are independent.
    fn go_to(&mut self, pass: u32) {
        self.rendering.go_to(pass);
    }

    /// Renders the next pass and returns its radiance estimate in each pixel, without the passes before it.
    fn pass(&mut self) -> Vec<Rgb> {
        self.rendering.advance(1, &|_| {});
        self.passes += 1;
        let means = self.rendering.film().means();
        let sums: Vec<_> = means.into_iter().map(|mean| f64::from(self.passes) * Rgb::from_array(mean)).collect();
        let radiances = sums.iter().zip(&self.sums).map(|(after, before)| after - before).collect();
        self.sums = sums;
        radiances
    }

    /// Continues from the integrator state alone, as a resumed render does.
    fn resume(&mut self) {
        let (next, state) = (self.rendering.next(), self.rendering.state().clone());
        self.rendering = self.renderer.resume(self.replicate, next, self.renderer.film(), state);
        self.passes = 0;
        self.sums.fill(Rgb::ZERO);
    }

    /// The squared radius of each pixel in the next pass over that in the first; empty with the schedule `per_pass`.
    fn squares(&self) -> Vec<f64> {
        match self.rendering.state() {
            IntegratorState::Empty => Vec::new(),
            IntegratorState::PixelRadii(radii) => radii.iter().map(|radius| radius.squared).collect(),
        }
    }
}
