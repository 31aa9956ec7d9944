"""Rough ground: a height field of fractional Brownian motion, z up."""

import math

from meshes import Mesh, Vec3

# The coarsest octave has FREQUENCY lattice points per unit. Each further octave has twice the frequency and GAIN times the
# amplitude of the one before, so the Hurst exponent is 0.85.
FREQUENCY = 0.7
OCTAVES = 5
AMPLITUDE = 0.24
GAIN = 0.5**0.85
# Each octave is rotated and shifted relative to the one before, so that their zeros do not coincide.
COS, SIN = 0.8, 0.6
SHIFT = (17.31, -5.83)

HALF_SIZE = 14.0
# The highest point of the ground within this distance of the origin is at z = 0, so that objects can stand on it.
STAND = 0.8


def ground(seed: int, quads: int) -> Mesh:
    """The square [-14, 14]^2 as `quads` x `quads` quads split into triangles, smallest in the middle, with smooth normals."""
    lines = [_spread(2.0 * k / quads - 1.0) for k in range(quads + 1)]
    positions = [(x, y, fractal(seed, x, y)) for y in lines for x in lines]
    faces: list[tuple[int, ...]] = []
    for j in range(quads):
        for i in range(quads):
            a = j * (quads + 1) + i
            b, c, d = a + 1, a + quads + 2, a + quads + 1
            faces += [(a, b, c), (a, c, d)]
    return Mesh(_lowered(positions), faces, _normals(positions, quads + 1))


def _spread(s: float) -> float:
    """Map [-1, 1] to the side of the square; the slope at the ends is 18 times the slope in the middle."""
    return HALF_SIZE * s * (0.15 + 0.85 * s * s)


def _lowered(positions: list[Vec3]) -> list[Vec3]:
    """Move positions along z, so that the highest vertex within `STAND` of the axis is at 0."""
    top = max(z for x, y, z in positions if x * x + y * y <= STAND * STAND)
    return [(x, y, z - top) for x, y, z in positions]


def _normals(positions: list[Vec3], side: int) -> list[Vec3]:
    """Normals from the differences between the neighbours of each vertex; at an edge, between the vertex and its neighbour."""
    normals = []
    for k in range(side * side):
        i, j = k % side, k // side
        west, east = positions[k - (i > 0)], positions[k + (i < side - 1)]
        south, north = positions[k - side * (j > 0)], positions[k + side * (j < side - 1)]
        dx, dy = (east[2] - west[2]) / (east[0] - west[0]), (north[2] - south[2]) / (north[1] - south[1])
        length = math.sqrt(1.0 + dx * dx + dy * dy)
        normals.append((-dx / length, -dy / length, 1.0 / length))
    return normals


def fractal(seed: int, x: float, y: float) -> float:
    """A sum of octaves of gradient noise. Musgrave, in Ebert et al. 2003, "Texturing and Modeling", chapter 16."""
    u, v, amplitude, total = FREQUENCY * x, FREQUENCY * y, AMPLITUDE, 0.0
    for octave in range(OCTAVES):
        total += amplitude * gradient_noise(seed + octave, u, v)
        u, v = 2.0 * (COS * u - SIN * v) + SHIFT[0], 2.0 * (SIN * u + COS * v) + SHIFT[1]
        amplitude *= GAIN
    return total


def gradient_noise(seed: int, u: float, v: float) -> float:
    """Gradient noise: a random slope at each lattice point, blended by a polynomial. Perlin 2002, "Improving noise"."""
    i, j = math.floor(u), math.floor(v)
    s, t = u - i, v - j
    total = 0.0
    for k in (0, 1):
        for m in (0, 1):
            along_u, along_v = _slope(seed, i + k, j + m)
            total += _weight(s, k) * _weight(t, m) * (along_u * (s - k) + along_v * (t - m))
    return total


def _weight(s: float, corner: int) -> float:
    """The weight of the lattice point at 0 or at 1."""
    rise = s * s * s * (s * (6.0 * s - 15.0) + 10.0)
    return rise if corner else 1.0 - rise


def _slope(seed: int, i: int, j: int) -> tuple[float, float]:
    """The slope at a lattice point: two numbers in [-1, 1)."""
    bits = _mixed((seed << 40) ^ ((i & 0xFFFFF) << 20) ^ (j & 0xFFFFF))
    return (bits >> 32) / 2.0**31 - 1.0, (bits & 0xFFFFFFFF) / 2.0**31 - 1.0


def _mixed(x: int) -> int:
    """SplitMix64, a hash of 64 bits. Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators"."""
    x = (x + 0x9E3779B97F4A7C15) & 0xFFFFFFFFFFFFFFFF
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & 0xFFFFFFFFFFFFFFFF
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & 0xFFFFFFFFFFFFFFFF
    return x ^ (x >> 31)
