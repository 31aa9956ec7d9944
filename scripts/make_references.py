#!/usr/bin/env python3
"""Render the scenes of assets/scenes with Mitsuba into reference/, or check that the references there are up to date.

Exit codes: 0 all is well; 1 (--check) a reference is stale or missing; 2 bad input; 130 interrupted.
"""

import argparse
import shlex
import sys
from pathlib import Path

import mitsuba_reference as ref
from user_error import UserError, exit_code


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="names of scenes, such as diffuse-room (default: all scenes)")
    parser.add_argument(
        "--spp", type=int, default=ref.SAMPLES_PER_BATCH, help="samples per pixel in each batch (default: %(default)s)"
    )
    parser.add_argument("--batches", type=int, default=ref.BATCHES, help="independent batches (default: %(default)s)")
    parser.add_argument(
        "--out", type=Path, default=ref.REFERENCES, metavar="FOLDER", help="folder of the references (default: reference/)"
    )
    parser.add_argument("--check", action="store_true", help="compare the recorded hashes with the files instead of rendering")
    return parser.parse_args()


def known_scenes() -> dict[str, Path]:
    """The scenes of assets/scenes and its figures, by name. The other sub-folders hold parts of scenes."""
    return {path.stem: path for path in ref.all_scenes()}


def chosen_scenes(names: list[str]) -> dict[str, Path]:
    known = known_scenes()
    for name in names:
        if name not in known:
            raise UserError(f"no scene is called {name!r}; known: {', '.join(known)}")
    return {name: known[name] for name in names} if names else known


def check(scenes: dict[str, Path], references: Path, whole: bool) -> int:
    """Print the stale references; with `whole`, also those without a scene. Returns the exit code."""
    faults = [f"{name}: {reason}" for name, path in scenes.items() for reason in ref.stale_reasons(path, references / name)]
    if whole and references.is_dir():
        faults += [
            f"{folder.name}: has no scene"
            for folder in sorted(references.iterdir())
            if folder.is_dir() and folder.name not in scenes
        ]
    for fault in faults:
        print(fault)
    print(f"{len(scenes)} references, {len(faults)} faults")
    return 1 if faults else 0


def render(scenes: dict[str, Path], references: Path, samples: int, batches: int) -> int:
    """Render each scene and print its statistics on one line. Returns the exit code."""
    if samples < 1 or not 2 <= batches <= ref.MAX_BATCHES:
        raise UserError(f"--spp must be at least 1 and --batches within 2 .. {ref.MAX_BATCHES}")
    renderer = ref.start_mitsuba()
    for name, path in scenes.items():
        command = shlex.join(["python", "scripts/make_references.py", name, "--spp", str(samples), "--batches", str(batches)])
        found = ref.make_reference(renderer, path, references / name, command, samples, batches)
        worst = max(found["global_relative_se"])
        median, p95 = found["tile_relative_se_median"], found["tile_relative_se_p95"]
        print(f"{name:20} se of mean {worst:.5f}, of tiles: median {median:.5f}, p95 {p95:.5f}", flush=True)
    return 0


def work(arguments: argparse.Namespace) -> int:
    scenes = chosen_scenes(arguments.scenes)
    if arguments.check:
        return check(scenes, arguments.out, whole=not arguments.scenes)
    return render(scenes, arguments.out, arguments.spp, arguments.batches)


def main() -> int:
    arguments = parse_arguments()
    return exit_code(lambda: work(arguments))


if __name__ == "__main__":
    sys.exit(main())
