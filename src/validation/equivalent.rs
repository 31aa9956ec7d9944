//! Equivalence tests of biased images against unbiased references.

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

/// The laws of equivalence.
pub(super) const LAWS: &[Law] = &[
    Law {
        name: "photon-map/mitsuba",
        claim: "Photon-mapped images, with radii extrapolated to 0, are equivalent to references by Mitsuba: by path tracing where \
                lights have areas, and by light tracing where they are points, without the light visible in mirrors and glass.",
        source: "two one-sided tests, Schuirmann 1987; bias of a density estimate is even in the radius",
        check: Check::Scenes(photon_mapped),
    },
    Law {
        name: "progressive/mitsuba",
        claim: "Images of a few progressive passes, with radii extrapolated to 0, are equivalent to references by Mitsuba: by path \
                tracing where lights have areas, and by light tracing where they are points, without the light visible in mirrors \
                and glass.",
        source: "two one-sided tests, Schuirmann 1987; the radii of all passes are proportional to the first, and the bias is even in them",
        check: Check::Scenes(progressive),
    },
];

/// The smallest lookup radius divided by the radius in the scene.
const LEAST_RADIUS: f64 = 0.012;

/// Whether a scene's integrator makes biased images without variance. Laws compare such a scene with its reference by
/// equivalence tests.
pub(super) fn is_biased(scene: &SceneFile) -> Result<bool, SceneError> {
    let integrator = Integrator::of_scene(&xml::read(&scene.path, &[])?, &Overrides::default())?;
    Ok(!integrator.has_variance())
}

/// Compares a photon-mapped scene with its reference.
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

/// The scenes for progressive photon mapping: the name, the radius schedule, the smallest radius of the first pass
/// divided by the radius in the scene, the number of images, and the numbers of passes and photons of each.
const SCENES: [(&str, &str, f64, u32, u32, &str); 7] = [
    ("figure-8-photons", "per_pixel", 0.02, 8, 8, "30000"),
    ("figure-9-caustic", "per_pass", 0.016, 12, 16, "40000"),
    ("glass-on-checker", "per_pixel", 0.012, 8, 8, "30000"),
    ("caustic-point", "per_pass", 0.012, 8, 8, "30000"),
    ("photon-caustic", "per_pixel", 0.012, 8, 8, "30000"),
    ("open-air", "per_pixel", 0.012, 8, 8, "60000"),
    ("wrappers", "per_pixel", 0.02, 8, 8, "60000"),
];

/// Compares progressive photon mapping of one of these scenes with the scene's reference.
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

/// The settings of a biased image.
struct Biased<'a> {
    /// The name of the integrator; None for the scene's own.
    integrator: Option<&'a str>,
    params: &'a [(&'a str, &'a str)],
    /// The names of the parameters that are radii.
    radii: &'a [&'a str],
    /// The smallest radius, divided by the radius in the scene.
    least: f64,
    /// The number of independent images at the standard effort, and the samples per pixel of each.
    passes: u32,
    samples: u32,
}

impl Biased<'_> {
    /// Tests the equivalence to the reference of a scene.
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
