"""The stand-ins in whole scenes: parameters, provenance, the scalar variant, scenes that need none, and errors."""

import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mitsuba_reference as ref
import stand_ins
from stand_in_scenes import BOX, HEAD, LIT, PANE, POINT, A, B, Load, absorbing, crossings, csg_xml, quadric_xml, sphere_xml


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
    """The scene uses all plugins that are written in Python: in the scalar variant, each call takes numbers instead of arrays."""
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
        (csg_xml("union", '<shape type="disk"/>'), "disk: has no stand-in as an operand"),
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
