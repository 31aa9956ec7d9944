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

/// A sphere, or an ellipsoid as its affine image. (If the transform is not a similarity, Mitsuba warns and renders a
/// wrong sphere; the exact equivalent in Mitsuba is an `instance` of a `shapegroup`.) Texture coordinates are the
/// azimuth divided by 2π and the polar angle divided by π.
///
/// A spherical area light is sampled uniformly in the solid angle of its visible cap, so that the estimate of an
/// unoccluded, uniform light varies only by the receiver's cosine. Ellipsoids, and spheres from inside, are
/// sampled uniformly on the area of the canonical sphere.
#[derive(Clone, Debug)]
pub struct EllipsoidShape<K> {
    affine: Affine,
    /// The world-space radius, or `None` for an ellipsoid.
    radius: Option<f64>,
    kind: PhantomData<K>,
}

/// A plugin that describes an ellipsoid in a scene file.
pub trait EllipsoidKind: Clone + Debug {
    /// The manual page.
    const PLUGIN: Plugin;

    /// Whether a reflection in `to_world` reverses the normals.
    const FLIPS_WHEN_MIRRORED: bool;

    /// The three radii in shape space.
    ///
    /// # Errors
    /// A radius is wrong.
    fn radii(params: &Params<'_>) -> Result<DVec3, SceneError>;
}

const CENTER: Param = Param::new("center", ParamKind::Point, "0, 0, 0", "the centre");

/// The plugin `sphere`, with one radius.
#[derive(Clone, Debug)]
pub struct Sphere;

impl EllipsoidKind for Sphere {
    /// As in Mitsuba, where a reflection reverses the normals of spheres, but not of other shapes.
    const FLIPS_WHEN_MIRRORED: bool = true;

    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("sphere.rs": "EllipsoidShape", "Sphere"),
        name: "sphere",
        summary: "A sphere; under an affine transform that is not a similarity, an exact ellipsoid.",
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

/// The plugin `ellipsoid`, with three radii.
#[derive(Clone, Debug)]
pub struct Ellipsoid;

impl EllipsoidKind for Ellipsoid {
    const FLIPS_WHEN_MIRRORED: bool = false;

    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("sphere.rs": "EllipsoidShape", "Ellipsoid"),
        name: "ellipsoid",
        summary: "An ellipsoid with axes along x, y and z of its shape space.",
        params: &[
            CENTER,
            Param::new("radii", ParamKind::Point, "1, 1, 1", "the semi-axes along x, y and z").within(Range::POSITIVE),
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

    /// The parameters at which the line of a ray intersects the ellipsoid, in order.
    #[inline(always)]
    fn roots(&self, ray: &Ray) -> Option<[f64; 2]> {
        let Ray { origin: o, direction: d, .. } = self.affine.ray(ray);
        // Half the chord follows from the point of the line that is nearest to the centre, which stays accurate for
        // distant origins. Hearn and Baker; Haines et al. 2019, "Precision Improvements for Ray/Sphere Intersection",
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

    /// The cone of directions from a point outside to the sphere. `None` for ellipsoids and for points inside.
    fn cone(&self, from: DVec3) -> Option<SubtendedCone> {
        let radius = self.radius?;
        let to_centre = self.centre() - from;
        let sin_squared = radius * radius / to_centre.length_squared();
        // Close to the surface the cone is nearly a hemisphere, and area sampling is as good.
        if sin_squared >= 1.0 - 1e-9 {
            return None;
        }
        let one_minus_cos = sin_squared / (1.0 + (1.0 - sin_squared).sqrt());
        Some(SubtendedCone { to_centre, radius, sin_squared, one_minus_cos })
    }

    fn sample<D>(&self, local: DVec3, pdf: D) -> ShapeSample<D> {
        ShapeSample { p: self.affine.point(local), n: self.affine.normal(local), uv: uv(local), pdf }
    }
}

/// The cone of directions in which a sphere is visible from a point.
struct SubtendedCone {
    to_centre: DVec3,
    radius: f64,
    /// The squared sine of the half-angle.
    sin_squared: f64,
    /// One minus the cosine of the half-angle.
    one_minus_cos: f64,
}

impl<K: EllipsoidKind> ShapeModel for EllipsoidShape<K> {
    fn bounds(&self) -> Aabb {
        // The half extent of the unit sphere's image along an axis is the length of that row of the matrix.
        let rows = self.affine.to_world.matrix3.transpose();
        let half_extent = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        Aabb { min: self.centre() - half_extent, max: self.centre() + half_extent }
    }

    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let [first, second] = self.roots(ray)?;
        let t = if ray.contains(first) { first } else { second };
        ray.contains(t).then_some(Hit::new(t, 0, DVec2::ZERO))
    }

    fn is_inside_out(&self) -> bool {
        K::FLIPS_WHEN_MIRRORED && self.affine.to_world.matrix3.determinant() < 0.0
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let local = self.affine.ray(ray).at(hit.t).normalize();
        let n = self.affine.normal(local);
        Surface::flat(self.affine.point(local), n, uv(local), 0)
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let local = warp::square_to_sphere(u);
        self.sample(local, self.affine.pdf(PerArea(warp::SQUARE_TO_SPHERE_PDF), local))
    }

    fn pdf_position(&self, surface: &Surface) -> PerArea {
        let local = self.affine.to_local.transform_point3(surface.p).normalize();
        self.affine.pdf(PerArea(warp::SQUARE_TO_SPHERE_PDF), local)
    }

    fn sample_direction(&self, from: DVec3, u: DVec2) -> Option<ShapeSample<PerSolidAngle>> {
        let Some(cone) = self.cone(from) else {
            let sample = self.sample_position(u);
            let pdf = super::to_solid_angle(sample.pdf, from, sample.p, sample.n)?;
            return Some(ShapeSample { p: sample.p, n: sample.n, uv: sample.uv, pdf });
        };
        let distance = cone.to_centre.length();
        let local = warp::square_to_cone(u, cone.one_minus_cos);
        let direction = Frame::from_normal(cone.to_centre / distance).to_world(local);
        // The first intersection in that direction. At the rim the squared half chord may round below zero.
        let sin_squared = 1.0 - local.z * local.z;
        let half_chord = (cone.sin_squared - sin_squared).max(0.0).sqrt() * distance;
        let p = from + (local.z * distance - half_chord) * direction;
        let n = (p - self.centre()) / cone.radius;
        let on_unit_sphere = self.affine.to_local.transform_vector3(n * cone.radius).normalize();
        Some(self.sample(on_unit_sphere, PerSolidAngle(warp::square_to_cone_pdf(cone.one_minus_cos))))
    }

    fn pdf_direction(&self, from: DVec3, surface: &Surface) -> PerSolidAngle {
        if let Some(cone) = self.cone(from) {
            return PerSolidAngle(warp::square_to_cone_pdf(cone.one_minus_cos));
        }
        super::to_solid_angle(self.pdf_position(surface), from, surface.p, surface.n).unwrap_or(PerSolidAngle(0.0))
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

/// The azimuth divided by 2π and the polar angle divided by π.
fn uv(local: DVec3) -> DVec2 {
    let phi = local.y.atan2(local.x);
    DVec2::new((if phi < 0.0 { phi + TAU } else { phi }) / TAU, local.z.clamp(-1.0, 1.0).acos() / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hit_from_a_hundred_radii_away_is_accurate() {
        let sphere = EllipsoidShape::<Sphere>::new(Affine::new(DAffine3::IDENTITY));
        let ray = Ray::new(DVec3::new(0.3, 0.4, 100.0), DVec3::NEG_Z);
        let hit = sphere.intersect(&ray).expect("the ray passes through the sphere");
        let exact = 100.0 - 0.75_f64.sqrt();
        assert!((hit.t - exact).abs() < 5e-14, "{}", hit.t - exact);
    }

    #[test]
    fn a_ray_from_inside_hits_the_far_side() {
        let sphere = EllipsoidShape::<Sphere>::new(Affine::new(DAffine3::from_scale(DVec3::splat(2.0))));
        let hit = sphere.intersect(&Ray::leaving(DVec3::new(0.5, 0.0, 0.0), DVec3::X)).expect("a hit");
        assert!((hit.t - 1.5).abs() < 1e-15);
    }
}
