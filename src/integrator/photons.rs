//! What integrators that find light in photons share.

use super::params::{MAX_DEPTH, RR_DEPTH, read_path_limits};
use crate::{
    photon::{Kernel, MAX_PHOTON_DEPTH},
    scene::Scene,
    scene_file::{Param, ParamKind, Params, SceneError},
    transport::PathLimits,
};

pub(super) const PHOTON_RR_DEPTH: Param = Param::new(
    RR_DEPTH.name,
    ParamKind::Integer,
    "1",
    "segments after which Russian roulette of photons begins; of paths from the eye at 5 or later",
)
.within(RR_DEPTH.range);
pub(super) const KERNEL: Param = Param::new(
    "kernel",
    ParamKind::Choice(&["constant", "cone", "epanechnikov"]),
    "epanechnikov",
    "what a photon counts at a distance",
);

/// What a photon counts at a distance.
pub(super) fn read_kernel(params: &Params<'_>) -> Result<Kernel, SceneError> {
    let name = params.string(KERNEL.name)?;
    let (_, kernel) = Kernel::ALL.into_iter().find(|(known, _)| *known == name).expect("the table has these");
    Ok(kernel)
}

/// How long paths may be; photons know the lengths of theirs up to a limit.
pub(super) fn read_photon_path_limits(params: &Params<'_>) -> Result<PathLimits, SceneError> {
    let limits = read_path_limits(params)?;
    if limits.max_depth != u32::MAX && limits.max_depth > MAX_PHOTON_DEPTH {
        let error = params.error(MAX_DEPTH.name, format!("\"max_depth\" is {}", limits.max_depth));
        return Err(error.hint(format!("must be at most {MAX_PHOTON_DEPTH} for a photon mapper, or -1")));
    }
    Ok(limits)
}

/// Russian roulette ends camera paths from this depth on at the earliest. Photons are many, and Russian roulette keeps them
/// alike in power; each camera path is seen.
pub(super) const CAMERA_RR_DEPTH: u32 = 5;

const MAX_POWER: f64 = 1e34;
const MIN_POWER: f64 = 1e-24;

/// Makes sure that a scene can be lit by photons.
///
/// # Errors
/// Why it cannot.
pub(super) fn check_photons(scene: &Scene) -> Result<(), String> {
    if !scene.has_smooth() {
        return Err("no surface can keep a photon, for none scatters over more than single directions".into());
    }
    // Photons hold their power in f32.
    if scene.power() > MAX_POWER || scene.power() > 0.0 && scene.power() < MIN_POWER {
        let power = scene.power();
        return Err(format!(
            "its lights emit {power:.3e} W, and photons are made for {MIN_POWER:e} to {MAX_POWER:e} W in all"
        ));
    }
    scene.check_emission()
}
