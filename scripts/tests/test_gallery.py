"""The pictures in the README."""

import re

import pytest

import make_gallery
import mitsuba_reference as ref


def test_the_readme_shows_every_figure() -> None:
    shown = re.findall(r'src="reports/gallery/([^"]+)\.png"', (ref.ROOT / "README.md").read_text())
    assert sorted(shown) == sorted(make_gallery.pictures())
    assert all((make_gallery.GALLERY / f"{name}.png").is_file() for name in shown)
    assert len(list(make_gallery.GALLERY.iterdir())) == len(shown)


@pytest.mark.parametrize("name", list(make_gallery.pictures()))
def test_the_size_of_a_picture_is_that_of_its_scene(name: str, renderer: ref.Renderer) -> None:
    scene, _ = make_gallery.pictures()[name]
    width, height = ref.load_scene(renderer, scene).sensors()[0].film().size()
    assert make_gallery.size(scene, 5) == ["-D", f"width={5 * width}", "-D", f"height={5 * height}"]
