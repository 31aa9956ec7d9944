//! Spectra as linear RGB, by the rule of Mitsuba's RGB variants.
//!
//! A spectrum is piecewise linear between pairs of wavelength and value, and 0 outside. Its colour is the sum of its
//! product with the CIE's colour matching functions at 1000 wavelengths from 360 to 830 nm, both ends included. All but
//! light is also multiplied by the illuminant D65, so that a white reflectance is white.

mod cie;
mod file;
pub mod laws;
mod planck;

pub use file::read_spd;
pub use planck::blackbody_to_rgb;

use glam::DMat3;

use crate::math::Rgb;
use cie::{D65, SAMPLES, XYZ};

/// The range of the colour matching functions, in nm.
pub const WAVELENGTHS: (f64, f64) = (360.0, 830.0);

/// What the values of a spectrum are, which determines their colour. No channel is negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Reflectances or transmittances; colours are clipped to [0, 1].
    Reflectance,
    /// The emission of a light.
    Light,
    /// Indices of refraction, or other numbers without an upper limit.
    Index,
}

/// The luminance of a flat spectrum of 1.
const FLAT: f64 = 106.750_259_399_414_06;
/// The luminance of the tabulated D65, over that of a flat spectrum of 1.
const WHITE: f64 = 98.997_417_518_762_55;
/// The number of wavelengths in a sum.
const STEPS: u32 = 1000;

/// The colour of a spectrum in linear RGB, given pairs of wavelength in nm and value, by rising wavelength.
#[must_use]
pub fn to_rgb(pairs: &[(f64, f64)], quantity: Quantity) -> Rgb {
    integrate(|wavelength| interpolate(pairs, wavelength), quantity)
}

/// The colour of a spectrum with one value at all wavelengths: grey, except for light, where it is not D65.
#[must_use]
pub fn uniform_to_rgb(value: f64, quantity: Quantity) -> Rgb {
    match quantity {
        Quantity::Reflectance | Quantity::Index => Rgb::splat(value),
        Quantity::Light => value * xyz_to_rgb(Rgb::ONE),
    }
}

/// Checks that wavelengths rise, and that there are at least two.
///
/// # Errors
/// What is wrong, without a place.
pub fn check_pairs(pairs: &[(f64, f64)]) -> Result<(), String> {
    if pairs.len() < 2 {
        return Err(format!("a spectrum needs 2 pairs of wavelength and value, got {}", pairs.len()));
    }
    match pairs.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
        Some(pair) => Err(format!("the wavelength {} does not rise above {}", pair[1].0, pair[0].0)),
        None => Ok(()),
    }
}

/// The sum over the colour matching functions.
fn integrate(value: impl Fn(f64) -> f64, quantity: Quantity) -> Rgb {
    let (first, last) = WAVELENGTHS;
    let mut xyz = Rgb::ZERO;
    for i in 0..STEPS {
        let wavelength = first + f64::from(i) / f64::from(STEPS - 1) * (last - first);
        let (i, t) = interval(wavelength);
        let white = D65[i] + (D65[i + 1] - D65[i]) * t;
        let weight = if quantity == Quantity::Light { 1.0 } else { white / WHITE };
        xyz += Rgb::from(XYZ[i]).lerp(Rgb::from(XYZ[i + 1]), t) * (weight * value(wavelength));
    }
    let rgb = xyz_to_rgb(xyz * ((last - first) / (f64::from(STEPS) * FLAT)));
    if quantity == Quantity::Reflectance { rgb.clamp(Rgb::ZERO, Rgb::ONE) } else { rgb.max(Rgb::ZERO) }
}

/// The interval of the tables that a wavelength lies in, and its position there from 0 to 1.
fn interval(wavelength: f64) -> (usize, f64) {
    let (first, last) = WAVELENGTHS;
    let position = (wavelength - first) / (last - first) * (SAMPLES - 1) as f64;
    let index = (position as usize).min(SAMPLES - 2);
    (index, position - index as f64)
}

/// XYZ as linear Rec. 709, whose white is D65.
fn xyz_to_rgb(xyz: Rgb) -> Rgb {
    let rows = DMat3::from_cols_array(&[
        3.240_479, -1.537_150, -0.498_535, //
        -0.969_256, 1.875_991, 0.041_556, //
        0.055_648, -0.204_043, 1.057_311,
    ]);
    rows.transpose() * xyz
}

/// The value of a spectrum: linear between its pairs, 0 outside.
fn interpolate(pairs: &[(f64, f64)], wavelength: f64) -> f64 {
    let next = pairs.partition_point(|pair| pair.0 <= wavelength).min(pairs.len() - 1);
    let [(from, at_from), (to, at_to)] = [pairs[next.saturating_sub(1)], pairs[next]];
    if wavelength < pairs[0].0 || wavelength > to {
        return 0.0;
    }
    at_from + (at_to - at_from) * ((wavelength - from) / (to - from))
}
