"""The scripts from end to end, on a tiny scene."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import compare_live
import mitsuba_reference as ref
from helpers import SCRIPTS, check_bad_input, run_script


def run(script: str, *arguments: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a script to its end with these environment variables alone."""
    return run_script(script, *arguments, environment={"PATH": "/usr/bin:/bin", **environment})


def test_a_reference_is_the_reduction_of_its_batches(tiny: Path, tmp_path: Path, renderer: ref.Renderer) -> None:
    folder = tmp_path / "out"
    statistics = ref.make_reference(renderer, tiny, folder, "command", samples=4, batches=6)
    images = ref.render_batches(renderer, tiny, 4, 6).images
    expected = ref.reduce_batches(images)
    tiles = np.load(folder / "tiles.npy")
    assert (folder / "tiles.npy").read_bytes()[6:8] == b"\x01\x00"
    assert tiles.dtype == np.float32 and tiles.flags.c_contiguous
    assert np.array_equal(tiles, expected.tiles.astype(np.float32), equal_nan=True)
    with OpenEXR.File(str(folder / "reference.exr"), separate_channels=True) as file:
        planes = {name: channel.pixels for name, channel in file.channels().items()}
        assert file.header()["compression"] == OpenEXR.ZIP_COMPRESSION
    assert {name: plane.dtype.name for name, plane in planes.items()} == {
        **dict.fromkeys("RGB", "float32"),
        **dict.fromkeys(["se.R", "se.G", "se.B", "deterministic"], "float16"),
    }
    for c, name in enumerate("RGB"):
        assert np.array_equal(planes[name], expected.mean[..., c].astype(np.float32))
        assert np.array_equal(planes[f"se.{name}"], expected.standard_error[..., c].astype(np.float16))
    assert np.array_equal(planes["deterministic"] == 1, expected.deterministic)
    assert 0.1 < statistics["deterministic_fraction"] < 0.9
    provenance = tomllib.loads((folder / "PROVENANCE.toml").read_text())
    assert provenance["statistics"] == statistics
    assert (provenance["width"], provenance["height"], provenance["batches"]) == (24, 16, 6)
    assert provenance["files"] == ref.file_hashes(tiny)
    assert ref.stale_reasons(tiny, folder) == []


def test_the_environment_is_deterministic_and_exact(tiny: Path, renderer: ref.Renderer) -> None:
    found = ref.reduce_batches(ref.render_batches(renderer, tiny, 4, 3).images)
    assert found.deterministic[0, 0] and not found.deterministic[8, 12]
    assert np.allclose(found.mean[0, 0], (0.5, 0.4, 0.3), rtol=1e-6)


def test_batches_differ_and_repeat(tiny: Path, renderer: ref.Renderer) -> None:
    first = ref.render_batches(renderer, tiny, 4, 3).images
    assert not np.array_equal(first[0], first[1])
    assert np.array_equal(first, ref.render_batches(renderer, tiny, 4, 3).images)


def test_light_tracing_repeats(tiny: Path, renderer: ref.Renderer) -> None:
    """Light tracing runs on one thread. Afterwards the number of threads is restored."""
    import drjit

    tiny.write_text(tiny.read_text().replace('type="path"', 'type="ptracer"'))
    threads = drjit.thread_count()
    first, again = (ref.render_batches(renderer, tiny, 256, 3).images for _ in range(2))
    assert np.array_equal(first, again) and first.mean() > 0.1
    assert drjit.thread_count() == threads


def test_the_sampler_is_always_independent(tiny: Path, renderer: ref.Renderer) -> None:
    first = ref.render_batches(renderer, tiny, 5, 2).images
    text = tiny.read_text()
    for other in (
        'type="ldsampler"><integer name="sample_count" value="8"/></sampler>',
        'type="stratified"><boolean name="jitter" value="true"/></sampler>',
    ):
        tiny.write_text(text.replace('type="independent"/>', other))
        assert tiny.read_text() != text
        assert np.array_equal(first, ref.render_batches(renderer, tiny, 5, 2).images)


def test_llvm_is_used_if_it_is_installed(renderer: ref.Renderer) -> None:
    found = os.environ.get("DRJIT_LIBLLVM_PATH") or ref.find_llvm()
    assert renderer.variant == ("llvm_ad_rgb" if found else "scalar_rgb")
    assert (renderer.llvm == "none") == (not found)


def test_parameters_reach_mitsuba(tiny: Path, renderer: ref.Renderer) -> None:
    bright, dark = (ref.render_batches(renderer, tiny, 4, 2, {"lit": lit}).images.mean() for lit in ("0.9", "0.1"))
    assert bright > dark


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('value="24"', 'value="20"', "20 x 16, but width and height must be multiples of 8"),
        ('type="sphere"', 'type="spher"', 'Plugin "spher" not found'),
        ('type="sphere">', 'type="sphere"><float name="radiu" value="2"/>', r'Found 1 unreferenced .* - float "radiu": 2'),
        ("</scene>", "", "not well-formed"),
    ],
)
def test_faults_of_a_scene_are_one_line(
    tiny: Path, tmp_path: Path, renderer: ref.Renderer, old: str, new: str, message: str
) -> None:
    tiny.write_text(tiny.read_text().replace(old, new))
    with pytest.raises(ref.UserError, match=message) as caught:
        ref.make_reference(renderer, tiny, tmp_path / "out", "command", samples=5, batches=2)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_check_distinguishes_fresh_from_missing(tmp_path: Path) -> None:
    missing = run("make_references.py", "--check", "--out", tmp_path, "diffuse-room")
    assert missing.returncode == 1
    assert "diffuse-room: missing tiles.npy" in missing.stdout
    fresh = run("make_references.py", "--check", "diffuse-room")
    assert (fresh.returncode, fresh.stdout) == (0, "1 references, 0 faults\n")


def test_check_finds_a_reference_without_a_scene(tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    found = run("make_references.py", "--check", "--out", tmp_path)
    assert found.returncode == 1
    assert "gone: has no scene" in found.stdout


@pytest.mark.parametrize(
    ("script", "arguments", "message"),
    [
        ("make_references.py", ["no-such-scene"], "no scene is called 'no-such-scene'; known: "),
        ("make_references.py", ["depth-crop", "--batches", "1"], "--batches within 2 .. 4096"),
        ("compare_live.py", ["x.xml", "-D", "spp"], "-D spp: expected NAME=VALUE"),
        ("compare_live.py", ["x.xml", "--etendue", "/no/such/binary"], "--etendue: no such program: /no/such/binary"),
        ("make_assets.py", ["--out", "/dev/null/x"], "Not a directory"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(script: str, arguments: list[str], message: str) -> None:
    found = run(script, *arguments)
    check_bad_input(script, found.returncode, found.stderr, message)


@pytest.mark.parametrize("script", sorted(path.name for path in SCRIPTS.glob("*.py") if path.read_text().startswith("#!")))
def test_help(script: str) -> None:
    found = run(script, "--help")
    assert found.returncode == 0 and "usage:" in found.stdout


@pytest.mark.parametrize(("verdict", "code"), [("0", 0), ("1", 1), ("2", 2)])
def test_compare_live_exits_with_the_verdict(tiny: Path, stub: Path, tmp_path: Path, verdict: str, code: int) -> None:
    out = tmp_path / "live"
    live = ["--spp", "4", "--batches", "3", "-D", "lit=0.6", "--integrator", "direct", "--threads", "2", "--json"]
    found = run("compare_live.py", tiny, "--out", out, *live, STUB_VERDICT=verdict, ETENDUE=str(stub))
    assert found.returncode == code, found.stderr
    image, options = out / "etendue.exr", "-D lit=0.6 --spp 12 --seed 0 --integrator direct --threads 2"
    assert (stub.parent / "calls").read_text().splitlines() == [
        f"render {tiny} --replay 0,0,0 {options}",
        f"render {tiny} -o {image} {options}",
        f"compare {image} {out} --json",
    ]
    assert ref.stale_reasons(tiny, out) == []
    assert tomllib.loads((out / "PROVENANCE.toml").read_text())["parameters"] == {"lit": "0.6"}


@pytest.mark.parametrize(
    ("old", "new", "options", "message"),
    [
        ('type="sphere"', 'type="spher"', [], r"tiny\.xml:\d+:\d+: .*spher"),
        ('name="fov"', 'name="fow"', [], r"tiny\.xml:\d+:\d+: .*fow"),
        ('type="sphere"', 'type="sphere"', ["-D", "lid=0.5"], "lid"),
        ('type="sphere"', 'type="sphere"', ["--integrator", "pat"], "pat"),
    ],
)
def test_compare_live_reports_a_mistake_before_mitsuba_starts(
    tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, options: list[str], message: str
) -> None:
    tiny.write_text(tiny.read_text().replace(old, new))
    monkeypatch.setattr(ref, "start_mitsuba", lambda: pytest.fail("Mitsuba was started"))
    monkeypatch.setattr(sys, "argv", ["compare_live.py", str(tiny), "--out", str(tmp_path / "out"), *options])
    with pytest.raises(ref.UserError, match=message) as caught:
        compare_live.compare(compare_live.parse_arguments(), tmp_path / "out")
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()


def test_the_option_etendue_precedes_the_environment(tiny: Path, stub: Path, tmp_path: Path) -> None:
    options = ["--spp", "4", "--batches", "2", "--out", tmp_path / "live", "--etendue", stub]
    found = run("compare_live.py", tiny, *options, STUB_VERDICT="0", ETENDUE="/no/such")
    assert found.returncode == 0, found.stderr


def test_without_llvm_the_scalar_variant_renders_and_reports_it(tiny: Path, tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; import mitsuba_reference as ref; ref.find_llvm = lambda: None\n"
        "ref.make_reference(ref.start_mitsuba(), Path(sys.argv[1]), Path(sys.argv[2]), 'command', samples=4, batches=2)"
    )
    found = subprocess.run(
        [sys.executable, "-c", program, str(tiny), str(tmp_path / "out")],
        capture_output=True,
        text=True,
        check=True,
        cwd=SCRIPTS,
        env={"PATH": "/usr/bin:/bin"},
    )
    assert "falling back to scalar_rgb" in found.stderr
    assert 'variant = "scalar_rgb"\nllvm = "none"\n' in (tmp_path / "out" / "PROVENANCE.toml").read_text()
