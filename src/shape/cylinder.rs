use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::{Drawn, Hit, Model, Surface, affine::Affine};
use crate::{
    math::{Aabb, Frame, PerArea, Ray, roots},
    node::{Category, Described, Kind, Param, Params, Plugin, Range, SceneError},
};

/// The mantle of a cylinder, without caps, normals outwards; an exact elliptic cylinder under any affine map.
/// Its canonical form has radius 1 and reaches from `z = 0` to `z = 1`.
#[derive(Clone, Debug)]
pub struct Cylinder {
    affine: Affine,
}

/// Per unit of the canonical mantle's area.
const LOCAL_DENSITY: PerArea = PerArea(1.0 / TAU);

impl Described for Cylinder {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        name: "cylinder",
        summary: "The mantle of a cylinder between two points, without caps.",
        params: &[
            Param::new("p0", Kind::Point, "0, 0, 0", "the middle of one end"),
            Param::new("p1", Kind::Point, "0, 0, 1", "the middle of the other end"),
            Param::new("radius", Kind::Float, "1", "the radius").within(Range::POSITIVE),
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="cylinder"/>"#,
            r#"<shape type="cylinder"><point name="p0" x="1" y="0" z="-1"/><point name="p1" x="-0.5" y="2" z="0.3"/>
                <float name="radius" value="0.4"/><transform name="to_world"><scale x="1" y="2" z="0.7"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "reference/tube-lights"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let (p0, p1, radius) = (params.point("p0")?, params.point("p1")?, params.float("radius")?);
        let axis = p1 - p0;
        if axis.length() == 0.0 || !axis.is_finite() {
            return Err(params.error("p1", "the cylinder has no length").hint("p0 and p1 must differ"));
        }
        let frame = Frame::from_normal(axis.normalize());
        let canonical =
            DAffine3 { matrix3: DMat3::from_cols(radius * frame.s, radius * frame.t, axis), translation: p0 };
        Ok(Self { affine: Affine::read(params, canonical)? })
    }
}

fn uv(local: DVec3) -> DVec2 {
    let phi = local.y.atan2(local.x) / TAU;
    DVec2::new(if phi < 0.0 { phi + 1.0 } else { phi }, local.z)
}

impl Model for Cylinder {
    fn bounds(&self) -> Aabb {
        let axes = self.affine.to_world.matrix3;
        let reach = (axes.x_axis * axes.x_axis + axes.y_axis * axes.y_axis).powf(0.5);
        let (p0, p1) = (self.affine.point(DVec3::ZERO), self.affine.point(DVec3::Z));
        Aabb { min: p0.min(p1) - reach, max: p0.max(p1) + reach }
    }

    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let local = self.affine.ray(ray);
        let (o, d) = (local.origin.truncate(), local.direction.truncate());
        let a = d.length_squared();
        let half_b = o.dot(d);
        // As for the sphere, in the plane of the circle.
        let inside = 1.0 - (o - (half_b / a) * d).length_squared();
        if inside < 0.0 || a == 0.0 {
            return None;
        }
        let roots = roots::from_root(a, 2.0 * half_b, o.length_squared() - 1.0, 2.0 * (a * inside).sqrt())?;
        let between_ends = |t: &f64| (0.0..=1.0).contains(&(local.origin.z + t * local.direction.z));
        let t = roots.into_iter().find(|t| ray.contains(*t) && between_ends(t))?;
        Some(Hit { t, primitive: 0, coordinates: DVec2::ZERO })
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let at = self.affine.ray(ray).at(hit.t);
        let radial = at.truncate().normalize().extend(0.0);
        let local = radial + at.z * DVec3::Z;
        Surface::flat(self.affine.point(local), self.affine.normal(radial), uv(local), 0)
    }

    fn sample_area(&self, u: DVec2) -> Drawn<PerArea> {
        let (sin, cos) = (TAU * u.x).sin_cos();
        let radial = DVec3::new(cos, sin, 0.0);
        let local = radial + u.y * DVec3::Z;
        let density = self.affine.density(LOCAL_DENSITY, radial);
        Drawn { p: self.affine.point(local), n: self.affine.normal(radial), uv: u, density }
    }

    fn area_density(&self, surface: &Surface) -> PerArea {
        let local = self.affine.to_local.transform_point3(surface.p);
        self.affine.density(LOCAL_DENSITY, local.truncate().normalize().extend(0.0))
    }
}
