#!/usr/bin/env python3
"""Render the scenes of assets/scenes/figures into reports/gallery, the pictures of the README.

Exit codes: 0 all is well; 2 a picture could not be rendered; 130 interrupted.
"""

import argparse
import sys
import tempfile
import xml.etree.ElementTree as ET
from fnmatch import fnmatch
from pathlib import Path

import etendue
from user_error import exit_code

FIGURES = etendue.ROOT / "assets" / "scenes" / "figures"
GALLERY = etendue.ROOT / "reports" / "gallery"

# Options of `etendue render`, by scene and by suffix. A picture is named after its scene, plus the suffix.
PHOTONS = ["--integrator", "photonmapper"]
MAP = ["--param", "raw_estimate=true", "--param", "kernel=constant", "--param", "lookup_size=20", "--layer", "raw"]
SMALL_LAMP = ["-D", "lamp=0.12", "-D", "radiance=115, 101, 82", "--param", "caustic_photons=4000000"]
OPTIONS = {
    "figure-7-shadows": {"": [], "-transparent": ["--param", "transparent_shadows=true"]},
    "figure-8-photons": {"": [*PHOTONS, *MAP], "-rendered": PHOTONS},
    "figure-9-caustic": {"": [*PHOTONS, *SMALL_LAMP], "-map": [*PHOTONS, *SMALL_LAMP, "--layer", "caustic", "--exposure", "0"]},
    "figure-10-cognac": {"": [*PHOTONS, "--param", "caustic_photons=4000000"]},
}


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=int, default=3, help="factor on the film size of each scene (default: %(default)s)")
    parser.add_argument("--spp", type=int, default=256, help="samples per pixel (default: %(default)s)")
    parser.add_argument("--only", default="*", metavar="GLOB", help="only pictures whose names match (default: all)")
    return parser.parse_args()


def pictures() -> dict[str, tuple[Path, list[str]]]:
    """The scene and the options of each picture, by the name of the picture."""
    found = {}
    for scene in sorted(FIGURES.glob("*.xml")):
        for suffix, options in OPTIONS.get(scene.stem, {"": []}).items():
            found[scene.stem + suffix] = (scene, options)
    return found


def size(scene: Path, scale: int) -> list[str]:
    """The options that enlarge the film of a scene; its parameters `width` and `height` hold the film size."""
    defaults = {element.get("name"): element.get("value", "") for element in ET.parse(scene).getroot().iter("default")}
    return [text for name in ("width", "height") for text in ("-D", f"{name}={scale * int(defaults[name])}")]


def render(name: str, scene: Path, options: list[str], arguments: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / f"{name}.exr"
        film = size(scene, arguments.scale)
        # A sample of photon mapping costs more than a path, and has less noise.
        spp = arguments.spp // 4 if options[:2] == PHOTONS else arguments.spp
        etendue.run(["render", scene, "-o", image, "--png", "--spp", spp, *film, *options])
        GALLERY.mkdir(parents=True, exist_ok=True)
        (GALLERY / f"{name}.png").write_bytes(image.with_suffix(".png").read_bytes())


def work(arguments: argparse.Namespace) -> int:
    for name, (scene, options) in pictures().items():
        if fnmatch(name, arguments.only):
            print(name, flush=True)
            render(name, scene, options, arguments)
    return 0


def main() -> int:
    arguments = parse_arguments()
    return exit_code(lambda: work(arguments))


if __name__ == "__main__":
    sys.exit(main())
