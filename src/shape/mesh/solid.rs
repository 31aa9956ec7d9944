//! Meshes as solids: the check that they are closed, and their crossings with a line.

use std::{collections::HashMap, fmt};

use glam::DVec3;

use super::{Triangles, wide};
use crate::shape::{Crossing, Crossings, Line};

/// The open edges of a mesh, because of which it does not enclose a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenEdges {
    /// The number of open edges.
    pub count: usize,
    /// The end points of the first few, in world space.
    pub some: Vec<[DVec3; 2]>,
}

/// The greatest number of open edges in a message.
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

/// The boundary of the surface, or `None` if the surface is closed. An edge is open if the numbers of triangles that
/// traverse it in its two directions differ. Vertices with the same position are treated as one.
///
/// `slivers` are triangles of zero area. They also close gaps.
pub(super) fn open_edges(triangles: &Triangles, slivers: &[[u32; 3]]) -> Option<OpenEdges> {
    let mut positions = HashMap::new();
    let position_of_vertex: Vec<u32> = triangles
        .positions()
        .iter()
        .map(|p| {
            // Adding zero turns -0 into +0.
            let next = positions.len() as u32;
            *positions.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(next)
        })
        .collect();
    let mut balance: HashMap<[u32; 2], ([u32; 2], i32)> = HashMap::new();
    for corners in triangles.indices().iter().chain(slivers) {
        for i in 0..3 {
            let vertices = [corners[i], corners[(i + 1) % 3]];
            let [a, b] = vertices.map(|v| position_of_vertex[v as usize]);
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

/// The volume that a closed mesh encloses, negative if the corners of its triangles run clockwise from outside. It is
/// computed by Gauss's theorem about the centre of the bounding box.
pub(super) fn signed_volume(triangles: &Triangles) -> f64 {
    let centre = triangles.bounds().centre();
    let tetrahedron = |i: u32| {
        let [a, b, c] = triangles.triangle(i).map(|corner| corner - centre);
        a.dot(b.cross(c)) / 6.0
    };
    (0..triangles.indices().len() as u32).map(tetrahedron).sum()
}

/// The crossings of a line with a closed mesh. `outward` is the sign of the mesh's volume.
///
/// A line through an edge hits both adjacent triangles: simultaneous hits count as one, which enters or leaves as their
/// majority does. The line is inside where it has entered more shells than it has left, so that shells may overlap, and
/// a shell that faces inwards within another bounds a cavity.
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
        let (simultaneous, later) = rest.split_at(rest.partition_point(|(hit, _)| hit.t <= end));
        let entering = simultaneous.iter().filter(|(_, enters)| *enters).count();
        let was_inside = depth > 0;
        depth += (2 * entering).cmp(&simultaneous.len()) as i32;
        if was_inside != (depth > 0) {
            let crossing = simultaneous.iter().find(|(_, enters)| *enters != was_inside);
            crossings.extend(crossing.map(|(hit, _)| *hit));
        }
        rest = later;
    }
    if crossings.len() % 2 == 1 {
        crossings.pop();
    }
    crossings
}
