//! The laws of all shapes, checked on every example of every plugin and on some meshes.
//!
//! Many of them are integral geometry. For uniform, isotropic lines through a sphere of radius `R`, the expected sum of
//! `f` over the points at which a line crosses a surface inside the sphere is `∫ f dA / 2πR²`. Hence hits give areas,
//! volumes and moments independently of the shapes' own sampling.

pub mod csg;
pub mod mesh;
mod subjects;

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use subjects::{Subject, subjects};

use super::{ShapeModel as _, ShapeSample, Shapes, Surface};
use crate::{
    law::{Check, Effort, Finding, Law, worst},
    math::{Frame, PerArea, Ray, rng::Stream, warp},
    stats::Moments,
};

/// The laws of all shapes.
pub const LAWS: &[Law] = &[
    Law {
        name: "shape/hits-on-surface",
        claim: "Hit points satisfy the shape's equation and lie at the ray's parameter.",
        source: "the canonical equations in shape space; for meshes, the nearest triangle",
        check: Check::Analytic(hits_on_surface),
    },
    Law {
        name: "shape/bounds",
        claim: "Every hit lies in the shape's bounding box.",
        source: "definition",
        check: Check::Analytic(bounds),
    },
    Law {
        name: "shape/occlusion",
        claim: "For any range of the parameter and directions of any length, the first hit of a ray is the first of all its \
                hits in the range, also in a hierarchy over two copies of the shape. The ray is occluded if and only if \
                there is a hit in the range.",
        source: "definition",
        check: Check::Analytic(occlusion),
    },
    Law {
        name: "shape/normals",
        claim: "The normal is perpendicular to the plane through neighbouring hits. Normals and the axes of shading frames \
                have unit length.",
        source: "central differences over 2e-5 radii; their error is about ε²κ²/cos⁵ < 1e-5",
        check: Check::Analytic(normals),
    },
    Law {
        name: "shape/uv",
        claim: "The texture coordinates of hits and of sampled points match the shape's parametrization.",
        source: "the parametrizations of Mitsuba 3.9, derived by hand: azimuth and polar angle, height or radius; the corners \
                 of squares",
        check: Check::Analytic(texture_coordinates),
    },
    Law {
        name: "shape/entering-leaving",
        claim: "A line enters and leaves a closed shape alternately, and equally often.",
        source: "topology",
        check: Check::Analytic(entering_leaving),
    },
    Law {
        name: "shape/area-pdf",
        claim: "Points are sampled on the surface with the stated pdf: the estimates of ∫ f dA for f = 1, x, y, z and their \
                products equal those by random lines.",
        source: "Crofton's formula; Santaló 2004, section 14.4; areas in closed form and by quadrature of |∂u × ∂v|",
        check: Check::Analytic(pdf_position),
    },
    Law {
        name: "shape/sampled-points",
        claim: "A sampled point has the same normal, texture coordinates and pdf as the hit of a ray at that point.",
        source: "definition",
        check: Check::Analytic(sampled_points),
    },
    Law {
        name: "shape/pdf-towards",
        claim: "Points are sampled from a viewpoint with the stated pdf per solid angle: the estimates of ∫ f dω over the \
                visible surface for f = 1, the direction and the pdf itself equal those by uniform directions.",
        source: "uniform directions in the cone around the bounding sphere",
        check: Check::Analytic(pdf_direction),
    },
    Law {
        name: "shape/line-volume",
        claim: "Random lines give the volume: it is πR² times the mean sum of the chords, and 4πR²/6 times the mean sum of \
                x·n over the hits.",
        source: "Cauchy and Crofton; Santaló 2004, section 14.4; Gauss's theorem for x·n",
        check: Check::Analytic(line_volume),
    },
    Law {
        name: "shape/mean-chord",
        claim: "The mean chord of a convex body is 4 V / S.",
        source: "Cauchy 1850; Santaló 2004, section 14.3; ellipsoid (1.2, 0.8, 0.5): 0.944828894",
        check: Check::Analytic(mean_chord),
    },
];

/// The subjects that can be area lights.
fn emitter_subjects() -> Vec<Subject> {
    subjects().into_iter().filter(|subject| subject.shape.not_an_emitter_because().is_none()).collect()
}

/// Visits the crossings of many random lines with each subject.
fn for_crossings(seed: u64, effort: Effort, mut visit: impl FnMut(&Subject, &Ray, &[(f64, Surface)])) {
    for subject in &subjects() {
        for_crossings_of(subject, seed, effort, |ray, crossings| visit(subject, ray, crossings));
    }
}

/// Visits the crossings of many random lines with one subject.
fn for_crossings_of(subject: &Subject, seed: u64, effort: Effort, mut visit: impl FnMut(&Ray, &[(f64, Surface)])) {
    let mut stream = Stream::at(&[seed]);
    for _ in 0..effort.samples(3000) {
        let ray = subject.line(&mut stream);
        visit(&ray, &subject.crossings(&ray));
    }
}

fn hits_on_surface(effort: Effort) -> Vec<Finding> {
    worst(1e-12, |note| {
        for_crossings(20, effort, |subject, ray, crossings| {
            let (_, radius) = subject.sphere();
            for (t, surface) in crossings {
                // For grazing rays the parameter has a larger error than the surface point.
                let cos = surface.n.dot(ray.direction.normalize()).abs();
                note(&subject.name, (ray.at(*t) - surface.p).length() * cos.min(1.0) / radius);
                if let Some(known) = &subject.known {
                    note(&subject.name, (known.equation)(surface.p));
                }
            }
        });
    })
}

fn bounds(effort: Effort) -> Vec<Finding> {
    worst(1e-12, |note| {
        for_crossings(21, effort, |subject, _, crossings| {
            let (bounds, (_, radius)) = (subject.shape.bounds(), subject.sphere());
            for (_, surface) in crossings {
                let beyond = (bounds.min - surface.p).max(surface.p - bounds.max).max_element();
                note(&subject.name, beyond.max(0.0) / radius);
            }
        });
    })
}

/// Counts contradictions for ranges that start and end before, between and after the hits.
fn occlusion(effort: Effort) -> Vec<Finding> {
    let mut stream = Stream::at(&[22, 1]);
    worst(0.0, |note| {
        for subject in &subjects() {
            let (_, radius) = subject.sphere();
            let two = Shapes::new(vec![subject.shape.clone(); 2]);
            for_crossings_of(subject, 22, effort, |ray, crossings| {
                let scale = 4.0 * radius / ray.direction.length();
                let (one, other) = (stream.next_1d() * scale, stream.next_1d() * scale);
                let segment = Ray { t_min: one.min(other), t_max: one.max(other), ..*ray };
                let expected = crossings.iter().map(|(t, _)| *t).find(|t| segment.contains(*t));
                let single = subject.shape.intersect(&segment).map(|hit| hit.t);
                let agree = single == expected
                    && two.intersect(&segment).map(|(_, hit)| hit.t) == expected
                    && two.occlude(&segment) == expected.is_some();
                note(&subject.name, f64::from(!agree));
            });
        }
    })
}

fn normals(effort: Effort) -> Vec<Finding> {
    worst(1e-4, |note| {
        for_crossings(23, effort, |subject, ray, crossings| {
            let Some((_, surface)) = crossings.first() else { return };
            let frame = surface.shading;
            let frame_error = frame.n.cross(frame.s).distance(frame.t) + frame.n.dot(frame.s).abs();
            for length in [surface.n, frame.n, frame.s, frame.t].map(DVec3::length) {
                note(&subject.name, 1e6 * (length - 1.0).abs() + 1e6 * frame_error);
            }
            if surface.n.dot(ray.direction.normalize()).abs() > 0.2
                && let Some(n) = normal_by_differences(subject, ray, surface)
            {
                note(&subject.name, n.cross(surface.n).length());
            }
        });
    })
}

fn texture_coordinates(effort: Effort) -> Vec<Finding> {
    let mut stream = Stream::at(&[29]);
    worst(1e-9, |note| {
        for_crossings(29, effort, |subject, _, crossings| {
            let Some(expected) = subject.known.as_ref().and_then(|known| known.uv.as_ref()) else { return };
            let mut compare = |p: DVec3, uv: DVec2| {
                let difference = (uv - expected(p)).abs();
                // Azimuths 0 and 1 are the same.
                note(&subject.name, difference.min((1.0 - difference).abs()).max_element());
            };
            crossings.iter().for_each(|(_, surface)| compare(surface.p, surface.uv));
            if subject.shape.not_an_emitter_because().is_none() {
                let sample = subject.shape.sample_position(stream.next_2d());
                compare(sample.p, sample.uv);
            }
        });
    })
}

/// The normal of the plane through four neighbouring hits, or `None` near an edge.
fn normal_by_differences(subject: &Subject, ray: &Ray, surface: &Surface) -> Option<DVec3> {
    let step = 1e-5 * subject.sphere().1;
    let frame = Frame::from_normal(ray.direction.normalize());
    let neighbour = |offset: DVec3| {
        let ray = Ray::new(ray.origin + offset, ray.direction);
        let found = subject.shape.surface(&ray, &subject.shape.intersect(&ray)?);
        // Reject hits on another face, or on another sheet behind a rim.
        (found.primitive == surface.primitive && found.p.distance(surface.p) < 20.0 * step).then_some(found.p)
    };
    let tangent_s = neighbour(step * frame.s)? - neighbour(-step * frame.s)?;
    let tangent_t = neighbour(step * frame.t)? - neighbour(-step * frame.t)?;
    Some(tangent_s.cross(tangent_t).normalize())
}

fn entering_leaving(effort: Effort) -> Vec<Finding> {
    worst(0.0, |note| {
        for_crossings(24, effort, |subject, ray, crossings| {
            if subject.closed().is_some() {
                let sides = crossings.iter().map(|(_, surface)| subject.sign() * surface.n.dot(ray.direction));
                let wrong = sides.enumerate().filter(|(i, side)| (*side > 0.0) != (i % 2 == 1)).count();
                note(&subject.name, (wrong + crossings.len() % 2) as f64);
            }
        });
    })
}

/// The monomials up to the second degree. Coordinates are relative to the bounding sphere.
fn monomials(p: DVec3) -> [f64; 10] {
    [1.0, p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.y * p.z, p.z * p.x]
}

fn pdf_position(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(30_000);
    emitter_subjects().iter().flat_map(|subject| surface_integrals(subject, samples)).collect()
}

/// Compares the integrals of the monomials over the surface, by sampled points and by random lines.
fn surface_integrals(subject: &Subject, samples: u32) -> Vec<Finding> {
    let (centre, radius) = subject.sphere();
    let mut stream = Stream::at(&[25]);
    let mut by_lines = [Moments::default(); 10];
    let mut by_sampling = [Moments::default(); 10];
    for _ in 0..samples {
        let crossings = subject.crossings(&subject.line(&mut stream));
        let values = crossings.iter().map(|(_, surface)| monomials((surface.p - centre) / radius));
        let sums = values.fold([0.0; 10], |sum, f| std::array::from_fn(|i| sum[i] + f[i]));
        let sample = subject.shape.sample_position(stream.next_2d());
        let f = monomials((sample.p - centre) / radius);
        for i in 0..10 {
            by_lines[i].push(TAU * radius * radius * sums[i]);
            by_sampling[i].push(f[i] / sample.pdf.0);
        }
    }
    let name = |i: usize| format!("{}, {}", subject.name, ["1", "x", "y", "z", "x²", "y²", "z²", "xy", "yz", "zx"][i]);
    let mut findings: Vec<_> = (0..10).map(|i| Finding::equal_means(name(i), &by_sampling[i], &by_lines[i])).collect();
    if let Some(area) = subject.known.as_ref().and_then(|known| known.area) {
        findings.push(Finding::mean(format!("{}, area by lines", subject.name), &by_lines[0], area));
        findings.push(area_by_sampling(subject, area, &by_sampling[0]));
    }
    findings
}

/// If the pdf is constant, its inverse is the area without statistical error.
fn area_by_sampling(subject: &Subject, area: f64, estimates: &Moments) -> Finding {
    let name = format!("{}, area by sampling", subject.name);
    if estimates.m2 <= 1e-16 * estimates.mean * estimates.mean {
        return Finding::value(name, estimates.mean, area, 2e-6 * area);
    }
    Finding::mean(name, estimates, area)
}

fn sampled_points(effort: Effort) -> Vec<Finding> {
    worst(1e-6, |note| {
        for subject in &emitter_subjects() {
            let (_, radius) = subject.sphere();
            let mut stream = Stream::at(&[26]);
            for _ in 0..effort.samples(2000) {
                let sample = subject.shape.sample_position(stream.next_2d());
                let ray = Ray::new(sample.p + 1e-3 * radius * sample.n, -sample.n);
                let Some(hit) = subject.shape.intersect(&ray) else {
                    // At a rim the ray may miss.
                    continue;
                };
                let found = subject.shape.surface(&ray, &hit);
                if found.p.distance(sample.p) < 1e-9 * radius {
                    note(&subject.name, difference(&sample, &found, subject.shape.pdf_position(&found)));
                }
            }
        }
    })
}

/// The greatest difference between a sampled point and a hit in their normals, texture coordinates and pdfs.
fn difference(sample: &ShapeSample<PerArea>, found: &Surface, pdf: PerArea) -> f64 {
    // Azimuths 0 and 1 are the same.
    let uv = (sample.uv - found.uv).abs();
    let uv = uv.min((1.0 - uv).abs());
    sample.n.distance(found.n).max(uv.max_element()).max((sample.pdf.0 / pdf.0 - 1.0).abs())
}

/// Viewpoints above, beside and far from a shape, relative to its bounding sphere.
const VIEWPOINTS: [DVec3; 3] = [DVec3::new(0.3, -0.2, 1.1), DVec3::new(-1.5, 0.4, -0.3), DVec3::new(3.0, 4.0, -2.0)];

fn pdf_direction(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(20_000);
    let mut findings = Vec::new();
    for subject in &emitter_subjects() {
        let (centre, radius) = subject.sphere();
        for (i, viewpoint) in VIEWPOINTS.into_iter().enumerate() {
            let view = format!("view {}", i + 1);
            findings.extend(visible_integrals(subject, &view, centre + radius * viewpoint, samples));
        }
        if subject.closed().is_some() {
            findings.extend(visible_integrals(subject, "inside", centre + 0.2 * radius * VIEWPOINTS[0], samples));
        }
    }
    findings
}

/// Compares integrals over the solid angle of the visible surface, by sampled points and by uniform directions.
fn visible_integrals(subject: &Subject, view: &str, from: DVec3, samples: u32) -> Vec<Finding> {
    let cone = Cone::around(subject.sphere(), from);
    let mut stream = Stream::at(&[27]);
    let mut by_sampling = [Moments::default(); 5];
    let mut by_directions = [Moments::default(); 5];
    let mut pdf_error = 0.0_f64;
    for _ in 0..samples {
        let mut values = [0.0; 5];
        let sample = subject.shape.sample_direction(from, stream.next_2d());
        let is_visible = |p: DVec3| subject.shape.intersect(&Ray::between(from, p)).is_none();
        if let Some(sample) = sample.filter(|sample| is_visible(sample.p)) {
            let surface = Surface::flat(sample.p, sample.n, sample.uv, 0);
            let pdf = subject.shape.pdf_direction(from, &surface).0;
            pdf_error = pdf_error.max((sample.pdf.0 / pdf - 1.0).abs());
            values = cone.functions((sample.p - from).normalize(), pdf).map(|f| f / sample.pdf.0);
        }
        by_sampling.iter_mut().zip(values).for_each(|(moments, value)| moments.push(value));
        let mut values = [0.0; 5];
        let ray = Ray::new(from, cone.direction(stream.next_2d()));
        if let Some(hit) = subject.shape.intersect(&ray) {
            let pdf = subject.shape.pdf_direction(from, &subject.shape.surface(&ray, &hit)).0;
            values = cone.functions(ray.direction, pdf).map(|f| f * cone.solid_angle());
        }
        by_directions.iter_mut().zip(values).for_each(|(moments, value)| moments.push(value));
    }
    let name = |what: &str| format!("{}, {view}, {what}", subject.name);
    let mut findings: Vec<_> = (0..5)
        .map(|i| Finding::equal_means(name(["1", "x", "y", "z", "pdf"][i]), &by_sampling[i], &by_directions[i]))
        .collect();
    findings.push(Finding::error(name("pdf of the sample"), pdf_error, 1e-6));
    findings
}

/// The cone of directions from a point to a sphere, or all directions if the point is inside the sphere.
struct Cone {
    frame: Frame,
    one_minus_cos: f64,
}

impl Cone {
    fn around((centre, radius): (DVec3, f64), from: DVec3) -> Self {
        let to_centre = centre - from;
        let sin = radius / to_centre.length();
        let one_minus_cos = if sin < 1.0 { 1.0 - sin.asin().cos() } else { 2.0 };
        Self { frame: Frame::from_normal(to_centre.normalize()), one_minus_cos }
    }

    fn direction(&self, u: DVec2) -> DVec3 {
        self.frame.to_world(warp::square_to_cone(u, self.one_minus_cos))
    }

    fn solid_angle(&self) -> f64 {
        TAU * self.one_minus_cos
    }

    /// The integrands: 1, the components of the direction across and along the cone, and the pdf, clamped to bound the
    /// variance.
    fn functions(&self, direction: DVec3, pdf: f64) -> [f64; 5] {
        let d = self.frame.to_local(direction) / self.one_minus_cos.min(1.0).sqrt();
        [1.0, d.x, d.y, 1.0 - d.z, pdf.min(20.0 / self.solid_angle())]
    }
}

fn line_volume(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(60_000);
    let mut findings = Vec::new();
    for subject in &subjects() {
        let Some((_, volume)) = subject.closed() else { continue };
        let (centre, radius) = subject.sphere();
        let mut stream = Stream::at(&[28]);
        let (mut chords, mut fluxes) = (Moments::default(), Moments::default());
        for _ in 0..samples {
            let ray = subject.line(&mut stream);
            let crossings = subject.crossings(&ray);
            chords.push(PI * radius * radius * chord(&ray, &crossings));
            let flux: f64 = crossings.iter().map(|(_, surface)| (surface.p - centre).dot(surface.n)).sum();
            fluxes.push(2.0 / 3.0 * PI * radius * radius * flux);
        }
        findings.push(Finding::mean(format!("{}, chords", subject.name), &chords, volume));
        findings.push(Finding::mean(format!("{}, x·n", subject.name), &fluxes, subject.sign() * volume));
    }
    findings
}

/// The total length of a line inside a solid, from its alternating crossings.
fn chord(ray: &Ray, crossings: &[(f64, Surface)]) -> f64 {
    crossings.chunks_exact(2).map(|pair| (pair[1].0 - pair[0].0) * ray.direction.length()).sum()
}

fn mean_chord(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(40_000);
    let mut findings = Vec::new();
    for subject in &subjects() {
        let Some((known, volume)) = subject.closed().filter(|(known, _)| known.convex) else { continue };
        let area = known.area.expect("the area of closed shapes is known");
        let mut stream = Stream::at(&[29]);
        let lines = (0..samples).map(|_| subject.line(&mut stream));
        let chords = lines.map(|ray| chord(&ray, &subject.crossings(&ray))).filter(|chord| *chord > 0.0);
        findings.push(Finding::mean(subject.name.clone(), &chords.collect(), 4.0 * volume / area));
        if subject.name == "sphere #2" {
            // The expected values are computed from elliptic integrals, to 9 digits.
            findings.push(Finding::value("ellipsoid, area", area, 8.512_099_114, 1e-5));
            findings.push(Finding::value("ellipsoid, 4 V / S", 4.0 * volume / area, 0.944_828_894, 2e-6));
        }
    }
    findings
}
