"""The generated meshes and textures."""

import math
from collections import Counter

import numpy as np
import pytest

import ground
import make_assets
import mitsuba_reference as ref
import snifter
from make_assets import Mesh

ASSETS = ref.ROOT / "assets"
LARGEST = 650_000
GENERATED = make_assets.assets()


def on_disk() -> set[str]:
    return {path.relative_to(ASSETS).as_posix() for kind in ("meshes", "textures") for path in (ASSETS / kind).iterdir()}


def test_every_asset_is_generated_and_nothing_else_is_there() -> None:
    assert on_disk() == set(GENERATED)


@pytest.mark.parametrize("name", sorted(GENERATED))
def test_each_asset_is_reproduced_byte_for_byte(name: str) -> None:
    content = GENERATED[name]
    assert (ASSETS / name).read_bytes() == content
    assert len(content) < LARGEST


def test_readme_lists_every_asset() -> None:
    readme = (ASSETS / "README.md").read_text()
    assert all(f"`{name}`" in readme for name in GENERATED)


def volume(mesh: Mesh) -> float:
    """The signed volume, which is positive if the faces are counter-clockwise from outside."""
    corners = np.array(mesh.positions)[np.array(mesh.faces)]
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0


def welded(*meshes: Mesh) -> Mesh:
    """Join meshes and weld vertices at the same position."""
    index: dict[tuple[float, ...], int] = {}
    faces = [tuple(index.setdefault(mesh.positions[k], len(index)) for k in face) for mesh in meshes for face in mesh.faces]
    return Mesh(list(index), faces)


def reversed_faces(mesh: Mesh) -> Mesh:
    """The mesh with all faces reversed."""
    return Mesh(mesh.positions, [face[::-1] for face in mesh.faces])


def is_closed(mesh: Mesh) -> bool:
    """Whether each edge belongs to two triangles, which run along it in opposite directions."""
    edges = Counter((f[k], f[(k + 1) % 3]) for f in mesh.faces for k in range(3))
    return set(edges.values()) == {1} and all((b, a) in edges for a, b in edges)


GLASS, WALL, SURFACE = snifter.snifter(), snifter.cognac_wall(), snifter.cognac_surface()


@pytest.mark.parametrize(
    "mesh",
    [make_assets.pebble(), make_assets.gem(), welded(WALL, SURFACE)],
    ids=["pebble", "gem", "cognac"],
)
def test_meshes_of_glass_are_closed(mesh: Mesh) -> None:
    assert is_closed(mesh)
    assert volume(mesh) > 0.5


def test_the_cognac_has_the_volume_of_its_part_of_the_ellipsoid() -> None:
    """The closed form of the volume between two heights, times the area of a polygon relative to its circle.

    For n sides the ratio is sin(2 pi / n) / (2 pi / n).
    """
    high = math.sin(snifter.LEVEL)
    exact = math.pi * snifter.ACROSS**2 * snifter.UPRIGHT * ((high - high**3 / 3.0) + 2.0 / 3.0)
    step = 2.0 * math.pi / snifter.SECTORS
    assert volume(welded(WALL, SURFACE)) == pytest.approx(exact * math.sin(step) / step, rel=2e-3)


def test_glass_and_cognac_touch_without_a_gap() -> None:
    whole = welded(GLASS, reversed_faces(WALL))
    assert is_closed(whole)
    assert volume(whole) > 0.1
    assert min(z for _, _, z in GLASS.positions) == 0.0


def test_the_ground_is_fractal() -> None:
    """Height differences grow with a power of the distance: above 0.5, and below 0.85 because the number of octaves is finite."""
    rng = np.random.default_rng(4)
    places = rng.uniform(-40.0, 40.0, (4000, 2))
    spreads = []
    for distance in (0.15, 0.6):
        away = [ground.fractal(1, x + distance, y) - ground.fractal(1, x, y) for x, y in places]
        spreads.append(float(np.std(away)))
    assert 0.5 < math.log(spreads[1] / spreads[0]) / math.log(4.0) < 0.85


def test_the_highest_point_near_the_origin_is_at_zero() -> None:
    mesh = ground.ground(2026, 40)
    assert max(z for x, y, z in mesh.positions if math.hypot(x, y) <= ground.STAND) == 0.0


def test_the_normals_of_the_ground_are_close_to_those_of_its_faces() -> None:
    """A few normals deviate more, where triangles are large and the ground is rough."""
    mesh = ground.ground(2026, 110)
    corners, normals = (np.array(values)[np.array(mesh.faces)] for values in (mesh.positions, mesh.normals))
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets /= np.linalg.norm(facets, axis=1, keepdims=True)
    cosines = np.einsum("ij,ikj->ik", facets, normals)
    assert (facets[:, 2] > 0.0).all()
    assert cosines.min() > 0.6
    assert np.quantile(cosines, 0.01) > 0.85


@pytest.mark.parametrize(
    "mesh",
    [make_assets.pebble(), make_assets.bumpy_torus(), GLASS, WALL, SURFACE],
    ids=["pebble", "torus", "snifter", "cognac-wall", "cognac-surface"],
)
def test_normals_are_unit_and_agree_with_the_faces(mesh: Mesh) -> None:
    assert all(abs(math.hypot(*n) - 1.0) < 2e-7 for n in mesh.normals)
    for a, b, c in mesh.faces:
        p, q, r = (np.array(mesh.positions[k]) for k in (a, b, c))
        facet = np.cross(q - p, r - p)
        for k in (a, b, c):
            assert facet @ np.array(mesh.normals[k]) > 0.9 * np.linalg.norm(facet)


def test_pebble_normals_are_those_of_its_surface() -> None:
    """Compare them with a central difference of the implicit function |p| - r(p / |p|)."""

    def implicit(p: np.ndarray) -> float:
        length = float(np.linalg.norm(p))
        x, y, z = p / length
        return length - (1.0 + x * y / 4.0 - z * z / 5.0 + x * x * z / 6.0)

    mesh = make_assets.pebble()
    for position, normal in list(zip(mesh.positions, mesh.normals, strict=True))[::97]:
        p = np.array(position)
        gradient = np.array([implicit(p + 1e-5 * e) - implicit(p - 1e-5 * e) for e in np.eye(3)])
        assert np.allclose(gradient / np.linalg.norm(gradient), normal, atol=1e-8)


@pytest.mark.parametrize(("mesh", "up"), [(make_assets.terrain(), 1.0), (make_assets.lamp(), -1.0)], ids=["terrain", "lamp"])
def test_the_faces_of_open_meshes_point_to_one_side(mesh: Mesh, up: float) -> None:
    corners = np.array(mesh.positions)[np.array(mesh.faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (up * normals[:, 1] > 0).all()


@pytest.mark.parametrize(("name", "size"), [("mosaic", (48, 32)), ("stripes", (16, 20)), ("weave", (24, 40))])
def test_mitsuba_reads_the_textures(renderer: ref.Renderer, name: str, size: tuple[int, int]) -> None:
    bitmap = renderer.mi.Bitmap(str(ASSETS / "textures" / f"{name}.png"))
    assert tuple(bitmap.size()) == size
    pixels = np.array(bitmap)
    for flipped in (pixels[::-1], pixels[:, ::-1], pixels[::-1, ::-1]):
        assert not np.array_equal(pixels, flipped)
