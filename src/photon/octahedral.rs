use glam::{DVec2, DVec3};

/// Encodes a unit vector as two integers of `bits` bits each, by the octahedron `|x| + |y| + |z| = 1` unfolded into a
/// square. Meyer et al. 2010, "On Floating-Point Normal Vectors".
pub(super) fn encode(v: DVec3, bits: u32) -> u64 {
    let p = v.truncate() / v.abs().element_sum();
    let p = if v.z < 0.0 { fold(p) } else { p };
    let steps = f64::from((1_u32 << bits) - 1);
    // Rounds to the nearest step; the cast truncates.
    let part = |x: f64| ((0.5 * (x + 1.0) * steps + 0.5) as u64).min((1 << bits) - 1);
    part(p.x) | part(p.y) << bits
}

/// Decodes a unit vector from [`encode`]'s code.
pub(super) fn decode(code: u64, bits: u32) -> DVec3 {
    let steps = f64::from((1_u32 << bits) - 1);
    let part = |code: u64| (code & ((1 << bits) - 1)) as f64 / steps * 2.0 - 1.0;
    let p = DVec2::new(part(code), part(code >> bits));
    let z = 1.0 - p.abs().element_sum();
    if z < 0.0 { fold(p).extend(z).normalize() } else { p.extend(z).normalize() }
}

fn fold(p: DVec2) -> DVec2 {
    let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
}

/// The maximum angle between a unit vector and its decoded code, in radians. Half a step in both integers moves a point
/// of the octahedron by √6 half steps, and the centre of a face is at distance 1/√3. A margin of 5 % covers
/// second-order terms and rounding of the angle.
#[cfg(test)]
pub(super) const fn max_error(bits: u32) -> f64 {
    1.05 * 4.242_640_687 / ((1_u32 << bits) - 1) as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math::warp;

    #[test]
    fn the_axes_stay_within_the_error() {
        for bits in [6, 13] {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z] {
                assert!(decode(encode(axis, bits), bits).angle_between(axis) < max_error(bits), "{axis}");
            }
        }
    }

    proptest! {
        #[test]
        fn directions_stay_within_the_error([a, b] in prop::array::uniform2(0.0..1.0f64), bits in 4..15u32) {
            let v = warp::square_to_sphere(DVec2::new(a, b));
            prop_assert!(decode(encode(v, bits), bits).angle_between(v) < max_error(bits));
        }
    }
}
