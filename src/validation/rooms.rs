//! Closed rooms: geometric series of interreflection, and how paths end.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    render::Replicate,
    stats::Moments,
    validation::setup::{
        ALBEDO, CHANNELS, GLASS, RADIANCE, RAY_INSIDE, Setup, area, diffuse, path, renderer, room, towards, triple,
    },
};

/// The laws of closed rooms.
pub const LAWS: &[Law] = &[
    Law {
        name: "radiometry/furnace",
        claim: "In a closed sphere or cube whose walls emit the radiance E and have the albedo ρ, the radiance is E (1 + ρ + ...) \
                up to max_depth terms. Without a max_depth it is E / (1 - ρ).",
        source: "geometric series",
        check: Check::Analytic(furnace),
    },
    Law {
        name: "radiometry/integrating-sphere",
        claim: "A point light off the centre of a diffuse sphere gives its wall the radiance ρ/π (I cos θ / d² + I ρ / (R² (1 - ρ))), \
                at four angles.",
        source: "Indirect light in a diffuse sphere is uniform: Jacquez and Kuppenheim 1955",
        check: Check::Analytic(integrating_sphere),
    },
    Law {
        name: "radiometry/colour-bleeding",
        claim: "A hemisphere that emits light and the coloured disk below it have the radiosities of the exact two-surface solution.",
        source: "form factors 1, ½, ½ of a hemisphere and its base",
        check: Check::Analytic(colour_bleeding),
    },
    Law {
        name: "radiometry/concentric-spheres",
        claim: "Two concentric spheres of radii 1 and 2, of which the inner emits, have the radiosities of the exact two-surface solution.",
        source: "form factors 1, ¼, ¾",
        check: Check::Analytic(concentric_spheres),
    },
    Law {
        name: "transport/roulette",
        claim: "Russian roulette does not change the mean, even from the first bounce.",
        source: "Arvo and Kirk 1990",
        check: Check::Analytic(roulette),
    },
    Law {
        name: "transport/max-depth",
        claim: "A max_depth of 0 gives a black image, 1 shows only emitters, and each increment adds one reflection, in path tracing \
                and light tracing alike.",
        source: "Mitsuba's definition",
        check: Check::Analytic(max_depth),
    },
];

/// The radiance in a room: the given number of terms of the geometric series, or its limit.
pub(super) fn series(emission: Rgb, albedo: Rgb, terms: Option<i32>) -> Rgb {
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
            findings.extend(setup.test(&format!("{shape}, depth {depth}"), RAY_INSIDE, samples, expected));
        }
        let setup = Setup::new(&path(-1, 3), &scene);
        findings.extend(setup.test(
            &format!("{shape}, any depth"),
            RAY_INSIDE,
            samples,
            series(RADIANCE, ALBEDO, None),
        ));
    }
    findings
}

fn integrating_sphere(effort: Effort) -> Vec<Finding> {
    const RADIUS: f64 = 2.0;
    let (source, intensity) = (DVec3::Z, Rgb::new(1.0, 3.0, 0.4));
    // The red channel has the values of the table.
    let albedo = Rgb::new(0.5, 0.8, 0.2);
    let scene = format!(
        r#"<shape type="sphere"><float name="radius" value="{RADIUS}"/><boolean name="flip_normals" value="true"/>{}</shape>
           <emitter type="point"><point name="position" x="0" y="0" z="1"/><rgb name="intensity" value="{}"/></emitter>"#,
        diffuse(albedo),
        triple(intensity)
    );
    let setup = Setup::new(&path(-1, 5), &scene);
    let table = [(0.0, 0.198_943_679), (60.0, 0.085_732_810), (90.0, 0.068_259_238), (180.0, 0.057_472_618)];
    let mut findings = Vec::new();
    for (alpha, number) in table {
        let (sin, cos) = f64::to_radians(alpha).sin_cos();
        let outwards = DVec3::new(0.6 * sin, 0.8 * sin, cos);
        let to_light = source - RADIUS * outwards;
        let direct = to_light.normalize().dot(-outwards) / to_light.length_squared();
        let indirect = albedo / (RADIUS * RADIUS * (Rgb::ONE - albedo));
        let expected = albedo * FRAC_1_PI * intensity * (direct + indirect);
        findings.push(Finding::value(format!("{alpha}°, the closed form"), expected.x, number, 1e-9));
        let ray = towards(RADIUS * outwards, -outwards);
        findings.extend(setup.test(&format!("{alpha}°"), ray, effort.samples(10_000), expected));
    }
    findings
}

fn colour_bleeding(effort: Effort) -> Vec<Finding> {
    let (emission, above, below) = (1.0, 0.5, Rgb::new(0.8, 0.2, 0.1));
    let scene = format!(
        r#"<shape type="sphere"><boolean name="flip_normals" value="true"/>{}{}</shape><shape type="disk">{}</shape>"#,
        diffuse(Rgb::splat(above)),
        area(Rgb::splat(emission)),
        diffuse(below)
    );
    let setup = Setup::new(&path(-1, 5), &scene);
    // B_h = E + ρ_h (B_d / 2 + B_h / 2) and B_d = ρ_d B_h.
    let hemisphere = below.map(|below| emission / (1.0 - 0.5 * above * (1.0 + below)));
    let base = below * hemisphere;
    let table = [
        ("hemisphere", hemisphere, Rgb::new(1.818_181_82, 1.428_571_43, 1.379_310_34)),
        ("disk", base, Rgb::new(1.454_545_45, 0.285_714_29, 0.137_931_03)),
    ];
    let mut findings = Vec::new();
    for (name, closed, number) in table {
        findings.push(Finding::error(format!("{name}, the closed form"), (closed - number).abs().max_element(), 1e-8));
    }
    let origin = DVec3::new(0.1, -0.2, 0.4);
    for (name, target, expected) in [
        ("disk, near the middle", DVec3::new(0.2, 0.1, 0.0), base),
        ("disk, near the rim", DVec3::new(-0.6, 0.7, 0.0), base),
        ("hemisphere, low", DVec3::new(0.8, 0.58, 0.15), hemisphere),
        ("hemisphere, high", DVec3::new(0.0, -0.3, 0.95), hemisphere),
    ] {
        findings.extend(setup.test(name, (origin, target - origin), effort.samples(10_000), expected));
    }
    findings
}

fn concentric_spheres(effort: Effort) -> Vec<Finding> {
    // The red channel has the values of the table.
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
    let origin = DVec3::new(1.4, 0.3, -0.2);
    let mut findings = vec![
        Finding::value("inner, the closed form", of_inner.x, 1.111_111_11, 1e-8),
        Finding::value("outer, the closed form", of_outer.x, 0.158_730_16, 1e-8),
    ];
    findings.extend(setup.test(
        "inner",
        (origin, DVec3::new(0.2, 0.5, 0.3) - origin),
        effort.samples(20_000),
        of_inner,
    ));
    findings.extend(setup.test("outer", (origin, DVec3::new(0.6, 0.5, 0.4)), effort.samples(20_000), of_outer));
    findings
}

fn roulette(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(120_000);
    let pebble = format!(
        r#"<shape type="sphere"><point name="center" x="0.5" y="0" z="-0.4"/><float name="radius" value="0.6"/>{GLASS}</shape>"#
    );
    let room = room("cube", Rgb::new(1.0, 0.2, 0.5), Rgb::new(0.3, 0.85, 0.6));
    let mut findings = Vec::new();
    for (name, scene) in [("cube", room.clone()), ("cube with a glass sphere", room + &pebble)] {
        let of =
            |rr_depth, seed| Setup::new(&path(9, rr_depth), &scene).many(RAY_INSIDE.0, RAY_INSIDE.1, samples, seed);
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
    let mut findings = of(0).compare("depth 0", RAY_INSIDE, Rgb::ZERO);
    findings.extend(of(1).compare("depth 1", RAY_INSIDE, RADIANCE));
    for depth in [2, 3] {
        let expected = series(RADIANCE, ALBEDO, Some(depth));
        findings.extend(of(depth).test(&format!("depth {depth}"), RAY_INSIDE, effort.samples(20_000), expected));
    }
    findings.extend((1..=3).flat_map(|depth| light_tracing_depth(depth, &scene, effort)));
    findings
}

/// Compares the film's mean, which light tracing gives a camera in a room, with the series of that depth.
fn light_tracing_depth(depth: i32, room: &str, effort: Effort) -> Vec<Finding> {
    let (origin, direction) = RAY_INSIDE;
    let sensor = format!(
        r#"<sensor type="perspective"><float name="fov" value="70"/>
           <transform name="to_world"><lookat origin="{}" target="{}" up="0, 0, 1"/></transform>
           <film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/><rfilter type="box"/></film>
           </sensor>"#,
        triple(origin),
        triple(origin + direction)
    );
    let integrator = format!(r#"<integrator type="ptracer"><integer name="max_depth" value="{depth}"/></integrator>"#);
    let renderer = renderer(&integrator, &sensor, room);
    let mut moments = [Moments::default(); 3];
    for number in 0..u64::from(effort.samples(24)) {
        let pixels = renderer.render(Replicate { seed: 33, number, samples: 400 }, &|_| {}).means();
        for (i, moments) in moments.iter_mut().enumerate() {
            moments.push(pixels.iter().map(|pixel| pixel[i]).sum::<f64>() / pixels.len() as f64);
        }
    }
    let expected = series(RADIANCE, ALBEDO, Some(depth));
    let subject = |i: usize| format!("light tracing, depth {depth}, {}", CHANNELS[i]);
    (0..3).map(|i| Finding::mean(subject(i), &moments[i], expected[i])).collect()
}
