use glam::{DVec2, DVec3};

use super::{
    FAR_CLIP, FILM, FOCAL_LENGTH, FOV, FOV_AXIS, NEAR_CLIP, NO_FOCUS, Projection, SAMPLER, SensorModel, SensorSample,
    TO_WORLD,
};
use crate::{
    math::Ray,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
};

/// A pinhole camera.
#[derive(Clone, Debug)]
pub struct Perspective {
    projection: Projection,
}

/// Far beyond any lens, and small enough for accurate arithmetic.
const OFFSET: Range = Range { min: -1e3, max: 1e3, open: false };

impl Described for Perspective {
    const PLUGIN: Plugin = Plugin {
        category: Category::Sensor,
        manual: manual!("perspective.rs": "Perspective"),
        name: "perspective",
        summary: "A pinhole camera.",
        params: &[
            FOV,
            FOCAL_LENGTH,
            FOV_AXIS,
            Param::new(
                "principal_point_offset_x",
                ParamKind::Float,
                "0",
                "the position of the optical axis on the film to the left of its centre, in widths of the film",
            )
            .within(OFFSET),
            Param::new(
                "principal_point_offset_y",
                ParamKind::Float,
                "0",
                "the position of the optical axis on the film above its centre, in heights of the film",
            )
            .within(OFFSET),
            NEAR_CLIP,
            FAR_CLIP,
            TO_WORLD,
            FILM,
            SAMPLER,
            NO_FOCUS,
        ],
        examples: &[
            r#"<sensor type="perspective"><float name="fov" value="40"/><film type="hdrfilm"/></sensor>"#,
            r#"<sensor type="perspective"><float name="principal_point_offset_x" value="0.25"/><film type="hdrfilm"/></sensor>"#,
        ],
        evidence: &["sensor/projection", "sensor/importance", "film/coverage"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let offset = DVec2::new(params.float("principal_point_offset_x")?, params.float("principal_point_offset_y")?);
        Ok(Self { projection: Projection::read(params)?.shifted(offset) })
    }
}

impl SensorModel for Perspective {
    fn ray(&self, film: DVec2, _lens: DVec2) -> Ray {
        self.projection.ray(DVec3::ZERO, self.projection.direction(film))
    }

    fn sample_direction(&self, p: DVec3, _lens: DVec2) -> Option<SensorSample> {
        self.projection.sample_direction(p, DVec3::ZERO, 1.0)
    }

    fn footprint(&self, p: DVec3) -> f64 {
        self.projection.footprint(p)
    }
}
