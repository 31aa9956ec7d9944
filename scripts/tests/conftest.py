"""Fixtures that several tests share: one Mitsuba for the whole run, a tiny scene, and a study of it."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import mitsuba_reference as ref
from helpers import write_program
from stand_in_scenes import HEAD, Load

# A shell ignores SIGINT in its background jobs, and their children inherit that. Tests interrupt scripts.
signal.signal(signal.SIGINT, signal.default_int_handler)

TINY = """<scene version="3.0.0">
  <default name="lit" value="0.8"/>
  <integrator type="path"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0.3, 1.2, 3" target="0, 0.2, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/><rfilter type="box"/></film>
    <sampler type="independent"/>
  </sensor>
  <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="$lit, 0.4, 0.2"/></bsdf></shape>
  <emitter type="constant"><rgb name="radiance" value="0.5, 0.4, 0.3"/></emitter>
</scene>
"""


@pytest.fixture(scope="session")
def renderer() -> ref.Renderer:
    return ref.start_mitsuba()


@pytest.fixture
def load(renderer: ref.Renderer, tmp_path: Path) -> Load:
    """Loads the body of a scene into Mitsuba; further arguments are parameters."""

    def loaded(body: str, head: str = HEAD, **params: str) -> Any:
        path = tmp_path / "scene.xml"
        path.write_text(head + body + "</scene>")
        return ref.load_scene(renderer, path, params)

    return loaded


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """A 24 x 16 scene: a diffuse sphere in a constant environment, which fills the corners of the image."""
    path = tmp_path / "tiny.xml"
    path.write_text(TINY)
    return path


STUDY = """title = "Tiny"
about = "A tiny study of a tiny scene."
seeds = 2
[[scene]]
file = "tiny.xml"
defines = { lit = 0.6 }
reference = { render = { integrator = "path", params = { max_depth = 2 }, spp = 2000 } }
"""
METHOD = """[[method]]
name = "%s"
renderer = "%s"
integrator = "path"
params = { max_depth = 2 }
vary = { name = "spp", values = %s }
"""


@pytest.fixture
def tiny_study(tiny: Path) -> Callable[..., Path]:
    """Writes a study of the tiny scene; each method is a name, a renderer and its sample counts."""

    def write(*methods: tuple[str, str, list[int]]) -> Path:
        path = tiny.with_name("study.toml")
        path.write_text(STUDY + "".join(METHOD % method for method in methods))
        return path

    return write


@pytest.fixture
def stub(tmp_path: Path) -> Path:
    """A stand-in for the etendue program: it logs its calls, renders an empty file, and compares with exit code $STUB_VERDICT."""
    text = """
echo "$@" >> "$(dirname "$0")/calls"
if [ "$1" = render ]; then [ "$3" = --replay ] || : > "$4"; exit; fi
[ "$1" = compare ] && [ -f "$2" ] && [ -f "$3/tiles.npy" ] && exit "$STUB_VERDICT"
exit 2
"""
    return write_program(tmp_path / "etendue-stub", text)
