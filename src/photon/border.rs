use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::Kernel;

/// The fraction of a kernel's mass around a point that lies within a flat polygon around the point: 1 far from the
/// border, 1/2 on an edge, 1/4 in a right-angled corner. The polygon may be concave.
#[must_use]
pub(super) fn mass_within(kernel: Kernel, polygon: &[DVec3], p: DVec3, radius: f64) -> f64 {
    let next = |i: usize| polygon[(i + 1) % polygon.len()];
    let is_near = |i: usize| distance_to_segment(p, polygon[i], next(i)) < radius;
    if !(0..polygon.len()).any(is_near) {
        return 1.0;
    }
    let along = (next(0) - polygon[0]).normalize();
    let normal = (0..polygon.len()).map(|i| (polygon[i] - p).cross(next(i) - p)).sum::<DVec3>().normalize();
    let across = normal.cross(along);
    let flat = |corner: DVec3| DVec2::new(along.dot(corner - p), across.dot(corner - p));
    (0..polygon.len()).map(|i| within_wedge(kernel, flat(polygon[i]), flat(next(i)), radius)).sum()
}

fn distance_to_segment(p: DVec3, from: DVec3, to: DVec3) -> f64 {
    let edge = to - from;
    let t = ((p - from).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
    (from + t * edge - p).length()
}

/// The kernel's mass in the wedge between the centre and an edge, negative if the edge runs clockwise.
fn within_wedge(kernel: Kernel, from: DVec2, to: DVec2, radius: f64) -> f64 {
    let direction = (to - from).normalize();
    let signed = from.perp_dot(direction);
    let h = signed.abs();
    // For a point on the edge, the wedge has angle zero.
    if h < 1e-12 * radius {
        return 0.0;
    }
    // The tangent of the angle at which the edge leaves the circle.
    let reach = if h < radius { (radius * radius - h * h).sqrt() / h } else { 0.0 };
    let up_to = |t: f64| {
        let tangent = t / h;
        let inside = tangent.clamp(-reach, reach);
        let beyond = tangent.atan() - inside.atan();
        kernel.within_triangle(h, inside, radius) + beyond / TAU
    };
    signed.signum() * (up_to(to.dot(direction)) - up_to(from.dot(direction)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SQUARE: [DVec3; 4] = [
        DVec3::new(-1.0, -1.0, 0.3),
        DVec3::new(1.0, -1.0, 0.3),
        DVec3::new(1.0, 1.0, 0.3),
        DVec3::new(-1.0, 1.0, 0.3),
    ];

    /// The fraction by the midpoint rule.
    fn mass_by_quadrature(kernel: Kernel, p: DVec3, radius: f64) -> f64 {
        let n = 1200;
        let step = 2.0 * radius / f64::from(n);
        let at = |i: i32| -radius + (f64::from(i) + 0.5) * step;
        let mut mass = 0.0;
        for (x, y) in (0..n).flat_map(|i| (0..n).map(move |j| (at(i), at(j)))) {
            let is_inside = (p.x + x).abs() < 1.0 && (p.y + y).abs() < 1.0 && x * x + y * y < radius * radius;
            mass += if is_inside { kernel.density(x * x + y * y, radius * radius) * step * step } else { 0.0 };
        }
        mass
    }

    #[test]
    fn the_mass_at_a_straight_edge_matches_a_table() {
        for (u, expected) in [(0.0, 0.5), (0.25, 0.657_481), (0.5, 0.804_499), (0.75, 0.927_853), (1.0, 1.0)] {
            let p = DVec3::new(1.0 - 0.2 * u, 0.1, 0.3);
            assert!((mass_within(Kernel::Constant, &SQUARE, p, 0.2) - expected).abs() < 1e-6, "{u}");
        }
        for (_, kernel) in Kernel::ALL {
            assert!((mass_within(kernel, &SQUARE, DVec3::new(1.0, 1.0, 0.3), 0.2) - 0.25).abs() < 1e-9);
            assert!((mass_within(kernel, &SQUARE, DVec3::new(1.0, 0.0, 0.3), 0.2) - 0.5).abs() < 1e-9);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn the_mass_matches_quadrature(x in -1.0..1.0f64, y in -1.0..1.0f64, radius in 0.05..3.0f64, which in 0..3usize) {
            let (p, kernel) = (DVec3::new(x, y, 0.3), Kernel::ALL[which].1);
            let (mass, quadrature) = (mass_within(kernel, &SQUARE, p, radius), mass_by_quadrature(kernel, p, radius));
            // Quadrature may misclassify the grid cells on the border.
            prop_assert!((mass - quadrature).abs() < 6e-3 * quadrature, "{} {}", mass, quadrature);
            let mut turned = SQUARE;
            turned.reverse();
            prop_assert!((mass_within(kernel, &turned, p, radius) - mass).abs() < 1e-12);
        }
    }
}
