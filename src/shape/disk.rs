use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DAffine3, DVec2, DVec3};

use super::{Hit, ShapeModel, ShapeSample, SolidModel, Surface, affine::Affine};
use crate::{
    math::{Aabb, PerArea, Ray, warp},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// The unit disc in the plane `z = 0` with normal +z, or an ellipse as its affine image. Texture coordinates are the
/// radius and the azimuth divided by 2π.
#[derive(Clone, Debug)]
pub struct Disk {
    affine: Affine,
    n: DVec3,
    /// The pdf of sampled points.
    pdf: PerArea,
}

impl Described for Disk {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("disk.rs": "Disk"),
        name: "disk",
        summary: "The unit disc in the plane z = 0, with normal +z.",
        params: &[super::TO_WORLD, super::FLIP_NORMALS],
        examples: &[
            r#"<shape type="disk"/>"#,
            r#"<shape type="disk"><transform name="to_world"><scale x="2" y="0.5"/><rotate x="1" y="0" z="0" angle="40"/>
                <translate z="3"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "radiometry/disk-light"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let affine = Affine::read(params, DAffine3::IDENTITY)?;
        Ok(Self { n: affine.normal(DVec3::Z), pdf: affine.pdf(PerArea(FRAC_1_PI), DVec3::Z), affine })
    }
}

/// The radius and the azimuth as a fraction of a turn.
fn uv(p: DVec2) -> DVec2 {
    let phi = p.y.atan2(p.x) / TAU;
    DVec2::new(p.length(), if phi < 0.0 { phi + 1.0 } else { phi })
}

impl ShapeModel for Disk {
    fn bounds(&self) -> Aabb {
        // The half extent of an ellipse with half-axes a and b is sqrt(a² + b²) in each coordinate.
        let axes = self.affine.to_world.matrix3;
        let half_extent = (axes.x_axis * axes.x_axis + axes.y_axis * axes.y_axis).powf(0.5);
        let centre = self.affine.to_world.translation;
        Aabb { min: centre - half_extent, max: centre + half_extent }
    }

    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let local = self.affine.ray(ray);
        let t = -local.origin.z / local.direction.z;
        if !ray.contains(t) {
            return None;
        }
        let p = local.at(t).truncate();
        (p.length_squared() <= 1.0).then_some(Hit::new(t, 0, p))
    }

    fn surface(&self, _ray: &Ray, hit: &Hit) -> Surface {
        let p = hit.coordinates;
        Surface::flat(self.affine.point(p.extend(0.0)), self.n, uv(p), 0)
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let p = warp::square_to_disc(u);
        ShapeSample { p: self.affine.point(p.extend(0.0)), n: self.n, uv: uv(p), pdf: self.pdf }
    }

    fn pdf_position(&self, _surface: &Surface) -> PerArea {
        self.pdf
    }
}

impl SolidModel for Disk {}
