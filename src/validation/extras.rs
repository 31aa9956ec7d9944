//! What goes beyond Mitsuba: infinite planes, surfaces that show colours by themselves, shadows that let light through;
//! and the cone of a spot light.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::{
    bsdf::fresnel,
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    validation::setup::{ALBEDO, GLASS, RADIANCE, Setup, diffuse, direct, ground, patch, path, sky, towards, triple},
};

/// These laws.
pub const LAWS: &[Law] = &[
    Law {
        name: "radiometry/plane",
        claim: "A point light I over an infinite plane gives it the radiance ρ/π I h / d³ at five distances, and nothing behind it.",
        source: "inverse square and cosine laws",
        check: Check::Analytic(plane),
    },
    Law {
        name: "radiometry/spot",
        claim: "A spot light is full up to its target width, falls off linearly with the angle, and ends at its cutoff angle.",
        source: "Mitsuba's definition; inverse square and cosine laws",
        check: Check::Analytic(spot),
    },
    Law {
        name: "radiometry/self_emission",
        claim: "The normals bsdf shows (n + 1) / 2 from both sides, Phong's ambient adds to what is reflected, and mirrors show both.",
        source: "definition",
        check: Check::Analytic(self_emission),
    },
    Law {
        name: "radiometry/blend",
        claim: "In an even sky L, a ball that is 1 - w diffuse ρ and w a mirror s shows ((1 - w) ρ + w s) L; with glass of \
                index n, s is 0.04 + 0.96 / n² at normal incidence.",
        source: "linearity of the reflection in the bsdf; conservation of étendue",
        check: Check::Analytic(blend),
    },
    Law {
        name: "radiometry/transparent-shadows",
        claim: "With transparent shadows, a pane between a surface and a light lets (1 - R(θ))² of it through, and all with \
                the reflectance model none; light is not found a second time on bent paths; other shadows stay black.",
        source: "definition; an even sky stays even, for what is not let through straight is mirrored",
        check: Check::Analytic(transparent_shadows),
    },
];

fn point_light(p: DVec3, intensity: Rgb) -> String {
    let DVec3 { x, y, z } = p;
    format!(
        r#"<emitter type="point"><point name="position" x="{x}" y="{y}" z="{z}"/><rgb name="intensity" value="{}"/></emitter>"#,
        triple(intensity)
    )
}

const INTENSITY: Rgb = Rgb::new(3.0, 2.0, 0.5);

fn plane(_: Effort) -> Vec<Finding> {
    // Tilted and moved: the place on the plane below the light, two directions on it, and its normal.
    let to_world =
        r#"<transform name="to_world"><rotate x="1" angle="30"/><translate x="0.5" y="-1" z="2"/></transform>"#;
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    let (foot, along, up) = (DVec3::new(0.5, -1.0, 2.0), DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos));
    let shape = format!(r#"<shape type="plane">{to_world}{}</shape>"#, diffuse(ALBEDO));
    let mut findings = Vec::new();
    for h in [2.0, -2.0_f64] {
        let setup = Setup::new(&path(-1, 5), &(shape.clone() + &point_light(foot + h * up, INTENSITY)));
        for r in [0.0, 1.0, 4.0, 50.0, 1000.0_f64] {
            let irradiance = INTENSITY * (h.max(0.0) / (h * h + r * r).powf(1.5));
            let p = foot + r * (0.6 * DVec3::X - 0.8 * along);
            let ray = (p + 0.1 * up + 0.04 * DVec3::X, -0.1 * up - 0.04 * DVec3::X);
            findings.extend(setup.compare(&format!("h = {h}, r = {r}"), ray, ALBEDO * FRAC_1_PI * irradiance));
        }
    }
    findings
}

fn spot(_: Effort) -> Vec<Finding> {
    let h = 2.5;
    let light = format!(
        r#"<emitter type="spot"><rgb name="intensity" value="{}"/><float name="cutoff_angle" value="30"/>
           <float name="beam_width" value="20"/><transform name="to_world"><lookat origin="0, 0, {h}" target="0, 0, 0" up="1, 0, 0"/>
           </transform></emitter>"#,
        triple(INTENSITY)
    );
    let setup = Setup::new(&path(-1, 5), &(light + &ground(ALBEDO)));
    let mut findings = Vec::new();
    for (degrees, share) in [(0.0, 1.0), (10.0, 1.0), (19.9, 1.0), (22.5, 0.75), (27.0, 0.3), (30.1, 0.0), (60.0, 0.0)]
    {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let r = h * sin / cos;
        let irradiance = INTENSITY * (share * cos.powi(3) / (h * h));
        let ray = towards(DVec3::new(0.6 * r, -0.8 * r, 0.0), DVec3::Z);
        findings.extend(setup.compare(&format!("{degrees}°"), ray, ALBEDO * FRAC_1_PI * irradiance));
    }
    findings
}

fn self_emission(_: Effort) -> Vec<Finding> {
    let down = (DVec3::new(0.1, 0.2, 3.0), -DVec3::Z);
    let mut findings = Vec::new();
    let ball = Setup::new(&path(-1, 5), r#"<shape type="sphere"><bsdf type="normals"/></shape>"#);
    let n = DVec3::new(0.1, 0.2, 0.95_f64.sqrt());
    findings.extend(ball.compare("normals", down, 0.5 * (n + 1.0)));
    // From within, at the lower side.
    let within = (DVec3::new(0.1, 0.2, 0.0), -DVec3::Z);
    let below = DVec3::new(n.x, n.y, -n.z);
    findings.extend(ball.compare("normals, from behind", within, 0.5 * (below + 1.0)));
    let mirror = r#"<shape type="rectangle"><transform name="to_world"><scale value="9"/><translate z="-1"/></transform>
        <bsdf type="conductor"><rgb name="specular_reflectance" value="0.9, 0.6, 0.3"/></bsdf></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="9"/><rotate x="1" angle="180"/><translate z="4"/></transform>
        <bsdf type="normals"/></shape>"#;
    let expected = Rgb::new(0.9, 0.6, 0.3) * Rgb::new(0.5, 0.5, 0.0);
    findings.extend(Setup::new(&path(-1, 5), mirror).compare("normals, in a mirror", down, expected));
    let ambient = Rgb::new(0.3, 0.1, 0.2);
    let phong = format!(
        r#"<shape type="plane"><bsdf type="phong"><rgb name="diffuse_reflectance" value="{}"/>
           <float name="specular_reflectance" value="0"/><rgb name="ambient" value="{}"/></bsdf></shape>{}"#,
        triple(ALBEDO),
        triple(ambient),
        point_light(DVec3::new(0.1, 0.2, 2.0), INTENSITY)
    );
    let expected = ambient + ALBEDO * FRAC_1_PI * INTENSITY / 4.0;
    for (name, integrator) in [("path", path(-1, 5)), ("direct", direct(1, 1))] {
        // The light itself is no surface, so that the ray passes it.
        findings.extend(Setup::new(&integrator, &phong).compare(&format!("ambient, {name}"), down, expected));
    }
    findings
}

fn blend(effort: Effort) -> Vec<Finding> {
    let share = 0.35;
    let mirror = Rgb::new(0.9, 0.6, 0.3);
    let conductor =
        format!(r#"<bsdf type="conductor"><rgb name="specular_reflectance" value="{}"/></bsdf>"#, triple(mirror));
    let mut findings = Vec::new();
    for (name, other, reflectance) in
        [("mirror", conductor.as_str(), mirror), ("glass", GLASS, Rgb::splat(0.04 + 0.96 / 2.25))]
    {
        let bsdf = format!(
            r#"<bsdf type="blendbsdf"><float name="weight" value="{share}"/>{}{other}</bsdf>"#,
            diffuse(ALBEDO)
        );
        // Half of space is glass, under which the sky is as bright: seen from outside, 1/n² of that.
        let shape = if name == "glass" { r#"<shape type="plane">"# } else { r#"<shape type="sphere">"# };
        let setup = Setup::new(&path(-1, 5), &format!("{}{shape}{bsdf}</shape>", sky(RADIANCE)));
        let ray = (DVec3::new(0.3, 0.2, 3.0), -DVec3::Z);
        let expected = ((1.0 - share) * ALBEDO + share * reflectance) * RADIANCE;
        findings.extend(setup.test(name, ray, effort.samples(20_000), expected));
    }
    findings
}

/// A pane at some height over the ground.
fn pane(bsdf: &str) -> String {
    let to_world = r#"<transform name="to_world"><scale x="1000" y="1000" z="0.1"/><translate z="0.7"/></transform>"#;
    format!(r#"<shape type="cube">{to_world}{bsdf}</shape>"#)
}

fn transparent(integrator: &str) -> String {
    integrator.replace("</integrator>", r#"<boolean name="transparent_shadows" value="true"/></integrator>"#)
}

fn transparent_shadows(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    let none = GLASS
        .replace(r#"type="dielectric""#, r#"type="schlick""#)
        .replace("</bsdf>", r#"<string name="reflectance_model" value="none"/></bsdf>"#);
    let h = 2.5;
    let light = point_light(DVec3::new(0.0, 0.0, h), INTENSITY);
    let opaque = r#"<bsdf type="diffuse"/>"#;
    for (name, bsdf) in [("glass", GLASS), ("none", &none), ("opaque", opaque)] {
        for (way, integrator) in [("path", path(2, 5)), ("direct", direct(1, 1))] {
            let setup = Setup::new(&transparent(&integrator), &(light.clone() + &ground(ALBEDO) + &pane(bsdf)));
            for degrees in [0.0, 45.0, 75.0_f64] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let share = match name {
                    "glass" => (1.0 - fresnel::dielectric(cos, 1.5).reflectance).powi(2),
                    "none" => 1.0,
                    _ => 0.0,
                };
                let r = h * sin / cos;
                let irradiance = INTENSITY * (share * cos.powi(3) / (h * h));
                let ray = towards(DVec3::new(0.6 * r, -0.8 * r, 0.0), DVec3::Z);
                let expected = ALBEDO * FRAC_1_PI * irradiance;
                findings.extend(setup.compare(&format!("{name}, {way}, {degrees}°"), ray, expected));
            }
        }
    }
    findings.extend(under_the_sky(effort));
    findings
}

/// A patch so small that nothing which it sends up comes back to it, in a sky that is even above and below: what the
/// pane does not let through it mirrors.
fn under_the_sky(effort: Effort) -> Vec<Finding> {
    let scene = sky(RADIANCE) + &patch(DVec3::ZERO, DVec3::Z, ALBEDO) + &pane(GLASS);
    let setup = Setup::new(&transparent(&path(-1, 5)), &scene);
    let ray = towards(DVec3::ZERO, DVec3::Z);
    setup.test("an even sky, any depth", ray, effort.samples(20_000), ALBEDO * RADIANCE)
}
