//! Meshes as solids: whether they are closed, and where a line enters and leaves them.

use std::{collections::HashMap, fmt};

use glam::DVec3;

use super::{Triangles, wide};
use crate::shape::{Crossing, Crossings, Line};

/// The edges of a mesh that keep it from enclosing a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenEdges {
    /// How many there are.
    pub count: usize,
    /// The ends of some, in the world.
    pub some: Vec<[DVec3; 2]>,
}

/// How many open edges a message shows.
const SHOWN: usize = 3;

impl fmt::Display for OpenEdges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let point = |p: DVec3| format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z);
        let some: Vec<_> = self.some.iter().map(|[a, b]| format!("{} to {}", point(*a), point(*b))).collect();
        let dots = if self.count > self.some.len() { ", ..." } else { "" };
        let edges = if self.count == 1 { "edge has" } else { "edges have" };
        write!(
            f,
            "the mesh is open: {} {edges} no matching triangle on the other side: {}{dots}",
            self.count,
            some.join("; ")
        )
    }
}

/// The boundary of the surface, if it has one: edges along which as many triangles do not run one way as the other.
/// Vertices at one place are one vertex, whatever their normals.
///
/// `slivers` are triangles without area, which close gaps as well.
pub(super) fn open_edges(triangles: &Triangles, slivers: &[[u32; 3]]) -> Option<OpenEdges> {
    let mut places = HashMap::new();
    let of_vertex: Vec<u32> = triangles
        .positions()
        .iter()
        .map(|p| {
            // Adding zero makes one zero of both.
            let next = places.len() as u32;
            *places.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(next)
        })
        .collect();
    let mut balance: HashMap<[u32; 2], ([u32; 2], i32)> = HashMap::new();
    for corners in triangles.indices().iter().chain(slivers) {
        for i in 0..3 {
            let vertices = [corners[i], corners[(i + 1) % 3]];
            let [a, b] = vertices.map(|v| of_vertex[v as usize]);
            let entry = balance.entry([a.min(b), a.max(b)]).or_insert((vertices, 0));
            entry.1 += match a.cmp(&b) {
                std::cmp::Ordering::Less => 1,
                std::cmp::Ordering::Equal => 0,
                std::cmp::Ordering::Greater => -1,
            };
        }
    }
    let mut open: Vec<[u32; 2]> =
        balance.into_values().filter(|(_, balance)| *balance != 0).map(|(vertices, _)| vertices).collect();
    open.sort_unstable();
    let ends = |edge: &[u32; 2]| edge.map(|v| wide(triangles.positions()[v as usize]));
    (!open.is_empty()).then(|| OpenEdges { count: open.len(), some: open.iter().take(SHOWN).map(ends).collect() })
}

/// The volume that closed triangles enclose, negative if their corners turn clockwise from outside: by Gauss's theorem
/// about a point in their midst.
pub(super) fn signed_volume(triangles: &Triangles) -> f64 {
    let centre = triangles.bounds().centre();
    let cone = |i: u32| {
        let [a, b, c] = triangles.triangle(i).map(|corner| corner - centre);
        a.dot(b.cross(c)) / 6.0
    };
    (0..triangles.indices().len() as u32).map(cone).sum()
}

/// Where a line enters and leaves a closed mesh; `outward` is the sign of its volume.
///
/// A line through an edge meets both its triangles: hits at one place count once, as what prevails among them. Inside is
/// where more surfaces have been entered than left, so that shells may overlap, and one that faces inwards within another
/// bounds a cavity.
pub(super) fn cross(triangles: &Triangles, outward: f64, line: &Line) -> Crossings {
    let mut hits: Vec<(Crossing, bool)> = Vec::new();
    triangles.for_each(&line.ray, |hit| {
        let [a, b, c] = triangles.triangle(hit.triangle);
        let enters = outward * (b - a).cross(c - a).dot(line.ray.direction) < 0.0;
        hits.push((Crossing::new(hit.t, hit.triangle), enters));
    });
    hits.sort_unstable_by(|(a, _), (b, _)| a.t.total_cmp(&b.t));
    let mut crossings = Crossings::new();
    let mut depth = 0;
    let mut rest = &hits[..];
    while let Some((first, _)) = rest.first() {
        let end = first.t + line.margin(first.t);
        let (here, beyond) = rest.split_at(rest.partition_point(|(hit, _)| hit.t <= end));
        let entering = here.iter().filter(|(_, enters)| *enters).count();
        let was_inside = depth > 0;
        depth += (2 * entering).cmp(&here.len()) as i32;
        if was_inside != (depth > 0) {
            let found = here.iter().find(|(_, enters)| *enters != was_inside);
            crossings.extend(found.map(|(hit, _)| *hit));
        }
        rest = beyond;
    }
    if crossings.len() % 2 == 1 {
        crossings.pop();
    }
    crossings
}
