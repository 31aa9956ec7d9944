//! Laws of BSDFs, checked with every example of every plugin.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::{Bsdf, BsdfModel as _, Lobe, Query, TransportMode, fresnel};
use crate::{
    law::{Check, Effort, Finding, Law, worst},
    math::{Rgb, rng::Stream, warp},
    scene_file::xml,
    stats::{Chi2, Ks},
};

/// The laws of all BSDFs, and the closed forms of some.
pub const LAWS: &[Law] = &[
    Law {
        name: "bsdf/chi2",
        claim: "Sampled directions follow the pdf of the BSDF. Failed and delta samples are as frequent as its integral falls short of 1.",
        source: "Pearson's chi-square of a histogram against the integrated pdf; pooled cells are tested too",
        check: Check::Analytic(chi2),
    },
    Law {
        name: "bsdf/unit-length",
        claim: "Sampled directions have unit length.",
        source: "definition; detects a wrong radial warp, which a test of directions alone does not",
        check: Check::Analytic(unit_length),
    },
    Law {
        name: "bsdf/weight",
        claim: "A sample's weight is eval_cos / pdf.",
        source: "definition",
        check: Check::Analytic(weight),
    },
    Law {
        name: "bsdf/energy",
        claim: "The directional albedo towards the camera does not exceed 1 in any channel.",
        source: "conservation of energy; metal is not reciprocal, and its adjoint exceeds 1 at grazing incidence",
        check: Check::Analytic(energy),
    },
    Law {
        name: "bsdf/reciprocity",
        claim: "f(wi, wo) = f(wo, wi). For refraction f / eta² is symmetric, and importance transport is the adjoint of radiance transport.",
        source: "Helmholtz; Veach 1997, section 5.2",
        check: Check::Analytic(reciprocity),
    },
    Law {
        name: "bsdf/rough-albedo",
        claim: "A white rough conductor of roughness 0.3 reflects 0.87735842 at normal incidence with GGX, and 0.99975237 with Beckmann.",
        source: "∫ D(m) G₁(2θ) cos θ dm, one-dimensional quadrature of Walter et al. 2007 at normal incidence",
        check: Check::Analytic(rough_albedo),
    },
    Law {
        name: "bsdf/phong",
        claim: "The glossy lobe of the modified Phong model has the directional albedo of its closed form at exponents 1, 10 and 50 \
               and five angles. Its bihemispherical albedo follows from it.",
        source: "Stokes' theorem, with a recursion over the exponent; equal to a two-dimensional quadrature to 1e-9",
        check: Check::Analytic(phong),
    },
    Law {
        name: "bsdf/metal",
        claim: "The bsdf \"metal\" has the pdf and the distribution of its closed forms at roughness below and above 1. It has \
               the directional albedo of its closed form at roughness up to 1.",
        source: "the volume of the sphere by direction: ∫ s² ds along chords; below the horizon, the volume of a cap",
        check: Check::Analytic(metal),
    },
    Law {
        name: "bsdf/mask",
        claim: "A mask of opacity a has exactly a times the values and densities of its BSDF, and lets 1 - a of the light pass straight. \
               The opacity of a colour is its luminance.",
        source: "a A + (1 - a) B; the luminance of (0.9, 0.2, 0.1) is 0.212671 · 0.9 + 0.71516 · 0.2 + 0.072169 · 0.1",
        check: Check::Analytic(mask),
    },
    Law {
        name: "fresnel/schlick",
        claim: "At an index of 1.5, the greatest error of Schlick's approximation is 0.035693, at 84.975 degrees. It is the same from \
               inside, 0.059924 at 1.33 and 0.074036 at 2.4. The cosine-weighted mean is R0 + (1 - R0) / 21.",
        source: "a scan of the difference to Fresnel's equations; closed form of the mean",
        check: Check::Analytic(schlick),
    },
    Law {
        name: "fresnel/table",
        claim: "The Fresnel reflectance at an index of 1.5 is correct at normal incidence (0.04), Brewster's angle, 45, 60, 75 and 85 degrees, and total reflection.",
        source: "Born and Wolf 1999, section 1.5; numbers by independent evaluation to 8 digits",
        check: Check::Analytic(fresnel_table),
    },
    Law {
        name: "fresnel/hemispherical",
        claim: "The cosine-weighted Fresnel reflectance at an index of 1.5 is 0.09177796 from outside and 0.59634576 from inside.",
        source: "closed form from outside; from inside 1 - (1 - R) / n², by étendue",
        check: Check::Analytic(fresnel_hemispherical),
    },
    Law {
        name: "fresnel/conductor",
        claim: "The reflectance of a conductor matches its closed form at normal incidence. Gold reflects (0.967, 0.802, 0.324).",
        source: "Born and Wolf 1999, section 14.2; R = ((n-1)² + k²) / ((n+1)² + k²)",
        check: Check::Analytic(fresnel_conductor),
    },
];

/// The examples of all plugins, with a name for each.
fn examples() -> impl Iterator<Item = (String, Bsdf)> {
    Bsdf::PLUGINS.iter().flat_map(|plugin| {
        plugin
            .examples
            .iter()
            .enumerate()
            .map(|(i, example)| (format!("{} #{}", plugin.name, i + 1), from_xml(example)))
    })
}

fn from_xml(element: &str) -> Bsdf {
    let document = xml::parse_element(element).expect("examples are valid XML");
    Bsdf::read(&document, document.root).expect("examples are valid BSDFs")
}

/// Directions of incidence (θ, φ) in degrees: near normal, oblique, grazing, from behind.
const INCIDENCES: [(f64, f64); 5] = [(2.0, 10.0), (35.0, -40.0), (65.0, 100.0), (86.0, 200.0), (130.0, 60.0)];

fn queries() -> impl Iterator<Item = (f64, Query)> {
    INCIDENCES.into_iter().map(|(theta, phi)| {
        let (theta_r, phi_r): (f64, f64) = (theta.to_radians(), phi.to_radians());
        let wi = DVec3::new(theta_r.sin() * phi_r.cos(), theta_r.sin() * phi_r.sin(), theta_r.cos());
        (theta, Query { wi, uv: DVec2::splat(0.3), mode: TransportMode::Radiance })
    })
}

/// The numbers of histogram cells in the cosine and in the azimuth.
const CELLS: (usize, usize) = (24, 32);
/// The first and the greatest number of quadrature points along each side of a cell.
const POINTS: (usize, usize) = (24, 1536);

fn chi2(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(60_000);
    let mut findings = Vec::new();
    for (i, (name, bsdf)) in (0..).zip(examples()).filter(|(_, (_, bsdf))| bsdf.is_smooth()) {
        for (theta, query) in queries() {
            let expected = expected_counts(&bsdf, &query, f64::from(samples));
            let observed = observed_counts(&bsdf, &query, samples, Stream::at(&[11, i, query.wi.x.to_bits()]));
            let subject = format!("{name}, incidence {theta}°");
            findings.push(match Chi2::goodness_of_fit(&observed, &expected, 5.0, 1) {
                Some(test) => Finding::test(subject, format!("chi² = {:.1}, {} dof", test.statistic, test.dof), test.p),
                None => {
                    Finding::error(format!("{subject}: no direction may be sampled"), sampled_outside(&observed), 0.0)
                }
            });
        }
    }
    findings
}

/// The number of samples in cells where the pdf is zero.
fn sampled_outside(observed: &[u64]) -> f64 {
    observed[..observed.len() - 1].iter().sum::<u64>() as f64
}

/// The expected number of samples in each cell. The last number counts failed samples and delta lobes.
fn expected_counts(bsdf: &Bsdf, query: &Query, samples: f64) -> Vec<f64> {
    let mut expected: Vec<f64> = (0..CELLS.0 * CELLS.1).map(|cell| expected_in(bsdf, query, samples, cell)).collect();
    let kept: f64 = expected.iter().sum();
    expected.push((samples - kept).max(0.0));
    expected
}

/// The expected number of samples in a cell. The midpoint rule doubles its points, which are denser towards the upper
/// pole, until its error is small compared with the standard deviation of the count.
fn expected_in(bsdf: &Bsdf, query: &Query, samples: f64, cell: usize) -> f64 {
    let count = |points: usize| {
        let area = 2.0 * TAU / (CELLS.0 * CELLS.1 * points * points) as f64;
        let middle = |point: usize| (point as f64 + 0.5) / points as f64;
        let pdf = |j: usize| {
            let s = middle(j / points);
            let z = 2.0 * ((cell / CELLS.1 + 1) as f64 - s * s) / CELLS.0 as f64 - 1.0;
            let azimuth = TAU * ((cell % CELLS.1) as f64 + middle(j % points)) / CELLS.1 as f64;
            let radius = (1.0 - z * z).sqrt();
            2.0 * s * bsdf.pdf(query, DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), z)).0
        };
        samples * area * (0..points * points).map(pdf).sum::<f64>()
    };
    let (mut points, mut before) = (POINTS.0, count(POINTS.0));
    while points < POINTS.1 {
        points *= 2;
        let now = count(points);
        if (now - before).abs() <= 0.02 * now.max(1.0).sqrt() {
            // Where the pdf is smooth, the error falls with the square of the number of points (Richardson
            // extrapolation).
            return now + (now - before) / 3.0;
        }
        before = now;
    }
    before
}

fn observed_counts(bsdf: &Bsdf, query: &Query, samples: u32, mut stream: Stream) -> Vec<u64> {
    let mut observed = vec![0; CELLS.0 * CELLS.1 + 1];
    for _ in 0..samples {
        let sampled = bsdf.sample(query, stream.next_1d(), stream.next_2d());
        let cell = sampled.filter(|sample| sample.lobe == Lobe::Smooth).map_or(CELLS.0 * CELLS.1, |sample| {
            let z = (0.5 * (sample.wo.z + 1.0) * CELLS.0 as f64) as usize;
            let azimuth = sample.wo.y.atan2(sample.wo.x).rem_euclid(TAU) / TAU * CELLS.1 as f64;
            z.min(CELLS.0 - 1) * CELLS.1 + (azimuth as usize).min(CELLS.1 - 1)
        });
        observed[cell] += 1;
    }
    observed
}

/// Calls `visit` with samples of every example, for every incidence and both transport modes.
fn for_samples(mut visit: impl FnMut(&str, &Bsdf, &Query, &super::BsdfSample)) {
    for (name, bsdf) in examples() {
        let from_light = |(theta, query)| (theta, Query { mode: TransportMode::Importance, ..query });
        for (_, query) in queries().chain(queries().map(from_light)) {
            let mut stream = Stream::at(&[12, query.wi.x.to_bits()]);
            for _ in 0..2000 {
                if let Some(sample) = bsdf.sample(&query, stream.next_1d(), stream.next_2d()) {
                    visit(&name, &bsdf, &query, &sample);
                }
            }
        }
    }
}

fn unit_length(_: Effort) -> Vec<Finding> {
    worst(1e-12, |note| for_samples(|name, _, _, sample| note(name, (sample.wo.length() - 1.0).abs())))
}

fn weight(_: Effort) -> Vec<Finding> {
    worst(1e-9, |note| {
        for_samples(|name, bsdf, query, sample| {
            if sample.lobe == Lobe::Smooth {
                let pdf = bsdf.pdf(query, sample.wo);
                let expected = bsdf.eval_cos(query, sample.wo) / pdf.0;
                note(name, (sample.weight - expected).abs().max_element() / expected.max_element().max(1e-3));
                note(name, (sample.pdf.0 / pdf.0 - 1.0).abs());
            }
        });
    })
}

/// Uses quadrature for smooth lobes and the sum of the weights for delta lobes. The weights of refraction are those of
/// flux, because radiance may exceed 1 on refraction into a dense medium.
fn energy(_: Effort) -> Vec<Finding> {
    worst(2e-3, |note| {
        for (name, bsdf) in examples() {
            for (_, query) in queries() {
                note(&name, (smooth_albedo(&bsdf, &query) + delta_albedo(&bsdf, &query)).max_element() - 1.0);
            }
        }
    })
    .into_iter()
    .map(|finding| match finding.measured {
        // An albedo below 1 is not an excess.
        crate::law::Measured::Value { value, bound, .. } => Finding::error(finding.subject, value.max(0.0), bound),
        measured => Finding { measured, ..finding },
    })
    .collect()
}

fn smooth_albedo(bsdf: &Bsdf, query: &Query) -> Rgb {
    const N: usize = 256;
    let mut sum = Rgb::ZERO;
    for i in 0..N * N {
        let u = DVec2::new((i / N) as f64 + 0.5, (i % N) as f64 + 0.5) / N as f64;
        sum += bsdf.eval_cos(query, warp::square_to_sphere(u)) / (warp::SQUARE_TO_SPHERE_PDF * (N * N) as f64);
    }
    sum
}

/// The mean weight of sampled delta lobes, over evenly spaced values of `u1`.
fn delta_albedo(bsdf: &Bsdf, query: &Query) -> Rgb {
    const N: usize = 1000;
    let choices = (0..N).filter_map(|i| bsdf.sample(query, (i as f64 + 0.5) / N as f64, DVec2::splat(0.5)));
    let deltas = choices.filter(|sample| sample.lobe != Lobe::Smooth);
    deltas.map(|sample| sample.weight * (sample.eta * sample.eta / N as f64)).sum()
}

fn reciprocity(_: Effort) -> Vec<Finding> {
    worst(1e-9, |note| {
        for_samples(|name, bsdf, query, sample| {
            if query.mode == TransportMode::Importance {
                return;
            }
            let reverse = Query { wi: sample.wo, mode: TransportMode::Importance, ..*query };
            if sample.lobe == Lobe::Smooth {
                let there = bsdf.eval_cos(query, sample.wo) / sample.wo.z.abs();
                let back = bsdf.eval_cos(&reverse, query.wi) / query.wi.z.abs();
                note(name, (there - back).abs().max_element() / there.max_element());
                return;
            }
            let is_reverse = |back: &super::BsdfSample| back.wo.dot(query.wi) > 1.0 - 1e-9;
            let choices = (0..256).map(|i| (f64::from(i) + 0.5) / 256.0).chain([1e-9, 1.0 - 1e-9]);
            let mut choices = choices.filter_map(|u| bsdf.sample(&reverse, u, DVec2::splat(0.5)));
            let back = choices.find(is_reverse).expect("a delta direction has a reverse");
            let there = sample.weight * (sample.pdf.0 * sample.eta * sample.eta);
            let back = back.weight * back.pdf.0;
            note(name, (there - back).abs().max_element() / there.max_element());
        });
    })
}

fn mask(_: Effort) -> Vec<Finding> {
    let inner = r#"<bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf>"#;
    let bsdf = from_xml(inner);
    let opacities = [
        (r#"<float name="opacity" value="0.35"/>"#, 0.35),
        (r#"<rgb name="opacity" value="0.9, 0.2, 0.1"/>"#, 0.341_652_8),
        (r#"<float name="opacity" value="1.5"/>"#, 1.0),
    ];
    worst(1e-12, |note| {
        for (opacity, a) in opacities {
            let mask = from_xml(&format!(r#"<bsdf type="mask">{opacity}{inner}</bsdf>"#));
            for (_, query) in queries() {
                for wo in [DVec3::new(0.3, -0.2, 0.5).normalize(), DVec3::new(-0.4, 0.1, -0.6).normalize()] {
                    note("value", (mask.eval_cos(&query, wo) - a * bsdf.eval_cos(&query, wo)).abs().max_element());
                    note("pdf", (mask.pdf(&query, wo).0 - a * bsdf.pdf(&query, wo).0).abs());
                }
                let passed = (0..1000).filter_map(|i| {
                    let sample = mask.sample(&query, (f64::from(i) + 0.5) / 1000.0, DVec2::splat(0.4))?;
                    (sample.lobe == Lobe::Null).then_some(sample)
                });
                let (count, pdf) = passed.fold((0, None), |(count, _), sample| (count + 1, Some(sample.pdf.0)));
                note("pdf of passing straight", (pdf.unwrap_or(0.0) - (1.0 - a)).abs());
                note("share that passes straight", (f64::from(count) / 1000.0 - (1.0 - a)).abs().max(5e-4) - 5e-4);
            }
        }
    })
}

fn rough_albedo(_: Effort) -> Vec<Finding> {
    let normal_incidence =
        Query { wi: DVec3::new(1e-6, 0.0, 1.0).normalize(), uv: DVec2::ZERO, mode: TransportMode::Radiance };
    [("ggx", 0.877_358_42, 5e-4), ("beckmann", 0.999_752_37, 5e-4)]
        .into_iter()
        .map(|(distribution, expected, bound)| {
            let bsdf = from_xml(&format!(
                r#"<bsdf type="roughconductor"><string name="distribution" value="{distribution}"/>
                   <float name="alpha" value="0.3"/></bsdf>"#
            ));
            Finding::value(distribution, smooth_albedo(&bsdf, &normal_incidence).x, expected, bound)
        })
        .collect()
}

/// The directional albedo by the midpoint rule in the azimuth and in `s`, with a cosine of `1 - s²`.
fn albedo_at(bsdf: &Bsdf, cos: f64) -> f64 {
    const N: usize = 1200;
    let wi = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let query = Query { wi, uv: DVec2::ZERO, mode: TransportMode::Radiance };
    let value = |i: usize, j: usize| {
        let s = (i as f64 + 0.5) / N as f64;
        let z = 1.0 - s * s;
        // The other half of the azimuths is symmetric.
        let (sin, cos) = (0.5 * TAU * (j as f64 + 0.5) / N as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        2.0 * s * bsdf.eval_cos(&query, DVec3::new(radius * cos, radius * sin, z)).x
    };
    (0..N * N).map(|k| value(k / N, k % N)).sum::<f64>() * TAU / (N * N) as f64
}

/// The directional albedo of the glossy Phong lobe with an integer exponent.
fn phong_albedo(n: u32, theta: f64) -> f64 {
    let (sin, cos) = theta.sin_cos();
    // W_k = √π Γ((k + 1) / 2) / Γ(k / 2 + 1) = ∫ sinᵏ over half a turn.
    let wallis = |k: u32| {
        (0..k / 2).fold(if k.is_multiple_of(2) { PI } else { 2.0 }, |w, i| {
            let k = f64::from(k % 2 + 2 * i + 2);
            w * (k - 1.0) / k
        })
    };
    let (mut before, mut tau) = (2.0 * (PI - theta), 0.5 * PI * (1.0 + cos));
    if n == 1 {
        tau = before;
    }
    for k in 2..n {
        let next = (f64::from(k - 1) * before + cos * sin.powi(k as i32 - 1) * wallis(k - 1)) / f64::from(k + 1);
        (before, tau) = (tau, next);
    }
    (f64::from(n) * cos * tau + sin.powi(n as i32) * wallis(n)) / TAU
}

fn phong(_: Effort) -> Vec<Finding> {
    const TABLE: [(u32, f64, f64); 7] = [
        (10, 0.0, 1.0),
        (10, 30.0, 0.866_028_525_3),
        (10, 60.0, 0.504_735_946_7),
        (10, 80.0, 0.228_056_292_5),
        (10, 90.0, 0.123_046_875),
        (50, 60.0, 0.500_002_112_2),
        (50, 80.0, 0.180_808_032_7),
    ];
    let table = |(n, degrees, expected): (u32, f64, f64)| {
        let closed = phong_albedo(n, degrees.to_radians());
        Finding::value(format!("n = {n}, {degrees}°, the closed form"), closed, expected, 2e-9)
    };
    let mut findings: Vec<_> = TABLE.into_iter().map(table).collect();
    for (n, bihemispherical) in [(1, 0.737_402_20), (10, 0.673_502_60), (50, 0.667_386_38)] {
        let bsdf = from_xml(&format!(
            r#"<bsdf type="phong"><float name="diffuse_reflectance" value="0"/><float name="specular_reflectance" value="1"/>
               <float name="exponent" value="{n}"/></bsdf>"#
        ));
        for degrees in [0.0, 30.0, 60.0, 80.0, 89.9_f64] {
            let theta = degrees.to_radians();
            let subject = format!("n = {n}, {degrees}°");
            findings.push(Finding::value(subject, albedo_at(&bsdf, theta.cos()), phong_albedo(n, theta), 1e-5));
        }
        const N: usize = 20_000;
        let cos = |i: usize| (i as f64 + 0.5) / N as f64;
        let mean: f64 = (0..N).map(|i| 2.0 * cos(i) * phong_albedo(n, cos(i).acos())).sum::<f64>() / N as f64;
        findings.push(Finding::value(format!("n = {n}, bihemispherical"), mean, bihemispherical, 1e-7));
    }
    findings
}

fn metal_bsdf(roughness: f64) -> Bsdf {
    from_xml(&format!(r#"<bsdf type="metal"><float name="roughness" value="{roughness}"/></bsdf>"#))
}

fn metal(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    let normal_incidence = Query { wi: DVec3::Z, uv: DVec2::ZERO, mode: TransportMode::Radiance };
    let at = |cos: f64| DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    for (roughness, cos, expected) in
        [(0.3, 0.98, 3.879_505_292_9), (0.7, 0.9, 0.693_823_948_2), (1.0, 0.5, 0.079_577_471_5)]
    {
        let pdf = metal_bsdf(roughness).pdf(&normal_incidence, at(cos)).0;
        findings.push(Finding::value(format!("pdf, ρ = {roughness}, μ = {cos}"), pdf, expected, 1e-9));
    }
    // A direction at an obtuse angle to the mirror direction, at oblique incidence.
    let oblique = Query { wi: at(0.3), ..normal_incidence };
    let mirror = DVec3::new(-oblique.wi.x, 0.0, 0.3);
    let across = DVec3::new(mirror.z, 0.0, -mirror.x);
    let backwards = -0.5 * mirror + 0.75_f64.sqrt() * across;
    let pdf = metal_bsdf(1.5).pdf(&oblique, backwards).0;
    findings.push(Finding::value("pdf, ρ = 1.5, μ = -0.5", pdf, 0.008_975_772, 1e-9));
    for roughness in [0.05, 0.3, 0.7, 1.0_f64] {
        let bsdf = metal_bsdf(roughness);
        let mut stream = Stream::at(&[13, roughness.to_bits()]);
        let cosine =
            |_| bsdf.sample(&normal_incidence, stream.next_1d(), stream.next_2d()).map_or(0.0, |sample| sample.wo.z);
        let cosines: Vec<f64> = (0..effort.samples(20_000)).map(cosine).collect();
        let test = Ks::one_sample(&cosines, |cos| {
            cos * (roughness * roughness - 1.0 + cos * cos).max(0.0).powf(1.5) / roughness.powi(3)
        });
        let statistic = format!("D = {:.5}", test.statistic);
        findings.push(Finding::test(format!("distribution, ρ = {roughness}"), statistic, test.p));
    }
    // At roughness above 1, directions in the lower hemisphere are absorbed.
    let bsdf = metal_bsdf(1.5);
    let mut stream = Stream::at(&[14]);
    let kept =
        (0..effort.samples(20_000)).filter_map(|_| bsdf.sample(&normal_incidence, stream.next_1d(), stream.next_2d()));
    let cosines: Vec<f64> = kept.map(|sample| sample.wo.z).collect();
    // The antiderivative of the pdf over the cosine, up to a factor.
    let integral = |cos: f64| cos.powi(4) + 1.875 * cos * cos + cos * (1.25 + cos * cos).powf(1.5);
    let test = Ks::one_sample(&cosines, |cos| integral(cos) / integral(1.0));
    findings.push(Finding::test("distribution, ρ = 1.5", format!("D = {:.5}", test.statistic), test.p));
    for (roughness, degrees, expected) in [(0.3, 80.0, 0.885_638), (0.3, 89.0, 0.543_582), (1.0, 60.0, 0.843_75_f64)] {
        let cos = f64::to_radians(degrees).cos();
        let z: f64 = cos / roughness;
        let closed = 1.0 - 0.25 * (2.0 - 3.0 * z + z * z * z);
        let subject = format!("albedo, ρ = {roughness}, {degrees}°");
        findings.push(Finding::value(format!("{subject}, the closed form"), closed, expected, 1e-6));
        findings.push(Finding::value(subject, albedo_at(&metal_bsdf(roughness), cos), closed, 1e-4));
    }
    findings
}

fn schlick(_: Effort) -> Vec<Finding> {
    const N: usize = 90_000;
    let degrees = |i: usize| 90.0 * i as f64 / N as f64;
    let error = |degrees: f64, eta: f64| {
        let cos = degrees.to_radians().cos();
        fresnel::schlick(cos, eta).reflectance - fresnel::dielectric(cos, eta).reflectance
    };
    let greatest = |eta: f64, sign: f64| {
        (0..N).map(degrees).max_by(|a, b| (sign * error(*a, eta)).total_cmp(&(sign * error(*b, eta)))).unwrap_or(0.0)
    };
    let mut findings = Vec::new();
    for (eta, angle, expected) in [(1.5, 84.975, 0.035_693), (1.33, 83.787, 0.059_924), (2.4, 84.538, 0.074_036)] {
        let at = greatest(eta, 1.0);
        findings.push(Finding::value(format!("n = {eta}, greatest error"), error(at, eta), expected, 1e-6));
        findings.push(Finding::value(format!("n = {eta}, at degrees"), at, angle, 2e-3));
        // From inside, the error at the refracted angle is the same.
        let cos = -(at.to_radians().sin() / eta).asin().cos();
        let inside = fresnel::schlick(cos, eta).reflectance - fresnel::dielectric(cos, eta).reflectance;
        findings.push(Finding::value(format!("n = {eta}, from inside"), inside, expected, 1e-6));
    }
    let at = greatest(1.5, -1.0);
    findings.push(Finding::value("n = 1.5, greatest negative error", error(at, 1.5), -0.019_626, 1e-6));
    let worst_inside = (0..N)
        .map(|i| -degrees(i).to_radians().cos())
        .map(|cos| (fresnel::schlick(cos, 1.5).reflectance - fresnel::dielectric(cos, 1.5).reflectance).abs())
        .fold(0.0, f64::max);
    findings.push(Finding::value("n = 1.5, greatest error from inside", worst_inside, 0.035_693, 1e-5));
    let cos = |i: usize| (i as f64 + 0.5) / N as f64;
    let mean: f64 = (0..N).map(|i| 2.0 * cos(i) * fresnel::schlick(cos(i), 1.5).reflectance).sum::<f64>() / N as f64;
    findings.push(Finding::value("n = 1.5, mean", mean, 0.085_714_29, 1e-8));
    findings
}

fn fresnel_table(_: Effort) -> Vec<Finding> {
    const TABLE: [(f64, f64); 5] =
        [(0.0, 0.04), (45.0, 0.050_239_91), (60.0, 0.089_186_71), (75.0, 0.253_060_56), (85.0, 0.612_799_65)];
    let reflectance = |degrees: f64| fresnel::dielectric(degrees.to_radians().cos(), 1.5).reflectance;
    let mut findings: Vec<_> = TABLE
        .into_iter()
        .map(|(degrees, expected)| Finding::value(format!("{degrees}°"), reflectance(degrees), expected, 1e-8))
        .collect();
    // At Brewster's angle only the perpendicular polarisation is reflected: ((n² - 1) / (n² + 1))² / 2.
    let brewster = 1.5_f64.atan();
    let half = 0.5 * (1.25_f64 / 3.25).powi(2);
    findings.push(Finding::value("Brewster, 56.309932°", reflectance(brewster.to_degrees()), half, 1e-14));
    let from_inside = |degrees: f64| fresnel::dielectric(-degrees.to_radians().cos(), 1.5);
    findings.push(Finding::value("inside, 41.82°: total", from_inside(41.82).reflectance, 1.0, 0.0));
    findings.push(Finding::value("inside, 41.80°: partial", from_inside(41.80).reflectance, 0.890_771_921_5, 1e-9));
    // The reflectance is the same from both sides of a refracted ray.
    let t = (45.0_f64.to_radians().sin() / 1.5).asin();
    findings.push(Finding::value("inside, 45° refracted", from_inside(t.to_degrees()).reflectance, 0.050_239_91, 1e-8));
    findings
}

/// `∫ R 2 c dc` by the midpoint rule, fine enough for the kink at the critical angle.
fn fresnel_hemispherical(_: Effort) -> Vec<Finding> {
    const N: usize = 1_000_000;
    let mean = |eta: f64| {
        let sum: f64 = (0..N)
            .map(|i| (i as f64 + 0.5) / N as f64)
            .map(|c| fresnel::dielectric(c, eta).reflectance * 2.0 * c)
            .sum();
        sum / N as f64
    };
    vec![
        Finding::value("from outside", mean(1.5), 0.091_777_96, 1e-8),
        Finding::value("from inside", mean(1.0 / 1.5), 0.596_345_76, 2e-8),
    ]
}

fn fresnel_conductor(_: Effort) -> Vec<Finding> {
    let (eta, k) = (Rgb::new(0.2, 1.0, 3.0), Rgb::new(3.9, 2.0, 0.5));
    let normal_incidence = fresnel::conductor(1.0, eta, k);
    let mut findings: Vec<_> = (0..3)
        .map(|i| {
            let expected = ((eta[i] - 1.0).powi(2) + k[i] * k[i]) / ((eta[i] + 1.0).powi(2) + k[i] * k[i]);
            Finding::value(
                format!("n = {}, k = {}, normal incidence", eta[i], k[i]),
                normal_incidence[i],
                expected,
                1e-14,
            )
        })
        .collect();
    let gold = from_xml(r#"<bsdf type="conductor"><string name="material" value="Au"/></bsdf>"#).albedo(DVec2::ZERO);
    for (i, expected) in [0.967, 0.802, 0.324].into_iter().enumerate() {
        findings.push(Finding::value(format!("Au, channel {i}"), gold[i], expected, 1e-3));
    }
    findings
}
