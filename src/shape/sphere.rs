use std::{
    f64::consts::{PI, TAU},
    fmt::Debug,
    marker::PhantomData,
};

use glam::{DAffine3, DVec2, DVec3};

use super::{Crossing, Hit, Line, ShapeModel, ShapeSample, SolidModel, Span, Surface, affine::Affine};
use crate::{
    math::{Aabb, Frame, PerArea, PerSolidAngle, Ray, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
};

/// A sphere, or after a transform that is not a similarity, the ellipsoid that it becomes. (Mitsuba warns there and
/// renders a wrong sphere; its exact stand-in is an `instance` of a `shapegroup`.)
///
/// As a light it is drawn by the solid angle of its visible cap, so that the estimate of an unoccluded, uniform
/// spherical light has no variance but that of the receiver's cosine; from inside, and as an ellipsoid, by area.
#[derive(Clone, Debug)]
pub struct EllipsoidShape<K> {
    affine: Affine,
    /// The radius in the world, if it is a sphere there.
    radius: Option<f64>,
    kind: PhantomData<K>,
}

/// Ways to describe a spheroid in a scene file.
pub trait EllipsoidKind: Clone + Debug {
    /// The manual page.
    const PLUGIN: Plugin;

    /// Whether a mirrored `to_world` turns it inside out.
    const TURNS_IN_MIRRORS: bool;

    /// The three radii in the shape's space.
    ///
    /// # Errors
    /// If one is wrong.
    fn radii(params: &Params<'_>) -> Result<DVec3, SceneError>;
}

const CENTER: Param = Param::new("center", ParamKind::Point, "0, 0, 0", "the centre");

/// By one radius.
#[derive(Clone, Debug)]
pub struct Sphere;

impl EllipsoidKind for Sphere {
    /// As in Mitsuba, whose other shapes keep their normals.
    const TURNS_IN_MIRRORS: bool = true;

    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("sphere.rs": "EllipsoidShape", "Sphere"),
        name: "sphere",
        summary: "A sphere; an exact ellipsoid under any other affine map.",
        params: &[
            CENTER,
            Param::new("radius", ParamKind::Float, "1", "the radius").within(Range::POSITIVE),
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="sphere"><point name="center" x="1" y="-2" z="0.5"/><float name="radius" value="0.7"/></shape>"#,
            r#"<shape type="sphere"><transform name="to_world"><scale x="1.2" y="0.8" z="0.5"/>
                <rotate x="1" angle="30"/><translate x="0.3" y="0.1" z="-0.2"/></transform></shape>"#,
            r#"<shape type="sphere"><float name="radius" value="3"/><boolean name="flip_normals" value="true"/></shape>"#,
        ],
        evidence: &[
            "shape/*",
            "shape/line-volume",
            "shape/mean-chord",
            "radiometry/sphere-light",
            "radiometry/integrating-sphere",
        ],
    };

    fn radii(params: &Params<'_>) -> Result<DVec3, SceneError> {
        params.float("radius").map(DVec3::splat)
    }
}

/// By three radii.
#[derive(Clone, Debug)]
pub struct Ellipsoid;

impl EllipsoidKind for Ellipsoid {
    const TURNS_IN_MIRRORS: bool = false;

    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("sphere.rs": "EllipsoidShape", "Ellipsoid"),
        name: "ellipsoid",
        summary: "An ellipsoid whose axes are those of its space.",
        params: &[
            CENTER,
            Param::new("radii", ParamKind::Point, "1, 1, 1", "half the axes along x, y and z").within(Range::POSITIVE),
            super::TO_WORLD,
            super::FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="ellipsoid"><vector name="radii" x="1.2" y="0.8" z="0.5"/></shape>"#,
            r#"<shape type="ellipsoid"><point name="center" x="-1" y="0.5" z="2"/><vector name="radii" x="0.4" y="1.5" z="0.9"/>
                <transform name="to_world"><rotate y="1" angle="-50"/><scale x="1.3" y="0.9" z="1.1"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "shape/line-volume", "shape/mean-chord", "optics/mirrors"],
    };

    fn radii(params: &Params<'_>) -> Result<DVec3, SceneError> {
        params.point("radii")
    }
}

impl<K: EllipsoidKind> Described for EllipsoidShape<K> {
    const PLUGIN: Plugin = K::PLUGIN;

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let canonical =
            DAffine3::from_translation(params.point(CENTER.name)?) * DAffine3::from_scale(K::radii(params)?);
        Ok(Self::new(Affine::read(params, canonical)?))
    }
}

impl<K> EllipsoidShape<K> {
    fn new(affine: Affine) -> Self {
        let axes = affine.to_world.matrix3;
        let gram = axes.transpose() * axes;
        let squared = gram.x_axis.x;
        let is_similarity = (gram - glam::DMat3::from_diagonal(DVec3::splat(squared)))
            .to_cols_array()
            .iter()
            .all(|entry| entry.abs() <= 1e-12 * squared);
        Self { radius: is_similarity.then(|| squared.sqrt()), affine, kind: PhantomData }
    }

    /// Where the line of a ray meets it, in order.
    #[inline(always)]
    fn roots(&self, ray: &Ray) -> Option<[f64; 2]> {
        let Ray { origin: o, direction: d, .. } = self.affine.ray(ray);
        // Half the chord through the point of the line that is nearest to the centre, which loses no digits when the
        // origin is far away. Hearn and Baker; Haines et al. 2019, "Precision Improvements for Ray/Sphere Intersection",
        // Ray Tracing Gems, chapter 7.
        let inverse = d.length_squared().recip();
        let middle = -o.dot(d) * inverse;
        let inside = 1.0 - (o + middle * d).length_squared();
        if inside < 0.0 {
            return None;
        }
        let half = (inside * inverse).sqrt();
        Some([middle - half, middle + half])
    }

    fn centre(&self) -> DVec3 {
        self.affine.to_world.translation
    }

    /// One minus the cosine of the angle under which the sphere is seen, where it is a sphere seen from outside.
    fn cap(&self, from: DVec3) -> Option<Cap> {
        let radius = self.radius?;
        let way = self.centre() - from;
        let sin_squared = radius * radius / way.length_squared();
        // Close to the surface the cap is nearly the hemisphere, and area sampling is as good.
        if sin_squared >= 1.0 - 1e-9 {
            return None;
        }
        Some(Cap { way, radius, sin_squared, one_minus_cos: sin_squared / (1.0 + (1.0 - sin_squared).sqrt()) })
    }

    fn drawn<D>(&self, local: DVec3, pdf: D) -> ShapeSample<D> {
        ShapeSample { p: self.affine.point(local), n: self.affine.normal(local), uv: uv(local), pdf }
    }
}

struct Cap {
    way: DVec3,
    radius: f64,
    sin_squared: f64,
    one_minus_cos: f64,
}

impl<K: EllipsoidKind> ShapeModel for EllipsoidShape<K> {
    fn bounds(&self) -> Aabb {
        // The image of the unit ball reaches as far along an axis as that row of the matrix is long.
        let rows = self.affine.to_world.matrix3.transpose();
        let reach = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        Aabb { min: self.centre() - reach, max: self.centre() + reach }
    }

    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let [first, second] = self.roots(ray)?;
        let t = if ray.contains(first) { first } else { second };
        ray.contains(t).then_some(Hit::new(t, 0, DVec2::ZERO))
    }

    fn is_inside_out(&self) -> bool {
        K::TURNS_IN_MIRRORS && self.affine.to_world.matrix3.determinant() < 0.0
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let local = self.affine.ray(ray).at(hit.t).normalize();
        let n = self.affine.normal(local);
        Surface::flat(self.affine.point(local), n, uv(local), 0)
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let local = warp::square_to_sphere(u);
        self.drawn(local, self.affine.pdf(PerArea(warp::SPHERE_DENSITY), local))
    }

    fn pdf_position(&self, surface: &Surface) -> PerArea {
        let local = self.affine.to_local.transform_point3(surface.p).normalize();
        self.affine.pdf(PerArea(warp::SPHERE_DENSITY), local)
    }

    fn sample_direction(&self, from: DVec3, u: DVec2) -> Option<ShapeSample<PerSolidAngle>> {
        let Some(cap) = self.cap(from) else {
            let drawn = self.sample_position(u);
            let pdf = super::as_seen(drawn.pdf, from, drawn.p, drawn.n)?;
            return Some(ShapeSample { p: drawn.p, n: drawn.n, uv: drawn.uv, pdf });
        };
        let distance = cap.way.length();
        let local = warp::square_to_cone(u, cap.one_minus_cos);
        let direction = Frame::from_normal(cap.way / distance).to_world(local);
        // Where that direction meets the sphere first; at the rim the root may round below zero.
        let sin_squared = 1.0 - local.z * local.z;
        let half_chord = (cap.sin_squared - sin_squared).max(0.0).sqrt() * distance;
        let p = from + (local.z * distance - half_chord) * direction;
        let n = (p - self.centre()) / cap.radius;
        let on_unit = self.affine.to_local.transform_vector3(n * cap.radius).normalize();
        Some(self.drawn(on_unit, PerSolidAngle(warp::square_to_cone_pdf(cap.one_minus_cos))))
    }

    fn pdf_direction(&self, from: DVec3, surface: &Surface) -> PerSolidAngle {
        if let Some(cap) = self.cap(from) {
            return PerSolidAngle(warp::square_to_cone_pdf(cap.one_minus_cos));
        }
        super::as_seen(self.pdf_position(surface), from, surface.p, surface.n).unwrap_or(PerSolidAngle(0.0))
    }
}

impl<K: EllipsoidKind> SolidModel for EllipsoidShape<K> {
    fn check_solid(&self) -> Result<(), String> {
        Ok(())
    }

    fn is_convex(&self) -> bool {
        true
    }

    #[inline(always)]
    fn span(&self, line: &Line) -> Option<Span> {
        self.roots(&line.ray).map(|roots| roots.map(|t| Crossing::new(t, 0)))
    }
}

/// Longitude and colatitude, each over its whole range.
fn uv(local: DVec3) -> DVec2 {
    let phi = local.y.atan2(local.x);
    DVec2::new((if phi < 0.0 { phi + TAU } else { phi }) / TAU, local.z.clamp(-1.0, 1.0).acos() / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hit_from_a_hundred_radii_away_keeps_its_digits() {
        let sphere = EllipsoidShape::<Sphere>::new(Affine::new(DAffine3::IDENTITY));
        let ray = Ray::new(DVec3::new(0.3, 0.4, 100.0), DVec3::NEG_Z);
        let hit = sphere.intersect(&ray).expect("the ray goes through");
        let exact = 100.0 - 0.75_f64.sqrt();
        assert!((hit.t - exact).abs() < 5e-14, "{}", hit.t - exact);
    }

    #[test]
    fn from_inside_the_far_side_is_hit() {
        let sphere = EllipsoidShape::<Sphere>::new(Affine::new(DAffine3::from_scale(DVec3::splat(2.0))));
        let hit = sphere.intersect(&Ray::leaving(DVec3::new(0.5, 0.0, 0.0), DVec3::X)).expect("a hit");
        assert!((hit.t - 1.5).abs() < 1e-15);
    }
}
