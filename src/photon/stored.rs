use glam::DVec3;

use super::octahedral::{decode, encode};
use crate::{
    math::Rgb,
    scene::{Scene, SurfaceInteraction},
    transport::PathClass,
};

/// One side of a surface in 26 bits: 12 for its geometric normal (within 0.068 radians), 14 for the surface's
/// identifier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceSide(u32);

const NORMAL_BITS: u32 = 6;
const SURFACE_BITS: u32 = 14;
const SIDE_BITS: u32 = 2 * NORMAL_BITS + SURFACE_BITS;

impl SurfaceSide {
    /// The side of a surface with a unit normal. The lowest 14 bits of the surface's identifier are kept.
    #[must_use]
    pub fn new(normal: DVec3, surface_id: u32) -> Self {
        Self(encode(normal, NORMAL_BITS) as u32 | (surface_id & ((1 << SURFACE_BITS) - 1)) << (2 * NORMAL_BITS))
    }

    /// The side of a surface from which a path arrives.
    #[must_use]
    pub fn facing(scene: &Scene, si: &SurfaceInteraction) -> Self {
        Self::new(si.facing(), scene.surface_id(si))
    }

    /// The unit normal.
    #[inline]
    #[must_use]
    pub fn normal(self) -> DVec3 {
        decode(u64::from(self.0), NORMAL_BITS)
    }

    /// Whether both are sides of the same surface.
    #[inline]
    #[must_use]
    pub fn is_of_same_surface(self, other: Self) -> bool {
        (self.0 ^ other.0) >> (2 * NORMAL_BITS) == 0
    }
}

/// A record that a photon map can hold: it belongs to one side of a surface.
pub trait Stored: Copy + Send + Sync {
    /// The side of the surface.
    fn side(&self) -> SurfaceSide;
}

/// A photon in 20 bytes. The photon map stores its position in another 12 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Photon {
    /// The power in W.
    power: [f32; 3],
    /// From the lowest: 26 bits for the direction (within 5.2e-4 radians), 26 for the side of the surface, 10 for the
    /// depth, 2 for the class.
    bits: [u32; 2],
}

/// The maximum depth that a photon can store.
pub const MAX_PHOTON_DEPTH: u32 = (1 << DEPTH_BITS) - 1;

const DIRECTION_BITS: u32 = 13;
const DEPTH_BITS: u32 = 10;

const SIDE_AT: u32 = 2 * DIRECTION_BITS;
const DEPTH_AT: u32 = SIDE_AT + SIDE_BITS;
const CLASS_AT: u32 = DEPTH_AT + DEPTH_BITS;

impl Photon {
    /// A photon with its power in W, the unit direction back along its path, the side of the surface at which it
    /// arrived, and the depth and the class of its path. Depths above [`MAX_PHOTON_DEPTH`] are clamped.
    #[must_use]
    pub fn new(power: Rgb, direction: DVec3, side: SurfaceSide, depth: u32, class: PathClass) -> Self {
        let class = PathClass::ALL.iter().position(|known| *known == class).expect("all classes are known") as u64;
        let bits = encode(direction, DIRECTION_BITS)
            | u64::from(side.0) << SIDE_AT
            | u64::from(depth.min(MAX_PHOTON_DEPTH)) << DEPTH_AT
            | class << CLASS_AT;
        Self { power: power.as_vec3().to_array(), bits: [bits as u32, (bits >> 32) as u32] }
    }

    #[inline]
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

    /// The unit direction back along its path.
    #[inline]
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        decode(self.field(0, 2 * DIRECTION_BITS), DIRECTION_BITS)
    }

    /// The unit normal of the side of the surface at which it arrived.
    #[inline]
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.side().normal()
    }

    /// The depth of its path: 1 if it came straight from an emitter.
    #[inline]
    #[must_use]
    pub fn depth(&self) -> u32 {
        self.field(DEPTH_AT, DEPTH_BITS) as u32
    }

    /// The number of surfaces that scattered it before it arrived.
    #[must_use]
    pub fn bounces(&self) -> u32 {
        self.depth() - 1
    }

    /// The class of a path that scatters it to the camera.
    #[inline]
    #[must_use]
    pub fn class(&self) -> PathClass {
        PathClass::ALL[self.field(CLASS_AT, 2) as usize]
    }
}

impl Stored for Photon {
    #[inline]
    fn side(&self) -> SurfaceSide {
        SurfaceSide(self.field(SIDE_AT, SIDE_BITS) as u32)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use proptest::prelude::*;

    use super::{super::octahedral::max_error, *};
    use crate::math::warp;

    proptest! {
        #[test]
        fn a_photon_keeps_its_fields(
            [a, b, c, d] in prop::array::uniform4(0.0..1.0f64),
            surface_id in 0..1u32 << SURFACE_BITS,
            depth in 0..2 * MAX_PHOTON_DEPTH,
            class in 0..4usize,
        ) {
            let (direction, normal) =
                (warp::square_to_sphere(DVec2::new(a, b)), warp::square_to_sphere(DVec2::new(c, d)));
            let side = SurfaceSide::new(normal, surface_id);
            let photon = Photon::new(Rgb::new(a, 2.0, 1e-9), direction, side, depth, PathClass::ALL[class]);
            prop_assert!(photon.direction().angle_between(direction) < max_error(DIRECTION_BITS));
            prop_assert!(photon.normal().angle_between(normal) < max_error(NORMAL_BITS));
            prop_assert!((photon.power() - Rgb::new(a, 2.0, 1e-9)).abs().max_element() < 1e-6);
            prop_assert_eq!(photon.side(), side);
            prop_assert_eq!(photon.depth(), depth.min(MAX_PHOTON_DEPTH));
            prop_assert_eq!(photon.class(), PathClass::ALL[class]);
            let (neighbour, back) = (SurfaceSide::new(normal, surface_id ^ 1), SurfaceSide::new(-normal, surface_id));
            prop_assert!(side != neighbour && !side.is_of_same_surface(neighbour));
            prop_assert!(side != back && side.is_of_same_surface(back));
        }
    }

    #[test]
    fn a_photon_takes_twenty_bytes() {
        assert_eq!(size_of::<Photon>(), 20);
    }
}
