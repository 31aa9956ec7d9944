//! What the integrators must find in scenes whose answer is known in closed form.
//!
//! No scene has a radius, an albedo or an angle that hides a factor: no unit distances, no equal channels, no light
//! that stands straight above.

use std::f64::consts::{FRAC_1_PI, PI};
use std::path::Path;

use glam::DVec3;

use super::{Integrator, Model as _, Overrides};
use crate::{
    bsdf::fresnel,
    law::{Effort, Finding, Law},
    math::{Ray, Rgb, rng::Stream},
    node::xml,
    sampler::PathNumbers,
    scene::Scene,
    stats::Moments,
};

/// The laws of radiometry, refraction and of how paths end.
pub const LAWS: &[Law] = &[
    Law {
        name: "radiometry/point-light",
        claim: "A point light I gives a diffuse plane the radiance ρ/π I cos θ / d², at two heights and five places.",
        source: "inverse square and cosine laws",
        check: point_light,
    },
    Law {
        name: "radiometry/directional-light",
        claim: "Parallel light E gives a diffuse surface the radiance ρ/π E cos θ, and none from behind.",
        source: "cosine law",
        check: directional_light,
    },
    Law {
        name: "radiometry/polygon-light",
        claim: "A 2 by 1 rectangle gives the irradiance of Lambert's formula, also across its horizon; its back is black.",
        source: "Lambert 1760; E/L = ½ |Σ Θi Γi·n|: 0.4158376265, 0.1877648137, 0.2199712755",
        check: polygon_light,
    },
    Law {
        name: "radiometry/disk-light",
        claim: "A disk of radius 1 at height 2 gives the irradiance of the closed form at five distances from its axis.",
        source: "Howell, Mengüç, Daun and Siegel 2020, configuration factor of a disk to a parallel element",
        check: disk_light,
    },
    Law {
        name: "radiometry/sphere-light",
        claim: "A sphere at three radii gives the irradiance of the closed form at 0, 60, 80, 90 and 95 degrees from the normal.",
        source: "Howell, Mengüç, Daun and Siegel 2020, element to sphere, with the horizon across it",
        check: sphere_light,
    },
    Law {
        name: "radiometry/white-sky",
        claim: "Under an even sky L a diffuse plane has the radiance ρ L, and the sky itself L.",
        source: "∫ cos θ dω = π",
        check: white_sky,
    },
    Law {
        name: "radiometry/furnace",
        claim: "In a closed sphere and a closed cube that shine with E and reflect ρ, the radiance is E (1 + ρ + ... ) up to \
                the greatest depth, and without one E / (1 - ρ).",
        source: "geometric series",
        check: furnace,
    },
    Law {
        name: "radiometry/integrating-sphere",
        claim: "A point light off the centre of a diffuse sphere: ρ/π (I cos θ / d² + I ρ / (R² (1 - ρ))) at four angles.",
        source: "indirect light in a diffuse sphere is uniform; Jacquez and Kuppenheim 1955",
        check: integrating_sphere,
    },
    Law {
        name: "radiometry/colour-bleeding",
        claim: "A shining hemisphere over a coloured disk has the radiosities of the exact two-patch solution.",
        source: "form factors 1, ½, ½ of a hemisphere and its base",
        check: colour_bleeding,
    },
    Law {
        name: "radiometry/concentric-spheres",
        claim: "Between concentric spheres of radii 1 and 2, of which the inner shines, radiosities are those of two patches.",
        source: "form factors 1, ¼, ¾",
        check: concentric_spheres,
    },
    Law {
        name: "radiometry/direct-strategies",
        claim: "Direct light is the same by samples of lights, of the bsdf, and both together in any numbers.",
        source: "Veach 1997, section 9.2: weights that sum to one",
        check: direct_strategies,
    },
    Law {
        name: "fresnel/slab",
        claim: "A slab of index 1.5 lets (1 - R) / (1 + R) through, after one and two passes (1 - R)² and (1 - R)² (1 + R²), and \
                is invisible in an even sky.",
        source: "geometric series of unpolarised reflections; 0.92307692, 0.90432679, 0.83623246, 0.59609205",
        check: slab,
    },
    Law {
        name: "fresnel/etendue",
        claim: "Inside glass of index n, radiance that came in is n² times as great: n² L in an even sky, n² L / (1 + R) through a \
                slab lit from one side, π (1 - 0.09177796) L on a surface within, and \
                beyond the critical angle nothing but what is in the glass.",
        source: "conservation of étendue n² A Ω; Veach 1997, section 5.2",
        check: etendue,
    },
    Law {
        name: "transport/roulette",
        claim: "Russian roulette from the first bounce on does not change the mean.",
        source: "Arvo and Kirk 1990",
        check: roulette,
    },
    Law {
        name: "transport/max-depth",
        claim: "A greatest depth of 0 is black, 1 shows lights, and every further one adds one reflection.",
        source: "Mitsuba's definition",
        check: max_depth,
    },
];

/// A scene with an integrator.
struct Setup {
    scene: Scene,
    integrator: Integrator,
}

impl Setup {
    fn new(integrator: &str, scene: &str) -> Self {
        let sensor = r#"<sensor type="perspective"><film type="hdrfilm"/></sensor>"#;
        let text = format!(r#"<scene version="3.0.0">{integrator}{sensor}{scene}</scene>"#);
        let document = xml::parse(&text, "law", Path::new(""), &[]).expect("the scene is valid XML");
        let scene = Scene::build(&document).expect("the scene is valid");
        Self {
            scene,
            integrator: Integrator::of_scene(&document, &Overrides::default()).expect("the integrator is valid"),
        }
    }

    /// One estimate of the radiance that comes from a point against a direction.
    fn once(&self, origin: DVec3, direction: DVec3, address: &[u64]) -> Rgb {
        let mut numbers = PathNumbers::Independent(Stream::at(address));
        self.integrator.radiance(&self.scene, &Ray::new(origin, direction.normalize()), &mut numbers, &mut [])
    }

    /// Many of them, by channel.
    fn many(&self, origin: DVec3, direction: DVec3, samples: u32, seed: u64) -> [Moments; 3] {
        let mut moments = [Moments::default(); 3];
        for i in 0..samples {
            let radiance = self.once(origin, direction, &[seed, u64::from(i)]);
            moments.iter_mut().zip(radiance.to_array()).for_each(|(moments, x)| moments.push(x));
        }
        moments
    }

    /// Tests the radiance of each channel.
    fn test(&self, subject: &str, (origin, direction): (DVec3, DVec3), samples: u32, expected: Rgb) -> Vec<Finding> {
        let found = self.many(origin, direction, samples, 31);
        (0..3).map(|i| Finding::mean(format!("{subject}, {}", CHANNELS[i]), &found[i], expected[i])).collect()
    }

    /// Compares the radiance of each channel where it has no variance, relative to the expectation.
    fn compare(&self, subject: &str, (origin, direction): (DVec3, DVec3), expected: Rgb) -> Vec<Finding> {
        let found = self.once(origin, direction, &[30]);
        let bound = |i: usize| 1e-9 * expected[i];
        (0..3).map(|i| Finding::value(format!("{subject}, {}", CHANNELS[i]), found[i], expected[i], bound(i))).collect()
    }
}

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

fn path(max_depth: i32, rr_depth: u32) -> String {
    format!(
        r#"<integrator type="path"><integer name="max_depth" value="{max_depth}"/>
           <integer name="rr_depth" value="{rr_depth}"/></integrator>"#
    )
}

fn direct(emitter_samples: u32, bsdf_samples: u32) -> String {
    format!(
        r#"<integrator type="direct"><integer name="emitter_samples" value="{emitter_samples}"/>
           <integer name="bsdf_samples" value="{bsdf_samples}"/></integrator>"#
    )
}

fn diffuse(albedo: Rgb) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{}"/></bsdf>"#, triple(albedo))
}

fn area(radiance: Rgb) -> String {
    format!(r#"<emitter type="area"><rgb name="radiance" value="{}"/></emitter>"#, triple(radiance))
}

fn triple(v: DVec3) -> String {
    format!("{}, {}, {}", v.x, v.y, v.z)
}

/// A plane `z = 0` that is large enough.
fn ground(albedo: Rgb) -> String {
    let scale = r#"<transform name="to_world"><scale value="100"/></transform>"#;
    format!(r#"<shape type="rectangle">{scale}{}</shape>"#, diffuse(albedo))
}

/// A small disk with a normal.
fn patch(p: DVec3, n: DVec3, albedo: Rgb) -> String {
    let (target, up) = (triple(p + n), triple(n.any_orthonormal_vector()));
    format!(
        r#"<shape type="disk"><transform name="to_world"><scale value="0.001"/>
           <lookat origin="{}" target="{target}" up="{up}"/></transform>{}</shape>"#,
        triple(p),
        diffuse(albedo)
    )
}

/// A ray to a point from its front, obliquely.
fn towards(p: DVec3, n: DVec3) -> (DVec3, DVec3) {
    let origin = p + 0.1 * n + 0.04 * n.any_orthonormal_vector();
    (origin, p - origin)
}

const ALBEDO: Rgb = Rgb::new(0.8, 0.5, 0.2);
const RADIANCE: Rgb = Rgb::new(0.7, 2.0, 5.0);

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

/// One area light and a patch, by every way of finding the light.
fn lit_patch(subject: &str, light: &str, (p, n): (DVec3, DVec3), configuration: f64, effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(10_000);
    let expected = ALBEDO * FRAC_1_PI * RADIANCE * configuration;
    let ways = [("lights", direct(1, 0)), ("bsdf", direct(0, 1)), ("path", path(2, 5))];
    let scene = light.to_owned() + &patch(p, n, ALBEDO);
    let tests = ways.iter().flat_map(|(way, integrator)| {
        Setup::new(integrator, &scene).test(&format!("{subject}, by {way}"), towards(p, n), samples, expected)
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
    findings.extend(lit_patch("below", &light, (below, DVec3::Z), 0.415_837_626_5, effort));
    findings.extend(lit_patch("beside", &light, (beside, DVec3::Z), 0.187_764_813_7, effort));
    findings.extend(lit_patch("tilted", &light, (beside, tilted), 0.219_971_275_5, effort));

    // Behind the light there is none, to see or to be lit by.
    let above = DVec3::new(0.2, 0.1, 3.0);
    let scene = light + &patch(above, DVec3::NEG_Z, ALBEDO);
    for (way, integrator) in [("lights", direct(1, 0)), ("bsdf", direct(0, 1)), ("path", path(-1, 5))] {
        let setup = Setup::new(&integrator, &scene);
        let (origin, direction) = towards(above, DVec3::NEG_Z);
        let lit: f64 = setup.many(origin, direction, 1000, 32).iter().map(|m| m.mean).sum();
        findings.push(Finding::error(format!("above, by {way}"), lit, 0.0));
        let back = setup.once(DVec3::new(0.2, 0.3, 2.5), DVec3::NEG_Z, &[33]).max_element();
        findings.push(Finding::error(format!("its back, by {way}"), back, 0.0));
        findings.extend(setup.compare(
            &format!("its front, by {way}"),
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
    let numbers = [
        (0.0, 0.628_318_530_7),
        (0.5, 0.580_263_747_6),
        (1.0, 0.460_075_592_3),
        (2.0, 0.206_963_188_4),
        (4.0, 0.033_693_919),
    ];
    let mut findings = Vec::new();
    for (r, number) in numbers {
        findings.push(Finding::value(format!("r = {r}, the closed form"), configuration(r), number, 1e-9));
        let p = DVec3::new(0.6 * r, 0.8 * r, 0.0);
        findings.extend(lit_patch(&format!("r = {r}"), &light, (p, DVec3::Z), configuration(r), effort));
    }
    findings
}

fn sphere_light(effort: Effort) -> Vec<Finding> {
    let numbers = [
        (0.0, 0.349_065_850),
        (60.0, 0.174_532_925),
        (80.0, 0.065_221_843),
        (90.0, 0.025_567_229),
        (95.0, 0.012_735_207),
    ];
    let mut findings = Vec::new();
    for (theta, configuration) in numbers {
        let (sin, cos) = f64::to_radians(theta).sin_cos();
        // Three radii away, and the radius is not 1.
        let centre = 1.5 * DVec3::new(0.6 * sin, 0.8 * sin, cos);
        let light = format!(
            r#"<shape type="sphere"><point name="center" x="{}" y="{}" z="{}"/><float name="radius" value="0.5"/>{}</shape>"#,
            centre.x,
            centre.y,
            centre.z,
            area(RADIANCE)
        );
        findings.extend(lit_patch(&format!("{theta}°"), &light, (DVec3::ZERO, DVec3::Z), configuration, effort));
    }
    findings
}

fn sky(radiance: Rgb) -> String {
    format!(r#"<emitter type="constant"><rgb name="radiance" value="{}"/></emitter>"#, triple(radiance))
}

fn white_sky(effort: Effort) -> Vec<Finding> {
    // The albedo as a texture of one colour.
    let texture = format!(
        r#"<texture type="rawconstant" name="reflectance"><rgb name="value" value="{}"/></texture>"#,
        triple(ALBEDO)
    );
    let plane = format!(r#"<shape type="rectangle"><bsdf type="diffuse">{texture}</bsdf></shape>"#);
    let scene = sky(RADIANCE) + &plane;
    let mut findings = Vec::new();
    for (way, integrator) in [("lights", direct(1, 0)), ("bsdf", direct(0, 1)), ("path", path(-1, 5))] {
        let setup = Setup::new(&integrator, &scene);
        let ray = towards(DVec3::ZERO, DVec3::Z);
        // Cosine-weighted directions meet the same light in every sample.
        findings.extend(match way {
            "bsdf" => setup.compare("by bsdf", ray, ALBEDO * RADIANCE),
            _ => setup.test(&format!("by {way}"), ray, effort.samples(20_000), ALBEDO * RADIANCE),
        });
        findings.extend(setup.compare(&format!("the sky, by {way}"), (DVec3::Z, DVec3::new(0.2, 0.3, 0.5)), RADIANCE));
    }
    findings
}

/// A closed room of some shape whose walls shine and reflect.
fn room(shape: &str, emission: Rgb, albedo: Rgb) -> String {
    let flip = r#"<boolean name="flip_normals" value="true"/>"#;
    format!(
        r#"<shape type="{shape}"><transform name="to_world"><scale value="1.7"/></transform>{flip}{}{}</shape>"#,
        diffuse(albedo),
        area(emission)
    )
}

/// A ray from inside a room.
const WITHIN: (DVec3, DVec3) = (DVec3::new(0.3, -0.5, 0.2), DVec3::new(0.5, 0.3, -0.8));

/// What a room shows: so many terms of the geometric series, or all.
fn series(emission: Rgb, albedo: Rgb, terms: Option<i32>) -> Rgb {
    let power = |x: f64| terms.map_or(0.0, |terms| x.powi(terms));
    Rgb::from_array(std::array::from_fn(|i| emission[i] * (1.0 - power(albedo[i])) / (1.0 - albedo[i])))
}

fn furnace(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(20_000);
    let mut findings = Vec::new();
    for shape in ["sphere", "cube"] {
        let scene = room(shape, RADIANCE, ALBEDO);
        for depth in [2, 4, 9] {
            let setup = Setup::new(&path(depth, 100), &scene);
            let expected = series(RADIANCE, ALBEDO, Some(depth));
            findings.extend(setup.test(&format!("{shape}, depth {depth}"), WITHIN, samples, expected));
        }
        let setup = Setup::new(&path(-1, 3), &scene);
        findings.extend(setup.test(&format!("{shape}, any depth"), WITHIN, samples, series(RADIANCE, ALBEDO, None)));
    }
    findings
}

fn integrating_sphere(effort: Effort) -> Vec<Finding> {
    const RADIUS: f64 = 2.0;
    let (source, intensity) = (DVec3::Z, Rgb::new(1.0, 3.0, 0.4));
    // Red has the numbers of the table.
    let albedo = Rgb::new(0.5, 0.8, 0.2);
    let scene = format!(
        r#"<shape type="sphere"><float name="radius" value="{RADIUS}"/><boolean name="flip_normals" value="true"/>{}</shape>
           <emitter type="point"><point name="position" x="0" y="0" z="1"/><rgb name="intensity" value="{}"/></emitter>"#,
        diffuse(albedo),
        triple(intensity)
    );
    let setup = Setup::new(&path(-1, 5), &scene);
    let numbers = [(0.0, 0.198_943_679), (60.0, 0.085_732_810), (90.0, 0.068_259_238), (180.0, 0.057_472_618)];
    let mut findings = Vec::new();
    for (alpha, number) in numbers {
        let (sin, cos) = f64::to_radians(alpha).sin_cos();
        let outwards = DVec3::new(0.6 * sin, 0.8 * sin, cos);
        let way = source - RADIUS * outwards;
        let straight = way.normalize().dot(-outwards) / way.length_squared();
        let scattered = albedo / (RADIUS * RADIUS * (Rgb::ONE - albedo));
        let expected = albedo * FRAC_1_PI * intensity * (straight + scattered);
        findings.push(Finding::value(format!("{alpha}°, the closed form"), expected.x, number, 1e-9));
        let ray = towards(RADIUS * outwards, -outwards);
        findings.extend(setup.test(&format!("{alpha}°"), ray, effort.samples(10_000), expected));
    }
    findings
}

fn colour_bleeding(effort: Effort) -> Vec<Finding> {
    let (shine, above, below) = (1.0, 0.5, Rgb::new(0.8, 0.2, 0.1));
    let scene = format!(
        r#"<shape type="sphere"><boolean name="flip_normals" value="true"/>{}{}</shape><shape type="disk">{}</shape>"#,
        diffuse(Rgb::splat(above)),
        area(Rgb::splat(shine)),
        diffuse(below)
    );
    let setup = Setup::new(&path(-1, 5), &scene);
    // B_h = E + ρ_h (B_d / 2 + B_h / 2) and B_d = ρ_d B_h.
    let hemisphere = below.map(|below| shine / (1.0 - 0.5 * above * (1.0 + below)));
    let base = below * hemisphere;
    let numbers = [
        ("hemisphere", hemisphere, Rgb::new(1.818_181_82, 1.428_571_43, 1.379_310_34)),
        ("disk", base, Rgb::new(1.454_545_45, 0.285_714_29, 0.137_931_03)),
    ];
    let mut findings = Vec::new();
    for (name, closed, number) in numbers {
        findings.push(Finding::error(format!("{name}, the closed form"), (closed - number).abs().max_element(), 1e-8));
    }
    let eye = DVec3::new(0.1, -0.2, 0.4);
    for (name, target, expected) in [
        ("disk, near the middle", DVec3::new(0.2, 0.1, 0.0), base),
        ("disk, near the rim", DVec3::new(-0.6, 0.7, 0.0), base),
        ("hemisphere, low", DVec3::new(0.8, 0.58, 0.15), hemisphere),
        ("hemisphere, high", DVec3::new(0.0, -0.3, 0.95), hemisphere),
    ] {
        findings.extend(setup.test(name, (eye, target - eye), effort.samples(10_000), expected));
    }
    findings
}

fn concentric_spheres(effort: Effort) -> Vec<Finding> {
    // Red has the numbers of the table.
    let (inner, outer) = (Rgb::new(0.7, 0.3, 0.9), Rgb::new(0.4, 0.8, 0.1));
    let scene = format!(
        r#"<shape type="sphere">{}{}</shape><shape type="sphere"><float name="radius" value="2"/>
           <boolean name="flip_normals" value="true"/>{}</shape>"#,
        diffuse(inner),
        area(Rgb::ONE),
        diffuse(outer)
    );
    let setup = Setup::new(&path(-1, 5), &scene);
    // B_1 = 1 + ρ_1 B_2 and B_2 = ρ_2 (B_1 / 4 + 3 B_2 / 4).
    let share = 0.25 * outer / (Rgb::ONE - 0.75 * outer);
    let of_inner = Rgb::ONE / (Rgb::ONE - inner * share);
    let of_outer = share * of_inner;
    let eye = DVec3::new(1.4, 0.3, -0.2);
    let mut findings = vec![
        Finding::value("inner, the closed form", of_inner.x, 1.111_111_11, 1e-8),
        Finding::value("outer, the closed form", of_outer.x, 0.158_730_16, 1e-8),
    ];
    findings.extend(setup.test("inner", (eye, DVec3::new(0.2, 0.5, 0.3) - eye), effort.samples(20_000), of_inner));
    findings.extend(setup.test("outer", (eye, DVec3::new(0.6, 0.5, 0.4)), effort.samples(20_000), of_outer));
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
        sky(Rgb::new(0.2, 0.3, 0.4)),
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
        for (way, found) in others {
            for i in 0..3 {
                let subject = format!("{name}: lights and {way}, {}", CHANNELS[i]);
                findings.push(Finding::equal_means(subject, &by_lights[i], &found[i]));
            }
        }
    }
    findings
}

const GLASS: &str =
    r#"<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>"#;

/// Glass between `z = -0.25` and `z = 0.25`.
fn pane() -> String {
    let scale = r#"<transform name="to_world"><scale x="100" y="100" z="0.25"/></transform>"#;
    format!(r#"<shape type="cube">{scale}{GLASS}</shape>"#)
}

/// A light that fills the half-space below, or above.
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
    let numbers = [(0.0, 0.923_076_92), (45.0, 0.904_326_79), (60.0, 0.836_232_46), (75.0, 0.596_092_05)];
    let mut findings = Vec::new();
    for (theta, number) in numbers {
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
    for (depth, passes) in [(2, 0.0), (3, 1.0), (4, 1.0), (5, 1.0 + reflectance.powi(2))] {
        let setup = Setup::new(&path(depth, 100), &scene);
        let found = setup.test(&format!("75°, depth {depth}"), steep, effort.samples(40_000), once * passes * RADIANCE);
        findings.extend(found.into_iter().nth(1));
    }
    // Whatever is reflected or refracted sees the same sky.
    let immersed = Setup::new(&path(-1, 1000), &(pane() + &sky(RADIANCE)));
    findings.extend(immersed.compare("60°, even sky", (DVec3::Z, DVec3::new(0.0, 0.866, -0.5)), RADIANCE));
    findings
}

fn etendue(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(20_000);
    let up = |theta: f64| {
        DVec3::new(0.6 * theta.to_radians().sin(), 0.8 * theta.to_radians().sin(), theta.to_radians().cos())
    };
    let mut findings = Vec::new();
    let immersed = Setup::new(&path(-1, 1000), &(pane() + &sky(RADIANCE)));
    findings.extend(immersed.compare("inside, even sky", (DVec3::ZERO, up(20.0)), 2.25 * RADIANCE));
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
    // A light within the glass is seen by total reflection as brightly as without.
    let scale = r#"<scale value="0.2"/><translate y="0.4" z="-0.2"/>"#;
    let within =
        format!(r#"<shape type="rectangle"><transform name="to_world">{scale}</transform>{}</shape>"#, area(RADIANCE));
    let reflected = Setup::new(&path(-1, 5), &(pane() + &within));
    let aslant = (DVec3::new(0.0, -0.3, 0.0), DVec3::new(0.0, 1.0, 1.0));
    findings.extend(reflected.compare("inside, by total reflection", aslant, RADIANCE));

    // Under a wide surface of glass, after one passage: the flux of the sky less what is reflected outside.
    let deep = r#"<transform name="to_world"><scale value="1000"/><translate z="-1000"/></transform>"#;
    let p = DVec3::new(0.0, 0.0, -1.0);
    let scene = format!(r#"{}<shape type="cube">{deep}{GLASS}</shape>{}"#, sky(RADIANCE), patch(p, DVec3::Z, ALBEDO));
    let expected = ALBEDO * RADIANCE * (1.0 - 0.091_777_96);
    findings.extend(Setup::new(&path(3, 5), &scene).test("a surface within", towards(p, DVec3::Z), samples, expected));
    findings
}

fn roulette(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(30_000);
    let pebble = format!(
        r#"<shape type="sphere"><point name="center" x="0.5" y="0" z="-0.4"/><float name="radius" value="0.6"/>{GLASS}</shape>"#
    );
    let room = room("cube", Rgb::new(1.0, 0.2, 0.5), Rgb::new(0.3, 0.85, 0.6));
    let mut findings = Vec::new();
    for (name, scene) in [("cube", room.clone()), ("cube with a glass sphere", room + &pebble)] {
        let of = |rr_depth, seed| Setup::new(&path(9, rr_depth), &scene).many(WITHIN.0, WITHIN.1, samples, seed);
        let without = of(1000, 41);
        for rr_depth in [1, 4] {
            let with = of(rr_depth, 42);
            for i in 0..3 {
                let subject = format!("{name}, from {rr_depth}, {}", CHANNELS[i]);
                findings.push(Finding::equal_means(subject, &with[i], &without[i]));
            }
        }
    }
    findings
}

fn max_depth(effort: Effort) -> Vec<Finding> {
    let scene = room("sphere", RADIANCE, ALBEDO);
    let of = |depth| Setup::new(&path(depth, 100), &scene);
    let mut findings = of(0).compare("depth 0", WITHIN, Rgb::ZERO);
    findings.extend(of(1).compare("depth 1", WITHIN, RADIANCE));
    for depth in [2, 3] {
        let expected = series(RADIANCE, ALBEDO, Some(depth));
        findings.extend(of(depth).test(&format!("depth {depth}"), WITHIN, effort.samples(20_000), expected));
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::failures;

    #[test]
    fn all_laws_hold() {
        let failed = failures(LAWS, Effort::Quick);
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    }
}
