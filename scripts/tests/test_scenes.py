"""The scenes of assets/scenes: each follows the rules for test scenes, and together they cover the scene language."""

import re
import subprocess
from collections.abc import Iterable
from pathlib import Path

import OpenEXR
import pytest

import etendue
import mitsuba_reference as ref
from mitsuba_reference import Element

SCENES = ref.all_scenes()
# Plugins that no scene has to use: `sppm` is chosen for scenes of other integrators, `mesh` exists in code alone, and
# tests compare each other name of a spectrum with its numbers.
IN_NO_SCENE = {"sppm", "mesh", "rawconstant", "uniform", "srgb", "d65", "blackbody", "regular", "irregular"}
AREA_SHAPES = "rectangle sphere disk cylinder cube ply ellipsoid"
LANGUAGE_TAGS = "default include ref alias lookat matrix translate rotate scale"
each_scene = pytest.mark.parametrize("scene", SCENES, ids=[path.stem for path in SCENES])


def elements(scene: Path) -> list[Element]:
    return list(ref.scene_elements(scene))


def everywhere() -> list[Element]:
    return [element for scene in SCENES for element in elements(scene)]


def values(found: Iterable[Element], tag: str, name: str) -> set[str]:
    """The values of all properties `<tag name="name" value="..."/>`."""
    return {e.attributes["value"] for e in found if e.tag == tag and e.attributes.get("name") == name}


def test_together_they_cover_every_plugin() -> None:
    used = {f"{e.tag} {e.attributes.get('type')}" for e in everywhere()}
    lines = subprocess.run([etendue.binary(), "plugins"], capture_output=True, text=True, check=True).stdout.splitlines()
    plugins = {line for line in lines if line and not line.startswith(" ")}
    wanted = {plugin for plugin in plugins if plugin.split()[1] not in IN_NO_SCENE}
    assert len(plugins) > 50
    assert wanted <= used, f"not covered: {sorted(wanted - used)}"


def test_area_lights_are_on_every_shape() -> None:
    lit, last = set(), ""
    for element in everywhere():
        if element.tag == "shape":
            last = element.attributes["type"]
        if element.tag == "emitter" and element.attributes["type"] == "area":
            lit.add(last)
    assert lit == set(AREA_SHAPES.split())


def test_together_they_cover_the_language() -> None:
    found = everywhere()
    assert set(LANGUAGE_TAGS.split()) <= {e.tag for e in found}
    assert {e.attributes["version"] for e in found if e.tag == "scene"} == {"3.0.0", "0.6.0"}
    sources = "".join(path.read_text() for path in ref.SCENES.rglob("*.xml"))
    assert re.search(r'="\$\w+"', sources)
    assert r"\$" in sources


@pytest.mark.parametrize(
    ("tag", "name", "wanted"),
    [
        ("string", "fov_axis", {"x", "y", "diagonal", "smaller", "larger"}),
        ("boolean", "face_normals", {"true", "false"}),
        ("boolean", "raw", {"true"}),
        ("boolean", "hide_emitters", {"true"}),
        ("boolean", "flip_normals", {"true"}),
        ("string", "material", {"Au", "none"}),
        ("string", "focal_length", {"50mm"}),
        ("integer", "max_depth", {"-1", "20"}),
        ("integer", "rr_depth", {"3", "5", "100"}),
    ],
)
def test_together_they_cover_the_variants(tag: str, name: str, wanted: set[str]) -> None:
    assert wanted <= values(everywhere(), tag, name)


def test_some_conductor_has_eta_and_k() -> None:
    assert values(everywhere(), "rgb", "eta")
    assert values(everywhere(), "rgb", "k")


def test_meshes_of_every_encoding_are_read() -> None:
    read = {(scene.parent / name).resolve() for scene in SCENES for name in ref.scene_files(scene)}
    meshes = {path for path in read if path.suffix == ".ply"}
    encodings = {path.read_bytes().split(b"\n", 2)[1].split()[1].decode() for path in meshes}
    assert encodings == {"ascii", "binary_little_endian", "binary_big_endian"}


def test_every_asset_is_read_by_some_scene() -> None:
    read = {(scene.parent / name).resolve() for scene in SCENES for name in ref.scene_files(scene)}
    assets = ref.ROOT / "assets"
    # The scenes of studies are in another folder.
    own = {path for path in assets.rglob("*.*") if assets / "studies" not in path.parents and path.name != "README.md"}
    assert own == read


@each_scene
def test_scene_starts_with_a_comment_on_what_it_exercises(scene: Path) -> None:
    text = scene.read_text()
    assert text.startswith("<!-- ")
    assert "Exercises:" in text.split("-->")[0]
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", scene.stem)


@each_scene
def test_scene_follows_the_rules(scene: Path) -> None:
    """Unequal channels, explicit indices of refraction, no <spectrum>, and a finite depth or early Russian roulette."""
    found = elements(scene)
    assert not [e for e in found if e.tag == "spectrum"]
    for element in found:
        if element.tag == "rgb":
            channels = [float(part) for part in re.split(r"[,\s]+", element.attributes["value"].strip())]
            assert len(set(channels)) == 3, element
            assert all(0.0 < channel < 30.0 for channel in channels), element
    indices = sum(e.attributes.get("name") in ("int_ior", "intIOR", "ext_ior", "extIOR") for e in found)
    assert indices == 2 * sum(e.tag == "bsdf" and e.attributes.get("type") in ("dielectric", "schlick") for e in found)
    depths = values(found, "integer", "max_depth") | values(found, "integer", "maxDepth")
    roulette = values(found, "integer", "rr_depth") | values(found, "integer", "rrDepth")
    if depths == {"-1"}:
        assert max(int(depth) for depth in roulette) <= 5
    assert all(int(depth) <= 20 for depth in depths)


def by_light_tracing(scene: Path) -> bool:
    """Whether Mitsuba traces light paths in this scene."""
    integrator = ref.integrator_name(scene)
    return integrator == "ptracer" or (integrator == "photonmapper" and ref.parameter(scene, ref.PHOTONS_BY) == "ptracer")


@each_scene
def test_delta_lights_are_not_combined_with_glass_or_mirrors(scene: Path) -> None:
    """A path tracer misses the caustics of point, spot and directional lights. Figure 7 shows this on purpose."""
    types = {(e.tag, e.attributes.get("type")) for e in elements(scene)}
    delta = {("emitter", light) for light in ("point", "spot", "directional")}
    if types & delta and scene.stem != "figure-7-shadows" and not by_light_tracing(scene):
        assert not types & {("bsdf", bsdf) for bsdf in ("dielectric", "schlick", "conductor")}


@each_scene
def test_light_tracing_avoids_the_faults_of_mitsuba(scene: Path) -> None:
    """Mitsuba's `ptracer` is too dark at the borders with any filter but box, and it ignores the principal point."""
    if by_light_tracing(scene):
        found = elements(scene)
        assert {e.attributes["type"] for e in found if e.tag == "rfilter"} == {"box"}
        assert not [e for e in found if e.attributes.get("name", "").startswith("principal_point")]


def test_photon_mapping_is_compared_with_both() -> None:
    scenes = [scene for scene in SCENES if ref.integrator_name(scene) == "photonmapper"]
    assert {by_light_tracing(scene) for scene in scenes} == {False, True}


@each_scene
def test_scene_loads_in_mitsuba(scene: Path, renderer: ref.Renderer) -> None:
    loaded, stand_ins = ref.load_with_stand_ins(renderer, scene)
    if not stand_ins:
        renderer.mi.load_file(str(scene))
    width, height = loaded.sensors()[0].film().crop_size()
    assert width % ref.TILE == 0 and height % ref.TILE == 0
    assert width * height <= 160 * 128


def test_some_film_is_not_square() -> None:
    assert any(values(elements(s), "integer", "width") != values(elements(s), "integer", "height") for s in SCENES)


@each_scene
def test_reference_belongs_to_the_scene(scene: Path) -> None:
    assert ref.stale_reasons(scene, ref.REFERENCES / scene.stem) == []


@each_scene
def test_wide_filters_blur_no_constant_background(scene: Path) -> None:
    """Next to a silhouette, samples in the tail of a filter are too rare for the standard error of one image."""
    boxes = [e for e in elements(scene) if e.tag == "rfilter" and e.attributes["type"] == "box"]
    with OpenEXR.File(str(ref.REFERENCES / scene.stem / "reference.exr"), separate_channels=True) as file:
        assert boxes or not file.channels()["deterministic"].pixels.any()
