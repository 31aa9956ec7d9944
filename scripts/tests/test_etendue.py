"""The module etendue: images, renders, shards and tables of studies."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
import pandas as pd
import pytest

import etendue
from helpers import write_program
from user_error import UserError

PLANES = {
    "R": np.float32,
    "G": np.float32,
    "B": np.float32,
    "deterministic": np.float16,
    "caustic.R": np.float32,
    "caustic.G": np.float32,
    "caustic.B": np.float32,
    "pp.Z": np.float32,
    "pp.X": np.float32,
    "pp.Y": np.float32,
    "tt.V": np.float32,
    "tt.U": np.float32,
    "count.I": np.uint32,
}


def random_planes() -> dict[str, np.ndarray]:
    """A plane of 5 x 7 random pixels for each channel; some values are extreme."""
    generator = np.random.default_rng(5)
    planes = {name: (generator.random((5, 7)) * 1000).astype(kind) for name, kind in PLANES.items()}
    planes["R"][0, :4] = [np.inf, -0.0, 1e-42, 3e38]
    return planes


def test_an_image_of_openexr_is_read(tmp_path: Path) -> None:
    planes, path = random_planes(), tmp_path / "a.exr"
    window = np.array([[2, 3], [8, 7]], np.int32), np.array([[1, 1], [20, 10]], np.int32)
    header = {"etendue.scene": "Sänfte ∑.xml", "dataWindow": tuple(window[0]), "displayWindow": tuple(window[1])}
    with OpenEXR.File(header, dict(planes)) as file:
        file.write(str(path))
    image = etendue.read_image(path)
    assert image.channels == {
        "": ("R", "G", "B"),
        "caustic": ("R", "G", "B"),
        "count": ("I",),
        "deterministic": ("",),
        "pp": ("X", "Y", "Z"),
        "tt": ("U", "V"),
    }
    for layer, name, index in [("", "R", 0), ("", "B", 2), ("caustic", "caustic.G", 1), ("pp", "pp.Z", 2), ("tt", "tt.U", 0)]:
        assert image[layer].dtype == planes[name].dtype
        assert np.array_equal(image[layer][..., index], planes[name])
    assert np.array_equal(image.color, np.dstack([planes[name] for name in "RGB"]))
    assert (image.crop, image.size) == ((1, 2), (20, 10))
    assert image.attributes["etendue.scene"] == "Sänfte ∑.xml"


def test_openexr_reads_an_image_that_was_written(tmp_path: Path) -> None:
    path, planes = tmp_path / "new" / "b.exr", random_planes()
    layers = {"": ("R", "G", "B"), "pp": ("X", "Y", "Z"), "deterministic": ("",)}
    names = {"": "RGB", "pp": ["pp.X", "pp.Y", "pp.Z"], "deterministic": ["deterministic"]}
    stacked = {layer: np.stack([planes[name] for name in found], axis=-1) for layer, found in names.items()}
    etendue.write_image(path, etendue.Image(stacked, layers, {"etendue.spp": "4"}, (3, 1), (30, 20)))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header, found = dict(file.header()), {name: channel.pixels for name, channel in file.channels().items()}
    assert found.keys() == {name for group in names.values() for name in group}
    for name, plane in found.items():
        assert plane.tobytes() == planes[name].tobytes(), name
    assert [corner.tolist() for corner in header["dataWindow"]] == [[3, 1], [9, 5]]
    assert [corner.tolist() for corner in header["displayWindow"]] == [[0, 0], [29, 19]]
    assert header["etendue.spp"] == "4"
    assert [file.name for file in path.parent.iterdir()] == ["b.exr"]
    again = etendue.read_image(path)
    assert (again.crop, again.size, again.channels) == ((3, 1), (30, 20), layers)


def test_a_render_has_the_requested_options(tiny: Path, tmp_path: Path) -> None:
    image = tmp_path / "a.exr"
    options = {"params": {"max_depth": 2}, "defines": {"lit": 0.25}, "sampler": "stratified"}
    etendue.render(tiny, image, integrator="path", spp=9, seed=7, threads=1, **options)
    found = etendue.read_image(image)
    assert {name: values.shape for name, values in found.layers.items()} == {"": (16, 24, 3), "variance": (16, 24, 3)}
    expected = {"spp": "9", "seed": "7", "integrator": "path", "sampler": "stratified", "parameters": "max_depth=2 lit=0.25"}
    assert {name: found.attributes[f"etendue.{name}"] for name in expected} == expected
    assert np.allclose(found.color[0, 0], (0.5, 0.4, 0.3), rtol=1e-6)


def test_merged_shards_are_the_single_run(tiny: Path, tmp_path: Path) -> None:
    single, merged = tmp_path / "single.exr", tmp_path / "merged.exr"
    etendue.render(tiny, single, spp=10, seed=3)
    shards = [tmp_path / f"{i}.sums" for i in (1, 2, 3)]
    for i, file in enumerate(shards, start=1):
        etendue.render(tiny, spp=10, seed=3, shard=(i, 3), checkpoint=file)
    etendue.merge(reversed(shards), merged)
    planes, others = (etendue.read_image(path).planes() for path in (single, merged))
    assert {name: plane.tobytes() for name, plane in planes.items()} == {n: p.tobytes() for n, p in others.items()}
    with pytest.raises(etendue.EtendueError, match=r"missing") as caught:
        etendue.merge(shards[1:], tmp_path / "part.exr")
    assert caught.value.code == 2 and not (tmp_path / "part.exr").exists()
    etendue.merge(shards[1:], tmp_path / "part.exr", partial=True)
    assert etendue.read_image(tmp_path / "part.exr").attributes["etendue.spp"] == "7"


def test_the_tables_of_a_study(tiny_study: Callable[..., Path], tmp_path: Path) -> None:
    study, out = tiny_study(("plain", "etendue", [2, 8])), tmp_path / "out"
    missing = etendue.plan(study, out=out)
    assert [run["cell"] for run in missing] == ["tiny.reference"] + ["tiny.plain.2"] * 2 + ["tiny.plain.8"] * 2
    assert etendue.run_study(study, out=out, jobs=2, threads=1).holds
    assert etendue.plan(study, out=out) == [] and len(etendue.plan(study, out=out, every=True)) == 5
    assert etendue.study_folder(study, out=out) == out
    rows, cells = etendue.read_rows(out), etendue.read_cells(out)
    assert sorted(rows["spp"]) == [2, 2, 8, 8] and sorted(cells["spp"]) == [2, 8]
    for row in rows.itertuples():
        assert etendue.read_image(row.image).attributes["etendue.seed"] == str(row.seed)
    # Four times the samples halve the error; the seeds are fixed, and the bounds exclude factors of 1 and 4.
    error = cells.set_index("spp")["rmse"]
    assert 1.5 < error[2] / error[8] < 2.7
    assert rows["rmse_masked"].isna().all() and pd.api.types.is_float_dtype(rows["rmse_masked"])


def test_an_incomplete_line_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "rows.jsonl").write_text('{"spp": 2, "rmse": 0.5}\n{"spp": 4, "rmse": 0.25}\n{"spp": 8, "rm')
    assert etendue.read_rows(tmp_path)["spp"].tolist() == [2, 4]
    (tmp_path / "rows.jsonl").write_text('{"spp": 2}\n{"spp": \n')
    with pytest.raises(UserError, match=r"rows\.jsonl:2: not JSON"):
        etendue.read_rows(tmp_path)


def test_the_order_in_which_the_program_is_searched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ETENDUE", raising=False)
    monkeypatch.setattr(etendue, "ROOT", tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with pytest.raises(UserError, match=r"no etendue program: build it with `cargo build --release` in "):
        etendue.binary()
    for path in (tmp_path / "bin" / "etendue", tmp_path / "target" / "release" / "etendue", tmp_path / "mine"):
        write_program(path, "exit 0")
        if path.name == "mine":
            monkeypatch.setenv("ETENDUE", str(path))
        assert etendue.binary() == path
    monkeypatch.setenv("ETENDUE", str(tmp_path / "none"))
    with pytest.raises(UserError, match=r"\$ETENDUE: no such program: .*none"):
        etendue.binary()
    assert etendue.binary(tmp_path / "mine") == tmp_path / "mine"
    with pytest.raises(UserError, match=r"--etendue: no such program: .*theirs"):
        etendue.binary(tmp_path / "theirs")


@pytest.mark.parametrize(
    ("text", "message", "code"),
    [
        ("echo 'warning: dark' >&2; echo 'box.xml:1:2: no shape' >&2; exit 2", "box.xml:1:2: no shape", 2),
        ("printf 'error: invalid value\\n\\nUsage: etendue\\n' >&2; exit 2", "invalid value", 2),
        ("exit 3", "ended with exit code 3 without a message", 3),
        ("kill -9 $$", "was killed by signal 9", -9),
    ],
)
def test_a_fault_of_the_program_has_its_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], text: str, message: str, code: int
) -> None:
    monkeypatch.setenv("ETENDUE", str(write_program(tmp_path / "etendue", text)))
    with pytest.raises(etendue.EtendueError) as caught:
        etendue.render("box.xml", "box.exr")
    assert str(caught.value).endswith(message) and caught.value.code == code
    assert capfd.readouterr().err == ("warning: dark\n" if "warning" in text else "")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: etendue.read_image("/no/such.exr"), "/no/such.exr: no such file"),
        (lambda: etendue.read_image(__file__), "cannot read"),
        (lambda: etendue.write_image("/dev/null/a.exr", etendue.Image({"": np.zeros((1, 1, 1))}, {"": ("R",)})), "cannot write"),
        (lambda: etendue.Image({"": 0, "pp": 0}, {})["caustic"], "no layer 'caustic'; it has: '', 'pp'"),
        (lambda: etendue.read_rows("/no/such"), "/no/such/rows.jsonl: no such file"),
        (lambda: etendue.render("/no/such.xml", "/tmp/a.exr"), "/no/such.xml"),
        (lambda: etendue.plan("/no/such.toml"), "/no/such.toml"),
        (lambda: etendue.merge(["/no/such.sums"], os.devnull), "/no/such.sums"),
    ],
)
def test_bad_input_is_one_line(call: Callable[[], object], message: str) -> None:
    with pytest.raises(UserError) as caught:
        call()
    assert message in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("value", "text"),
    [(True, "true"), (3, "3"), (0.5, "0.5"), ("cone", "cone"), ([1, 0.5], "1, 0.5"), (np.array([2.0, 3.0]), "2.0, 3.0")],
)
def test_values_are_written_as_in_scenes(value: object, text: str) -> None:
    assert etendue.value_text(value) == text
