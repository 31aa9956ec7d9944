use glam::DVec3;

use crate::{
    scene_file::{Spectrum, whole_number},
    spectrum::check_pairs,
};

use super::element::Element;
use crate::scene_file::fault::ParseFault;

/// The hint for numbers.
const NUMBER: &str = "write a number like 1, -0.5 or 2e-3";

/// A `<float>`: blanks around it, a sign, an exponent and `inf` are allowed.
pub(super) fn float(text: &str) -> Result<f64, ParseFault> {
    let bad = || ParseFault::new(format!("could not parse floating point value \"{text}\"")).hint(NUMBER);
    let number: f64 = text.trim_ascii().parse().map_err(|_| bad())?;
    if number.is_nan() {
        return Err(bad());
    }
    // Digits that overflow to infinity are an error; the word `inf` is accepted.
    if number.is_infinite() && text.bytes().any(|byte| byte.is_ascii_digit()) {
        return Err(ParseFault::new(format!("\"{text}\" is too large for a double")).hint("write inf for infinity"));
    }
    Ok(number)
}

/// A number that cannot be infinite: a coordinate, an angle, a channel.
pub(super) fn finite(text: &str) -> Result<f64, ParseFault> {
    let number = float(text)?;
    if number.is_finite() { Ok(number) } else { Err(ParseFault::new(format!("\"{text}\" is not finite")).hint(NUMBER)) }
}

/// An `<integer>`; as in Mitsuba, blanks around it are allowed, a plus sign is not.
pub(super) fn integer(text: &str) -> Result<i64, ParseFault> {
    let digits = text.trim_ascii();
    digits.parse().ok().filter(|_| !digits.starts_with('+')).ok_or_else(|| {
        ParseFault::new(format!("could not parse integer value \"{text}\""))
            .hint("write a whole number of 64 bits like 3 or -1")
    })
}

/// An `<integer>` whose value comes from a parameter, which may also be written as 1e5.
pub(super) fn parameter_integer(text: &str) -> Result<i64, ParseFault> {
    integer(text).or_else(|fault| whole_number(text.trim_ascii()).and_then(|n| n.try_into().ok()).ok_or(fault))
}

/// A `<boolean>`.
pub(super) fn boolean(text: &str) -> Result<bool, ParseFault> {
    match text {
        _ if text.eq_ignore_ascii_case("true") => Ok(true),
        _ if text.eq_ignore_ascii_case("false") => Ok(false),
        _ => Err(ParseFault::new(format!("could not parse boolean value \"{text}\"")).hint("write true or false")),
    }
}

/// The items of a list. As in Mitsuba, any number of commas and blanks separates them.
pub(super) fn list(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_ascii_whitespace()).filter(|item| !item.is_empty())
}

/// Finite numbers of a list.
pub(super) fn numbers(text: &str) -> Result<Vec<f64>, ParseFault> {
    list(text).map(finite).collect()
}

/// An `<rgb>`: three channels, or one for grey.
pub(super) fn rgb(text: &str) -> Result<DVec3, ParseFault> {
    let bad = || {
        ParseFault::new(format!("could not parse RGB value \"{text}\""))
            .hint("give 1 or 3 numbers, separated by commas or blanks")
    };
    match *numbers(text).map_err(|_| bad())? {
        [grey] => Ok(DVec3::splat(grey)),
        [r, g, b] => Ok(DVec3::new(r, g, b)),
        _ => Err(bad()),
    }
}

/// Exactly three numbers in one attribute.
pub(super) fn triple(text: &str) -> Result<DVec3, ParseFault> {
    match *numbers(text)? {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        ref other => Err(ParseFault::new(format!("expected 3 numbers, got {}", other.len()))
            .hint("separate them by commas or blanks")),
    }
}

/// The attributes that [`coordinates`] reads.
pub(super) const COORDINATES: [&str; 4] = ["value", "x", "y", "z"];

/// Three numbers, in the attributes `x`, `y`, `z`, each of which has a default, or in `value`, which has three numbers
/// or one for all.
pub(super) fn coordinates(element: &Element<'_>, default: f64) -> Result<DVec3, ParseFault> {
    let axes = ["x", "y", "z"];
    let Some(value) = element.get("value") else {
        let mut result = DVec3::splat(default);
        for (i, axis) in axes.into_iter().enumerate() {
            if let Some(text) = element.get(axis) {
                result[i] = finite(text).map_err(|fault| fault.on(axis))?;
            }
        }
        return Ok(result);
    };
    if let Some(axis) = axes.into_iter().find(|axis| element.has(axis)) {
        let fault = ParseFault::new(format!("cannot mix \"value\" with \"{axis}\" in <{}>", element.tag));
        return Err(fault.hint("give \"value\" or \"x\", \"y\", \"z\""));
    }
    match *numbers(value).map_err(|fault| fault.on("value"))? {
        [all] => Ok(DVec3::splat(all)),
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        ref other => Err(ParseFault::new(format!("\"value\" has {} numbers", other.len()))
            .hint("give 1 or 3, separated by commas or blanks")
            .on("value")),
    }
}

/// The `value` of a `<spectrum>`: one number, or at least two pairs `wavelength:value` with rising wavelengths.
pub(super) fn spectrum(text: &str) -> Result<Spectrum, ParseFault> {
    let items: Vec<_> = list(text).collect();
    if let [single] = *items
        && !single.contains(':')
    {
        return Ok(Spectrum::Uniform(finite(single)?));
    }
    let pairs = items
        .iter()
        .map(|item| match item.split_once(':') {
            Some((wavelength, value)) => Ok((finite(wavelength)?, finite(value)?)),
            None => Err(ParseFault::new(format!("could not parse spectrum value \"{item}\""))
                .hint("write one number, or pairs like 400:0.1, 700:0.2")),
        })
        .collect::<Result<Vec<_>, _>>()?;
    tabulated(pairs)
}

/// The spectrum of two or more pairs of wavelength and value, with rising wavelengths.
pub(in crate::scene_file) fn tabulated(pairs: Vec<(f64, f64)>) -> Result<Spectrum, ParseFault> {
    let hint = "write one number, or pairs like 400:0.1, 700:0.2, sorted by wavelength";
    check_pairs(&pairs).map_err(|what| ParseFault::new(what).hint(hint))?;
    Ok(Spectrum::Tabulated(pairs))
}
