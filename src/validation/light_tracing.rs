//! Light tracing and photon mapping must give the images of path tracing.

use crate::{
    integrator::Overrides,
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    render::{Renderer, Replicate},
    stats::{Estimate, Moments, equivalence::TO_RADIUS_ZERO},
    transport::PathClass,
    validation::{caustics::pane, setup},
};

/// The laws of integrators that trace paths from lights.
pub const LAWS: &[Law] = &[
    Law {
        name: "light-tracing/path",
        claim: "Light tracing and path tracing have the same mean in every quarter of the film. The cases cover all emitters and \
                scattering BSDFs, pinhole and thin lens, all filters up to the film's border, a crop, hidden emitters, and a small \
                max_depth.",
        source: "two estimators of one integral, Veach 1997, chapter 10",
        check: Check::Analytic(light_is_path),
    },
    Law {
        name: "photon-map/split",
        claim: "Each of the four path classes of a photon-mapped image, extrapolated to radius 0, is equivalent to the same class of a \
                path-traced image. So is their sum. This also holds with direct and indirect light from the map.",
        source: "the bias of a density estimate is an even function of the radius; least squares in r² on the same photons",
        check: Check::Analytic(split),
    },
    Law {
        name: "caustic/pane-unseen",
        claim: "Path tracing and light tracing both give black for a floor that a point light illuminates and a pinhole camera views \
                through glass.",
        source: "glass blocks shadow rays, and no sampled ray hits a point",
        check: Check::Analytic(black),
    },
];

/// Names and values of an integrator's parameters.
type Params<'a> = &'a [(&'a str, &'a str)];

fn renderer(scene: &str, sensor: &str, integrator: &str, params: Params<'_>) -> Renderer {
    let params = params.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    setup::renderer_with(&Overrides { name: Some(integrator.to_owned()), params }, &[sensor, scene])
}

const LOOK: &str =
    r#"<transform name="to_world"><lookat origin="0.6, -3.4, 2.1" target="0, 0.1, 0.6" up="0, 0, 1"/></transform>"#;

fn pinhole(film: &str) -> String {
    format!(
        r#"<sensor type="perspective"><float name="fov" value="50"/>{LOOK}<film type="hdrfilm">
           <integer name="width" value="16"/><integer name="height" value="12"/>{film}</film><sampler type="ldsampler"/></sensor>"#
    )
}

fn lens(film: &str) -> String {
    format!(
        r#"<sensor type="thinlens"><float name="fov" value="50"/><float name="aperture_radius" value="0.2"/>
           <float name="focus_distance" value="3"/>{LOOK}<film type="hdrfilm">
           <integer name="width" value="16"/><integer name="height" value="12"/>{film}</film></sensor>"#
    )
}

const FILTER: &str = r#"<rfilter type="box"/>"#;

fn objects(material: &str) -> String {
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="1.6"/></transform>
             <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf></shape>
           <shape type="rectangle"><transform name="to_world"><scale value="1.6"/><rotate x="1" angle="80"/>
             <translate x="0" y="1.6" z="0.9"/></transform>{material}</shape>
           <shape type="sphere"><point name="center" x="-0.5" y="-0.2" z="0.6"/><float name="radius" value="0.5"/>{material}</shape>
           <shape type="cube"><transform name="to_world"><scale value="0.3"/><rotate z="1" angle="25"/>
             <translate x="0.7" y="-0.3" z="0.3"/></transform>
             <bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.6, 0.8"/></bsdf></shape>"#
    )
}

const PAINT: &str =
    r#"<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.8, 0.5"/></bsdf></bsdf>"#;
const POINT: &str = r#"<emitter type="point"><point name="position" x="0.3" y="-0.8" z="2.5"/>
    <rgb name="intensity" value="4, 6, 9"/></emitter>"#;
const LAMP: &str = r#"<shape type="rectangle"><transform name="to_world"><scale value="0.4"/><rotate x="1" angle="190"/>
    <translate x="0.2" y="0.2" z="2"/></transform><emitter type="area"><rgb name="radiance" value="9, 6, 4"/></emitter></shape>"#;

fn light_is_path(effort: Effort) -> Vec<Finding> {
    let phong = r#"<bsdf type="phong"><rgb name="diffuse_reflectance" value="0.3, 0.2, 0.1"/>
        <rgb name="specular_reflectance" value="0.4, 0.5, 0.6"/><float name="exponent" value="4"/></bsdf>"#;
    let metal = r#"<bsdf type="metal"><rgb name="reflectance" value="0.9, 0.7, 0.4"/><float name="roughness" value="0.9"/></bsdf>"#;
    let rough =
        r#"<bsdf type="roughconductor"><string name="material" value="Cu"/><float name="alpha" value="0.5"/></bsdf>"#;
    let sun = r#"<emitter type="directional"><vector name="direction" x="0.4" y="0.5" z="-1"/>
        <rgb name="irradiance" value="1, 2, 3"/></emitter>"#;
    let environment = r#"<emitter type="constant"><rgb name="radiance" value="0.5, 0.8, 1"/></emitter>"#;
    let picture = setup::Picture::new([12, 7], |x, y| {
        Rgb::new((x % 5) as f64, (y % 4) as f64, if [x, y] == [8, 2] { 40.0 } else { 1.0 })
    });
    let sky = format!(
        r#"<emitter type="envmap">{}<float name="scale" value="0.3"/><transform name="to_world"><rotate x="1" angle="90"/>
           <rotate z="1" angle="40"/></transform></emitter>"#,
        picture.xml()
    );
    let spot = r#"<emitter type="spot"><rgb name="intensity" value="30, 20, 10"/><float name="cutoff_angle" value="35"/>
        <transform name="to_world"><lookat origin="1.5, -1.5, 2" target="0, 0, 0.3" up="0, 0, 1"/></transform></emitter>"#;
    let gaussian = r#"<rfilter type="gaussian"/>"#;
    let border = r#"<rfilter type="tent"><float name="radius" value="2"/></rfilter><boolean name="sample_border" value="true"/>
        <integer name="crop_offset_x" value="4"/><integer name="crop_width" value="8"/>"#;
    let hidden = [("hide_emitters", "true")];
    // The glass is above the camera's view, because light tracing renders glass black.
    let amber = r#"<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="175"/>
        <translate x="0.3" y="0" z="4.4"/></transform><emitter type="area"><rgb name="radiance" value="40, 30, 20"/></emitter></shape>
        <shape type="sphere"><point name="center" x="0.2" y="0.1" z="2.9"/><float name="radius" value="0.5"/>
        <bsdf type="dielectric"><float name="int_ior" value="1.3"/><float name="ext_ior" value="1"/>
        <rgb name="absorption" value="0.2, 0.9, 3"/></bsdf></shape>"#;
    let cases: [(&str, String, String, Params<'_>); 11] = [
        ("point light, pinhole, box", objects(PAINT) + POINT, pinhole(FILTER), &[]),
        ("spot, thin lens", objects(PAINT) + spot, lens(FILTER), &[]),
        ("sun, gaussian", objects(PAINT) + sun, pinhole(gaussian), &[]),
        ("environment, crop with border, tent", objects(PAINT) + environment, pinhole(border), &[]),
        ("environment map, lamp", objects(PAINT) + &sky + LAMP, pinhole(FILTER), &[]),
        ("lamp, phong", objects(phong) + LAMP, pinhole(FILTER), &[]),
        ("lamp, metal", objects(metal) + LAMP, pinhole(FILTER), &[]),
        (
            "lamp and environment, rough conductor, hidden lights",
            objects(rough) + LAMP + environment,
            lens(gaussian),
            &hidden,
        ),
        (
            "all lights, thin lens, gaussian",
            objects(PAINT) + POINT + spot + sun + environment + LAMP,
            lens(gaussian),
            &[],
        ),
        ("lamp behind amber", objects(PAINT) + amber, lens(FILTER), &[]),
        ("lamp and point, max_depth 3", objects(PAINT) + LAMP + POINT, pinhole(FILTER), &[("max_depth", "3")]),
    ];
    let replicates = u64::from(effort.samples(24));
    let mut findings = Vec::new();
    for (name, scene, sensor, params) in cases {
        let of = |integrator, seed| {
            let depth = [("max_depth", "6")];
            let params = [&depth[..], params].concat();
            quarters(&renderer(&scene, &sensor, integrator, &params), seed, replicates)
        };
        let (light, path) = (of("ptracer", 91), of("path", 92));
        for (i, quarter) in QUARTERS.iter().enumerate() {
            findings.push(Finding::equal_means(format!("{name}, {quarter}"), &light[i], &path[i]));
        }
    }
    findings
}

const QUARTERS: [&str; 4] = ["upper left", "upper right", "lower left", "lower right"];

/// The moments, over replicates, of each film quarter's mean of a weighted sum of the channels.
fn quarters(renderer: &Renderer, seed: u64, replicates: u64) -> [Moments; 4] {
    let crop = renderer.scene.sensor.film.rendered();
    let mut moments = [Moments::default(); 4];
    for number in 0..replicates {
        let pixels = renderer.render(Replicate { seed, number, samples: 48 }, &|_| {}).means();
        let mut sums = [0.0; 4];
        for (i, [r, g, b]) in pixels.iter().enumerate() {
            let (x, y) = (i as u32 % crop.width, i as u32 / crop.width);
            let quarter = usize::from(2 * x >= crop.width) + 2 * usize::from(2 * y >= crop.height);
            // The weights are unequal, so that a swap of channels changes the sum.
            sums[quarter] += (0.5 * r + 0.3 * g + 0.2 * b) * 4.0 / pixels.len() as f64;
        }
        moments.iter_mut().zip(sums).for_each(|(moments, sum)| moments.push(sum));
    }
    moments
}

/// The moments, over replicates, of the film means of the four path classes and, last, of the image, extrapolated to
/// radius 0.
///
/// `least` is the smallest of the three radii.
fn extrapolated(make: impl Fn(Params<'_>) -> Renderer, least: f64, samples: u32, replicates: u64) -> [Moments; 5] {
    let at_radius = |(scale, weight): (f64, f64)| {
        let radius = format!("{}", scale * least);
        let renderer =
            make(&[("lookup_size", "0"), ("global_lookup_radius", &radius), ("caustic_lookup_radius", &radius)]);
        (renderer, weight)
    };
    let renderers = TO_RADIUS_ZERO.map(at_radius);
    let mut moments = [Moments::default(); 5];
    for number in 0..replicates {
        let mut sums = [0.0; 5];
        for (renderer, weight) in &renderers {
            // All three radii use the same photons and the same samples.
            let parts = parts(renderer, Replicate { seed: 94, number, samples });
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += weight * part);
        }
        moments.iter_mut().zip(sums).for_each(|(moments, sum)| moments.push(sum));
    }
    moments
}

/// The film means of a weighted sum of the channels: of the four path classes, then of the image.
fn parts(renderer: &Renderer, replicate: Replicate) -> [f64; 5] {
    let image = renderer.render(replicate, &|_| {}).image();
    let mean = |prefix: &str| {
        let channel = |name: &str, weight: f64| {
            let plane = image.channel(&format!("{prefix}{name}")).expect("the image has a layer for each class");
            weight * plane.iter().map(|&x| f64::from(x)).sum::<f64>() / plane.len() as f64
        };
        channel("R", 0.5) + channel("G", 0.3) + channel("B", 0.2)
    };
    let [direct, specular, caustic, indirect] = PathClass::ALL.map(|class| mean(&format!("{}.", class.name())));
    [direct, specular, caustic, indirect, mean("")]
}

/// A room with differently coloured walls, an area light, glass, a mirror and a rough metal.
fn glass_room() -> String {
    let wall = |colour: &str, transform: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="1.5"/>{transform}</transform>
               <bsdf type="diffuse"><rgb name="reflectance" value="{colour}"/></bsdf></shape>"#
        )
    };
    let walls = [
        wall("0.7, 0.6, 0.5", ""),
        wall("0.6, 0.7, 0.7", r#"<rotate x="1" angle="180"/><translate z="3"/>"#),
        wall("0.7, 0.2, 0.1", r#"<rotate y="1" angle="90"/><translate x="-1.5" z="1.5"/>"#),
        wall("0.1, 0.3, 0.7", r#"<rotate y="1" angle="-90"/><translate x="1.5" z="1.5"/>"#),
        wall("0.5, 0.6, 0.4", r#"<rotate x="1" angle="90"/><translate y="1.5" z="1.5"/>"#),
    ];
    walls.concat()
        + r#"<shape type="rectangle"><transform name="to_world"><scale value="0.6"/><rotate x="1" angle="180"/>
               <translate x="0.2" y="-0.2" z="2.9"/></transform><emitter type="area"><rgb name="radiance" value="9, 7, 4"/></emitter></shape>
             <shape type="sphere"><point name="center" x="-0.6" y="-0.3" z="0.7"/><float name="radius" value="0.6"/>
               <bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
             <shape type="sphere"><point name="center" x="0.7" y="0.5" z="0.6"/><float name="radius" value="0.5"/>
               <bsdf type="conductor"><rgb name="specular_reflectance" value="0.9, 0.8, 0.6"/></bsdf></shape>
             <shape type="sphere"><point name="center" x="0.6" y="-0.6" z="0.3"/><float name="radius" value="0.3"/>
               <bsdf type="metal"><rgb name="reflectance" value="0.6, 0.7, 0.9"/><float name="roughness" value="0.9"/></bsdf></shape>"#
}

fn black(_: Effort) -> Vec<Finding> {
    let light = |integrator| -> f64 {
        let renderer = renderer(&pane::scene(), &pinhole(FILTER), integrator, &[]);
        renderer.render(Replicate { seed: 95, number: 0, samples: 64 }, &|_| {}).means().as_flattened().iter().sum()
    };
    let finding = |integrator| Finding::value(integrator, light(integrator), 0.0, 0.0);
    let mut findings: Vec<_> = ["path", "ptracer"].map(finding).into();
    // Photon mapping shows that the lit floor is in the camera's view.
    let is_lit = f64::from(light("photonmapper") > 1e-3);
    findings.push(Finding::value("photonmapper, whether it shows light there", is_lit, 1.0, 0.0));
    findings
}

fn split(effort: Effort) -> Vec<Finding> {
    const NAMES: [&str; 5] = ["direct", "specular", "caustic", "indirect", "sum"];
    /// Relative equivalence bounds of each class, as tight as the noise at the standard effort allows.
    const BOUNDS: [f64; 5] = [0.01, 0.04, 0.04, 0.03, 0.015];
    const BOUNDS_OF_MAPS: [f64; 5] = [0.02, 0.04, 0.04, 0.03, 0.02];
    const BOUND_BY_NEAREST: f64 = 0.03;
    const REPLICATES: u32 = 24;
    let (scene, sensor) = (glass_room(), pinhole(FILTER));
    let depth = ("max_depth", "6");
    let replicates = u64::from(effort.samples(REPLICATES));
    let path = renderer(&scene, &sensor, "path", &[depth, ("path_classes", "true")]);
    let mut truth = [Moments::default(); 5];
    for number in 0..replicates {
        let parts = parts(&path, Replicate { seed: 93, number, samples: 1024 });
        truth.iter_mut().zip(parts).for_each(|(moments, part)| moments.push(part));
    }
    let methods: [(&str, [f64; 5], Params<'_>); 4] = [
        ("traced and gathered", BOUNDS, &[]),
        ("all from the map", BOUNDS_OF_MAPS, &[("direct", "map"), ("indirect", "map")]),
        ("shadow photons", BOUNDS_OF_MAPS, &[("direct", "shadow_photons"), ("indirect", "map")]),
        ("several rays with importance", BOUNDS, &[("gather_samples", "3"), ("gather_importance", "true")]),
    ];
    let mut findings = Vec::new();
    for (method, bounds, params) in methods {
        let photons = [depth, ("global_photons", "20000"), ("caustic_photons", "20000")];
        let make =
            |radius: Params<'_>| renderer(&scene, &sensor, "photonmapper", &[&photons[..], params, radius].concat());
        let found = extrapolated(make, 0.06, 64, replicates);
        for (i, part) in NAMES.iter().enumerate() {
            let subject = format!("{method}, {part}");
            let bound = effort.bound(REPLICATES, bounds[i]);
            findings.push(Finding::equivalent(subject, &estimate(&found[i]), &estimate(&truth[i]), bound));
        }
    }
    let (ours, truth) = (by_nearest(&scene, &sensor, replicates), estimate(&truth[4]));
    findings.push(Finding::equivalent("50 nearest, sum", &ours, &truth, effort.bound(REPLICATES, BOUND_BY_NEAREST)));
    findings
}

/// The mean of the image with the default lookup of 50 photons, without extrapolation. The map is dense, so the bias is
/// small.
fn by_nearest(scene: &str, sensor: &str, replicates: u64) -> Estimate {
    let params = [("max_depth", "6"), ("global_photons", "60000"), ("caustic_photons", "60000")];
    let renderer = renderer(scene, sensor, "photonmapper", &params);
    let sums = (0..replicates).map(|number| parts(&renderer, Replicate { seed: 96, number, samples: 32 })[4]);
    estimate(&sums.collect())
}

fn estimate(moments: &Moments) -> Estimate {
    Estimate::from_moments(moments).expect("there are two replicates or more")
}
