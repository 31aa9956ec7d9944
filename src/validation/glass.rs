//! Radiance through and inside glass.

use glam::DVec3;

use crate::{
    bsdf::fresnel,
    law::{Check, Effort, Finding, Law},
    validation::setup::{ALBEDO, GLASS, RADIANCE, Setup, area, environment, path, small_disk, towards},
};

/// The laws of radiance through glass.
pub const LAWS: &[Law] = &[
    Law {
        name: "fresnel/slab",
        claim: "A slab of index 1.5 transmits (1 - R) / (1 + R). Direct transmission alone gives (1 - R)², and two internal \
                reflections add up to (1 - R)² (1 + R²). The slab is invisible in a constant environment.",
        source: "geometric series of unpolarised reflections; 0.92307692, 0.90432679, 0.83623246, 0.59609205",
        check: Check::Analytic(slab),
    },
    Law {
        name: "fresnel/etendue",
        claim: "Radiance that enters glass of index n is scaled by n²: it is n² L in a constant environment and n² L / (1 + R) in a \
                slab lit from one side. A surface inside receives the irradiance π (1 - 0.09177796) L. Beyond the critical angle only \
                light from inside the glass arrives.",
        source: "conservation of étendue n² A Ω; Veach 1997, section 5.2",
        check: Check::Analytic(etendue),
    },
];

/// Glass between `z = -0.25` and `z = 0.25`.
fn pane() -> String {
    let scale = r#"<transform name="to_world"><scale x="100" y="100" z="0.25"/></transform>"#;
    format!(r#"<shape type="cube">{scale}{GLASS}</shape>"#)
}

/// An area light that fills the half-space below the pane for negative `z`, or above it for positive `z`.
fn floor_light(z: f64) -> String {
    let turn = if z > 0.0 { r#"<rotate x="1" angle="180"/>"# } else { "" };
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="1000"/>{turn}<translate z="{z}"/></transform>{}</shape>"#,
        area(RADIANCE)
    )
}

fn slab(effort: Effort) -> Vec<Finding> {
    let scene = pane() + &floor_light(-4.0);
    let setup = Setup::new(&path(-1, 5), &scene);
    let table = [(0.0, 0.923_076_92), (45.0, 0.904_326_79), (60.0, 0.836_232_46), (75.0, 0.596_092_05)];
    let mut findings = Vec::new();
    for (theta, number) in table {
        let (sin, cos) = f64::to_radians(theta).sin_cos();
        let reflectance = fresnel::dielectric(cos, 1.5).reflectance;
        let expected = (1.0 - reflectance) / (1.0 + reflectance);
        findings.push(Finding::value(format!("{theta}°, the closed form"), expected, number, 1e-8));
        let ray = (DVec3::new(0.0, 0.0, 3.0), DVec3::new(0.6 * sin, 0.8 * sin, -cos));
        findings
            .push(setup.test(&format!("{theta}°"), ray, effort.samples(40_000), expected * RADIANCE).swap_remove(1));
    }
    let steep = (DVec3::new(0.0, 0.0, 3.0), DVec3::new(0.0, 75.0_f64.to_radians().sin(), -75.0_f64.to_radians().cos()));
    let reflectance = fresnel::dielectric(steep.1.z.abs(), 1.5).reflectance;
    let once = (1.0 - reflectance).powi(2);
    for (depth, terms) in [(2, 0.0), (3, 1.0), (4, 1.0), (5, 1.0 + reflectance.powi(2))] {
        let setup = Setup::new(&path(depth, 100), &scene);
        let found = setup.test(&format!("75°, depth {depth}"), steep, effort.samples(40_000), once * terms * RADIANCE);
        findings.extend(found.into_iter().nth(1));
    }
    // Every reflected or refracted ray reaches the same constant environment.
    let immersed = Setup::new(&path(-1, 1000), &(pane() + &environment(RADIANCE)));
    findings.extend(immersed.compare("60°, constant environment", (DVec3::Z, DVec3::new(0.0, 0.866, -0.5)), RADIANCE));
    findings
}

fn etendue(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(20_000);
    let up = |theta: f64| {
        DVec3::new(0.6 * theta.to_radians().sin(), 0.8 * theta.to_radians().sin(), theta.to_radians().cos())
    };
    let mut findings = Vec::new();
    let immersed = Setup::new(&path(-1, 1000), &(pane() + &environment(RADIANCE)));
    findings.extend(immersed.compare("inside, constant environment", (DVec3::ZERO, up(20.0)), 2.25 * RADIANCE));
    let lit = Setup::new(&path(-1, 5), &(pane() + &floor_light(4.0)));
    for theta in [0.0, 20.0, 38.0_f64] {
        let outside = (1.5 * theta.to_radians().sin()).asin().cos();
        let reflectance = fresnel::dielectric(outside, 1.5).reflectance;
        let expected = 2.25 / (1.0 + reflectance) * RADIANCE;
        findings.extend(lit.test(
            &format!("inside, {theta}°, lit from one side"),
            (DVec3::ZERO, up(theta)),
            samples,
            expected,
        ));
    }
    let beyond: f64 = lit.many(DVec3::ZERO, up(45.0), 100, 40).iter().map(|m| m.mean).sum();
    findings.push(Finding::error("inside, beyond the critical angle", beyond, 0.0));
    // Total internal reflection shows a light inside the glass at its full radiance.
    let scale = r#"<scale value="0.2"/><translate y="0.4" z="-0.2"/>"#;
    let within =
        format!(r#"<shape type="rectangle"><transform name="to_world">{scale}</transform>{}</shape>"#, area(RADIANCE));
    let reflected = Setup::new(&path(-1, 5), &(pane() + &within));
    let aslant = (DVec3::new(0.0, -0.3, 0.0), DVec3::new(0.0, 1.0, 1.0));
    findings.extend(reflected.compare("inside, by total reflection", aslant, RADIANCE));

    // A surface under a wide glass interface, after one refraction: it receives the environment's flux less the
    // reflected part.
    let deep = r#"<transform name="to_world"><scale value="1000"/><translate z="-1000"/></transform>"#;
    let p = DVec3::new(0.0, 0.0, -1.0);
    let scene = format!(
        r#"{}<shape type="cube">{deep}{GLASS}</shape>{}"#,
        environment(RADIANCE),
        small_disk(p, DVec3::Z, ALBEDO)
    );
    let expected = ALBEDO * RADIANCE * (1.0 - 0.091_777_96);
    findings.extend(Setup::new(&path(3, 5), &scene).test("a surface within", towards(p, DVec3::Z), samples, expected));
    findings
}
