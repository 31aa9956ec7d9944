use glam::{DVec2, DVec3};

use crate::{
    math::{DiscreteSample, Distribution1D, PerSolidAngle, cos_theta, luminance, warp},
    photon::{GatherPoint, MapLookup, PhotonLookup as _},
    transport::{PathClass, ShadingPoint},
};

/// A density of directions in proportion to the power of nearby photons from each direction. The unit square, mapped to
/// the cosine-weighted hemisphere, is divided into cells. Each cell is sampled in proportion to the power of its
/// photons. Jensen 1995, "Importance Driven Path Tracing using the Photon Map".
pub(super) struct DirectionHistogram {
    /// The cells by the power of their photons.
    cells: Distribution1D<[f64; CELLS]>,
    /// The sign of the side of the surface that the path arrives at.
    side: f64,
}

const ROWS: usize = 4;
const CELLS: usize = ROWS * ROWS;

impl DirectionHistogram {
    /// The histogram at a point; None if no indirect photon is near it.
    pub(super) fn new(lookup: &MapLookup<'_>, gather_point: &GatherPoint, point: &ShadingPoint<'_>) -> Option<Self> {
        let side = if cos_theta(point.query.wi) < 0.0 { -1.0 } else { 1.0 };
        let mut powers = [0.0; CELLS];
        let shading = &point.si.surface.shading;
        lookup.for_each_nearby(gather_point, |nearby| {
            let local = side * shading.to_local(nearby.photon.direction());
            if nearby.photon.class() == PathClass::Indirect && local.z > 0.0 {
                powers[cell(local)] += luminance(nearby.photon.power()) * nearby.density;
            }
        });
        let cells = Distribution1D::new(powers).normalized()?;
        Some(Self { cells, side })
    }

    /// Samples a local direction.
    pub(super) fn sample(&self, u: DVec2) -> DVec3 {
        let DiscreteSample { index: cell, remapped } = self.cells.sample(u.x);
        let square = DVec2::new((cell % ROWS) as f64 + remapped, (cell / ROWS) as f64 + u.y) / ROWS as f64;
        self.side * warp::square_to_cosine_hemisphere(square)
    }

    /// The density of a local direction.
    pub(super) fn pdf(&self, wo: DVec3) -> PerSolidAngle {
        let local = self.side * wo;
        if local.z <= 0.0 {
            return PerSolidAngle(0.0);
        }
        let chance = self.cells.probability(cell(local));
        PerSolidAngle(chance * CELLS as f64 * warp::square_to_cosine_hemisphere_pdf(local.z))
    }
}

/// The cell of a direction of the upper hemisphere.
fn cell(local: DVec3) -> usize {
    let square = warp::disc_to_square(local.truncate());
    let index = |x: f64| ((x * ROWS as f64) as usize).min(ROWS - 1);
    index(square.y) * ROWS + index(square.x)
}
