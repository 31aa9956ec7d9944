use std::{collections::HashMap, f64::consts::TAU};

use proptest::prelude::*;

use super::*;
use crate::{math::rng::Stream, shape::bvh::SLACK};

/// Tests the triangles one after the other, with the arithmetic of the blocks.
fn brute_force(triangles: &Triangles, ray: &Ray) -> Option<TriangleHit> {
    let shear = Shear::new(ray);
    let mut best: Option<TriangleHit> = None;
    for (index, indices) in triangles.indices.iter().enumerate() {
        let corners = indices.map(|i| triangles.positions[i as usize]);
        if bounds(&corners).is_empty() {
            continue;
        }
        let t_max = best.map_or(ray.t_max, |hit| hit.t);
        let alone = Block::new(std::iter::once((index as u32, corners)));
        best = alone.closest(&shear, &Ray { t_max, ..*ray }).or(best);
    }
    best
}

/// The test of Möller & Trumbore (1997), as a reference for hits that are not near an edge.
fn moller_trumbore([a, b, c]: [DVec3; 3], ray: &Ray) -> Option<(f64, f64, f64)> {
    let (ab, ac) = (b - a, c - a);
    let p = ray.direction.cross(ac);
    let determinant = ab.dot(p);
    let from_a = ray.origin - a;
    let b1 = from_a.dot(p) / determinant;
    let q = from_a.cross(ab);
    let b2 = ray.direction.dot(q) / determinant;
    let t = ac.dot(q) / determinant;
    (b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 && ray.contains(t)).then_some((t, b1, b2))
}

fn soup(corners: Vec<[DVec3; 3]>) -> Triangles {
    let positions: Vec<_> = corners.iter().flatten().map(|p| p.as_vec3().to_array()).collect();
    let indices = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Triangles::new(positions, indices)
}

fn in_cube(random: &mut Stream) -> DVec3 {
    2.0 * DVec3::new(random.next_1d(), random.next_1d(), random.next_1d()) - 1.0
}

/// A random direction of any length, sometimes with components that are zero.
fn direction(random: &mut Stream) -> DVec3 {
    let mut d = in_cube(random) * 10.0_f64.powf(6.0 * random.next_1d() - 3.0);
    let kind = random.next_bits() % 16;
    if kind < 7 {
        d.x *= f64::from(kind as u32 & 1);
        d.y *= f64::from(kind as u32 >> 1 & 1);
        d.z *= f64::from(kind as u32 >> 2 & 1);
    }
    if d == DVec3::ZERO { DVec3::NEG_Z } else { d }
}

/// A unit icosahedron whose faces are divided into four `levels` times.
fn icosphere(levels: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let g = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut positions = vec![];
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        let corners = [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)];
        positions.extend(corners.map(DVec3::normalize));
    }
    // The faces are the triples of corners that are nearest neighbours.
    let is_edge = |a: usize, b: usize| (positions[a] - positions[b]).length() < 1.1;
    let mut faces = vec![];
    for (a, b, c) in (0..12).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| (a, b, c)))) {
        if is_edge(a, b) && is_edge(b, c) && is_edge(c, a) {
            faces.push([a as u32, b as u32, c as u32]);
        }
    }
    for _ in 0..levels {
        let mut midpoints = HashMap::new();
        let mut midpoint = |a: u32, b: u32| {
            *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let divide = |[a, b, c]: [u32; 3]| {
            let [ab, bc, ca] = [midpoint(a, b), midpoint(b, c), midpoint(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(divide).collect();
    }
    (positions.iter().map(|p| p.as_vec3().to_array()).collect(), faces)
}

/// Compares the hierarchy with brute force, and `occluded` with `closest`. Returns whether there is a hit.
fn check(triangles: &Triangles, ray: &Ray) -> bool {
    let (hit, expected) = (triangles.closest(ray), brute_force(triangles, ray));
    assert_eq!(hit.map(|h| h.t.to_bits()), expected.map(|h| h.t.to_bits()), "{ray:?}: {hit:?}, not {expected:?}");
    assert_eq!(triangles.occluded(ray), hit.is_some(), "{ray:?}: {hit:?}");
    if let Some(hit) = hit {
        assert!(ray.contains(hit.t), "{ray:?}: {hit:?}");
        // The hit is a point of the triangle and of the ray, within the slack of the hierarchy.
        let [a, b, c] = triangles.triangle(hit.triangle);
        let p = (1.0 - hit.b1 - hit.b2) * a + hit.b1 * b + hit.b2 * c;
        let size = [a, b, c, ray.origin].iter().fold(0.0_f64, |size, p| size.max(p.abs().max_element()));
        assert!((p - ray.at(hit.t)).abs().max_element() < SLACK * size, "{ray:?}: {hit:?}");
        let alone = Triangles::new(triangles.positions.clone(), vec![triangles.indices[hit.triangle as usize]]);
        assert_eq!(alone.closest(ray), Some(TriangleHit { triangle: 0, ..hit }), "{ray:?}");
    }
    hit.is_some()
}

#[test]
fn hits_on_random_triangles_at_any_scale_equal_brute_force() {
    let mut hits = 0;
    for case in 0..60 {
        let mut random = Stream::at(&[1, case]);
        let scale = 10.0_f64.powi((case % 13) as i32 - 6);
        let offset = [0.0, 1.0, 100.0, 1e6][case as usize / 13 % 4] * scale * in_cube(&mut random);
        let size = 10.0_f64.powf(-2.0 * random.next_1d());
        let mut corners = || {
            let at = in_cube(&mut random);
            [0; 3].map(|_| offset + scale * (at + size * in_cube(&mut random)))
        };
        let triangles = soup((0..150).map(|_| corners()).collect());
        let mut random = Stream::at(&[2, case]);
        for _ in 0..2000 {
            let origin = offset + 1.5 * scale * in_cube(&mut random);
            let mut ray = Ray::new(origin, direction(&mut random));
            if random.next_bits().is_multiple_of(2) {
                let target = triangles.triangle((random.next_bits() % 150) as u32)[0];
                let d = target - origin;
                (ray.t_min, ray.t_max) = (random.next_1d() - 0.5, 1.0 + random.next_1d());
                ray.direction = d + scale * size * 0.5 * in_cube(&mut random);
            }
            hits += u32::from(check(&triangles, &ray));
        }
    }
    assert!(hits > 25_000, "{hits} hits");
}

#[test]
fn hits_equal_those_of_moller_and_trumbore() {
    let mut random = Stream::at(&[3]);
    for _ in 0..20_000 {
        let corners = [0; 3].map(|_| in_cube(&mut random).as_vec3().as_dvec3());
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let ray = Ray::new(2.0 * in_cube(&mut random), direction(&mut random).normalize());
        let expected = moller_trumbore(corners, &ray);
        let hit = soup(vec![corners]).closest(&ray);
        // Skip rays that graze the plane or pass near an edge.
        let cosine = normal.dot(ray.direction).abs();
        let near = |(_, b1, b2): (f64, f64, f64)| b1.min(b2).min(1.0 - b1 - b2) < 1e-9;
        if cosine < 1e-3 || expected.is_some_and(near) {
            continue;
        }
        match (hit, expected) {
            (Some(hit), Some((t, b1, b2))) => {
                let error = (hit.t - t).abs().max((hit.b1 - b1).abs()).max((hit.b2 - b2).abs());
                assert!(error < 1e-11, "{hit:?}, not {t} {b1} {b2}");
            }
            (None, None) => {}
            _ => panic!("{ray:?}: {hit:?}, not {expected:?}"),
        }
    }
}

#[test]
fn no_ray_escapes_a_closed_mesh() {
    let (positions, faces) = icosphere(5);
    assert_eq!((positions.len(), faces.len()), (10_242, 20_480));
    let triangles = Triangles::new(positions, faces);
    let mut random = Stream::at(&[4]);
    for i in 0..1_000_000 {
        let origin = 0.9 * in_cube(&mut random) / 3.0_f64.sqrt();
        let [a, b, _] = triangles.triangle((random.next_bits() % 20_480) as u32);
        // Towards a random point, a corner, or a point of an edge.
        let d = match i % 3 {
            0 => in_cube(&mut random),
            1 => a - origin,
            _ => a.lerp(b, random.next_1d()) - origin,
        };
        let ray = Ray::new(origin, d);
        assert!(triangles.closest(&ray).is_some(), "{ray:?} escapes");
        assert!(triangles.occluded(&ray), "{ray:?} is not occluded");
    }
}

/// Squares of side `1/8` on the plane where a coordinate is `height`, each of two triangles.
fn grid(axis: usize, height: f32) -> Triangles {
    let mut positions = vec![];
    for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
        let mut p = [height; 3];
        p[(axis + 1) % 3] = i as f32 / 8.0;
        p[(axis + 2) % 3] = j as f32 / 8.0;
        positions.push(p);
    }
    let mut indices = vec![];
    for at in (0..8).flat_map(|i| (0..8).map(move |j| 9 * i + j)) {
        indices.extend([[at, at + 1, at + 9], [at + 1, at + 10, at + 9]]);
    }
    Triangles::new(positions, indices)
}

#[test]
fn flat_meshes_are_hit_by_axis_parallel_rays() {
    for (axis, height) in (0..3).flat_map(|axis| [0.0_f32, 0.3, -7.0, 1e6].map(|height| (axis, height))) {
        let triangles = grid(axis, height);
        let z = f64::from(height);
        let point = |u: f64, v: f64, w: f64| {
            let mut p = DVec3::ZERO;
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (w, u, v);
            p
        };
        for (i, j) in (-1..=17).flat_map(|i| (-1..=17).map(move |j| (i, j))) {
            let (u, v) = (f64::from(i) / 16.0, f64::from(j) / 16.0);
            let inside = (0..=16).contains(&i) && (0..=16).contains(&j);
            for (start, step) in [(-1.0, 0.5), (3.0, -0.25), (-1.0, 2e-9), (1.0, -4e9)] {
                let ray = Ray::new(point(u, v, z + start), point(0.0, 0.0, step));
                let expected = (z - (z + start)) / step;
                assert_eq!(check(&triangles, &ray), inside, "{ray:?}");
                // The parameter is the same at every point of a flat surface, up to two roundings.
                let near = |hit: TriangleHit| (hit.t / expected - 1.0).abs() < 1e-15;
                assert!(triangles.closest(&ray).is_none_or(near), "{ray:?}");
            }
            // Rays in the plane, parallel to the axes and oblique, through corners and along edges.
            for (du, dv) in [(1.0, 0.0), (0.0, -1.0), (1.0, 1.0), (-1.0, 3.0)] {
                assert!(!check(&triangles, &Ray::new(point(u - 3.0 * du, v - 3.0 * dv, z), point(du, dv, 0.0))));
            }
        }
    }
}

#[test]
fn rays_in_the_faces_of_bounding_boxes_hit() {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let triangles = Triangles::new(corners, vec![[0, 1, 2], [1, 3, 2]]);
    for i in 0..=8 {
        let s = f64::from(i) / 8.0;
        for (x, y) in [(s, 0.0), (s, 1.0), (0.0, s), (1.0, s), (s, 1.0 - s)] {
            for (dz, zero) in [(1.0, 0.0), (1.0, -0.0), (-1.0, 0.0), (-1.0, -0.0)] {
                assert!(check(&triangles, &Ray::new(DVec3::new(x, y, -2.0 * dz), DVec3::new(zero, zero, dz))));
            }
            let from = DVec3::new(x, -1.0, 1.0);
            assert!(check(&triangles, &Ray::new(from, DVec3::new(x, y, 0.0) - from)));
        }
    }
}

#[test]
fn rays_in_the_plane_of_a_triangle_hit_as_by_brute_force() {
    // Whether such a ray hits depends on rounding, but the hierarchy must agree with brute force.
    let mut hits = 0;
    for case in 0..40 {
        let mut random = Stream::at(&[5, case]);
        let triangles = soup((0..60).map(|_| [0; 3].map(|_| in_cube(&mut random))).collect());
        for _ in 0..2500 {
            let [a, b, c] = triangles.triangle((random.next_bits() % 60) as u32);
            let mut point = || {
                let (u, v) = (4.0 * random.next_1d() - 2.0, 4.0 * random.next_1d() - 2.0);
                a + u * (b - a) + v * (c - a)
            };
            let (from, to) = (point(), point());
            let lift = 1e-15 * (random.next_bits() % 3) as f64 * in_cube(&mut random);
            hits += u32::from(check(&triangles, &Ray::new(from, to - from + lift)));
        }
    }
    assert!(hits > 25_000, "{hits} hits");
}

#[test]
fn the_length_of_the_direction_does_not_matter() {
    let (positions, faces) = icosphere(3);
    let triangles = Triangles::new(positions, faces);
    let mut random = Stream::at(&[6]);
    for _ in 0..2000 {
        let ray = Ray::new(2.0 * in_cube(&mut random), in_cube(&mut random));
        let factor = 2.0_f64.powi((random.next_bits() % 80) as i32 - 40);
        let scaled = Ray { direction: ray.direction * factor, ..ray };
        let (t, u) = (triangles.closest(&ray).map(|h| h.t), triangles.closest(&scaled).map(|h| h.t * factor));
        assert_eq!(t, u);
    }
}

#[test]
fn the_ends_of_the_ray_are_excluded() {
    let triangles = grid(2, 0.5);
    let ray = Ray::new(DVec3::new(0.3, 0.4, -0.5), DVec3::Z);
    let t = triangles.closest(&ray).expect("the ray hits the grid").t;
    assert!((t - 1.0).abs() < 1e-15);
    assert!(!check(&triangles, &Ray { t_min: t, ..ray }));
    assert!(!check(&triangles, &Ray { t_max: t, ..ray }));
    assert!(check(&triangles, &Ray { t_min: t.next_down(), t_max: t.next_up(), ..ray }));
    assert!(check(&triangles, &Ray { t_min: -5.0, ..Ray::new(ray.at(3.0), ray.direction) }));
    assert!(check(&triangles, &Ray { t_min: f64::NEG_INFINITY, ..Ray::new(ray.at(1e3), ray.direction) }));
}

#[test]
fn an_empty_mesh_is_not_hit() {
    let triangles = Triangles::new(vec![], vec![]);
    assert!(!check(&triangles, &Ray::new(DVec3::ZERO, DVec3::X)) && triangles.bounds().is_empty());
}

#[test]
fn triangles_without_area_are_not_hit() {
    let corners = [
        [[0.1, 0.2, 0.3], [0.1, 0.2, 0.3], [0.7, 0.1, 0.2]],
        [[0.0, 0.0, 0.0], [0.25, 0.5, 0.75], [0.5, 1.0, 1.5]],
        [[f32::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[f32::INFINITY, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    ];
    let positions = corners.iter().flatten().copied().collect();
    let triangles = Triangles::new(positions, vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]]);
    assert!(triangles.bounds().is_empty());
    let mut random = Stream::at(&[7]);
    for _ in 0..1000 {
        let target = DVec3::new(0.25, 0.5, 0.75) * random.next_1d();
        let origin = in_cube(&mut random);
        assert!(!check(&triangles, &Ray::new(origin, target - origin)));
    }
}

#[test]
fn a_mesh_takes_less_than_90_bytes_per_triangle() {
    let (positions, faces) = icosphere(6);
    let triangles = Triangles::new(positions, faces);
    let each = triangles.bytes() as f64 / triangles.indices().len() as f64;
    assert!(each < 90.0, "{each} bytes a triangle");
}

/// A corner on a coarse lattice, so that triangles share corners, edges and planes, or have zero area.
fn lattice() -> impl Strategy<Value = DVec3> {
    (-2..=2, -2..=2, -2..=2).prop_map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)))
}

proptest! {
    #[test]
    fn hits_on_lattice_triangles_equal_brute_force(
        corners in prop::collection::vec([lattice(), lattice(), lattice()], 0..40),
        from in lattice(), to in lattice(), angle in 0.0..TAU,
        shift in prop::sample::select(vec![0.0, 1e-300, 1e-16, 1e-8]),
    ) {
        let triangles = soup(corners);
        let along = if from == to { DVec3::new(angle.cos(), angle.sin(), 0.0) } else { to - from };
        check(&triangles, &Ray::new(from + shift, along));
        check(&triangles, &Ray { t_min: -2.0, t_max: 2.0, ..Ray::new(from, along * (1.0 + shift)) });
    }
}
