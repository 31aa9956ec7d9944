//! The laws of photon emission and of photon maps, in scenes with known answers.

use std::{f64::consts::PI, num::NonZeroUsize};

use glam::DVec3;

use crate::{
    law::{Check, Effort, Finding, Law},
    math::{Ray, Rgb, luminance},
    photon::{EmittedPhotons, EstimateParameters, GatherPoint, Kernel, PhotonMap, PhotonMapKind, trace_photons},
    scene::Scene,
    stats::Moments,
    transport::{PathClass, PathLimits},
    validation::setup::{CHANNELS, scene},
};

/// The laws of photon maps.
pub const LAWS: &[Law] = &[
    Law {
        name: "photon-map/stored",
        claim: "In a closed room of albedo ρ an emitted photon is stored 1/(1-ρ) times on average, and the stored power is Φ/(1-ρ) in each \
                channel. The first stored photon of each path is direct light, with the total power Φ.",
        source: "geometric series; Jensen 2001, section 5.2",
        check: Check::Analytic(stored),
    },
    Law {
        name: "photon-map/glass",
        claim: "All power that a light inside a glass sphere emits leaves the sphere: photon power is not scaled by 1/η².",
        source: "conservation of energy; Veach 1997, section 5.2",
        check: Check::Analytic(glass),
    },
    Law {
        name: "photon-map/uniform",
        claim: "The estimate of a uniform irradiance is unbiased, from the k nearest photons and from all photons within a radius, with \
                each kernel, at 0 and 60 degrees of incidence: inside a rectangle, on and near its edge, in its corner, and beside a \
                step to another rectangle.",
        source: "the k - 1 nearest points of a Poisson process are uniformly distributed within the distance of the k-th",
        check: Check::Analytic(uniform),
    },
    Law {
        name: "photon-map/knn-normalization",
        claim: "The textbook estimate k / πr² is too bright by the factor k / (k - 1): by 25 %, 5.3 % and 2.0 % for 5, 20 and 50 photons.",
        source: "E[1 / r²] of a Poisson process; measured from a sorted list of distances",
        check: Check::Analytic(textbook),
    },
    Law {
        name: "photon-map/thin-wall",
        claim: "The back of a thin wall that is lit from its front is black, whether the wall is one surface or two. A wall whose \
                plane contains the light is black too.",
        source: "opaque walls transmit nothing",
        check: Check::Analytic(thin_wall),
    },
    Law {
        name: "photon-map/kind",
        claim: "Photons emitted towards specular surfaces bring the same caustic power, in each channel, as photons emitted in all \
                directions. This holds for each type of emitter, and where bounding spheres of specular surfaces overlap.",
        source: "importance sampling",
        check: Check::Analytic(kind),
    },
];

const UNLIMITED: PathLimits = PathLimits { max_depth: u32::MAX, rr_depth: 1 };

/// Applies `measure` to each of `times` independent sets of photons.
fn each<T>(
    scene: &Scene,
    kind: PhotonMapKind,
    emitted: u64,
    times: u32,
    measure: impl Fn(&EmittedPhotons) -> T,
) -> Vec<T> {
    (0..times)
        .map(|replicate| measure(&trace_photons(scene, kind, emitted, UNLIMITED, [17, u64::from(replicate), 0])))
        .collect()
}

/// Tests the mean of each channel.
fn means(subject: &str, values: &[Rgb], expected: Rgb) -> Vec<Finding> {
    let channel = |i: usize| {
        let moments: Moments = values.iter().map(|value| value[i]).collect();
        let subject = format!("{subject}, {}", CHANNELS[i]);
        // Without random scattering all photons have equal powers, rounded to f32. A test of the mean needs variance.
        if values.iter().all(|value| (value[i] - moments.mean).abs() < 1e-7 * moments.mean) {
            return Finding::value(subject, moments.mean, expected[i], 1e-7 * expected[i]);
        }
        Finding::mean(subject, &moments, expected[i])
    };
    (0..3).map(channel).collect()
}

fn diffuse(albedo: Rgb) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{}, {}, {}"/></bsdf>"#, albedo.x, albedo.y, albedo.z)
}

fn stored(effort: Effort) -> Vec<Finding> {
    let (intensity, radiance) = (Rgb::new(3.0, 1.0, 0.4), Rgb::new(0.3, 2.0, 1.0));
    let times = effort.samples(32);
    let mut findings = Vec::new();
    for (name, albedo) in [("grey", Rgb::splat(0.6)), ("coloured", Rgb::new(0.2, 0.5, 0.8))] {
        let lamp = format!(
            r#"<shape type="sphere"><float name="radius" value="1.7"/><boolean name="flip_normals" value="true"/>{}</shape>
               <emitter type="point"><point name="position" x="0.6" y="-0.9" z="0.3"/>
               <rgb name="intensity" value="3, 1, 0.4"/></emitter>"#,
            diffuse(albedo)
        );
        let emitted = format!(
            r#"<shape type="cube"><transform name="to_world"><scale x="1.7" y="0.8" z="1.1"/></transform>
               <boolean name="flip_normals" value="true"/>{}
               <emitter type="area"><rgb name="radiance" value="0.3, 2, 1"/></emitter></shape>"#,
            diffuse(albedo)
        );
        let area = 8.0 * (1.7 * 0.8 + 0.8 * 1.1 + 1.1 * 1.7);
        for (room, parts, power) in
            [("lamp in a sphere", lamp, 4.0 * PI * intensity), ("emitted box", emitted, PI * area * radiance)]
        {
            let subject = format!("{room}, {name}");
            let found = each(&scene(&parts), PhotonMapKind::Global, 4096, times, |emitted| {
                let statistics = PathClass::ALL.map(|class| emitted.statistics(class));
                let count = statistics.iter().map(|class| class.stored).sum::<u64>() as f64 / emitted.emitted as f64;
                (count, statistics.iter().map(|class| class.power).sum::<Rgb>(), statistics[0].power)
            });
            let column = |value: fn(&(f64, Rgb, Rgb)) -> Rgb| found.iter().map(value).collect::<Vec<_>>();
            findings.extend(means(&format!("{subject}, power"), &column(|f| f.1), power / (Rgb::ONE - albedo)));
            findings.extend(means(&format!("{subject}, direct power"), &column(|f| f.2), power));
            if name == "grey" {
                let counts: Moments = found.iter().map(|(count, ..)| *count).collect();
                findings.push(Finding::mean(format!("{subject}, count"), &counts, 1.0 / (1.0 - albedo.x)));
            }
        }
    }
    findings
}

fn glass(effort: Effort) -> Vec<Finding> {
    let parts = r#"<shape type="sphere"><float name="radius" value="3"/><boolean name="flip_normals" value="true"/>
            <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></shape>
        <shape type="sphere"><bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
        <emitter type="point"><point name="position" x="0.3" y="0.2" z="-0.4"/><rgb name="intensity" value="2, 1, 0.5"/></emitter>"#;
    let power = 4.0 * PI * Rgb::new(2.0, 1.0, 0.5);
    let found = each(&scene(parts), PhotonMapKind::Global, 4096, effort.samples(16), |emitted| {
        (emitted.statistics(PathClass::Caustic).power, emitted.statistics(PathClass::Direct).power)
    });
    let caustic: Vec<_> = found.iter().map(|(caustic, _)| *caustic).collect();
    let direct: Vec<_> = found.iter().map(|(_, direct)| *direct).collect();
    let mut findings = means("through the glass", &caustic, power);
    findings.extend(means("past the glass", &direct, Rgb::ZERO));
    findings
}

/// A scene with parallel light at an angle of incidence on the square from -1 to 1, and the square's irradiance.
fn sunlit(degrees: f64) -> (Scene, Rgb) {
    let (sin, cos) = degrees.to_radians().sin_cos();
    // The second square is lower by so little that a lookup sphere reaches it.
    let parts = format!(
        r#"<emitter type="directional"><vector name="direction" x="{}" y="{}" z="{}"/>
             <rgb name="irradiance" value="1, 3, 0.2"/></emitter>
           <shape type="rectangle">{}</shape>
           <shape type="rectangle"><transform name="to_world"><translate x="-2" y="0" z="-0.001"/></transform>{}</shape>"#,
        0.6 * sin,
        0.8 * sin,
        -cos,
        diffuse(Rgb::splat(0.5)),
        diffuse(Rgb::splat(0.5))
    );
    (scene(&parts), Rgb::new(1.0, 3.0, 0.2) * cos)
}

/// The gather point where a ray intersects the scene.
fn gather_point(scene: &Scene, origin: DVec3, direction: DVec3) -> GatherPoint {
    let si = scene.intersect(&Ray::new(origin, direction)).expect("the ray intersects a surface");
    GatherPoint::new(scene, &si)
}

fn irradiance(map: &PhotonMap, point: &GatherPoint, lookup: &EstimateParameters) -> Rgb {
    let mut sum = Rgb::ZERO;
    map.for_each_nearby(point, lookup, |nearby| sum += nearby.photon.power() * nearby.density);
    sum
}

fn uniform(effort: Effort) -> Vec<Finding> {
    const POINTS: [(&str, f64, f64); 5] = [
        ("inside", 0.1, -0.2),
        ("near an edge", 0.95, 0.3),
        ("on an edge", 0.1, 0.999_999),
        ("in a corner", 0.999_999, 0.999_999),
        ("beside a step", -0.99, 0.2),
    ];
    let nearest = |k| EstimateParameters { nearest: NonZeroUsize::new(k), radius: 1.0, kernel: Kernel::Constant };
    let mut lookups: Vec<(String, EstimateParameters)> =
        [5, 20, 50].map(|k| (format!("{k} nearest"), nearest(k))).into();
    for (name, kernel) in Kernel::ALL {
        lookups.push((format!("20 nearest, {name}"), EstimateParameters { kernel, ..nearest(20) }));
        lookups.push((format!("within 0.1, {name}"), EstimateParameters { nearest: None, radius: 0.1, kernel }));
    }
    lookups.push(("20 nearest within 0.08".into(), EstimateParameters { radius: 0.08, ..nearest(20) }));
    let mut findings = Vec::new();
    for degrees in [0.0, 60.0] {
        let (scene, expected) = sunlit(degrees);
        let points = POINTS.map(|(_, x, y)| gather_point(&scene, DVec3::new(x, y, 1.0), -DVec3::Z));
        let found = each(&scene, PhotonMapKind::Global, 6000, effort.samples(1200), |emitted| {
            let map = PhotonMap::new(&emitted.positions, emitted.photons.clone());
            let at = |point: &GatherPoint| {
                lookups.iter().map(|(_, lookup)| irradiance(&map, point, lookup).y).collect::<Vec<_>>()
            };
            points.iter().map(at).collect::<Vec<_>>()
        });
        for (i, (name, ..)) in POINTS.iter().enumerate() {
            for (j, (lookup, _)) in lookups.iter().enumerate() {
                let moments: Moments = found.iter().map(|estimates| estimates[i][j]).collect();
                findings.push(Finding::mean(format!("{degrees}°, {name}, {lookup}"), &moments, expected.y));
            }
        }
    }
    findings
}

fn textbook(effort: Effort) -> Vec<Finding> {
    let (scene, expected) = sunlit(60.0);
    let ratios = each(&scene, PhotonMapKind::Global, 6000, effort.samples(1200), |emitted| {
        let distance = |p: &[f32; 3]| (f64::from(p[0]) - 0.1).hypot(f64::from(p[1]) + 0.2);
        let mut distances: Vec<f64> = emitted.positions.iter().map(distance).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let power = emitted.photons[0].power().y;
        [5, 20, 50].map(|k| k as f64 * power / (PI * distances[k - 1].powi(2)) / expected.y)
    });
    let finding = |(i, k): (usize, f64)| {
        let moments: Moments = ratios.iter().map(|ratios| ratios[i]).collect();
        Finding::mean(format!("{k} nearest over the truth"), &moments, k / (k - 1.0))
    };
    [5.0, 20.0, 50.0].into_iter().enumerate().map(finding).collect()
}

fn thin_wall(_: Effort) -> Vec<Finding> {
    let two_sided = format!(r#"<bsdf type="twosided">{}</bsdf>"#, diffuse(Rgb::new(0.8, 0.5, 0.3)));
    let parts = |wall: &str| {
        format!(
            r#"<emitter type="point"><point name="position" x="0.2" y="0.3" z="2"/><rgb name="intensity" value="5, 3, 2"/></emitter>
               {wall}"#
        )
    };
    let rectangle = parts(&format!(r#"<shape type="rectangle">{two_sided}</shape>"#));
    let slab = parts(&format!(
        r#"<shape type="cube"><transform name="to_world"><scale x="1" y="1" z="0.0001"/></transform>{two_sided}</shape>"#
    ));
    let shell = parts(&format!(
        r#"<shape type="sphere"><float name="radius" value="1.5"/>{two_sided}</shape>
           <shape type="sphere"><float name="radius" value="1.499"/>{two_sided}</shape>"#
    ));
    let corner = parts(&format!(
        r#"<shape type="rectangle">{two_sided}</shape><shape type="rectangle"><transform name="to_world">
           <rotate y="1" angle="90"/><translate x="0.2" y="0" z="1"/></transform>{two_sided}</shape>"#
    ));
    let lookup = EstimateParameters { nearest: NonZeroUsize::new(50), radius: 0.3, kernel: Kernel::Constant };
    let mut findings = Vec::new();
    let origins = [("from behind", DVec3::new(0.1, 0.2, -1.0), DVec3::Z)];
    for (name, parts) in [("a rectangle", &rectangle), ("a slab", &slab)] {
        findings.extend(darkness(name, &scene(parts), &lookup, &origins));
    }
    let within = [("from within", DVec3::new(0.1, 0.2, 0.3), DVec3::Z)];
    findings.extend(darkness("a shell of two spheres", &scene(&shell), &lookup, &within));
    let beside = [("the wall in the light's plane", DVec3::new(-0.5, 0.3, 0.01), DVec3::X)];
    findings.extend(darkness("a corner", &scene(&corner), &lookup, &beside));
    findings
}

/// Tests that the irradiance estimate is 0 where each of the rays intersects the scene.
fn darkness(name: &str, scene: &Scene, lookup: &EstimateParameters, rays: &[(&str, DVec3, DVec3)]) -> Vec<Finding> {
    let direct = PathLimits { max_depth: 1, rr_depth: 1 };
    let found = trace_photons(scene, PhotonMapKind::Global, 50_000, direct, [18, 0, 0]);
    let map = PhotonMap::new(&found.positions, found.photons);
    let dark = |(ray, origin, direction): &(&str, DVec3, DVec3)| {
        let found = irradiance(&map, &gather_point(scene, *origin, *direction), lookup);
        Finding::value(format!("{name}, {ray}"), luminance(found), 0.0, 0.0)
    };
    rays.iter().map(dark).collect()
}

fn kind(effort: Effort) -> Vec<Finding> {
    let lights = [
        (
            "point",
            r#"<emitter type="point"><point name="position" x="0.4" y="0.2" z="4"/><rgb name="intensity" value="3, 1, 2"/></emitter>"#,
        ),
        (
            "spot",
            r#"<emitter type="spot"><rgb name="intensity" value="9, 4, 2"/><float name="cutoff_angle" value="24"/>
            <transform name="to_world"><lookat origin="2, 1, 3" target="0, 0, 1" up="0, 1, 0"/></transform></emitter>"#,
        ),
        (
            "directional",
            r#"<emitter type="directional"><vector name="direction" x="0.3" y="-0.2" z="-1"/>
            <rgb name="irradiance" value="1, 2, 3"/></emitter>"#,
        ),
        ("constant", r#"<emitter type="constant"><rgb name="radiance" value="0.3, 0.5, 1"/></emitter>"#),
        (
            "area",
            r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="170"/><translate x="0.5" y="0.2" z="3"/></transform>
            <emitter type="area"><rgb name="radiance" value="3, 2, 1"/></emitter></shape>"#,
        ),
        (
            "two",
            r#"<emitter type="point"><point name="position" x="0.4" y="0.2" z="1.1"/><rgb name="intensity" value="3, 1, 2"/></emitter>
            <emitter type="constant"><rgb name="radiance" value="0.3, 0.5, 1"/></emitter>"#,
        ),
    ];
    let things = format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform>{}</shape>
           <shape type="sphere"><point name="center" x="0" y="0" z="1.1"/><bsdf type="dielectric">
             <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
           <shape type="sphere"><point name="center" x="0.9" y="0.3" z="0.6"/><float name="radius" value="0.4"/>
             <bsdf type="conductor"><rgb name="specular_reflectance" value="0.9, 0.6, 0.3"/></bsdf></shape>"#,
        diffuse(Rgb::splat(0.5))
    );
    let times = effort.samples(24);
    let mut findings = Vec::new();
    for (name, light) in lights {
        let scene = scene(&format!("{light}{things}"));
        let trace = |kind| each(&scene, kind, 8192, times, |emitted| emitted.statistics(PathClass::Caustic).power);
        let (aimed, everywhere) = (trace(PhotonMapKind::Caustic), trace(PhotonMapKind::Global));
        for (i, channel) in CHANNELS.iter().enumerate() {
            let of = |values: &[Rgb]| values.iter().map(|value| value[i]).collect::<Moments>();
            findings.push(Finding::equal_means(format!("{name}, {channel}"), &of(&aimed), &of(&everywhere)));
        }
    }
    findings
}
