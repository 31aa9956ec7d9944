use glam::{DAffine3, DVec2, DVec3};

use super::{Canonical, QuadraticForm, QuadricKind};
use crate::{
    math::{Aabb, PerArea},
    scene_file::{Category, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// The part of any quadric `A x² + B y² + C z² + D xy + E xz + F yz + G x + H y + I z + J = 0` that lies in a box.
///
/// The normals point to the side where the left side is positive. As an operand of a csg it is the part of the box in
/// which the left side is not positive. Texture coordinates are x and y; on the faces of the box, the two coordinates
/// that vary there.
#[derive(Clone, Debug)]
pub struct General;

const COEFFICIENTS: &str =
    "ten numbers \"A, B, C, D, E, F, G, H, I, J\" of A x² + B y² + C z² + D xy + E xz + F yz + G x + H y + I z + J";

impl QuadricKind for General {
    const PLUGIN: Plugin = Plugin {
        category: Category::Shape,
        manual: manual!("general.rs": "General"),
        name: "quadric",
        summary: "The part of any quadric that lies in a box.",
        params: &[
            Param::required("coefficients", ParamKind::String, COEFFICIENTS),
            Param::required("bbox_min", ParamKind::Point, "the corner of the box with the least coordinates"),
            Param::required("bbox_max", ParamKind::Point, "the corner of the box with the greatest coordinates"),
            crate::shape::TO_WORLD,
            crate::shape::FLIP_NORMALS,
        ],
        examples: &[
            r#"<shape type="quadric"><string name="coefficients" value="3, 2, 2, 1, -1, 0.5, 0.4, -0.3, 0.2, -1"/>
                <point name="bbox_min" value="-1"/><point name="bbox_max" value="1"/></shape>"#,
            r#"<shape type="quadric"><string name="coefficients" value="1 -1 0 0 0 0 0 0 -1 0"/>
                <point name="bbox_min" x="-1" y="-0.8" z="-0.5"/><point name="bbox_max" x="1" y="0.8" z="0.6"/>
                <transform name="to_world"><matrix value="2 0.5 0.1 1 0 1.5 0.2 -1 0.3 0 1 2 0 0 0 1"/></transform></shape>"#,
        ],
        evidence: &["shape/*", "shape/line-volume", "optics/mirrors", "csg/render-equivalence", "reference/quadrics"],
    };

    fn read(params: &Params<'_>) -> Result<Canonical<Self>, SceneError> {
        let numbers = params.numbers("coefficients")?;
        let Ok(coefficients) = <[f64; 10]>::try_from(numbers.as_slice()) else {
            let what = format!("\"coefficients\" has {} numbers", numbers.len());
            return Err(params.error("coefficients", what).hint(format!("give {COEFFICIENTS}")));
        };
        let form = QuadraticForm::new(coefficients);
        if !form.has_sides() {
            let error = params.error("coefficients", "the quadric has no surface with two sides");
            return Err(error.hint("A to I must not all be 0, and the equation must not be the square of a plane's"));
        }
        let clip = Aabb { min: params.point("bbox_min")?, max: params.point("bbox_max")? };
        if !clip.min.cmplt(clip.max).all() {
            return Err(params
                .error("bbox_max", "the box is empty")
                .hint("bbox_max must be above bbox_min in x, y and z"));
        }
        Ok(Canonical { form, clip, to_shape: DAffine3::IDENTITY, kind: Self })
    }

    fn uv(&self, local: DVec3) -> DVec2 {
        local.truncate()
    }

    fn sample(&self, _u: DVec2) -> Option<(DVec3, PerArea)> {
        None
    }

    fn pdf(&self, _local: DVec3) -> PerArea {
        PerArea(0.0)
    }

    fn not_an_emitter_because() -> Option<&'static str> {
        Some("use an ellipsoid, cylinder, cone, paraboloid or hyperboloid")
    }
}
