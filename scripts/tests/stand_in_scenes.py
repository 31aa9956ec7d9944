"""Scenes, rays and closed forms that the tests of the stand-ins share."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import surfaces
from helpers import need_wavefront

HEAD = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film>
</sensor>
"""
TO_WORLD = """<transform name="to_world">
  <scale x="0.9" y="1.3" z="0.7"/><rotate x="1" y="0" z="0" angle="35"/><translate x="0.2" y="-0.1" z="0.3"/>
</transform>"""
MIRRORED = TO_WORLD.replace('x="0.9"', 'x="-0.9"')
FLIP = '<boolean name="flip_normals" value="true"/>'

Load = Callable[..., Any]
Mask = np.ndarray

# --- scenes -------------------------------------------------------------------------------------------------------------

SPHERE = [1, 1, 1, 0, 0, 0, 0, 0, 0, -1]
SADDLE = [1, -0.7, 0, 0.3, 0, 0, 0, 0.1, -1, 0.05]
BOX = '<point name="bbox_min" value="-0.9, -0.8, -1"/><point name="bbox_max" value="0.9, 0.8, 1"/>'
A, B, C = (-0.4, 0.0, 0.0, 0.9), (0.5, 0.1, 0.0, 0.8), (0.0, 0.5, 0.3, 0.6)


def quadric_xml(coefficients: list[float]) -> str:
    return f'<string name="coefficients" value="{", ".join(map(str, coefficients))}"/>{BOX}'


def sphere_xml(x: float, y: float, z: float, radius: float, rest: str = "") -> str:
    centre = f'<point name="center" value="{x}, {y}, {z}"/>'
    return f'<shape type="sphere">{centre}<float name="radius" value="{radius}"/>{rest}</shape>'


def csg_xml(operation: str, *children: str) -> str:
    return f'<shape type="csg"><string name="operation" value="{operation}"/>{"".join(children)}</shape>'


def absorbing(kind: str) -> str:
    numbers = '<float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>'
    return f'<bsdf type="{kind}">{numbers}<rgb name="absorption" value="0.1, 0.5, 1.5"/></bsdf>'


LIT = """<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.6, 0.3"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><translate x="-2"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.8, 0.7"/></bsdf></shape>
<shape type="sphere"><point name="center" value="0.5, -0.5, 2"/><float name="radius" value="0.2"/>
  <emitter type="area"><rgb name="radiance" value="3, 4, 5"/></emitter></shape>
"""
POINT = '<emitter type="point"><point name="position" value="1, 2, 3"/><rgb name="intensity" value="9, 8, 7"/></emitter>'
PANE = '<shape type="plane"><transform name="to_world"><translate z="0.5"/></transform></shape>'


# --- rays ---------------------------------------------------------------------------------------------------------------


def matrix_of(mirrored: bool) -> np.ndarray:
    """The matrix of TO_WORLD or MIRRORED."""
    c, s = math.cos(math.radians(35.0)), math.sin(math.radians(35.0))
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation @ np.diag([-0.9 if mirrored else 0.9, 1.3, 0.7]), [0.2, -0.1, 0.3]
    return matrix


def rays(count: int, spread: float = 1.2) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a distance of 5 to points near the origin, as origins and directions."""
    rng = np.random.default_rng(3)
    origins = rng.standard_normal((count, 3))
    origins *= 5.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-spread, spread, (count, 3)) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def crossings(mi: Any, scene: Any, origins: np.ndarray, directions: np.ndarray, count: int) -> list[dict[str, np.ndarray]]:
    """The first crossings of each ray with surfaces that are not masked: `valid`, `t`, `p`, `n`, `uv`, `colour`."""
    need_wavefront(mi)
    travelled = np.zeros(len(origins))
    start, left = origins.copy(), np.full(len(origins), count)
    result = [{} for _ in range(count)]
    for crossing in result:
        crossing.update(valid=np.zeros(len(origins), bool), t=np.zeros(len(origins)), p=np.zeros_like(origins))
        crossing.update(n=np.zeros_like(origins), uv=np.zeros((len(origins), 2)), colour=np.zeros_like(origins))
    for _ in range(40):
        si = scene.ray_intersect(mi.Ray3f(mi.Point3f(start.T), mi.Vector3f(directions.T)))
        valid = np.array(si.is_valid()) & (left > 0)
        if not valid.any():
            break
        bsdf = si.bsdf()
        kept = valid & (np.array(bsdf.eval_null_transmission(si, si.is_valid()))[0] < 0.5)
        colour = np.array(bsdf.eval_diffuse_reflectance(si, si.is_valid())).T
        travelled = travelled + np.where(valid, np.array(si.t), 0.0)
        for k, crossing in enumerate(result):
            now = kept & (left == count - k)
            crossing["valid"] |= now
            crossing["t"][now] = travelled[now]
            for name, value in (("p", si.p), ("n", si.sh_frame.n), ("uv", si.uv)):
                crossing[name][now] = np.array(value).T[now]
            crossing["colour"][now] = colour[now]
        left = left - kept
        start = np.where(valid[:, None], np.array(si.p).T + 1e-4 * directions, start)
        travelled = travelled + 1e-4 * valid
    return result


# --- closed forms -------------------------------------------------------------------------------------------------------


def everywhere(p: np.ndarray) -> Mask:
    return np.ones(p.shape[:-1], dtype=bool)


def between(low: float, high: float) -> Callable[[np.ndarray], Mask]:
    return lambda p: (p[..., 2] >= low) & (p[..., 2] <= high)


def boxed(p: np.ndarray) -> Mask:
    return (np.abs(p) <= (0.9, 0.8, 1.0)).all(axis=-1)


def closed_form(
    coefficients: list[float], clip: Callable[[np.ndarray], Mask], matrix: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The first hit of a quadric that is clipped in its own frame.

    Returns t, which is infinite without a hit, and the unit normal along the gradient.
    """
    inverse = np.linalg.inv(matrix)
    o, d = origins @ inverse[:3, :3].T + inverse[:3, 3], directions @ inverse[:3, :3].T
    quadric = surfaces.Quadric.of(coefficients)
    a = np.einsum("ni,ij,nj->n", d, quadric.matrix, d)
    b = np.einsum("ni,ni->n", d, quadric.gradient(o))
    root = np.sqrt(np.maximum(b * b - 4.0 * a * quadric.value(o), 0.0))
    real = b * b >= 4.0 * a * quadric.value(o)
    with np.errstate(divide="ignore", invalid="ignore"):
        both = np.stack([(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)])
        both = np.where(np.abs(a) > 1e-12, both, -quadric.value(o) / b)
    hit = real & (both > 0.0) & clip(o + both[..., None] * d)
    t = np.where(hit, both, np.inf).min(axis=0)
    normal = quadric.gradient(o + np.where(np.isfinite(t), t, 0.0)[:, None] * d) @ inverse[:3, :3]
    return t, normal / np.linalg.norm(normal, axis=1, keepdims=True)
