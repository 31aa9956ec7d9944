"""A cognac glass and its cognac: three surfaces of revolution around the z axis, each between two media.

The foot stands on z = 0. The surfaces meet at the edge of the liquid, where they share their vertices.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

from meshes import Mesh, Vec3

SECTORS = 80

FOOT, EDGE = 0.77, 0.05
STEM, STEM_LOW, STEM_HIGH = 0.085, 0.30, 0.42
# The inner wall of the bowl is a part of an ellipsoid of revolution. The outer wall is a part of a second one, which is larger by
# THICKNESS.
CENTRE, ACROSS, UPRIGHT, THICKNESS = 1.45, 0.85, 0.9, 0.05
# The angles of the end of the stem, the surface of the liquid, and the rim above the widest circle of the bowl.
BOTTOM, LEVEL, RIM = (math.radians(degrees) for degrees in (-65.0, -22.0, 52.0))

Vec2 = tuple[float, float]


@dataclass(frozen=True)
class Point:
    """A point (r, z) of a profile and its unit normal, which points to the right of the direction of the profile."""

    r: float
    z: float
    normal: Vec2


def snifter() -> Mesh:
    """The boundary between glass and air: foot, stem, the outside of the bowl, and its inside down to the liquid."""
    outside, inside = ACROSS + THICKNESS, UPRIGHT + THICKNESS
    foot = line((0.0, 0.0), (FOOT, 0.0), 2)
    edge = curve((FOOT, 0.0), (0.04, 0.0), (-0.04, 0.0036), (FOOT, EDGE), 10)
    top = curve((FOOT, EDGE), (-0.45, 0.0405), (0.0, 0.16), (STEM, STEM_LOW), 10)
    stem = line((STEM, STEM_LOW), (STEM, STEM_HIGH), 2)
    start, end = ellipse(outside, inside, BOTTOM), ellipse(outside, inside, RIM)
    fillet = curve((STEM, STEM_HIGH), (0.0, 0.09), along(start, 0.15), (start.r, start.z), 6)
    lip = ellipse(ACROSS, UPRIGHT, RIM, -1.0)
    rim = curve((end.r, end.z), along(end, 0.03), along(lip, 0.03), (lip.r, lip.z), 10)
    bowl, wall = arc(outside, inside, BOTTOM, RIM, 18), arc(ACROSS, UPRIGHT, RIM, LEVEL, 12)
    return revolved([foot, edge, top, stem, fillet, bowl, rim, wall])


def cognac_wall() -> Mesh:
    """The boundary between liquid and glass, with normals out of the liquid."""
    return revolved([arc(ACROSS, UPRIGHT, -0.5 * math.pi, LEVEL, 20)])


def cognac_surface() -> Mesh:
    """The flat boundary between the liquid and the air above it."""
    shore = ellipse(ACROSS, UPRIGHT, LEVEL)
    return revolved([line((shore.r, shore.z), (0.0, shore.z), 1)])


# --- profiles ----------------------------------------------------------------------------------------------------------


def along(point: Point, length: float) -> Vec2:
    """The tangent of the profile at a point, with a given length."""
    return (-length * point.normal[1], length * point.normal[0])


def line(a: Vec2, b: Vec2, steps: int) -> list[Point]:
    r, z = b[0] - a[0], b[1] - a[1]
    length = math.hypot(r, z)
    return [Point(a[0] + r * k / steps, a[1] + z * k / steps, (z / length, -r / length)) for k in range(steps + 1)]


def curve(a: Vec2, leaving: Vec2, arriving: Vec2, b: Vec2, steps: int) -> list[Point]:
    """A cubic Bezier curve from `a` to `b`; its inner control points are `a + leaving` and `b - arriving`."""
    controls = [a, (a[0] + leaving[0], a[1] + leaving[1]), (b[0] - arriving[0], b[1] - arriving[1]), b]
    return [_bezier(controls, k / steps) for k in range(steps + 1)]


def _bezier(controls: list[Vec2], t: float) -> Point:
    s = 1.0 - t
    weights = (s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t)
    slopes = (-s * s, s * (s - 2.0 * t), t * (2.0 * s - t), t * t)
    r, z = (sum(w * control[axis] for w, control in zip(weights, controls, strict=True)) for axis in (0, 1))
    dr, dz = (sum(w * control[axis] for w, control in zip(slopes, controls, strict=True)) for axis in (0, 1))
    length = math.hypot(dr, dz)
    return Point(r, z, (dz / length, -dr / length))


def ellipse(across: float, upright: float, angle: float, sense: float = 1.0) -> Point:
    """A point of the bowl on a profile that runs upwards (`sense` 1) or downwards (-1)."""
    cos, sin = math.cos(angle), math.sin(angle)
    nr, nz = cos / across, sin / upright
    length = math.hypot(nr, nz)
    return Point(across * cos, CENTRE + upright * sin, (sense * nr / length, sense * nz / length))


def arc(across: float, upright: float, start: float, end: float, steps: int) -> list[Point]:
    sense = math.copysign(1.0, end - start)
    return [ellipse(across, upright, start + (end - start) * k / steps, sense) for k in range(steps + 1)]


# --- surfaces ----------------------------------------------------------------------------------------------------------


def revolved(parts: list[list[Point]]) -> Mesh:
    """Revolve a profile of smoothly joined parts; a point on the axis becomes one vertex."""
    points = parts[0] + [point for part in parts[1:] for point in part[1:]]
    mesh = Mesh([], [])
    rings = [_ring(mesh, point) for point in points]
    for lower, upper in pairwise(rings):
        for k in range(SECTORS):
            a, b, c, d = lower[k], lower[(k + 1) % SECTORS], upper[(k + 1) % SECTORS], upper[k]
            mesh.faces += [face for face in ((a, b, c), (a, c, d)) if len(set(face)) == 3]
    return mesh


def _ring(mesh: Mesh, point: Point) -> list[int]:
    """Add the vertices of one point of the profile; returns their indices by sector."""
    first = len(mesh.positions)
    is_pole = point.r < 1e-9
    for k in range(1 if is_pole else SECTORS):
        angle = 2.0 * math.pi * k / SECTORS
        cos, sin = math.cos(angle), math.sin(angle)
        nr, nz = (0.0, math.copysign(1.0, point.normal[1])) if is_pole else point.normal
        radius = 0.0 if is_pole else point.r
        mesh.positions.append(_vector(radius * cos, radius * sin, point.z))
        mesh.normals.append(_vector(nr * cos, nr * sin, nz))
    return [first] * SECTORS if is_pole else list(range(first, first + SECTORS))


def _vector(x: float, y: float, z: float) -> Vec3:
    """Round to seven decimals, so that all platforms give the same cosines; zero has no minus sign."""
    return (round(x, 7) + 0.0, round(y, 7) + 0.0, round(z, 7) + 0.0)
