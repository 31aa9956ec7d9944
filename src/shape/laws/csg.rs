//! The laws of constructive solid geometry: integral geometry, set algebra, and faces that coincide.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec2, DVec3};
use sobol_burley::sample;

use super::{
    mesh::kcply,
    subjects::{octahedron, revolved_area},
};
use crate::{
    law::{Check, Effort, Finding, Law, worst},
    math::{Frame, Ray, rng::Stream, warp},
    scene_file::xml,
    shape::{Hit, Line, Shape, ShapeModel as _, SolidModel as _},
    stats::Moments,
};

/// The laws of constructive solid geometry.
pub const LAWS: &[Law] = &[
    Law {
        name: "csg/solids",
        claim: "Random lines give the volume, the surface area and, from x·n, the signed volume of solids and of csgs of \
                them, each with a relative standard error of at most 1e-3.",
        source: "Cauchy and Crofton, Gauss; closed forms of lenses, caps, quadrics and nested shells",
        check: Check::Analytic(solids),
    },
    Law {
        name: "csg/membership",
        claim: "On random trees, a point of a line lies between an entry and an exit if and only if it is in the set that \
                the tree describes.",
        source: "the inequalities of the operands, combined point by point",
        check: Check::Analytic(membership),
    },
    Law {
        name: "csg/identities",
        claim: "On random trees A, B in a cube U: De Morgan's laws, A \\ B = A ∩ (U \\ B), (A \\ B) ∪ (A ∩ B) = A, A ∪ A = A, \
                A ∪ (A ∩ B) = A, A \\ A is empty. Both sides have the same crossings with every line, although faces coincide.",
        source: "the algebra of sets",
        check: Check::Analytic(identities),
    },
    Law {
        name: "csg/normals",
        claim: "Normals of every operand point against the line where it enters the result and along it where it leaves.",
        source: "definition",
        check: Check::Analytic(normals),
    },
];

/// A shape from its element.
fn shape(element: &str) -> Shape {
    let document = xml::parse_element(element).expect("the element is valid XML");
    let params = Shape::params(&document, document.root).expect("the element is a shape");
    Shape::read_from(&params).expect("the shape is valid")
}

/// The element of a csg.
fn csg(operation: &str, operands: &[&str]) -> String {
    format!(r#"<shape type="csg"><string name="operation" value="{operation}"/>{}</shape>"#, operands.concat())
}

/// The element of a sphere.
fn sphere(centre: DVec3, radius: f64) -> String {
    let DVec3 { x, y, z } = centre;
    format!(
        r#"<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/><float name="radius" value="{radius}"/></shape>"#
    )
}

/// A solid with its known properties.
struct Solid {
    name: &'static str,
    shape: Shape,
    volume: f64,
    area: f64,
    convex: bool,
    /// The centre and the radius of a bounding sphere.
    bounding_sphere: (DVec3, f64),
}

impl Solid {
    fn new(name: &'static str, element: &str, [volume, area]: [f64; 2], bounding_sphere: (DVec3, f64)) -> Self {
        Self { name, shape: shape(element), volume, area, convex: false, bounding_sphere }
    }

    fn convex(self) -> Self {
        Self { convex: true, ..self }
    }
}

fn spheres() -> Vec<Solid> {
    let (one, other) = (sphere(DVec3::ZERO, 1.0), sphere(DVec3::X, 0.8));
    let of = |operation| csg(operation, &[&one, &other]);
    let unit = (DVec3::ZERO, 1.001);
    // Nested spheres that do not touch, subtracted alternately.
    let shells = [(0.0, 1.0), (0.1, 0.8), (-0.05, 0.6), (0.1, 0.4), (0.15, 0.2)];
    let nested = shells.iter().rev().fold(String::new(), |inner, (x, radius)| {
        let shell = sphere(DVec3::new(*x, -0.5 * x, 0.3 * x), *radius);
        if inner.is_empty() { shell } else { csg("difference", &[&shell, &inner]) }
    });
    let (cubes, squares) = (1.0 - 0.512 + 0.216 - 0.064 + 0.008, 1.0 + 0.64 + 0.36 + 0.16 + 0.04);
    vec![
        Solid::new(
            "intersection of spheres",
            &of("intersection"),
            [0.750_631_205, 4.423_362_456],
            (DVec3::X * 0.68, 0.8),
        )
        .convex(),
        Solid::new("difference of spheres", &of("difference"), [3.438_159_0, 12.968_494_474], unit),
        Solid::new("union of spheres", &of("union"), [5.582_819_585, 16.185_485_351], (DVec3::X * 0.4, 1.401)),
        Solid::new("shells of depth 5", &nested, [4.0 / 3.0 * PI * cubes, 4.0 * PI * squares], unit),
    ]
}

fn quadrics() -> Vec<Solid> {
    let closed = |element: &str| csg("union", &[element]);
    let cone_radius: f64 = 1.0 / 3.0_f64.sqrt();
    let cone = format!(r#"<shape type="cone"><float name="radius" value="{cone_radius}"/></shape>"#);
    let cylinder = r#"<shape type="cylinder"><point name="p0" x="0" y="0" z="-1"/><point name="p1" x="0" y="0" z="1"/>
        <float name="radius" value="0.7"/></shape>"#;
    let bowl = r#"<shape type="paraboloid"><float name="radius" value="0.8"/><float name="height" value="2"/></shape>"#;
    let one_sheet =
        r#"<shape type="hyperboloid"><float name="radius" value="0.5"/><float name="axis" value="0.8"/></shape>"#;
    let two_sheets = r#"<shape type="hyperboloid"><integer name="sheets" value="2"/><float name="axis" value="0.5"/>
        <float name="z_min" value="-0.75"/><float name="z_max" value="0.75"/></shape>"#;
    let saddle = r#"<shape type="quadric"><string name="coefficients" value="1 -1 0 0 0 0 0 0 -1 0"/>
        <point name="bbox_min" x="-1" y="-1" z="-1.2"/><point name="bbox_max" x="1" y="1" z="1.5"/></shape>"#;
    let ellipsoid = r#"<shape type="ellipsoid"><vector name="radii" x="1.2" y="0.8" z="0.5"/></shape>"#;
    let plane = r#"<shape type="plane"><transform name="to_world"><translate z="0.3"/></transform></shape>"#;
    let identity = DAffine3::IDENTITY;
    let lateral = revolved_area(&identity, [-1.0, 1.0], |z| DVec2::new(0.5 * (1.0 + z * z / 0.64).sqrt(), z));
    let caps = TAU * 0.25 * (1.0 + 1.0 / 0.64);
    let sheet = revolved_area(&identity, [0.0, 1.5_f64.acosh()], |s| DVec2::new(s.sinh(), 0.5 * s.cosh()));
    let bowl_area = PI * 0.8 / 24.0 * ((0.64 + 16.0_f64).powf(1.5) - 0.512) + PI * 0.64;
    let high = (DVec3::Z, 1.3);
    vec![
        Solid::new("ellipsoid", &closed(ellipsoid), [2.010_619_298, 8.512_099_114], (DVec3::ZERO, 1.201)).convex(),
        Solid::new("cylinder", &closed(cylinder), [0.98 * PI, 3.78 * PI], (DVec3::ZERO, 1.221)).convex(),
        Solid::new("cone", &closed(&cone), [PI / 9.0, PI], (DVec3::Z / 3.0, 0.667)).convex(),
        Solid::new("paraboloid", &closed(bowl), [0.64 * PI, bowl_area], high).convex(),
        Solid::new(
            "hyperboloid of one sheet",
            &closed(one_sheet),
            [0.5 * PI * (1.0 + 1.0 / 1.92), lateral + caps],
            (DVec3::ZERO, 1.281),
        ),
        Solid::new(
            "hyperboloid of two sheets",
            &closed(two_sheets),
            [TAU * 0.4375 / 3.0, 2.0 * sheet + TAU * 1.25],
            (DVec3::ZERO, 1.347),
        ),
        Solid::new("saddle in a box", &closed(saddle), [6.0, 16.0 + saddle_area()], (DVec3::Z * 0.25, 1.892)),
        Solid::new(
            "sphere cut by a plane",
            &csg("intersection", &[&sphere(DVec3::ZERO, 1.0), plane]),
            [4.0 / 3.0 * PI - PI * 0.49 * (1.0 - 0.7 / 3.0), 4.0 * PI - TAU * 0.7 + PI * 0.91],
            (DVec3::ZERO, 1.001),
        )
        .convex(),
    ]
}

/// The area of z = x² - y² over the square [-1, 1]²: `∫ sqrt(1 + 4x² + 4y²)` by the midpoint rule.
fn saddle_area() -> f64 {
    const N: usize = 400;
    let at = |i: usize| 2.0 * (i as f64 + 0.5) / N as f64 - 1.0;
    let value = |i, j| (1.0 + 4.0 * (at(i) * at(i) + at(j) * at(j))).sqrt();
    (0..N * N).map(|k| value(k / N, k % N)).sum::<f64>() * 4.0 / (N * N) as f64
}

/// A mesh from a file, cut by a plane and subtracted from a sphere.
fn meshes() -> Vec<Solid> {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("octahedron.kcply");
    std::fs::write(&path, kcply(&octahedron(), 0)).expect("a temporary folder can be written to");
    let element = format!(r#"<shape type="kcply"><string name="filename" value="{}"/></shape>"#, path.display());
    let faces = 4.0 * 3.0_f64.sqrt();
    let pit = csg("difference", &[&sphere(DVec3::ZERO, 1.0), &element]);
    let half = csg("intersection", &[&element, r#"<shape type="plane"/>"#]);
    let volumes = [4.0 / 3.0 * (PI - 1.0), 2.0 / 3.0];
    vec![
        Solid::new("sphere without octahedron", &pit, [volumes[0], 4.0 * PI + faces], (DVec3::ZERO, 1.001)),
        Solid::new("half an octahedron", &half, [volumes[1], 0.5 * faces + 2.0], (DVec3::ZERO, 1.001)).convex(),
    ]
}

/// The number of independent Sobol' point sets, whose variance gives the standard error.
const REPLICATES: u32 = 16;

fn solids(effort: Effort) -> Vec<Finding> {
    spheres().into_iter().chain(quadrics()).chain(meshes()).flat_map(|solid| lines_through(&solid, effort)).collect()
}

/// Compares the integrals that lines through a solid give with the known properties.
fn lines_through(solid: &Solid, effort: Effort) -> Vec<Finding> {
    let lines = effort.needed_samples(1 << 15);
    let (centre, radius) = solid.bounding_sphere;
    let mut moments = [Moments::default(); 4];
    for replicate in 0..REPLICATES {
        let mut sums = [0.0; 4];
        for i in 0..lines {
            let u = |dimension| f64::from(sample(i, dimension, replicate));
            let direction = warp::square_to_sphere(DVec2::new(u(0), u(1)));
            let frame = Frame::from_normal(direction);
            let across = radius * warp::square_to_disc(DVec2::new(u(2), u(3)));
            let origin = centre + across.x * frame.s + across.y * frame.t - 2.0 * radius * direction;
            let ray = Ray::new(origin, direction);
            let hits = crossings(&solid.shape, &ray);
            sums[0] += PI * radius * radius * hits.chunks_exact(2).map(|pair| pair[1].t - pair[0].t).sum::<f64>();
            sums[1] += TAU * radius * radius * hits.len() as f64;
            let surfaces = hits.iter().map(|hit| solid.shape.surface(&ray, hit));
            sums[2] += TAU / 3.0 * radius * radius * surfaces.map(|s| (s.p - centre).dot(s.n)).sum::<f64>();
            sums[3] += f64::from(!hits.is_empty());
        }
        let mean = sums.map(|sum| sum / f64::from(lines));
        let chord = mean[0] / (PI * radius * radius) / mean[3];
        moments.iter_mut().zip([mean[0], mean[1], mean[2], chord]).for_each(|(m, x)| m.push(x));
    }
    let name = |what: &str| format!("{}, {what}", solid.name);
    let mut findings: Vec<_> = [("volume", solid.volume), ("surface", solid.area), ("x·n", solid.volume)]
        .into_iter()
        .zip(&moments)
        .map(|((what, expected), moments)| Finding::mean(name(what), moments, expected))
        .collect();
    if solid.convex {
        findings.push(Finding::mean(name("mean chord 4 V / S"), &moments[3], 4.0 * solid.volume / solid.area));
    }
    let error = |m: &Moments| (m.m2 / f64::from(REPLICATES * (REPLICATES - 1))).sqrt() / m.mean;
    let worst = moments[..3].iter().map(error).fold(0.0, f64::max);
    findings.push(Finding::error(name("relative standard error"), worst, 1e-3));
    findings
}

fn crossings(shape: &Shape, ray: &Ray) -> Vec<Hit> {
    shape.geometry.cross(&Line::new(ray)).into_iter().map(Hit::from).collect()
}

/// A function that is negative inside a solid.
type Inequality = fn(DVec3) -> f64;

/// A random set, as an element and as inequalities.
enum Tree {
    Operand { element: String, to_local: DAffine3, form: Inequality },
    Node { operation: usize, children: Vec<Tree> },
}

const OPERATIONS: [&str; 3] = ["union", "intersection", "difference"];

/// The operands, as attributes of their elements, and their inequalities in shape space.
const OPERANDS: [(&str, Inequality); 6] = [
    (r#"type="sphere""#, |p| p.length() - 1.0),
    (r#"type="cube""#, |p| p.abs().max_element() - 1.0),
    (r#"type="plane""#, |p| p.z),
    (r#"type="cylinder""#, |p| (p.truncate().length() - 1.0).max((p.z - 0.5).abs() - 0.5)),
    (r#"type="cone""#, |p| (p.truncate().length() + p.z - 1.0).max(-p.z)),
    (r#"type="paraboloid""#, |p| (p.truncate().length_squared() - p.z).max(p.z - 1.0)),
];

impl Tree {
    fn random(stream: &mut Stream, depth: u32) -> Self {
        if depth == 0 || stream.next_1d() < 0.2 {
            return Self::random_operand(stream);
        }
        let operation = (stream.next_1d() * 3.0) as usize;
        let count = 2 + (stream.next_1d() * 2.0) as usize;
        Self::Node { operation, children: (0..count).map(|_| Self::random(stream, depth - 1)).collect() }
    }

    fn random_operand(stream: &mut Stream) -> Self {
        let (kind, form) = OPERANDS[(stream.next_1d() * OPERANDS.len() as f64) as usize];
        let mut signed = |size: f64| size * (2.0 * stream.next_1d() - 1.0);
        let centre = DVec3::new(signed(0.8), signed(0.8), signed(0.8));
        let size = DVec3::new(0.9 + signed(0.5), 0.9 + signed(0.5), 0.9 + signed(0.5));
        let (axis, angle) = (DVec3::new(signed(1.0), signed(1.0), 1.5 + signed(1.0)).normalize(), signed(180.0));
        let to_world = DAffine3::from_translation(centre)
            * DAffine3::from_axis_angle(axis, angle.to_radians())
            * DAffine3::from_scale(size);
        let numbers = to_world.matrix3.transpose().to_cols_array();
        let t = to_world.translation;
        let [a, b, c, d, e, f, g, h, i] = numbers;
        let matrix = format!("{a} {b} {c} {} {d} {e} {f} {} {g} {h} {i} {} 0 0 0 1", t.x, t.y, t.z);
        let element =
            format!(r#"<shape {kind}><transform name="to_world"><matrix value="{matrix}"/></transform></shape>"#);
        Self::Operand { element, to_local: to_world.inverse(), form }
    }

    fn element(&self) -> String {
        match self {
            Self::Operand { element, .. } => element.clone(),
            Self::Node { operation, children } => {
                let children: Vec<_> = children.iter().map(Self::element).collect();
                csg(OPERATIONS[*operation], &children.iter().map(String::as_str).collect::<Vec<_>>())
            }
        }
    }

    /// Whether the set contains a point, and approximately the least distance of the point from an operand's surface.
    fn contains(&self, p: DVec3) -> (bool, f64) {
        match self {
            Self::Operand { to_local, form, .. } => {
                let value = form(to_local.transform_point3(p));
                (value < 0.0, value.abs())
            }
            Self::Node { operation, children } => {
                let mut of_children = children.iter().map(|child| child.contains(p));
                let first = of_children.next().expect("a node has children");
                of_children.fold(first, |(inside, margin), (other, other_margin)| {
                    let inside = match operation {
                        0 => inside || other,
                        1 => inside && other,
                        _ => inside && !other,
                    };
                    (inside, margin.min(other_margin))
                })
            }
        }
    }
}

/// A line that passes near the origin.
fn line(stream: &mut Stream) -> Ray {
    let direction = warp::square_to_sphere(stream.next_2d());
    let through = 1.5 * warp::square_to_sphere(stream.next_2d()) * stream.next_1d().cbrt();
    Ray::new(through - 6.0 * direction, (0.1 + 5.0 * stream.next_1d()) * direction)
}

fn membership(effort: Effort) -> Vec<Finding> {
    worst(0.0, |note| {
        for seed in 0..effort.samples(60) {
            let depth = 1 + seed % 5;
            let mut stream = Stream::at(&[60, u64::from(seed)]);
            let tree = Tree::random(&mut stream, depth);
            let solid = shape(&csg("union", &[&tree.element()]));
            let mut wrong = 0;
            for _ in 0..100 {
                let ray = line(&mut stream);
                let hits = crossings(&solid, &ray);
                for _ in 0..8 {
                    let t = 12.0 * stream.next_1d() / ray.direction.length();
                    let (inside, margin) = tree.contains(ray.at(t));
                    let before = hits.iter().filter(|hit| hit.t < t).count();
                    wrong += u32::from(margin > 1e-6 && inside != (before % 2 == 1));
                }
            }
            note(&format!("depth {depth}"), f64::from(wrong));
        }
    })
}

/// The number of random lines whose crossings with two shapes differ.
fn differences(one: &str, other: &str, stream: &mut Stream, lines: u32) -> u32 {
    let (one, other) = (shape(one), shape(other));
    let differ = |ray: Ray| {
        let (a, b) = (crossings(&one, &ray), crossings(&other, &ray));
        // Equal infinities are compared first, because their difference is NaN.
        let is_apart = |a: &Hit, b: &Hit| a.t != b.t && (a.t - b.t).abs() * ray.direction.length() > 1e-7;
        a.len() != b.len() || a.iter().zip(&b).any(|(a, b)| is_apart(a, b))
    };
    (0..lines).filter(|_| differ(line(stream))).count() as u32
}

/// The two sides of each identity.
fn sides(a: &str, b: &str) -> Vec<(&'static str, String, String)> {
    let u = r#"<shape type="cube"><transform name="to_world"><scale value="9"/></transform></shape>"#;
    let not = |x: &str| csg("difference", &[u, x]);
    let (a, b) = (csg("intersection", &[a, u]), csg("intersection", &[b, u]));
    let [union, intersection, difference] = OPERATIONS.map(|operation| csg(operation, &[&a, &b]));
    vec![
        ("not (A or B)", not(&union), csg("intersection", &[&not(&a), &not(&b)])),
        ("not (A and B)", not(&intersection), csg("union", &[&not(&a), &not(&b)])),
        ("A \\ B", difference.clone(), csg("intersection", &[&a, &not(&b)])),
        ("A in two parts", csg("union", &[&difference, &intersection]), a.clone()),
        ("A or A", csg("union", &[&a, &a]), a.clone()),
        ("A and A", csg("intersection", &[&a, &a]), a.clone()),
        ("A or (A and B)", csg("union", &[&a, &intersection]), a.clone()),
        ("A \\ A", csg("difference", &[&a, &a]), csg("difference", &[u, u])),
        ("not not A", not(&not(&a)), a.clone()),
    ]
}

/// The number of lines on which each identity fails for two random trees.
fn broken(seed: u64, depth: u32, lines: u32) -> Vec<(&'static str, u32)> {
    let mut stream = Stream::at(&[61, seed]);
    let [a, b] = [0, 1].map(|_| Tree::random(&mut stream, depth).element());
    let count =
        |(name, one, other): (&'static str, String, String)| (name, differences(&one, &other, &mut stream, lines));
    sides(&a, &b).into_iter().map(count).collect()
}

fn identities(effort: Effort) -> Vec<Finding> {
    worst(0.0, |note| {
        for seed in 0..effort.samples(40) {
            for (name, count) in broken(u64::from(seed), seed % 4, 60) {
                note(name, f64::from(count));
            }
        }
    })
}

fn normals(effort: Effort) -> Vec<Finding> {
    worst(0.0, |note| {
        for seed in 0..effort.samples(40) {
            let mut stream = Stream::at(&[62, u64::from(seed)]);
            let tree = Tree::random(&mut stream, 1 + seed % 4);
            let solid = shape(&csg("union", &[&tree.element()]));
            let mut wrong = 0;
            for _ in 0..200 {
                let ray = line(&mut stream);
                let hits = crossings(&solid, &ray);
                for (i, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.t.is_finite()) {
                    let cos = solid.surface(&ray, hit).n.dot(ray.direction.normalize());
                    let enters = i % 2 == 0;
                    wrong += u32::from(cos.abs() > 1e-6 && (cos < 0.0) != enters);
                }
            }
            note("random trees", f64::from(wrong));
        }
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn set_identities_hold_on_random_trees(seed in any::<u64>(), depth in 0..4_u32) {
            for (name, count) in broken(seed, depth, 20) {
                prop_assert_eq!(count, 0, "{} at seed {}", name, seed);
            }
        }
    }

    fn along_x(element: &str) -> Vec<f64> {
        let ray = Ray::new(DVec3::new(-5.0, 0.0, 0.0), DVec3::X);
        crossings(&shape(element), &ray).into_iter().map(|hit| hit.t - 5.0).collect()
    }

    #[test]
    fn touching_solids_have_a_union_but_no_intersection() {
        let (one, other) = (sphere(DVec3::ZERO, 1.0), sphere(2.0 * DVec3::X, 1.0));
        assert_eq!(along_x(&csg("union", &[&one, &other])), [-1.0, 3.0]);
        assert!(along_x(&csg("intersection", &[&one, &other])).is_empty());
        assert_eq!(along_x(&csg("difference", &[&one, &other])), [-1.0, 1.0]);
        let inner = sphere(0.5 * DVec3::X, 0.5);
        assert_eq!(along_x(&csg("difference", &[&one, &inner])), [-1.0, 0.0]);
        assert_eq!(along_x(&csg("union", &[&one, &inner])), [-1.0, 1.0]);
    }

    #[test]
    fn the_union_of_two_halves_has_no_seam() {
        let turned =
            r#"<shape type="plane"><transform name="to_world"><rotate x="1" angle="180"/></transform></shape>"#;
        let one = csg("intersection", &[&sphere(DVec3::ZERO, 1.0), r#"<shape type="plane"/>"#]);
        let other = csg("intersection", &[&sphere(DVec3::ZERO, 1.0), turned]);
        let glued = csg("union", &[&one, &other]);
        let mut stream = Stream::at(&[63]);
        assert_eq!(differences(&glued, &sphere(DVec3::ZERO, 1.0), &mut stream, 2000), 0);
    }

    /// Lines through edges and corners of a mesh hit several triangles at once.
    #[test]
    fn lines_through_the_edges_of_a_mesh_enter_and_leave_alternately() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("octahedron.kcply");
        std::fs::write(&path, kcply(&octahedron(), 1)).expect("it can be written to");
        let element = format!(r#"<shape type="kcply"><string name="filename" value="{}"/></shape>"#, path.display());
        let solid = shape(&csg("union", &[&element]));
        let grid = || (-4..=4).map(|i| f64::from(i) * 0.25);
        for (y, z) in grid().flat_map(|y| grid().map(move |z| (y, z))) {
            let hits = crossings(&solid, &Ray::new(DVec3::new(-3.0, y, z), DVec3::X));
            let half = 1.0 - y.abs() - z.abs();
            let expected: &[f64] = if half > 0.0 { &[3.0 - half, 3.0 + half] } else { &[] };
            let found: Vec<f64> = hits.iter().map(|hit| hit.t).collect();
            assert!(
                found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
                "y = {y}, z = {z}: {found:?}, not {expected:?}"
            );
        }
    }

    /// The crossings of a line along x with a mesh of two cubes, each given by the x of its centre and half its edge.
    /// The second cube faces outwards or inwards.
    fn two_cubes([x, r]: [f64; 2], [y, q]: [f64; 2], faces_out: bool) -> Vec<f64> {
        let corner = |i: usize, bit: usize, r: f64| if i >> bit & 1 == 1 { r } else { -r };
        let vertices = |x: f64, r: f64| -> String {
            (0..8).map(|i| format!("{} {} {}\n", x + corner(i, 0, r), corner(i, 1, r), corner(i, 2, r))).collect()
        };
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = |first: usize, out: bool| -> String {
            let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
            let turned = triangles.map(|[a, b, c]| if out { [a, b, c] } else { [a, c, b] });
            turned.map(|t| format!("3 {} {} {}\n", t[0] + first, t[1] + first, t[2] + first)).collect()
        };
        let parts = [vertices(x, r), vertices(y, q), faces(0, true), faces(8, faces_out)].concat();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("two.kcply");
        std::fs::write(&path, format!("kcply\nelement vertex 16\nelement face 24\n{parts}"))
            .expect("it can be written to");
        let element = format!(r#"<shape type="kcply"><string name="filename" value="{}"/></shape>"#, path.display());
        let solid = shape(&csg("union", &[&element]));
        let ray = Ray::new(DVec3::new(-5.0, 0.1, 0.07), DVec3::X);
        crossings(&solid, &ray).into_iter().map(|hit| ((hit.t - 5.0) * 1e6).round() / 1e6).collect()
    }

    #[test]
    fn shells_may_overlap_be_separate_or_bound_cavities() {
        assert_eq!(two_cubes([0.0, 0.5], [0.25, 0.5], true), [-0.5, 0.75]);
        assert_eq!(two_cubes([0.0, 0.5], [2.0, 0.5], true), [-0.5, 0.5, 1.5, 2.5]);
        assert_eq!(two_cubes([0.0, 0.5], [0.0, 0.25], false), [-0.5, -0.25, 0.25, 0.5]);
        assert_eq!(two_cubes([0.0, 0.5], [0.0, 0.25], true), [-0.5, 0.5]);
    }
}
