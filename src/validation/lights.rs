//! Closed forms of the radiance that a small surface reflects from each type of light.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    validation::setup::{
        ALBEDO, CHANNELS, RADIANCE, Setup, area, diffuse, direct, environment, ground, path, small_disk, towards,
        triple,
    },
};

/// The laws of emitters in closed form.
pub const LAWS: &[Law] = &[
    Law {
        name: "radiometry/point-light",
        claim: "A point light of intensity I gives a diffuse plane the radiance ρ/π I cos θ / d², at two heights and five points.",
        source: "inverse square and cosine laws",
        check: Check::Analytic(point_light),
    },
    Law {
        name: "radiometry/directional-light",
        claim: "Parallel light of irradiance E gives a diffuse surface the radiance ρ/π E cos θ. Light from behind the surface gives none.",
        source: "cosine law",
        check: Check::Analytic(directional_light),
    },
    Law {
        name: "radiometry/polygon-light",
        claim: "A 2 by 1 rectangular emitter gives the irradiance of Lambert's formula, also where the receiver's horizon cuts it. Its \
                back is black.",
        source: "Lambert 1760; E/L = ½ |Σ Θi Γi·n|: 0.4158376265, 0.1877648137, 0.2199712755",
        check: Check::Analytic(polygon_light),
    },
    Law {
        name: "radiometry/disk-light",
        claim: "A disk emitter of radius 1 at height 2 gives the irradiance of the closed form at five distances from its axis.",
        source: "Howell, Mengüç, Daun and Siegel 2020, configuration factor of a disk to a parallel element",
        check: Check::Analytic(disk_light),
    },
    Law {
        name: "radiometry/sphere-light",
        claim: "A spherical emitter at a distance of three radii gives the irradiance of the closed form at 0, 60, 80, 90 and 95 \
                degrees from the normal.",
        source: "Howell, Mengüç, Daun and Siegel 2020, element to sphere, also where the horizon cuts it",
        check: Check::Analytic(sphere_light),
    },
    Law {
        name: "radiometry/white-environment",
        claim: "Under a constant environment of radiance L, a diffuse plane has the radiance ρ L. The environment itself has L.",
        source: "∫ cos θ dω = π",
        check: Check::Analytic(white_environment),
    },
    Law {
        name: "radiometry/direct-strategies",
        claim: "Direct light has the same mean by emitter sampling, by BSDF sampling, and by both with any numbers of samples.",
        source: "Veach 1997, section 9.2: MIS weights that sum to one",
        check: Check::Analytic(direct_strategies),
    },
];

fn point_light(_: Effort) -> Vec<Finding> {
    let intensity = Rgb::new(3.0, 2.0, 0.5);
    let mut findings = Vec::new();
    for h in [2.0, 5.0, -2.0_f64] {
        let light = format!(
            r#"<emitter type="point"><point name="position" x="0" y="0" z="{h}"/>
               <rgb name="intensity" value="{}"/></emitter>"#,
            triple(intensity)
        );
        let setup = Setup::new(&path(-1, 5), &(light + &ground(ALBEDO)));
        for r in [0.0, 0.5, 1.0, 2.0, 4.0_f64] {
            let irradiance = intensity * (h.max(0.0) / (h * h + r * r).powf(1.5));
            let ray = towards(DVec3::new(0.6 * r, -0.8 * r, 0.0), DVec3::Z);
            findings.extend(setup.compare(&format!("h = {h}, r = {r}"), ray, ALBEDO * FRAC_1_PI * irradiance));
        }
    }
    findings
}

fn directional_light(_: Effort) -> Vec<Finding> {
    let irradiance = Rgb::new(3.0, 2.0, 0.5);
    let mut findings = Vec::new();
    for theta in [0.0, 30.0, 70.0, 120.0_f64] {
        let (sin, cos) = theta.to_radians().sin_cos();
        let light = format!(
            r#"<emitter type="directional"><vector name="direction" x="{}" y="{}" z="{}"/>
               <rgb name="irradiance" value="{}"/></emitter>"#,
            -2.0 * sin * 0.6,
            2.0 * sin * 0.8,
            -2.0 * cos,
            triple(irradiance)
        );
        let setup = Setup::new(&path(-1, 5), &(light + &ground(ALBEDO)));
        let expected = ALBEDO * FRAC_1_PI * irradiance * cos.max(0.0);
        findings.extend(setup.compare(&format!("{theta}°"), towards(DVec3::new(0.3, -0.2, 0.0), DVec3::Z), expected));
    }
    findings
}

/// Tests a small disk lit by one area light, with emitter sampling, BSDF sampling and both.
fn lit_disk(subject: &str, light: &str, (p, n): (DVec3, DVec3), configuration: f64, effort: Effort) -> Vec<Finding> {
    // Few directions hit a light at the horizon.
    let samples = effort.needed_samples(10_000);
    let expected = ALBEDO * FRAC_1_PI * RADIANCE * configuration;
    let strategies = [("lights", direct(1, 0)), ("bsdf", direct(0, 1)), ("path", path(2, 5))];
    let scene = light.to_owned() + &small_disk(p, n, ALBEDO);
    let tests = strategies.iter().flat_map(|(strategy, integrator)| {
        Setup::new(integrator, &scene).test(&format!("{subject}, by {strategy}"), towards(p, n), samples, expected)
    });
    tests.collect()
}

fn polygon_light(effort: Effort) -> Vec<Finding> {
    let light = format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale x="1" y="0.5"/><rotate x="1" angle="180"/>
           <translate z="2"/></transform>{}</shape>"#,
        area(RADIANCE)
    );
    let (below, beside) = (DVec3::ZERO, DVec3::new(1.5, 0.7, 0.0));
    let tilted = DVec3::new(-0.6, 0.0, 0.8);
    let mut findings = Vec::new();
    findings.extend(lit_disk("below", &light, (below, DVec3::Z), 0.415_837_626_5, effort));
    findings.extend(lit_disk("beside", &light, (beside, DVec3::Z), 0.187_764_813_7, effort));
    findings.extend(lit_disk("tilted", &light, (beside, tilted), 0.219_971_275_5, effort));

    // The emitter's back is black and lights nothing.
    let above = DVec3::new(0.2, 0.1, 3.0);
    let scene = light + &small_disk(above, DVec3::NEG_Z, ALBEDO);
    for (strategy, integrator) in [("lights", direct(1, 0)), ("bsdf", direct(0, 1)), ("path", path(-1, 5))] {
        let setup = Setup::new(&integrator, &scene);
        let (origin, direction) = towards(above, DVec3::NEG_Z);
        let lit: f64 = setup.many(origin, direction, 1000, 32).iter().map(|m| m.mean).sum();
        findings.push(Finding::error(format!("above, by {strategy}"), lit, 0.0));
        let back = setup.once(DVec3::new(0.2, 0.3, 2.5), DVec3::NEG_Z, 33).max_element();
        findings.push(Finding::error(format!("its back, by {strategy}"), back, 0.0));
        findings.extend(setup.compare(
            &format!("its front, by {strategy}"),
            (DVec3::new(0.2, 0.3, 0.0), DVec3::Z),
            RADIANCE,
        ));
    }
    findings
}

fn disk_light(effort: Effort) -> Vec<Finding> {
    let light = format!(
        r#"<shape type="disk"><transform name="to_world"><rotate x="1" angle="180"/><translate z="2"/></transform>{}</shape>"#,
        area(RADIANCE)
    );
    let configuration = |r: f64| {
        let (a2, h2, r2) = (1.0, 4.0, r * r);
        0.5 * PI * (1.0 - (h2 + r2 - a2) / ((h2 + r2 + a2).powi(2) - 4.0 * a2 * r2).sqrt())
    };
    let table = [
        (0.0, 0.628_318_530_7),
        (0.5, 0.580_263_747_6),
        (1.0, 0.460_075_592_3),
        (2.0, 0.206_963_188_4),
        (4.0, 0.033_693_919),
    ];
    let mut findings = Vec::new();
    for (r, number) in table {
        findings.push(Finding::value(format!("r = {r}, the closed form"), configuration(r), number, 1e-9));
        let p = DVec3::new(0.6 * r, 0.8 * r, 0.0);
        findings.extend(lit_disk(&format!("r = {r}"), &light, (p, DVec3::Z), configuration(r), effort));
    }
    findings
}

fn sphere_light(effort: Effort) -> Vec<Finding> {
    let table = [
        (0.0, 0.349_065_850),
        (60.0, 0.174_532_925),
        (80.0, 0.065_221_843),
        (90.0, 0.025_567_229),
        (95.0, 0.012_735_207),
    ];
    let mut findings = Vec::new();
    for (theta, configuration) in table {
        let (sin, cos) = f64::to_radians(theta).sin_cos();
        // The distance is three radii. The radius is not 1.
        let centre = 1.5 * DVec3::new(0.6 * sin, 0.8 * sin, cos);
        let light = format!(
            r#"<shape type="sphere"><point name="center" x="{}" y="{}" z="{}"/><float name="radius" value="0.5"/>{}</shape>"#,
            centre.x,
            centre.y,
            centre.z,
            area(RADIANCE)
        );
        findings.extend(lit_disk(&format!("{theta}°"), &light, (DVec3::ZERO, DVec3::Z), configuration, effort));
    }
    findings
}

fn white_environment(effort: Effort) -> Vec<Finding> {
    // The albedo is given by a constant texture.
    let texture = format!(
        r#"<texture type="rawconstant" name="reflectance"><rgb name="value" value="{}"/></texture>"#,
        triple(ALBEDO)
    );
    let plane = format!(r#"<shape type="rectangle"><bsdf type="diffuse">{texture}</bsdf></shape>"#);
    let scene = environment(RADIANCE) + &plane;
    let mut findings = Vec::new();
    for (strategy, integrator) in [("lights", direct(1, 0)), ("bsdf", direct(0, 1)), ("path", path(-1, 5))] {
        let setup = Setup::new(&integrator, &scene);
        let ray = towards(DVec3::ZERO, DVec3::Z);
        // Cosine-weighted BSDF sampling has no variance here: every sample returns the same radiance.
        findings.extend(match strategy {
            "bsdf" => setup.compare("by bsdf", ray, ALBEDO * RADIANCE),
            _ => setup.test(&format!("by {strategy}"), ray, effort.samples(20_000), ALBEDO * RADIANCE),
        });
        findings.extend(setup.compare(
            &format!("the environment, by {strategy}"),
            (DVec3::Z, DVec3::new(0.2, 0.3, 0.5)),
            RADIANCE,
        ));
    }
    findings
}

fn direct_strategies(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(30_000);
    let metal = r#"<bsdf type="twosided"><bsdf type="roughconductor"><string name="material" value="Au"/>
        <float name="alpha" value="0.25"/></bsdf></bsdf>"#;
    let lights = format!(
        r#"{}<shape type="sphere"><point name="center" x="0.4" y="1.2" z="1.5"/><float name="radius" value="0.5"/>{}</shape>
           <shape type="rectangle"><transform name="to_world"><scale x="0.8" y="0.4"/><rotate y="1" angle="130"/>
           <translate x="-1.5" y="0.2" z="1"/></transform>{}</shape>"#,
        environment(Rgb::new(0.2, 0.3, 0.4)),
        area(RADIANCE),
        area(Rgb::new(6.0, 3.0, 1.0))
    );
    let plane = r#"<transform name="to_world"><scale value="3"/></transform>"#;
    let mut findings = Vec::new();
    for (name, bsdf) in [("metal", metal.to_owned()), ("paint", diffuse(ALBEDO))] {
        let scene = format!(r#"{lights}<shape type="rectangle">{plane}{bsdf}</shape>"#);
        let ray = (DVec3::new(0.5, -2.0, 1.5), DVec3::new(-0.4, 2.0, -1.5));
        let of = |integrator: String, seed| Setup::new(&integrator, &scene).many(ray.0, ray.1, samples, seed);
        let by_lights = of(direct(1, 0), 34);
        let others = [
            ("bsdf", of(direct(0, 1), 35)),
            ("one of each", of(direct(1, 1), 36)),
            ("three and one", of(direct(3, 1), 37)),
            ("one and four", of(direct(1, 4), 38)),
            ("path", of(path(2, 5), 39)),
        ];
        for (strategy, found) in others {
            for i in 0..3 {
                let subject = format!("{name}: lights and {strategy}, {}", CHANNELS[i]);
                findings.push(Finding::equal_means(subject, &by_lights[i], &found[i]));
            }
        }
    }
    findings
}
