//! Tests of the guarantee of the hierarchy on boxes. The tests of `mesh::triangles` check it on triangles.

use glam::DVec3;
use proptest::prelude::*;

use super::{
    traverse::{Kernel as _, Portable, STACK, Slabs},
    *,
};
use crate::math::rng::Stream;

fn in_cube(random: &mut Stream) -> DVec3 {
    2.0 * DVec3::new(random.next_1d(), random.next_1d(), random.next_1d()) - 1.0
}

/// A number between two powers of ten.
fn scale(random: &mut Stream, from: f64, to: f64) -> f64 {
    10.0_f64.powf(from + (to - from) * random.next_1d())
}

/// Random boxes. A third of their extents are zero, and some of them share a position.
fn boxes(random: &mut Stream, count: usize, offset: DVec3, size: f64) -> Vec<Aabb> {
    let mut one = || {
        let bits = random.next_bits();
        let at = if bits.is_multiple_of(8) { DVec3::splat(0.5) } else { in_cube(random) };
        let extent = in_cube(random) * scale(random, -3.0, 0.0);
        let full = DVec3::from([8, 9, 10].map(|shift| f64::from(!(bits >> shift).is_multiple_of(3))));
        Aabb::around([offset + size * at, offset + size * (at + extent * full)])
    };
    (0..count).map(|_| one()).collect()
}

impl Bvh {
    /// The parameter of the closest hit. Calls `test` with primitives, approximately front to back.
    fn closest(&self, ray: &Ray, mut test: impl Test<u32>) -> Option<f64> {
        self.closest_block(ray, |block: u32, ray: &Ray| {
            let mut ray = *ray;
            let mut found = None;
            for &primitive in self.block(block) {
                if let Some(t) = test.test(primitive, &ray) {
                    ray.t_max = t;
                    found = Some(t);
                }
            }
            found
        })
    }

    /// Whether the ray hits anything. Calls `test` with primitives.
    fn any(&self, ray: &Ray, mut test: impl Test<u32>) -> bool {
        self.any_block(ray, |block: u32, ray: &Ray| {
            self.block(block).iter().find_map(|&primitive| test.test(primitive, ray))
        })
    }
}

/// The primitives that the traversal visits if nothing is hit, in ascending order.
fn visited(bvh: &Bvh, ray: &Ray) -> Vec<u32> {
    let mut visited = vec![];
    let any = bvh.any(ray, |primitive, _: &Ray| {
        visited.push(primitive);
        None
    });
    let mut again = vec![];
    let closest = bvh.closest(ray, |primitive, _: &Ray| {
        again.push(primitive);
        None
    });
    assert!(!any && closest.is_none());
    visited.sort_unstable();
    again.sort_unstable();
    assert_eq!(visited, again, "{ray:?}");
    visited
}

/// The bounding box of the primitives below a child. Checks that the boxes of the nodes contain it.
fn check_below(bvh: &Bvh, bounds: &[Aabb], child: Child) -> Aabb {
    if let Some(block) = child.as_block() {
        return bvh.block(block).iter().fold(Aabb::EMPTY, |all, &i| all.union(bounds[i as usize]));
    }
    let node = &bvh.tree.nodes[child.0 as usize];
    let mut all = Aabb::EMPTY;
    for slot in present(node) {
        let below = check_below(bvh, bounds, node.children[slot]);
        for axis in 0..3 {
            let [low, high] = [0, 1].map(|side| node.planes[axis][side].0[slot]);
            assert!(f64::from(low) <= below.min[axis] && below.max[axis] <= f64::from(high), "{node:?} {slot}");
            assert!(!low.is_subnormal() && !high.is_subnormal());
        }
        all = all.union(below);
    }
    all
}

/// The slots of a node's children.
fn present(node: &Node) -> impl Iterator<Item = usize> {
    (0..WIDTH).filter(|slot| node.present >> slot & 1 == 1)
}

/// The greatest number of entries that the traversal of a subtree can have on the stack.
fn max_stack(bvh: &Bvh, child: Child) -> usize {
    if child.as_block().is_some() {
        return 0;
    }
    let node = &bvh.tree.nodes[child.0 as usize];
    let deepest = present(node).map(|slot| max_stack(bvh, node.children[slot])).max().unwrap_or(0);
    present(node).count() - 1 + deepest
}

/// Checks the invariants on which the traversal relies.
fn check_structure(bvh: &Bvh, bounds: &[Aabb]) {
    let mut order = bvh.order.clone();
    order.sort_unstable();
    let expected: Vec<_> = (0..bounds.len() as u32).filter(|&i| !bounds[i as usize].is_empty()).collect();
    assert_eq!(order, expected);
    let blocks: Vec<_> = (0..bvh.block_count() as u32).flat_map(|block| bvh.block(block)).copied().collect();
    assert_eq!(blocks, bvh.order);
    let all = expected.iter().fold(Aabb::EMPTY, |all, &i| all.union(bounds[i as usize]));
    assert_eq!(bvh.bounds(), all);
    if !expected.is_empty() {
        assert_eq!(check_below(bvh, bounds, Child::node(0)), all);
        assert!(max_stack(bvh, Child::node(0)) < STACK);
    }
}

/// A ray to a point of a box, with the point's parameter up to rounding. The point is often a corner or on an edge or a
/// face. The direction is often parallel to an axis or a coordinate plane.
fn ray_to(b: &Aabb, size: f64, random: &mut Stream) -> Option<(Ray, f64)> {
    let bits = random.next_bits();
    let mut weights = 0.5 + 0.5 * in_cube(random);
    let mut offset = size * in_cube(random) * scale(random, -3.0, 3.0);
    for axis in 0..3 {
        if bits >> (2 * axis) & 2 == 0 {
            weights[axis] = (bits >> (2 * axis) & 1) as f64;
        }
        if bits >> (8 + 2 * axis) & 3 == 0 {
            offset[axis] = 0.0;
        }
    }
    let point = b.min + weights * b.extent();
    let origin = point - offset;
    let length = scale(random, -6.0, 6.0);
    let direction = (point - origin) * length;
    (direction != DVec3::ZERO).then(|| (Ray::new(origin, direction), 1.0 / length))
}

#[test]
fn no_box_on_the_ray_is_missed() {
    let mut checked = 0;
    for case in 0..100 {
        let mut random = Stream::at(&[10, case]);
        let size = scale(&mut random, -6.0, 6.0);
        let offset = [0.0, 1.0, 1e3, 1e6][case as usize % 4] * size * in_cube(&mut random);
        let bounds = boxes(&mut random, 200, offset, size);
        let bvh = Bvh::build_in_blocks(bounds.iter().copied(), 1 + case as usize % 5);
        check_structure(&bvh, &bounds);
        for _ in 0..2000 {
            let target = random.next_bits() as usize % bounds.len();
            let Some((ray, t)) = ray_to(&bounds[target], size, &mut random) else { continue };
            let back = Ray { direction: -ray.direction, ..ray };
            for ray in [
                ray,
                Ray { t_min: t.next_down(), t_max: t.next_up(), ..ray },
                Ray { t_min: -t, t_max: 1.5 * t, ..ray },
                Ray { t_min: -t.next_up(), t_max: -t.next_down(), ..back },
                Ray { t_min: f64::NEG_INFINITY, t_max: 0.0, ..back },
            ] {
                assert!(visited(&bvh, &ray).contains(&(target as u32)), "{ray:?} {:?}", bounds[target]);
            }
            checked += 1;
        }
    }
    assert!(checked > 150_000, "{checked}");
}

/// The parameters at which the line of a ray enters and leaves a box.
fn span(b: &Aabb, ray: &Ray) -> (f64, f64) {
    let (p, q) = ((b.min - ray.origin) / ray.direction, (b.max - ray.origin) / ray.direction);
    (p.min(q).max_element(), p.max(q).min_element())
}

#[test]
fn boxes_off_the_ray_are_skipped() {
    let mut random = Stream::at(&[11]);
    let corners = (0..4096).map(|i| DVec3::new(f64::from(i % 16), f64::from(i / 16 % 16), f64::from(i / 256)));
    let bounds: Vec<_> = corners.map(|corner| Aabb::around([corner, corner + 0.9])).collect();
    let bvh = Bvh::build(&bounds);
    let mut count = 0;
    for _ in 0..1000 {
        let origin = 8.0 + 20.0 * in_cube(&mut random).normalize();
        let ray = Ray::new(origin, 8.0 + 8.0 * in_cube(&mut random) - origin);
        let is_hit = |&i: &u32| {
            let (entry, exit) = span(&bounds[i as usize], &ray);
            entry <= exit && exit > 0.0
        };
        let hit: Vec<_> = (0..4096).filter(is_hit).collect();
        assert_eq!(visited(&bvh, &ray), hit);
        count += hit.len();
        // The traversal is front to back: it skips the boxes behind a hit.
        let mut visits = 0;
        let t = bvh.closest(&ray, |i, ray: &Ray| {
            visits += 1;
            let (entry, exit) = span(&bounds[i as usize], ray);
            (entry <= exit && ray.contains(entry)).then_some(entry)
        });
        let first = hit.iter().map(|&i| span(&bounds[i as usize], &ray).0).reduce(f64::min);
        assert_eq!(t, first);
        assert!(visits <= 3, "{visits} of {}", hit.len());
    }
    assert!(count > 5000, "{count}");
}

#[test]
fn boxes_beyond_the_ends_of_the_ray_are_skipped() {
    let point = |x: f64| DVec3::splat(x);
    let bounds: Vec<_> = (0..64).map(|i| Aabb::around([point(f64::from(i)), point(f64::from(i) + 0.5)])).collect();
    let bvh = Bvh::build(&bounds);
    for length in [1e-9, 0.3, 0.5, 1.0, 1.9, 2.0, 1e9] {
        for (from, to) in [(0.0, 10.2), (20.7, 20.9), (30.1, 31.2), (-1.0, 3.2), (-5.0, -4.0)] {
            let ray = Ray { t_min: from / length, t_max: to / length, ..Ray::new(DVec3::ZERO, point(length)) };
            let expected: Vec<_> =
                (0..64).filter(|&i| bounds[i as usize].min.x < to && from < bounds[i as usize].max.x).collect();
            assert_eq!(visited(&bvh, &ray), expected, "{ray:?}");
        }
    }
}

#[test]
fn empty_and_degenerate_hierarchies_can_be_built() {
    let ray = Ray::new(DVec3::new(-1.0, 0.0, 0.0), DVec3::X);
    let nan = Aabb { min: DVec3::NAN, max: DVec3::NAN };
    for none in [vec![], vec![Aabb::EMPTY], vec![nan, Aabb::EMPTY, nan]] {
        let bvh = Bvh::build(&none);
        check_structure(&bvh, &none);
        assert!(visited(&bvh, &ray).is_empty() && bvh.block_count() == 0);
    }
    let point = Aabb::around([DVec3::ZERO]);
    let all = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
    let half = Aabb { min: DVec3::new(3.0, f64::NEG_INFINITY, f64::NEG_INFINITY), ..all };
    for (one, count) in [(point, 1), (point, 7), (point, 1000), (all, 1), (all, 300), (half, 5)] {
        let bounds = vec![one; count];
        for block in [1, 4] {
            let bvh = Bvh::build_in_blocks(bounds.iter().copied(), block);
            check_structure(&bvh, &bounds);
            assert_eq!(visited(&bvh, &ray).len(), count);
        }
    }
    let mixed = [all, Aabb::EMPTY, point, nan, half, Aabb::around([DVec3::splat(1e300)]), point];
    let bvh = Bvh::build(&mixed);
    check_structure(&bvh, &mixed);
    // An invalid ray may visit any boxes, but the traversal ends.
    for none in [Ray::new(DVec3::NAN, DVec3::NAN), Ray::new(DVec3::splat(1e300), DVec3::ONE)] {
        assert!(visited(&bvh, &none).len() <= 5);
    }
    let found = visited(&bvh, &ray);
    assert!([0, 2, 4, 6].iter().all(|i| found.contains(i)), "{found:?}");
}

#[test]
fn unbalanced_trees_do_not_overflow_the_stack() {
    // The heuristic alone would split off these boxes one by one.
    for ratio in [0.5_f64, 0.9, 0.99, 1.01] {
        let corner = |i: i32| DVec3::ONE * ratio.powi(i);
        let nested: Vec<_> = (0..5000).map(|i| Aabb::around([DVec3::ZERO, corner(i)])).collect();
        let disjoint: Vec<_> = (0..5000).map(|i| Aabb::around([corner(i)])).collect();
        for (bounds, block) in [(&nested, 1), (&nested, 4), (&disjoint, 1), (&disjoint, 4)] {
            check_structure(&Bvh::build_in_blocks(bounds.iter().copied(), block), bounds);
        }
    }
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mut random = Stream::at(&[12]);
    let bounds = boxes(&mut random, 60_000, DVec3::ZERO, 1.0);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| Bvh::build_in_blocks(bounds.iter().copied(), 4))
    };
    let one = build(1);
    check_structure(&one, &bounds);
    for threads in [2, 7] {
        let other = build(threads);
        assert!(one.tree.nodes == other.tree.nodes && one.order == other.order && one.starts == other.starts);
    }
}

#[test]
fn a_forest_finds_the_hits_of_its_primitives() {
    let mut random = Stream::at(&[15]);
    for count in [0, 1, 3, 40] {
        // Every third primitive is a box without a hierarchy. The others have up to a hundred boxes, one to four per
        // block.
        let mut boxes_of = |i: usize| {
            let count = if i.is_multiple_of(3) { 1 } else { 1 + random.next_bits() as usize % 100 };
            let offset = 2.0 * in_cube(&mut random);
            boxes(&mut random, count, offset, 0.5)
        };
        let all: Vec<Vec<Aabb>> = (0..count).map(&mut boxes_of).collect();
        let around = |boxes: &Vec<Aabb>| boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        let own = |i: usize| (!i.is_multiple_of(3)).then(|| Bvh::build_in_blocks(all[i].iter().copied(), 1 + i % 4));
        let hierarchies: Vec<_> = (0..count).map(own).collect();
        let top = Bvh::build(&all.iter().map(around).collect::<Vec<_>>());
        let forest = Forest::new(&top, |i| hierarchies[i as usize].as_ref());
        let members = |leaf: Leaf| match &hierarchies[leaf.primitive as usize] {
            Some(own) => own.block(leaf.block).to_vec(),
            None => vec![leaf.block],
        };
        let spans = |i: usize, k: u32, ray: &Ray| span(&all[i][k as usize], ray);
        for _ in 0..500 {
            let ray = Ray::new(4.0 * in_cube(&mut random), in_cube(&mut random));
            let hit = |(entry, exit): (f64, f64), ray: &Ray| (entry <= exit && ray.contains(entry)).then_some(entry);
            let expected = (0..count)
                .flat_map(|i| (0..all[i].len() as u32).map(move |k| (i, k)))
                .filter_map(|(i, k)| hit(spans(i, k, &ray), &ray))
                .reduce(f64::min);
            let test = |leaf: Leaf, ray: &Ray| {
                let hits = members(leaf).into_iter().filter_map(|k| hit(spans(leaf.primitive as usize, k, ray), ray));
                hits.reduce(f64::min)
            };
            assert_eq!(forest.closest(&ray, test), expected, "{ray:?}");
            assert_eq!(forest.any(&ray, test), expected.is_some(), "{ray:?}");
        }
    }
}

/// The kernel under test, if this processor has it.
#[cfg(target_arch = "x86_64")]
fn avx2() -> Option<simd::avx2::Avx2> {
    simd::avx2::Avx2::detected()
}

#[cfg(target_arch = "x86_64")]
#[test]
fn both_kernels_give_the_same_bits() {
    let Some(avx2) = avx2() else { return };
    let number = |random: &mut Stream| match random.next_bits() % 8 {
        0 => 0.0,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        3 => -1.0,
        _ => (2.0 * random.next_1d() - 1.0) as f32 * scale(random, -3.0, 3.0) as f32,
    };
    let mut random = Stream::at(&[13]);
    for _ in 0..50_000 {
        let planes = [[[0; WIDTH]; 2]; 3].map(|axis| axis.map(|plane| Lanes(plane.map(|_| number(&mut random)))));
        let node = Node { planes, children: Default::default(), present: random.next_bits() as u32 & 0xff };
        // Factors that include zeros of either sign and numbers whose inverse overflows.
        let tiny = |random: &mut Stream| [1.0, 1.0, 1.0, 0.0, -0.0, 1e-60][random.next_bits() as usize % 6];
        let direction = in_cube(&mut random) * DVec3::new(tiny(&mut random), tiny(&mut random), 1.0);
        let ray = Ray { t_min: random.next_1d() - 0.5, ..Ray::new(in_cube(&mut random).round(), direction) };
        let slabs = Slabs::new(&ray, 0.0);
        let limit = number(&mut random);
        let (entry, hit) = Portable.intersect(&node, &slabs, limit);
        let (other_entry, other_hit) = avx2.intersect(&node, &slabs, limit);
        assert_eq!((entry.0.map(f32::to_bits), hit), (other_entry.0.map(f32::to_bits), other_hit), "{ray:?} {node:?}");
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn both_kernels_visit_the_same_blocks() {
    let Some(avx2) = avx2() else { return };
    let mut random = Stream::at(&[14]);
    let bounds = boxes(&mut random, 3000, DVec3::ZERO, 1.0);
    let bvh = Bvh::build_in_blocks(bounds.iter().copied(), 4);
    for _ in 0..20_000 {
        let ray = Ray::new(in_cube(&mut random), in_cube(&mut random));
        // Every seventh block counts as a hit at half of `t_max`.
        let test = |block: u32, ray: &Ray, visited: &mut Vec<u32>| {
            visited.push(block);
            block.is_multiple_of(7).then_some(0.5 * ray.t_max.min(4.0))
        };
        let (mut with, mut without) = (vec![], vec![]);
        let t = avx2.closest(&bvh.tree, &ray, |block, ray: &Ray| test(block, ray, &mut with));
        let u = traverse::closest(Portable, &bvh.tree, &ray, |block, ray: &Ray| test(block, ray, &mut without));
        let a = avx2.any(&bvh.tree, &ray, |block, ray: &Ray| test(block, ray, &mut with));
        let b = traverse::any(Portable, &bvh.tree, &ray, |block, ray: &Ray| test(block, ray, &mut without));
        assert_eq!((t, a, with), (u, b, without));
    }
}

/// Coordinates that include the limits of `f32` and `f64`.
fn coordinate() -> impl Strategy<Value = f64> {
    let corners = vec![0.0, -0.0, 1.0, 1e-310, -1e-40, 1e-30, 1.0 + 1e-12, 3e38, -1e300];
    let narrow = (-2.0..2.0_f64).prop_map(|x| f64::from(x as f32));
    prop_oneof![prop::sample::select(corners), -2.0..2.0, (-2.0..2.0_f64).prop_map(|x| x * 1e-20), narrow]
}

proptest! {
    #[test]
    fn hierarchies_over_boxes_of_any_size_are_valid(
        corners in prop::collection::vec(prop::array::uniform6(coordinate()), 0..200), block in 1..6_usize,
    ) {
        let around = |c: [f64; 6]| Aabb::around([DVec3::new(c[0], c[1], c[2]), DVec3::new(c[3], c[4], c[5])]);
        let bounds: Vec<_> = corners.into_iter().map(around).collect();
        check_structure(&Bvh::build_in_blocks(bounds.iter().copied(), block), &bounds);
    }
}
