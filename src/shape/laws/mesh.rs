//! The laws of meshes, in addition to the laws of all shapes.

use std::{fmt::Write as _, path::Path};

use glam::{DAffine3, DVec3};

use super::subjects::{octahedron, torus};
use crate::{
    law::{Check, Effort, Finding, Law, worst},
    math::{Ray, rng::Stream, warp},
    scene_file::xml,
    shape::{
        Shape, ShapeModel, Surface,
        mesh::{Mesh, MeshData, Ply},
    },
};

/// The laws of meshes.
pub const LAWS: &[Law] = &[
    Law {
        name: "mesh/round-trip",
        claim: "A mesh gives the same hits to the last bit after it is written as PLY (ascii and both byte orders), OBJ or \
                kcply (with either base) and read as part of a scene.",
        source: "definition",
        check: Check::Analytic(round_trip),
    },
    Law {
        name: "mesh/shading-normals",
        claim: "For an octahedron with corners ei under a map M, with normals of any length at its corners or with computed \
                ones, the shading normal at a point M q is Σ qi M⁻ᵀ ei / |M⁻ᵀ ei|, normalized.",
        source: "linear interpolation of unit normals with barycentric coordinates |qi|; normals transform by M⁻ᵀ",
        check: Check::Analytic(shading_normals),
    },
    Law {
        name: "mesh/vertex-normals",
        claim: "The shading normal of a mesh without normals is interpolated from vertex normals: the normalized sums of the \
                adjacent triangles' normals, weighted by their angles.",
        source: "Thürmer and Wüthrich 1998, computed independently for a stretched octahedron",
        check: Check::Analytic(vertex_normals),
    },
    Law {
        name: "mesh/edges",
        claim: "The fraction of a triangle's area within a distance d of its edges is 1 - (1 - d / ρ)² for an inradius ρ.",
        source: "the points at a greater distance form a similar triangle with the inradius ρ - d",
        check: Check::Analytic(edges),
    },
];

/// A torus with normals and texture coordinates. The faces use all vertices, in order.
fn torus_with_normals() -> MeshData {
    let data = torus();
    let normals = data.positions.iter().map(|p| p.map(|x| 2.0 * x + 0.1)).collect();
    MeshData { normals: Some(normals), ..data }
}

fn round_trip(effort: Effort) -> Vec<Finding> {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let data = torus_with_normals();
    let original = Mesh::<Ply>::new(data.clone(), &DAffine3::IDENTITY, false);
    let bare = MeshData { normals: None, uvs: None, ..data.clone() };
    let without = Mesh::<Ply>::new(bare.clone(), &DAffine3::IDENTITY, false);
    let files: [(&str, &str, Vec<u8>); 4] = [
        ("ascii.ply", "ply", ply_ascii(&data).into_bytes()),
        ("little.ply", "ply", ply_binary(&data, "little", f32::to_le_bytes, u32::to_le_bytes)),
        ("big.ply", "ply", ply_binary(&data, "big", f32::to_be_bytes, u32::to_be_bytes)),
        ("mesh.obj", "obj", obj(&data).into_bytes()),
    ];
    let texts = [0, 1].map(|base| (["zero.kcply", "one.kcply"][base], "kcply", kcply(&bare, base as u32).into_bytes()));
    let compare = |(name, plugin, bytes): &(&str, &str, Vec<u8>)| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("a temporary folder can be written to");
        let rays = effort.samples(3000);
        let read = read(&path, plugin);
        let original = if *plugin == "kcply" { &without } else { &original };
        let different = read.map_or(rays as usize, |shape| differences(original, &shape, rays));
        Finding::error(*name, different as f64, 0.0)
    };
    files.iter().chain(&texts).map(compare).collect()
}

fn read(path: &Path, plugin: &str) -> Option<Shape> {
    let flip = match plugin {
        "kcply" => "",
        _ => r#"<boolean name="flip_tex_coords" value="false"/>"#,
    };
    let element =
        format!(r#"<shape type="{plugin}"><string name="filename" value="{}"/>{flip}</shape>"#, path.display());
    let document = xml::parse_element(&element).expect("the element is valid XML");
    let params = Shape::params(&document, document.root).expect("the element is a shape");
    Shape::read_from(&params).ok()
}

/// The number of random rays whose hits on the two shapes differ.
fn differences(one: &impl ShapeModel, other: &impl ShapeModel, samples: u32) -> usize {
    let mut stream = Stream::at(&[50]);
    let mut ray = || {
        let [from, to] = [0, 1].map(|_| warp::square_to_sphere(stream.next_2d()));
        Ray::new(2.0 * from, to - 2.0 * from)
    };
    let differ = |ray: Ray| match (one.intersect(&ray), other.intersect(&ray)) {
        (Some(a), Some(b)) => a != b || one.surface(&ray, &a) != other.surface(&ray, &b),
        (a, b) => a.is_some() || b.is_some(),
    };
    (0..samples).filter(|_| differ(ray())).count()
}

/// The position, normal and texture coordinates of each vertex.
fn vertices(data: &MeshData) -> impl Iterator<Item = [f32; 8]> {
    let normals = data.normals.as_ref().expect("the mesh has normals");
    let uvs = data.uvs.as_ref().expect("the mesh has texture coordinates");
    data.positions.iter().zip(normals).zip(uvs).map(|((p, n), uv)| [p[0], p[1], p[2], n[0], n[1], n[2], uv[0], uv[1]])
}

fn ply_header(data: &MeshData, encoding: &str) -> String {
    let properties: String =
        ["x", "y", "z", "nx", "ny", "nz", "u", "v"].map(|name| format!("property float {name}\n")).concat();
    format!(
        "ply\nformat {encoding} 1.0\nelement vertex {}\n{properties}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        data.positions.len(),
        data.triangles.len()
    )
}

/// A kcply file whose vertex indices start at `base`.
pub(super) fn kcply(data: &MeshData, base: u32) -> String {
    let mut text = format!("kcply\nelement vertex {}\nelement face {}\n", data.positions.len(), data.triangles.len());
    for [x, y, z] in &data.positions {
        writeln!(text, "{x} {y} {z}").expect("writing to a string cannot fail");
    }
    for [a, b, c] in data.triangles.iter().map(|corners| corners.map(|i| i + base)) {
        writeln!(text, "3 {a} {b} {c}").expect("writing to a string cannot fail");
    }
    text
}

fn ply_ascii(data: &MeshData) -> String {
    let mut text = ply_header(data, "ascii");
    let mut line =
        |numbers: &[String]| writeln!(text, "{}", numbers.join(" ")).expect("writing to a string cannot fail");
    vertices(data).for_each(|vertex| line(&vertex.map(|x| x.to_string())));
    data.triangles.iter().for_each(|[a, b, c]| line(&[3, *a, *b, *c].map(|i| i.to_string())));
    text
}

fn ply_binary(data: &MeshData, byte_order: &str, float: fn(f32) -> [u8; 4], index: fn(u32) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = ply_header(data, &format!("binary_{byte_order}_endian")).into_bytes();
    vertices(data).for_each(|vertex| bytes.extend(vertex.map(float).concat()));
    for triangle in &data.triangles {
        bytes.push(3);
        bytes.extend(triangle.map(index).concat());
    }
    bytes
}

/// An OBJ file. Its faces use the vertices in order, so that the reader keeps their indices.
fn obj(data: &MeshData) -> String {
    let mut text = String::new();
    for [x, y, z, nx, ny, nz, u, v] in vertices(data) {
        writeln!(text, "v {x} {y} {z}\nvn {nx} {ny} {nz}\nvt {u} {v}").expect("writing to a string cannot fail");
    }
    for triangle in &data.triangles {
        let [a, b, c] = triangle.map(|i| i + 1);
        writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}").expect("writing to a string cannot fail");
    }
    text
}

fn shading_normals(effort: Effort) -> Vec<Finding> {
    let map =
        DAffine3::from_scale(DVec3::new(1.5, 0.7, 0.4)) * DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let plain = octahedron();
    // The normals point outwards and have different lengths.
    let normals = plain.positions.iter().enumerate().map(|(i, p)| p.map(|x| x * (0.5 + i as f32))).collect();
    let with_normals = MeshData { normals: Some(normals), ..plain.clone() };
    let cases = [
        ("given", Mesh::<Ply>::new(with_normals, &map, false), map),
        ("from the faces", Mesh::<Ply>::new(plain, &DAffine3::IDENTITY, false), DAffine3::IDENTITY),
    ];
    worst(1e-6, |note| {
        for (name, mesh, map) in &cases {
            let inverse = map.matrix3.inverse();
            let corners = DVec3::AXES.map(|axis| (inverse.transpose() * axis).normalize());
            let mut stream = Stream::at(&[51]);
            for _ in 0..effort.samples(1000) {
                let from = 3.0 * warp::square_to_sphere(stream.next_2d());
                let ray = Ray::new(from, -from);
                let hit = mesh.intersect(&ray).expect("a ray to the centre hits the mesh");
                let surface = mesh.surface(&ray, &hit);
                let q = inverse * surface.p;
                let expected = (q.x * corners[0] + q.y * corners[1] + q.z * corners[2]).normalize();
                note(name, surface.shading.n.distance(expected));
            }
        }
    })
}

fn vertex_normals(effort: Effort) -> Vec<Finding> {
    let map = DAffine3::from_scale(DVec3::new(1.5, 0.7, 0.4));
    let data = octahedron();
    let mesh = Mesh::<Ply>::new(data.clone(), &map, false);
    let corner = |v: u32| map.transform_point3(DVec3::from_array(data.positions[v as usize].map(f64::from)));
    let normal_at = |v: u32| {
        let around = data.triangles.iter().filter(|corners| corners.contains(&v));
        let weighted = around.map(|corners| {
            let [a, b, c] = corners.map(corner);
            let others: Vec<_> =
                corners.iter().filter(|w| **w != v).map(|w| (corner(*w) - corner(v)).normalize()).collect();
            others[0].dot(others[1]).acos() * (b - a).cross(c - a).normalize()
        });
        weighted.sum::<DVec3>().normalize()
    };
    worst(1e-6, |note| {
        let mut stream = Stream::at(&[52]);
        for _ in 0..effort.samples(1000) {
            let from = 3.0 * warp::square_to_sphere(stream.next_2d());
            let ray = Ray::new(from, -from);
            let hit = mesh.intersect(&ray).expect("a ray to the centre hits the mesh");
            let (b1, b2) = (hit.coordinates.x, hit.coordinates.y);
            let [n0, n1, n2] = data.triangles[hit.primitive as usize].map(normal_at);
            let expected = ((1.0 - b1 - b2) * n0 + b1 * n1 + b2 * n2).normalize();
            note("stretched octahedron", mesh.surface(&ray, &hit).shading.n.distance(expected));
        }
    })
}

fn edges(effort: Effort) -> Vec<Finding> {
    let corners = [DVec3::new(0.5, 0.25, 1.0), DVec3::new(2.5, 0.5, -0.5), DVec3::new(1.0, 2.0, 0.25)];
    let [a, b, c] = corners;
    let positions = corners.map(|p| p.to_array().map(|x| x as f32)).to_vec();
    let data = MeshData::new(positions, None, None, vec![[0, 1, 2]]).expect("the triangle has an area");
    let mesh = Mesh::<Ply>::new(data, &DAffine3::IDENTITY, true);
    let inradius = (b - a).cross(c - a).length() / (a.distance(b) + b.distance(c) + c.distance(a));
    let mut findings = Vec::new();
    for fraction in [0.05, 0.3, 0.8] {
        let mut stream = Stream::at(&[53]);
        let near = (0..effort.samples(20_000)).map(|_| {
            let sample = mesh.sample_position(stream.next_2d());
            let surface = Surface::flat(sample.p, sample.n, sample.uv, 0);
            f64::from(mesh.edge_distance(&surface).is_some_and(|distance| distance <= fraction * inradius))
        });
        let expected = 1.0 - (1.0 - fraction) * (1.0 - fraction);
        findings.push(Finding::mean(format!("d = {fraction} ρ"), &near.collect(), expected));
    }
    findings
}
