use std::num::NonZeroUsize;

use glam::DVec3;

use super::{Kernel, Photon, Stored, SurfaceSide, border::mass_within};
use crate::{
    bsdf::BsdfModel as _,
    math::Rgb,
    scene::{Scene, SurfaceInteraction},
    transport::{PathClass, ShadingPoint},
};

/// The parameters of a radiance estimate: which photons count, and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateParameters {
    /// The number of nearest photons, of which the farthest only sets the radius. None uses all photons within
    /// `radius`.
    pub nearest: Option<NonZeroUsize>,
    /// The maximum distance of a photon, in m.
    pub radius: f64,
    /// The weight of a photon by its distance.
    pub kernel: Kernel,
}

/// One side of a surface around a point, where the density of photons is estimated.
#[derive(Clone, Copy, Debug)]
pub struct GatherPoint {
    /// The point.
    pub p: DVec3,
    /// The unit geometric normal on this side.
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

    /// A point on an infinite plane.
    #[cfg(test)]
    pub(super) fn flat(p: DVec3, n: DVec3, surface_id: u32) -> Self {
        Self { p, n, side: SurfaceSide::new(n, surface_id), polygon: None }
    }

    /// Whether a photon arrived at this side of this surface, where the normal differs by at most 45 degrees.
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
    /// The kernel density in 1/m². The irradiance estimate at the point, in W/m², is the sum of this times the photon's
    /// power.
    pub density: f64,
    /// The squared distance over the squared radius, from 0 to 1.
    pub squared_distance: f64,
}

/// A lookup of the photons near a point, on the point's side of its surface.
pub trait PhotonLookup {
    /// Calls `visit` for each of them, in a deterministic order.
    fn for_each_nearby(&self, point: &GatherPoint, visit: impl FnMut(NearbyPhoton<'_>));
}

/// The radiance estimate: the light of the photons around a shading point that is scattered back along the path, Jensen
/// 2001, eq. (7.6). Only photons that `accepts` returns true for count. `add` receives the class and the radiance of
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
        // The photon density per surface area already includes the cosine at the geometric surface.
        let cos = direction.dot(gather_point.n);
        if cos > 0.0 {
            let scattered = point.bsdf.eval_cos(&point.query, shading.to_local(direction));
            add(photon.class(), scattered * photon.power() * (density / cos));
        }
    });
}

/// The minimum kernel mass: rounding may move a point on the border outside the polygon, where hardly any mass is left.
const MIN_MASS: f64 = 1e-3;

/// A kernel around a point, normalized over the part of its disc within the border of a flat polygon.
pub(super) struct KernelSum<'s> {
    point: &'s GatherPoint,
    kernel: Kernel,
    radius_squared: f64,
    per_radius_squared: f64,
    /// The value of the kernel at the centre, computed for the first photon that counts.
    height: Option<f64>,
}

impl<'s> KernelSum<'s> {
    pub(super) fn new(point: &'s GatherPoint, kernel: Kernel, radius_squared: f32) -> Self {
        let radius_squared = f64::from(radius_squared);
        let per_radius_squared = radius_squared.recip();
        Self { point, kernel, radius_squared, per_radius_squared, height: None }
    }

    /// Calls `visit` for a photon if it is on the point's side of the surface.
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
