//! The subjects of the laws of shapes: every example of every plugin and some meshes, with their known properties.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::{
    math::{Frame, Ray, rng::Stream, warp},
    scene_file::{Category, Document, Params, xml},
    shape::{
        Geometry, Shape, ShapeModel as _, Surface,
        mesh::{Mesh, MeshData, Ply},
    },
};

/// A shape with its known properties.
pub(super) struct Subject {
    pub(super) name: String,
    pub(super) shape: Shape,
    /// The known properties, if any.
    pub(super) known: Option<Known>,
}

/// Properties of a shape that are computed independently of it.
pub(super) struct Known {
    /// The residual of the shape's equation at a world point. It is 0 on the surface.
    pub(super) equation: Box<dyn Fn(DVec3) -> f64>,
    /// The texture coordinates at a world point of the surface, if there is a formula.
    pub(super) uv: Option<Box<dyn Fn(DVec3) -> DVec2>>,
    /// The area, if there is a formula.
    pub(super) area: Option<f64>,
    /// The enclosed volume, if the shape is closed.
    pub(super) volume: Option<f64>,
    pub(super) convex: bool,
}

/// All subjects.
pub(super) fn subjects() -> Vec<Subject> {
    let examples = Geometry::PLUGINS.iter().flat_map(|plugin| {
        plugin.examples.iter().enumerate().map(|(i, example)| {
            let document = xml::parse_element(example).expect("examples are valid XML");
            from_example(format!("{} #{}", plugin.name, i + 1), &document)
        })
    });
    examples.chain(meshes()).collect()
}

fn from_example(name: String, document: &Document) -> Subject {
    let params = Shape::params(document, document.root).expect("examples are valid shapes");
    let shape = Shape::read_from(&params).expect("examples are valid shapes");
    Subject { known: known(&params), name, shape }
}

/// The known properties, computed from the parameters of the element.
fn known(params: &Params<'_>) -> Option<Known> {
    let to_world = params.transform("to_world").expect("examples are valid");
    Some(match params.plugin().name {
        "sphere" => ellipsoid(params, to_world, DVec3::splat(float(params, "radius"))),
        "ellipsoid" => ellipsoid(params, to_world, point(params, "radii")),
        "cube" => cube(to_world),
        "rectangle" => {
            let equation = |p: DVec3| p.z.abs() + (p.x.abs() - 1.0).max(0.0) + (p.y.abs() - 1.0).max(0.0);
            open(to_world, equation, |p| 0.5 * (p.truncate() + 1.0), 4.0 * parallelogram(&to_world))
        }
        "disk" => {
            let equation = |p: DVec3| p.z.abs() + (p.truncate().length() - 1.0).max(0.0);
            let uv = |p: DVec3| DVec2::new(p.truncate().length(), azimuth(p));
            open(to_world, equation, uv, PI * parallelogram(&to_world))
        }
        "plane" => Known { area: None, ..open(to_world, |p| p.z.abs(), DVec3::truncate, 0.0) },
        "cylinder" => {
            let (p0, axis) = (point(params, "p0"), point(params, "p1") - point(params, "p0"));
            let (s, t) = axis.normalize().any_orthonormal_pair();
            let radius = float(params, "radius");
            let map = to_world * DAffine3 { matrix3: DMat3::from_cols(radius * s, radius * t, axis), translation: p0 };
            let area = revolved_area(&map, [0.0, 1.0], |z| DVec2::new(1.0, z));
            around_z(map, [0.0, 1.0], |z| 1.0 + 0.0 * z, area)
        }
        "cone" => {
            let map = to_world * stretch(float(params, "radius"), float(params, "height"));
            let area = revolved_area(&map, [0.0, 1.0], |z| DVec2::new(1.0 - z, z));
            around_z(map, [0.0, 1.0], |z| (1.0 - z).powi(2), area)
        }
        "paraboloid" => {
            let map = to_world * stretch(float(params, "radius"), float(params, "height"));
            let area = revolved_area(&map, [0.0, 1.0], |r| DVec2::new(r, r * r));
            around_z(map, [0.0, 1.0], |z| z, area)
        }
        "hyperboloid" => hyperboloid(params, to_world),
        "quadric" => quadric(params, to_world),
        "triangle" => triangle(params, to_world),
        "csg" => two_spheres(params, to_world),
        _ => return None,
    })
}

fn float(params: &Params<'_>, name: &str) -> f64 {
    params.float(name).expect("examples are valid")
}

fn point(params: &Params<'_>, name: &str) -> DVec3 {
    params.point(name).expect("examples are valid")
}

fn volume_scale(map: &DAffine3) -> f64 {
    map.matrix3.determinant().abs()
}

/// The area of the image of the square `[0, 1]²` in x and y.
fn parallelogram(map: &DAffine3) -> f64 {
    map.matrix3.x_axis.cross(map.matrix3.y_axis).length()
}

fn stretch(radius: f64, height: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::new(radius, radius, height))
}

fn ellipsoid(params: &Params<'_>, to_world: DAffine3, radii: DVec3) -> Known {
    let map = to_world * DAffine3::from_translation(point(params, "center")) * DAffine3::from_scale(radii);
    Known {
        equation: local(map, |p: DVec3| (p.length() - 1.0).abs()),
        uv: Some(local(map, |p: DVec3| DVec2::new(azimuth(p), p.z.clamp(-1.0, 1.0).acos() / PI))),
        area: Some(revolved_area(&map, [0.0, PI], |theta| DVec2::new(theta.sin(), theta.cos()))),
        volume: Some(4.0 / 3.0 * PI * volume_scale(&map)),
        convex: true,
    }
}

fn cube(to_world: DAffine3) -> Known {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| to_world.transform_vector3(axis));
    Known {
        equation: local(to_world, |p: DVec3| (p.abs().max_element() - 1.0).abs()),
        uv: Some(local(to_world, cube_uv)),
        area: Some(8.0 * (x.cross(y).length() + y.cross(z).length() + z.cross(x).length())),
        volume: Some(8.0 * volume_scale(&to_world)),
        convex: true,
    }
}

fn open(map: DAffine3, equation: fn(DVec3) -> f64, uv: fn(DVec3) -> DVec2, area: f64) -> Known {
    Known { equation: local(map, equation), uv: Some(local(map, uv)), area: Some(area), volume: None, convex: false }
}

/// An open surface of revolution around the z axis, given its squared radius at each height.
fn around_z(map: DAffine3, [from, to]: [f64; 2], radius_squared: fn(f64) -> f64, area: f64) -> Known {
    let inverse = map.inverse();
    let equation = move |p: DVec3| {
        let p = inverse.transform_point3(p);
        let residual = p.truncate().length_squared() - radius_squared(p.z);
        residual.abs() + (from - p.z).max(p.z - to).max(0.0)
    };
    let uv = move |p: DVec3| {
        let p = inverse.transform_point3(p);
        DVec2::new(azimuth(p), (p.z - from) / (to - from))
    };
    Known { equation: Box::new(equation), uv: Some(Box::new(uv)), area: Some(area), volume: None, convex: false }
}

fn hyperboloid(params: &Params<'_>, to_world: DAffine3) -> Known {
    let axis = float(params, "axis");
    let map = to_world * stretch(float(params, "radius"), axis);
    let [low, high] = ["z_min", "z_max"].map(|name| float(params, name) / axis);
    if params.integer("sheets").expect("examples are valid") == 1 {
        let area = revolved_area(&map, [low.asinh(), high.asinh()], |s| DVec2::new(s.cosh(), s.sinh()));
        return around_z(map, [low, high], |z| 1.0 + z * z, area);
    }
    if low >= -1.0 {
        let area = revolved_area(&map, [0.0, high.acosh()], |s| DVec2::new(s.sinh(), s.cosh()));
        return around_z(map, [1.0, high], |z| z * z - 1.0, area);
    }
    // Both sheets lie between the heights.
    let lower = revolved_area(&map, [0.0, (-low).acosh()], |s| DVec2::new(s.sinh(), -s.cosh()));
    let upper = revolved_area(&map, [0.0, high.acosh()], |s| DVec2::new(s.sinh(), s.cosh()));
    around_z(map, [low, high], |z| z * z - 1.0, lower + upper)
}

fn quadric(params: &Params<'_>, to_world: DAffine3) -> Known {
    let c = params.numbers("coefficients").expect("examples are valid");
    let (low, high) = (point(params, "bbox_min"), point(params, "bbox_max"));
    let inverse = to_world.inverse();
    let equation = move |p: DVec3| {
        let p = inverse.transform_point3(p);
        let DVec3 { x, y, z } = p;
        let squares = c[0] * x * x + c[1] * y * y + c[2] * z * z + c[3] * x * y + c[4] * x * z + c[5] * y * z;
        let value: f64 = squares + c[6] * x + c[7] * y + c[8] * z + c[9];
        value.abs() + (low - p).max(p - high).max_element().max(0.0)
    };
    let uv = local(to_world, DVec3::truncate);
    Known { equation: Box::new(equation), uv: Some(uv), area: None, volume: None, convex: false }
}

fn triangle(params: &Params<'_>, to_world: DAffine3) -> Known {
    let corners = ["p0", "p1", "p2"].map(|name| to_world.transform_point3(point(params, name)));
    let [a, b, c] = corners;
    let area = 0.5 * (b - a).cross(c - a).length();
    let equation = Box::new(move |p| triangle_residual(&corners, p));
    Known { equation, uv: None, area: Some(area), volume: None, convex: false }
}

/// A csg of two spheres. The first has radius 1 and its centre at the origin. The centre of the second is on the x
/// axis.
fn two_spheres(params: &Params<'_>, to_world: DAffine3) -> Known {
    let children = params.children(Category::Shape);
    let second = Shape::params(params.document(), children[1]).expect("examples are valid");
    let (centre, r) = (point(&second, "center"), float(&second, "radius"));
    let d = centre.length();
    // The heights of the caps that the plane of the common circle cuts off.
    let x = (d * d + 1.0 - r * r) / (2.0 * d);
    let (h, k) = (1.0 - x, r - (d - x));
    let cap_volume = |r: f64, h: f64| PI * h * h * (r - h / 3.0);
    let (volumes, areas) = ([4.0 / 3.0 * PI, 4.0 / 3.0 * PI * r.powi(3)], [4.0 * PI, 4.0 * PI * r * r]);
    let lens = cap_volume(1.0, h) + cap_volume(r, k);
    let (inner, outer) = (TAU * h, TAU * r * k);
    let (volume, area) = match params.string("operation").expect("examples are valid") {
        "union" => (volumes[0] + volumes[1] - lens, areas[0] + areas[1] - inner - outer),
        "intersection" => (lens, inner + outer),
        _ => (volumes[0] - lens, areas[0] - inner + outer),
    };
    // The only transform among the examples is a similarity.
    let scale = volume_scale(&to_world);
    let inverse = to_world.inverse();
    let equation = move |p: DVec3| {
        let p = inverse.transform_point3(p);
        (p.length() - 1.0).abs().min((p.distance(centre) - r).abs())
    };
    let convex = params.string("operation").is_ok_and(|operation| operation == "intersection");
    let (area, volume) = (Some(area * scale.cbrt().powi(2)), Some(volume * scale));
    Known { equation: Box::new(equation), uv: None, area, volume, convex }
}

/// Turns a function of local points into a function of world points. `map` is the transform from local to world space.
fn local<T: 'static>(map: DAffine3, function: fn(DVec3) -> T) -> Box<dyn Fn(DVec3) -> T> {
    let inverse = map.inverse();
    Box::new(move |p| function(inverse.transform_point3(p)))
}

/// The azimuth around z, as a fraction of a turn from the x axis.
fn azimuth(p: DVec3) -> f64 {
    (p.y.atan2(p.x) / TAU).rem_euclid(1.0)
}

/// The texture coordinates of Mitsuba's cube, face by face.
fn cube_uv(p: DVec3) -> DVec2 {
    let DVec3 { x, y, z } = p;
    let size = p.abs();
    let (u, v) = if size.x > size.y && size.x > size.z {
        (y, -z * x)
    } else if size.y > size.z {
        if y > 0.0 { (-x, -z) } else { (z, x) }
    } else {
        (y * z, x)
    };
    0.5 * (DVec2::new(u, v) + 1.0)
}

/// The area of the image under `map` of the surface of revolution of a curve (radius, height) around z:
/// `∫ |∂s p × ∂φ p| ds dφ` by the midpoint rule, with a relative error of 1e-6.
pub(super) fn revolved_area(map: &DAffine3, [from, to]: [f64; 2], curve: fn(f64) -> DVec2) -> f64 {
    const N: (usize, usize) = (1000, 128);
    let cell = |i: usize, j: usize| {
        let s = from + (to - from) * (i as f64 + 0.5) / N.0 as f64;
        let (sin, cos) = (TAU * j as f64 / N.1 as f64).sin_cos();
        let (radius, step) = (curve(s).x, 1e-6 * (to - from));
        let slope = (curve(s + step) - curve(s - step)) / (2.0 * step);
        let d_s = map.transform_vector3(DVec3::new(slope.x * cos, slope.x * sin, slope.y));
        let d_phi = map.transform_vector3(radius * DVec3::new(-sin, cos, 0.0));
        d_s.cross(d_phi).length()
    };
    let sum: f64 = (0..N.0 * N.1).map(|k| cell(k / N.1, k % N.1)).sum();
    sum * (to - from) * TAU / (N.0 * N.1) as f64
}

/// Closed meshes: a convex one and one with a hole, each flat and smooth.
fn meshes() -> Vec<Subject> {
    let squeezed = DAffine3::from_translation(DVec3::new(0.5, -1.0, 2.0))
        * DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7)
        * DAffine3::from_scale(DVec3::new(1.5, 0.7, 1.0));
    vec![
        mesh("flat octahedron", octahedron(), &squeezed, true, true),
        mesh("smooth octahedron", octahedron(), &DAffine3::IDENTITY, false, true),
        mesh("flat torus", torus(), &DAffine3::IDENTITY, true, false),
        mesh("smooth torus", torus(), &squeezed, false, false),
    ]
}

pub(super) fn octahedron() -> MeshData {
    let corners =
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let upper = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
    let lower = [[2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let triangles = upper.into_iter().chain(lower).collect();
    MeshData::new(corners.to_vec(), None, None, triangles).expect("the mesh is well formed")
}

/// A torus with texture coordinates, without normals.
pub(super) fn torus() -> MeshData {
    const N: (u32, u32) = (24, 12);
    let at = |k: u32| {
        let (u, v) = (TAU * f64::from(k / N.1) / f64::from(N.0), TAU * f64::from(k % N.1) / f64::from(N.1));
        let radius = 1.0 + 0.4 * v.cos();
        [radius * u.cos(), radius * u.sin(), 0.4 * v.sin()].map(|x| x as f32)
    };
    let index = |i: u32, j: u32| (i % N.0) * N.1 + j % N.1;
    let cells = (0..N.0 * N.1).map(|k| (k / N.1, k % N.1));
    let triangles = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    let uvs = (0..N.0 * N.1).map(|k| [k as f32 / 100.0, (k % 7) as f32 / 7.0]).collect();
    MeshData::new((0..N.0 * N.1).map(at).collect(), None, Some(uvs), triangles.collect())
        .expect("the mesh is well formed")
}

fn mesh(name: &str, data: MeshData, to_world: &DAffine3, face_normals: bool, convex: bool) -> Subject {
    let position = |v: u32| {
        let p = DVec3::from_array(data.positions[v as usize].map(f64::from));
        to_world.transform_point3(p).as_vec3().as_dvec3()
    };
    let triangles: Vec<[DVec3; 3]> = data.triangles.iter().map(|corners| corners.map(position)).collect();
    let area: f64 = triangles.iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum();
    // Gauss's theorem: the sum of the signed volumes of tetrahedra with a common apex.
    let volume = triangles.iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum();
    let equation = Box::new(move |p| {
        triangles.iter().map(|triangle| triangle_residual(triangle, p)).fold(f64::INFINITY, f64::min)
    });
    let geometry = Geometry::Ply(Mesh::<Ply>::new(data, to_world, face_normals));
    let known = Known { equation, uv: None, area: Some(area), volume: Some(volume), convex };
    Subject { name: name.to_owned(), shape: Shape { geometry, flipped: false }, known: Some(known) }
}

/// The distance of a point from a triangle's plane, plus the magnitude of its most negative barycentric coordinate.
fn triangle_residual([a, b, c]: &[DVec3; 3], p: DVec3) -> f64 {
    let n = (b - a).cross(c - a);
    let weight = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(n) / n.length_squared();
    let outside = weight(*a, *b).min(weight(*b, *c)).min(weight(*c, *a));
    (p - a).dot(n.normalize()).abs() + (-outside).max(0.0)
}

impl Subject {
    /// The centre and the radius of the sphere through which random lines pass: a bounding sphere of the shape.
    pub(super) fn sphere(&self) -> (DVec3, f64) {
        let (centre, radius) = self.shape.bounds().bounding_sphere();
        if radius.is_finite() { (centre, 1.01 * radius) } else { INFINITE_SHAPE_SPHERE }
    }

    /// A uniform, isotropic line through the sphere, as a ray from outside with a direction of random length.
    pub(super) fn line(&self, stream: &mut Stream) -> Ray {
        let (centre, radius) = self.sphere();
        let direction = warp::square_to_sphere(stream.next_2d());
        let frame = Frame::from_normal(direction);
        let across = radius * warp::square_to_disc(stream.next_2d());
        let length = LENGTHS[(stream.next_bits() % LENGTHS.len() as u64) as usize];
        let origin = centre + across.x * frame.s + across.y * frame.t - 2.0 * radius * direction;
        Ray::new(origin, length * direction)
    }

    /// All points at which a ray crosses the surface, in order, with their parameters.
    pub(super) fn crossings(&self, ray: &Ray) -> Vec<(f64, Surface)> {
        let mut rest = *ray;
        let mut found = Vec::new();
        while let Some(hit) = self.shape.intersect(&rest) {
            found.push((hit.t, self.shape.surface(&rest, &hit)));
            rest.t_min = hit.t;
        }
        found
    }

    /// The known properties and the volume, if the shape is closed.
    pub(super) fn closed(&self) -> Option<(&Known, f64)> {
        let known = self.known.as_ref()?;
        Some((known, known.volume?))
    }

    /// 1 if the normals of a closed shape point outwards, -1 if they are flipped.
    pub(super) fn sign(&self) -> f64 {
        if self.shape.flipped { -1.0 } else { 1.0 }
    }
}

/// The sphere for shapes of infinite size, which they intersect.
const INFINITE_SHAPE_SPHERE: (DVec3, f64) = (DVec3::new(0.3, -0.2, 0.1), 2.0);

/// The lengths of directions. They differ from 1 because the parameter of a ray is not a distance.
const LENGTHS: [f64; 4] = [1.0, 0.01, 7.3, 1e4];
