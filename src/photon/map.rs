use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::{EstimateParameters, GatherPoint, NearbyPhoton, Photon, PhotonLookup, Stored, estimate::KernelSum};
use crate::math::Aabb;

/// A k-d tree of photons, or of other records at surfaces.
#[derive(Debug)]
pub struct PhotonMap<P = Photon> {
    /// None if there are no photons.
    tree: Option<ImmutableKdTree<f32, 3>>,
    photons: Vec<P>,
}

impl<P: Stored> PhotonMap<P> {
    /// Builds a tree of photons and their positions, which must be equally many.
    ///
    /// # Panics
    /// If a coordinate is not finite, or there are 2³² photons or more.
    #[must_use]
    pub fn new(positions: &[[f32; 3]], photons: Vec<P>) -> Self {
        assert_eq!(positions.len(), photons.len());
        if photons.is_empty() {
            return Self { tree: None, photons };
        }
        // Photons that are near in space are stored near in memory, which makes lookups faster.
        let order = along_curve(positions);
        let positions: Vec<_> = order.iter().map(|&index| positions[index as usize]).collect();
        let photons = order.into_iter().map(|index| photons[index as usize]).collect();
        let tree = ImmutableKdTree::new_from_slice(&positions).expect("a tree can be built from any finite points");
        Self { tree: Some(tree), photons }
    }

    /// The number of photons.
    #[must_use]
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// Whether it holds no photon.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// The memory in bytes: each photon, its position, and its index in the tree.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.photons.len() * (size_of::<P>() + size_of::<[f32; 3]>() + size_of::<u32>())
    }

    /// Calls `visit` for the photons around a point, on the point's side of its surface.
    ///
    /// If the k-th nearest photon is at the distance r, the photons within r count with the kernel of radius r. The
    /// k-th itself does not count, because its distance defines the radius. So the estimate is `(k-1) / πr²` photons
    /// per area for photons of one surface, which is unbiased where the density is constant. `k / πr²` would be too
    /// bright by `k / (k-1)`. This also holds if photons of other surfaces lie in between. The kernel is normalized
    /// within the border of a flat polygon.
    #[inline]
    pub fn for_each_nearby(
        &self,
        point: &GatherPoint,
        parameters: &EstimateParameters,
        mut visit: impl FnMut(NearbyPhoton<'_, P>),
    ) {
        let Some(tree) = &self.tree else { return };
        // Distances are f32: the clamp keeps their squares in range.
        let cap = ((parameters.radius * parameters.radius) as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
        let query = point.p.as_vec3().to_array();
        match parameters.nearest {
            None => {
                let mut sum = KernelSum::new(point, parameters.kernel, cap);
                for found in tree.query(&query).within::<SquaredEuclidean<f32>>(cap).unsorted().execute() {
                    sum.visit(&self.photons[found.item as usize], found.distance, &mut visit);
                }
            }
            Some(nearest) => {
                let mut found = tree.query(&query).nearest_n::<SquaredEuclidean<f32>>(nearest).within(cap).execute();
                let reach = if found.len() == nearest.get() {
                    found.pop().map_or(cap, |farthest| farthest.distance)
                } else {
                    cap
                };
                // If all photons lie at one point, the estimate uses the maximum radius.
                let mut sum = KernelSum::new(point, parameters.kernel, if reach > 0.0 { reach } else { cap });
                for found in &found {
                    sum.visit(&self.photons[found.item as usize], found.distance, &mut visit);
                }
            }
        }
    }
}

/// A lookup in a map with fixed parameters.
#[derive(Clone, Copy, Debug)]
pub struct MapLookup<'m> {
    /// The map.
    pub map: &'m PhotonMap,
    /// The parameters of the estimate.
    pub parameters: &'m EstimateParameters,
}

impl PhotonLookup for MapLookup<'_> {
    #[inline]
    fn for_each_nearby(&self, point: &GatherPoint, visit: impl FnMut(NearbyPhoton<'_>)) {
        self.map.for_each_nearby(point, self.parameters, visit);
    }
}

/// The order of points along a Morton curve through their bounding box. Points with equal codes keep their order.
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

/// The lowest 21 bits of `x`, each followed by two zeros.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Rgb,
        photon::{Kernel, SurfaceSide},
        transport::PathClass,
    };

    #[test]
    fn bits_are_spread_by_three() {
        for bit in 0..21 {
            assert_eq!(spread_bits(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread_bits(u64::MAX).count_ones(), 21);
    }

    #[test]
    fn photons_outside_a_polygon_by_rounding_have_a_finite_density() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let photon = Photon::new(Rgb::ONE, DVec3::Z, SurfaceSide::new(DVec3::Z, 7), 1, PathClass::Direct);
        for p in [DVec3::ZERO, DVec3::new(-1e-9, -1e-9, 0.0), DVec3::new(0.5, -1e-6, 0.0)] {
            let map = PhotonMap::new(&[p.as_vec3().to_array()], vec![photon]);
            let point = GatherPoint { polygon: Some(square), ..GatherPoint::flat(p, DVec3::Z, 7) };
            for radius in [1e-20, 1e-12, 1e-7, 0.1, 1e15] {
                for (_, kernel) in Kernel::ALL {
                    let mut counts = Vec::new();
                    let parameters = EstimateParameters { nearest: None, radius, kernel };
                    map.for_each_nearby(&point, &parameters, |nearby| counts.push(nearby.density));
                    let [count] = counts[..] else { panic!("one photon is found") };
                    assert!(count.is_finite() && count > 0.0, "{p} {radius} {kernel:?}: {count}");
                }
            }
        }
    }
}
