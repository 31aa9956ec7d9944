//! Photon mapping of a floor lit and viewed through a pane of glass.

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

/// The law of the floor under a pane.
pub const LAWS: &[Law] = &[Law {
    name: "caustic/pane",
    claim: "Photon mapping gives a floor under a pane of glass the radiance of the closed form, in three bands of viewing angles. It agrees \
            exactly with the closed form blurred by the kernel, and is within 2 % of the closed form itself.",
    source: "paths light, glass, floor, glass, camera: (1-R)² of the camera ray times ρ/π E, with E = (1-R)² I sin θ / (x dx/dθ) and \
             x = (h-d) tan θ + d tan θt",
    check: Check::Analytic(floor_under_pane),
}];

pub(in crate::validation) const PANE: Pane = Pane { index: 1.5, thickness: 0.4, height: 2.1, intensity: 1.0 };
const INTENSITY: Rgb = Rgb::new(3.0, 1.0, 0.4);

/// The XML of a point light above a pane above a floor.
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

/// The bands of viewing angles to the vertical. Each is tested in its own channel.
pub(in crate::validation) const BANDS: [&str; 3] = ["up to 38°, red", "38° to 52°, green", "above 52°, blue"];

const COLUMNS: u32 = 20;
const ROWS: u32 = 15;

/// The XML of a camera above the pane that views the surroundings of the point below the light.
pub(in crate::validation) fn camera() -> String {
    let position = DVec3::new(-1.9, -0.75, 2.0);
    let (sin, cos) = f64::to_radians(42.5).sin_cos();
    let target = position + DVec3::new(0.96 * sin, 0.28 * sin, -cos);
    PixelCentres { position, target, fov: 58.0, columns: COLUMNS, rows: ROWS }.xml()
}

/// The viewing band of a pixel and its point on the floor.
pub(in crate::validation) struct Pixel {
    band: usize,
    footprint: Footprint,
}

/// The pixels of this camera, row by row.
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

/// The expected mean radiance of each band, from the irradiance of a light of intensity 1 as a function of the distance
/// from the point below it.
pub(in crate::validation) fn expected(pixels: &[Pixel], irradiance: impl Fn(f64) -> f64) -> [f64; BANDS.len()] {
    let radiance = |pixel: &Pixel| {
        let Pixel { band, footprint: Footprint { place, weight } } = pixel;
        Rgb::splat(weight * FRAC_1_PI * irradiance(place.length())) * ALBEDO[*band] * INTENSITY[*band]
    };
    band_means(&pixels.iter().map(radiance).collect::<Vec<_>>(), pixels)
}

/// The mean radiance of each band in its channel.
pub(in crate::validation) fn band_means(radiances: &[Rgb], pixels: &[Pixel]) -> [f64; BANDS.len()] {
    std::array::from_fn(|band| {
        let of_band = radiances.iter().zip(pixels).filter(|(_, pixel)| pixel.band == band);
        let (count, sum) = of_band.fold((0.0, 0.0), |(count, sum), (radiance, _)| (count + 1.0, sum + radiance[band]));
        sum / count
    })
}

/// The irradiance of a light of intensity 1, blurred by the kernel, as a function of the distance from the point below
/// it.
///
/// The blur is the mean over the given radii.
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

/// The lookup radius and the kernel.
const LOOKUP: (f64, Kernel) = (0.2, Kernel::Epanechnikov);
const PHOTONS: u32 = 100_000;

/// A renderer with a max_depth of 6, which admits only paths without reflections inside the pane.
fn mapper() -> Renderer {
    let integrator = format!(
        r#"<integrator type="photonmapper"><integer name="max_depth" value="6"/><integer name="global_photons" value="1"/>
           <integer name="caustic_photons" value="{PHOTONS}"/><integer name="lookup_size" value="0"/>
           <float name="caustic_lookup_radius" value="{}"/><string name="kernel" value="epanechnikov"/></integrator>"#,
        LOOKUP.0
    );
    renderer(&integrator, &camera(), &scene())
}

fn floor_under_pane(effort: Effort) -> Vec<Finding> {
    const REPLICATES: u32 = 60;
    const SAMPLES: u32 = 8;
    let renderer = mapper();
    let pixels = pixels(&renderer.scene.sensor.camera);
    let mut found = [Moments::default(); BANDS.len()];
    for number in 0..u64::from(effort.samples(REPLICATES)) {
        let film = renderer.render(Replicate { seed: 51, number, samples: SAMPLES }, &|_| {});
        let radiances: Vec<_> = film.means().into_iter().map(Rgb::from_array).collect();
        found.iter_mut().zip(band_means(&radiances, &pixels)).for_each(|(moments, mean)| moments.push(mean));
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
