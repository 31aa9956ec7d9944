//! The cost of constructive solid geometry and quadrics, compared with spheres on the same rays.
//!
//! `cargo bench --bench solids`. All benchmarks run on one thread; compare numbers of one run only. `one_*` tests a
//! single shape, without a hierarchy; about two thirds of its rays hit the lens' bounding sphere. `many_*` finds the
//! first hit among equally many shapes at the same positions.

use std::hint::black_box;

use divan::{Bencher, counter::ItemsCount};
use etendue::{
    math::{Ray, rng::Stream, warp},
    scene_file::xml,
    shape::{Shape, ShapeModel as _, Shapes},
};
use glam::DVec3;

const RAYS: usize = 20_000;

fn main() {
    divan::main();
}

fn shape(element: &str) -> Shape {
    let document = xml::parse_element(element).expect("the element is valid XML");
    let params = Shape::params(&document, document.root).expect("the element is a shape");
    Shape::read_from(&params).expect("the shape is valid")
}

fn sphere(p: DVec3) -> String {
    format!(r#"<shape type="sphere"><point name="center" x="{}" y="{}" z="{}"/></shape>"#, p.x, p.y, p.z)
}

/// Two balls of radius 1 whose centres are 0.8 apart.
fn csg(operation: &str, p: DVec3) -> String {
    let (one, other) = (sphere(p - 0.4 * DVec3::X), sphere(p + 0.4 * DVec3::X));
    format!(r#"<shape type="csg"><string name="operation" value="{operation}"/>{one}{other}</shape>"#)
}

/// An ellipsoid with cross terms, about as large as the ball.
fn quadric(p: DVec3) -> String {
    format!(
        r#"<shape type="quadric"><string name="coefficients" value="1.1 1 1.2 0.3 -0.2 0.25 0 0 0 -1"/><point name="bbox_min" value="-1.1"/>
           <point name="bbox_max" value="1.1"/><transform name="to_world"><translate x="{}" y="{}" z="{}"/></transform></shape>"#,
        p.x, p.y, p.z
    )
}

/// Lines that pass within `reach` of the origin.
fn rays(reach: f64) -> Vec<Ray> {
    let mut stream = Stream::at(&[1]);
    let ray = |_| {
        let direction = warp::square_to_sphere(stream.next_2d());
        let through = reach * stream.next_1d().cbrt() * warp::square_to_sphere(stream.next_2d());
        Ray::new(through - 4.0 * reach * direction, direction)
    };
    (0..RAYS).map(ray).collect()
}

fn one(bencher: Bencher, element: &str) {
    let (shape, rays) = (shape(element), rays(1.2));
    // The compiler must know neither the shape nor the hit, as in a traversal.
    let count = || rays.iter().filter(|ray| black_box(black_box(&shape).intersect(black_box(ray))).is_some()).count();
    bencher.counter(ItemsCount::new(RAYS)).bench(count);
}

#[divan::bench]
fn one_sphere(bencher: Bencher) {
    one(bencher, &sphere(DVec3::ZERO));
}

#[divan::bench(args = ["union", "intersection", "difference"])]
fn one_csg_of_two_spheres(bencher: Bencher, operation: &str) {
    one(bencher, &csg(operation, DVec3::ZERO));
}

#[divan::bench]
fn one_quadric(bencher: Bencher) {
    one(bencher, &quadric(DVec3::ZERO));
}

/// Shapes at random points of a cube, which fill about a fifth of it.
fn many(bencher: Bencher, count: usize, element: impl Fn(DVec3) -> String) {
    let mut stream = Stream::at(&[2]);
    let half = 1.4 * (count as f64).cbrt();
    let mut along = || half * (2.0 * stream.next_1d() - 1.0);
    let places: Vec<_> = (0..count).map(|_| DVec3::new(along(), along(), along())).collect();
    let shapes = Shapes::new(places.into_iter().map(|p| shape(&element(p))).collect());
    let rays = rays(half);
    bencher
        .counter(ItemsCount::new(RAYS))
        .bench(|| rays.iter().filter(|ray| black_box(shapes.intersect(black_box(ray))).is_some()).count());
}

#[divan::bench(args = [1000, 10_000])]
fn many_spheres(bencher: Bencher, count: usize) {
    many(bencher, count, sphere);
}

#[divan::bench(args = [1000])]
fn many_csg_lenses(bencher: Bencher, count: usize) {
    many(bencher, count, |p| csg("intersection", p));
}

#[divan::bench(args = [10_000])]
fn many_quadrics(bencher: Bencher, count: usize) {
    many(bencher, count, quadric);
}
