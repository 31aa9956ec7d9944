use glam::DVec3;

use super::{narrow, wide};

/// A unit normal for every vertex: the sum of the normals of its triangles, each weighted by the triangle's angle at
/// the vertex, so that the result does not depend on the triangulation of flat faces. It is zero for a vertex without
/// triangles.
///
/// Thürmer and Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1).
pub(super) fn of_vertices(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let corners = triangle.map(|v| wide(positions[v as usize]));
        let Some(n) = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize() else { continue };
        for i in 0..3 {
            let to_next = corners[(i + 1) % 3] - corners[i];
            let to_previous = corners[(i + 2) % 3] - corners[i];
            sums[triangle[i] as usize] += to_next.angle_between(to_previous) * n;
        }
    }
    sums.into_iter().map(|sum| narrow(sum.normalize_or_zero())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_at_a_cubes_corner_does_not_depend_on_the_diagonals_of_its_faces() {
        // Three faces share the corner at the origin. The diagonal of the first passes through it, the others do not.
        let positions =
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1]].map(|p| p.map(|x| x as f32));
        let triangles = [[0, 2, 1], [0, 3, 2], [0, 4, 3], [4, 5, 3], [0, 1, 4], [1, 6, 4]];
        let n = wide(of_vertices(&positions, &triangles)[0]);
        assert!((n - DVec3::splat(-1.0 / 3.0_f64.sqrt())).length() < 1e-6, "{n}");
    }
}
