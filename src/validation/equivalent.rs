//! Biased images held against the references of other integrators.

use crate::{
    comparison::{
        Reference,
        equivalence::{self, Work},
    },
    integrator::{Integrator, IntegratorModel as _, Overrides},
    law::{Check, CheckError, Effort, Finding, Law, SceneFile},
    render::{Renderer, Replicate},
    scene_file::{SceneError, xml},
    stats::equivalence::TO_RADIUS_ZERO,
    validation::reference::SEED,
};

/// These laws.
pub(super) const LAWS: &[Law] = &[
    Law {
        name: "photon-map/mitsuba",
        claim: "Photon-mapped images, with radii extrapolated to 0, are equivalent to Mitsuba's path tracing where lights have areas, \
                and to its light tracing, without what is seen in mirrors and glass, where they are points.",
        source: "two one-sided tests, Schuirmann 1987; bias of a density estimate is even in the radius",
        check: Check::Scenes(photon_mapped),
    },
    Law {
        name: "progressive/mitsuba",
        claim: "Images of few progressive passes, with radii extrapolated to 0, are equivalent to Mitsuba's path tracing where lights \
                have areas, and to its light tracing, without what is seen in mirrors and glass, where they are points.",
        source: "two one-sided tests, Schuirmann 1987; radii of all passes are as those of the first, and bias is even in them",
        check: Check::Scenes(progressive),
    },
];

/// The least radius of a lookup over that of the scene.
const LEAST_RADIUS: f64 = 0.012;

/// Whether a scene asks for an integrator whose images are biased and have no variance, so that laws hold it against its
/// reference by equivalence.
pub(super) fn is_biased(scene: &SceneFile) -> Result<bool, SceneError> {
    let integrator = Integrator::of_scene(&xml::read(&scene.path, &[])?, &Overrides::default())?;
    Ok(!integrator.has_variance())
}

/// Holds a scene of photon mapping against its reference.
fn photon_mapped(scene: &SceneFile, effort: Effort) -> Result<Vec<Finding>, CheckError> {
    if !is_biased(scene)? {
        return Ok(Vec::new());
    }
    let params = [("lookup_size", "0"), ("global_photons", "60000"), ("caustic_photons", "100000")];
    let biased = Biased {
        integrator: None,
        params: &params,
        radii: &["global_lookup_radius", "caustic_lookup_radius"],
        least: LEAST_RADIUS,
        passes: 10,
        samples: 4,
    };
    biased.compare(scene, effort)
}

/// Scenes that progressive photon mapping is held against, with the schedule and the least radius of the first pass
/// over that of the scene, and how many images of how many passes of how many photons there are.
const SCENES: [(&str, &str, f64, u32, u32, &str); 5] = [
    ("figure-8-photons", "per_pixel", 0.02, 8, 8, "30000"),
    ("figure-9-caustic", "per_pass", 0.016, 12, 16, "40000"),
    ("glass-on-checker", "per_pixel", 0.012, 8, 8, "30000"),
    ("caustic-point", "per_pass", 0.012, 8, 8, "30000"),
    ("photon-caustic", "per_pixel", 0.012, 8, 8, "30000"),
];

/// Holds progressive photon mapping of one of these scenes against the scene's reference.
fn progressive(scene: &SceneFile, effort: Effort) -> Result<Vec<Finding>, CheckError> {
    let stem = scene.stem();
    let Some((_, schedule, least, images, passes, photons)) = SCENES.into_iter().find(|(known, ..)| *known == stem)
    else {
        return Ok(Vec::new());
    };
    let params = [("photon_count", photons), ("radius_schedule", schedule), ("path_classes", "true")];
    let biased = Biased {
        integrator: Some("sppm"),
        params: &params,
        radii: &["initial_radius"],
        least,
        passes: images,
        samples: passes,
    };
    biased.compare(scene, effort)
}

/// The quick effort takes one sample of each pixel where the standard one takes this many.
const QUICK_SHARE: u32 = 4;

/// A biased image.
struct Biased<'a> {
    /// The name of the integrator, unless it is the scene's own.
    integrator: Option<&'a str>,
    params: &'a [(&'a str, &'a str)],
    /// The parameters that are radii.
    radii: &'a [&'a str],
    /// The least of them, over the radius of the scene.
    least: f64,
    /// Independent images at the standard effort, and samples of each pixel in one.
    passes: u32,
    samples: u32,
}

impl Biased<'_> {
    /// Whether it is equivalent to the reference of a scene.
    fn compare(&self, scene: &SceneFile, effort: Effort) -> Result<Vec<Finding>, CheckError> {
        let reference = Reference::load(&scene.reference)?;
        reference.check_fresh(&scene.reference, &scene.path)?;
        let document = xml::read(&scene.path, &[])?;
        let size = Renderer::new(&document, &Overrides::default())?.scene.scene_bounds().radius;
        let [one, two, three] = TO_RADIUS_ZERO.map(|(scale, _)| {
            let radius = (self.least * scale * size).to_string();
            let radii = self.radii.iter().map(|name| (*name, radius.as_str()));
            let params = self.params.iter().copied().chain(radii);
            let params = params.map(|(name, value)| (name.to_owned(), value.to_owned())).collect();
            Renderer::new(&document, &Overrides { name: self.integrator.map(str::to_owned), params })
        });
        let samples = match effort {
            Effort::Quick => self.samples.div_ceil(QUICK_SHARE),
            Effort::Standard | Effort::Full => self.samples,
        };
        // The standard error of a mean of independent samples.
        let noisier = (f64::from(self.samples) / f64::from(samples)).sqrt();
        let work = Work {
            replicate: Replicate { seed: SEED, number: 0, samples },
            passes: u64::from(effort.samples(self.passes)),
            widening: noisier * effort.bound(self.passes, 1.0),
        };
        let found = equivalence::photon_map(&[one?, two?, three?], &reference, &work);
        Ok(found
            .into_iter()
            .map(|found| Finding { subject: format!("{}, {}", scene.stem(), found.subject), ..found })
            .collect())
    }
}
