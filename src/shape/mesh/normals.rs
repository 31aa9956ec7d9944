use glam::DVec3;

use super::{narrow, wide};

/// A unit normal for every vertex: the normals of its triangles, each weighted by its angle there, so that the result
/// does not depend on how a flat face is cut into triangles. Zero for vertices of no triangle.
///
/// Thürmer and Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1).
pub(super) fn of_vertices(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let corners = triangle.map(|v| wide(positions[v as usize]));
        let Some(n) = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize() else { continue };
        for i in 0..3 {
            let one = corners[(i + 1) % 3] - corners[i];
            let other = corners[(i + 2) % 3] - corners[i];
            sums[triangle[i] as usize] += one.angle_between(other) * n;
        }
    }
    sums.into_iter().map(|sum| narrow(sum.normalize_or_zero())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_a_cubes_corner_the_diagonal_of_a_face_makes_no_difference() {
        // Three faces meet at the origin, the first cut through the origin, the others not.
        let positions =
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1]].map(|p| p.map(|x| x as f32));
        let triangles = [[0, 2, 1], [0, 3, 2], [0, 4, 3], [4, 5, 3], [0, 1, 4], [1, 6, 4]];
        let n = wide(of_vertices(&positions, &triangles)[0]);
        assert!((n - DVec3::splat(-1.0 / 3.0_f64.sqrt())).length() < 1e-6, "{n}");
    }
}
