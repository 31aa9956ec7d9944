"""Mitsuba's runs of a study: they use the same scene, appear in the same rows, and their times cover the render alone."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import convergence
import etendue
import mitsuba_reference as ref
import mitsuba_run
from helpers import check_bad_input, run_script
from mitsuba_run import Run


def test_mitsuba_appears_in_the_same_rows(tiny_study: Callable[..., Path], tmp_path: Path, renderer: ref.Renderer) -> None:
    study, out = tiny_study(("ours", "etendue", [16]), ("theirs", "mitsuba", [16])), tmp_path / "out"
    etendue.run_study(study, out=out)
    planned = {run["output"]: run for run in etendue.plan(study, out=out)}
    start = time.perf_counter()
    found = run_script("convergence.py", study, "--out", out)
    elapsed = time.perf_counter() - start
    assert found.returncode == 0, found.stderr
    assert found.stdout.count(" core-s\n") == len(planned) == 2 and etendue.plan(study, out=out) == []
    ours = etendue.read_image(next(out.glob("runs/tiny.ours.16/*.exr"))).attributes
    for image, plan in planned.items():
        theirs = etendue.read_image(image).attributes
        for name in ("scene_sha256", "integrator", "sampler", "parameters", "spp"):
            assert theirs[f"etendue.{name}"] == ours[f"etendue.{name}"], name
        assert theirs["etendue.seed"] == str(plan["seed"])
        assert theirs["etendue.renderer"] == f"mitsuba {renderer.mi.__version__} {renderer.variant}"
        # Times are rounded to milliseconds, so the time of a tiny image may be 0.
        assert 0.0 <= float(theirs["etendue.seconds"]) <= elapsed
        assert 0.0 <= float(theirs["etendue.warm_up_seconds"]) <= elapsed
        assert int(theirs["etendue.peak_bytes"]) > 0
    rows = etendue.read_rows(out)
    assert rows.groupby("renderer").size().to_dict() == {"etendue": 2, "mitsuba": 2}
    # Both renderers estimate the reference without bias: their mean errors over 16 x 24 x 3 values are noise.
    assert (rows["bias"].abs() < 5.0 * rows["rmse"] / np.sqrt(1152)).all()
    assert 0.5 < rows.groupby("renderer")["rmse"].mean()["mitsuba"] / rows.groupby("renderer")["rmse"].mean()["etendue"] < 2.0
    assert run_script("convergence.py", study, "--out", out).stdout.count(" core-s\n") == 0


def test_a_run_that_fails_is_reported_and_the_others_are_rendered(tiny_study: Callable[..., Path], tmp_path: Path) -> None:
    study, out = tiny_study(("good", "mitsuba", [2]), ("bad", "mitsuba", [2])), tmp_path / "out"
    before, bad = study.read_text().split('name = "bad"')
    study.write_text(before.replace("seeds = 2", "seeds = 1") + 'name = "bad"' + bad.replace('"path"', '"no-such"'))
    found = run_script("convergence.py", study, "--out", out, "--no-evaluate")
    assert found.returncode == 2 and found.stderr.count("\n") == 1
    assert found.stderr.startswith("convergence.py: tiny.bad.2 seed ") and 'Plugin "no-such" not found' in found.stderr
    assert [path.parent.name for path in out.glob("runs/*/*.exr")] == ["tiny.good.2"]


@pytest.mark.parametrize(
    ("script", "arguments", "message"),
    [
        ("convergence.py", ["no-such.toml"], "no-such.toml"),
        ("mitsuba_run.py", ["no-such.xml", "-o", "a.exr", "--spp", "1"], "no-such.xml: No such file"),
        ("mitsuba_run.py", ["a.xml", "-o", "a.exr", "--spp", "0"], "spp must be at least 1"),
        ("mitsuba_run.py", ["a.xml", "-o", "a.exr", "--spp", "1", "--seed", "4294967296"], "the seed within 0 .. 4294967295"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(script: str, arguments: list[str], message: str) -> None:
    found = run_script(script, *arguments)
    check_bad_input(script, found.returncode, found.stderr, message)


def test_an_incomplete_plan_is_an_error() -> None:
    with pytest.raises(etendue.UserError, match=r"a\.2: the plan lacks 'spp'"):
        convergence.command({"cell": "a.2", "scene": "a.xml", "output": "a.exr"}, None)


def test_a_crop_is_at_the_position_of_ours(tmp_path: Path) -> None:
    scene = ref.SCENES / "depth-crop.xml"
    found = run_script("mitsuba_run.py", scene, "-o", tmp_path / "theirs.exr", "--spp", "4", "--threads", "1")
    assert found.returncode == 0, found.stderr
    etendue.render(scene, tmp_path / "ours.exr", spp=4)
    theirs, ours = (etendue.read_image(tmp_path / f"{name}.exr") for name in ("theirs", "ours"))
    assert (theirs.crop, theirs.size, theirs.color.shape) == (ours.crop, ours.size, ours.color.shape)
    assert theirs.crop != (0, 0)


@pytest.mark.parametrize("name", ["params-and-includes", "glass-on-checker", "teapots", "figures/figure-10-cognac"])
def test_the_hash_of_a_scene_equals_ours(name: str, tmp_path: Path) -> None:
    """The scenes have included files, textures and meshes."""
    scene = ref.SCENES / f"{name}.xml"
    etendue.render(scene, tmp_path / "a.exr", integrator="depth", spp=1)
    assert etendue.read_image(tmp_path / "a.exr").attributes["etendue.scene_sha256"] == ref.scene_hash(scene)


def load(renderer: ref.Renderer, scene: Path, **changes: object) -> object:
    options = {"spp": 4, "seed": 1, "integrator": None, "sampler": "independent", "params": {}, "defines": {}, **changes}
    wanted = Run(scene, Path("a.exr"), **options)
    return ref.load_with_stand_ins(renderer, scene, None, lambda state: mitsuba_run.change_scene(renderer.mi, state, wanted))[0]


def test_an_integrator_is_replaced_and_path_limits_are_kept(tiny: Path, renderer: ref.Renderer) -> None:
    """The integrator of the scene is path with max_depth 3."""

    def image(**changes: object) -> np.ndarray:
        return np.array(renderer.mi.render(load(renderer, tiny, **changes), spp=4, seed=1))

    own = image()
    assert np.array_equal(own, image(integrator="path", params={"max_depth": "3"}))
    assert not np.array_equal(own, image(params={"max_depth": "1"}))
    assert "max_depth = 3" in str(load(renderer, tiny, integrator="volpath").integrator())
    assert "PathIntegrator" not in str(load(renderer, tiny, integrator="direct").integrator())


@pytest.mark.parametrize("text", ["true", "3", "0.5", "cone"])
def test_parameters_have_the_type_of_their_text(text: str) -> None:
    assert etendue.value_text(mitsuba_run.typed(text)) == text
    assert type(mitsuba_run.typed(text)).__name__ == {"true": "bool", "3": "int", "0.5": "float", "cone": "str"}[text]


@pytest.mark.parametrize(
    ("integrator", "spp", "renders"), [("path", 37, [5, 37]), ("path", 32, [4, 32]), ("ptracer", 37, [5, 37, 37])]
)
def test_the_time_is_that_of_a_warm_render(
    tiny: Path, renderer: ref.Renderer, monkeypatch: pytest.MonkeyPatch, integrator: str, spp: int, renders: list[int]
) -> None:
    """The kernels of light tracing depend on the number of samples, so Mitsuba renders once more."""
    counts: list[int] = []
    original = renderer.mi.render
    monkeypatch.setattr(renderer.mi, "render", lambda *a, **b: counts.append(b["spp"]) or original(*a, **b))
    measured = mitsuba_run.render(renderer, load(renderer, tiny, integrator=integrator), spp, 1, since=0.0)
    assert counts == ([spp] if renderer.variant.startswith("scalar") else renders)
    assert measured.pixels.shape == (16, 24, 3) and measured.seconds > 0.0


def test_a_sampler_that_changes_the_number_of_samples_is_refused(tiny: Path, tmp_path: Path) -> None:
    found = run_script("mitsuba_run.py", tiny, "-o", tmp_path / "a.exr", "--spp", "10", "--sampler", "stratified")
    assert found.returncode == 2 and "stratified takes 16 samples per pixel instead of 10" in found.stderr
    assert not (tmp_path / "a.exr").exists()
