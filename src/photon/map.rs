use std::num::NonZeroUsize;

use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::{Kernel, Photon, border::mass_within, packed::surface_key};
use crate::{
    math::Aabb,
    scene::{Scene, SurfaceInteraction},
};

/// Photons in a tree.
#[derive(Debug)]
pub struct Map {
    /// None without photons.
    tree: Option<ImmutableKdTree<f32, 3>>,
    photons: Vec<Photon>,
}

/// Which photons an estimate is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateParameters {
    /// The nearest so many, of which the farthest only tells the radius; None for all within `radius`.
    pub nearest: Option<NonZeroUsize>,
    /// None farther than this, in m.
    pub radius: f64,
    /// What they count.
    pub kernel: Kernel,
}

/// A place where density is estimated.
#[derive(Clone, Copy, Debug)]
pub struct GatherPoint {
    /// Where.
    pub p: DVec3,
    /// The unit normal of the true surface, on the side that is looked at.
    pub n: DVec3,
    surface_id: u32,
    /// Of photons on this side of a flat surface.
    key: u64,
    polygon: Option<[DVec3; 4]>,
}

impl GatherPoint {
    /// The surface at a vertex, from the side that it is seen from.
    #[must_use]
    pub fn new(scene: &Scene, si: &SurfaceInteraction) -> Self {
        let (n, surface_id) = (si.facing(), scene.surface_id(si));
        Self { p: si.surface.p, n, surface_id, key: surface_key(n, surface_id), polygon: scene.polygon(si) }
    }

    /// A place on a plane without border.
    #[cfg(test)]
    pub(super) fn flat(p: DVec3, n: DVec3, surface_id: u32) -> Self {
        Self { p, n, surface_id, key: surface_key(n, surface_id), polygon: None }
    }

    /// Whether a photon arrived at this side of this surface, where it is not turned by more than 45 degrees.
    #[inline]
    fn shares(&self, photon: &Photon) -> bool {
        const COS: f64 = std::f64::consts::FRAC_1_SQRT_2;
        photon.is_at(self.key) || photon.is_on_surface(self.surface_id) && photon.normal().dot(self.n) > COS
    }
}

impl Map {
    /// Puts photons into a tree: in f32, as many positions as photons.
    ///
    /// # Panics
    /// If a coordinate is not finite, or there are 2³² photons or more.
    #[must_use]
    pub fn new(positions: &[[f32; 3]], photons: Vec<Photon>) -> Self {
        assert_eq!(positions.len(), photons.len());
        if photons.is_empty() {
            return Self { tree: None, photons };
        }
        // Neighbours in space are neighbours in memory, where an estimate finds them together.
        let order = along_curve(positions);
        let positions: Vec<_> = order.iter().map(|&index| positions[index as usize]).collect();
        let photons = order.into_iter().map(|index| photons[index as usize]).collect();
        let tree = ImmutableKdTree::new_from_slice(&positions).expect("finite points make a tree of any shape");
        Self { tree: Some(tree), photons }
    }

    /// How many photons there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Bytes that it takes: a photon, its position, and the number by which the tree knows it.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.photons.len() * (size_of::<Photon>() + size_of::<[f32; 3]>() + size_of::<u32>())
    }

    /// Shows the photons around a place, on its side of its surface, each with what it counts there: the density of
    /// power in W/m² is the sum of these numbers times the photons' powers.
    ///
    /// With the k-th nearest photon at the distance r, those within r count by the kernel of radius r, and the k-th itself
    /// does not: its distance is what the others are distributed below. So the estimate is `(k-1) / πr²` photons per
    /// area for photons of one surface, which has the right mean where the density is even; `k / πr²` would be too
    /// bright by `k / (k-1)`. Photons of other surfaces in between change nothing of that. The kernel's norm is that
    /// within the border of a flat polygon.
    #[inline]
    pub fn gather(&self, point: &GatherPoint, lookup: &EstimateParameters, mut show: impl FnMut(&Photon, f64)) {
        let Some(tree) = &self.tree else { return };
        let position = point.p.as_vec3().to_array();
        // Distances are in f32, which have neither arbitrarily small nor arbitrarily great squares.
        let cap = ((lookup.radius * lookup.radius) as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
        let query = tree.query(&position);
        match lookup.nearest {
            None => {
                let mut share = KernelSum::new(point, lookup, cap);
                for found in query.within::<SquaredEuclidean<f32>>(cap).unsorted().execute() {
                    share.show(&self.photons[found.item as usize], found.distance, &mut show);
                }
            }
            Some(nearest) => {
                let mut found = query.nearest_n::<SquaredEuclidean<f32>>(nearest).within(cap).execute();
                let reach = if found.len() == nearest.get() {
                    found.pop().map_or(cap, |farthest| farthest.distance)
                } else {
                    cap
                };
                // Photons that all lie in one point have no density: they are spread over the greatest disc.
                let mut share = KernelSum::new(point, lookup, if reach > 0.0 { reach } else { cap });
                for found in &found {
                    share.show(&self.photons[found.item as usize], found.distance, &mut show);
                }
            }
        }
    }
}

/// Rounding may put a point of a border outside of it, where next to nothing of a kernel is left.
const MIN_MASS: f64 = 1e-3;

/// The order of points along Morton's curve through their box, equal places by their numbers.
fn along_curve(positions: &[[f32; 3]]) -> Vec<u32> {
    let point = |position: &[f32; 3]| DVec3::from_array(position.map(f64::from));
    let bounds = Aabb::around(positions.iter().map(point));
    let steps = f64::from((1_u32 << 21) - 1) / bounds.extent().max(DVec3::splat(f64::MIN_POSITIVE));
    let code = |(index, position): (usize, &[f32; 3])| {
        let cell = ((point(position) - bounds.min) * steps).to_array().map(|x| spread_bits(x as u64));
        (cell[0] | cell[1] << 1 | cell[2] << 2, index as u32)
    };
    let mut codes: Vec<(u64, u32)> = positions.par_iter().enumerate().map(code).collect();
    codes.par_sort_unstable();
    codes.into_iter().map(|(_, index)| index).collect()
}

/// The lowest 21 bits of a number, each followed by two zeros.
fn spread_bits(x: u64) -> u64 {
    const STEPS: [(u32, u64); 5] = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    STEPS.iter().fold(x & 0x001f_ffff, |x, (shift, mask)| (x | x << shift) & mask)
}

/// What photons count at a place, for a radius.
pub(super) struct KernelSum<'s> {
    point: &'s GatherPoint,
    kernel: Kernel,
    radius_squared: f64,
    per_radius_squared: f64,
    /// What a photon in the middle counts, for as much of the kernel as lies within the border; computed when the first
    /// photon counts.
    height: Option<f64>,
}

impl<'s> KernelSum<'s> {
    pub(super) fn new(point: &'s GatherPoint, lookup: &EstimateParameters, radius_squared: f32) -> Self {
        let radius_squared = f64::from(radius_squared);
        let per_radius_squared = radius_squared.recip();
        Self { point, kernel: lookup.kernel, radius_squared, per_radius_squared, height: None }
    }

    /// Shows a photon if it is on the surface that is looked at.
    #[inline]
    pub(super) fn show(&mut self, photon: &Photon, distance_squared: f32, show: &mut impl FnMut(&Photon, f64)) {
        if !self.point.shares(photon) {
            return;
        }
        let height = match self.height {
            Some(height) => height,
            None => *self.height.insert(self.height_within_border()),
        };
        show(photon, height * self.kernel.shape(f64::from(distance_squared) * self.per_radius_squared));
    }

    #[inline(never)]
    fn height_within_border(&self) -> f64 {
        let (point, radius) = (self.point, self.radius_squared.sqrt());
        let mass = point.polygon.map_or(1.0, |polygon| mass_within(self.kernel, &polygon, point.p, radius));
        self.kernel.height(self.radius_squared) / mass.max(MIN_MASS)
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn bits_are_spread_by_three() {
        for bit in 0..21 {
            assert_eq!(super::spread_bits(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(super::spread_bits(u64::MAX).count_ones(), 21);
    }

    use super::*;
    use crate::{math::Rgb, transport::PathClass};

    #[test]
    fn beside_a_polygon_by_rounding_photons_still_count_a_number() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let photon = Photon::new(Rgb::ONE, DVec3::Z, DVec3::Z, 7, 1, PathClass::Direct);
        for p in [DVec3::ZERO, DVec3::new(-1e-9, -1e-9, 0.0), DVec3::new(0.5, -1e-6, 0.0)] {
            let map = Map::new(&[p.as_vec3().to_array()], vec![photon]);
            let point = GatherPoint { polygon: Some(square), ..GatherPoint::flat(p, DVec3::Z, 7) };
            for radius in [1e-20, 1e-12, 1e-7, 0.1, 1e15] {
                for (_, kernel) in Kernel::ALL {
                    let mut counts = Vec::new();
                    map.gather(&point, &EstimateParameters { nearest: None, radius, kernel }, |_, count| {
                        counts.push(count)
                    });
                    let [count] = counts[..] else { panic!("one photon is there") };
                    assert!(count.is_finite() && count > 0.0, "{p} {radius} {kernel:?}: {count}");
                }
            }
        }
    }
}
