//! Laws of the conversion of spectra to RGB.

use super::{Quantity, WAVELENGTHS, blackbody_to_rgb, to_rgb, uniform_to_rgb, xyz_to_rgb};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
};

/// The laws of spectra.
pub const LAWS: &[Law] = &[
    Law {
        name: "spectrum/rgb",
        claim: "Reflectances, lights and indices of refraction become the same RGB as in Mitsuba.",
        source: "the parameters of objects loaded by Mitsuba 3.9.1, variant scalar_rgb",
        check: Check::Analytic(rgb),
    },
    Law {
        name: "spectrum/blackbody",
        claim: "A black body of 2855.5 K has the chromaticity of the standard illuminant A.",
        source: "ISO 11664-2: x = 0.44758, y = 0.40745",
        check: Check::Analytic(blackbody),
    },
];

/// A use, a spectrum as in a scene file, and Mitsuba's RGB.
const SPECTRA: [(Quantity, &str, [f64; 3]); 20] = [
    (Quantity::Reflectance, "400:0.1 500:0.6 600:0.3 700:0.9", [0.338_070_8, 0.487_567_9, 0.358_675_5]),
    (Quantity::Reflectance, "360:0.5 830:0.5", [0.499_492_6, 0.499_436_9, 0.499_400_8]),
    (Quantity::Reflectance, "0.25", [0.25, 0.25, 0.25]),
    (Quantity::Reflectance, "300:0.2 900:0.8", [0.541_874_8, 0.442_500_5, 0.340_420_4]),
    (Quantity::Reflectance, "500:0.9 520:0.9", [0.0, 0.174_391_6, 0.013_127_47]),
    (Quantity::Reflectance, "400:3 700:5", [1.0, 1.0, 1.0]),
    (Quantity::Reflectance, "450:0 455:1 460:0", [0.004_845_102, 0.0, 0.102_450_5]),
    (Quantity::Light, "400:0.1 500:0.6 600:0.3 700:0.9", [0.432_962_7, 0.459_342_7, 0.317_791_9]),
    (Quantity::Light, "360:0.5 830:0.5", [0.602_441_8, 0.474_114_1, 0.454_633_4]),
    (Quantity::Light, "2", [2.409_588, 1.896_582, 1.817_832]),
    (Quantity::Light, "300:0.2 900:0.8", [0.644_874_6, 0.420_747_2, 0.306_834]),
    (Quantity::Light, "500:0.9 520:0.9", [0.0, 0.161_143, 0.011_924_49]),
    (Quantity::Light, "400:3 700:5", [5.479_694, 3.758_002, 2.937_723]),
    (Quantity::Light, "580:0 600:4 610:8 640:0", [4.641_036, 0.044_832_16, 0.0]),
    (Quantity::Index, "400:0.2 500:0.9 700:0.3", [0.442_243_3, 0.809_438_8, 0.556_130_1]),
    (Quantity::Index, "400:3 700:5", [4.594_323, 3.952_18, 3.256_811]),
    (Quantity::Index, "1.5", [1.5, 1.5, 1.5]),
    (Quantity::Index, "300:0.2 900:0.8", [0.541_874_8, 0.442_500_5, 0.340_420_4]),
    (Quantity::Index, "500:0.9 520:0.9", [0.0, 0.174_391_6, 0.013_127_47]),
    (Quantity::Index, "360:1.5 480:1.7 830:0.1", [0.937_972_9, 1.430_579, 1.684_615]),
];

fn rgb(_: Effort) -> Vec<Finding> {
    let finding = |(quantity, text, expected): &(Quantity, &str, [f64; 3])| {
        let number = |text: &str| text.parse::<f64>().expect("a number");
        let pairs: Vec<_> = text.split(' ').filter_map(|pair| pair.split_once(':')).collect();
        let pairs: Vec<_> = pairs.into_iter().map(|(wavelength, value)| (number(wavelength), number(value))).collect();
        let rgb = if pairs.is_empty() { uniform_to_rgb(number(text), *quantity) } else { to_rgb(&pairs, *quantity) };
        let error = (rgb - Rgb::from(*expected)).abs().max_element() / Rgb::from(*expected).max_element();
        Finding::error(format!("{quantity:?} {text}"), error, 1e-5)
    };
    SPECTRA.iter().map(finding).collect()
}

fn blackbody(_: Effort) -> Vec<Finding> {
    // Illuminant A has 2848 K with a second radiation constant of 0.01435 m K, now 0.014388 m K.
    let rgb = blackbody_to_rgb(2848.0 * 0.014_387_77 / 0.014_35, WAVELENGTHS, Quantity::Light);
    let columns = glam::DMat3::from_cols(xyz_to_rgb(Rgb::X), xyz_to_rgb(Rgb::Y), xyz_to_rgb(Rgb::Z));
    let xyz = columns.inverse() * rgb;
    let (x, y) = (xyz.x / xyz.element_sum(), xyz.y / xyz.element_sum());
    vec![Finding::value("x", x, 0.447_58, 2e-5), Finding::value("y", y, 0.407_45, 2e-5)]
}
