//! Parameters and checks that both photon integrators share.

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
    "the depth from which on Russian roulette may end photon paths; camera paths from depth 5 at the earliest",
)
.within(RR_DEPTH.range);
pub(super) const KERNEL: Param = Param::new(
    "kernel",
    ParamKind::Choice(&["constant", "cone", "epanechnikov"]),
    "epanechnikov",
    "the weight of a photon by its distance",
);

/// Reads the kernel.
pub(super) fn read_kernel(params: &Params<'_>) -> Result<Kernel, SceneError> {
    let name = params.string(KERNEL.name)?;
    let (_, kernel) = Kernel::ALL.into_iter().find(|(known, _)| *known == name).expect("the table has these");
    Ok(kernel)
}

/// Reads the limits of paths; photons store depths up to a maximum.
pub(super) fn read_photon_path_limits(params: &Params<'_>) -> Result<PathLimits, SceneError> {
    let limits = read_path_limits(params)?;
    if limits.max_depth != u32::MAX && limits.max_depth > MAX_PHOTON_DEPTH {
        let error = params.error(MAX_DEPTH.name, format!("\"max_depth\" is {}", limits.max_depth));
        return Err(error.hint(format!("must be at most {MAX_PHOTON_DEPTH} for a photon integrator, or -1")));
    }
    Ok(limits)
}

/// The least depth at which Russian roulette may end camera paths. Photons are many, and Russian roulette gives them
/// similar power. A camera path is one sample of a pixel, so ending it early adds visible noise.
pub(super) const CAMERA_RR_DEPTH: u32 = 5;

const MAX_POWER: f64 = 1e34;
const MIN_POWER: f64 = 1e-24;

/// Checks that a scene can be lit by photons.
///
/// # Errors
/// The reason why it cannot.
pub(super) fn check_photons(scene: &Scene) -> Result<(), String> {
    if !scene.has_smooth() {
        return Err("no surface can store a photon: all are mirrors, glass or invisible".into());
    }
    // Photons store their power in f32.
    if scene.power() > MAX_POWER || scene.power() > 0.0 && scene.power() < MIN_POWER {
        let power = scene.power();
        return Err(format!(
            "its emitters emit {power:.3e} W in total; photons can store {MIN_POWER:e} to {MAX_POWER:e} W"
        ));
    }
    scene.check_emission()
}
