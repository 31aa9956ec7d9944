use glam::{DAffine3, DVec2, DVec3};

use super::{Hit, ShapeModel, ShapeSample, SolidModel, Surface, affine::Affine};
use crate::{
    math::{Aabb, PerArea, Ray},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// The square `|x|, |y| <= 1` in the plane `z = 0` with normal +z, or a parallelogram as its affine image. Texture
/// coordinates run from 0 to 1 along x and y.
#[derive(Clone, Debug)]
pub struct Rectangle {
    affine: Affine,
    n: DVec3,
    /// The pdf of sampled points.
    pdf: PerArea,
}

impl Described for Rectangle {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("rectangle.rs": "Rectangle"),
        name: "rectangle",
        summary: "The square from -1 to 1 in x and y in the plane z = 0, with normal +z.",
        params: &[super::TO_WORLD, super::FLIP_NORMALS, super::FLAT],
        examples: &[
            r#"<shape type="rectangle"/>"#,
            r#"<shape type="rectangle"><transform name="to_world"><matrix value="2 0.5 0.1 1 0 1.5 0.2 -1 0.3 0 1 2 0 0 0 1"/>
                </transform><boolean name="flip_normals" value="true"/></shape>"#,
        ],
        evidence: &["shape/*", "radiometry/polygon-light"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let affine = Affine::read(params, DAffine3::IDENTITY)?;
        Ok(Self { n: affine.normal(DVec3::Z), pdf: affine.pdf(PerArea(0.25), DVec3::Z), affine })
    }
}

impl ShapeModel for Rectangle {
    fn bounds(&self) -> Aabb {
        let corner = |x, y| self.affine.point(DVec3::new(x, y, 0.0));
        Aabb::around([corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)])
    }

    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let local = self.affine.ray(ray);
        let t = -local.origin.z / local.direction.z;
        if !ray.contains(t) {
            return None;
        }
        let p = local.at(t).truncate();
        p.abs().cmple(DVec2::ONE).all().then_some(Hit::new(t, 0, p))
    }

    fn surface(&self, _ray: &Ray, hit: &Hit) -> Surface {
        let p = hit.coordinates;
        Surface::flat(self.affine.point(p.extend(0.0)), self.n, 0.5 * (p + 1.0), 0)
    }

    fn is_polyhedron(&self) -> bool {
        true
    }

    fn polygon(&self, _surface: &Surface) -> Option<[DVec3; 4]> {
        let corner = |x, y| self.affine.point(DVec3::new(x, y, 0.0));
        Some([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let p = self.affine.point((2.0 * u - 1.0).extend(0.0));
        ShapeSample { p, n: self.n, uv: u, pdf: self.pdf }
    }

    fn pdf_position(&self, _surface: &Surface) -> PerArea {
        self.pdf
    }
}

impl SolidModel for Rectangle {}
