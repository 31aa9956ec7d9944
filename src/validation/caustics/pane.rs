//! A floor that is lit and seen through a pane of glass.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    photon::Kernel,
    render::{Renderer, Replicate},
    sensor::{Camera, SensorModel as _},
    stats::{Estimate, Moments},
    validation::{
        setup::{ALBEDO, GLASS, PixelCentres, ground, renderer},
        theory::{
            density::Photons,
            numeric::Interpolant,
            pane::{Footprint, Pane},
        },
    },
};

/// These laws.
pub const LAWS: &[Law] = &[Law {
    name: "caustic/pane",
    claim: "Photon mapping shows a floor under a pane of glass with the radiance of the closed form, in three bands of angles of the eye; \
            with the blur of its kernel exactly, and without it within 2 %.",
    source: "light, glass, floor, glass, eye: (1-R)² of the eye's ray times ρ/π E, E = (1-R)² I sin θ / (x dx/dθ) and \
             x = (h-d) tan θ + d tan θt",
    check: Check::Analytic(seen_through),
}];

pub(in crate::validation) const PANE: Pane = Pane { index: 1.5, thickness: 0.4, height: 2.1, intensity: 1.0 };
const INTENSITY: Rgb = Rgb::new(3.0, 1.0, 0.4);

/// A point light over a pane over a floor.
pub(crate) fn scene() -> String {
    let (half, height, Rgb { x, y, z }) = (0.5 * PANE.thickness, PANE.height, INTENSITY);
    let pane = format!(
        r#"<shape type="cube"><transform name="to_world"><scale x="40" y="40" z="{half}"/><translate z="0.9"/></transform>{GLASS}</shape>"#
    );
    let light = format!(
        r#"<emitter type="point"><point name="position" x="0" y="0" z="{height}"/><rgb name="intensity" value="{x}, {y}, {z}"/></emitter>"#
    );
    light + &pane + &ground(ALBEDO)
}

/// What is seen at different angles to the vertical, each in a channel of its own.
pub(in crate::validation) const BANDS: [&str; 3] = ["up to 38°, red", "38° to 52°, green", "above 52°, blue"];

const COLUMNS: u32 = 20;
const ROWS: u32 = 15;

/// A camera above the pane, which looks at what is around the place below the light.
pub(in crate::validation) fn camera() -> String {
    let eye = DVec3::new(-1.9, -0.75, 2.0);
    let (sin, cos) = f64::to_radians(42.5).sin_cos();
    let target = eye + DVec3::new(0.96 * sin, 0.28 * sin, -cos);
    PixelCentres { eye, target, fov: 58.0, columns: COLUMNS, rows: ROWS }.xml()
}

/// What a pixel sees.
pub(in crate::validation) struct Pixel {
    band: usize,
    footprint: Footprint,
}

/// What the pixels of this camera see, row by row.
pub(in crate::validation) fn pixels(camera: &Camera) -> Vec<Pixel> {
    let pixel = |(row, column): (u32, u32)| {
        let centre = DVec2::new(f64::from(column), f64::from(row)) + 0.5;
        let ray = camera.ray(centre, DVec2::splat(0.5));
        let degrees = (-ray.direction.z).acos().to_degrees();
        let band = [38.0, 52.0].iter().filter(|from| degrees > **from).count();
        let footprint = PANE.footprints(ray.origin, ray.direction).next().expect("there is an order 0");
        Pixel { band, footprint }
    };
    (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))).map(pixel).collect()
}

/// The mean radiance of each band, if the irradiance of a light of intensity 1 depends like this on the distance from
/// the place below it.
pub(in crate::validation) fn expected(pixels: &[Pixel], irradiance: impl Fn(f64) -> f64) -> [f64; BANDS.len()] {
    let seen = |pixel: &Pixel| {
        let Pixel { band, footprint: Footprint { place, weight } } = pixel;
        Rgb::splat(weight * FRAC_1_PI * irradiance(place.length())) * ALBEDO[*band] * INTENSITY[*band]
    };
    band_means(&pixels.iter().map(seen).collect::<Vec<_>>(), pixels)
}

/// The mean radiance of each band in its channel.
pub(in crate::validation) fn band_means(shown: &[Rgb], pixels: &[Pixel]) -> [f64; BANDS.len()] {
    std::array::from_fn(|band| {
        let of_band = shown.iter().zip(pixels).filter(|(_, pixel)| pixel.band == band);
        let (count, sum) = of_band.fold((0.0, 0.0), |(count, sum), (radiance, _)| (count + 1.0, sum + radiance[band]));
        sum / count
    })
}

/// What the kernel makes of the irradiance of a light of intensity 1, by the distance from the place below it: for
/// photons within each of these radii, in the mean over these.
pub(in crate::validation) fn blurred(kernel: Kernel, radii: &[f64], pixels: &[Pixel]) -> impl Fn(f64) -> f64 {
    let photons = Photons {
        irradiance: |place: DVec2| PANE.irradiance(place.length(), 0),
        power: 4.0 * PI * PANE.intensity,
        count: 1,
    };
    let mean = |distance: f64| {
        let within = |radius: &f64| photons.within(kernel, DVec2::new(distance, 0.0), *radius).mean;
        [radii.iter().map(within).sum::<f64>() / radii.len() as f64]
    };
    let farthest = pixels.iter().map(|pixel| pixel.footprint.place.length()).fold(0.0, f64::max);
    let interpolant = Interpolant::new(mean, [0.0, farthest], 14);
    move |distance| interpolant.at(distance)[0]
}

/// How far photons count, and how.
const LOOKUP: (f64, Kernel) = (0.2, Kernel::Epanechnikov);
const PHOTONS: u32 = 100_000;

/// Paths of six segments are those without reflections.
fn mapper() -> Renderer {
    let integrator = format!(
        r#"<integrator type="photonmapper"><integer name="max_depth" value="6"/><integer name="global_photons" value="1"/>
           <integer name="caustic_photons" value="{PHOTONS}"/><integer name="lookup_size" value="0"/>
           <float name="caustic_lookup_radius" value="{}"/><string name="kernel" value="epanechnikov"/></integrator>"#,
        LOOKUP.0
    );
    renderer(&integrator, &camera(), &scene())
}

fn seen_through(effort: Effort) -> Vec<Finding> {
    const REPLICATES: u32 = 60;
    const SAMPLES: u32 = 8;
    let renderer = mapper();
    let pixels = pixels(&renderer.scene.sensor.camera);
    let mut found = [Moments::default(); BANDS.len()];
    for number in 0..u64::from(effort.samples(REPLICATES)) {
        let film = renderer.render(Replicate { seed: 51, number, samples: SAMPLES }, &|_| {});
        let shown: Vec<_> = film.means().into_iter().map(Rgb::from_array).collect();
        found.iter_mut().zip(band_means(&shown, &pixels)).for_each(|(moments, mean)| moments.push(mean));
    }
    let (radius, kernel) = LOOKUP;
    let expected_blurred = expected(&pixels, blurred(kernel, &[radius], &pixels));
    let exact = expected(&pixels, |distance| PANE.irradiance(distance, 0));
    let mut findings = Vec::new();
    for (i, subject) in BANDS.into_iter().enumerate() {
        findings.push(Finding::mean(format!("{subject}, blurred"), &found[i], expected_blurred[i]));
        let estimate = Estimate::from_moments(&found[i]).expect("there are two replicates or more");
        findings.push(Finding::equivalent(
            subject,
            &estimate,
            &Estimate::exact(exact[i]),
            effort.bound(REPLICATES, 0.02),
        ));
    }
    findings
}
