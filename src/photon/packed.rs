use glam::{DVec2, DVec3};

use crate::{math::Rgb, transport::PathClass};

/// A photon in 20 bytes; its position, another 12, is kept by the tree that finds it.
///
/// The direction is that to where it came from, in 26 bits (within 5.2e-4 radians), the normal that of the true surface, in
/// 12 (within 0.068): octahedral maps, Meyer et al. 2010, "On Floating-Point Normal Vectors".
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Photon {
    /// In W.
    power: [f32; 3],
    /// From the lowest: 26 bits of direction, 12 of normal, 14 of patch, 10 of depth, 2 of class.
    bits: [u32; 2],
}

/// Depths beyond this cannot be told apart.
pub const MAX_PHOTON_DEPTH: u32 = (1 << DEPTH_BITS) - 1;

const DIRECTION_BITS: u32 = 13;
const NORMAL_BITS: u32 = 6;
const PATCH_BITS: u32 = 14;
const DEPTH_BITS: u32 = 10;

const NORMAL_AT: u32 = 2 * DIRECTION_BITS;
const PATCH_AT: u32 = NORMAL_AT + 2 * NORMAL_BITS;
const DEPTH_AT: u32 = PATCH_AT + PATCH_BITS;
const CLASS_AT: u32 = DEPTH_AT + DEPTH_BITS;

impl Photon {
    /// A photon with its power in W, the unit direction to where it came from, the unit normal of the surface, the patch
    /// of the surface, of which the lowest bits are kept, the segments of its path, and what kind of path that was.
    #[must_use]
    pub fn new(power: Rgb, direction: DVec3, normal: DVec3, surface_id: u32, depth: u32, class: PathClass) -> Self {
        let class = PathClass::ALL.iter().position(|known| *known == class).expect("all classes are known") as u64;
        let bits = encode(direction, DIRECTION_BITS)
            | surface_key(normal, surface_id)
            | u64::from(depth.min(MAX_PHOTON_DEPTH)) << DEPTH_AT
            | class << CLASS_AT;
        Self { power: power.as_vec3().to_array(), bits: [bits as u32, (bits >> 32) as u32] }
    }

    fn field(&self, at: u32, width: u32) -> u64 {
        let bits = u64::from(self.bits[0]) | u64::from(self.bits[1]) << 32;
        bits >> at & ((1 << width) - 1)
    }

    /// The power in W.
    #[must_use]
    pub fn power(&self) -> Rgb {
        Rgb::from_array(self.power.map(f64::from))
    }

    /// The same photon with its power times a factor.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { power: self.power.map(|power| (f64::from(power) * factor) as f32), ..self }
    }

    /// The unit direction to where it came from.
    #[inline]
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        decode(self.field(0, 2 * DIRECTION_BITS), DIRECTION_BITS)
    }

    /// The unit normal of the surface where it arrived.
    #[inline]
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        decode(self.field(NORMAL_AT, 2 * NORMAL_BITS), NORMAL_BITS)
    }

    /// Whether it arrived at a patch of which a number is given.
    #[inline]
    #[must_use]
    pub fn is_on_surface(&self, surface_id: u32) -> bool {
        self.field(PATCH_AT, PATCH_BITS) == u64::from(surface_id) & ((1 << PATCH_BITS) - 1)
    }

    /// Whether it arrived at a patch and on a side that have this [`surface_key`].
    #[inline]
    #[must_use]
    pub(super) fn is_at(&self, key: u64) -> bool {
        const MASK: u64 = ((1 << (2 * NORMAL_BITS + PATCH_BITS)) - 1) << NORMAL_AT;
        let bits = u64::from(self.bits[0]) | u64::from(self.bits[1]) << 32;
        bits & MASK == key
    }

    /// Segments from the light.
    #[inline]
    #[must_use]
    pub fn depth(&self) -> u32 {
        self.field(DEPTH_AT, DEPTH_BITS) as u32
    }

    /// Surfaces that it had met before.
    #[must_use]
    pub fn bounces(&self) -> u32 {
        self.depth() - 1
    }

    /// What the eye would see if it saw where the photon arrived.
    #[inline]
    #[must_use]
    pub fn class(&self) -> PathClass {
        PathClass::ALL[self.field(CLASS_AT, 2) as usize]
    }
}

/// A unit normal and the number of a patch, as photons hold them.
#[must_use]
pub(super) fn surface_key(normal: DVec3, surface_id: u32) -> u64 {
    encode(normal, NORMAL_BITS) << NORMAL_AT | (u64::from(surface_id) & ((1 << PATCH_BITS) - 1)) << PATCH_AT
}

/// A unit vector as two numbers of so many bits: the octahedron `|x| + |y| + |z| = 1`, unfolded.
fn encode(v: DVec3, bits: u32) -> u64 {
    let p = v.truncate() / v.abs().element_sum();
    let p = if v.z < 0.0 { fold(p) } else { p };
    let steps = f64::from((1_u32 << bits) - 1);
    // To the nearest step; the cast rounds down.
    let part = |x: f64| ((0.5 * (x + 1.0) * steps + 0.5) as u64).min((1 << bits) - 1);
    part(p.x) | part(p.y) << bits
}

fn decode(code: u64, bits: u32) -> DVec3 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::warp;
    use proptest::prelude::*;

    /// Half a step of both numbers moves a point of the octahedron by √6 of it, and a face's middle is 1/√3 away. To
    /// that first order come the second and the rounding of the angle.
    const fn error(bits: u32) -> f64 {
        1.05 * 4.242_640_687 / ((1_u32 << bits) - 1) as f64
    }

    const DIRECTION_ERROR: f64 = error(DIRECTION_BITS);
    const NORMAL_ERROR: f64 = error(NORMAL_BITS);

    proptest! {
        #[test]
        fn what_is_packed_comes_out(
            [a, b, c, d] in prop::array::uniform4(0.0..1.0f64),
            surface_id in 0..1u32 << PATCH_BITS,
            depth in 0..2 * MAX_PHOTON_DEPTH,
            class in 0..4usize,
        ) {
            let (direction, normal) =
                (warp::square_to_sphere(DVec2::new(a, b)), warp::square_to_sphere(DVec2::new(c, d)));
            let photon = Photon::new(Rgb::new(a, 2.0, 1e-9), direction, normal, surface_id, depth, PathClass::ALL[class]);
            prop_assert!(photon.direction().angle_between(direction) < DIRECTION_ERROR);
            prop_assert!(photon.normal().angle_between(normal) < NORMAL_ERROR);
            prop_assert!((photon.power() - Rgb::new(a, 2.0, 1e-9)).abs().max_element() < 1e-6);
            prop_assert!(photon.is_on_surface(surface_id) && !photon.is_on_surface(surface_id ^ 1));
            prop_assert!(photon.is_at(surface_key(normal, surface_id)) && !photon.is_at(surface_key(normal, surface_id ^ 1)));
            prop_assert!(!photon.is_at(surface_key(-normal, surface_id)));
            prop_assert_eq!(photon.depth(), depth.min(MAX_PHOTON_DEPTH));
            prop_assert_eq!(photon.class(), PathClass::ALL[class]);
        }
    }

    #[test]
    fn a_photon_takes_twenty_bytes() {
        assert_eq!(size_of::<Photon>(), 20);
    }

    #[test]
    fn the_axes_are_exact_enough() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z] {
            assert!(
                decode(encode(axis, DIRECTION_BITS), DIRECTION_BITS).angle_between(axis) < DIRECTION_ERROR,
                "{axis}"
            );
        }
    }
}
