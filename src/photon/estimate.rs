use std::num::NonZeroUsize;

use glam::DVec3;

use super::{Kernel, Photon, Stored, SurfaceSide, border::mass_within};
use crate::{
    bsdf::BsdfModel as _,
    math::Rgb,
    scene::{Scene, SurfaceInteraction},
    transport::{PathClass, ShadingPoint},
};

/// Which photons an estimate is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateParameters {
    /// How many of the nearest photons; the farthest of them only sets the radius. None for all photons within `radius`.
    pub nearest: Option<NonZeroUsize>,
    /// The greatest distance of a photon, in m.
    pub radius: f64,
    /// How much a photon counts at its distance.
    pub kernel: Kernel,
}

/// One side of a surface around a point, where the density of photons is estimated.
#[derive(Clone, Copy, Debug)]
pub struct GatherPoint {
    /// The point.
    pub p: DVec3,
    /// The unit normal of the geometric surface, on the side that is looked at.
    pub n: DVec3,
    pub(super) side: SurfaceSide,
    pub(super) polygon: Option<[DVec3; 4]>,
}

impl GatherPoint {
    /// The surface at an interaction, on the side from which the path arrives.
    #[must_use]
    pub fn new(scene: &Scene, si: &SurfaceInteraction) -> Self {
        let side = SurfaceSide::facing(scene, si);
        Self { p: si.surface.p, n: si.facing(), side, polygon: scene.polygon(si) }
    }

    /// A point of a plane without a border.
    #[cfg(test)]
    pub(super) fn flat(p: DVec3, n: DVec3, surface_id: u32) -> Self {
        Self { p, n, side: SurfaceSide::new(n, surface_id), polygon: None }
    }

    /// Whether something arrived at this side of this surface, where the normal differs by at most 45 degrees.
    #[inline]
    fn shares_side_with(&self, other: SurfaceSide) -> bool {
        const COS: f64 = std::f64::consts::FRAC_1_SQRT_2;
        other == self.side || other.is_of_same_surface(self.side) && other.normal().dot(self.n) > COS
    }
}

/// A photon near a point.
#[derive(Clone, Copy, Debug)]
pub struct NearbyPhoton<'p, P = Photon> {
    /// The photon.
    pub photon: &'p P,
    /// How much it counts: the density of power at the point, in W/m², is the sum of this times the photons' powers.
    pub density: f64,
    /// Its squared distance over the square of the radius.
    pub squared_distance: f64,
}

/// A way to find the photons near a point, on its side of its surface.
pub trait PhotonLookup {
    /// Shows each of them to `visit`, always in the same order.
    fn for_each_nearby(&self, point: &GatherPoint, visit: impl FnMut(NearbyPhoton<'_>));
}

/// The radiance estimate: the light of the photons around a shading point that is scattered back along the path, Jensen
/// 2001, eq. (7.6). Of the photons found, those count that `accepts` lets through; `add` receives the class and the radiance of
/// each.
#[inline]
pub fn radiance_estimate(
    scene: &Scene,
    point: &ShadingPoint<'_>,
    photons: &impl PhotonLookup,
    mut accepts: impl FnMut(&NearbyPhoton<'_>) -> bool,
    mut add: impl FnMut(PathClass, Rgb),
) {
    let gather_point = GatherPoint::new(scene, &point.si);
    let shading = &point.si.surface.shading;
    photons.for_each_nearby(&gather_point, |nearby| {
        if !accepts(&nearby) {
            return;
        }
        let NearbyPhoton { photon, density, .. } = nearby;
        let direction = photon.direction();
        // Photons are counted per area: the cosine at the geometric surface is in their density already.
        let cos = direction.dot(gather_point.n);
        if cos > 0.0 {
            let scattered = point.bsdf.eval_cos(&point.query, shading.to_local(direction));
            add(photon.class(), scattered * photon.power() * (density / cos));
        }
    });
}

/// Rounding may put a point of a border outside of it, where next to nothing of a kernel is left.
const MIN_MASS: f64 = 1e-3;

/// A kernel around a point, normalized over the part of its disc that lies within the border of a flat polygon.
pub(super) struct KernelSum<'s> {
    point: &'s GatherPoint,
    kernel: Kernel,
    radius_squared: f64,
    per_radius_squared: f64,
    /// The value of the kernel in the middle, computed when the first photon counts.
    height: Option<f64>,
}

impl<'s> KernelSum<'s> {
    pub(super) fn new(point: &'s GatherPoint, kernel: Kernel, radius_squared: f32) -> Self {
        let radius_squared = f64::from(radius_squared);
        let per_radius_squared = radius_squared.recip();
        Self { point, kernel, radius_squared, per_radius_squared, height: None }
    }

    /// Shows a photon if it is on the side that is looked at.
    #[inline]
    pub(super) fn visit<P: Stored>(
        &mut self,
        photon: &P,
        distance_squared: f32,
        visit: &mut impl FnMut(NearbyPhoton<'_, P>),
    ) {
        if !self.point.shares_side_with(photon.side()) {
            return;
        }
        let height = match self.height {
            Some(height) => height,
            None => *self.height.insert(self.height_within_border()),
        };
        let squared_distance = f64::from(distance_squared) * self.per_radius_squared;
        visit(NearbyPhoton { photon, density: height * self.kernel.shape(squared_distance), squared_distance });
    }

    #[inline(never)]
    fn height_within_border(&self) -> f64 {
        let (point, radius) = (self.point, self.radius_squared.sqrt());
        let mass = point.polygon.map_or(1.0, |polygon| mass_within(self.kernel, &polygon, point.p, radius));
        self.kernel.height(self.radius_squared) / mass.max(MIN_MASS)
    }
}
