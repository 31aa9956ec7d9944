#!/usr/bin/env python3
"""Generate the meshes and textures that the scenes in assets/scenes use.

The files are the same, byte for byte, on every machine: vertices are rounded to float32 or to decimals, and the PNG files contain
stored (uncompressed) blocks. Only manifold3d, which computes the closed teapot, could change a file; requirements.txt fixes its
version.
"""

import argparse
import math
import struct
import sys
import zlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from ground import ground
from meshes import Mesh, Vec3, kcply_bytes, obj_bytes, ply_bytes
from snifter import cognac_surface, cognac_wall, snifter
from teapot import closed_teapot, open_teapot
from user_error import exit_code

Rgb8 = tuple[int, int, int]

ASSETS = Path(__file__).resolve().parent.parent / "assets"


# --- vectors -----------------------------------------------------------------------------------------------------------


def _sub(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _scale(a: Vec3, s: float) -> Vec3:
    return (a[0] * s, a[1] * s, a[2] * s)


def _normalize(a: Vec3) -> Vec3:
    return _scale(a, 1.0 / math.sqrt(_dot(a, a)))


# --- shapes ------------------------------------------------------------------------------------------------------------


def grid_faces(columns: int, rows: int) -> list[tuple[int, ...]]:
    """The quads of a grid whose (columns + 1) x (rows + 1) vertices are stored row by row."""
    starts = [j * (columns + 1) + i for j in range(rows) for i in range(columns)]
    return [(a, a + 1, a + columns + 2, a + columns + 1) for a in starts]


def grid_mesh(point: Callable[[float, float], Vec3], columns: int, rows: int) -> Mesh:
    """Tessellate point(u, v), for u and v in [0, 1], into `columns` x `rows` quads with normals along dp/du x dp/dv."""
    mesh = Mesh([], grid_faces(columns, rows))
    step = 1e-4
    for j in range(rows + 1):
        for i in range(columns + 1):
            u, v = i / columns, j / rows
            du = _sub(point(u + step, v), point(u - step, v))
            dv = _sub(point(u, v + step), point(u, v - step))
            mesh.positions.append(point(u, v))
            mesh.normals.append(_normalize(_cross(du, dv)))
            mesh.uvs.append((u, v))
    return mesh


def triangulated(mesh: Mesh) -> Mesh:
    """Split each polygon into a fan of triangles."""
    faces = [(f[0], f[k], f[k + 1]) for f in mesh.faces for k in range(1, len(f) - 1)]
    return Mesh(mesh.positions, faces, mesh.normals, mesh.uvs)


def bumpy_torus() -> Mesh:
    """A torus of radius 1 around the y axis whose tube radius varies; 48 x 24 quads split into triangles."""

    def point(u: float, v: float) -> Vec3:
        a, b = 2.0 * math.pi * u, 2.0 * math.pi * v
        tube = 0.38 * (1.0 + 0.16 * math.sin(5.0 * a) * math.cos(2.0 * b))
        ring = 1.0 + tube * math.cos(b)
        return (ring * math.sin(a), tube * math.sin(b), ring * math.cos(a))

    return triangulated(grid_mesh(point, 48, 24))


def vase() -> Mesh:
    """An open surface of revolution around the y axis, 0 <= y <= 1.6, made of quads with outward normals."""

    def point(u: float, v: float) -> Vec3:
        a = 2.0 * math.pi * u
        radius = 0.36 + 0.18 * math.sin(0.4 + 4.6 * v) + 0.10 * v * v
        return (radius * math.sin(a), 1.6 * v, radius * math.cos(a))

    return grid_mesh(point, 32, 18)


def icosahedron() -> Mesh:
    """The regular icosahedron inscribed in the unit sphere, with faces counter-clockwise from outside."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    corners = [(0.0, s, t * g) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    corners += [(s, t * g, 0.0) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    corners += [(t * g, 0.0, s) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    faces = []
    for a in range(12):
        for b in range(a + 1, 12):
            for c in range(b + 1, 12):
                edges = [_sub(corners[p], corners[q]) for p, q in ((a, b), (b, c), (c, a))]
                if all(abs(_dot(e, e) - 4.0) < 1e-9 for e in edges):
                    outward = _dot(_cross(edges[0], edges[1]), corners[a]) > 0.0
                    faces.append((a, b, c) if outward else (a, c, b))
    return Mesh([_normalize(p) for p in corners], faces)


def icosphere(levels: int) -> Mesh:
    """The icosahedron with each face split in four `levels` times, and all vertices on the unit sphere."""
    mesh = icosahedron()
    for _ in range(levels):
        midpoints: dict[tuple[int, int], int] = {}
        positions, faces = list(mesh.positions), []
        for a, b, c in mesh.faces:
            middle = []
            for p, q in ((a, b), (b, c), (c, a)):
                key = (min(p, q), max(p, q))
                if key not in midpoints:
                    midpoints[key] = len(positions)
                    total = [x + y for x, y in zip(positions[p], positions[q], strict=True)]
                    positions.append(_normalize((total[0], total[1], total[2])))
                middle.append(midpoints[key])
            ab, bc, ca = middle
            faces += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        mesh = Mesh(positions, faces)
    return mesh


def pebble() -> Mesh:
    """A closed, smooth stone with exact normals: r(d) = 1 + xy/4 - z^2/5 + x^2 z/6, where d is the unit direction."""
    sphere = icosphere(4)
    positions, normals = [], []
    for d in sphere.positions:
        x, y, z = d
        radius = 1.0 + x * y / 4.0 - z * z / 5.0 + x * x * z / 6.0
        slope = (y / 4.0 + x * z / 3.0, x / 4.0, x * x / 6.0 - 2.0 * z / 5.0)
        tangential = _sub(slope, _scale(d, _dot(slope, d)))
        positions.append(_scale(d, radius))
        normals.append(_normalize(_sub(d, _scale(tangential, 1.0 / radius))))
    return Mesh(positions, sphere.faces, normals)


def gem() -> Mesh:
    """A faceted stone: an icosahedron stretched along y, without normals."""
    base = icosahedron()
    tilt = 0.35
    positions = []
    for x, y, z in base.positions:
        x, y = x * math.cos(tilt) - y * math.sin(tilt), x * math.sin(tilt) + y * math.cos(tilt)
        positions.append((0.8 * x, 1.1 * y, 0.75 * z))
    return Mesh(positions, base.faces)


def terrain() -> Mesh:
    """A coarse height field over [-2, 2]^2 with triangles of very different shapes, with uvs and without normals."""

    def point(u: float, v: float) -> Vec3:
        x, z = 4.0 * u**1.4 - 2.0, 2.0 - 4.0 * v
        return (x, 0.22 * math.sin(2.3 * x + 0.5) * math.cos(1.9 * z) + 0.06 * x * z, z)

    columns, rows = 14, 11
    mesh = Mesh([], grid_faces(columns, rows))
    for j in range(rows + 1):
        for i in range(columns + 1):
            mesh.positions.append(point(i / columns, j / rows))
            mesh.uvs.append((i / columns, j / rows))
    return triangulated(mesh)


def lamp() -> Mesh:
    """A folded fan of seven triangles of different areas, whose geometric normals point to -y."""
    rim = [(0.9, 0.0), (0.5, 0.55), (0.1, 0.35), (-0.35, 0.7), (-0.8, 0.1), (-0.3, -0.5), (0.4, -0.65)]
    positions: list[Vec3] = [(0.05, 0.30, 0.02)]
    positions += [(x, 0.10 * (k % 2), z) for k, (x, z) in enumerate(rim)]
    faces = [(0, 1 + k, 1 + (k + 1) % len(rim)) for k in range(len(rim))]
    return Mesh(positions, faces)


# --- files -------------------------------------------------------------------------------------------------------------


def png_bytes(rows: Sequence[Sequence[Iterable[int]]], channels: int) -> bytes:
    """Encode 8-bit rows of pixels, the top row first, with 1 (grey) or 3 (RGB) channels as PNG with stored blocks."""
    raw = b"".join(b"\0" + bytes(c for pixel in row for c in pixel) for row in rows)
    blocks = [raw[k : k + 65535] for k in range(0, len(raw), 65535)]
    stream = b"\x78\x01"
    for k, block in enumerate(blocks):
        stream += struct.pack("<BHH", k == len(blocks) - 1, len(block), 0xFFFF - len(block)) + block
    stream += struct.pack(">I", zlib.adler32(raw))
    colour_type = {1: 0, 3: 2}[channels]
    size = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, colour_type, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", size) + _chunk(b"IDAT", stream) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


# --- textures ----------------------------------------------------------------------------------------------------------


def mosaic() -> bytes:
    """48 x 32 RGB, to be decoded as sRGB: different coloured tiles, without symmetry under flips or a swap of axes."""
    palette: list[Rgb8] = [(214, 164, 92), (88, 132, 156), (196, 88, 72), (112, 148, 84), (232, 220, 196), (72, 64, 88)]
    rows = []
    for y in range(32):
        row = []
        for x in range(48):
            column, line = (x + 3 * (y // 8)) // 8, y // 8
            grout = (x + 3 * line) % 8 == 0 or y % 8 == 0
            row.append((150, 142, 128) if grout else palette[(column * 5 + line * 3 + column * line) % 6])
        rows.append(row)
    for y in range(2, 7):
        for x in range(2, 2 + (7 - y)):
            rows[y][x] = (250, 40, 30)
    return png_bytes(rows, 3)


def weave() -> bytes:
    """24 x 40 RGB, to be read with raw=true: smooth gradients that differ between channels."""
    rows = []
    for y in range(40):
        row = []
        for x in range(24):
            red = 40 + 7 * x
            green = 30 + 4 * y
            blue = 90 + (x * y) % 97
            row.append((red, green, blue))
        rows.append(row)
    return png_bytes(rows, 3)


def stripes() -> bytes:
    """16 x 20 grey: oblique stripes with a bright corner."""
    rows = [[(230,) if x < 4 and y < 5 else (60 + 22 * ((x + 2 * y) % 8),) for x in range(16)] for y in range(20)]
    return png_bytes(rows, 1)


def sky() -> bytes:
    """64 x 32 RGB, to be decoded as sRGB: a latitude-longitude map of a sky with a small sun, clouds and a brown ground."""
    rows = []
    for y in range(32):
        row: list[Rgb8] = []
        for x in range(64):
            cloud = max(0, 7 - (x * 3 + y * y) % 23) * 6 if 4 < y < 14 else 0
            blue = (60 + 2 * y + cloud, 84 + 2 * y + cloud, 128 + cloud)
            row.append(blue if y < 16 else (74 - y, 62 - y, 50 - y))
        rows.append(row)
    for y in (9, 10):
        for x in (40, 41):
            rows[y][x] = (255, 250, 235)
    return png_bytes(rows, 3)


def assets() -> dict[str, bytes]:
    """The bytes of every generated file, by its path under assets/."""
    coarse, fine = open_teapot(6), open_teapot(10)
    return {
        "meshes/bumpy-torus.ply": ply_bytes(bumpy_torus(), "binary_little_endian"),
        "meshes/cognac-surface.ply": ply_bytes(cognac_surface(), "binary_little_endian"),
        "meshes/cognac-wall.ply": ply_bytes(cognac_wall(), "binary_little_endian"),
        "meshes/gem.ply": ply_bytes(gem(), "ascii"),
        "meshes/ground.ply": ply_bytes(ground(2026, 110), "binary_little_endian"),
        "meshes/lamp.ply": ply_bytes(lamp(), "ascii"),
        "meshes/pebble.ply": ply_bytes(pebble(), "binary_big_endian"),
        "meshes/snifter.ply": ply_bytes(snifter(), "binary_little_endian"),
        "meshes/teapot-closed.ply": ply_bytes(closed_teapot(10), "binary_little_endian"),
        "meshes/teapot-coarse.kcply": kcply_bytes(coarse, 0),
        "meshes/teapot-coarse.ply": ply_bytes(coarse, "binary_little_endian"),
        "meshes/teapot-fine.kcply": kcply_bytes(fine, 1),
        "meshes/teapot-fine.ply": ply_bytes(fine, "binary_little_endian"),
        "meshes/terrain.ply": ply_bytes(terrain(), "binary_little_endian"),
        "meshes/vase.obj": obj_bytes(vase()),
        "textures/mosaic.png": mosaic(),
        "textures/sky.png": sky(),
        "textures/stripes.png": stripes(),
        "textures/weave.png": weave(),
    }


def write(out: Path) -> int:
    for name, content in assets().items():
        path = out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        print(f"{path}: {len(content)} bytes")
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ASSETS, metavar="FOLDER", help="folder of the files (default: assets/)")
    arguments = parser.parse_args()
    return exit_code(lambda: write(arguments.out))


if __name__ == "__main__":
    sys.exit(main())
