use glam::{DVec2, DVec3};

use crate::{
    math::{PerSolidAngle, cos_theta, luminance, warp},
    photon::{GatherPoint, MapLookup, PhotonLookup as _},
    transport::{PathClass, ShadingPoint},
};

/// From where the photons around a place came: a density of directions to gather from. The unit square, which the
/// hemisphere is an image of by cosines, is cut into cells, each drawn in proportion to the power of its photons.
/// Jensen 1995, "Importance Driven Path Tracing using the Photon Map".
pub(super) struct DirectionHistogram {
    /// The power of the cells up to each, the last being 1.
    up_to: [f64; CELLS],
    /// The sign of the side that is looked at.
    side: f64,
}

const ROWS: usize = 4;
const CELLS: usize = ROWS * ROWS;

impl DirectionHistogram {
    /// The guide of a place; None if no indirect photon is near it.
    pub(super) fn new(lookup: &MapLookup<'_>, gather_point: &GatherPoint, point: &ShadingPoint<'_>) -> Option<Self> {
        let side = if cos_theta(point.query.wi) < 0.0 { -1.0 } else { 1.0 };
        let mut up_to = [0.0; CELLS];
        let shading = &point.si.surface.shading;
        lookup.for_each_nearby(gather_point, |nearby| {
            let local = side * shading.to_local(nearby.photon.direction());
            if nearby.photon.class() == PathClass::Indirect && local.z > 0.0 {
                up_to[cell(local)] += luminance(nearby.photon.power()) * nearby.density;
            }
        });
        let mut total = 0.0;
        for power in &mut up_to {
            total += *power;
            *power = total;
        }
        // The last is then exactly 1.
        up_to.iter_mut().for_each(|power| *power /= total);
        (total > 0.0).then_some(Self { up_to, side })
    }

    /// The chance of a cell, and of all before it.
    fn chance(&self, cell: usize) -> (f64, f64) {
        let before = if cell == 0 { 0.0 } else { self.up_to[cell - 1] };
        (self.up_to[cell] - before, before)
    }

    /// Draws a local direction.
    pub(super) fn sample(&self, u: DVec2) -> DVec3 {
        let cell = self.up_to.partition_point(|&up_to| up_to <= u.x).min(CELLS - 1);
        let (chance, before) = self.chance(cell);
        // What is left of u.x within the cell is uniform again.
        let rest = ((u.x - before) / chance).clamp(0.0, 1.0);
        let square = DVec2::new((cell % ROWS) as f64 + rest, (cell / ROWS) as f64 + u.y) / ROWS as f64;
        self.side * warp::square_to_cosine_hemisphere(square)
    }

    /// The density of a local direction.
    pub(super) fn pdf(&self, wo: DVec3) -> PerSolidAngle {
        let local = self.side * wo;
        if local.z <= 0.0 {
            return PerSolidAngle(0.0);
        }
        let (chance, _) = self.chance(cell(local));
        PerSolidAngle(chance * CELLS as f64 * warp::square_to_cosine_hemisphere_pdf(local.z))
    }
}

/// The cell of a direction of the upper hemisphere.
fn cell(local: DVec3) -> usize {
    let square = warp::disc_to_square(local.truncate());
    let index = |x: f64| ((x * ROWS as f64) as usize).min(ROWS - 1);
    index(square.y) * ROWS + index(square.x)
}
