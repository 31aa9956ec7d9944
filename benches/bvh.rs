//! The speed of building and traversing a hierarchy of triangles, compared with the `obvhs` crate on the same rays.
//!
//! `cargo bench --bench bvh`. All benchmarks run on one thread; compare numbers of one run only. The sets of rays:
//! `primary` are the rays of a camera, row by row; `bounce` leave the surface in all directions, in random order;
//! `random` lie within the ball.

use std::{collections::HashMap, sync::LazyLock, time::Duration};

use divan::{Bencher, counter::ItemsCount};
use etendue::{
    math::{Ray, rng::Stream},
    shape::mesh::Triangles,
};
use glam::{DVec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    bvh2::{Bvh2, builder::build_bvh2_from_tris},
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::RayHit,
    rt_triangle::RtTriangle,
    triangle::Triangle,
};

/// The side of the camera's image; each set has the square of this number of rays.
const SIDE: usize = 256;

/// Divisions of the icosahedron: 81,920 and 1,310,720 triangles.
const LEVELS: [u32; 2] = [6, 8];

static MESH: LazyLock<Mesh> = LazyLock::new(|| blob(LEVELS[0]));
static OURS: LazyLock<Triangles> = LazyLock::new(|| MESH.ours());

fn main() {
    // Builders would otherwise use all threads.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    pool.install(divan::main);
}

#[divan::bench(args = LEVELS, sample_count = 5, sample_size = 1)]
fn build(bencher: Bencher, levels: u32) {
    let mesh = blob(levels);
    let count = ItemsCount::new(mesh.faces.len());
    bencher.counter(count).with_inputs(|| mesh.clone()).bench_values(|mesh| Triangles::new(mesh.positions, mesh.faces));
}

#[divan::bench(args = LEVELS, sample_count = 5, sample_size = 1)]
fn build_obvhs_bvh2(bencher: Bencher, levels: u32) {
    let triangles = blob(levels).theirs();
    let count = ItemsCount::new(triangles.len());
    bencher.counter(count).bench(|| bvh2(&triangles));
}

#[divan::bench(args = ["primary", "bounce", "random"])]
fn closest(bencher: Bencher, kind: &str) {
    let rays = rays(kind);
    let count = |rays: &[Ray]| rays.iter().filter_map(|ray| OURS.closest(ray)).count();
    bencher.counter(ItemsCount::new(rays.len())).bench(|| count(&rays));
}

#[divan::bench(args = ["primary", "bounce", "random"])]
fn closest_obvhs_bvh2(bencher: Bencher, kind: &str) {
    let triangles = MESH.theirs();
    let bvh = bvh2(&triangles);
    let leaves: Vec<RtTriangle> = bvh.primitive_indices.iter().map(|&i| (&triangles[i as usize]).into()).collect();
    let rays: Vec<_> = rays(kind).iter().map(narrow).collect();
    let is_hit =
        |&&ray: &&obvhs::ray::Ray| bvh.ray_traverse(ray, &mut RayHit::none(), |ray, i| leaves[i].intersect(ray));
    bencher.counter(ItemsCount::new(rays.len())).bench(|| rays.iter().filter(is_hit).count());
}

#[divan::bench(args = ["primary", "bounce", "random"])]
fn closest_obvhs_cwbvh(bencher: Bencher, kind: &str) {
    let triangles = MESH.theirs();
    let mut duration = Duration::ZERO;
    let bvh: CwBvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut duration);
    let leaves: Vec<RtTriangle> = bvh.primitive_indices.iter().map(|&i| (&triangles[i as usize]).into()).collect();
    let rays: Vec<_> = rays(kind).iter().map(narrow).collect();
    let is_hit =
        |&&ray: &&obvhs::ray::Ray| bvh.ray_traverse(ray, &mut RayHit::none(), |ray, i| leaves[i].intersect(ray));
    bencher.counter(ItemsCount::new(rays.len())).bench(|| rays.iter().filter(is_hit).count());
}

#[divan::bench(args = ["primary", "bounce", "random"])]
fn occluded(bencher: Bencher, kind: &str) {
    let rays = rays(kind);
    let count = |rays: &[Ray]| rays.iter().filter(|ray| OURS.occluded(ray)).count();
    bencher.counter(ItemsCount::new(rays.len())).bench(|| count(&rays));
}

#[derive(Clone)]
struct Mesh {
    positions: Vec<[f32; 3]>,
    faces: Vec<[u32; 3]>,
}

impl Mesh {
    fn ours(&self) -> Triangles {
        Triangles::new(self.positions.clone(), self.faces.clone())
    }

    fn theirs(&self) -> Vec<Triangle> {
        let corner = |i: u32| Vec3A::from_array(self.positions[i as usize]);
        self.faces.iter().map(|&[a, b, c]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) }).collect()
    }
}

fn bvh2(triangles: &[Triangle]) -> Bvh2 {
    let mut duration = Duration::ZERO;
    build_bvh2_from_tris(triangles, BvhBuildParams::medium_build(), &mut duration)
}

fn narrow(ray: &Ray) -> obvhs::ray::Ray {
    let (origin, direction) = (ray.origin.as_vec3a(), ray.direction.as_vec3a());
    obvhs::ray::Ray::new(origin, direction, ray.t_min as f32, ray.t_max as f32)
}

/// An icosahedron whose faces are divided into four several times, projected to a ball with bumps.
fn blob(levels: u32) -> Mesh {
    let g = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut positions = vec![];
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        let corners = [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)];
        positions.extend(corners.map(DVec3::normalize));
    }
    // The faces are the triples of corners at the least distance.
    let is_edge = |a: usize, b: usize| (positions[a] - positions[b]).length() < 1.1;
    let triples = (0..12).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| (a, b, c))));
    let is_face = |&(a, b, c): &(usize, usize, usize)| is_edge(a, b) && is_edge(b, c) && is_edge(c, a);
    let mut faces: Vec<_> = triples.filter(is_face).map(|(a, b, c)| [a as u32, b as u32, c as u32]).collect();
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let divide = |[a, b, c]: [u32; 3]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(divide).collect();
    }
    let bump = |p: DVec3, k: f64| (k * p.x).sin() * (0.9 * k * p.y).sin() * (1.2 * k * p.z).cos();
    let narrow = |&p: &DVec3| (p * (1.0 + 0.2 * bump(p, 5.0) + 0.05 * bump(p, 19.0))).as_vec3().to_array();
    Mesh { positions: positions.iter().map(narrow).collect(), faces }
}

fn direction(random: &mut Stream) -> DVec3 {
    let z = 2.0 * random.next_1d() - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * random.next_1d()).sin_cos();
    DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + z * DVec3::Z
}

fn rays(kind: &str) -> Vec<Ray> {
    let mut random = Stream::at(&[1]);
    match kind {
        "primary" => camera(SIDE),
        "bounce" => {
            let mut rays: Vec<_> = camera(2 * SIDE).iter().filter_map(|ray| bounce(ray, &mut random)).collect();
            for i in (1..rays.len()).rev() {
                rays.swap(i, (random.next_1d() * (i + 1) as f64) as usize);
            }
            rays.truncate(SIDE * SIDE);
            rays
        }
        _ => {
            let mut one = || Ray::new(1.3 * random.next_1d().cbrt() * direction(&mut random), direction(&mut random));
            (0..SIDE * SIDE).map(|_| one()).collect()
        }
    }
}

/// The rays of a camera that views the blob and some of its surroundings.
fn camera(side: usize) -> Vec<Ray> {
    let at = |i: usize| (i as f64 + 0.5) / side as f64 - 0.5;
    let ray = |x: usize, y: usize| Ray::new(DVec3::new(0.0, 0.0, 3.6), DVec3::new(at(x), at(y), -1.2).normalize());
    (0..side).flat_map(|y| (0..side).map(move |x| ray(x, y))).collect()
}

/// A ray that starts where another ray hits, with the density of a diffuse surface.
fn bounce(ray: &Ray, random: &mut Stream) -> Option<Ray> {
    let hit = OURS.closest(ray)?;
    let [a, b, c] = OURS.triangle(hit.triangle);
    let normal = (b - a).cross(c - a).normalize();
    let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
    Some(Ray { t_min: 1e-4, ..Ray::new(ray.at(hit.t), (normal + direction(random)).normalize()) })
}
