"""Meshes of curved surfaces, whose vertices lie on the surface and have its exact normals; and PLY files of meshes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from user_error import UserError

Array = NDArray[np.float64]

# About 400k triangles: the distance between the mesh and a cone or paraboloid of radius 1 is at most 5e-6.
COLUMNS = 1024
ROWS = 192
# The number of cells along each axis of the box of a quadric, before each triangle is split in four.
CELLS = 80

PLANE_HALF_SIZE = 1000.0


@dataclass(frozen=True)
class Surface:
    """A triangle mesh: positions (N, 3), faces (M, 3), and optional normals (N, 3) and uvs (N, 2) of the vertices."""

    positions: Array
    faces: NDArray[np.int64]
    normals: Array | None = None
    uvs: Array | None = None

    def transformed(self, matrix: Array) -> "Surface":
        """The image under an affine map.

        Normals stay on their side of the surface, and faces stay counter-clockwise around them.
        """
        positions = self.positions @ matrix[:3, :3].T + matrix[:3, 3]
        faces = self.faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else self.faces
        normals = None if self.normals is None else _unit(self.normals @ np.linalg.inv(matrix[:3, :3]))
        return Surface(positions, faces, normals, self.uvs)


def write_ply(path: Path, surface: Surface) -> None:
    """Write a binary PLY file in single precision."""
    parts = [surface.positions, surface.normals, surface.uvs]
    columns = np.hstack([part for part in parts if part is not None]).astype("<f4")
    names = ["x", "y", "z"] + ["nx", "ny", "nz"] * (surface.normals is not None) + ["u", "v"] * (surface.uvs is not None)
    faces = np.empty(len(surface.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, surface.faces
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(columns)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    path.write_bytes("\n".join(header).encode() + columns.tobytes() + faces.tobytes())


def read_kcply(path: Path, index_base: str) -> Surface:
    """Read a `kcply` file; `index_base` is auto, 0 or 1."""
    try:
        lines = path.read_text().splitlines()
        vertices, faces = (int(lines[k].removeprefix(f"element {kind} ")) for k, kind in ((1, "vertex"), (2, "face")))
        positions = np.array([line.split() for line in lines[3 : 3 + vertices]], dtype=np.float64)
        corners = np.array([line.split() for line in lines[3 + vertices : 3 + vertices + faces]], dtype=np.int64)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from error
    except (IndexError, ValueError) as error:
        raise UserError(f"{path}: not a kcply file: {error}") from error
    if lines[0] != "kcply" or positions.shape != (vertices, 3) or corners.shape != (faces, 4) or (corners[:, 0] != 3).any():
        raise UserError(f"{path}: not a kcply file of {vertices} vertices and {faces} triangles")
    least, greatest = corners[:, 1:].min(), corners[:, 1:].max()
    bases = [base for base in (0, 1) if base <= least and greatest < vertices + base and index_base in ("auto", str(base))]
    if len(bases) != 1:
        raise UserError(f"{path}: indices {least} to {greatest} of {vertices} vertices do not fit index_base {index_base}")
    return Surface(positions, corners[:, 1:] - bases[0])


def triangle(corners: Array, normals: Array | None) -> Surface:
    """One triangle with `corners` (3, 3) and optional normals (3, 3)."""
    return Surface(corners, np.array([[0, 1, 2]]), normals)


def plane() -> Surface:
    """The square |x|, |y| <= PLANE_HALF_SIZE of the plane z = 0 with uv = (x, y).

    It consists of nested squares, so that uv near the origin has the full accuracy of single precision.
    """
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    sizes = [PLANE_HALF_SIZE / 10**k for k in range(4)]
    flat = np.vstack([size * corners for size in sizes])
    last = 4 * (len(sizes) - 1)
    faces = [[last, last + 1, last + 2], [last, last + 2, last + 3]]
    for ring in range(0, last, 4):
        for k in range(4):
            a, b = ring + k, ring + (k + 1) % 4
            faces += [[a, b, b + 4], [a, b + 4, a + 4]]
    positions = np.column_stack([flat, np.zeros(len(flat))])
    return Surface(positions, np.array(faces), np.tile([0.0, 0.0, 1.0], (len(flat), 1)), flat)


# --- surfaces of revolution ---------------------------------------------------------------------------------------------


def revolved(radius: Array, z: Array, radial: Array, axial: Array, v: Array) -> Surface:
    """Revolve a profile of ascending z around the z axis; uv = (azimuth / 2 pi, v), normal = (radial, axial).

    On the axis, each column of triangles has its own vertex, with the normal at the middle of the column.
    """
    on_axis = radius == 0.0
    turns = (np.arange(COLUMNS + 1) + np.where(on_axis, 0.5, 0.0)[:, None]) / COLUMNS
    cosine, sine = np.cos(2.0 * np.pi * turns), np.sin(2.0 * np.pi * turns)
    # The first and the last column coincide exactly.
    cosine[~on_axis, -1], sine[~on_axis, -1] = 1.0, 0.0
    positions = np.stack([radius[:, None] * cosine, radius[:, None] * sine, np.broadcast_to(z[:, None], turns.shape)], axis=-1)
    normals = np.stack([radial[:, None] * cosine, radial[:, None] * sine, np.broadcast_to(axial[:, None], turns.shape)], axis=-1)
    uvs = np.stack([turns, np.broadcast_to(v[:, None], turns.shape)], axis=-1)
    index = np.arange(turns.size).reshape(turns.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    lower = np.stack([a, b, np.where(on_axis[1:, None], d, c)], axis=-1)[~on_axis[:-1]]
    upper = np.stack([a, c, d], axis=-1)[~on_axis[1:]]
    faces = np.vstack([lower.reshape(-1, 3), upper.reshape(-1, 3)])
    return Surface(positions.reshape(-1, 3), faces, _unit(normals.reshape(-1, 3)), uvs.reshape(-1, 2))


def sphere() -> Surface:
    """The unit sphere with the uv of Mitsuba's sphere."""
    theta = np.pi * (1.0 - np.arange(ROWS * 2 + 1) / (ROWS * 2))
    radius = np.sin(theta)
    radius[[0, -1]] = 0.0
    return revolved(radius, np.cos(theta), radius, np.cos(theta), theta / np.pi)


def cylinder() -> Surface:
    """The open cylinder of radius 1 around the z axis, 0 <= z <= 1."""
    z = np.arange(ROWS + 1) / ROWS
    return revolved(np.ones_like(z), z, np.ones_like(z), np.zeros_like(z), z)


def cone(radius: float, height: float) -> Surface:
    """The open cone with its base in z = 0 and its apex at z = height."""
    v = np.arange(ROWS + 1) / ROWS
    return revolved(radius * (1.0 - v), height * v, np.full_like(v, height), np.full_like(v, radius), v)


def paraboloid(radius: float, height: float) -> Surface:
    """The surface x^2 + y^2 = radius^2 z / height for 0 <= z <= height."""
    t = np.arange(ROWS + 1) / ROWS
    return revolved(radius * t, height * t * t, 2.0 * height * t, np.full_like(t, -radius), t * t)


def hyperboloid(radius: float, axis: float, z_min: float, z_max: float, sheets: int) -> Surface:
    """The surface (x^2 + y^2)/radius^2 - z^2/axis^2 = 1 (one sheet) or -1 (two sheets) for z_min <= z <= z_max."""
    if sheets == 1:
        t = np.linspace(np.arcsinh(z_min / axis), np.arcsinh(z_max / axis), ROWS + 1)
        return _hyperbolic(radius, axis, (z_min, z_max), t, 0.0)
    pieces = []
    if z_min < -axis:
        t = np.linspace(np.arccosh(-z_min / axis), np.arccosh(max(-z_max / axis, 1.0)), ROWS + 1)
        pieces.append(_hyperbolic(radius, axis, (z_min, z_max), t, -1.0))
    if z_max > axis:
        t = np.linspace(np.arccosh(max(z_min / axis, 1.0)), np.arccosh(z_max / axis), ROWS + 1)
        pieces.append(_hyperbolic(radius, axis, (z_min, z_max), t, 1.0))
    if not pieces:
        raise ValueError(f"neither of its two sheets lies between z_min {z_min} and z_max {z_max}")
    return joined(pieces)


def _hyperbolic(radius: float, axis: float, ends: tuple[float, float], t: Array, sheet: float) -> Surface:
    """One sheet (`sheet` 0), or the lower or upper one of two (-1, 1), at the hyperbolic angles t."""
    rho, z = (np.sinh(t), sheet * np.cosh(t)) if sheet else (np.cosh(t), np.sinh(t))
    v = (axis * z - ends[0]) / (ends[1] - ends[0])
    return revolved(radius * rho, axis * z, axis * rho, -radius * z, v)


def joined(pieces: Sequence[Surface]) -> Surface:
    """Join several meshes with normals and uvs."""
    starts = np.cumsum([0] + [len(piece.positions) for piece in pieces[:-1]])
    return Surface(
        np.vstack([piece.positions for piece in pieces]),
        np.vstack([piece.faces + start for piece, start in zip(pieces, starts, strict=True)]),
        np.vstack([piece.normals for piece in pieces if piece.normals is not None]),
        np.vstack([piece.uvs for piece in pieces if piece.uvs is not None]),
    )


# --- general quadrics ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Quadric:
    """The quadric p^T M p + g . p + c = 0, with the coefficients A to J of x^2 y^2 z^2 xy xz yz x y z 1."""

    matrix: Array
    linear: Array
    constant: float

    @classmethod
    def of(cls, coefficients: Sequence[float]) -> "Quadric":
        a, b, c, d, e, f, g, h, i, j = coefficients
        matrix = np.array([[a, d / 2.0, e / 2.0], [d / 2.0, b, f / 2.0], [e / 2.0, f / 2.0, c]])
        return cls(matrix, np.array([g, h, i]), j)

    def value(self, p: Array) -> Array:
        return np.einsum("...i,ij,...j->...", p, self.matrix, p) + p @ self.linear + self.constant

    def gradient(self, p: Array) -> Array:
        return 2.0 * p @ self.matrix + self.linear

    def ellipsoid(self) -> Array | None:
        """The affine map (4, 4) of the unit sphere onto the quadric, with normals along the gradient.

        None if the quadric is not an ellipsoid, or if its gradient points inwards.
        """
        values, axes = np.linalg.eigh(self.matrix)
        if values[0] <= 1e-9 * np.abs(values).max():
            return None
        centre = np.linalg.solve(self.matrix, -0.5 * self.linear)
        level = -self.value(centre)
        if level <= 0.0:
            return None
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = axes * np.sqrt(level / values), centre
        return matrix


def within(ellipsoid: Array, low: Array, high: Array) -> bool:
    """Whether the image of the unit sphere under an affine map lies in a box."""
    reach = np.linalg.norm(ellipsoid[:3, :3], axis=1)
    return bool((ellipsoid[:3, 3] - reach >= low).all() and (ellipsoid[:3, 3] + reach <= high).all())


def quadric(shape: Quadric, low: Array, high: Array) -> Surface:
    """The part of a quadric in a box, by marching tetrahedra on a grid of the box.

    Vertices are exact roots along the edges of the grid, so the boundary of the mesh lies on the faces of the box.
    """
    axes = [np.linspace(low[k], high[k], CELLS + 1) for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    values = shape.value(grid)
    triangles = _marched(values >= 0.0)
    if not len(triangles):
        raise ValueError("no surface in its box")
    edges, index = np.unique(triangles.reshape(-1, 2), axis=0, return_inverse=True)
    a, b = grid[edges[:, 0]], grid[edges[:, 1]]
    t = _root(shape, a, b, values[edges[:, 0]], values[edges[:, 1]])[:, None]
    positions = np.where(t == 1.0, b, a + t * (b - a))
    # If the surface passes through a node of the grid, several edges have their root there.
    positions, same = np.unique(positions, axis=0, return_inverse=True)
    faces = _facing(shape, positions, same.reshape(-1)[index].reshape(-1, 3))
    positions, faces = _split(shape, positions, faces, low, high)
    faces = _facing(shape, positions, faces)
    return Surface(positions, faces, _unit(shape.gradient(positions)))


def _marched(outside: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Triangles (M, 3, 2) of the marching tetrahedra. Each corner is an edge of the grid, given by its two nodes in order."""
    size = CELLS + 1
    steps = np.array([size * size, size, 1])
    cube = outside.reshape(size, size, size)
    corners = [cube[x : x + CELLS, y : y + CELLS, z : z + CELLS] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    count = np.sum(corners, axis=0)
    cells = np.argwhere((count > 0) & (count < 8)) @ steps
    triangles = []
    for order in ([0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]):
        # Each of the six tetrahedra of a cell follows its edges from one corner to the opposite one, in one of six orders.
        nodes = cells[:, None] + np.concatenate([[0], np.cumsum(steps[order])])
        # Sort the corners of each tetrahedron: those inside come first.
        rank = np.argsort(outside[nodes], axis=1, kind="stable")
        nodes = np.take_along_axis(nodes, rank, axis=1)
        inside = 4 - outside[nodes].sum(axis=1)
        one, two, three = (nodes[inside == k] for k in (1, 2, 3))
        triangles += [one[:, [[0, 1], [0, 2], [0, 3]]], three[:, [[0, 3], [1, 3], [2, 3]]]]
        triangles += [two[:, [[0, 2], [0, 3], [1, 3]]], two[:, [[0, 2], [1, 3], [1, 2]]]]
    return np.sort(np.concatenate(triangles), axis=2)


def _root(shape: Quadric, a: Array, b: Array, at_a: Array, at_b: Array) -> Array:
    """The t in [0, 1] at which the quadric vanishes on a + t (b - a), given its values of opposite sign at the ends."""
    along = b - a
    square = np.einsum("ni,ij,nj->n", along, shape.matrix, along)
    linear = at_b - at_a - square
    root = np.sqrt(np.maximum(linear * linear - 4.0 * square * at_a, 0.0))
    # Of the two roots -2c/(b +- sqrt), this one changes from the sign at a to the sign at b.
    denominator = linear + np.where(at_b >= 0.0, root, -root)
    t = np.divide(-2.0 * at_a, denominator, out=np.zeros_like(at_a), where=denominator != 0.0)
    # Roots within rounding error of a node are moved to the node.
    return np.clip(t.round(12), 0.0, 1.0)


def _facing(shape: Quadric, positions: Array, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Drop triangles without area, and orient the others counter-clockwise around the gradient."""
    corners = positions[faces]
    facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    side = np.einsum("ni,ni->n", facet, shape.gradient(corners.mean(axis=1)))
    flipped = np.where((side < 0.0)[:, None], faces[:, ::-1], faces)
    return flipped[np.linalg.norm(facet, axis=1) > 0.0]


def _split(
    shape: Quadric, positions: Array, faces: NDArray[np.int64], low: Array, high: Array
) -> tuple[Array, NDArray[np.int64]]:
    """Split each triangle in four and move the new vertices onto the surface; those on a face of the box stay on it."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    unique, index = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    a, b = positions[unique[:, 0]], positions[unique[:, 1]]
    held = (a == b) & ((a == low) | (a == high))
    middle, length = (a + b) / 2.0, np.linalg.norm(b - a, axis=1)
    moved = middle.copy()
    for _ in range(5):
        gradient = np.where(held, 0.0, shape.gradient(moved))
        square = np.einsum("ni,ni->n", gradient, gradient)
        step = np.divide(shape.value(moved), square, out=np.zeros_like(square), where=square > 0.0)
        moved = np.clip(moved - step[:, None] * gradient, low, high)
    # Where the gradient vanishes, as at the apex of a cone, a vertex may move far: keep it on the chord.
    near = np.linalg.norm(moved - middle, axis=1) <= 0.5 * length
    positions = np.vstack([positions, np.where(near[:, None], moved, middle)])
    ab, bc, ca = (index.reshape(-1, 3) + len(positions) - len(unique)).T
    p, q, r = faces.T
    quarters = [[p, ab, ca], [ab, q, bc], [ca, bc, r], [ab, bc, ca]]
    return positions, np.concatenate([np.column_stack(quarter) for quarter in quarters])


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
