use rayon::prelude::*;
use smallvec::SmallVec;

use super::{EmittedPhotons, GatherPoint, Kernel, NearbyPhoton, Photon, PhotonLookup, estimate::KernelSum};

/// Photons in a hashed uniform grid, built in one step, for lookups with a radius near half the edge of a cell. The
/// order in which it visits photons does not depend on the number of threads.
#[derive(Debug)]
pub struct PhotonGrid {
    cells: Cells,
    /// The photons by the first bits of their bucket's index.
    parts: Vec<GridPart>,
}

/// Maps positions to cells and buckets.
#[derive(Clone, Copy, Debug)]
struct Cells {
    per_length: f64,
    /// The number of buckets is 2^bits.
    bits: u32,
}

/// The photons of consecutive buckets, in the order of the buckets and, within each, of emission.
#[derive(Debug)]
struct GridPart {
    /// The index after the last photon of each bucket.
    ends: Vec<u32>,
    photons: Vec<GridPhoton>,
}

#[derive(Clone, Copy, Debug, Default)]
struct GridPhoton {
    position: [f32; 3],
    photon: Photon,
}

impl Cells {
    /// The cell of a position along each axis.
    #[inline]
    fn of(&self, position: [f64; 3]) -> [i64; 3] {
        position.map(|x| {
            // Rounds down without a library call.
            let towards_zero = (x * self.per_length) as i64;
            towards_zero.saturating_sub(i64::from(towards_zero as f64 > x * self.per_length))
        })
    }

    #[inline]
    fn bucket(&self, [x, y, z]: [i64; 3]) -> u32 {
        // Multiplicative hashing with odd factors; the highest bits depend on all others.
        const FACTORS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xd1b5_4a32_d192_ed03, 0x8cb9_2ba7_2f3d_8dd7];
        let [x, y, z] = [x, y, z].map(|x| x as u64);
        let mixed =
            x.wrapping_mul(FACTORS[0]) ^ y.wrapping_mul(FACTORS[1]).rotate_left(21) ^ z.wrapping_mul(FACTORS[2]);
        ((mixed ^ mixed >> 32).wrapping_mul(FACTORS[0]) >> (64 - self.bits)) as u32
    }
}

/// The maximum of `Cells::bits`.
const MAX_BITS: u32 = 26;

impl PhotonGrid {
    /// Sorts batches of photons into cells whose edge is given in m.
    ///
    /// # Panics
    /// If there are 2³² photons or more.
    #[must_use]
    pub fn new(emitted: &[EmittedPhotons], edge: f64) -> Self {
        let count: usize = emitted.iter().map(|batch| batch.photons.len()).sum();
        let count = u32::try_from(count).expect("photon indices have 32 bits");
        let bits = count.next_power_of_two().trailing_zeros().clamp(1, MAX_BITS);
        let cells = Cells { per_length: edge.recip(), bits };
        let bucket = |position: &[f32; 3]| cells.bucket(cells.of(position.map(f64::from)));
        let of_batch = |batch: &EmittedPhotons| batch.positions.iter().map(bucket).collect();
        let buckets: Vec<Vec<u32>> = emitted.par_iter().map(of_batch).collect();
        // Each thread picks the photons of its own buckets.
        let parts = rayon::current_num_threads().next_power_of_two().min(1 << bits);
        let size = (1 << bits) / parts;
        let part = |part: usize| GridPart::new(emitted, &buckets, part * size, size);
        Self { cells, parts: (0..parts).into_par_iter().map(part).collect() }
    }

    /// The number of photons.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.iter().map(|part| part.photons.len()).sum()
    }

    /// Whether it holds no photon.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A lookup of all photons within a radius in m, weighted by a kernel.
    #[must_use]
    pub fn within(&self, radius: f64, kernel: Kernel) -> GridLookup<'_> {
        GridLookup { grid: self, radius, kernel }
    }

    /// The buckets of all cells that a sphere's bounding box overlaps, without duplicates; None if there are more cells
    /// than buckets.
    #[inline]
    fn buckets(&self, point: &GatherPoint, radius: f64) -> Option<SmallVec<[u32; 8]>> {
        let low = self.cells.of((point.p - radius).to_array());
        let high = self.cells.of((point.p + radius).to_array());
        let counts = [0, 1, 2].map(|axis| (high[axis] as f64 - low[axis] as f64) + 1.0);
        if counts.iter().product::<f64>() > f64::from(1_u32 << self.cells.bits) {
            return None;
        }
        let mut buckets = SmallVec::<[u32; 8]>::new();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    buckets.push(self.cells.bucket([x, y, z]));
                }
            }
        }
        // Two cells may share a bucket.
        buckets.sort_unstable();
        buckets.dedup();
        Some(buckets)
    }

    #[inline]
    fn bucket(&self, bucket: u32) -> &[GridPhoton] {
        let shift = self.cells.bits - self.parts.len().trailing_zeros();
        let part = &self.parts[(bucket >> shift) as usize];
        let index = (bucket & ((1 << shift) - 1)) as usize;
        let start = if index == 0 { 0 } else { part.ends[index - 1] };
        &part.photons[start as usize..part.ends[index] as usize]
    }
}

/// A lookup in a grid with a fixed radius and kernel.
#[derive(Clone, Copy, Debug)]
pub struct GridLookup<'g> {
    grid: &'g PhotonGrid,
    radius: f64,
    kernel: Kernel,
}

impl PhotonLookup for GridLookup<'_> {
    #[inline]
    fn for_each_nearby(&self, point: &GatherPoint, mut visit: impl FnMut(NearbyPhoton<'_>)) {
        let (grid, radius) = (self.grid, self.radius);
        let radius_squared = ((radius * radius) as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
        let mut sum = KernelSum::new(point, self.kernel, radius_squared);
        let p = point.p.as_vec3().to_array();
        let mut visit_all = |photons: &[GridPhoton]| {
            for placed in photons {
                let [x, y, z] = [0, 1, 2].map(|axis| placed.position[axis] - p[axis]);
                let distance_squared = x * x + y * y + z * z;
                if distance_squared < radius_squared {
                    let squared_distance = f64::from(distance_squared / radius_squared);
                    sum.visit(&placed.photon, distance_squared, &mut |nearby| {
                        visit(NearbyPhoton { squared_distance, ..nearby });
                    });
                }
            }
        };
        match grid.buckets(point, radius) {
            Some(buckets) => buckets.into_iter().for_each(|bucket| visit_all(grid.bucket(bucket))),
            None => grid.parts.iter().for_each(|part| visit_all(&part.photons)),
        }
    }
}

impl GridPart {
    /// Counting sort of the photons of `size` buckets from index `first`.
    fn new(emitted: &[EmittedPhotons], buckets: &[Vec<u32>], first: usize, size: usize) -> Self {
        let own = |bucket: u32| (bucket as usize).checked_sub(first).filter(|index| *index < size);
        let mut ends = vec![0_u32; size];
        for &bucket in buckets.iter().flatten() {
            if let Some(index) = own(bucket) {
                ends[index] += 1;
            }
        }
        let mut total = 0;
        for end in &mut ends {
            (*end, total) = (total, total + *end);
        }
        // Each entry is the start of its bucket here, and its end once all photons are placed.
        let mut photons = vec![GridPhoton::default(); total as usize];
        for (batch, buckets) in emitted.iter().zip(buckets) {
            for ((&position, &photon), &bucket) in batch.positions.iter().zip(&batch.photons).zip(buckets) {
                if let Some(index) = own(bucket) {
                    photons[ends[index] as usize] = GridPhoton { position, photon };
                    ends[index] += 1;
                }
            }
        }
        Self { ends, photons }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::{
        math::{Rgb, rng::Stream},
        photon::{EstimateParameters, MapLookup, PhotonMap, SurfaceSide},
        transport::PathClass,
    };

    fn trace_photons(count: usize, size: f64) -> EmittedPhotons {
        let mut stream = Stream::at(&[91]);
        let mut emitted = EmittedPhotons::default();
        for i in 0..count {
            let p = DVec3::new(stream.next_1d(), stream.next_1d(), 0.1 * stream.next_1d()) * size - 0.4 * size;
            emitted.positions.push(p.as_vec3().to_array());
            let power = Rgb::splat(i as f64 + 1.0);
            emitted.photons.push(Photon::new(power, DVec3::Z, SurfaceSide::new(DVec3::Z, 3), 1, PathClass::Direct));
        }
        emitted
    }

    /// The identifiers and densities of all photons that a lookup finds, ordered by identifier.
    fn found(lookup: &impl PhotonLookup, point: &GatherPoint) -> Vec<(u64, f64)> {
        let mut found = Vec::new();
        lookup.for_each_nearby(point, |nearby| found.push((nearby.photon.power().x as u64, nearby.density)));
        found.sort_by_key(|(number, _)| *number);
        found
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_grid_finds_the_same_photons_as_the_tree(
            count in 0..400usize,
            edge in prop_oneof![1e-3..0.1f64, 0.1..20.0f64],
            radius in prop_oneof![1e-3..1.0f64, 1.0..60.0f64],
            at in prop::array::uniform3(-5.0..5.0f64),
            threads in 1..5usize,
        ) {
            let emitted = trace_photons(count, 10.0);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let grid = pool.install(|| PhotonGrid::new(std::slice::from_ref(&emitted), edge));
            let map = PhotonMap::new(&emitted.positions, emitted.photons.clone());
            prop_assert_eq!(grid.len(), count);
            let point = GatherPoint::flat(DVec3::from_array(at) * DVec3::new(1.0, 1.0, 0.1), DVec3::Z, 3);
            let parameters = EstimateParameters { nearest: None, radius, kernel: Kernel::Cone };
            let by_map = found(&MapLookup { map: &map, parameters: &parameters }, &point);
            prop_assert_eq!(by_map, found(&grid.within(radius, Kernel::Cone), &point));
        }
    }

    #[test]
    fn the_order_does_not_depend_on_the_number_of_threads() {
        let emitted = trace_photons(5000, 1.0);
        let point = GatherPoint::flat(DVec3::new(0.0, 0.0, -0.35), DVec3::Z, 3);
        let order = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let grid = pool.install(|| PhotonGrid::new(std::slice::from_ref(&emitted), 0.2));
            let mut order = Vec::new();
            let lookup = grid.within(0.1, Kernel::Constant);
            lookup.for_each_nearby(&point, |nearby| order.push(nearby.photon.power().x));
            order
        };
        let with_one_thread = order(1);
        assert!(with_one_thread.len() > 100);
        assert_eq!(with_one_thread, order(2));
        assert_eq!(with_one_thread, order(7));
    }
}
