"""Newell's patches, the open teapot that consists of them, and the closed teapot."""

import math
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_reference as ref
import teapot

MESHES = ref.ROOT / "assets" / "meshes"
OPEN = {"coarse": 6, "fine": 10}
Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass
class Solid:
    """Triangles read from a file; each vertex has a position, and a normal if the file has normals."""

    positions: Array
    faces: Indices
    normals: Array

    def corners(self) -> Array:
        return self.positions[self.faces]

    def facets(self) -> Array:
        """The normals of the faces; their lengths are twice the areas."""
        a, b, c = self.corners().transpose(1, 0, 2)
        return np.cross(b - a, c - a)

    def welded(self) -> Indices:
        """The faces after welding vertices at the same position."""
        _, index = np.unique(self.positions, axis=0, return_inverse=True)
        return index.reshape(-1)[self.faces]


def read_ply(name: str) -> Solid:
    """Read a binary PLY file with positions and normals."""
    header, body = (MESHES / name).read_bytes().split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in header.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, "<f4", 6 * counts[0]).reshape(-1, 6).astype(float)
    faces = np.frombuffer(body, [("size", "u1"), ("corners", "<i4", 3)], offset=24 * counts[0])
    assert len(faces) == counts[1]
    assert (faces["size"] == 3).all()
    return Solid(vertices[:, :3], faces["corners"].astype(np.int64), vertices[:, 3:])


def read_kcply(name: str) -> tuple[Solid, int]:
    """Read a kcply file; returns the mesh and the smallest vertex index."""
    lines = (MESHES / name).read_text().splitlines()
    assert lines[0] == "kcply"
    vertices, faces = int(lines[1].removeprefix("element vertex ")), int(lines[2].removeprefix("element face "))
    assert len(lines) == 3 + vertices + faces
    positions = np.array([[float(x) for x in line.split()] for line in lines[3 : 3 + vertices]])
    polygons = np.array([[int(i) for i in line.split()] for line in lines[3 + vertices :]])
    assert (polygons[:, 0] == 3).all()
    first = int(polygons[:, 1:].min())
    assert polygons[:, 1:].max() == first + vertices - 1
    return Solid(positions, polygons[:, 1:] - first, np.empty((0, 3))), first


def directed_edges(faces: Indices) -> Counter[tuple[int, int]]:
    return Counter((int(f[k]), int(f[(k + 1) % 3])) for f in faces for k in range(3))


def de_casteljau(patch: Array, u: float, v: float) -> Array:
    for t in (v, v, v, u, u, u):
        patch = patch[:-1] * (1.0 - t) + patch[1:] * t
        if len(patch) == 1:
            patch = patch[0]
    return patch


# --- patches -----------------------------------------------------------------------------------------------------------


def test_there_are_32_patches() -> None:
    parts = Counter(part for part, _ in teapot.patches())
    assert parts == {"rim": 4, "body": 8, "handle": 4, "spout": 4, "lid": 8, "bottom": 4}
    assert all(patch.shape == (4, 4, 3) for _, patch in teapot.patches())


def test_the_teapot_is_symmetric() -> None:
    """The reflection y -> -y maps each patch to a patch of the teapot, with its control points in any order."""

    def points(patch: Array, y: float) -> tuple[tuple[float, ...], ...]:
        return tuple(sorted(tuple(point) for point in (patch * (1.0, y, 1.0) + 0.0).reshape(-1, 3).tolist()))

    patches = [patch for _, patch in teapot.patches()]
    assert Counter(points(patch, 1.0) for patch in patches) == Counter(points(patch, -1.0) for patch in patches)


def test_patches_share_their_edges() -> None:
    """Of 128 edges, 8 are poles and 16 are open (rim, lid, both ends of handle and spout); the others are pairs."""
    edges: Counter[tuple[tuple[float, ...], ...]] = Counter()
    poles = 0
    for _, patch in teapot.patches():
        for edge in (patch[0], patch[3], patch[:, 0], patch[:, 3]):
            points = [tuple(point) for point in edge.tolist()]
            if len(set(points)) == 1:
                poles += 1
            else:
                edges[min(tuple(points), tuple(reversed(points)))] += 1
    assert poles == 8
    assert Counter(edges.values()) == {1: 16, 2: 52}


def test_bounding_box() -> None:
    """The tip of the spout is the maximum of the cubic with coefficients 3.3, 3.525, 3.45, 3.2."""
    t = (0.6 - math.sqrt(0.2475)) / 0.25
    tip = 3.3 * (1 - t) ** 3 + 3 * 3.525 * t * (1 - t) ** 2 + 3 * 3.45 * t**2 * (1 - t) + 3.2 * t**3
    grid = np.linspace(0.0, 1.0, 51)
    points = np.array([de_casteljau(patch, u, v) for _, patch in teapot.patches() for u in grid[::10] for v in grid])
    assert np.allclose(points.min(axis=0), (-3.0, -2.0, 0.0), atol=1e-12)
    assert np.allclose(points.max(axis=0), (tip, 2.0, 3.15), atol=1e-4)


@pytest.mark.parametrize("k", range(32))
def test_points_and_normals_agree_with_de_casteljau(k: int) -> None:
    part, patch = teapot.patches()[k]
    for u, v in np.random.default_rng(k).uniform(0.01, 0.99, (8, 2)):
        point, normal = teapot.evaluate(patch, u, v)
        assert np.allclose(point, de_casteljau(patch, u, v), rtol=0.0, atol=0.51e-5)
        step = 1e-5
        du = de_casteljau(patch, u + step, v) - de_casteljau(patch, u - step, v)
        dv = de_casteljau(patch, u, v + step) - de_casteljau(patch, u, v - step)
        cross = np.cross(du, dv)
        assert np.allclose(cross / np.linalg.norm(cross), normal, atol=1e-7), part


def test_normals_at_the_poles() -> None:
    poles = [patch for _, patch in teapot.patches() if (patch[0] == patch[0, 0]).all()]
    assert len(poles) == 8
    for patch in poles:
        for u in (0.0, 0.3, 1.0):
            point, normal = teapot.evaluate(patch, u, 0.0)
            up = {3.15: 1.0, 0.0: -1.0}[point[2]]
            assert point[:2] == (0.0, 0.0)
            assert np.allclose(normal, (0.0, 0.0, up), atol=1e-15)
            near = teapot.evaluate(patch, u, 1e-6)[1]
            assert np.allclose(normal, near, atol=1e-5)


# --- the open teapot ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "quads"), OPEN.items())
def test_open_edges(name: str, quads: int) -> None:
    """The rim and the lid are open along four patches each; the handle and the spout along two patches at each end."""
    mesh = read_ply(f"teapot-{name}.ply")
    edges = directed_edges(mesh.faces)
    lengths = sorted(len(loop) for loop in loops(mesh.faces))
    assert len(mesh.faces) == 64 * quads**2 - 8 * quads
    assert set(edges.values()) == {1}
    assert lengths == [2 * quads] * 4 + [4 * quads] * 2
    assert sum((b, a) not in edges for a, b in edges) == 16 * quads


@pytest.mark.parametrize(("name", "first"), [("coarse", 0), ("fine", 1)])
def test_kcply_and_ply_are_the_same_triangles(name: str, first: int) -> None:
    mesh, base = read_kcply(f"teapot-{name}.kcply")
    other = read_ply(f"teapot-{name}.ply")
    assert base == first
    assert np.array_equal(mesh.faces, other.faces)
    assert np.array_equal(mesh.positions.astype(np.float32), other.positions.astype(np.float32))


@pytest.mark.parametrize(("name", "least"), [("coarse", 0.2), ("fine", 0.35), ("closed", 0.35)])
def test_normals_are_unit_and_agree_with_the_faces(name: str, least: float) -> None:
    """At the sharp lip of the spout, a facet and a vertex normal differ by up to 78 degrees (coarse) or 68 degrees."""
    mesh = read_ply(f"teapot-{name}.ply")
    facets = mesh.facets()
    cosines = np.einsum("fck,fk->fc", mesh.normals[mesh.faces], facets) / np.linalg.norm(facets, axis=1)[:, None]
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
    assert cosines.min() > least
    assert np.quantile(cosines, 0.05) > 0.8


# --- the closed teapot -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def closed() -> Solid:
    return read_ply("teapot-closed.ply")


def test_closed_is_watertight_and_oriented(closed: Solid) -> None:
    edges = directed_edges(closed.welded())
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


def test_closed_is_one_piece_with_one_handle(closed: Solid) -> None:
    """Euler's number V - E + F equals 2 - 2 genus, and the triangles around each vertex form one fan."""
    faces = closed.welded()
    label = np.arange(faces.max() + 1)
    for _ in range(len(label)):
        least = label.copy()
        np.minimum.at(least, faces, label[faces].min(axis=1)[:, None])
        if np.array_equal(least, label):
            break
        label = least
    assert set(label) == {0}
    assert len(label) - 3 * len(faces) // 2 + len(faces) == 0
    follows = [dict[int, int]() for _ in label]
    for face in faces.tolist():
        for a, b, c in (face, face[1:] + face[:1], face[2:] + face[:2]):
            follows[a][b] = c
    for fan in follows:
        start = here = min(fan)
        steps = 1
        while (here := fan[here]) != start:
            steps += 1
        assert steps == len(fan)


def test_closed_does_not_intersect_itself(closed: Solid) -> None:
    """No edge of a triangle crosses a triangle with which it has no common vertex."""
    corners, faces = closed.corners(), closed.welded()
    low, high = corners.min(axis=1), corners.max(axis=1)
    pairs = []
    for k in range(len(faces)):
        near = np.flatnonzero((low <= high[k]).all(axis=1) & (high >= low[k]).all(axis=1))
        apart = ~(faces[near][:, :, None] == faces[k]).any(axis=(1, 2))
        pairs += [(k, other) for other in near[apart]]
    edge_of, triangle = np.array(pairs).T
    assert len(pairs) > 1000
    for side in range(3):
        start, end = corners[edge_of, side], corners[edge_of, (side + 1) % 3]
        assert not crosses(start, end, corners[triangle]).any()


def crosses(start: Array, end: Array, triangle: Array) -> NDArray[np.bool_]:
    """Whether segments cross triangles, from the signs of the volumes of tetrahedra."""

    def volume(a: Array, b: Array, c: Array, d: Array) -> Array:
        return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)

    a, b, c = triangle.transpose(1, 0, 2)
    sides = np.stack([volume(start, end, a, b), volume(start, end, b, c), volume(start, end, c, a)])
    return (volume(a, b, c, start) * volume(a, b, c, end) < 0.0) & ((sides > 0.0).all(axis=0) | (sides < 0.0).all(axis=0))


def winding_number(points: Array, corners: Array) -> Array:
    """The winding number of a surface around points: the solid angle of its triangles over 4 pi."""
    total = np.zeros(len(points))
    for k, point in enumerate(points):
        a, b, c = (corners - point).transpose(1, 0, 2)
        x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        dot_ab, dot_bc, dot_ca = (np.einsum("ij,ij->i", p, q) for p, q in ((a, b), (b, c), (c, a)))
        triple = np.einsum("ij,ij->i", a, np.cross(b, c))
        total[k] = np.arctan2(triple, x * y * z + dot_ab * z + dot_bc * x + dot_ca * y).sum() / (2.0 * np.pi)
    return total


def test_closed_has_glass_on_exactly_one_side_of_each_face(closed: Solid) -> None:
    """The winding number is 1 just below a face and 0 just above it, so there are no walls inside."""
    corners, facets = closed.corners(), closed.facets()
    centres = corners.mean(axis=1)[::11]
    out = 1e-6 * (facets / np.linalg.norm(facets, axis=1)[:, None])[::11]
    assert np.allclose(winding_number(centres - out, corners), 1.0, atol=1e-6)
    assert np.allclose(winding_number(centres + out, corners), 0.0, atol=1e-6)


def loops(faces: Indices) -> list[list[int]]:
    """The open edges of a mesh as closed polygons."""
    edges = directed_edges(faces)
    after = {a: b for a, b in edges if (b, a) not in edges}
    found = []
    while after:
        start, here = after.popitem()
        loop = [start]
        while here != start:
            loop.append(here)
            here = after.pop(here)
        found.append(loop)
    return found


def columns(corners: Array, rays: Array) -> list[Array]:
    """The ascending heights at which vertical lines through points (x, y) cross triangles."""
    a, b, c = corners.transpose(1, 0, 2)
    crossings = []
    for ray in rays:
        u, v, w = (
            (q[:, 0] - ray[0]) * (r[:, 1] - ray[1]) - (q[:, 1] - ray[1]) * (r[:, 0] - ray[0]) for q, r in ((b, c), (c, a), (a, b))
        )
        hit = ((u > 0.0) & (v > 0.0) & (w > 0.0)) | ((u < 0.0) & (v < 0.0) & (w < 0.0))
        heights = u * a[:, 2] + v * b[:, 2] + w * c[:, 2]
        crossings.append(np.sort(heights[hit] / (u + v + w)[hit]))
    return crossings


def test_closed_volume_is_that_of_the_union_of_the_parts(closed: Solid) -> None:
    """Compare the volume with an estimate from 4096 vertical lines, two at random positions in each of 64 x 32 cells.

    The estimate uses the length of each line inside any part. The parts of the open teapot are closed by cones over their
    open edges. The simplification may move the surface, whose area is less than 60, by `TOLERANCE`. The extension of the handle
    changes the volume by less than that.
    """
    parts = []
    for names in (teapot.POT, teapot.LID, teapot.HANDLE, teapot.SPOUT):
        mesh = teapot.surface(names, 10)
        corners = np.array(mesh.positions)[np.array(mesh.faces)]
        for loop in loops(np.array(mesh.faces)):
            rim = np.array([mesh.positions[k] for k in loop])
            cone = [(p, q, rim.mean(axis=0)) for q, p in pairwise([*rim, rim[0]])]
            corners = np.concatenate([corners, cone])
        assert signed_volume(corners) > 0.0
        parts.append(corners)
    low, size, cells = np.array([-3.0, -2.0]), np.array([6.5, 4.0]), np.array([64, 32])
    index = np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), axis=-1).reshape(-1, 1, 2)
    rays = low + size / cells * (index + np.random.default_rng(1975).random((len(index), 2, 2)))
    lengths = np.zeros(rays.shape[:2])
    crossings = [columns(corners, rays.reshape(-1, 2)) for corners in parts]
    for k in range(lengths.size):
        spans = sorted((a, b) for part in crossings for a, b in part[k].reshape(-1, 2))
        top = -1.0
        for a, b in spans:
            lengths.flat[k] += max(0.0, b - max(a, top))
            top = max(top, b)
    area = float(size.prod())
    estimate = area * lengths.mean()
    error = area * math.sqrt(float(((lengths[:, 0] - lengths[:, 1]) ** 2).sum())) / lengths.size
    volume = signed_volume(closed.corners())
    assert error < 0.003 * estimate
    assert abs(volume - estimate) < 4.0 * error + 60.0 * teapot.TOLERANCE


def signed_volume(corners: Array) -> float:
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0


def test_closed_has_the_normals_of_the_patches(closed: Solid) -> None:
    """Where the fine open and the closed teapot share a vertex, one of the normals of the closed teapot is the same."""
    fine = read_ply("teapot-fine.ply")
    copies: dict[tuple[float, ...], list[Array]] = {}
    for position, normal in zip(closed.positions.tolist(), closed.normals, strict=True):
        copies.setdefault(tuple(position), []).append(normal)
    common = [(n, copies[tuple(p)]) for p, n in zip(fine.positions.tolist(), fine.normals, strict=True) if tuple(p) in copies]
    assert len(common) > 0.9 * len(fine.positions)
    assert all(min(np.abs(normal - copy).max() for copy in found) < 1e-6 for normal, found in common)
    smooth = sum(len(found) == 1 for _, found in common)
    assert smooth > 0.9 * len(common)


def test_only_the_ring_and_the_mouth_of_closed_are_flat(closed: Solid) -> None:
    """The flat faces point upwards: the ring around the lid and the mouth of the spout, whose centre is dropped."""
    normals = closed.normals[closed.faces]
    flat = normals[np.abs(normals - normals[:, :1]).max(axis=(1, 2)) < 1e-6]
    assert len(flat) == 80 + 18
    assert np.allclose(flat, (0.0, 0.0, 1.0))
