use glam::{DAffine3, DVec2, DVec3};

use super::{Crossing, Hit, Line, ShapeModel, SolidModel, Span, Surface, affine::Affine};
use crate::{
    math::{Aabb, Ray},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// The infinite plane `z = 0` with normal +z. As an operand of a csg it is the half-space below the plane. Texture
/// coordinates are the local x and y.
#[derive(Clone, Debug)]
pub struct Plane {
    affine: Affine,
    n: DVec3,
}

impl Described for Plane {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("plane.rs": "Plane"),
        name: "plane",
        summary: "The infinite plane z = 0, with normal +z; in a csg, the half-space below it.",
        params: &[super::TO_WORLD, super::FLIP_NORMALS],
        examples: &[
            r#"<shape type="plane"/>"#,
            r#"<shape type="plane"><transform name="to_world"><scale x="2" y="0.5"/>
                <rotate x="1" angle="40"/><translate z="0.3"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "radiometry/plane", "csg/solids"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let affine = Affine::read(params, DAffine3::IDENTITY)?;
        Ok(Self { n: affine.normal(DVec3::Z), affine })
    }
}

impl ShapeModel for Plane {
    fn bounds(&self) -> Aabb {
        Aabb::EVERYTHING
    }

    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let local = self.affine.ray(ray);
        let t = -local.origin.z / local.direction.z;
        ray.contains(t).then(|| Hit::new(t, 0, DVec2::ZERO))
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let p = self.affine.ray(ray).at(hit.t).truncate();
        Surface::flat(self.affine.point(p.extend(0.0)), self.n, p, 0)
    }

    fn not_an_emitter_because(&self) -> Option<&'static str> {
        Some("its area is infinite; use a rectangle")
    }
}

impl SolidModel for Plane {
    fn check_solid(&self) -> Result<(), String> {
        Ok(())
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn span(&self, line: &Line) -> Option<Span> {
        let local = self.affine.ray(&line.ray);
        let (height, slope) = (local.origin.z, local.direction.z);
        let crossing = |t: f64| Crossing::new(t, 0);
        let (start, end) = (crossing(f64::NEG_INFINITY), crossing(f64::INFINITY));
        if slope > 0.0 {
            Some([start, crossing(-height / slope)])
        } else if slope < 0.0 {
            Some([crossing(-height / slope), end])
        } else {
            (height < 0.0).then_some([start, end])
        }
    }
}
