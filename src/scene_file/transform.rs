use glam::{DAffine3, DMat3, DVec3};

use super::fault::ParseFault;
use crate::math::Frame;

/// An affine map that is built step by step, for a parameter such as `to_world` of a scene built in code.
///
/// Each step applies after the steps before it, in the order of the operations in a `<transform>` element, and gives
/// the same bits. An invalid step is reported when the scene is built.
///
/// ```
/// # use etendue::prelude::*;
/// // A lamp: the unit square, shrunk, turned to face downwards, and lifted to y = 2.
/// let to_world = Transform::new().scale([0.5, 0.5, 1.0]).rotate([1.0, 0.0, 0.0], 90.0).translate([0.0, 2.0, 0.0]);
/// let lamp = shape("rectangle").with("to_world", to_world);
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Transform(pub(super) Result<DAffine3, ParseFault>);

impl Default for Transform {
    fn default() -> Self {
        Self::new()
    }
}

impl Transform {
    /// The identity.
    pub fn new() -> Self {
        Self(Ok(DAffine3::IDENTITY))
    }

    /// Moves by an offset.
    pub fn translate(self, offset: impl Into<DVec3>) -> Self {
        self.then(Ok(DAffine3::from_translation(offset.into())))
    }

    /// Scales each axis about the origin. No factor may be 0; a negative one mirrors.
    pub fn scale(self, factors: impl Into<DVec3>) -> Self {
        self.then(Ok(DAffine3::from_scale(factors.into())))
    }

    /// Scales all axes by the same factor, which may not be 0.
    pub fn scale_uniformly(self, factor: f64) -> Self {
        self.scale(DVec3::splat(factor))
    }

    /// Turns about an axis through the origin, by an angle in degrees, anticlockwise as seen from the axis' tip. The
    /// axis may have any length but 0.
    pub fn rotate(self, axis: impl Into<DVec3>, degrees: f64) -> Self {
        self.then(rotation(axis.into(), degrees))
    }

    /// Places a camera: moves the origin to `origin`, and turns +z towards `target` and +y as far as possible towards
    /// `up`. With an `up` of 0 the roll is arbitrary.
    pub fn look_at(self, origin: impl Into<DVec3>, target: impl Into<DVec3>, up: impl Into<DVec3>) -> Self {
        self.then(look_at(origin.into(), target.into(), up.into()))
    }

    /// Applies a matrix of three rows, whose last column is the translation; the fourth row is 0 0 0 1.
    pub fn matrix(self, [x, y, z]: [[f64; 4]; 3]) -> Self {
        let column = |j: usize| DVec3::new(x[j], y[j], z[j]);
        let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
        self.then(Ok(DAffine3 { matrix3, translation: column(3) }))
    }

    /// Applies a step. The first fault is kept.
    fn then(self, step: Result<DAffine3, ParseFault>) -> Self {
        Self(self.0.and_then(|before| Ok(step? * before)))
    }
}

/// The least sine of the angle between `up` and the direction of a `<lookat>`. Below it, rounding alone would determine
/// the roll.
const PARALLEL: f64 = 1e-9;

/// The least volume of an invertible matrix whose columns are scaled to unit length: a few rounding errors of the
/// determinant.
const SINGULAR: f64 = 1e-14;

/// Rejects a map that cannot be inverted.
pub(super) fn regular(transform: DAffine3) -> Result<DAffine3, ParseFault> {
    if !transform.is_finite() {
        return Err(ParseFault::new("the transform is not finite").hint("use smaller numbers"));
    }
    let m = transform.matrix3;
    let columns = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::try_normalize);
    let volume = match columns {
        [Some(x), Some(y), Some(z)] => DMat3::from_cols(x, y, z).determinant().abs(),
        _ => 0.0,
    };
    if volume < SINGULAR || !transform.inverse().is_finite() {
        return Err(ParseFault::new("the transform is singular").hint("it must not flatten space; no scale may be 0"));
    }
    Ok(transform)
}

/// Turns about an axis of any length but 0.
pub(super) fn rotation(axis: DVec3, degrees: f64) -> Result<DAffine3, ParseFault> {
    match axis.try_normalize() {
        Some(unit) => Ok(DAffine3::from_axis_angle(unit, degrees.to_radians())),
        None => Err(ParseFault::new("the rotation axis is zero").hint("give it a direction such as 1, 0, 0")),
    }
}

/// Columns (left, up, direction, origin): a camera looks along its +z with +x on its left.
pub(super) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Result<DAffine3, ParseFault> {
    let Some(direction) = (target - origin).try_normalize() else {
        return Err(ParseFault::new("invalid lookat: origin and target are the same").hint("move one of them"));
    };
    let up = up.try_normalize().unwrap_or_else(|| Frame::from_normal(direction).s);
    let across = up.cross(direction);
    if across.length() < PARALLEL {
        return Err(ParseFault::new("invalid lookat: up is parallel to the direction").hint("turn up, or leave it out"));
    }
    let left = across.normalize();
    Ok(DAffine3 { matrix3: DMat3::from_cols(left, direction.cross(left), direction), translation: origin })
}
