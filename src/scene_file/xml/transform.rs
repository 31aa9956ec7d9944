use glam::{DAffine3, DMat3, DVec3};

use crate::scene_file::transform::{look_at, rotation};

use super::{
    element::Element,
    values::{COORDINATES, coordinates, finite, numbers, triple},
};
use crate::scene_file::fault::ParseFault;

/// The elements that stand inside a `<transform>`.
pub(super) const OPERATIONS: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// The tolerance for the length of a rotation axis, which must be 1. Mitsuba does not normalise the axis, so this is
/// also the largest difference between its transform and ours, relative to the size of the object: a hundredth of a
/// pixel in an image a thousand pixels wide. Axes written with four digits, such as 0.7071, are within it.
pub(super) const UNIT: f64 = 1e-5;

/// The attributes of an operation, required ones first.
pub(super) fn attributes(operation: &str) -> (&'static [&'static str], &'static [&'static str]) {
    match operation {
        "rotate" => (&["angle"], &COORDINATES),
        "lookat" => (&["origin", "target"], &["up"]),
        "matrix" => (&["value"], &[]),
        _ => (&[], &COORDINATES),
    }
}

/// The map of one operation, which is multiplied from the left.
pub(super) fn operation(element: &Element<'_>) -> Result<DAffine3, ParseFault> {
    match element.tag {
        "translate" => Ok(DAffine3::from_translation(coordinates(element, 0.0)?)),
        "scale" => Ok(DAffine3::from_scale(coordinates(element, 1.0)?)),
        "rotate" => rotate(element),
        "lookat" => lookat(element),
        _ => matrix(element),
    }
}

fn rotate(element: &Element<'_>) -> Result<DAffine3, ParseFault> {
    let axis = coordinates(element, 0.0)?;
    let angle = finite(element.required("angle")).map_err(|fault| fault.on("angle"))?;
    let rotation = rotation(axis, angle).map_err(|fault| fault.hint("write for example x=\"1\""))?;
    let length = axis.length();
    if (length - 1.0).abs() > UNIT {
        let unit = axis.normalize();
        let what = format!("the rotation axis has length {length:.6}, and Mitsuba would shear with it");
        let hint = format!("write x=\"{}\" y=\"{}\" z=\"{}\"", unit.x, unit.y, unit.z);
        return Err(ParseFault::new(what).hint(hint));
    }
    Ok(rotation)
}

fn lookat(element: &Element<'_>) -> Result<DAffine3, ParseFault> {
    let read = |name| triple(element.required(name)).map_err(|fault| fault.on(name));
    let (origin, target) = (read("origin")?, read("target")?);
    // An empty `up` counts as absent.
    let up = if element.required("up").is_empty() { DVec3::ZERO } else { read("up")? };
    look_at(origin, target, up)
}

/// 16 numbers row by row, or 9 without a translation.
fn matrix(element: &Element<'_>) -> Result<DAffine3, ParseFault> {
    let m = numbers(element.required("value")).map_err(|fault| fault.on("value"))?;
    let (rows, translation) = match m.len() {
        16 => (4, DVec3::new(m[3], m[7], m[11])),
        9 => (3, DVec3::ZERO),
        n => return Err(ParseFault::new(format!("a matrix has 9 or 16 numbers, got {n}")).on("value")),
    };
    // Mitsuba ignores the last row, so any other values would have no effect there.
    if rows == 4 && m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(ParseFault::new("the last row of the matrix is not 0 0 0 1")
            .hint("transforms are affine; numbers go row by row, the translation is the last column")
            .on("value"));
    }
    let column = |j: usize| DVec3::new(m[j], m[rows + j], m[2 * rows + j]);
    Ok(DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation })
}
