"""The generated meshes and textures."""

import math
from collections import Counter

import numpy as np
import pytest

import make_assets
import mitsuba_reference as ref
from make_assets import Mesh

ASSETS = ref.ROOT / "assets"
LARGEST = 300_000
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
    """Signed volume; positive if the faces are counter-clockwise from outside."""
    corners = np.array(mesh.positions)[np.array(mesh.faces)]
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0


@pytest.mark.parametrize("mesh", [make_assets.pebble(), make_assets.gem()], ids=["pebble", "gem"])
def test_glass_can_be_made_of_a_closed_mesh(mesh: Mesh) -> None:
    edges = Counter((f[k], f[(k + 1) % 3]) for f in mesh.faces for k in range(3))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert volume(mesh) > 1.0


@pytest.mark.parametrize("mesh", [make_assets.pebble(), make_assets.bumpy_torus()], ids=["pebble", "torus"])
def test_normals_are_unit_and_agree_with_the_faces(mesh: Mesh) -> None:
    assert all(abs(math.hypot(*n) - 1.0) < 1e-12 for n in mesh.normals)
    for a, b, c in mesh.faces:
        p, q, r = (np.array(mesh.positions[k]) for k in (a, b, c))
        facet = np.cross(q - p, r - p)
        for k in (a, b, c):
            assert facet @ np.array(mesh.normals[k]) > 0.9 * np.linalg.norm(facet)


def test_pebble_normals_are_those_of_its_surface() -> None:
    """Against a central difference of the implicit function |p| - r(p / |p|)."""

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
def test_open_meshes_face_one_way(mesh: Mesh, up: float) -> None:
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
