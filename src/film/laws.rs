//! Laws of reconstruction filters, as used by the film.

use std::f64::consts::TAU;

use glam::DVec2;

use super::{FilmPlugin, HdrFilm};
use crate::{
    law::{Check, Effort, Finding, Law},
    scene_file::xml,
    stats::normal,
};

/// The laws of the film.
pub const LAWS: &[Law] = &[
    Law {
        name: "film/filter",
        claim: "Sampled positions around a pixel's centre have the filter as their density. At a border that is not sampled, the \
               filter is truncated.",
        source: "closed-form distribution functions of box, tent and shifted Gaussian, at 2000 quantiles",
        check: Check::Analytic(distribution),
    },
    Law {
        name: "film/footprint",
        claim: "The mean of a pixel's positions is its centre. The variance is 1/12 for the box, r²/6 for the tent and 0.24857086 \
               for the default Gaussian.",
        source: "moments of the densities, of the Gaussian by quadrature",
        check: Check::Analytic(footprint),
    },
];

/// A filter element with its radius, distribution function and variance.
struct Subject {
    element: &'static str,
    radius: f64,
    below: fn(f64) -> f64,
    variance: f64,
}

const SUBJECTS: [Subject; 3] = [
    Subject { element: r#"<rfilter type="box"/>"#, radius: 0.5, below: box_below, variance: 1.0 / 12.0 },
    Subject {
        element: r#"<rfilter type="tent"><float name="radius" value="1.4"/></rfilter>"#,
        radius: 1.4,
        below: tent_below,
        variance: 1.4 * 1.4 / 6.0,
    },
    Subject { element: r#"<rfilter type="gaussian"/>"#, radius: 2.0, below: gaussian_below, variance: 0.248_570_86 },
];

fn box_below(x: f64) -> f64 {
    (x + 0.5).clamp(0.0, 1.0)
}

fn tent_below(x: f64) -> f64 {
    let s = (x / 1.4).clamp(-1.0, 1.0);
    0.5 + s - 0.5 * s * s.abs()
}

/// The distribution function of a Gaussian of standard deviation 1/2, shifted down by its value at 2.
fn gaussian_below(x: f64) -> f64 {
    let unnormalised =
        |x: f64| 0.5 * TAU.sqrt() * (normal::cdf(2.0 * x) - normal::cdf(-4.0)) - (x + 2.0) * (-8.0_f64).exp();
    unnormalised(x.clamp(-2.0, 2.0)) / unnormalised(2.0)
}

/// The width and height of the film.
const SIZE: (u32, u32) = (40, 30);
/// The offset and the size of the crop.
const CROP: (u32, u32, u32, u32) = (5, 7, 12, 9);

fn film(filter: &str, sample_border: bool) -> HdrFilm {
    let (x, y, width, height) = CROP;
    let element = format!(
        r#"<film type="hdrfilm"><integer name="width" value="{}"/><integer name="height" value="{}"/>
           <integer name="crop_offset_x" value="{x}"/><integer name="crop_offset_y" value="{y}"/>
           <integer name="crop_width" value="{width}"/><integer name="crop_height" value="{height}"/>
           <boolean name="sample_border" value="{sample_border}"/>{filter}</film>"#,
        SIZE.0, SIZE.1
    );
    let document = xml::parse_element(&element).expect("the element is valid XML");
    FilmPlugin::read(&document, document.root).expect("the element is a film").format().clone()
}

/// The number of quantiles.
const POINTS: u32 = 2000;

/// The offsets from a pixel's centre at equidistant values of the random numbers.
fn offsets(film: &HdrFilm, (x, y): (u32, u32)) -> impl Iterator<Item = (f64, DVec2)> {
    let centre = DVec2::new(f64::from(CROP.0 + x) + 0.5, f64::from(CROP.1 + y) + 0.5);
    let steps = (0..POINTS).map(|i| (f64::from(i) + 0.5) / f64::from(POINTS));
    // The second number runs backwards, which detects exchanged axes.
    steps.map(move |u| (u, film.sample(x, y, DVec2::new(u, 1.0 - u)) - centre))
}

fn distribution(_: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for subject in &SUBJECTS {
        for sample_border in [false, true] {
            let film = film(subject.element, sample_border);
            for pixel in [(6, 4), (0, 4), (11, 8), (1, 0)] {
                let worst = offsets(&film, pixel).fold(0.0_f64, |worst, (u, offset)| {
                    let along = cut_below(subject, sample_border, pixel.0, CROP.2, offset.x) - u;
                    let down = cut_below(subject, sample_border, pixel.1, CROP.3, offset.y) - (1.0 - u);
                    worst.max(along.abs()).max(down.abs())
                });
                let border = if sample_border { "sampled" } else { "cut" };
                // Linear pieces of length h have an error of at most h²/12 max|f′| = 5e-6 in the Gaussian's
                // distribution function, and are exact for the other filters.
                let subject = format!("{}, pixel {pixel:?}, border {border}", subject.element);
                findings.push(Finding::error(subject, worst, 1e-5));
            }
        }
    }
    findings
}

/// The distribution function at an offset of the filter, truncated to the crop unless the border is sampled.
fn cut_below(subject: &Subject, sample_border: bool, index: u32, count: u32, offset: f64) -> f64 {
    let centre = f64::from(index) + 0.5;
    let reach = subject.radius;
    let (from, to) = if sample_border { (-reach, reach) } else { (-centre, f64::from(count) - centre) };
    let (from, to) = ((subject.below)(from), (subject.below)(to));
    ((subject.below)(offset) - from) / (to - from)
}

fn footprint(_: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for subject in &SUBJECTS {
        let film = film(subject.element, false);
        let (mut mean, mut square) = (DVec2::ZERO, DVec2::ZERO);
        for (_, offset) in offsets(&film, (6, 4)) {
            mean += offset / f64::from(POINTS);
            square += offset * offset / f64::from(POINTS);
        }
        let name = subject.element;
        findings.push(Finding::error(format!("{name}, mean"), mean.abs().max_element(), 1e-9));
        // The tolerance covers the midpoint rule in u, whose integrand has infinite slope at the ends.
        findings.push(Finding::value(format!("{name}, variance along x"), square.x, subject.variance, 1e-4));
        findings.push(Finding::value(format!("{name}, variance along y"), square.y, subject.variance, 1e-4));
    }
    // A tent of radius 1 truncated at -1/2 has the first moment 1/12 and the mass 7/8.
    let narrow = film(r#"<rfilter type="tent"/>"#, false);
    let mean = offsets(&narrow, (0, 4)).map(|(_, offset)| offset.x).sum::<f64>() / f64::from(POINTS);
    findings.push(Finding::value("tent, mean at the border", mean, 2.0 / 21.0, 1e-5));
    findings
}
