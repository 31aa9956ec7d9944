//! Quadrics of revolution around the z axis: `x² + y² = c0 + c1 z + c2 z²` between two heights.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::{Canonical, QuadraticForm, QuadricKind};
use crate::{
    math::{Aabb, Frame, PerArea},
    scene_file::{Category, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::{FLIP_NORMALS, TO_WORLD},
};

/// The squared radius as a function of the height z.
#[derive(Clone, Debug)]
struct Profile {
    /// `c0`, `c1` and `c2`.
    coefficients: [f64; 3],
    /// The lower and the upper end of the surface.
    heights: [f64; 2],
    /// The heights between which the surface is empty.
    gap: [f64; 2],
}

impl Profile {
    fn new(coefficients: [f64; 3], heights: [f64; 2]) -> Self {
        Self { coefficients, heights, gap: [heights[1]; 2] }
    }

    fn radius_squared(&self, z: f64) -> f64 {
        let [c0, c1, c2] = self.coefficients;
        c0 + z * (c1 + z * c2)
    }

    fn canonical<K>(self, to_shape: DAffine3, kind: impl FnOnce(Self) -> K) -> Canonical<K> {
        let [c0, c1, c2] = self.coefficients;
        // The radius is greatest at an end or at the vertex of the parabola.
        let vertex = if c2 < 0.0 { -0.5 * c1 / c2 } else { self.heights[0] };
        let candidates = [self.heights[0], self.heights[1], vertex.clamp(self.heights[0], self.heights[1])];
        let radius = candidates.map(|z| self.radius_squared(z).max(0.0)).into_iter().fold(0.0, f64::max).sqrt();
        // A slightly greater radius, so that the sides of the box do not clip the surface.
        let radius = DVec2::splat(radius * (1.0 + 1e-9));
        let clip = Aabb { min: (-radius).extend(self.heights[0]), max: radius.extend(self.heights[1]) };
        Canonical { form: QuadraticForm::revolved([c0, c1, c2]), clip, to_shape, kind: kind(self) }
    }

    /// The azimuth as a fraction of a turn, and the height as a fraction of the distance between the ends.
    fn uv(&self, local: DVec3) -> DVec2 {
        let phi = local.y.atan2(local.x) / TAU;
        let [from, to] = self.heights;
        DVec2::new(if phi < 0.0 { phi + 1.0 } else { phi }, (local.z - from) / (to - from))
    }

    /// The total height of the surface, without the gap.
    fn total_height(&self) -> f64 {
        self.heights[1] - self.heights[0] - (self.gap[1] - self.gap[0])
    }

    /// Samples a point with uniform azimuth and height.
    fn sample(&self, u: DVec2) -> (DVec3, PerArea) {
        let without_gap = self.heights[0] + u.y * self.total_height();
        let z = if without_gap < self.gap[0] { without_gap } else { without_gap + (self.gap[1] - self.gap[0]) };
        let (sin, cos) = (TAU * u.x).sin_cos();
        let radius = self.radius_squared(z).max(0.0).sqrt();
        let local = DVec3::new(radius * cos, radius * sin, z);
        (local, self.pdf(local))
    }

    /// The pdf of [`Profile::sample`]. The area element is `sqrt(q + q'²/4) dφ dz` for a squared radius q.
    fn pdf(&self, local: DVec3) -> PerArea {
        let [_, c1, c2] = self.coefficients;
        let half_slope = 0.5 * c1 + c2 * local.z;
        let stretch = (self.radius_squared(local.z).max(0.0) + half_slope * half_slope).sqrt();
        PerArea(1.0 / (TAU * self.total_height() * stretch))
    }
}

/// Implements [`QuadricKind`] for the plugins, which differ only in their parameters.
macro_rules! by_profile {
    ($($Name:ident)*) => {$(
        impl QuadricKind for $Name {
            const PLUGIN: Plugin = $Name::PLUGIN;

            fn read(params: &Params<'_>) -> Result<Canonical<Self>, SceneError> {
                let (profile, to_shape) = $Name::read(params)?;
                Ok(profile.canonical(to_shape, Self))
            }

            fn uv(&self, local: DVec3) -> DVec2 {
                self.0.uv(local)
            }

            fn sample(&self, u: DVec2) -> Option<(DVec3, PerArea)> {
                Some(self.0.sample(u))
            }

            fn pdf(&self, local: DVec3) -> PerArea {
                self.0.pdf(local)
            }
        }
    )*};
}

by_profile! { Cylinder Cone Paraboloid Hyperboloid }

/// The lateral surface of a cylinder, without caps, with outward normals; an exact elliptic cylinder under any affine
/// map. As an operand of a csg it is closed by flat caps.
#[derive(Clone, Debug)]
pub struct Cylinder(Profile);

/// The lateral surface of a cone with its base in the plane `z = 0` and its apex above, with outward normals. As an
/// operand of a csg it is closed by a flat base.
#[derive(Clone, Debug)]
pub struct Cone(Profile);

/// The paraboloid `x² + y² = radius² z / height` from its vertex at the origin up to `height`. The normals point
/// outwards, away from the focus at the height `radius² / (4 height)`. As an operand of a csg it is closed by a flat
/// disk at the rim.
#[derive(Clone, Debug)]
pub struct Paraboloid(Profile);

/// The hyperboloid `(x² + y²) / radius² - z² / axis² = 1` of one sheet, or `= -1` of two sheets, between two heights.
/// The normals point away from the z axis; with two sheets, they also point towards the other sheet. As an operand of a
/// csg it is closed by flat caps.
#[derive(Clone, Debug)]
pub struct Hyperboloid(Profile);

const RADIUS: Param = Param::new("radius", ParamKind::Float, "1", "the radius").within(Range::LENGTH);

impl Cylinder {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("revolved.rs": "Cylinder"),
        name: "cylinder",
        summary: "The lateral surface of a cylinder between two points, without caps.",
        params: &[
            Param::new("p0", ParamKind::Point, "0, 0, 0", "the centre of one end"),
            Param::new("p1", ParamKind::Point, "0, 0, 1", "the centre of the other end"),
            RADIUS,
            TO_WORLD,
            FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="cylinder"/>"#,
            r#"<shape type="cylinder"><point name="p0" x="1" y="0" z="-1"/><point name="p1" x="-0.5" y="2" z="0.3"/>
                <float name="radius" value="0.4"/><transform name="to_world"><scale x="1" y="2" z="0.7"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "reference/tube-lights", "csg/solids"],
    };

    fn read(params: &Params<'_>) -> Result<(Profile, DAffine3), SceneError> {
        let (p0, p1, radius) = (params.point("p0")?, params.point("p1")?, params.float("radius")?);
        let axis = p1 - p0;
        if axis.length() == 0.0 || !axis.is_finite() {
            return Err(params.error("p1", "the cylinder has no length").hint("p0 and p1 must differ"));
        }
        let frame = Frame::from_normal(axis.normalize());
        let matrix3 = DMat3::from_cols(radius * frame.s, radius * frame.t, axis);
        Ok((Profile::new([1.0, 0.0, 0.0], [0.0, 1.0]), DAffine3 { matrix3, translation: p0 }))
    }
}

/// A scaling by `radius` in x and y and by `height` in z.
fn scaling(radius: f64, height: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::new(radius, radius, height))
}

impl Cone {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("revolved.rs": "Cone"),
        name: "cone",
        summary: "The lateral surface of a cone from its base at z = 0 up to its apex, without the base.",
        params: &[
            Param::new("radius", ParamKind::Float, "1", "the radius of the base").within(Range::LENGTH),
            Param::new("height", ParamKind::Float, "1", "the height of the apex").within(Range::LENGTH),
            TO_WORLD,
            FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="cone"><float name="radius" value="0.57735"/></shape>"#,
            r#"<shape type="cone"><float name="radius" value="0.8"/><float name="height" value="2"/>
                <transform name="to_world"><rotate x="1" angle="70"/><scale x="1" y="2" z="0.7"/><translate x="1" z="-2"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "csg/solids", "reference/quadrics"],
    };

    fn read(params: &Params<'_>) -> Result<(Profile, DAffine3), SceneError> {
        let to_shape = scaling(params.float("radius")?, params.float("height")?);
        Ok((Profile::new([1.0, -2.0, 1.0], [0.0, 1.0]), to_shape))
    }
}

impl Paraboloid {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("revolved.rs": "Paraboloid"),
        name: "paraboloid",
        summary: "A paraboloid of revolution from its vertex at the origin up to its rim.",
        params: &[
            Param::new("radius", ParamKind::Float, "1", "the radius of the rim").within(Range::LENGTH),
            Param::new("height", ParamKind::Float, "1", "the height of the rim").within(Range::LENGTH),
            TO_WORLD,
            FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="paraboloid"/>"#,
            r#"<shape type="paraboloid"><float name="radius" value="0.8"/><float name="height" value="2"/>
                <transform name="to_world"><rotate y="1" angle="100"/><scale x="1.5" y="0.8" z="1"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "csg/solids", "optics/mirrors", "reference/quadrics"],
    };

    fn read(params: &Params<'_>) -> Result<(Profile, DAffine3), SceneError> {
        let to_shape = scaling(params.float("radius")?, params.float("height")?);
        Ok((Profile::new([0.0, 1.0, 0.0], [0.0, 1.0]), to_shape))
    }
}

impl Hyperboloid {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("revolved.rs": "Hyperboloid"),
        name: "hyperboloid",
        summary: "A hyperboloid of revolution of one or two sheets between two heights.",
        params: &[
            Param::new(
                "radius",
                ParamKind::Float,
                "1",
                "the semi-axis in x and y; with one sheet, the radius of the waist",
            )
            .within(Range::LENGTH),
            Param::new(
                "axis",
                ParamKind::Float,
                "1",
                "the semi-axis along z; with two sheets, the height of the vertices",
            )
            .within(Range::LENGTH),
            Param::new("z_min", ParamKind::Float, "-1", "the height of the lower end"),
            Param::new("z_max", ParamKind::Float, "1", "the height of the upper end"),
            Param::new("sheets", ParamKind::Integer, "1", "the number of sheets, 1 or 2").within(Range {
                min: 1.0,
                max: 2.0,
                open: false,
            }),
            TO_WORLD,
            FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="hyperboloid"><float name="radius" value="0.5"/><float name="axis" value="0.8"/></shape>"#,
            r#"<shape type="hyperboloid"><integer name="sheets" value="2"/><float name="axis" value="0.5"/>
                <float name="z_min" value="-1.2"/><float name="z_max" value="0.9"/>
                <transform name="to_world"><rotate x="1" angle="20"/><scale x="1" y="1.4" z="0.9"/></transform></shape>"#,
            r#"<shape type="hyperboloid"><integer name="sheets" value="2"/><float name="z_max" value="1.8"/></shape>"#,
        ],
        evidence: &["shape/*", "csg/solids", "reference/quadrics"],
    };

    fn read(params: &Params<'_>) -> Result<(Profile, DAffine3), SceneError> {
        let (radius, axis) = (params.float("radius")?, params.float("axis")?);
        let heights = [params.float("z_min")? / axis, params.float("z_max")? / axis];
        if heights[0] >= heights[1] {
            return Err(params.error("z_max", "z_max is not above z_min"));
        }
        let to_shape = scaling(radius, axis);
        if params.integer("sheets")? == 1 {
            return Ok((Profile::new([1.0, 0.0, 1.0], heights), to_shape));
        }
        if heights[0] >= -1.0 && heights[1] <= 1.0 {
            let error =
                params.error("z_max", format!("both sheets lie outside z_min to z_max: their vertices are at ±{axis}"));
            return Err(error.hint("give z_min below -axis or z_max above axis"));
        }
        // The surface is empty between the vertices.
        let heights = [
            if heights[0] >= -1.0 { heights[0].max(1.0) } else { heights[0] },
            if heights[1] <= 1.0 { heights[1].min(-1.0) } else { heights[1] },
        ];
        let gap = if heights[0] < -1.0 && heights[1] > 1.0 { [-1.0, 1.0] } else { [heights[1]; 2] };
        Ok((Profile { gap, ..Profile::new([-1.0, 0.0, 1.0], heights) }, to_shape))
    }
}
