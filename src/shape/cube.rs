use glam::{DAffine3, DVec2, DVec3};

use super::{Crossing, Hit, Line, ShapeModel, ShapeSample, SolidModel, Span, Surface, affine::Affine};
use crate::{
    math::{Aabb, DiscreteSample, Distribution1D, PerArea, Ray},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// The cube from -1 to 1 on every axis, or a parallelepiped as its affine image. Face `2 axis + side` lies at -1
/// (`side` 0) or +1 (`side` 1) on that axis. The texture coordinates of each face cover the unit square, oriented as in
/// Mitsuba.
#[derive(Clone, Debug)]
pub struct Cube {
    affine: Affine,
    normals: [DVec3; 6],
    /// Samples faces in proportion to their areas.
    faces: Distribution1D<[f64; 6]>,
    pdf: PerArea,
}

impl Described for Cube {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("cube.rs": "Cube"),
        name: "cube",
        summary: "The cube from -1 to 1 on every axis, with outward normals.",
        params: &[super::TO_WORLD, super::FLIP_NORMALS, super::FLAT],
        examples: &[
            r#"<shape type="cube"/>"#,
            r#"<shape type="cube"><transform name="to_world"><matrix value="2 0.5 0.1 1 0 1.5 0.2 -1 0.3 0 1 2 0 0 0 1"/>
                </transform></shape>"#,
        ],
        evidence: &["shape/*", "shape/line-volume", "fresnel/slab", "radiometry/furnace"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let affine = Affine::read(params, DAffine3::IDENTITY)?;
        let areas: [f64; 6] = std::array::from_fn(|face| 4.0 / affine.pdf(PerArea(1.0), local_normal(face)).0);
        let total: f64 = areas.iter().sum();
        let faces = Distribution1D::from_probabilities(areas.map(|area| area / total));
        let normals = std::array::from_fn(|face| affine.normal(local_normal(face)));
        Ok(Self { affine, normals, faces, pdf: PerArea(1.0 / total) })
    }
}

const CANONICAL: Aabb = Aabb { min: DVec3::NEG_ONE, max: DVec3::ONE };

fn local_normal(face: usize) -> DVec3 {
    DVec3::AXES[face / 2] * if face % 2 == 1 { 1.0 } else { -1.0 }
}

fn uv(face: usize, p: DVec3) -> DVec2 {
    0.5 * (1.0
        + match face {
            0 => DVec2::new(p.y, p.z),
            1 => DVec2::new(p.y, -p.z),
            2 => DVec2::new(p.z, p.x),
            3 => DVec2::new(-p.x, -p.z),
            4 => DVec2::new(-p.y, p.x),
            _ => DVec2::new(p.y, p.x),
        })
}

impl ShapeModel for Cube {
    fn bounds(&self) -> Aabb {
        CANONICAL.transformed(&self.affine.to_world)
    }

    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let [entry, exit] = CANONICAL.cross(&self.affine.ray(ray))?;
        let (t, face) = if ray.contains(entry.0) { entry } else { exit };
        ray.contains(t).then_some(Hit::new(t, face as u32, DVec2::ZERO))
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let face = hit.primitive as usize;
        let mut local = self.affine.ray(ray).at(hit.t);
        local[face / 2] = local_normal(face)[face / 2];
        Surface::flat(self.affine.point(local), self.normals[face], uv(face, local), hit.primitive)
    }

    fn is_polyhedron(&self) -> bool {
        true
    }

    fn polygon(&self, surface: &Surface) -> Option<[DVec3; 4]> {
        let face = surface.primitive as usize;
        let (a, b) = ((face / 2 + 1) % 3, (face / 2 + 2) % 3);
        let corner = |x: f64, y: f64| {
            let mut local = local_normal(face);
            (local[a], local[b]) = (x, y);
            self.affine.point(local)
        };
        Some([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let DiscreteSample { index: face, remapped: u_x } = self.faces.sample(u.x);
        let (axis, a, b) = (face / 2, (face / 2 + 1) % 3, (face / 2 + 2) % 3);
        let mut local = DVec3::ZERO;
        local[axis] = local_normal(face)[axis];
        local[a] = 2.0 * u_x - 1.0;
        local[b] = 2.0 * u.y - 1.0;
        ShapeSample { p: self.affine.point(local), n: self.normals[face], uv: uv(face, local), pdf: self.pdf }
    }

    fn pdf_position(&self, _surface: &Surface) -> PerArea {
        self.pdf
    }
}

impl SolidModel for Cube {
    fn check_solid(&self) -> Result<(), String> {
        Ok(())
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn span(&self, line: &Line) -> Option<Span> {
        let crossings = CANONICAL.cross(&self.affine.ray(&line.ray))?;
        Some(crossings.map(|(t, face)| Crossing::new(t, face as u32)))
    }
}
