//! What integrators that find light in photons share.

use super::{MAX_DEPTH, RR_DEPTH, read_depths};
use crate::{
    math::Rgb,
    node::{Kind, Param, Params, SceneError},
    photon::{Kernel, LONGEST},
    scene::Scene,
    transport::{Depths, PathClass},
};

pub(super) const PHOTON_RR_DEPTH: Param = Param::new(
    RR_DEPTH.name,
    Kind::Integer,
    "1",
    "segments after which Russian roulette of photons begins; of paths from the eye at 5 or later",
)
.within(RR_DEPTH.range);
pub(super) const KERNEL: Param = Param::new(
    "kernel",
    Kind::Choice(&["constant", "cone", "epanechnikov"]),
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
pub(super) fn read_photon_depths(params: &Params<'_>) -> Result<Depths, SceneError> {
    let depths = read_depths(params)?;
    if depths.max != u32::MAX && depths.max > LONGEST {
        let error = params.error(MAX_DEPTH.name, format!("\"max_depth\" is {}", depths.max));
        return Err(error.hint(format!("must be at most {LONGEST} for a photon mapper, or -1")));
    }
    Ok(depths)
}

const MOST_POWER: f64 = 1e34;
const LEAST_POWER: f64 = 1e-24;

/// Makes sure that a scene can be lit by photons.
///
/// # Errors
/// Why it cannot.
pub(super) fn check_photons(scene: &Scene) -> Result<(), String> {
    if !scene.has_smooth() {
        return Err("no surface can keep a photon, for none scatters over more than single directions".into());
    }
    // Photons hold their power in f32.
    if scene.power() > MOST_POWER || scene.power() > 0.0 && scene.power() < LEAST_POWER {
        let power = scene.power();
        return Err(format!(
            "its lights emit {power:.3e} W, and photons are made for {LEAST_POWER:e} to {MOST_POWER:e} W in all"
        ));
    }
    scene.check_emission()
}

/// The four parts of what a path shows.
#[derive(Default)]
pub(super) struct Parts(pub(super) [Rgb; 4]);

impl Parts {
    pub(super) fn add(&mut self, class: PathClass, light: Rgb) {
        self.0[class as usize] += light;
    }

    /// Adds all parts of another, times a factor.
    pub(super) fn add_all(&mut self, other: &Self, factor: f64) {
        self.0.iter_mut().zip(other.0).for_each(|(sum, light)| *sum += factor * light);
    }
}
