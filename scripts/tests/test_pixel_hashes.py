"""The hashes of pixels: equal for equal images, different for different images."""

import sys
from pathlib import Path

import pytest

import etendue
import pixel_hashes


@pytest.fixture
def assets(tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder like assets/ that holds the tiny scene alone."""
    scene = tmp_path / "assets" / "scenes" / "tiny.xml"
    scene.parent.mkdir(parents=True)
    scene.write_text(tiny.read_text())
    monkeypatch.setattr(pixel_hashes, "ASSETS", tmp_path / "assets")
    return scene


def call(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    monkeypatch.setattr(sys, "argv", ["pixel_hashes.py", *map(str, arguments)])
    return pixel_hashes.main()


def test_the_hash_depends_only_on_the_pixels_and_the_window(tiny: Path, tmp_path: Path) -> None:
    image = tmp_path / "a.exr"
    first = pixel_hashes.hash_of_render(tiny, "path", 1, image)
    assert first == pixel_hashes.hash_of_render(tiny, "path", 1, image)
    assert first != pixel_hashes.hash_of_render(tiny, "path", 2, image)
    found = etendue.read_image(image)
    before = pixel_hashes.hash_of_image(image)
    etendue.write_image(image, etendue.Image(found.layers, found.channels, {"etendue.seconds": "7"}, found.crop, found.size))
    assert pixel_hashes.hash_of_image(image) == before
    etendue.write_image(image, etendue.Image(found.layers, found.channels, found.attributes, (1, 0), (25, 16)))
    assert pixel_hashes.hash_of_image(image) != before


def test_a_changed_scene_differs_and_an_unchanged_one_does_not(
    assets: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pixel_hashes, "INTEGRATORS", ("own", "depth", "sppm", "no-such"))
    file = tmp_path / "hashes.json"
    assert call(monkeypatch, "record", file) == 0
    assert '"no-such": "refused"' in file.read_text()
    assert call(monkeypatch, "check", file) == 0
    assert capsys.readouterr().out.endswith("scenes/tiny: done\n1 scenes, 0 differences\n")
    # The depth does not depend on the colour.
    assets.write_text(assets.read_text().replace('value="0.8"', 'value="0.7"'))
    assert call(monkeypatch, "check", file) == 1
    assert "scenes/tiny: differs: own, sppm\n" in capsys.readouterr().out
    assets.unlink()
    assert call(monkeypatch, "check", file, "--only", "scenes/figures/*") == 0
    assert call(monkeypatch, "check", file) == 1


def test_bad_input_is_one_line_and_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "torn.json").write_text("{")
    for name in ("no-such.json", "torn.json"):
        assert call(monkeypatch, "check", tmp_path / name) == 2
        stderr = capsys.readouterr().err
        assert stderr.startswith("pixel_hashes.py: ") and stderr.count("\n") == 1
