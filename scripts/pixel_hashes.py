#!/usr/bin/env python3
"""Record a hash of the pixels of every scene by every integrator, or check the pixels against recorded hashes.

For developers who change code but must not change images:

    python scripts/pixel_hashes.py record before.json    # with the old program
    python scripts/pixel_hashes.py check before.json     # with the new program

A hash covers the data window and the names, types and pixels of all channels. It leaves out the rest of the header, which
contains times. A combination of scene and integrator that the program refuses is recorded as "refused".

Exit codes: 0 all is well; 1 (check) something differs; 2 bad input, or a render failed; 130 interrupted.
"""

import argparse
import hashlib
import json
import signal
import sys
import tempfile
from fnmatch import fnmatch
from pathlib import Path

import etendue
from user_error import UserError, exit_code

ASSETS = etendue.ROOT / "assets"
# Folders of whole scenes; other folders hold parts of scenes.
FOLDERS = ("scenes", "scenes/figures", "studies/scenes")
OWN = "own"
INTEGRATORS = (OWN, "path", "direct", "ptracer", "photonmapper", "sppm", "depth", "aov", "moment")
SAMPLES = 4
SEEDS = (1, 2)
REFUSED = "refused"

# By integrator: a hash for each seed, or REFUSED.
Hashes = dict[str, dict[str, str] | str]


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("record", "check"), help="write the hashes, or compare with them")
    parser.add_argument("file", type=Path, metavar="FILE", help="the JSON file of hashes")
    parser.add_argument("--only", default="*", metavar="GLOB", help="only scenes whose names match, such as 'scenes/figures/*'")
    return parser.parse_args()


def all_scenes() -> dict[str, Path]:
    """The scenes under assets/ by name: the path under assets/ without its suffix."""
    paths = (path for folder in FOLDERS for path in sorted((ASSETS / folder).glob("*.xml")))
    return {path.relative_to(ASSETS).with_suffix("").as_posix(): path for path in paths}


def hash_of_image(path: Path) -> str:
    """The SHA-256 of all channels of all parts of an OpenEXR file, and of their data windows."""
    import OpenEXR

    digest = hashlib.sha256()
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for part in file.parts:
            window = [corner.tolist() for corner in part.header["dataWindow"]]
            for name, channel in sorted(part.channels.items()):
                digest.update(f"{window} {name} {channel.pixels.dtype.str}\n".encode())
                digest.update(channel.pixels.tobytes())
    return digest.hexdigest()


def hash_of_render(scene: Path, integrator: str, seed: int, image: Path) -> str:
    """The hash of one image, rendered into the file `image`; REFUSED if the program refuses the combination."""
    words: list[str | Path] = ["render", scene, "--spp", str(SAMPLES), "--seed", str(seed), "-o", image]
    code, _ = etendue.run(words if integrator == OWN else [*words, "--integrator", integrator], good=(0, 2))
    return hash_of_image(image) if code == 0 else REFUSED


def hashes_of_scene(scene: Path, image: Path) -> Hashes:
    found: Hashes = {}
    for integrator in INTEGRATORS:
        hashes = {str(seed): hash_of_render(scene, integrator, seed, image) for seed in SEEDS}
        found[integrator] = REFUSED if set(hashes.values()) == {REFUSED} else hashes
    return found


def read_hashes(file: Path) -> dict[str, Hashes]:
    """The hashes of each scene that `record` wrote."""
    try:
        return json.loads(file.read_text())
    except ValueError as error:
        raise UserError(f"{file}: not a file of hashes: {error}") from error


def work(action: str, file: Path, only: str) -> int:
    """Render the scenes one after the other; write the file after each, or print what differs from it."""
    scenes, found, differences = all_scenes(), {}, 0
    recorded = read_hashes(file) if action == "check" else {}
    names = [name for name in {**recorded, **scenes} if fnmatch(name, only)]
    with tempfile.TemporaryDirectory(prefix="etendue-hashes-") as folder:
        for name in names:
            found[name] = hashes_of_scene(scenes[name], Path(folder) / "image.exr") if name in scenes else {}
            if action == "record":
                file.write_text(json.dumps(found, indent=1) + "\n")
            before = recorded.get(name, {}) if action == "check" else found[name]
            changed = [key for key in {**before, **found[name]} if before.get(key) != found[name].get(key)]
            differences += len(changed)
            print(f"{name}: {'differs: ' + ', '.join(changed) if changed else 'done'}", flush=True)
    print(f"{len(names)} scenes, {differences} differences" if action == "check" else f"{len(names)} scenes")
    return 1 if differences else 0


def main() -> int:
    arguments = parse_arguments()
    # SIGTERM must end the current render too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    return exit_code(lambda: work(arguments.action, arguments.file, arguments.only))


if __name__ == "__main__":
    sys.exit(main())
