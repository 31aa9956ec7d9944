//! Laws of features that Mitsuba lacks (infinite planes, self-emission of BSDFs, transparent shadows), and of the spot
//! light's cone.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::{
    bsdf::fresnel,
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    validation::setup::{
        ALBEDO, GLASS, RADIANCE, Setup, diffuse, direct, environment, ground, path, small_disk, towards, triple,
    },
};

/// The laws of extensions to Mitsuba and of the spot light.
pub const LAWS: &[Law] = &[
    Law {
        name: "radiometry/plane",
        claim: "A point light of intensity I at the height h over an infinite plane gives it the radiance ρ/π I h / d³ at five \
                distances. A light behind the plane gives none.",
        source: "inverse square and cosine laws",
        check: Check::Analytic(plane),
    },
    Law {
        name: "radiometry/spot",
        claim: "A spot light has its full intensity up to its beam width, falls off linearly with the angle, and ends at its cutoff angle.",
        source: "Mitsuba's definition; inverse square and cosine laws",
        check: Check::Analytic(spot),
    },
    Law {
        name: "radiometry/self-emission",
        claim: "The normals BSDF emits (n + 1) / 2 from both sides, Phong's ambient term is added to the reflected light, and mirrors show \
                both.",
        source: "definition of the two BSDFs",
        check: Check::Analytic(self_emission),
    },
    Law {
        name: "radiometry/blend",
        claim: "In a constant environment of radiance L, a sphere with a blend of a diffuse BSDF (albedo ρ, weight 1 - w) and a mirror \
                (reflectance s, weight w) has the radiance ((1 - w) ρ + w s) L. With glass of index n instead of the mirror, s is \
                0.04 + 0.96 / n² at normal incidence.",
        source: "linearity of reflection in the BSDF; conservation of étendue",
        check: Check::Analytic(blend),
    },
    Law {
        name: "radiometry/transparent-shadows",
        claim: "With transparent shadows, a pane between a surface and a light transmits (1 - R(θ))², or everything with the \
                reflectance model none. Refracted paths do not add the same light again. Shadows of opaque objects stay black.",
        source: "definition; a constant environment stays constant, because the pane mirrors what it does not transmit",
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
    // The plane is tilted and moved. `foot` is the point below the light, `up` the normal, `along` a tangent.
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
    for (degrees, falloff) in
        [(0.0, 1.0), (10.0, 1.0), (19.9, 1.0), (22.5, 0.75), (27.0, 0.3), (30.1, 0.0), (60.0, 0.0)]
    {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let r = h * sin / cos;
        let irradiance = INTENSITY * (falloff * cos.powi(3) / (h * h));
        let ray = towards(DVec3::new(0.6 * r, -0.8 * r, 0.0), DVec3::Z);
        findings.extend(setup.compare(&format!("{degrees}°"), ray, ALBEDO * FRAC_1_PI * irradiance));
    }
    findings
}

fn self_emission(_: Effort) -> Vec<Finding> {
    let down = (DVec3::new(0.1, 0.2, 3.0), -DVec3::Z);
    let mut findings = Vec::new();
    let sphere = Setup::new(&path(-1, 5), r#"<shape type="sphere"><bsdf type="normals"/></shape>"#);
    let n = DVec3::new(0.1, 0.2, 0.95_f64.sqrt());
    findings.extend(sphere.compare("normals", down, 0.5 * (n + 1.0)));
    // The camera is inside and looks at the lower hemisphere.
    let within = (DVec3::new(0.1, 0.2, 0.0), -DVec3::Z);
    let below = DVec3::new(n.x, n.y, -n.z);
    findings.extend(sphere.compare("normals, from behind", within, 0.5 * (below + 1.0)));
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
        // A point light is not a surface, so the camera ray passes it.
        findings.extend(Setup::new(&integrator, &phong).compare(&format!("ambient, {name}"), down, expected));
    }
    findings
}

fn blend(effort: Effort) -> Vec<Finding> {
    let weight = 0.35;
    let mirror = Rgb::new(0.9, 0.6, 0.3);
    let conductor =
        format!(r#"<bsdf type="conductor"><rgb name="specular_reflectance" value="{}"/></bsdf>"#, triple(mirror));
    let mut findings = Vec::new();
    for (name, other, reflectance) in
        [("mirror", conductor.as_str(), mirror), ("glass", GLASS, Rgb::splat(0.04 + 0.96 / 2.25))]
    {
        let bsdf = format!(
            r#"<bsdf type="blendbsdf"><float name="weight" value="{weight}"/>{}{other}</bsdf>"#,
            diffuse(ALBEDO)
        );
        // Glass fills the half-space below the plane. Transmitted radiance scales with 1/n² on the way out.
        let shape = if name == "glass" { r#"<shape type="plane">"# } else { r#"<shape type="sphere">"# };
        let setup = Setup::new(&path(-1, 5), &format!("{}{shape}{bsdf}</shape>", environment(RADIANCE)));
        let ray = (DVec3::new(0.3, 0.2, 3.0), -DVec3::Z);
        let expected = ((1.0 - weight) * ALBEDO + weight * reflectance) * RADIANCE;
        findings.extend(setup.test(name, ray, effort.samples(20_000), expected));
    }
    findings
}

/// A pane of thickness 0.2 with its centre 0.7 above the ground.
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
        for (method, integrator) in [("path", path(2, 5)), ("direct", direct(1, 1))] {
            let setup = Setup::new(&transparent(&integrator), &(light.clone() + &ground(ALBEDO) + &pane(bsdf)));
            for degrees in [0.0, 45.0, 75.0_f64] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let transmittance = match name {
                    "glass" => (1.0 - fresnel::dielectric(cos, 1.5).reflectance).powi(2),
                    "none" => 1.0,
                    _ => 0.0,
                };
                let r = h * sin / cos;
                let irradiance = INTENSITY * (transmittance * cos.powi(3) / (h * h));
                let ray = towards(DVec3::new(0.6 * r, -0.8 * r, 0.0), DVec3::Z);
                let expected = ALBEDO * FRAC_1_PI * irradiance;
                findings.extend(setup.compare(&format!("{name}, {method}, {degrees}°"), ray, expected));
            }
        }
    }
    findings.extend(under_environment(effort));
    findings
}

/// A disk under a pane in a constant environment. The disk is too small to receive its own reflected light, and the
/// pane mirrors whatever it does not transmit, so the disk's irradiance is that without a pane.
fn under_environment(effort: Effort) -> Vec<Finding> {
    let scene = environment(RADIANCE) + &small_disk(DVec3::ZERO, DVec3::Z, ALBEDO) + &pane(GLASS);
    let setup = Setup::new(&transparent(&path(-1, 5)), &scene);
    let ray = towards(DVec3::ZERO, DVec3::Z);
    setup.test("constant environment, any depth", ray, effort.samples(20_000), ALBEDO * RADIANCE)
}
