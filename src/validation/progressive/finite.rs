//! The bias and the variance of the mean of N passes of progressive photon mapping.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{ERROR_DRIVEN, Image, PER_PASS, PER_PIXEL, sppm, squares_of_passes};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    photon::Kernel,
    render::Renderer,
    stats::{Estimate, Moments},
    validation::{
        setup::{PixelCentres, ground, renderer},
        slope::{Point, slope},
        theory::{
            density::{Photons, Prediction, point_light},
            numeric::Interpolant,
        },
    },
};

/// The laws of finitely many passes.
pub const LAWS: &[Law] = &[
    Law {
        name: "progressive/finite-n",
        claim: "The mean of N passes has the bias and the variance that are predicted for N passes, for three N and for α = 1/2, 2/3 and \
                4/5, with a different kernel for each α. The slopes over N are the predicted ones, which still differ from the limits.",
        source: "N passes of M independent photons: the mean is E blurred by the kernels, the variance is N^-2 Σ (Φ ∫ E K² - mean²) / M; \
                 in the limit N^(α-1) and N^-α, Knaus and Zwicker 2011, section 4",
        check: Check::Analytic(passes),
    },
    Law {
        name: "progressive/finite-n-pixel",
        claim: "With a radius for each pixel, the mean of N passes has the bias and the variance that are predicted from the pixel's actual \
                radii. The radii shrink as predicted from the expected photon counts. The slopes over N follow these predictions.",
        source: "given the radii, passes are independent; r² (i + α) / (i + 1) under uniform light; here the blurred E gives the photon counts",
        check: Check::Analytic(pixels),
    },
];

const INTENSITY: f64 = 3.0;
const HEIGHT: f64 = 0.5;
/// The distance of the test points from the point below the light.
const DISTANCE: f64 = 0.25;
/// The number of test points. They have equal irradiance, and each is viewed by one pixel.
const POINTS: usize = 8;
/// The film's width and height in pixels.
const EDGE: u32 = 4;
/// The radius of the first pass.
const RADIUS: f64 = 0.4;
const ALBEDO: f64 = 0.6;
const CASES: [(f64, &str, Kernel); 3] = [
    (0.5, "constant", Kernel::Constant),
    (2.0 / 3.0, "epanechnikov", Kernel::Epanechnikov),
    (0.8, "cone", Kernel::Cone),
];
const PASSES: [u32; 3] = [4, 16, 64];

/// A renderer with a camera below the light that looks straight down.
fn scene(alpha: f64, kernel: &str, schedule: &str, photons: u32) -> Renderer {
    let integrator = sppm(&format!(
        "integer photon_count={photons}, float initial_radius={RADIUS}, float alpha={alpha}, string direct=map, integer \
         max_depth=2, string kernel={kernel}, string radius_schedule={schedule}"
    ));
    let light = format!(
        r#"<emitter type="point"><point name="position" x="0" y="0" z="{HEIGHT}"/><rgb name="intensity" value="{INTENSITY}"/></emitter>"#
    );
    let position = 0.3 * DVec3::Z;
    let half_width = DISTANCE * f64::from(EDGE) / RING.sqrt();
    let fov = 2.0 * (half_width / position.z).atan().to_degrees();
    let camera = PixelCentres { position, target: DVec3::ZERO, fov, columns: EDGE, rows: EDGE };
    renderer(&integrator, &camera.xml(), &(light + &ground(Rgb::splat(ALBEDO))))
}

/// The squared distance of the test points from the centre of the film, in units of half a pixel.
const RING: f64 = 1.0 + 9.0;

/// One of the test points.
const POINT: DVec2 = DVec2::new(DISTANCE, 0.0);

/// The indices of the pixels that view the test points.
fn ring() -> [usize; POINTS] {
    let edge = EDGE as usize;
    let across = |i: usize| 2.0 * i as f64 + 1.0 - f64::from(EDGE);
    let is_on_ring = |pixel: &usize| DVec2::new(across(pixel % edge), across(pixel / edge)).length_squared() == RING;
    let mut pixels = (0..edge * edge).filter(is_on_ring);
    std::array::from_fn(|_| pixels.next().expect("the ring has eight pixels"))
}

/// The irradiance estimates at the test points in the next pass.
fn estimates(image: &mut Image<'_>) -> [f64; POINTS] {
    let radiances = image.pass();
    ring().map(|pixel| PI / ALBEDO * radiances[pixel].y)
}

/// The irradiance at the test points.
fn truth() -> f64 {
    point_light(INTENSITY, HEIGHT)(POINT)
}

/// The predicted moments of an estimate, for any radius up to the radius of the first pass.
struct Blur {
    photons: u32,
    /// Two smooth functions of the squared radius over the first: the mean, and the squared radius times the mean of K²
    /// E.
    moments: Interpolant<2>,
}

impl Blur {
    const POWER: f64 = 4.0 * PI * INTENSITY;

    fn new(kernel: Kernel, photons: u32) -> Self {
        let moments = |squared: f64| {
            let floor = Photons { irradiance: point_light(INTENSITY, HEIGHT), power: Self::POWER, count: photons };
            let found = floor.within(kernel, POINT, RADIUS * squared.sqrt());
            let square = f64::from(photons) * found.variance + found.mean * found.mean;
            [found.mean, squared * square]
        };
        Self { photons, moments: Interpolant::new(moments, [0.0, 1.0], 14) }
    }

    fn at(&self, squared: f64) -> Prediction {
        let [mean, square] = self.moments.at(squared);
        Prediction { mean, variance: (square / squared - mean * mean) / f64::from(self.photons) }
    }

    /// The prediction for the mean of passes with the given squared radii.
    fn over(&self, squares: impl Iterator<Item = f64>) -> Prediction {
        let (mut mean, mut variance, mut n) = (0.0, 0.0, 0.0);
        for squared in squares {
            let pass = self.at(squared);
            (mean, variance, n) = (mean + pass.mean, variance + pass.variance, n + 1.0);
        }
        Prediction { mean: mean / n, variance: variance / (n * n) }
    }
}

/// Bias and variance as functions of N.
#[derive(Default)]
struct Points([Vec<Point>; 2]);

impl Points {
    /// Adds the moments of the errors and of their squares at a number of passes.
    ///
    /// Errors are relative to the expectation, whose bias is `bias`.
    fn push(&mut self, passes: u32, [errors, squares]: &[Moments; 2], bias: f64, expected: Prediction) {
        let count = f64::from(passes);
        // Blur darkens the peak of the irradiance, so the bias is negative. A slope needs positive values.
        let darker = Moments { mean: -bias - errors.mean, ..*errors };
        self.0[0].push(Point { count, found: darker, expected: truth() - expected.mean });
        self.0[1].push(Point { count, found: *squares, expected: expected.variance });
    }

    fn slopes(&self, name: &str, alpha: f64) -> [Finding; 2] {
        [
            slope(format!("{name}, slope of the bias"), &self.0[0], alpha - 1.0),
            slope(format!("{name}, slope of the variance"), &self.0[1], -alpha),
        ]
    }
}

fn passes(effort: Effort) -> Vec<Finding> {
    const PHOTONS: u32 = 500;
    let mut findings = Vec::new();
    for (case, (alpha, kernel_name, kernel)) in CASES.into_iter().enumerate() {
        let renderer = scene(alpha, kernel_name, PER_PASS, PHOTONS);
        let blur = Blur::new(kernel, PHOTONS);
        let name = format!("α = {alpha:.3}");
        let mut points = Points::default();
        for n in PASSES {
            let expected = blur.over(squares_of_passes(alpha).take(n as usize));
            let image = |number: u32| {
                let mut image = Image::new(&renderer, n, 72 + 10 * case as u64 + u64::from(n), u64::from(number));
                let mut errors = [-expected.mean; POINTS];
                for _ in 0..n {
                    let found = estimates(&mut image);
                    errors.iter_mut().zip(found).for_each(|(error, found)| *error += found / f64::from(n));
                }
                mean_and_square(errors)
            };
            let found: Vec<_> = (0..effort.samples(5120 / n)).into_par_iter().map(image).collect();
            let moments = [0, 1].map(|i| found.iter().map(|image| image[i]).collect::<Moments>());
            let bias = expected.mean - truth();
            let biases = Moments { mean: moments[0].mean + bias, ..moments[0] };
            findings.push(Finding::mean(format!("{name}, {n} passes, bias"), &biases, bias));
            findings.push(Finding::mean(format!("{name}, {n} passes, variance"), &moments[1], expected.variance));
            points.push(n, &moments, bias, expected);
        }
        findings.extend(points.slopes(&name, alpha));
    }
    findings
}

/// The means over the test points of the errors and of their squares.
fn mean_and_square(errors: [f64; POINTS]) -> [f64; 2] {
    [1, 2].map(|n| errors.iter().map(|error| error.powi(n)).sum::<f64>() / POINTS as f64)
}

/// Means over the test points of one image with a radius for each pixel: of the errors, of their squares, of the bias
/// and of the variance predicted from the pixel's own radii, and of the last squared radius.
type OfPixels = [f64; 5];

/// The moments of images, with the predictions from their own radii.
struct Given {
    errors: Moments,
    squares: Moments,
    /// Squared errors minus the predicted variance, which differs between images.
    excess: Moments,
    /// The means of the predicted bias and of the predicted variance.
    expected: (f64, f64),
}

impl Given {
    fn of(images: &[OfPixels]) -> Self {
        let column = |i: usize| images.iter().map(|image| image[i]).collect::<Moments>();
        Self {
            errors: column(0),
            squares: column(1),
            excess: images.iter().map(|image| image[1] - image[3]).collect(),
            expected: (column(2).mean, column(3).mean),
        }
    }

    fn bias(&self, name: &str) -> Finding {
        let biases = Moments { mean: self.errors.mean + self.expected.0, ..self.errors };
        Finding::mean(format!("{name}, bias"), &biases, self.expected.0)
    }

    fn variance(&self, name: &str) -> Finding {
        let variances = Moments { mean: self.excess.mean + self.expected.1, ..self.excess };
        Finding::mean(format!("{name}, variance"), &variances, self.expected.1)
    }
}

fn pixels(effort: Effort) -> Vec<Finding> {
    const PHOTONS: u32 = 4000;
    let mut findings = Vec::new();
    for (case, (alpha, kernel_name, kernel)) in CASES.into_iter().enumerate() {
        let renderer = scene(alpha, kernel_name, PER_PIXEL, PHOTONS);
        let (blur, constant) = (Blur::new(kernel, PHOTONS), Blur::new(Kernel::Constant, PHOTONS));
        let name = format!("α = {alpha:.3}");
        let mut points = Points::default();
        for n in PASSES {
            let expected_squares = expected_squares(&constant, alpha, n);
            let expected = blur.over(expected_squares[..n as usize].iter().copied());
            let seed = 172 + 10 * case as u64 + u64::from(n);
            let image = |number: u32| of_pixels(&mut Image::new(&renderer, n, seed, u64::from(number)), &blur);
            let found: Vec<_> = (0..effort.samples(1024 / n)).into_par_iter().map(image).collect();
            let given = Given::of(&found);
            findings.push(given.bias(&format!("{name}, {n} passes")));
            findings.push(given.variance(&format!("{name}, {n} passes")));
            let last: Moments = found.iter().map(|image| image[4]).collect();
            let bound = effort.bound(1024 / n, 0.02);
            let last = Estimate::from_moments(&last).expect("there are two images or more");
            let expected_last = Estimate::exact(expected_squares[n as usize]);
            findings.push(Finding::equivalent(format!("{name}, r² after {n} passes"), &last, &expected_last, bound));
            points.push(n, &[given.errors, given.squares], given.expected.0, expected);
        }
        findings.extend(points.slopes(&name, alpha));
    }
    findings.extend(error_driven(effort));
    findings
}

/// Tests radii that depend on all earlier passes. They add no bias, because the photons of the next pass are
/// independent of these.
fn error_driven(effort: Effort) -> [Finding; 3] {
    const PHOTONS: u32 = 4000;
    const PASSES: u32 = 16;
    let renderer = scene(0.7, "epanechnikov", ERROR_DRIVEN, PHOTONS);
    let blur = Blur::new(Kernel::Epanechnikov, PHOTONS);
    let image = |number: u32| of_pixels(&mut Image::new(&renderer, PASSES, 271, u64::from(number)), &blur);
    let found: Vec<_> = (0..effort.samples(64)).into_par_iter().map(image).collect();
    let given = Given::of(&found);
    let name = format!("by its error, {PASSES} passes");
    let least = found.iter().map(|image| image[4]).fold(f64::INFINITY, f64::min);
    [
        given.bias(&name),
        given.variance(&name),
        // The schedule must detect the bias and shrink a radius at least once.
        Finding::error(format!("{name}, 1 if no radius shrank"), f64::from(least >= 1.0), 0.0),
    ]
}

fn of_pixels(image: &mut Image<'_>, blur: &Blur) -> OfPixels {
    let passes = image.replicate.samples;
    let mut squares = [1.0; POINTS];
    let mut errors = [0.0; POINTS];
    let (mut mean, mut variance, weight) = (0.0, 0.0, f64::from(passes).recip());
    for _ in 0..passes {
        for ((error, found), squared) in errors.iter_mut().zip(estimates(image)).zip(&squares) {
            let expected = blur.at(*squared);
            *error += weight * (found - expected.mean);
            mean += weight * expected.mean / POINTS as f64;
            variance += weight * weight * expected.variance / POINTS as f64;
        }
        let all = image.squares();
        squares = ring().map(|pixel| all[pixel]);
    }
    let [error, square] = mean_and_square(errors);
    [error, square, mean - truth(), variance, squares.iter().sum::<f64>() / POINTS as f64]
}

/// The squared radius over the first, before each pass and after the last, if each pass finds the expected number of
/// photons.
fn expected_squares(constant: &Blur, alpha: f64, passes: u32) -> Vec<f64> {
    let (mut squared, mut kept) = (1.0, 0.0);
    let mut squares = vec![squared];
    for _ in 0..passes {
        // In units of a photon's power per area.
        let found = constant.at(squared).mean * squared;
        squared *= (kept + alpha * found) / (kept + found);
        kept += alpha * found;
        squares.push(squared);
    }
    squares
}
