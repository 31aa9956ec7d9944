//! What must hold for every shape of the list over all its examples, and for meshes.
//!
//! Much of it is integral geometry: among lines that cross a ball of radius `R`, uniform and isotropic, the expected
//! sum of `f` over the points where a line crosses a surface in the ball is `∫ f dA / 2πR²`. That turns hits into areas,
//! volumes and moments without any of the shapes' own sampling.

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

/// The laws of the list.
pub const LAWS: &[Law] = &[
    Law {
        name: "shape/hits-on-surface",
        claim: "Points that rays meet fulfil the shape's equation and lie at the ray's parameter.",
        source: "the canonical equations, in the space that to_world comes from; for meshes, the nearest triangle",
        check: Check::Analytic(hits_on_surface),
    },
    Law {
        name: "shape/bounds",
        claim: "Every hit lies in the box that the shape states.",
        source: "definition",
        check: Check::Analytic(bounds),
    },
    Law {
        name: "shape/occlusion",
        claim: "Within any range of the parameter and for directions of any length, a ray's first hit is the first of all \
                its hits there, also in the hierarchy of two such shapes; it is occluded if and only if there is one.",
        source: "definition",
        check: Check::Analytic(occlusion),
    },
    Law {
        name: "shape/normals",
        claim: "Normals are those of the plane through neighbouring hits, and have unit length, as have shading frames.",
        source: "central differences over 2e-5 radii; their error is about ε²κ²/cos⁵ < 1e-5",
        check: Check::Analytic(normals),
    },
    Law {
        name: "shape/uv",
        claim: "Texture coordinates are those of the shapes' parametrisations, of hits and of points that are drawn.",
        source: "Mitsuba 3.9's, by hand: azimuth and polar angle, height or radius; the corners of squares",
        check: Check::Analytic(texture_coordinates),
    },
    Law {
        name: "shape/entering-leaving",
        claim: "A line enters and leaves a closed shape in turn, as often the one as the other.",
        source: "topology",
        check: Check::Analytic(entering_leaving),
    },
    Law {
        name: "shape/area-pdf",
        claim: "Points are drawn on the surface with the pdf that is stated: ∫ f dA for f = 1, x, y, z, and their products.",
        source: "Crofton's formula; Santaló 2004, section 14.4; closed areas and areas by quadrature of |∂u × ∂v|",
        check: Check::Analytic(pdf_position),
    },
    Law {
        name: "shape/sampled-points",
        claim: "A drawn point has the normal, the texture coordinates and the pdf that a ray finds there.",
        source: "definition",
        check: Check::Analytic(drawn_points),
    },
    Law {
        name: "shape/pdf-towards",
        claim: "Points seen from elsewhere are drawn with the pdf per solid angle that is stated: ∫ f dω over what is \
                seen, for f = 1, the direction, and the pdf itself.",
        source: "uniform directions in the cone around the bounding sphere",
        check: Check::Analytic(pdf_direction),
    },
    Law {
        name: "shape/line-volume",
        claim: "Chords of random lines give the volume: πR² times the mean sum of chords, and (4πR²/6) times that of x·n.",
        source: "Cauchy and Crofton; Santaló 2004, section 14.4; Gauss's theorem for the second",
        check: Check::Analytic(line_volume),
    },
    Law {
        name: "shape/mean-chord",
        claim: "A convex body's mean chord is 4 V / S.",
        source: "Cauchy 1850; Santaló 2004, section 14.3; ellipsoid (1.2, 0.8, 0.5): 0.944828894",
        check: Check::Analytic(mean_chord),
    },
];

/// The subjects that can be lights.
fn emitted() -> Vec<Subject> {
    subjects().into_iter().filter(|subject| subject.shape.not_an_emitter_because().is_none()).collect()
}

/// Notes errors at the crossings of many lines.
fn for_crossings(seed: u64, effort: Effort, mut visit: impl FnMut(&Subject, &Ray, &[(f64, Surface)])) {
    for subject in &subjects() {
        for_crossings_of(subject, seed, effort, |ray, crossings| visit(subject, ray, crossings));
    }
}

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
            let (_, radius) = subject.ball();
            for (t, surface) in crossings {
                // Where a ray grazes, its parameter is less certain than the surface.
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
            let (bounds, (_, radius)) = (subject.shape.bounds(), subject.ball());
            for (_, surface) in crossings {
                let beyond = (bounds.min - surface.p).max(surface.p - bounds.max).max_element();
                note(&subject.name, beyond.max(0.0) / radius);
            }
        });
    })
}

/// Counts contradictions, with ranges that start and end before, between and beyond the hits.
fn occlusion(effort: Effort) -> Vec<Finding> {
    let mut stream = Stream::at(&[22, 1]);
    worst(0.0, |note| {
        for subject in &subjects() {
            let (_, radius) = subject.ball();
            let two = Shapes::new(vec![subject.shape.clone(); 2]);
            for_crossings_of(subject, 22, effort, |ray, crossings| {
                let scale = 4.0 * radius / ray.direction.length();
                let (one, other) = (stream.next_1d() * scale, stream.next_1d() * scale);
                let part = Ray { t_min: one.min(other), t_max: one.max(other), ..*ray };
                let expected = crossings.iter().map(|(t, _)| *t).find(|t| part.contains(*t));
                let alone = subject.shape.intersect(&part).map(|hit| hit.t);
                let agree = alone == expected
                    && two.intersect(&part).map(|(_, hit)| hit.t) == expected
                    && two.occlude(&part) == expected.is_some();
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
            let skew = frame.n.cross(frame.s).distance(frame.t) + frame.n.dot(frame.s).abs();
            for length in [surface.n, frame.n, frame.s, frame.t].map(DVec3::length) {
                note(&subject.name, 1e6 * (length - 1.0).abs() + 1e6 * skew);
            }
            if surface.n.dot(ray.direction.normalize()).abs() > 0.2
                && let Some(n) = by_differences(subject, ray, surface)
            {
                note(&subject.name, n.cross(surface.n).length());
            }
        });
    })
}

/// The normal of the plane through four neighbouring hits, if no edge is near.
fn texture_coordinates(effort: Effort) -> Vec<Finding> {
    let mut stream = Stream::at(&[29]);
    worst(1e-9, |note| {
        for_crossings(29, effort, |subject, _, crossings| {
            let Some(expected) = subject.known.as_ref().and_then(|known| known.uv.as_ref()) else { return };
            let mut compare = |p: DVec3, uv: DVec2| {
                let apart = (uv - expected(p)).abs();
                // An azimuth of 0 is one of 1.
                note(&subject.name, apart.min((1.0 - apart).abs()).max_element());
            };
            crossings.iter().for_each(|(_, surface)| compare(surface.p, surface.uv));
            if subject.shape.not_an_emitter_because().is_none() {
                let drawn = subject.shape.sample_position(stream.next_2d());
                compare(drawn.p, drawn.uv);
            }
        });
    })
}

fn by_differences(subject: &Subject, ray: &Ray, surface: &Surface) -> Option<DVec3> {
    let step = 1e-5 * subject.ball().1;
    let frame = Frame::from_normal(ray.direction.normalize());
    let beside = |way: DVec3| {
        let ray = Ray::new(ray.origin + way, ray.direction);
        let found = subject.shape.surface(&ray, &subject.shape.intersect(&ray)?);
        // Elsewhere: another face, or another sheet behind a rim.
        (found.primitive == surface.primitive && found.p.distance(surface.p) < 20.0 * step).then_some(found.p)
    };
    let along = beside(step * frame.s)? - beside(-step * frame.s)?;
    let across = beside(step * frame.t)? - beside(-step * frame.t)?;
    Some(along.cross(across).normalize())
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

/// Polynomials up to the second degree, of coordinates in units of the bounding ball.
fn polynomials(p: DVec3) -> [f64; 10] {
    [1.0, p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.y * p.z, p.z * p.x]
}

fn pdf_position(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(30_000);
    emitted().iter().flat_map(|subject| area_of(subject, samples)).collect()
}

fn area_of(subject: &Subject, samples: u32) -> Vec<Finding> {
    let (centre, radius) = subject.ball();
    let mut stream = Stream::at(&[25]);
    let mut by_lines = [Moments::default(); 10];
    let mut by_draws = [Moments::default(); 10];
    for _ in 0..samples {
        let crossings = subject.crossings(&subject.line(&mut stream));
        let values = crossings.iter().map(|(_, surface)| polynomials((surface.p - centre) / radius));
        let sums = values.fold([0.0; 10], |sum, f| std::array::from_fn(|i| sum[i] + f[i]));
        let drawn = subject.shape.sample_position(stream.next_2d());
        let f = polynomials((drawn.p - centre) / radius);
        for i in 0..10 {
            by_lines[i].push(TAU * radius * radius * sums[i]);
            by_draws[i].push(f[i] / drawn.pdf.0);
        }
    }
    let name = |i: usize| format!("{}, {}", subject.name, ["1", "x", "y", "z", "x²", "y²", "z²", "xy", "yz", "zx"][i]);
    let mut findings: Vec<_> = (0..10).map(|i| Finding::equal_means(name(i), &by_draws[i], &by_lines[i])).collect();
    if let Some(area) = subject.known.as_ref().and_then(|known| known.area) {
        findings.push(Finding::mean(format!("{}, area by lines", subject.name), &by_lines[0], area));
        findings.push(area_by_draws(subject, area, &by_draws[0]));
    }
    findings
}

/// Where all points are equally dense, one draw tells the area.
fn area_by_draws(subject: &Subject, area: f64, draws: &Moments) -> Finding {
    let name = format!("{}, area by draws", subject.name);
    if draws.m2 <= 1e-16 * draws.mean * draws.mean {
        return Finding::value(name, draws.mean, area, 2e-6 * area);
    }
    Finding::mean(name, draws, area)
}

fn drawn_points(effort: Effort) -> Vec<Finding> {
    worst(1e-6, |note| {
        for subject in &emitted() {
            let (_, radius) = subject.ball();
            let mut stream = Stream::at(&[26]);
            for _ in 0..effort.samples(2000) {
                let drawn = subject.shape.sample_position(stream.next_2d());
                let ray = Ray::new(drawn.p + 1e-3 * radius * drawn.n, -drawn.n);
                let Some(hit) = subject.shape.intersect(&ray) else {
                    // At a rim the ray may pass by.
                    continue;
                };
                let found = subject.shape.surface(&ray, &hit);
                if found.p.distance(drawn.p) < 1e-9 * radius {
                    note(&subject.name, difference(&drawn, &found, subject.shape.pdf_position(&found)));
                }
            }
        }
    })
}

fn difference(drawn: &ShapeSample<PerArea>, found: &Surface, pdf: PerArea) -> f64 {
    // Longitudes 0 and 1 are the same.
    let apart = (drawn.uv - found.uv).abs();
    let uv = apart.min((1.0 - apart).abs());
    drawn.n.distance(found.n).max(uv.max_element()).max((drawn.pdf.0 / pdf.0 - 1.0).abs())
}

/// From near, from beside and from afar, in units of the bounding ball.
const VIEWPOINTS: [DVec3; 3] = [DVec3::new(0.3, -0.2, 1.1), DVec3::new(-1.5, 0.4, -0.3), DVec3::new(3.0, 4.0, -2.0)];

fn pdf_direction(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(20_000);
    let mut findings = Vec::new();
    for subject in &emitted() {
        let (centre, radius) = subject.ball();
        for (i, viewpoint) in VIEWPOINTS.into_iter().enumerate() {
            findings.extend(seen_from(subject, &format!("view {}", i + 1), centre + radius * viewpoint, samples));
        }
        if subject.closed().is_some() {
            findings.extend(seen_from(subject, "inside", centre + 0.2 * radius * VIEWPOINTS[0], samples));
        }
    }
    findings
}

/// Integrals over what is seen, by its own draws and by uniform directions.
fn seen_from(subject: &Subject, view: &str, from: DVec3, samples: u32) -> Vec<Finding> {
    let cone = Cone::around(subject.ball(), from);
    let mut stream = Stream::at(&[27]);
    let mut by_draws = [Moments::default(); 5];
    let mut by_directions = [Moments::default(); 5];
    let mut apart = 0.0_f64;
    for _ in 0..samples {
        let mut values = [0.0; 5];
        let drawn = subject.shape.sample_direction(from, stream.next_2d());
        if let Some(drawn) = drawn.filter(|drawn| subject.shape.intersect(&Ray::between(from, drawn.p)).is_none()) {
            let surface = Surface::flat(drawn.p, drawn.n, drawn.uv, 0);
            let pdf = subject.shape.pdf_direction(from, &surface).0;
            apart = apart.max((drawn.pdf.0 / pdf - 1.0).abs());
            values = cone.functions((drawn.p - from).normalize(), pdf).map(|f| f / drawn.pdf.0);
        }
        by_draws.iter_mut().zip(values).for_each(|(moments, value)| moments.push(value));
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
        .map(|i| Finding::equal_means(name(["1", "x", "y", "z", "pdf"][i]), &by_draws[i], &by_directions[i]))
        .collect();
    findings.push(Finding::error(name("stated twice"), apart, 1e-6));
    findings
}

/// Directions to a ball, or all of them from inside it.
struct Cone {
    frame: Frame,
    one_minus_cos: f64,
}

impl Cone {
    fn around((centre, radius): (DVec3, f64), from: DVec3) -> Self {
        let way = centre - from;
        let sin = radius / way.length();
        let one_minus_cos = if sin < 1.0 { 1.0 - sin.asin().cos() } else { 2.0 };
        Self { frame: Frame::from_normal(way.normalize()), one_minus_cos }
    }

    fn direction(&self, u: DVec2) -> DVec3 {
        self.frame.to_world(warp::square_to_cone(u, self.one_minus_cos))
    }

    fn solid_angle(&self) -> f64 {
        TAU * self.one_minus_cos
    }

    /// 1, the direction across the cone and along it, and the density, which has no variance beyond a bound.
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
        let (centre, radius) = subject.ball();
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

/// The length of a line inside, from alternating crossings.
fn chord(ray: &Ray, crossings: &[(f64, Surface)]) -> f64 {
    crossings.chunks_exact(2).map(|pair| (pair[1].0 - pair[0].0) * ray.direction.length()).sum()
}

fn mean_chord(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(40_000);
    let mut findings = Vec::new();
    for subject in &subjects() {
        let Some((known, volume)) = subject.closed().filter(|(known, _)| known.convex) else { continue };
        let area = known.area.expect("that of closed shapes is known");
        let mut stream = Stream::at(&[29]);
        let lines = (0..samples).map(|_| subject.line(&mut stream));
        let chords = lines.map(|ray| chord(&ray, &subject.crossings(&ray))).filter(|chord| *chord > 0.0);
        findings.push(Finding::mean(subject.name.clone(), &chords.collect(), 4.0 * volume / area));
        if subject.name == "sphere #2" {
            // By elliptic integrals, to 9 digits.
            findings.push(Finding::value("ellipsoid, area", area, 8.512_099_114, 1e-5));
            findings.push(Finding::value("ellipsoid, 4 V / S", 4.0 * volume / area, 0.944_828_894, 2e-6));
        }
    }
    findings
}
