"""The Utah teapot as triangles, from Newell's Bezier patches. z is up, and the spout points to +x."""

import math
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from meshes import Mesh, Vec3

try:
    import numpy as np
    from manifold3d import Manifold, Mesh64, OpType
    from numpy.typing import NDArray
except ModuleNotFoundError as error:
    print(f"{error}; run: pip install -r scripts/requirements.txt", file=sys.stderr)
    sys.exit(2)

DATA = Path(__file__).resolve().parent / "data" / "newell-teapot.txt"
DECIMALS = 5

# Groups of parts whose patches share edges. The handle and the spout end inside the pot; the lid does not touch the rim.
POT, HANDLE, SPOUT, LID = ("rim", "body", "bottom"), ("handle",), ("spout",), ("lid",)

# The lower end of the handle only touches the smooth pot, so it does not reach a pot of flat facets. The solid handle is extended
# by this vector, along the tangents of its patches.
SINK = (0.2, 0.0, -0.09)
# The union drops vertices if that moves its surface by less than this distance.
TOLERANCE = 1e-4


# --- patches -----------------------------------------------------------------------------------------------------------


def patches() -> list[tuple[str, NDArray[np.float64]]]:
    """The 32 patches: the part of each, and its 4 x 4 control points as an array of shape (4, 4, 3)."""
    points, rows = [], []
    for line in DATA.read_text().splitlines():
        match line.split():
            case ["point", *numbers]:
                points.append([float(x) for x in numbers])
            case ["patch", part, *indices]:
                rows.append((part, [int(i) for i in indices]))
    return [(part, np.array([points[i] for i in indices]).reshape(4, 4, 3)) for part, indices in rows]


def evaluate(patch: NDArray[np.float64], u: float, v: float) -> tuple[Vec3, Vec3]:
    """A point of a patch, rounded to `DECIMALS`, and its outward unit normal.

    u runs along the rows of control points, v across them. Where the edge v = 0 degenerates to a point, dp/du vanishes like
    v d2p/dudv, so d2p/dudv is used instead.
    """
    along, across = _bernstein(u), _bernstein(v)
    du = np.einsum("i,j,ijk", across, _slope(u), patch)
    if v == 0.0 and not du.any():
        du = np.einsum("i,j,ijk", _slope(v), _slope(u), patch)
    normal = np.cross(du, np.einsum("i,j,ijk", _slope(v), along, patch))
    return _rounded(np.einsum("i,j,ijk", across, along, patch)), _unit(normal)


def _bernstein(t: float) -> NDArray[np.float64]:
    s = 1.0 - t
    return np.array([s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t])


def _slope(t: float) -> NDArray[np.float64]:
    """The derivatives of the Bernstein polynomials."""
    s = 1.0 - t
    return np.array([-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t])


def _rounded(point: NDArray[np.float64]) -> Vec3:
    """Round to `DECIMALS`; zero has no minus sign."""
    x, y, z = (round(float(c), DECIMALS) + 0.0 for c in point)
    return (x, y, z)


def _unit(vector: NDArray[np.float64]) -> Vec3:
    x, y, z = (float(c) for c in vector)
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)


# --- the open teapot ---------------------------------------------------------------------------------------------------


def open_teapot(quads: int) -> Mesh:
    """All 32 patches with `quads` x `quads` quads each: surfaces with open edges that end inside one another."""
    return joined([surface(shell, quads) for shell in (POT, HANDLE, SPOUT, LID)])


def surface(parts: Sequence[str], quads: int) -> Mesh:
    """The patches of `parts` as triangles, welded at shared points; a quad at a pole becomes one triangle."""
    mesh = Mesh([], [])
    index: dict[Vec3, int] = {}
    for part, patch in patches():
        if part not in parts:
            continue
        grid = []
        for j in range(quads + 1):
            for i in range(quads + 1):
                point, normal = evaluate(patch, i / quads, j / quads)
                if point not in index:
                    index[point] = len(mesh.positions)
                    mesh.positions.append(point)
                    mesh.normals.append(normal)
                grid.append(index[point])
        for j in range(quads):
            for i in range(quads):
                k = j * (quads + 1) + i
                a, b, c, d = grid[k], grid[k + 1], grid[k + quads + 2], grid[k + quads + 1]
                mesh.faces += [face for face in ((a, b, c), (a, c, d)) if len(set(face)) == 3]
    return mesh


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Join meshes without welding vertices."""
    whole = Mesh([], [])
    for mesh in meshes:
        first = len(whole.positions)
        whole.positions += mesh.positions
        whole.normals += mesh.normals
        whole.faces += [tuple(first + i for i in face) for face in mesh.faces]
    return whole


# --- the closed teapot -------------------------------------------------------------------------------------------------


def closed_teapot(quads: int) -> Mesh:
    """The solid teapot: the union of the closed pot with its lid, the closed handle and the closed spout.

    A flat ring closes the gap between lid and rim; flat caps close the handle and the spout. A vertex on a crease is repeated for
    each of its normals. If vertices at the same position are welded, the mesh is watertight.
    """
    handle = surface(HANDLE, quads)
    lower = min(boundary(handle), key=lambda loop: handle.positions[loop[0]][2])
    solids = [ringed(surface(POT, quads), surface(LID, quads)), capped(extended(handle, lower)), capped(surface(SPOUT, quads))]
    union = Manifold.batch_boolean([manifold(solid) for solid in solids], OpType.Add).simplify(TOLERANCE).to_mesh64()
    vertices = np.asarray(union.vert_properties)
    positions = [_rounded(vertex[:3]) for vertex in vertices]
    normals = [_unit(vertex[3:]) for vertex in vertices]
    faces = [(int(a), int(b), int(c)) for a, b, c in np.asarray(union.tri_verts)]
    return Mesh(positions, faces, normals)


def boundary(mesh: Mesh) -> list[list[int]]:
    """The loops of edges that belong to one triangle only, in the direction of that triangle."""
    edges = {(f[k], f[(k + 1) % 3]) for f in mesh.faces for k in range(3)}
    after = {a: b for a, b in sorted(edges) if (b, a) not in edges}
    loops = []
    while after:
        loop = [min(after)]
        while loop[-1] in after:
            loop.append(after.pop(loop[-1]))
        loops.append(loop[:-1])
    return loops


def extended(tube: Mesh, loop: Sequence[int]) -> Mesh:
    """Extend a tube by `SINK` at its open end `loop`."""
    mesh = joined([tube])
    copies = {old: len(tube.positions) + k for k, old in enumerate(loop)}
    mesh.positions += [_rounded(np.add(tube.positions[old], SINK)) for old in loop]
    mesh.normals += [tube.normals[old] for old in loop]
    for a, b in pairwise([*loop, loop[0]]):
        mesh.faces += [(b, a, copies[a]), (b, copies[a], copies[b])]
    return mesh


def capped(tube: Mesh) -> Mesh:
    """Close each open end of a tube with a flat fan around its centre."""
    mesh = joined([tube])
    for loop in boundary(tube):
        rim = np.array([tube.positions[k] for k in reversed(loop)])
        centre = rim.mean(axis=0)
        normal = _unit(np.cross(rim - centre, np.roll(rim, -1, axis=0) - centre).sum(axis=0))
        first = len(mesh.positions)
        mesh.positions += [*(_rounded(point) for point in rim), _rounded(centre)]
        mesh.normals += [normal] * (len(rim) + 1)
        mesh.faces += [(first + k, first + (k + 1) % len(rim), first + len(rim)) for k in range(len(rim))]
    return mesh


def ringed(pot: Mesh, lid: Mesh) -> Mesh:
    """Join pot and lid by a flat ring from the inner edge of the rim to the edge of the lid."""
    mesh = joined([pot, lid])
    first = len(mesh.positions)
    for part in (pot, lid):
        (loop,) = boundary(part)
        mesh.positions += sorted((part.positions[k] for k in loop), key=lambda p: math.atan2(p[1], p[0]))
    count = (len(mesh.positions) - first) // 2
    mesh.normals += [(0.0, 0.0, 1.0)] * (2 * count)
    for k in range(count):
        a, b = first + k, first + (k + 1) % count
        mesh.faces += [(a, b, b + count), (a, b + count, a + count)]
    return mesh


def manifold(solid: Mesh) -> Manifold:
    """The input of manifold3d's union, which interpolates the normals at the vertices that it adds."""
    first: dict[Vec3, int] = {}
    weld = [(k, first.setdefault(point, k)) for k, point in enumerate(solid.positions)]
    source, target = zip(*((k, to) for k, to in weld if k != to), strict=True)
    return Manifold(
        Mesh64(
            np.hstack([solid.positions, solid.normals]),
            np.array(solid.faces, dtype=np.uint64),
            merge_from_vert=np.array(source, dtype=np.uint64),
            merge_to_vert=np.array(target, dtype=np.uint64),
        )
    )
