"""The stand-ins for single shapes: intersections and uvs compared with closed forms, and files of meshes."""

from pathlib import Path

import numpy as np
import pytest

import mitsuba_reference as ref
import surfaces
from stand_in_scenes import (
    FLIP,
    MIRRORED,
    SADDLE,
    SPHERE,
    TO_WORLD,
    Load,
    between,
    boxed,
    closed_form,
    crossings,
    everywhere,
    matrix_of,
    quadric_xml,
    rays,
)

SQUARES = [1 / 0.36, 1 / 0.81, 1 / 1.21]
TILTED = [1, 1.4, 2, 0.3, -0.2, 0.1, 0.1, -0.2, 0.1, -0.3]
OPEN_BALL = [1, 1, 1, 0.2, 0, 0, 0, 0, 0, -1.2]

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
    # A few rays may differ, because they pass close to an edge or a silhouette.
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
