//! Photon integrators and light tracing with bad input and unsuitable scenes. They must give an error or a warning, and
//! never a panic, a value that is not finite, or a black image without a warning.

use crate::{
    bad_input::{Case, check_all, scene},
    kit::{self, Folder, SENSOR, SKY, run},
};

const BALL: &str = r#"<shape type="sphere"/>"#;
const MIRROR: &str =
    r#"<shape type="sphere"><bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>"#;
const BULB: &str = r#"<emitter type="point"><point name="position" x="1" y="3" z="3"/></emitter>"#;
const SUN: &str = r#"<emitter type="directional"><vector name="direction" x="0" y="-1" z="-1"/></emitter>"#;

fn mapper(params: &str) -> String {
    format!(
        r#"<integrator type="photonmapper"><integer name="global_photons" value="2000"/><integer name="caustic_photons" value="2000"/>{params}</integrator>"#
    )
}

fn faulty(param: &str, faults: &'static [&'static str]) -> Case {
    let integrator = format!(r#"<integrator type="photonmapper">{param}</integrator>"#);
    scene(kit::scene_of(&[&integrator, SENSOR, SKY, BALL]), faults)
}

fn integer(name: &str, value: &str) -> String {
    format!(r#"<integer name="{name}" value="{value}"/>"#)
}

fn radius(value: &str) -> String {
    format!(r#"<float name="caustic_lookup_radius" value="{value}"/>"#)
}

#[test]
fn parameters_that_are_wrong() {
    check_all(vec![
        (
            "none",
            faulty(&integer("global_photons", "0"), &["\"global_photons\" is 0; must be a number from 1 to 100000000"]),
        ),
        ("-1", faulty(&integer("global_photons", "-1"), &["\"global_photons\" is -1; must be a number from 1"])),
        (
            "10^12",
            faulty(&integer("global_photons", "1000000000000"), &["\"global_photons\" is 1000000000000; must be"]),
        ),
        ("1.5", faulty(&integer("global_photons", "1.5"), &["could not parse integer value \"1.5\""])),
        (
            "float",
            faulty(
                r#"<float name="global_photons" value="1.5"/>"#,
                &["\"global_photons\" is a float; must be an integer"],
            ),
        ),
        (
            "no caustics",
            faulty(&integer("caustic_photons", "0"), &["\"caustic_photons\" is 0; must be a number from 1"]),
        ),
        (
            "-1 caustic",
            faulty(&integer("caustic_photons", "-1"), &["\"caustic_photons\" is -1; must be a number from 1"]),
        ),
        (
            "caustic 10^12",
            faulty(&integer("caustic_photons", "1000000000000"), &["\"caustic_photons\" is 1000000000000; must"]),
        ),
        (
            "one",
            faulty(
                &integer("lookup_size", "1"),
                &["\"lookup_size\" is 1; must be 0, or 2 or more: the farthest photon"],
            ),
        ),
        ("fewer", faulty(&integer("lookup_size", "-1"), &["\"lookup_size\" is -1; must be a number from 0"])),
        ("radius 0", faulty(&radius("0"), &["\"caustic_lookup_radius\" is 0; must be a number above 0"])),
        ("radius -1", faulty(&radius("-1"), &["\"caustic_lookup_radius\" is -1; must be a number above 0"])),
        ("radius NaN", faulty(&radius("nan"), &["could not parse floating point value \"nan\""])),
        ("radius inf", faulty(&radius("inf"), &["\"caustic_lookup_radius\" is inf; must be a number above 0"])),
        (
            "kernel",
            faulty(
                r#"<string name="kernel" value="gauss"/>"#,
                &["\"kernel\" cannot be \"gauss\"; known: constant, cone, epanechnikov"],
            ),
        ),
        (
            "deep",
            faulty(
                &integer("max_depth", "5000"),
                &["\"max_depth\" is 5000; must be at most 1023 for a photon integrator, or -1"],
            ),
        ),
    ]);
}

fn progressive(param: &str, faults: &'static [&'static str]) -> Case {
    let integrator = format!(r#"<integrator type="sppm">{param}</integrator>"#);
    scene(kit::scene_of(&[&integrator, SENSOR, SKY, BALL]), faults)
}

#[test]
fn parameters_of_progressive_photon_mapping_that_are_wrong() {
    let float = |name: &str, value: &str| format!(r#"<float name="{name}" value="{value}"/>"#);
    let word = |name: &str, value: &str| format!(r#"<string name="{name}" value="{value}"/>"#);
    const ALPHA: &str = "must be a number above 0, at most 1";
    const COUNT: &str = "must be a number from 1 to 100000000";
    const NO_INTEGER: &[&str] = &["could not parse integer value \"1.5\""];
    check_all(vec![
        ("alpha 0", progressive(&float("alpha", "0"), &[ALPHA])),
        ("alpha -1", progressive(&float("alpha", "-1"), &["\"alpha\" is -1; must be a number above 0"])),
        ("alpha 2", progressive(&float("alpha", "2"), &[ALPHA])),
        ("alpha NaN", progressive(&float("alpha", "nan"), &["could not parse floating point value \"nan\""])),
        ("no photons", progressive(&integer("photon_count", "0"), &[COUNT])),
        ("-1 photons", progressive(&integer("photon_count", "-1"), &[COUNT])),
        ("1.5 photons", progressive(&integer("photon_count", "1.5"), NO_INTEGER)),
        ("10^12 photons", progressive(&integer("photon_count", "1000000000000"), &[COUNT])),
        (
            "radius -1",
            progressive(&float("initial_radius", "-1"), &["\"initial_radius\" is -1; must be a number from 0"]),
        ),
        ("radius NaN", progressive(&float("initial_radius", "nan"), &["could not parse floating point value \"nan\""])),
        (
            "radius inf",
            progressive(&float("initial_radius", "inf"), &["\"initial_radius\" is inf; must be a number from 0"]),
        ),
        ("no passes", progressive(&integer("max_passes", "0"), &["\"max_passes\" is 0; must be a number from 1"])),
        (
            "schedule",
            progressive(
                &word("radius_schedule", "per_photon"),
                &["\"radius_schedule\" cannot be \"per_photon\"; known: per_pixel, error_driven, per_pass"],
            ),
        ),
        (
            "direct",
            progressive(
                &word("direct", "shadow_photons"),
                &["\"direct\" cannot be \"shadow_photons\"; known: traced, map"],
            ),
        ),
        ("deep", progressive(&integer("max_depth", "5000"), &["\"max_depth\" is 5000; must be at most 1023"])),
    ]);
}

#[test]
fn parameters_of_progressive_photon_mapping_at_their_limits_give_numbers() {
    let floor = r#"<shape type="rectangle"/>"#;
    for schedule in ["per_pixel", "error_driven", "per_pass"] {
        for (name, value) in
            [("alpha", "1"), ("alpha", "1e-300"), ("initial_radius", "1e-300"), ("initial_radius", "1e300")]
        {
            let integrator = format!(
                r#"<integrator type="sppm"><integer name="photon_count" value="500"/><string name="direct" value="map"/>
                <string name="radius_schedule" value="{schedule}"/><float name="{name}" value="{value}"/></integrator>"#
            );
            let image = kit::image(&kit::scene_of(&[&integrator, SENSOR, BULB, BALL, floor]), 5);
            let good = image.channels.iter().all(|(_, values)| values.iter().all(|x| x.is_finite() && *x >= 0.0));
            assert!(good, "{schedule} {name} {value}");
        }
    }
}

#[test]
fn scenes_that_photons_cannot_treat() {
    let plane = r#"<shape type="plane"/>"#;
    let photons = mapper("");
    let of = |parts: &[&str], faults| scene(kit::scene_of(parts), faults);
    let tracer = r#"<integrator type="ptracer"/>"#;
    let passes = r#"<integrator type="sppm"/>"#;
    let wrapped = format!(r#"<integrator type="moment">{photons}</integrator>"#);
    const ENDLESS: &[&str] = &["cannot render this scene: a distant emitter illuminates an infinite plane"];
    const STRONG: &str = r#"<emitter type="point"><rgb name="intensity" value="1e30"/></emitter>"#;
    let stronger = r#"<shape type="rectangle"><transform name="to_world"><scale value="1e6"/></transform>
        <emitter type="area"><rgb name="radiance" value="1e30"/></emitter></shape>"#;
    check_all(vec![
        (
            "mirrors",
            of(
                &[&photons, SENSOR, BULB, MIRROR],
                &["\"photonmapper\" cannot render this scene: no surface can store a photon"],
            ),
        ),
        (
            "wrapped",
            of(&[&wrapped, SENSOR, BULB, MIRROR], &["cannot render this scene: no surface can store a photon"]),
        ),
        ("nothing", of(&[&photons, SENSOR, BULB], &["no surface can store a photon"])),
        (
            "progressive, mirrors",
            of(&[passes, SENSOR, BULB, MIRROR], &["\"sppm\" cannot render this scene: no surface can store a photon"]),
        ),
        ("progressive, nothing", of(&[passes, SENSOR, BULB], &["no surface can store a photon"])),
        ("progressive, sun over a plane", of(&[passes, SENSOR, SUN, plane], ENDLESS)),
        ("progressive, environment over a plane", of(&[passes, SENSOR, SKY, plane], ENDLESS)),
        ("environment over a plane", of(&[tracer, SENSOR, SKY, plane], ENDLESS)),
        ("sun over a plane", of(&[tracer, SENSOR, SUN, plane], ENDLESS)),
        ("environment over a plane, photons", of(&[&photons, SENSOR, SKY, plane], ENDLESS)),
        ("sun over a plane, photons", of(&[&photons, SENSOR, SUN, plane], ENDLESS)),
        (
            "too much light",
            of(
                &[&photons, SENSOR, STRONG, stronger, BALL],
                &["its emitters emit 1.257e43 W in total; photons can store 1e-24 to 1e34 W"],
            ),
        ),
    ]);
}

/// The warnings of a render, whose image must be finite.
fn warnings(integrator: &str, parts: &[&str], options: &str) -> Vec<String> {
    let folder = Folder::with_scene(&kit::scene_of(&[&[integrator, SENSOR], parts].concat()));
    let said = run(&mut folder.etendue(&format!("render scene.xml -o image.exr --spp 2 {options}")));
    assert_eq!(said.code, Some(0), "{}", said.err);
    let image = etendue::film::exr::read(&folder.path("image.exr")).unwrap();
    assert!(image.channels.iter().all(|(_, values)| values.iter().all(|x| x.is_finite())));
    said.err.lines().filter_map(|line| line.strip_prefix("warning: ")).map(str::to_owned).collect()
}

#[test]
fn scenes_that_stay_black_say_why() {
    let dark = r#"<emitter type="point"><rgb name="intensity" value="0"/></emitter>"#;
    let aside = r#"<emitter type="spot"><transform name="to_world"><lookat origin="0, 0, 9" target="0, 0, 20"/></transform></emitter>"#;
    let glass = r#"<shape type="sphere"><point name="center" x="90" y="0" z="0"/><bsdf type="dielectric"/></shape>"#;
    let photons = mapper("");
    let unlit = "none of 2000 photons carried any light";
    let empty = "none of 2000 photons hit a surface that can store it: the global map is empty";
    let passes = r#"<integrator type="sppm"><integer name="photon_count" value="2000"/></integrator>"#;
    for integrator in [r#"<integrator type="path"/>"#, r#"<integrator type="ptracer"/>"#, &photons, passes] {
        let is_mapper = integrator == photons || integrator == passes;
        let with_map =
            |first: &str| if is_mapper { vec![first.to_owned(), unlit.to_owned()] } else { vec![first.to_owned()] };
        assert_eq!(warnings(integrator, &[BALL], ""), with_map("the scene has no light: the image will be black"));
        assert_eq!(
            warnings(integrator, &[BALL, dark], ""),
            with_map("the scene's lights have no power: the image will be black")
        );
        assert!(warnings(integrator, &[BALL, SKY], "").is_empty());
    }
    assert_eq!(warnings(&photons, &[BALL, aside], ""), [empty]);
    assert_eq!(warnings(passes, &[BALL, aside], ""), [empty]);
    let wrapped = format!(r#"<integrator type="aov"><string name="aovs" value="z:depth"/>{photons}</integrator>"#);
    assert_eq!(warnings(&wrapped, &[BALL, aside], ""), [empty]);
    let none = "none of 2000 photons reached a surface through mirrors or glass: the image has no caustics";
    assert_eq!(warnings(&photons, &[BALL, glass, BULB], "--param max_depth=2"), [none]);
    let seen = warnings(r#"<integrator type="ptracer"/>"#, &[MIRROR, BULB], "");
    assert_eq!(seen.len(), 1);
    assert!(seen[0].starts_with("every surface is specular"), "{seen:?}");
}

#[test]
fn lights_that_are_black_in_places() {
    let lamp = |texture: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><translate z="3"/></transform>
            <emitter type="area">{texture}</emitter></shape>"#
        )
    };
    let checkered = lamp(
        r#"<texture type="checkerboard" name="radiance"><rgb name="color0" value="0"/><rgb name="color1" value="0, 5, 0"/>
        <transform name="to_uv"><scale x="3" y="3"/></transform></texture>"#,
    );
    let black = lamp(r#"<rgb name="radiance" value="0"/>"#);
    for integrator in [
        r#"<integrator type="ptracer"/>"#.to_owned(),
        mapper(""),
        mapper(r#"<string name="direct" value="shadow_photons"/>"#),
    ] {
        assert!(warnings(&integrator, &[BALL, &checkered, &black, BULB], "").is_empty(), "{integrator}");
        assert_eq!(
            warnings(&integrator, &[BALL, &black], "")[0],
            "the scene's lights have no power: the image will be black"
        );
    }
}

#[test]
fn photons_within_other_integrators_and_replayed() {
    let photons = mapper(r#"<boolean name="raw_estimate" value="true"/>"#);
    let aov =
        format!(r#"<integrator type="aov"><string name="aovs" value="z:depth,n:sample_count"/>{photons}</integrator>"#);
    let moment = format!(r#"<integrator type="moment">{photons}</integrator>"#);
    let folder = |integrator: &str| Folder::with_scene(&kit::scene_of(&[integrator, SENSOR, SKY, BALL]));
    let own = folder(&photons).render("--spp 3 --seed 2");
    for (wrapped, more) in [(&aov, ["z.T", "n.N"].as_slice()), (&moment, &["m2.R", "m2.G", "m2.B"])] {
        let image = folder(wrapped).render("--spp 3 --seed 2");
        for (name, values) in &own.channels {
            assert_eq!(image.channel(name), Some(values.as_slice()), "{name}");
        }
        assert_eq!(image.channels.len(), own.channels.len() + more.len());
        assert!(more.iter().all(|name| image.channel(name).is_some()) && image.channel("variance.R").is_none());
    }
    let mut sum = 0.0;
    for sample in 0..3 {
        let said = run(&mut folder(&aov).etendue(&format!("render scene.xml --spp 3 --seed 2 --replay 8,6,{sample}")));
        assert_eq!(said.code, Some(0), "{}", said.err);
        sum += said.out.split_whitespace().next().unwrap().parse::<f64>().unwrap();
    }
    let mean = f64::from(kit::pixel(&own, 8, 6)[0]);
    assert!((sum / 3.0 - mean).abs() <= f64::from(f32::EPSILON) * mean, "{sum} {mean}");
}

/// A floor with a ball on it, of a given size at a given distance from the origin, viewed from nearby.
fn place(integrator: &str, size: f64, far: f64, light: &str) -> String {
    let to_world = |own: &str| {
        format!(
            r#"<transform name="to_world">{own}<scale value="{size}"/><translate x="{far}" y="{far}"/></transform>"#
        )
    };
    let camera = r#"<lookat origin="0, -3, 3" target="0, 0, 0" up="0, 0, 1"/>"#;
    let (eye, at) = (format!("{}, {}, {}", far, far - 3.0 * size, 3.0 * size), format!("{far}, {far}, 0"));
    let camera = camera.replace("0, -3, 3", &eye).replace("0, 0, 0", &at);
    let sensor = format!(
        r#"<sensor type="perspective"><transform name="to_world">{camera}</transform>
        <float name="near_clip" value="{}"/><float name="far_clip" value="{}"/>
        <film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/></film></sensor>"#,
        1e-3 * size,
        1e3 * size
    );
    let light =
        light.replace("TO_WORLD", &to_world(r#"<lookat origin="0.1, 0.2, 3" target="0.1, 0.2, 0" up="0, 1, 0"/>"#));
    let glass = format!(
        r#"<shape type="sphere"><float name="radius" value="0.4"/>{}<bsdf type="dielectric"/></shape>"#,
        to_world(r#"<translate x="0.9" z="0.5"/>"#)
    );
    let cube =
        format!(r#"<shape type="cube">{}</shape>"#, to_world(r#"<scale value="0.2"/><translate x="-0.9" z="0.3"/>"#));
    let floor = format!(r#"<shape type="rectangle">{}</shape>"#, to_world(r#"<scale value="2"/>"#));
    kit::scene_of(&[integrator, &sensor, &light, &glass, &cube, &floor])
}

#[test]
fn geometry_at_the_limits_gives_numbers() {
    // All photons of the narrowest beam arrive in one point.
    let beam = r#"<emitter type="spot"><float name="cutoff_angle" value="1e-7"/>TO_WORLD</emitter>"#;
    let lamp = r#"<shape type="rectangle">TO_WORLD<emitter type="area"/></shape>"#;
    let lookups = [
        r#"<integer name="lookup_size" value="0"/>"#,
        r#"<integer name="lookup_size" value="2"/>"#,
        r#"<float name="global_lookup_radius" value="1e-30"/><float name="caustic_lookup_radius" value="1e15"/>"#,
    ];
    let ways = [("map", "map"), ("traced", "final_gather"), ("shadow_photons", "final_gather")];
    for (size, far) in [(1.0, 0.0), (1e-6, 0.0), (1e-6, 1.0), (1.0, 1e12), (1e12, 0.0), (1e6, 1e13)] {
        for light in [beam, lamp, SUN] {
            for lookup in lookups {
                for (kernel, (direct, indirect)) in ["constant", "cone", "epanechnikov"].into_iter().zip(ways) {
                    let words = [("kernel", kernel), ("direct", direct), ("indirect", indirect)];
                    let words: String =
                        words.iter().map(|(name, word)| format!(r#"<string name="{name}" value="{word}"/>"#)).collect();
                    let integrator = mapper(&format!("{words}{lookup}")).replace("2000", "300");
                    let image = kit::image(&place(&integrator, size, far, light), 1);
                    let is_number = |x: &f32| !x.is_nan() && *x >= 0.0;
                    let good = image.channels.iter().all(|(_, values)| values.iter().all(is_number));
                    assert!(good, "{size} {far} {light} {lookup} {words}");
                }
            }
            kit::image(&place(r#"<integrator type="ptracer"/>"#, size, far, light), 2);
        }
    }
}
