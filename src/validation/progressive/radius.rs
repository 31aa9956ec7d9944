//! The shrinking of radii, against products and Stirling's series.

use std::f64::consts::{FRAC_2_SQRT_PI, TAU};

use super::squares_of_passes;
use crate::{
    law::{Check, Effort, Finding, Law, worst},
    photon::radius::{PixelRadius, of_pass},
};

/// The law of the radii.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/radius",
    claim: "The squared radii of passes follow r² (i + α) / (i + 1) and tend to i^(α-1) / Γ(1+α) times the first. The squared radii of \
            a pixel preserve its photon density. They tend to i^(α-1) / Γ(α) under uniform light, where the photon count is \
            proportional to the disc's area. They are Γ(n+1) Γ(1/α) / Γ(n+1/α) if each pass finds the same number of photons.",
    source: "Knaus and Zwicker 2011, eq. (15); Hachisuka and Jensen 2009, eq. (3) and (4); products step by step; Γ by Stirling's \
             series",
    check: Check::Analytic(radii),
}];

const ALPHAS: [f64; 3] = [0.5, 2.0 / 3.0, 0.8];
const PASSES: u32 = 100_000;

fn radii(_: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    // Γ(3/2) = √π / 2. The other value has five digits.
    for (alpha, name, number, bound) in [(0.5, "1/2", FRAC_2_SQRT_PI, 1e-14), (2.0 / 3.0, "2/3", 1.107_73, 5e-6)] {
        findings.push(Finding::value(format!("1 / Γ(1 + {name})"), (-ln_gamma(1.0 + alpha)).exp(), number, bound));
    }
    for alpha in ALPHAS {
        let name = format!("α = {alpha:.3}");
        // The next term of the series of Γ(i + α) / Γ(i + 1), plus a tenth for the later terms.
        let n = f64::from(PASSES);
        let bound = 1.1 * alpha * (1.0 - alpha) / (2.0 * n);
        let scaled = of_pass(PASSES - 1, alpha) * n.powf(1.0 - alpha);
        let limit = (-ln_gamma(1.0 + alpha)).exp();
        findings.push(Finding::value(format!("{name}, pass {PASSES} over its power"), scaled, limit, bound * limit));
        let even = pixel_radii(alpha, |squared| (1e9 * squared).round() as u32).1 * 1000_f64.powf(1.0 - alpha);
        let limit = (-ln_gamma(alpha)).exp();
        let bound = 1.1 * alpha * (1.0 - alpha) / 2000.0;
        findings.push(Finding::value(format!("{name}, a pixel in uniform light"), even, limit, bound * limit));
        let (kept, equal) = pixel_radii(alpha, |_| 1000);
        let exact = (ln_gamma(1001.0) + ln_gamma(alpha.recip()) - ln_gamma(1000.0 + alpha.recip())).exp();
        findings.push(Finding::value(format!("{name}, a pixel with equal photon counts"), equal, exact, 1e-10 * exact));
        let uneven = pixel_radii(alpha, |squared| (4.0 * (1e6 * squared).fract()) as u32).0;
        findings.push(Finding::error(format!("{name}, photon density of pixels"), kept.max(uneven), 1e-11));
    }
    findings.extend(worst(1e-9, |note| {
        for alpha in ALPHAS {
            for (pass, product) in (0..PASSES).zip(squares_of_passes(alpha)) {
                note("passes against the product", (of_pass(pass, alpha) / product - 1.0).abs());
            }
        }
    }));
    findings
}

/// Runs a pixel through 1000 passes, each of which finds `count(squared radius)` photons.
///
/// Returns the largest relative error of the pixel's photon density, compared with the density of all found photons in
/// the discs of their passes, and the final squared radius.
fn pixel_radii(alpha: f64, count: impl Fn(f64) -> u32) -> (f64, f64) {
    let (mut radius, mut density, mut worst) = (PixelRadius::FIRST, 0.0, 0.0_f64);
    for _ in 0..1000 {
        let found = count(radius.squared);
        density += f64::from(found) / radius.squared;
        radius = radius.after(found, alpha);
        if density > 0.0 {
            worst = worst.max((radius.photons / radius.squared / density - 1.0).abs());
        }
    }
    (worst, radius.squared)
}

/// ln Γ by Stirling's series, applied above 20, where its fifth term is below 1e-15.
/// Abramowitz and Stegun 1972, 6.1.41.
fn ln_gamma(x: f64) -> f64 {
    if x < 20.0 {
        return ln_gamma(x + 1.0) - x.ln();
    }
    let y = x.recip();
    let series = y / 12.0 - y.powi(3) / 360.0 + y.powi(5) / 1260.0 - y.powi(7) / 1680.0;
    (x - 0.5) * x.ln() - x + 0.5 * TAU.ln() + series
}
