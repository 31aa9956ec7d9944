//! Parameters that several integrators have.

use crate::{
    scene_file::{Param, ParamKind, Params, Range, SceneError},
    transport::{PathLimits, Shadows},
};

pub(super) const HIDE_EMITTERS: Param = Param::new(
    "hide_emitters",
    ParamKind::Boolean,
    "false",
    "whether the camera sees through lights, and a black environment",
);
pub(super) const TRANSPARENT_SHADOWS: Param = Param::new(
    "transparent_shadows",
    ParamKind::Boolean,
    "false",
    "whether shadow rays pass glass, unbent and weighted by its transmittance; not physical",
);
/// Whether layers show the four classes of paths apart.
pub(super) const PATH_CLASSES: Param = Param::new(
    "path_classes",
    ParamKind::Boolean,
    "false",
    "whether layers direct, specular, caustic, indirect add up to the image",
);
pub(super) const MAX_DEPTH: Param =
    Param::new("max_depth", ParamKind::Integer, "-1", "segments of the longest path; 1 is emission only, -1 no limit")
        .within(Range { min: -1.0, max: 4_294_967_295.0, open: false });
pub(super) const RR_DEPTH: Param =
    Param::new("rr_depth", ParamKind::Integer, "5", "segments after which Russian roulette begins").within(Range {
        min: 1.0,
        max: 4_294_967_295.0,
        open: false,
    });

/// How long paths may be.
pub(super) fn read_path_limits(params: &Params<'_>) -> Result<PathLimits, SceneError> {
    let max = params.integer(MAX_DEPTH.name)?;
    let rr_depth = params.integer(RR_DEPTH.name)?.unsigned_abs() as u32;
    Ok(PathLimits { max_depth: u32::try_from(max).unwrap_or(u32::MAX), rr_depth })
}

/// Whether shadows of glass are transparent.
pub(super) fn read_shadows(params: &Params<'_>) -> Result<Shadows, SceneError> {
    let transparent = params.boolean(TRANSPARENT_SHADOWS.name)?;
    Ok(if transparent { Shadows::Transparent } else { Shadows::Opaque })
}

/// What an image with such shadows says of itself.
pub(super) fn not_physical(shadows: Shadows) -> Option<&'static str> {
    (shadows == Shadows::Transparent).then_some(TRANSPARENT_SHADOWS.name)
}
