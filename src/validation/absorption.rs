//! Absorption inside dielectrics (Beer and Lambert).

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::{
    bsdf::fresnel,
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    validation::setup::{
        ALBEDO, CHANNELS, RADIANCE, Setup, area, diffuse, direct, environment, path, small_disk, triple,
    },
};

/// The laws of absorption.
pub const LAWS: &[Law] = &[
    Law {
        name: "absorption/slab",
        claim: "In a constant environment of radiance L, an absorbing slab of thickness d has the radiance (R + (1 - R)² a / (1 - R a)) L \
                with a = exp(-σ d / cos θ'). It transmits (1 - R)² a / (1 - R² a²) of a light behind it, and (1 - R)² a without \
                internal reflections.",
        source: "geometric series; Beer and Lambert; 0.57404473 at 60° in green",
        check: Check::Analytic(slab),
    },
    Law {
        name: "absorption/ball",
        claim: "In a constant environment of radiance L, a ray at the distance h r from the centre of an absorbing sphere of radius r \
                has the radiance (R + (1 - R)² a / (1 - R a)) L with a = exp(-2 σ r cos θ'), at three values of h.",
        source: "all chords of one ray are equal; 0.81206747, 0.34467584, 0.05382822 through the centre",
        check: Check::Analytic(sphere),
    },
    Law {
        name: "absorption/immersed",
        claim: "A diffuse surface at the depth h in an absorbing medium, under a constant environment of radiance L, has from straight \
                above the radiance R L + ρ L (1 - R) e^(-σ h) ∫ 2 μ (1 - R(μ)) e^(-σ h / μ) dμ, for light that crosses the \
                interface once each way. Without refraction the integral is 2 E₃(σ h).",
        source: "exponential integral; 2 E₃ of 0.09, 0.48, 1.8 is 0.84721921, 0.45650168, 0.07743143",
        check: Check::Analytic(immersed),
    },
    Law {
        name: "absorption/touching",
        claim: "Two touching absorbing layers have the radiance that the adding method predicts, whichever layer is the inside of \
                their common interface.",
        source: "van de Hulst 1980, chapter 4: adding of layers",
        check: Check::Analytic(touching),
    },
    Law {
        name: "absorption/integrators",
        claim: "Camera rays, shadow rays and transparent shadows are attenuated along every segment inside the medium.",
        source: "Beer and Lambert; Fresnel",
        check: Check::Analytic(integrators),
    },
];

/// The absorption coefficient, per unit length.
const ABSORPTION: Rgb = Rgb::new(0.15, 0.8, 3.0);
const INDEX: f64 = 1.5;

fn glass(inside: f64, outside: f64, absorption: Rgb) -> String {
    format!(
        r#"<bsdf type="dielectric"><float name="int_ior" value="{inside}"/><float name="ext_ior" value="{outside}"/>
           <rgb name="absorption" value="{}"/></bsdf>"#,
        triple(absorption)
    )
}

/// The transmittance over a distance.
fn transmittance(absorption: Rgb, distance: f64) -> Rgb {
    (-absorption * distance).exp()
}

/// The radiance of a body in a constant environment of radiance 1, if each internal chord has the transmittance `a`.
fn in_constant_environment(reflectance: f64, a: Rgb) -> Rgb {
    Rgb::splat(reflectance) + (1.0 - reflectance).powi(2) * a / (Rgb::ONE - reflectance * a)
}

/// A medium between the heights `low` and `high`, wide enough to act as infinite.
fn layer(low: f64, high: f64, bsdf: &str) -> String {
    let (z, half) = (0.5 * (low + high), 0.5 * (high - low));
    let to_world = format!(r#"<scale x="1000" y="1000" z="{half}"/><translate z="{z}"/>"#);
    format!(r#"<shape type="cube"><transform name="to_world">{to_world}</transform>{bsdf}</shape>"#)
}

/// A wide area light at the height `z` that faces up.
fn floor_light(z: f64) -> String {
    let to_world =
        format!(r#"<transform name="to_world"><scale value="2000"/><translate x="1" y="-3" z="{z}"/></transform>"#);
    format!(r#"<shape type="rectangle">{to_world}{}</shape>"#, area(RADIANCE))
}

/// A ray that descends at an angle to the vertical, the cosine of its refracted angle, and the Fresnel reflectance.
fn descending(degrees: f64) -> ((DVec3, DVec3), f64, f64) {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let ray = (DVec3::new(0.2, -0.1, 3.0), DVec3::new(0.6 * sin, -0.8 * sin, -cos));
    (ray, (sin / INDEX).asin().cos(), fresnel::dielectric(cos, INDEX).reflectance)
}

fn slab(effort: Effort) -> Vec<Finding> {
    let (samples, thickness) = (effort.samples(20_000), 0.6);
    let pane = layer(-0.4, 0.2, &glass(INDEX, 1.0, ABSORPTION));
    let immersed = Setup::new(&path(-1, 5), &(pane.clone() + &environment(RADIANCE)));
    let lit = Setup::new(&path(-1, 5), &(pane.clone() + &floor_light(-4.0)));
    let once = Setup::new(&path(3, 100), &(pane + &floor_light(-4.0)));
    let mut findings = Vec::new();
    for degrees in [0.0, 60.0, 80.0] {
        let (ray, cos, r) = descending(degrees);
        let a = transmittance(ABSORPTION, thickness / cos);
        let expected = in_constant_environment(r, a);
        if degrees == 60.0 {
            findings.push(Finding::value("60°, the closed form", expected.y, 0.574_044_73, 1e-8));
        }
        findings.extend(immersed.test(&format!("{degrees}°, constant environment"), ray, samples, expected * RADIANCE));
        let through = (1.0 - r).powi(2) * a;
        let expected = through / (Rgb::ONE - r * r * a * a) * RADIANCE;
        findings.extend(lit.test(&format!("{degrees}°, over a light"), ray, samples, expected));
        findings.extend(once.test(&format!("{degrees}°, one passage"), ray, samples, through * RADIANCE));
    }
    findings
}

fn sphere(effort: Effort) -> Vec<Finding> {
    let (centre, radius) = (DVec3::new(0.3, -0.2, 0.5), 0.7);
    let shape = format!(
        r#"<shape type="sphere"><point name="center" x="0.3" y="-0.2" z="0.5"/><float name="radius" value="{radius}"/>{}</shape>"#,
        glass(INDEX, 1.0, ABSORPTION)
    );
    let setup = Setup::new(&path(-1, 5), &(shape + &environment(RADIANCE)));
    let mut findings = Vec::new();
    for h in [0.0, 0.5, 0.9_f64] {
        let reflectance = fresnel::dielectric(h.asin().cos(), INDEX).reflectance;
        let expected =
            in_constant_environment(reflectance, transmittance(ABSORPTION, 2.0 * radius * (h / INDEX).asin().cos()));
        if h == 0.0 {
            for (i, number) in [0.812_067_47, 0.344_675_84, 0.053_828_22].into_iter().enumerate() {
                findings.push(Finding::value(format!("the closed form, {i}"), expected[i], number, 1e-8));
            }
        }
        let ray = (centre + DVec3::new(0.6 * radius * h, 0.8 * radius * h, 4.0), -DVec3::Z);
        findings.extend(setup.test(&format!("h = {h}"), ray, effort.samples(20_000), expected * RADIANCE));
    }
    findings
}

/// `∫ 2 μ (1 - R(μ)) exp(-x / μ) dμ` over the cosines inside the medium, by the midpoint rule.
fn transmitted_integral(index: f64, x: f64) -> f64 {
    const STEPS: u32 = 20_000;
    let term = |i: u32| {
        let mu = (f64::from(i) + 0.5) / f64::from(STEPS);
        2.0 * mu * (1.0 - fresnel::dielectric(-mu, index).reflectance) * (-x / mu).exp()
    };
    (0..STEPS).map(term).sum::<f64>() / f64::from(STEPS)
}

fn immersed(effort: Effort) -> Vec<Finding> {
    let depth = 0.6;
    let mut findings = Vec::new();
    for (x, number) in [(0.09, 0.847_219_21), (0.48, 0.456_501_68), (1.8, 0.077_431_43)] {
        findings.push(Finding::value(format!("2 E₃({x})"), transmitted_integral(1.0, x), number, 1e-7));
    }
    for index in [1.0, INDEX] {
        let medium = layer(-1000.0, 0.2, &glass(index, 1.0, ABSORPTION));
        let scene = environment(RADIANCE) + &medium + &small_disk(DVec3::new(0.0, 0.0, 0.2 - depth), DVec3::Z, ALBEDO);
        let integral = (ABSORPTION * depth).map(|x| transmitted_integral(index, x));
        let r = fresnel::dielectric(1.0, index).reflectance;
        let expected = (r + (1.0 - r) * transmittance(ABSORPTION, depth) * ALBEDO * integral) * RADIANCE;
        let ray = (DVec3::new(0.0, 0.0, 2.0), -DVec3::Z);
        // A path of depth 4: camera, interface, disk, interface, environment.
        let setup = Setup::new(&path(4, 100), &scene);
        findings.extend(setup.test(&format!("index {index}"), ray, effort.samples(100_000), expected));
    }
    findings
}

/// The reflectance from above and the transmittance from below of a stack of layers, per channel.
///
/// Radiances are divided by the square of the index.
#[derive(Clone, Copy)]
struct Stack {
    reflected: Rgb,
    transmitted: Rgb,
}

impl Stack {
    const EMPTY: Self = Self { reflected: Rgb::ZERO, transmitted: Rgb::ONE };

    /// The stack with an absorbing layer of transmittance `a` on top.
    fn under_layer(self, a: Rgb) -> Self {
        Self { reflected: a * a * self.reflected, transmitted: a * self.transmitted }
    }

    /// The stack with an interface of reflectance `r` on top.
    fn under_interface(self, r: f64) -> Self {
        let series = Rgb::ONE / (Rgb::ONE - r * self.reflected);
        Self {
            reflected: Rgb::splat(r) + (1.0 - r).powi(2) * self.reflected * series,
            transmitted: (1.0 - r) * self.transmitted * series,
        }
    }
}

fn interface(z: f64, up: bool, bsdf: &str) -> String {
    let flip = format!(r#"<boolean name="flip_normals" value="{}"/>"#, !up);
    format!(r#"<shape type="plane"><transform name="to_world"><translate z="{z}"/></transform>{flip}{bsdf}</shape>"#)
}

fn touching(effort: Effort) -> Vec<Finding> {
    let (upper, lower) = (1.5, 1.33);
    let (upper_absorption, lower_absorption) = (Rgb::new(0.9, 0.1, 0.4), ABSORPTION);
    let (thick, thin) = (0.7, 0.4);
    let top = interface(thick, true, &glass(upper, 1.0, upper_absorption));
    let bottom = interface(-thin, false, &glass(lower, 1.0, lower_absorption));
    let middles = [
        ("the lower", interface(0.0, true, &glass(lower, upper, lower_absorption))),
        ("the upper", interface(0.0, false, &glass(upper, lower, upper_absorption))),
    ];
    let mut findings = Vec::new();
    for (inside, middle) in middles {
        let setup = Setup::new(&path(-1, 5), &(top.clone() + &middle + &bottom + &environment(RADIANCE)));
        for degrees in [0.0, 50.0, 75.0_f64] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let within = |index: f64| (sin / index).asin().cos();
            let r = [
                fresnel::dielectric(cos, upper).reflectance,
                fresnel::dielectric(within(upper), lower / upper).reflectance,
                fresnel::dielectric(cos, lower).reflectance,
            ];
            let stack = Stack::EMPTY
                .under_interface(r[2])
                .under_layer(transmittance(lower_absorption, thin / within(lower)))
                .under_interface(r[1])
                .under_layer(transmittance(upper_absorption, thick / within(upper)))
                .under_interface(r[0]);
            let ray = (DVec3::new(0.1, 0.3, 2.0), DVec3::new(0.6 * sin, 0.8 * sin, -cos));
            let expected = (stack.reflected + stack.transmitted) * RADIANCE;
            let subject = format!("{degrees}°, {inside} inside");
            findings.extend(setup.test(&subject, ray, effort.samples(20_000), expected));
        }
    }
    findings
}

fn integrators(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(20_000);
    let medium = layer(-1.0, 0.2, &glass(INDEX, 1.0, ABSORPTION));
    let mut findings = Vec::new();

    // A ray down to a light inside the medium, and a ray up from a camera inside it.
    let (ray, cos, r) = descending(50.0);
    let lit = Setup::new(&direct(1, 1), &(medium.clone() + &floor_light(-0.5)));
    let expected = (1.0 - r) / (INDEX * INDEX) * transmittance(ABSORPTION, 0.7 / cos) * RADIANCE;
    findings.extend(lit.test("direct, a light within", ray, samples, expected));
    let up = (DVec3::new(0.1, 0.2, -0.6), DVec3::new(0.3, 0.0, 0.91_f64.sqrt()));
    let r = fresnel::dielectric(-up.1.z, INDEX).reflectance;
    let expected = INDEX * INDEX * (1.0 - r) * transmittance(ABSORPTION, 0.8 / up.1.z) * RADIANCE;
    let open = Setup::new(&direct(1, 1), &(medium + &environment(RADIANCE)));
    findings.extend(open.test("direct, a camera within", up, samples, expected));

    for (name, integrator) in [("path", path(2, 5)), ("direct", direct(1, 1))] {
        findings.extend(painted(name, &integrator));
        findings.extend(transparent_shadows(name, &integrator));
    }
    findings
}

fn bulb(z: f64) -> String {
    format!(
        r#"<emitter type="point"><point name="position" x="0.4" y="0.1" z="{z}"/><rgb name="intensity" value="{}"/></emitter>"#,
        triple(RADIANCE)
    )
}

/// The upper interface of a medium that does not refract, blended half with paint. The camera and the light are inside.
fn painted(name: &str, integrator: &str) -> Vec<Finding> {
    let paint = format!(r#"<bsdf type="twosided">{}</bsdf>"#, diffuse(ALBEDO));
    let bsdf = format!(r#"<bsdf type="blendbsdf">{paint}{}</bsdf>"#, glass(1.0, 1.0, ABSORPTION));
    let setup = Setup::new(integrator, &(interface(0.2, true, &bsdf) + &bulb(-0.5)));
    let (origin, p) = (DVec3::new(-0.2, 0.0, -0.7), DVec3::new(0.1, 0.3, 0.2));
    let to_bulb = DVec3::new(0.4, 0.1, -0.5) - p;
    let d = to_bulb.length();
    let irradiance = RADIANCE * (-to_bulb.z / d.powi(3)) * transmittance(ABSORPTION, d);
    let expected = 0.5 * ALBEDO * FRAC_1_PI * irradiance * transmittance(ABSORPTION, (p - origin).length());
    let found = setup.once(origin, p - origin, 30);
    // Shadow rays end at a relative distance of about 1e-9 before their light.
    let bound = |i: usize| 1e-8 * expected[i];
    let subject = |i: usize| format!("{name}, a connection within, {}", CHANNELS[i]);
    (0..3).map(|i| Finding::value(subject(i), found[i], expected[i], bound(i))).collect()
}

/// A disk below a pane and a disk inside one, lit by transparent shadow rays.
fn transparent_shadows(name: &str, integrator: &str) -> Vec<Finding> {
    let transparent =
        integrator.replace("</integrator>", r#"<boolean name="transparent_shadows" value="true"/></integrator>"#);
    let mut findings = Vec::new();
    let pane = layer(-0.3, 0.2, &glass(INDEX, 1.0, ABSORPTION));
    for (subject, z, faces, within) in [("below", -1.0, 2, 0.5), ("in", -0.1, 1, 0.3)] {
        let p = DVec3::new(-0.5, 0.3, z);
        let setup = Setup::new(&transparent, &(pane.clone() + &bulb(1.5) + &small_disk(p, DVec3::Z, ALBEDO)));
        let to_bulb = DVec3::new(0.4, 0.1, 1.5) - p;
        let (d, cos) = (to_bulb.length(), to_bulb.normalize().z);
        let transmittance =
            (1.0 - fresnel::dielectric(cos, INDEX).reflectance).powi(faces) * transmittance(ABSORPTION, within / cos);
        let expected = ALBEDO * FRAC_1_PI * transmittance * RADIANCE * cos / (d * d);
        let ray = (p + DVec3::new(0.01, 0.02, 0.05), DVec3::new(-0.01, -0.02, -0.05));
        findings.extend(setup.compare(&format!("{name}, a patch {subject} a pane"), ray, expected));
    }
    findings
}
