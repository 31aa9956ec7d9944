"""The stand-ins for normals, absorption and photon mapping: colours, the law of Beer and Lambert, and integrators."""

import math
from pathlib import Path

import numpy as np
import pytest

import mitsuba_reference as ref
from stand_in_scenes import FLIP, HEAD, POINT, SPHERE, A, Load, absorbing, closed_form, csg_xml, everywhere, sphere_xml

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


# --- absorption -----------------------------------------------------------------------------------------------------------

ABSORPTION = np.array([0.1, 0.5, 1.5])


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
