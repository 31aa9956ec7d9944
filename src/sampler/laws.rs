//! Laws of samplers.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use glam::DVec2;

use super::{Address, SampleStream as _, Sampler, SamplerModel as _};
use crate::{
    law::{Check, Effort, Finding, Law},
    scene_file::{Plugin, xml},
    stats::{Chi2, Moments},
};

/// The laws of samplers.
pub const LAWS: &[Law] = &[
    Law {
        name: "sampler/variance",
        claim: "The mean of 64 samples of a smooth function on the unit square is unbiased for every sampler. Its variance is at most \
               the variance with 64 jittered cells, or for independent sampling with independent numbers.",
        source: "variances by quadrature over the square and over its 8 by 8 cells; chi-square of the squared errors",
        check: Check::Analytic(variance),
    },
    Law {
        name: "sampler/dimensions",
        claim: "The numbers of one path are uncorrelated: products of coordinates of different dimensions have the mean 1/4, for 64 \
               samples and for 60, which is not a square number.",
        source: "∫ x y dx dy over the unit square",
        check: Check::Analytic(dimensions),
    },
];

/// The number of samples per estimate: 8 by 8 cells.
const SAMPLES: u32 = 64;
const CELLS: usize = 8;

fn integrand(u: DVec2) -> f64 {
    (FRAC_PI_2 * u.x).sin() * (0.5 + u.y) + 0.3 * u.x
}

/// `∫ sin (πx/2) dx = 2/π`, and 1 and 1/2 for the other factors.
const INTEGRAL: f64 = FRAC_2_PI + 0.15;

/// The variance of a single sample that is uniform in a cell, averaged over `cells` by `cells` cells, by the midpoint
/// rule.
fn variance_within(cells: usize) -> f64 {
    const N: usize = 512;
    let per_cell = N / cells;
    let one_cell = |cell: usize| {
        let point = |k: usize| {
            let column = cell % cells * per_cell + k % per_cell;
            let row = cell / cells * per_cell + k / per_cell;
            integrand(DVec2::new(column as f64 + 0.5, row as f64 + 0.5) / N as f64)
        };
        let moments: Moments = (0..per_cell * per_cell).map(point).collect();
        moments.m2 / moments.n as f64
    };
    (0..cells * cells).map(one_cell).sum::<f64>() / (cells * cells) as f64
}

fn variance(effort: Effort) -> Vec<Finding> {
    let variances = [variance_within(1), variance_within(CELLS)].map(|variance| variance / f64::from(SAMPLES));
    let mut findings = Vec::new();
    for plugin in Sampler::PLUGINS {
        let sampler = from_example(plugin);
        let bound = if plugin.name == "independent" { variances[0] } else { variances[1] };
        // Estimates are independent over pixels and over replicates.
        for (what, pixels, replicates) in [("pixels", effort.samples(2000), 1), ("replicates", 1, effort.samples(2000))]
        {
            for skipped in [0, 5] {
                let name = format!("{}, over {what}, dimension {skipped}", plugin.name);
                let addresses = (0..pixels)
                    .flat_map(|pixel| (0..replicates).map(move |replicate| (u64::from(pixel), u64::from(replicate))));
                let means: Vec<f64> = addresses.map(|address| estimate(&sampler, address, skipped)).collect();
                findings.push(Finding::mean(format!("{name}, mean"), &means.iter().copied().collect(), INTEGRAL));
                let z: Vec<f64> = means.iter().map(|mean| (mean - INTEGRAL) / bound.sqrt()).collect();
                let test = Chi2::sum_of_squares(&z);
                let statistic = format!("{:.4} of the bound", test.statistic / test.dof);
                findings.push(Finding::test(format!("{name}, variance"), statistic, test.p));
            }
        }
    }
    findings
}

fn dimensions(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for plugin in Sampler::PLUGINS {
        let sampler = from_example(plugin);
        for samples in [60, 64] {
            let mut products = [Moments::default(); 7];
            for pixel in 0..effort.samples(500) {
                let means = mean_products(&sampler, u64::from(pixel), samples);
                products.iter_mut().zip(means).for_each(|(moments, mean)| moments.push(mean));
            }
            for (name, found) in ["a x", "a y", "x y", "x u", "x v", "y u", "y v"].into_iter().zip(&products) {
                findings.push(Finding::mean(format!("{}, {samples} samples, {name}", plugin.name), found, 0.25));
            }
        }
    }
    findings
}

/// Means over the samples of a pixel of the products of a number `a` and two points `(x, y)` and `(u, v)`, in this
/// order of dimensions.
fn mean_products(sampler: &Sampler, pixel: u64, samples: u32) -> [f64; 7] {
    let mut sums = [0.0; 7];
    for sample in 0..samples {
        let mut sampler = sampler.path_sampler(&Address { seed: 71, replicate: 0, pixel, sample, samples });
        let (a, p, q) = (sampler.next_1d(), sampler.next_2d(), sampler.next_2d());
        let products = [a * p.x, a * p.y, p.x * p.y, p.x * q.x, p.x * q.y, p.y * q.x, p.y * q.y];
        sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += product / f64::from(samples));
    }
    sums
}

fn from_example(plugin: &Plugin) -> Sampler {
    let document = xml::parse_element(plugin.examples[0]).expect("examples are valid XML");
    Sampler::read(&document, document.root).expect("examples are valid samplers")
}

/// The mean of the integrand over the samples of one pixel in one replicate, after `skipped` dimensions.
fn estimate(sampler: &Sampler, (pixel, replicate): (u64, u64), skipped: usize) -> f64 {
    let sum: f64 = (0..SAMPLES)
        .map(|sample| {
            let mut sampler = sampler.path_sampler(&Address { seed: 70, replicate, pixel, sample, samples: SAMPLES });
            for _ in 0..skipped {
                sampler.next_1d();
            }
            integrand(sampler.next_2d())
        })
        .sum();
    sum / f64::from(SAMPLES)
}
