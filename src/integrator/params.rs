//! Parameters that several integrators share.

use crate::{
    scene_file::{Param, ParamKind, Params, Range, SceneError},
    transport::{PathLimits, Shadows},
};

pub(super) const HIDE_EMITTERS: Param = Param::new(
    "hide_emitters",
    ParamKind::Boolean,
    "false",
    "whether emitters are invisible to the camera, and the environment black",
);
pub(super) const TRANSPARENT_SHADOWS: Param = Param::new(
    "transparent_shadows",
    ParamKind::Boolean,
    "false",
    "whether shadow rays pass straight through glass, weighted by its transmittance; not physical",
);
pub(super) const PATH_CLASSES: Param = Param::new(
    "path_classes",
    ParamKind::Boolean,
    "false",
    "whether to write the layers direct, specular, caustic and indirect, which add up to the image",
);
pub(super) const MAX_DEPTH: Param = Param::new(
    "max_depth",
    ParamKind::Integer,
    "-1",
    "the maximum depth of a path; 1 is emission only, -1 sets no limit",
)
.within(Range { min: -1.0, max: 4_294_967_295.0, open: false });
pub(super) const RR_DEPTH: Param =
    Param::new("rr_depth", ParamKind::Integer, "5", "the depth from which on Russian roulette may end a path")
        .within(Range { min: 1.0, max: 4_294_967_295.0, open: false });

/// Reads the limits of paths.
pub(super) fn read_path_limits(params: &Params<'_>) -> Result<PathLimits, SceneError> {
    let max = params.integer(MAX_DEPTH.name)?;
    let rr_depth = params.integer(RR_DEPTH.name)?.unsigned_abs() as u32;
    Ok(PathLimits { max_depth: u32::try_from(max).unwrap_or(u32::MAX), rr_depth })
}

/// Reads the parameter that decides which surfaces block shadow rays.
pub(super) fn read_shadows(params: &Params<'_>) -> Result<Shadows, SceneError> {
    let transparent = params.boolean(TRANSPARENT_SHADOWS.name)?;
    Ok(if transparent { Shadows::Transparent } else { Shadows::Opaque })
}

/// The name of the parameter that makes the image not physical, if shadows are transparent.
pub(super) fn not_physical(shadows: Shadows) -> Option<&'static str> {
    (shadows == Shadows::Transparent).then_some(TRANSPARENT_SHADOWS.name)
}
