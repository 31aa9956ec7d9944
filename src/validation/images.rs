//! The laws of rendered images: pixel coverage, AOVs and the wireframe.

use glam::{DVec2, DVec3};

use crate::{
    film::splats,
    law::{Check, Effort, Finding, Law, worst},
    render::{Renderer, Replicate},
    stats::Moments,
    validation::setup,
};

/// The laws of images.
pub const LAWS: &[Law] = &[
    Law {
        name: "film/coverage",
        claim: "A pixel's value is the fraction of the pixel that an emissive rectangle covers, on the whole film and on a crop.",
        source: "areas of rectangles",
        check: Check::Analytic(coverage),
    },
    Law {
        name: "film/aov",
        claim: "The AOVs of a sphere are exact in each sample: a position on the sphere inside the pixel, its depth from the near plane, \
                and its normals. Image layers are means over samples and 0 where no surface is hit. The sample count matches the \
                render.",
        source: "the equation of the sphere and the projection of its points, sample by sample",
        check: Check::Analytic(aov),
    },
    Law {
        name: "film/wireframe",
        claim: "The wireframe layer draws the edges of a triangle that faces the camera as lines half a pixel wide, inside the triangle.",
        source: "the area within d, half a pixel, of the edges is the fraction 1 - (1 - d / ρ)² of a triangle of inradius ρ",
        check: Check::Analytic(wireframe),
    },
];

const SIZE: DVec2 = DVec2::new(12.0, 8.0);
const NEAR: f64 = 0.5;
const DISTANCE: f64 = 6.0;

/// A renderer whose camera is on the z axis at the distance `DISTANCE` from the origin and looks at it.
///
/// The film covers 6 by 4 units at the origin.
fn renderer(integrator: &str, crop: &str, scene: &str) -> Renderer {
    let fov = 2.0 * (3.0 / DISTANCE).atan().to_degrees();
    let sensor = format!(
        r#"<sensor type="perspective"><float name="fov" value="{fov}"/>
           <float name="near_clip" value="{NEAR}"/>
           <transform name="to_world"><lookat origin="0, 0, {DISTANCE}" target="0, 0, 0" up="0, 1, 0"/></transform>
           <film type="hdrfilm"><integer name="width" value="{}"/><integer name="height" value="{}"/>{crop}
           <rfilter type="box"/></film></sensor>"#,
        SIZE.x, SIZE.y
    );
    setup::renderer(integrator, &sensor, scene)
}

const CROP: &str = r#"<integer name="crop_offset_x" value="2"/><integer name="crop_offset_y" value="1"/>
    <integer name="crop_width" value="7"/><integer name="crop_height" value="6"/>"#;

/// The projection of a point to the film, in pixels: x to the right, y down, two pixels per unit at the origin.
fn image_of(p: DVec3) -> DVec2 {
    let scale = 2.0 * DISTANCE / (DISTANCE - p.z);
    0.5 * SIZE + scale * DVec2::new(p.x, -p.y)
}

fn coverage(effort: Effort) -> Vec<Finding> {
    // The rectangle covers the columns 3.3 to 7.8 and the rows 2.6 to 5.1.
    let (from, to) = (DVec2::new(3.3, 2.6), DVec2::new(7.8, 5.1));
    let (middle, half) = (0.5 * (from + to) - 0.5 * SIZE, 0.5 * (to - from));
    let scene = format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale x="{}" y="{}"/><translate x="{}" y="{}"/></transform>
           <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#,
        0.5 * half.x,
        0.5 * half.y,
        0.5 * middle.x,
        -0.5 * middle.y
    );
    let mut findings = Vec::new();
    for (name, crop) in [("whole", ""), ("crop", CROP)] {
        let renderer = renderer(r#"<integrator type="path"/>"#, crop, &scene);
        let crop = renderer.scene.sensor.film.rendered();
        let mut values = [0.0; 3];
        for y in 0..crop.height {
            for x in 0..crop.width {
                let low = DVec2::new(f64::from(crop.x + x), f64::from(crop.y + y));
                let overlap = (to.min(low + 1.0) - from.max(low)).max(DVec2::ZERO);
                let replicate = Replicate { seed: 80, number: 0, samples: effort.samples(2000) };
                let mut rendering = renderer.begin(replicate);
                let mut sample = |i| rendering.sample((x, y), i, &mut values, &mut splats::Path::default()).x;
                let shown: Moments = (0..replicate.samples).map(&mut sample).collect();
                findings.push(Finding::mean(format!("{name}, pixel ({x}, {y})"), &shown, overlap.x * overlap.y));
            }
        }
    }
    findings
}

const CENTRE: DVec3 = DVec3::new(0.4, -0.3, 0.8);
const RADIUS: f64 = 1.2;

fn aov(_: Effort) -> Vec<Finding> {
    let integrator = r#"<integrator type="aov"><string name="aovs" value="d:depth, p:position, c:sample_count, n:sh_normal, g:geo_normal"/>
        </integrator>"#;
    let scene = format!(
        r#"<shape type="sphere"><point name="center" x="{}" y="{}" z="{}"/><float name="radius" value="{RADIUS}"/></shape>"#,
        CENTRE.x, CENTRE.y, CENTRE.z
    );
    let renderer = renderer(integrator, CROP, &scene);
    let replicate = Replicate { seed: 81, number: 0, samples: 16 };
    let mut findings =
        worst(1e-9, |note| for_samples(&renderer, replicate, |pixel, values| check_sample(pixel, values, note)));
    findings.extend(means(&renderer, replicate));
    findings
}

/// Visits the values of every sample of every pixel: three channels of the image, which is black, then the layers.
fn for_samples(renderer: &Renderer, replicate: Replicate, mut visit: impl FnMut((u32, u32), &[f64])) {
    let crop = renderer.scene.sensor.film.rendered();
    let mut values = vec![0.0; renderer.film().stride()];
    let mut rendering = renderer.begin(replicate);
    for pixel in (0..crop.height).flat_map(|y| (0..crop.width).map(move |x| (x, y))) {
        for i in 0..replicate.samples {
            rendering.sample(pixel, i, &mut values, &mut splats::Path::default());
            visit((crop.x + pixel.0, crop.y + pixel.1), &values);
        }
    }
}

fn check_sample((x, y): (u32, u32), values: &[f64], note: &mut dyn FnMut(&str, f64)) {
    let [depth, position, shading, true_normal] = [3, 4, 7, 10].map(|first| &values[first..]);
    if depth[0] == 0.0 {
        note("no surface", values.iter().map(|value| value.abs()).sum());
        return;
    }
    let p = DVec3::from_slice(position);
    let n = (p - CENTRE) / RADIUS;
    note("position", (n.length() - 1.0).abs());
    let within = image_of(p) - DVec2::new(f64::from(x), f64::from(y)) - 0.5;
    note("pixel", (within.abs().max_element() - 0.5).max(0.0));
    note("sh_normal", DVec3::from_slice(shading).distance(n));
    note("geo_normal", DVec3::from_slice(true_normal).distance(n));
    // The ray starts where it crosses the near plane.
    let offset = p - DISTANCE * DVec3::Z;
    let before = NEAR * offset.length() / -offset.z;
    note("depth", (depth[0] + before - offset.length()).abs());
}

/// Compares the image's channels with the means of the samples, to the precision of `f32`.
fn means(renderer: &Renderer, replicate: Replicate) -> Vec<Finding> {
    let image = renderer.render(replicate, &|_| {}).image();
    let channels = ["d.T", "p.X", "p.Y", "p.Z", "n.X", "n.Y", "n.Z", "g.X", "g.Y", "g.Z"];
    let width = image.crop.width;
    let mut sums = vec![[0.0; 10]; image.crop.width as usize * image.crop.height as usize];
    for_samples(renderer, replicate, |(x, y), values| {
        let pixel = (y - image.crop.y) * width + x - image.crop.x;
        sums[pixel as usize]
            .iter_mut()
            .zip(&values[3..])
            .for_each(|(sum, value)| *sum += value / f64::from(replicate.samples));
    });
    let of_channel = |(i, name): (usize, &str)| {
        let plane = image.channel(name).expect("the image has the requested channels");
        let errors = plane.iter().zip(&sums).map(|(value, sum)| (f64::from(*value) - sum[i]).abs());
        Finding::error(format!("mean of {name}"), errors.fold(0.0, f64::max), 1e-6)
    };
    let counts = image.channel("c.N").expect("the image has the requested channels");
    let miscounted = counts.iter().filter(|count| f64::from(**count) != f64::from(replicate.samples)).count();
    let mut findings: Vec<_> = channels.into_iter().enumerate().map(of_channel).collect();
    findings.push(Finding::error("sample_count", miscounted as f64, 0.0));
    findings
}

fn wireframe(effort: Effort) -> Vec<Finding> {
    let corners = [DVec3::new(-2.0, -1.2, 0.0), DVec3::new(1.8, -1.0, 0.0), DVec3::new(0.5, 1.5, 0.0)];
    let points =
        corners.iter().enumerate().map(|(i, p)| format!(r#"<point name="p{i}" x="{}" y="{}" z="0"/>"#, p.x, p.y));
    let scene = format!(r#"<shape type="triangle">{}</shape>"#, points.collect::<String>());
    let aov = r#"<integrator type="aov"><string name="aovs" value="edges:wireframe"/></integrator>"#;
    let renderer = renderer(aov, "", &scene);
    let [a, b, c] = corners;
    let area = 0.5 * (b - a).cross(c - a).length();
    let inradius = 2.0 * area / (a.distance(b) + b.distance(c) + c.distance(a));
    // A unit has two pixels.
    let half_pixel = 0.25;
    let band = area * (1.0 - (1.0 - half_pixel / inradius).powi(2));
    let total = |number: u64| {
        let image = renderer.render(Replicate { seed: 5, number, samples: 64 }, &|_| {}).image();
        let layer = image.channel("edges.Y").expect("the image has the layer");
        layer.iter().map(|&y| f64::from(y)).sum::<f64>() / 4.0
    };
    let totals: Moments = (0..u64::from(effort.samples(32))).map(total).collect();
    vec![Finding::mean("a triangle, area of the lines", &totals, band)]
}
