use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{Emission, EmissionTarget, EmitterModel, EmitterSample, orientation::Orientation};
use crate::{
    math::{PerSolidAngle, Ray, Rgb, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::Shape,
};

/// A point that emits in a cone around its local z axis, as in Mitsuba. The intensity is constant up to the angle
/// `beam_width` from the axis, and falls linearly with the angle to 0 at `cutoff_angle`.
#[derive(Clone, Debug)]
pub struct Spot {
    orientation: Orientation,
    position: DVec3,
    intensity: Rgb,
    /// In radians.
    beam_width: f64,
    cutoff: f64,
}

const ANGLE: Range = Range { min: 0.0, max: 180.0, open: true };

impl Described for Spot {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        manual: manual!("spot.rs": "Spot"),
        name: "spot",
        summary: "A point that emits in a cone, with linear falloff towards its edge.",
        params: &[
            Param::new("intensity", ParamKind::Rgb, "1", "the radiant intensity within beam_width, in W/sr")
                .within(Range::LIGHT),
            Param::new(
                "cutoff_angle",
                ParamKind::Float,
                "20",
                "the angle from the axis beyond which nothing is emitted, in degrees",
            )
            .within(ANGLE),
            Param::optional(
                "beam_width",
                ParamKind::Float,
                "3/4 of cutoff_angle",
                "the angle from the axis up to which the intensity is constant, in degrees",
            )
            .within(Range { min: 0.0, max: 180.0, open: false }),
            Param::optional(
                "to_world",
                ParamKind::Transform,
                "the identity",
                "maps the light to the world; its local axis is +z",
            ),
        ],
        examples: &[
            r#"<emitter type="spot"><rgb name="intensity" value="30, 20, 10"/><float name="cutoff_angle" value="25"/>
                <transform name="to_world"><lookat origin="1, 2, -1" target="0, 0, 0"/></transform></emitter>"#,
        ],
        evidence: &["emitter/*", "radiometry/spot", "reference/materials"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let cutoff = params.float("cutoff_angle")?;
        let beam_width = params.optional_float("beam_width")?.unwrap_or(0.75 * cutoff);
        if beam_width > cutoff {
            let error = params.error("beam_width", format!("beam_width {beam_width} is beyond cutoff_angle {cutoff}"));
            return Err(error.hint("the beam must lie within the cone"));
        }
        Ok(Self {
            orientation: Orientation::read(params)?,
            position: params.transform("to_world")?.translation,
            intensity: params.rgb("intensity")?,
            beam_width: beam_width.to_radians(),
            cutoff: cutoff.to_radians(),
        })
    }
}

impl Spot {
    /// The fraction of the full intensity that is emitted in a world direction.
    fn falloff(&self, direction: DVec3) -> f64 {
        let local = self.orientation.local(direction);
        let angle = local.truncate().length().atan2(local.z);
        if angle >= self.cutoff {
            0.0
        } else if angle <= self.beam_width {
            1.0
        } else {
            (self.cutoff - angle) / (self.cutoff - self.beam_width)
        }
    }

    /// Samples a direction within the cone.
    fn within_cone(&self, u: DVec2) -> (DVec3, PerSolidAngle) {
        let one_minus_cos = 2.0 * (0.5 * self.cutoff).sin().powi(2);
        let (direction, ratio) = self.orientation.world(warp::square_to_cone(u, one_minus_cos));
        (direction, PerSolidAngle(warp::square_to_cone_pdf(one_minus_cos) / ratio))
    }
}

impl EmitterModel for Spot {
    fn sample_direction(&self, _shape: Option<&Shape>, from: DVec3, _u: DVec2) -> Option<EmitterSample> {
        let to_light = self.position - from;
        let distance_squared = to_light.length_squared();
        let falloff = self.falloff(-to_light);
        if distance_squared == 0.0 || falloff == 0.0 {
            return None;
        }
        Some(EmitterSample {
            direction: to_light / distance_squared.sqrt(),
            shadow_ray: Ray::between(from, self.position),
            value: self.intensity * (falloff / distance_squared),
            pdf: None,
        })
    }

    fn emit(&self, _shape: Option<&Shape>, target: &EmissionTarget, [_, u]: [DVec2; 2]) -> Option<Emission> {
        let (direction, pdf) = if target.is_aimed { target.towards(self.position, u) } else { self.within_cone(u) };
        let falloff = self.falloff(direction);
        let ray = Ray::new(self.position, direction);
        (falloff > 0.0).then(|| Emission { ray, flux: self.intensity * (falloff / pdf.0) })
    }

    /// `2π ∫ falloff(θ) sin θ dθ = 2π (1 - cos m sin h / h)`, with the mean m and half the difference h of the two
    /// angles. Ignores a shear in the transform. The terms are rearranged because `1 - cos` cancels for narrow cones.
    fn power(&self, _shape: Option<&Shape>, _target: &EmissionTarget) -> Rgb {
        let (mean, half) = (0.5 * (self.cutoff + self.beam_width), 0.5 * (self.cutoff - self.beam_width));
        let square = half * half;
        let one_minus_sinc = if half < 1e-2 { square / 6.0 * (1.0 - square / 20.0) } else { 1.0 - half.sin() / half };
        let one_minus_cos = 2.0 * (0.5 * mean).sin().powi(2);
        self.intensity * (TAU * (one_minus_cos + mean.cos() * one_minus_sinc))
    }
}
