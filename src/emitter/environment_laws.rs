//! Laws of environments that are images, in closed form.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3};

use super::{EmitterModel as _, EnvMap};
use crate::{
    law::{Check, Effort, Finding, Law, worst},
    math::{Frame, Rgb, cos_theta, rng::Stream, warp},
    stats::{Chi2, Moments},
};

/// The laws of environments.
pub const LAWS: &[Law] = &[
    Law {
        name: "environment/irradiance",
        claim: "The irradiance on an oblique plane under a uniform map, under one bright texel, and under a map that is linear in the \
                direction equals its closed form, by emitter sampling and by cosine sampling, also if the map is turned or mirrored.",
        source: "E = π L; products of the integrals of hat functions with sines; E = π a + (2π/3) b·n for L = a + b·ω",
        check: Check::Analytic(irradiance),
    },
    Law {
        name: "environment/lookup",
        claim: "In the direction of a texel's centre, the map has the texel's radiance, also in the rows of the poles. Both sides of the \
                seam have the same radiance. A turned map equals a turned direction.",
        source: "Mitsuba's latitude-longitude format: longitude 2π (x + ½) / W, colatitude π y / (H - 1)",
        check: Check::Analytic(lookup),
    },
    Law {
        name: "environment/chi2",
        claim: "Directions to the environment are sampled with the stated pdf, also if its transform shears. The pdf of a sample is the pdf \
                of its direction. Directions to a uniform map are sampled uniformly.",
        source: "Pearson's chi-square test of counts in cells of equal solid angle; a pdf of 1/4π, up to the linear \
                interpolation of a sine",
        check: Check::Analytic(chi2),
    },
];

/// The size of the map with one bright texel, and its position.
const SIZE: [usize; 2] = [16, 9];
const BRIGHT: [usize; 2] = [0, 3];
const RADIANCE: Rgb = Rgb::new(3.0, 7.0, 0.5);

/// The local direction of a longitude from -z towards +x, and a colatitude from +y.
fn local_direction(longitude: f64, colatitude: f64) -> DVec3 {
    let (sin, cos) = colatitude.sin_cos();
    DVec3::new(sin * longitude.sin(), cos, -sin * longitude.cos())
}

/// The longitude and the colatitude of the centre of a texel.
fn angles([width, height]: [usize; 2], x: usize, y: usize) -> (f64, f64) {
    (TAU * (x as f64 + 0.5) / width as f64, PI * y as f64 / (height - 1) as f64)
}

fn environment(size: [usize; 2], to_world: DMat3, radiance: impl Fn(usize, usize) -> Rgb) -> EnvMap {
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    EnvMap::new(size, texels.map(|(x, y)| radiance(x, y).as_vec3().to_array()).collect(), to_world)
}

fn one_bright_texel(to_world: DMat3) -> EnvMap {
    environment(SIZE, to_world, |x, y| if [x, y] == BRIGHT { RADIANCE } else { Rgb::ZERO })
}

/// Turned and mirrored, so that a transposed or unflipped matrix gives another image.
fn turned() -> [(&'static str, DMat3); 2] {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    [("turned", turn), ("mirrored", turn * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)))]
}

/// The irradiance on a plane with a local normal, whose horizon the bright texel does not reach. The texel is a product
/// of hats of the widths `a` in longitude and `h` in colatitude. The integral of a hat times a cosine or sine of `k x`
/// is its value at the centre times `2 (1 - cos k h) / (k² h)`.
fn irradiance_of_texel(n: DVec3) -> Rgb {
    let (longitude, colatitude) = angles(SIZE, BRIGHT[0], BRIGHT[1]);
    let (a, h) = (TAU / SIZE[0] as f64, PI / (SIZE[1] - 1) as f64);
    let across = 2.0 * (1.0 - a.cos()) / a;
    let double = h.sin().powi(2) / h;
    let sin_squared = 0.5 * (h - double * (2.0 * colatitude).cos());
    let sin_cos = 0.5 * double * (2.0 * colatitude).sin();
    let (sin, cos) = longitude.sin_cos();
    RADIANCE * (across * sin_squared * (n.x * sin - n.z * cos) + a * sin_cos * n.y)
}

fn irradiance(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    let gradient = [DVec3::new(0.3, -0.2, 0.4), DVec3::new(0.1, 0.5, -0.2), DVec3::new(-0.6, 0.1, 0.3)];
    let linear = |direction: DVec3| Rgb::from(gradient.map(|b| 1.0 + b.dot(direction)));
    let n = DVec3::new(0.4, 0.7, -0.6).normalize();
    for (name, to_world) in turned() {
        let uniform = environment([4, 3], to_world, |_, _| RADIANCE);
        // Interpolation between 512 x 257 texels errs by 1e-5.
        let size = [512, 257];
        let smooth = environment(size, to_world, |x, y| {
            let (longitude, colatitude) = angles(size, x, y);
            linear(local_direction(longitude, colatitude))
        });
        let flux_of_linear = Rgb::from(gradient.map(|b| PI + TAU / 3.0 * b.dot(n)));
        let subjects = [
            ("uniform", uniform, PI * RADIANCE),
            ("one texel", one_bright_texel(to_world), irradiance_of_texel(n)),
            ("linear", smooth, flux_of_linear),
        ];
        for (map, environment, expected) in subjects {
            findings.extend(both_estimates(&format!("{map}, {name}"), &environment, to_world * n, expected, effort));
        }
    }
    findings
}

/// Tests the irradiance on a plane by emitter sampling, and by sampling the cosine.
fn both_estimates(subject: &str, environment: &EnvMap, n: DVec3, expected: Rgb, effort: Effort) -> Vec<Finding> {
    let (mut by_emitter, mut by_cosine) = ([Moments::default(); 3], [Moments::default(); 3]);
    let frame = Frame::from_normal(n);
    let mut stream = Stream::at(&[75]);
    for _ in 0..effort.samples(40_000) {
        let sampled = environment.sample_direction(None, DVec3::ZERO, stream.next_2d());
        let light = sampled.map_or(Rgb::ZERO, |sample| {
            sample.value * (n.dot(sample.direction).max(0.0) / sample.pdf.map_or(1.0, |pdf| pdf.0))
        });
        by_emitter.iter_mut().zip(light.to_array()).for_each(|(moments, x)| moments.push(x));
        let direction = frame.to_world(warp::square_to_cosine_hemisphere(stream.next_2d()));
        let light = PI * environment.environment_radiance(direction);
        by_cosine.iter_mut().zip(light.to_array()).for_each(|(moments, x)| moments.push(x));
    }
    let estimates = [("emitter", by_emitter), ("cosine", by_cosine)];
    let test = |(by, moments): &(&str, [Moments; 3])| {
        let finding = |(i, channel)| Finding::mean(format!("{subject}, by {by}, {channel}"), &moments[i], expected[i]);
        ["R", "G", "B"].into_iter().enumerate().map(finding).collect::<Vec<_>>()
    };
    estimates.iter().flat_map(test).collect()
}

fn lookup(_: Effort) -> Vec<Finding> {
    let colour = |x: usize, y: usize| Rgb::new(x as f64 + 1.0, (y * y) as f64, (x * y % 5) as f64);
    let upright = environment(SIZE, DMat3::IDENTITY, colour);
    let mut findings = worst(1e-5, |note| {
        for y in 1..SIZE[1] - 1 {
            for x in 0..SIZE[0] {
                let (longitude, colatitude) = angles(SIZE, x, y);
                let found = upright.environment_radiance(local_direction(longitude, colatitude));
                note("centres of texels", (found - colour(x, y)).abs().max_element());
            }
        }
        for (y, colatitude) in [(0, 1e-9), (SIZE[1] - 1, PI - 1e-9)] {
            let found = upright.environment_radiance(local_direction(angles(SIZE, 5, y).0, colatitude));
            note("poles", (found - colour(5, y)).abs().max_element());
        }
        for colatitude in [0.3, 1.1, 2.8] {
            let beside = |step: f64| upright.environment_radiance(local_direction(step, colatitude));
            let at_seam = angles(SIZE, 0, 0).0;
            note("seam", (beside(1e-9) - beside(-1e-9)).abs().max_element());
            note("first column", (beside(at_seam + 1e-9) - beside(at_seam - 1e-9)).abs().max_element());
        }
    });
    findings.extend(worst(1e-9, |note| {
        let mut stream = Stream::at(&[76]);
        for (name, to_world) in turned() {
            let environment = environment(SIZE, to_world, colour);
            for _ in 0..200 {
                let local = warp::square_to_sphere(stream.next_2d());
                let expected = upright.environment_radiance(local);
                note(name, (environment.environment_radiance(to_world * local) - expected).abs().max_element());
            }
        }
    }));
    findings
}

/// Cells of equal solid angle: bands of equal height, and sectors.
const CELLS: [usize; 2] = [10, 12];

fn cell_of(direction: DVec3) -> usize {
    let band = (0.5 * (1.0 + cos_theta(direction)) * CELLS[0] as f64) as usize;
    let sector = (direction.y.atan2(direction.x).rem_euclid(TAU) / TAU * CELLS[1] as f64) as usize;
    band.min(CELLS[0] - 1) * CELLS[1] + sector.min(CELLS[1] - 1)
}

fn chi2(effort: Effort) -> Vec<Finding> {
    let shear = DMat3::from_cols(DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.3, -1.4, 0.1), DVec3::new(0.0, 0.5, 0.8));
    let uneven = |x: usize, y: usize| Rgb::splat(((7 * x + 3 * y) % 5 * (x % 3)) as f64);
    let [(_, turn), _] = turned();
    let subjects = [
        ("turned", environment(SIZE, turn, uneven)),
        ("sheared", environment(SIZE, shear, uneven)),
        ("one texel", one_bright_texel(turn)),
    ];
    let samples = effort.samples(40_000);
    let tests = subjects.iter().zip(0..).map(|((name, environment), i)| chi2_of(name, environment, samples, i));
    let mut findings: Vec<Finding> = tests.collect();
    findings.extend(worst(1e-9, |note| {
        for (name, environment) in &subjects {
            for [pdf, again] in sampled_pdfs(environment) {
                note(&format!("{name}, pdf of samples"), (pdf / again - 1.0).abs());
            }
        }
    }));
    // At its nodes the interpolated sine is right, and its integral over half a period is h / tan(h / 2) instead of 2.
    let uniform = environment([64, 33], turn, |_, _| RADIANCE);
    let h = PI / 32.0;
    findings.extend(worst(2.0 * (0.5 * h).tan() / h - 1.0 + 1e-6, |note| {
        sampled_pdfs(&uniform).for_each(|[pdf, _]| note("uniform map", (4.0 * PI * pdf - 1.0).abs()));
    }));
    findings
}

/// The pdf of some sampled directions: of the sample, and of the direction.
fn sampled_pdfs(environment: &EnvMap) -> impl Iterator<Item = [f64; 2]> {
    let mut stream = Stream::at(&[78]);
    (0..500).filter_map(move |_| {
        let sample = environment.sample_direction(None, DVec3::ZERO, stream.next_2d())?;
        let again = environment.pdf_direction(None, DVec3::ZERO, sample.direction, None).0;
        Some([sample.pdf?.0, again])
    })
}

fn chi2_of(name: &str, environment: &EnvMap, samples: u32, number: u64) -> Finding {
    const POINTS: usize = 48;
    let pdf = |direction| environment.pdf_direction(None, DVec3::ZERO, direction, None).0;
    let middle = |i: usize, count: usize| (i as f64 + 0.5) / count as f64;
    let (bands, sectors) = (CELLS[0] * POINTS, CELLS[1] * POINTS);
    let mut expected = vec![0.0; CELLS[0] * CELLS[1]];
    for point in 0..bands * sectors {
        let u = DVec2::new(middle(point % sectors, sectors), middle(point / sectors, bands));
        let z = 2.0 * u.y - 1.0;
        let direction = (DVec2::from_angle(TAU * u.x) * (1.0 - z * z).sqrt()).extend(z);
        let cell = point / sectors / POINTS * CELLS[1] + point % sectors / POINTS;
        expected[cell] += f64::from(samples) * pdf(direction) * 4.0 * PI / (bands * sectors) as f64;
    }
    let mut observed = vec![0; CELLS[0] * CELLS[1]];
    let mut stream = Stream::at(&[77, number]);
    for _ in 0..samples {
        let sampled = environment.sample_direction(None, DVec3::ZERO, stream.next_2d());
        sampled.into_iter().for_each(|sample| observed[cell_of(sample.direction)] += 1);
    }
    match Chi2::goodness_of_fit(&observed, &expected, 5.0, 1) {
        Some(test) => Finding::test(name, format!("chi² = {:.1}, {} dof", test.statistic, test.dof), test.p),
        None => Finding::error(format!("{name}: too few cells"), f64::NAN, 0.0),
    }
}
