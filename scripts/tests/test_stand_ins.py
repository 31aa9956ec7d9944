"""The stand-ins for etendue's plugins in Mitsuba: intersections compared with closed forms, masks, errors, provenance."""

import math
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mitsuba_reference as ref
import stand_ins
import surfaces

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


@pytest.fixture
def load(renderer: ref.Renderer, tmp_path: Path) -> Load:
    """Load the body of a scene; further arguments are parameters."""

    def loaded(body: str, head: str = HEAD, **params: str) -> Any:
        path = tmp_path / "scene.xml"
        path.write_text(head + body + "</scene>")
        return ref.load_scene(renderer, path, params)

    return loaded


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
    if "scalar" in mi.variant():
        pytest.fail(f"this test needs a wavefront, but Mitsuba runs {mi.variant()}: {ref.INSTALL_LLVM}", pytrace=False)
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


# --- single shapes ------------------------------------------------------------------------------------------------------


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


SQUARES = [1 / 0.36, 1 / 0.81, 1 / 1.21]
SPHERE = [1, 1, 1, 0, 0, 0, 0, 0, 0, -1]
SADDLE = [1, -0.7, 0, 0.3, 0, 0, 0, 0.1, -1, 0.05]
TILTED = [1, 1.4, 2, 0.3, -0.2, 0.1, 0.1, -0.2, 0.1, -0.3]
OPEN_BALL = [1, 1, 1, 0.2, 0, 0, 0, 0, 0, -1.2]
BOX = '<point name="bbox_min" value="-0.9, -0.8, -1"/><point name="bbox_max" value="0.9, 0.8, 1"/>'


def quadric_xml(coefficients: list[float]) -> str:
    return f'<string name="coefficients" value="{", ".join(map(str, coefficients))}"/>{BOX}'


# Plugin, parameters, the quadric, its clipping test, and the errors of the stand-in: the maximum over positions, and the 99th
# percentile over normals.
SHAPES = {
    "plane": ("plane", "", [0, 0, 0, 0, 0, 0, 0, 0, 1, 0], everywhere, 2e-5, 2e-7),
    "ellipsoid": (
        "ellipsoid",
        '<point name="center" x="0.1" y="0.2" z="-0.1"/><vector name="radii" value="0.6, 0.9, 1.1"/>',
        [*SQUARES, 0, 0, 0, -0.2 * SQUARES[0], -0.4 * SQUARES[1], 0.2 * SQUARES[2], np.dot(SQUARES, [0.01, 0.04, 0.01]) - 1],
        everywhere,
        1e-5,
        2e-5,
    ),
    "scaled sphere": ("sphere", "", SPHERE, everywhere, 2e-6, 3e-6),
    "scaled cylinder": ("cylinder", "", [1, 1, 0, 0, 0, 0, 0, 0, 0, -1], between(0, 1), 5e-6, 5e-6),
    "cone": ("cone", '<float name="radius" value="0.7"/>', [1, 1, -0.49, 0, 0, 0, 0, 0, 0.98, -0.49], between(0, 1), 2e-5, 4e-5),
    "paraboloid": (
        "paraboloid",
        '<float name="radius" value="0.9"/><float name="height" value="1.2"/>',
        [1, 1, 0, 0, 0, 0, 0, 0, -0.675, 0],
        between(0, 1.2),
        2e-5,
        7e-5,
    ),
    "one sheet": (
        "hyperboloid",
        '<float name="radius" value="0.5"/><float name="axis" value="0.8"/><float name="z_min" value="-0.6"/>',
        [4, 4, -1 / 0.64, 0, 0, 0, 0, 0, 0, -1],
        between(-0.6, 1),
        2e-5,
        4e-5,
    ),
    "two sheets": (
        "hyperboloid",
        '<integer name="sheets" value="2"/><float name="radius" value="0.5"/><float name="axis" value="0.4"/>'
        '<float name="z_min" value="-1.1"/>',
        [4, 4, -1 / 0.16, 0, 0, 0, 0, 0, 0, 1],
        between(-1.1, 1),
        2e-5,
        4e-5,
    ),
    "saddle": ("quadric", quadric_xml(SADDLE), SADDLE, boxed, 5e-5, 1e-4),
    "tilted ellipsoid": ("quadric", quadric_xml(TILTED), TILTED, boxed, 1.5e-4, 8e-4),
    "open ball": ("quadric", quadric_xml(OPEN_BALL), OPEN_BALL, boxed, 6e-5, 1.2e-4),
}


@pytest.mark.parametrize("placing", ["", TO_WORLD, MIRRORED + FLIP], ids=["as is", "placed", "mirrored and flipped"])
@pytest.mark.parametrize("name", SHAPES)
def test_rays_hit_the_shape(load: Load, renderer: ref.Renderer, name: str, placing: str) -> None:
    plugin, parameters, coefficients, clip, offset, turn = SHAPES[name]
    scene = load(f'<shape type="{plugin}">{parameters}{placing}</shape>')
    origins, directions = rays(20_000)
    matrix = matrix_of("-0.9" in placing) if placing else np.eye(4)
    t, normal = closed_form(coefficients, clip, matrix, origins, directions)
    # The stand-in for the plane is finite.
    near = ~((t > 50.0) & np.isfinite(t))
    origins, directions, t, normal = (values[near] for values in (origins, directions, t, normal))
    found = crossings(renderer.mi, scene, origins, directions, 1)[0]
    both = np.isfinite(t) & found["valid"]
    # All but a few rays, which pass close to an edge or a silhouette.
    same = both & (np.abs(t - found["t"]) < 0.01)
    assert same.sum() > 1500
    assert (np.isfinite(t) | found["valid"]).sum() - same.sum() <= 3
    error, cosine = np.abs(t - found["t"])[same], np.abs(np.einsum("ni,ni->n", normal, directions))[same]
    assert (error * np.maximum(cosine, 0.02) / np.maximum(1.0, t[same] / 6.0)).max() < offset
    turned = found["n"][same] * (-1.0 if FLIP in placing else 1.0)
    assert np.percentile(np.linalg.norm(turned - normal[same], axis=1), 99) < turn


@pytest.mark.parametrize("name", ["cone", "paraboloid", "one sheet", "two sheets"])
def test_uv_is_azimuth_and_height(load: Load, renderer: ref.Renderer, name: str) -> None:
    plugin, parameters, _, clip, *_ = SHAPES[name]
    ends = [z for z in np.linspace(-2.0, 2.0, 4001) if clip(np.array([0.0, 0.0, z]))]
    found = crossings(renderer.mi, load(f'<shape type="{plugin}">{parameters}</shape>'), *rays(10_000), 1)[0]
    x, y, z = found["p"][found["valid"]].T
    u, v = found["uv"][found["valid"]].T
    turn = np.mod(np.arctan2(y, x) / (2.0 * np.pi) - u, 1.0)
    assert (np.minimum(turn, 1.0 - turn) * np.hypot(x, y)).max() < 1e-4
    assert np.allclose(v, (z - ends[0]) / (ends[-1] - ends[0]), atol=1e-3)


def test_uv_of_the_plane_is_its_local_xy(load: Load, renderer: ref.Renderer) -> None:
    found = crossings(renderer.mi, load(f'<shape type="plane">{TO_WORLD}</shape>'), *rays(20_000), 1)[0]
    inverse = np.linalg.inv(matrix_of(False))
    local = found["p"] @ inverse[:3, :3].T + inverse[:3, 3]
    near = found["valid"] & (np.linalg.norm(found["p"], axis=1) < 50.0)
    size = np.maximum(np.abs(local[near, :2]).max(axis=1), 1.0)
    assert (np.abs(found["uv"][near] - local[near, :2]).max(axis=1) / size).max() < 3e-6
    assert np.abs(found["p"][found["valid"]]).max() > 100.0


def test_an_ellipsoid_with_an_emitter_is_a_mesh_of_the_right_area(load: Load) -> None:
    scene = load('<shape type="ellipsoid"><vector name="radii" value="1.2, 0.8, 0.5"/><emitter type="area"/></shape>')
    assert len(scene.emitters()) == 1
    assert np.ravel(scene.shapes()[0].surface_area())[0] == pytest.approx(8.512099114, rel=2e-4)


def test_a_triangle_is_flat_or_has_its_normals(load: Load, renderer: ref.Renderer) -> None:
    corners = np.array([[-1.0, -1.0, 0.2], [1.5, -0.5, 0.0], [0.0, 1.2, -0.4]])
    points = "".join(f'<point name="p{k}" value="{x}, {y}, {z}"/>' for k, (x, y, z) in enumerate(corners))
    normals = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.6, 0.8]])
    given = "".join(f'<vector name="n{k}" value="{x}, {y}, {z}"/>' for k, (x, y, z) in enumerate(normals))
    origins, directions = rays(5000)
    face = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    t = ((corners[0] - origins) @ face) / (directions @ face)
    p = origins + t[:, None] * directions
    weights = np.linalg.solve(np.vstack([corners.T, [1.0, 1.0, 1.0]])[[0, 1, 3]], np.vstack([p.T[:2], np.ones(len(p))])).T
    inside = (weights > 0.0).all(axis=1) & (t > 0.0)
    for body, expected in ((points, np.tile(face, (len(p), 1))), (points + given, weights @ normals)):
        found = crossings(renderer.mi, load(f'<shape type="triangle">{body}</shape>'), origins, directions, 1)[0]
        assert (found["valid"] == inside).mean() > 0.999
        both = found["valid"] & inside
        assert both.sum() > 500
        assert np.allclose(found["t"][both], t[both], atol=2e-5)
        assert np.allclose(found["n"][both], (expected / np.linalg.norm(expected, axis=1, keepdims=True))[both], atol=1e-5)


TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [1.2, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.2, 0.9]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def kcply(base: int, vertices: np.ndarray = TETRAHEDRON) -> str:
    lines = ["kcply", f"element vertex {len(vertices)}", f"element face {len(FACES)}"]
    lines += [" ".join(map(str, vertex)) for vertex in vertices]
    return "\n".join(lines + ["3 " + " ".join(str(k + base) for k in face) + " " for face in FACES]) + "\n"


@pytest.mark.parametrize(("base", "flat"), [(0, "true"), (1, "false")])
def test_kcply_is_the_same_mesh_as_ply(load: Load, renderer: ref.Renderer, tmp_path: Path, base: int, flat: str) -> None:
    (tmp_path / "a.kcply").write_text(kcply(base))
    surfaces.write_ply(tmp_path / "a.ply", surfaces.Surface(TETRAHEDRON, FACES))
    rest = f'<boolean name="face_normals" value="{flat}"/>{TO_WORLD}</shape>'
    scenes = [load(f'<shape type="{kind}"><string name="filename" value="a.{kind}"/>{rest}') for kind in ("kcply", "ply")]
    ours, theirs = (crossings(renderer.mi, scene, *rays(3000), 1)[0] for scene in scenes)
    assert ours["valid"].sum() > 300
    assert all(np.array_equal(ours[name], theirs[name]) for name in ("valid", "t", "n"))


def test_kcply_index_bases(tmp_path: Path) -> None:
    path = tmp_path / "a.kcply"
    five = np.vstack([[9.0, 9.0, 9.0], TETRAHEDRON])
    # The indices 1 to 4 of five vertices fit both bases, so the parameter must choose one.
    path.write_text(kcply(1, five))
    with pytest.raises(ref.UserError, match="do not fit index_base auto"):
        surfaces.read_kcply(path, "auto")
    assert np.array_equal(surfaces.read_kcply(path, "0").faces, FACES + 1)
    assert np.array_equal(surfaces.read_kcply(path, "1").faces, FACES)
    path.write_text(kcply(2))
    with pytest.raises(ref.UserError, match="indices 2 to 5 of 4 vertices"):
        surfaces.read_kcply(path, "auto")


@pytest.mark.parametrize("text", ["", "ply\n", kcply(0).replace("3 0", "4 0"), kcply(0)[:-10], kcply(0).replace("1.2", "x")])
def test_a_broken_kcply_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.kcply").write_text(text)
    with pytest.raises(ref.UserError, match="not a kcply file"):
        surfaces.read_kcply(tmp_path / "a.kcply", "auto")


# --- csg ------------------------------------------------------------------------------------------------------------------


def ball(p: np.ndarray, x: float, y: float, z: float, radius: float) -> Mask:
    return ((p - np.array([x, y, z])) ** 2).sum(axis=-1) < radius * radius


def around(p: np.ndarray) -> np.ndarray:
    """Squared distance from the z axis."""
    return p[..., 0] ** 2 + p[..., 1] ** 2


def sphere_xml(x: float, y: float, z: float, radius: float, rest: str = "") -> str:
    centre = f'<point name="center" value="{x}, {y}, {z}"/>'
    return f'<shape type="sphere">{centre}<float name="radius" value="{radius}"/>{rest}</shape>'


def csg_xml(operation: str, *children: str) -> str:
    return f'<shape type="csg"><string name="operation" value="{operation}"/>{"".join(children)}</shape>'


A, B, C = (-0.4, 0.0, 0.0, 0.9), (0.5, 0.1, 0.0, 0.8), (0.0, 0.5, 0.3, 0.6)
SOLIDS: dict[str, tuple[str, Callable[[np.ndarray], Mask]]] = {
    "union": (csg_xml("union", sphere_xml(*A), sphere_xml(*B)), lambda p: ball(p, *A) | ball(p, *B)),
    "intersection": (csg_xml("intersection", sphere_xml(*A), sphere_xml(*B)), lambda p: ball(p, *A) & ball(p, *B)),
    "difference": (
        csg_xml("difference", sphere_xml(*A), sphere_xml(*B), sphere_xml(*C)),
        lambda p: ball(p, *A) & ~ball(p, *B) & ~ball(p, *C),
    ),
    "difference of a difference": (
        csg_xml("difference", sphere_xml(*A), csg_xml("difference", sphere_xml(*B), sphere_xml(*C))),
        lambda p: ball(p, *A) & ~(ball(p, *B) & ~ball(p, *C)),
    ),
    "cut cube": (
        csg_xml("difference", '<shape type="cube"/>', '<shape type="plane"><transform name="to_world">'
                '<rotate y="1" angle="40"/><translate x="-0.3"/></transform></shape>'),
        lambda p: (np.abs(p) < 1.0).all(axis=-1)
        & ~((p[..., 0] + 0.3) * math.sin(math.radians(40)) + p[..., 2] * math.cos(math.radians(40)) < 0.0),
    ),
    "drilled ellipsoid": (
        csg_xml("difference", '<shape type="ellipsoid"><vector name="radii" value="1.2, 0.8, 0.6"/></shape>',
                '<shape type="cylinder"><point name="p0" value="-0.5, 0, -1"/><point name="p1" value="0.5, 0, 0.4"/>'
                '<float name="radius" value="0.3"/></shape>'),
        lambda p: (((p / (1.2, 0.8, 0.6)) ** 2).sum(axis=-1) < 1.0)
        & ~in_tube(p, np.array([-0.5, 0.0, -1.0]), np.array([0.5, 0.0, 0.4]), 0.3),
    ),
    "tube": (
        csg_xml("union", '<shape type="cylinder"><point name="p0" value="0, -1, 0"/><point name="p1" value="0.3, 1, 0.5"/>'
                '<float name="radius" value="0.5"/></shape>'),
        lambda p: in_tube(p, np.array([0.0, -1.0, 0.0]), np.array([0.3, 1.0, 0.5]), 0.5),
    ),
    "cone": (
        csg_xml("difference", '<shape type="cone"><float name="radius" value="0.8"/></shape>', sphere_xml(*C)),
        lambda p: (around(p) < (0.8 * (1.0 - p[..., 2])) ** 2) & between(0, 1)(p) & ~ball(p, *C),
    ),
    "paraboloid": (
        csg_xml("union", '<shape type="paraboloid"><float name="radius" value="0.8"/></shape>', sphere_xml(*C)),
        lambda p: ((around(p) < 0.64 * p[..., 2]) & (p[..., 2] < 1.0)) | ball(p, *C),
    ),
    "one sheet": (
        csg_xml("difference", '<shape type="hyperboloid"><float name="radius" value="0.5"/></shape>', sphere_xml(*C)),
        lambda p: (4.0 * around(p) < 1.0 + p[..., 2] ** 2) & between(-1, 1)(p) & ~ball(p, *C),
    ),
    "two sheets": (
        csg_xml("union", '<shape type="hyperboloid"><float name="axis" value="0.4"/><float name="radius" value="0.4"/>'
                '<integer name="sheets" value="2"/></shape>'),
        lambda p: (around(p) < p[..., 2] ** 2 - 0.16) & between(-1, 1)(p),
    ),
    "saddle": (
        csg_xml("intersection", f'<shape type="quadric">{quadric_xml(SADDLE)}</shape>', sphere_xml(*A)),
        lambda p: (surfaces.Quadric.of(SADDLE).value(p) < 0.0) & boxed(p) & ball(p, *A),
    ),
}


def in_tube(p: np.ndarray, a: np.ndarray, b: np.ndarray, radius: float) -> Mask:
    axis = b - a
    along = (p - a) @ axis / (axis @ axis)
    return (along > 0.0) & (along < 1.0) & ((((p - a) - along[..., None] * axis) ** 2).sum(axis=-1) < radius * radius)


def changes(inside: Callable[[np.ndarray], Mask], origins: np.ndarray, directions: np.ndarray, count: int) -> np.ndarray:
    """The distances (count, rays) up to 9 at which the membership changes along each ray; infinite where it does not."""
    steps = np.linspace(2.0, 9.0, 1401)
    samples = inside(origins[:, None] + steps[:, None] * directions[:, None])
    found = np.full((count, len(origins)), np.inf)
    ray, step = np.nonzero(samples[:, 1:] != samples[:, :-1])
    order = np.arange(len(ray)) - np.searchsorted(ray, ray)
    ray, step, order = (values[order < count] for values in (ray, step, order))
    low, high, before = steps[step], steps[step + 1], samples[ray, step]
    for _ in range(45):
        middle = (low + high) / 2.0
        same = inside(origins[ray] + middle[:, None] * directions[ray]) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    found[order, ray] = (low + high) / 2.0
    return found


def normals_at(inside: Callable[[np.ndarray], Mask], origins: np.ndarray, directions: np.ndarray, count: int) -> np.ndarray:
    """Unit normals (count, rays, 3) against the ray, from the changes of membership along shifted rays."""
    across = np.cross(directions, np.roll(directions, 1, axis=1) + np.array([0.1, 0.2, 0.3]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    shifts = [np.zeros_like(across), 1e-6 * across, 1e-6 * np.cross(directions, across)]
    points = [
        origins + shift + changes(inside, origins + shift, directions, count)[..., None] * directions for shift in shifts
    ]
    with np.errstate(invalid="ignore"):
        normals = np.cross(points[1] - points[0], points[2] - points[0])
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return -normals * np.sign(np.einsum("kni,ni->kn", normals, directions))[..., None]


@pytest.mark.parametrize("placing", ["", MIRRORED, FLIP], ids=["as is", "mirrored", "flipped"])
@pytest.mark.parametrize("name", SOLIDS)
def test_rays_cross_the_solid(load: Load, renderer: ref.Renderer, name: str, placing: str) -> None:
    """The first two crossings of each ray, in and out, with normals to the outside, compared with the inequalities."""
    body, local = SOLIDS[name]
    scene = load(body[: -len("</shape>")] + placing + "</shape>")
    inverse = np.linalg.inv(matrix_of(True)) if placing == MIRRORED else np.eye(4)

    def inside(p: np.ndarray) -> Mask:
        return local(p @ inverse[:3, :3].T + inverse[:3, 3])

    origins, directions = rays(1500)
    expected, normals = changes(inside, origins, directions, 2), normals_at(inside, origins, directions, 2)
    found = crossings(renderer.mi, scene, origins, directions, 2)
    for k, crossing in enumerate(found):
        hit = np.isfinite(expected[k])
        assert hit.sum() > 75
        # Rays close to an edge or a silhouette may differ: the inequalities are evaluated in steps, hits in single precision.
        assert (hit != crossing["valid"]).mean() < 8e-3
        both = hit & crossing["valid"]
        same = both & (np.abs(expected[k] - crossing["t"]) < 2e-4)
        assert same.sum() > 0.99 * both.sum()
        outward = (1.0 if k == 0 else -1.0) * (-1.0 if placing == FLIP else 1.0)
        error = np.linalg.norm(outward * crossing["n"] - normals[k], axis=1)[same]
        assert (error < 2e-3).mean() > 0.985


def test_each_surface_has_its_own_bsdf_or_that_of_the_nearest_csg(load: Load, renderer: ref.Renderer) -> None:
    def paint(*rgb: float) -> str:
        return f'<bsdf type="diffuse"><rgb name="reflectance" value="{", ".join(map(str, rgb))}"/></bsdf>'

    red, green = (0.8, 0.1, 0.1), (0.1, 0.8, 0.1)
    inner = csg_xml("union", paint(*green), sphere_xml(-1.0, 0.0, 0.0, 0.3), sphere_xml(0.0, 0.0, 0.0, 0.3, paint(*red)))
    scene = load(csg_xml("union", inner, sphere_xml(1.0, 0.0, 0.0, 0.3)) + csg_xml("union", paint(*red), inner))
    origins = np.array([[-1.0, 0.0, 5.0], [0.0, 0.0, 5.0], [1.0, 0.0, 5.0]])
    found = crossings(renderer.mi, scene, origins, np.tile([0.0, 0.0, -1.0], (3, 1)), 1)[0]
    assert found["valid"].all()
    assert np.allclose(found["colour"], [green, red, (0.5, 0.5, 0.5)])


LIT = """<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.6, 0.3"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><translate x="-2"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.8, 0.7"/></bsdf></shape>
<shape type="sphere"><point name="center" value="0.5, -0.5, 2"/><float name="radius" value="0.2"/>
  <emitter type="area"><rgb name="radiance" value="3, 4, 5"/></emitter></shape>
"""
POINT = '<emitter type="point"><point name="position" value="1, 2, 3"/><rgb name="intensity" value="9, 8, 7"/></emitter>'
# The surfaces of an empty solid, in front of the wall and of the lights: all of them are masked.
PANE = '<shape type="plane"><transform name="to_world"><translate z="0.5"/></transform></shape>'
EMPTY = csg_xml("intersection", sphere_xml(0.0, 0.0, 1.2, 1.0), sphere_xml(0.0, 0.0, 9.0, 1.0), PANE)


@pytest.mark.parametrize("depth", [1, 2, 3, 4])
@pytest.mark.parametrize("hide", ["true", "false"])
def test_masked_surfaces_change_nothing(load: Load, renderer: ref.Renderer, depth: int, hide: str) -> None:
    """volpath does not count null interactions as depth, evaluates lights through them, and otherwise agrees with path."""
    end = 'value="3"/></integrator>'
    assert end in HEAD
    head = HEAD.replace(end, f'value="{depth}"/><boolean name="hide_emitters" value="{hide}"/></integrator>')
    images = []
    for seed, body in enumerate((LIT + POINT, LIT + POINT + EMPTY)):
        scene = load(body, head)
        batches = [np.array(renderer.mi.render(scene, spp=256, seed=8 * seed + k))[..., :3] for k in range(8)]
        images.append(np.array(batches).mean(axis=(1, 2)))
    a, b = (batches.mean(axis=0) for batches in images)
    error = np.sqrt(sum(batches.var(axis=0, ddof=1) for batches in images) / 8)
    assert (np.abs(a - b) <= 5.0 * error + 1e-6 * a).all()
    assert (error <= 5e-3 * a).all()
    assert (a > 0.0).all() == (depth > 1 or hide == "false")


def test_direct_sees_direct_light_through_masks(load: Load, renderer: ref.Renderer) -> None:
    """The scene has no point light, because Mitsuba's direct adds one once for each of its emitter_samples."""
    old, new = '"path"><integer name="max_depth" value="3"/>', '"direct"><integer name="emitter_samples" value="2"/>'
    assert old in HEAD
    direct = HEAD.replace(old, new)
    plain, masked = (np.array(renderer.mi.render(load(body, direct), spp=2048)) for body in (LIT, LIT + EMPTY))
    deeper = np.array(renderer.mi.render(load(LIT), spp=2048))
    assert np.median(masked / plain) == pytest.approx(1.0, abs=4e-3)
    assert np.percentile(masked / plain, 95) < 1.02 < np.percentile(deeper / plain, 95)


GLASS = '<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>'


def test_a_masked_surface_inside_glass_changes_nothing(load: Load, renderer: ref.Renderer) -> None:
    """A glass ball, and the union of the same ball with a smaller one inside it."""
    head = HEAD.replace('value="3"/></integrator>', 'value="8"/></integrator>')
    plain = sphere_xml(0.0, 0.0, 1.2, 0.9, GLASS)
    joined = csg_xml("union", GLASS, sphere_xml(0.0, 0.0, 1.2, 0.9), sphere_xml(0.1, 0.0, 1.2, 0.5))
    images = []
    for seed, body in enumerate((LIT + plain, LIT + joined)):
        scene = load(body, head)
        batches = [np.array(renderer.mi.render(scene, spp=512, seed=8 * seed + k))[..., :3] for k in range(8)]
        images.append(np.array(batches).mean(axis=(1, 2)))
    a, b = (batches.mean(axis=0) for batches in images)
    error = np.sqrt(sum(batches.var(axis=0, ddof=1) for batches in images) / 8)
    assert (np.abs(a - b) <= 5.0 * error).all()
    assert (error <= 1e-2 * a).all()


TUBE = '<shape type="cylinder"><point name="p0" value="-2, 0, 0"/><point name="p1" value="2, 0, 0.5"/></shape>'
TUBE = TUBE.replace("/></shape>", '/><float name="radius" value="0.3"/></shape>')
LENS = [sphere_xml(x, 0.0, 0.0, 1.0) for x in (-0.5, 0.5)]


@pytest.mark.parametrize(
    "solid",
    [
        csg_xml("intersection", GLASS.replace("dielectric", "schlick"), *LENS),
        csg_xml("difference", GLASS, '<shape type="ellipsoid"><vector name="radii" value="1, 0.6, 0.8"/></shape>', TUBE),
        csg_xml("intersection", GLASS, '<shape type="hyperboloid"><float name="radius" value="0.5"/></shape>', LENS[0]),
    ],
    ids=["lens", "drilled ellipsoid", "cut hyperboloid"],
)
def test_glass_is_invisible_in_a_constant_environment(load: Load, renderer: ref.Renderer, solid: str) -> None:
    """It would be visible if a surface were missing, doubled, or turned inside out."""
    head = HEAD.replace('value="3"/></integrator>', 'value="100"/><integer name="rr_depth" value="200"/></integrator>')
    image = np.array(renderer.mi.render(load('<emitter type="constant"/>' + solid, head), spp=256))
    assert np.abs(image.mean() - 1.0) < 5e-4
    assert np.median(np.abs(image - 1.0)) < 1e-5


# --- normals --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "body",
    [
        sphere_xml(0.0, 0.0, 0.0, 1.0, '<bsdf type="normals"/>'),
        f'<shape type="sphere"><transform name="to_world"><scale z="0.9999"/></transform><bsdf type="normals"/>{FLIP}</shape>',
        csg_xml("intersection", '<bsdf type="normals"/>', sphere_xml(0.0, 0.0, 0.0, 1.0), sphere_xml(0.0, 0.0, 0.4, 1.5)),
        '<bsdf type="normals" id="n"/>' + sphere_xml(0.0, 0.0, 0.0, 1.0, '<ref id="n"/>'),
    ],
    ids=["native", "mesh, flipped", "csg", "by reference"],
)
def test_normals_are_shown_as_colour(load: Load, renderer: ref.Renderer, body: str) -> None:
    image = np.array(renderer.mi.render(load(body), spp=256))
    rows, columns = np.mgrid[0:16, 0:16]
    slope = math.tan(math.radians(20.0)) / 8.0
    directions = np.stack([(columns - 7.5) * slope, (7.5 - rows) * slope, np.full((16, 16), -1.0)], axis=-1).reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = np.tile([0.0, 0.0, 4.0], (256, 1))
    t, normals = closed_form(SPHERE, everywhere, np.eye(4), origins, directions)
    steep = np.isfinite(t) & (np.einsum("ni,ni->n", normals, directions) < -0.5)
    expected = 0.5 + (-0.5 if FLIP in body else 0.5) * normals
    assert steep.sum() > 50
    assert np.abs(image.reshape(-1, 3) - expected)[steep].max() < 0.02


def test_normals_are_shown_on_both_sides_and_light_other_surfaces(load: Load, renderer: ref.Renderer) -> None:
    """A rectangle seen from behind, and a white floor in front of it without any other light."""
    away = '<transform name="to_world"><rotate y="1" angle="180"/><translate z="-1"/></transform>'
    floor = """<shape type="rectangle"><bsdf type="diffuse"><rgb name="reflectance" value="1, 0.9, 0.8"/></bsdf>
      <transform name="to_world"><rotate x="1" angle="-90"/><translate y="-1" z="0.5"/></transform></shape>"""
    image = np.array(renderer.mi.render(load(f'<shape type="rectangle">{away}<bsdf type="normals"/></shape>' + floor), spp=256))
    assert np.allclose(image[7:9, 7:9], [0.5, 0.5, 0.0], atol=1e-5)
    bottom = image[15, 7:9].mean(axis=0)
    assert (bottom[:2] > 0.02).all() and bottom[2] == 0.0
    assert bottom[1] / bottom[0] == pytest.approx(0.9, rel=1e-3)


# --- photon mapping -------------------------------------------------------------------------------------------------------

PHOTONS = '''<integrator type="photonmapper"><integer name="max_depth" value="3"/><integer name="global_photons" value="9"/>
<string name="direct" value="map"/></integrator>'''
PATH = HEAD.splitlines()[1]
BY_PTRACER = '<default name="photons_by" value="ptracer"/>'
BALL_BY_POINT = POINT + sphere_xml(*A, '<bsdf type="diffuse"/>')


@pytest.mark.parametrize(
    ("before", "params", "plugin"),
    [
        ("", {}, "path"),
        ("", {"photons_by": "ptracer"}, "ptracer"),
        (BY_PTRACER, {}, "ptracer"),
        (BY_PTRACER, {"photons_by": "path"}, "path"),
    ],
)
def test_photon_mapping_becomes_an_integrator_with_the_same_path_limits(
    load: Load, renderer: ref.Renderer, before: str, params: dict[str, str], plugin: str
) -> None:
    ours = load(BALL_BY_POINT, HEAD.replace(PATH, before + PHOTONS), **params)
    theirs = load(BALL_BY_POINT, HEAD.replace(PATH, PATH.replace('"path"', f'"{plugin}"')))
    same, other = (load(BALL_BY_POINT, HEAD.replace('"path"', f'"{name}"')) for name in ("path", "ptracer"))
    assert str(ours.integrator()) == str(theirs.integrator())
    assert str(same.integrator()) != str(other.integrator())


def test_provenance_names_the_stand_in_for_photons(renderer: ref.Renderer, tiny: Path) -> None:
    path = '"path"><integer name="max_depth" value="3"/></integrator>'
    assert path in tiny.read_text()
    tiny.write_text(tiny.read_text().replace(path, path.replace("path", "photonmapper")))
    assert ref.load_with_stand_ins(renderer, tiny)[1] == ["photonmapper: path"]
    found = ref.load_with_stand_ins(renderer, tiny, {"photons_by": "ptracer"})[1]
    assert found == ["photonmapper: ptracer, which shows mirrors and glass black"]


def test_the_path_tracer_for_photons_supports_masks(load: Load, renderer: ref.Renderer) -> None:
    scene = load(csg_xml("union", sphere_xml(*A)), HEAD.replace(PATH, PHOTONS))
    assert isinstance(scene.integrator(), type(renderer.mi.load_dict({"type": "volpath"})))


# --- scenes ---------------------------------------------------------------------------------------------------------------


def test_parameters_includes_and_references_still_work(load: Load, renderer: ref.Renderer, tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(
        '<scene version="3.0.0"><shape type="ellipsoid"><vector name="radii" value="$size"/>'
        '<point name="center" value="0, 0, -3"/><ref id="paint"/></shape></scene>'
    )
    body = """<default name="size" value="0.5, 0.6, 0.7"/><default name="level" value="0.3"/><include filename="part.xml"/>
    <bsdf type="diffuse" id="paint"><rgb name="reflectance" value="$level, 0.2, 0.1"/></bsdf>"""
    down = np.array([[0.0, 0.0, 5.0]]), np.array([[0.0, 0.0, -1.0]])
    for params, t, red in (({}, 7.3, 0.3), ({"size": "0.5, 0.6, 1.5", "level": "0.9"}, 6.5, 0.9)):
        found = crossings(renderer.mi, load(body, **params), *down, 1)[0]
        assert found["t"][0] == pytest.approx(t, rel=1e-6)
        assert np.allclose(found["colour"][0], [red, 0.2, 0.1])


def test_a_scene_of_version_0_6_is_upgraded_first(load: Load, renderer: ref.Renderer) -> None:
    head = HEAD.replace('version="3.0.0"', 'version="0.6.0"').replace("max_depth", "maxDepth").replace("to_world", "toWorld")
    body = '<shape type="sphere"><transform name="toWorld"><scale z="2"/></transform></shape>'
    found = crossings(renderer.mi, load(body, head), np.array([[0.0, 0.0, 5.0]]), np.array([[0.0, 0.0, -1.0]]), 1)[0]
    assert found["t"][0] == pytest.approx(3.0, rel=1e-6)


def test_provenance_names_the_stand_ins(renderer: ref.Renderer, tiny: Path, tmp_path: Path) -> None:
    def recorded() -> dict[str, Any]:
        ref.make_reference(renderer, tiny, tmp_path / "out", "command", samples=4, batches=2)
        return tomllib.loads((tmp_path / "out" / "PROVENANCE.toml").read_text())

    assert "stand_ins" not in recorded()
    extra = '<shape type="plane"/><shape type="ellipsoid"><vector name="radii" value="1, 2, 3"/><bsdf type="metal"/></shape>'
    extra += '<shape type="cone"/>' + csg_xml("union", sphere_xml(*A)) + sphere_xml(*B, '<bsdf type="normals"/>')
    tiny.write_text(tiny.read_text().replace("</scene>", extra + "</scene>"))
    assert recorded()["stand_ins"] == [
        "metal: Python BSDF",
        "plane: square of half-size 1000",
        "ellipsoid: instance of a sphere",
        "cone: mesh of 392192 triangles",
        "csg: surfaces of its operands, masked where they do not bound it",
        "normals: Python emitter on a black surface",
        "path: volpath, which sees through masks",
    ]


def test_the_scalar_variant_renders_the_same(renderer: ref.Renderer, tmp_path: Path) -> None:
    """The scene uses everything that is written in Python: in the scalar variant, each call takes numbers instead of arrays."""
    shapes = """<shape type="ellipsoid"><vector name="radii" value="0.3, 0.4, 0.5"/><point name="center" value="-1, 0, 1"/>
      <bsdf type="phong"/></shape>
      <shape type="sphere"><point name="center" value="-0.5, 0.8, 1"/><float name="radius" value="0.3"/>
      <bsdf type="metal"><float name="roughness" value="0.4"/></bsdf></shape>"""
    shapes += csg_xml(
        "difference",
        '<bsdf type="schlick"/>',
        sphere_xml(0.3, 0.0, 1.0, 0.5),
        sphere_xml(0.3, 0.0, 1.5, 0.4, '<bsdf type="normals"/>'),
        PANE,
    )
    path = tmp_path / "scene.xml"
    path.write_text(HEAD + LIT + POINT + shapes + "</scene>")
    program = (
        "import sys; import numpy as np; from pathlib import Path; import mitsuba_reference as ref\n"
        "ref.find_llvm = lambda: None\n"
        "images = ref.render_batches(ref.start_mitsuba(), Path(sys.argv[1]), 48, 4).images\n"
        "np.save(sys.argv[2], images)"
    )
    command = [sys.executable, "-c", program, str(path), str(tmp_path / "scalar.npy")]
    subprocess.run(command, check=True, cwd=ref.ROOT / "scripts", env={"PATH": "/usr/bin:/bin"}, capture_output=True)
    images = [ref.render_batches(renderer, path, 256, 4).images, np.load(tmp_path / "scalar.npy")]
    # Values are clamped, so that the lamp does not dominate the mean.
    means = [np.minimum(batches, 1.0).mean(axis=(1, 2)) for batches in images]
    error = np.sqrt(sum(m.var(axis=0, ddof=1) for m in means) / 4)
    assert (np.abs(means[0].mean(axis=0) - means[1].mean(axis=0)) <= 6.0 * error + 5e-3 * means[0].mean(axis=0)).all()
    assert (error <= 1e-2 * means[0].mean(axis=0)).all()


ABSORPTION = np.array([0.1, 0.5, 1.5])


def absorbing(kind: str) -> str:
    numbers = '<float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>'
    return f'<bsdf type="{kind}">{numbers}<rgb name="absorption" value="0.1, 0.5, 1.5"/></bsdf>'


@pytest.mark.parametrize("kind", ["dielectric", "schlick"])
@pytest.mark.parametrize(
    ("shape", "distance"),
    [
        ('<shape type="sphere">', 2.0),
        ('<shape type="cube"><transform name="to_world"><scale z="0.3"/></transform>', 0.6),
        ('<shape type="ellipsoid"><vector name="radii" value="1, 2, 0.5"/>', 1.0),
    ],
)
def test_glass_absorbs_by_the_law_of_beer_and_lambert(
    renderer: ref.Renderer, tmp_path: Path, kind: str, shape: str, distance: float
) -> None:
    """At normal incidence in a white environment: R + (1 - R)^2 a / (1 - R a), a = exp(-absorption distance)."""
    path = tmp_path / "scene.xml"
    head = HEAD.replace('name="fov" value="40"', 'name="fov" value="0.01"').replace('value="3"', 'value="20"')
    path.write_text(head + f'<emitter type="constant"/>{shape}{absorbing(kind)}</shape></scene>')
    means = ref.render_batches(renderer, path, 2048, 8).images.astype(np.float64).mean(axis=(1, 2))
    left = np.exp(-ABSORPTION * distance)
    expected = 0.04 + 0.96**2 * left / (1.0 - 0.04 * left)
    error = means.std(axis=0, ddof=1) / math.sqrt(len(means))
    assert (np.abs(means.mean(axis=0) - expected) <= 5.0 * error).all()
    assert (error <= 4e-3 * expected).all()


def test_glass_without_absorption_and_open_glass_keep_their_integrator(renderer: ref.Renderer, tmp_path: Path) -> None:
    glass = absorbing("dielectric").replace("0.1, 0.5, 1.5", "0, 0, 0")
    mesh = f'<string name="filename" value="{ref.ROOT}/assets/meshes/lamp.ply"/><boolean name="allow_open" value="true"/>'
    path = tmp_path / "scene.xml"
    path.write_text(HEAD + f'<shape type="ply">{mesh}{glass}</shape></scene>')
    assert ref.load_with_stand_ins(renderer, path)[1] == ["allow_open: nothing"]


OURS = {"plane", "triangle", "kcply", "ellipsoid", "cone", "paraboloid", "hyperboloid", "quadric", "csg"}
OURS |= {"phong", "metal", "schlick", "normals", "photonmapper"}
OUR_PARAMETERS = {"absorption", "allow_open"}


def uses_ours(scene: Path) -> bool:
    found = [element.attributes for element in ref.scene_elements(scene)]
    return any(attributes.get("type") in OURS or attributes.get("name") in OUR_PARAMETERS for attributes in found)


@pytest.mark.parametrize("scene", [s for s in ref.all_scenes() if not uses_ours(s)], ids=lambda scene: scene.stem)
def test_scenes_without_our_plugins_are_unchanged(renderer: ref.Renderer, scene: Path) -> None:
    """Inserting stand-ins, and upgrading twice, changes no node that Mitsuba instantiates."""
    mi = renderer.mi
    texts = []
    for ours in (False, True):
        config = mi.parser.ParserConfig(renderer.variant)
        state = mi.parser.parse_file(config, str(scene))
        if ours:
            mi.parser.transform_upgrade(config, state)
            mi.parser.transform_resolve(config, state)
            assert stand_ins.put_in(mi, state, scene.parent, Path("/nowhere")) == []
        mi.parser.transform_all(config, state)
        texts.append(mi.parser.write_string(state))
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ('<shape type="plane"><emitter type="area"/></shape>', "plane: no stand-in for an infinite area light"),
        ('<shape type="ellipsoid"><vector name="radii" value="1, 0, 1"/></shape>', "a radius is not positive"),
        ('<shape type="ellipsoid"><float name="radus" value="2"/></shape>', "radus"),
        ('<shape type="cone"><float name="radus" value="2"/></shape>', "radus"),
        ('<shape type="cone"><float name="height" value="-1"/></shape>', "a length is not positive"),
        ('<shape type="hyperboloid"><integer name="sheets" value="3"/></shape>', "1 or 2 sheets"),
        ('<shape type="hyperboloid"><float name="axis" value="2"/><integer name="sheets" value="2"/></shape>', "neither of"),
        ('<shape type="triangle"><point name="p0" value="1"/></shape>', "needs p0, p1 and p2"),
        (f'<shape type="quadric"><string name="coefficients" value="1, 2"/>{BOX}</shape>', "ten coefficients"),
        (f'<shape type="quadric"><string name="coefficients" value="1, z"/>{BOX}</shape>', "quadric: could not convert"),
        ('<shape type="cone"><transform name="to_world"><scale x="0"/></transform></shape>', "cone: Singular matrix"),
        (csg_xml("union", '<shape type="cube"><transform name="to_world"><scale x="0"/></transform></shape>'), "cube: Singular"),
        (f'<shape type="quadric">{quadric_xml([1, 1, 1, 0, 0, 0, 0, 0, 0, 1])}</shape>', "no surface in its box"),
        ('<shape type="kcply"/>', "needs a filename"),
        (csg_xml("xor", sphere_xml(*A)), "unknown operation 'xor'"),
        (csg_xml("union"), "csg: may contain only shapes"),
        (csg_xml("union", sphere_xml(*A), '<float name="radius" value="1"/>'), "csg: may contain only shapes"),
        (csg_xml("union", '<shape type="disk"/>'), "disk: no stand-in for it as an operand"),
        (csg_xml("union", sphere_xml(*A, '<emitter type="area"/>')), "an operand with an emitter"),
        (csg_xml("union", sphere_xml(*A)) + '<integrator type="depth"/>', "depth: does not support the masks and media"),
        ('<shape type="sphere"><bsdf type="twosided"><bsdf type="normals"/></bsdf></shape>', "normals inside another bsdf"),
        (
            '<shape type="sphere"><bsdf type="normals"/></shape>'
            '<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>',
            "hide_emitters",
        ),
        ('<shape type="sphere"><bsdf type="phong"><rgb name="ambient" value="0.1"/></bsdf></shape>', "ambient"),
        (csg_xml("union", absorbing("dielectric"), sphere_xml(*A)), "csg: no stand-in for absorbing glass in"),
        (csg_xml("union", sphere_xml(*A, absorbing("schlick")), sphere_xml(*B)), "sphere: no stand-in for absorbing"),
        (
            f'<shape type="sphere"><bsdf type="blendbsdf"><bsdf type="diffuse"/>{absorbing("dielectric")}</bsdf></shape>',
            "blendbsdf: no stand-in for absorbing glass inside another bsdf",
        ),
        (f'<shape type="sphere">{absorbing("dielectric")}</shape><integrator type="depth"/>', "depth: does not support"),
        ('<default name="photons_by" value="bdpt"/><integrator type="photonmapper"/>', "unknown stand-in 'bdpt'; known: path"),
        ('<shape type="sphere"><bsdf type="normals"/></shape><integrator type="ptracer"/>', "ptracer: does not trace light"),
    ],
)
def test_faults_and_missing_stand_ins_are_one_line(renderer: ref.Renderer, tmp_path: Path, body: str, message: str) -> None:
    path = tmp_path / "scene.xml"
    head = HEAD.replace(HEAD.splitlines()[1], "") if "<integrator" in body else HEAD
    path.write_text(head + body + "</scene>")
    with pytest.raises(ref.UserError, match=message) as caught:
        ref.render_batches(renderer, path, 1, 2)
    assert "\n" not in str(caught.value)
    assert "scene.xml" in str(caught.value)
