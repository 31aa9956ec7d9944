use super::{Quantity, integrate};
use crate::math::Rgb;

/// Planck's constant in J s, the speed of light in m/s, and Boltzmann's constant in J/K.
const H: f64 = 6.626_070_15e-34;
const C: f64 = 299_792_458.0;
const K: f64 = 1.380_649e-23;

/// The colour of a black body of a temperature in K, between two wavelengths in nm. The radiance behind it is in W per
/// m², sr and nm.
#[must_use]
pub fn blackbody_to_rgb(temperature: f64, (from, to): (f64, f64), quantity: Quantity) -> Rgb {
    let emits = |wavelength| if (from..=to).contains(&wavelength) { radiance(temperature, wavelength) } else { 0.0 };
    integrate(emits, quantity)
}

/// The radiance of a black body at a wavelength in nm, by Planck's law, in W per m², sr and nm.
fn radiance(temperature: f64, wavelength: f64) -> f64 {
    let metres = 1e-9 * wavelength;
    let per_metre = 2.0 * H * C * C / (metres.powi(5) * (H * C / (metres * K * temperature)).exp_m1());
    1e-9 * per_metre
}
