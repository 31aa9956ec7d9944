use glam::{DVec2, DVec3};

use super::{
    FAR_CLIP, FILM, FOCAL_LENGTH, FOV, FOV_AXIS, NEAR_CLIP, Projection, SAMPLER, SensorModel, SensorSample, TO_WORLD,
};
use crate::{
    math::{Ray, warp},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
};

/// A camera with an ideal thin lens. Points in the plane at `focus_distance` are in focus, others blur to discs.
#[derive(Clone, Debug)]
pub struct ThinLens {
    projection: Projection,
    aperture_radius: f64,
    focus_distance: f64,
}

const RADIUS: Range = Range { open: false, ..Range::LENGTH };

impl Described for ThinLens {
    const PLUGIN: Plugin = Plugin {
        category: Category::Sensor,
        manual: manual!("thinlens.rs": "ThinLens"),
        name: "thinlens",
        summary: "A camera with an ideal thin lens, for depth of field.",
        params: &[
            Param::required("aperture_radius", ParamKind::Float, "the radius of the lens; 0 is a pinhole")
                .within(RADIUS),
            Param::optional("focus_distance", ParamKind::Float, "far_clip", "the depth of the plane in focus")
                .within(Range::LENGTH),
            FOV,
            FOCAL_LENGTH,
            FOV_AXIS,
            NEAR_CLIP,
            FAR_CLIP,
            TO_WORLD,
            FILM,
            SAMPLER,
        ],
        examples: &[
            r#"<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><float name="focus_distance" value="3"/>
            <film type="hdrfilm"/></sensor>"#,
        ],
        evidence: &["sensor/projection", "sensor/importance", "sensor/blur-disc", "reference/torus-thinlens"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let projection = Projection::read(params)?;
        let focus_distance = params.optional_float("focus_distance")?.unwrap_or(projection.far);
        Ok(Self { projection, aperture_radius: params.float("aperture_radius")?, focus_distance })
    }
}

impl ThinLens {
    /// A sampled point of the lens, in local coordinates.
    fn on_lens(&self, u: DVec2) -> DVec3 {
        (self.aperture_radius * warp::square_to_disc(u)).extend(0.0)
    }
}

impl SensorModel for ThinLens {
    fn ray(&self, film: DVec2, lens: DVec2) -> Ray {
        let origin = self.on_lens(lens);
        let focus = self.focus_distance * self.projection.direction(film);
        self.projection.ray(origin, focus - origin)
    }

    fn sample_direction(&self, p: DVec3, lens: DVec2) -> Option<SensorSample> {
        self.projection.sample_direction(p, self.on_lens(lens), self.focus_distance)
    }

    fn footprint(&self, p: DVec3) -> f64 {
        self.projection.footprint(p)
    }
}
