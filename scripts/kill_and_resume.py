#!/usr/bin/env python3
"""Kill a render again and again, resume it each time, and compare the image with that of a render without interruption.

Each time the render is started from nothing, killed (SIGKILL) at a random moment, resumed, killed, ... until it has been
killed as often as it is asked for, and then resumed to its end on another number of threads. All channels must be the same to
the last bit. Exit codes: 0 all are; 1 one is not, or hardly any was killed; 2 bad input.
"""

import argparse
import random
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import OpenEXR

ROOT = Path(__file__).resolve().parent.parent


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="a scene file")
    parser.add_argument("--times", type=int, default=50, help="how often it is killed in all (default: %(default)s)")
    parser.add_argument("--kills", type=int, default=1, help="how often each render is killed (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the random moments (default: %(default)s)")
    parser.add_argument("--options", default="--spp 64", help="options of etendue render (default: %(default)s)")
    parser.add_argument("--every", default="0s", help="the time between checkpoints (default: %(default)s)")
    parser.add_argument("--etendue", type=Path, default=ROOT / "target" / "release" / "etendue", help="the etendue binary")
    return parser.parse_args()


def planes(image: Path) -> dict[str, np.ndarray]:
    """Every channel of an image, as bits."""
    with OpenEXR.File(str(image), separate_channels=True) as file:
        return {name: channel.pixels.view(np.uint32).copy() for name, channel in file.channels().items()}


def are_equal(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)


class Render:
    """A render with all that is always the same about it."""

    def __init__(self, arguments: argparse.Namespace, folder: Path) -> None:
        self.command = [str(arguments.etendue.resolve()), "render", str(arguments.scene.resolve())]
        self.command += shlex.split(arguments.options)
        self.every = arguments.every
        self.folder = folder

    def whole(self) -> tuple[dict[str, np.ndarray], float]:
        """The image without interruption, and how long it took."""
        image, start = self.folder / "whole.exr", time.monotonic()
        subprocess.run([*self.command, "-o", str(image)], check=True, stderr=subprocess.DEVNULL)
        return planes(image), time.monotonic() - start

    def start(self, image: Path, threads: int) -> subprocess.Popen[bytes]:
        """Begins it, or goes on where there is something to go on from."""
        checkpoint = self.folder / "render.ck"
        option = "--resume" if checkpoint.exists() else "--checkpoint"
        keeping = [option, str(checkpoint), "--every", self.every, "--threads", str(threads), "-o", str(image)]
        return subprocess.Popen([*self.command, *keeping], stderr=subprocess.PIPE)

    def killed(self, kills: int, seconds: float, chance: random.Random) -> tuple[dict[str, np.ndarray], str]:
        """The image after so many kills, and what happened."""
        image, story = self.folder / "killed.exr", []
        (self.folder / "render.ck").unlink(missing_ok=True)
        for _ in range(kills):
            process = self.start(image, chance.randint(1, 4))
            moment = chance.uniform(0.0, seconds)
            time.sleep(moment)
            process.kill()
            _, fault = process.communicate()
            if process.returncode not in (0, -9):
                raise SystemExit(f"exit code {process.returncode}: {fault.decode()}")
            kept = "resumed" if (self.folder / "render.ck").exists() else "begun anew"
            story.append(f"{'killed' if process.returncode else 'finished before'} {moment:.3f} s, {kept}")
        image.unlink(missing_ok=True)
        process = self.start(image, chance.randint(1, 4))
        _, fault = process.communicate()
        if process.returncode:
            raise SystemExit(f"exit code {process.returncode}: {fault.decode()}")
        return planes(image), "; ".join(story)


def main() -> int:
    arguments = parse_arguments()
    if not arguments.scene.is_file():
        print(f"{arguments.scene}: no such scene", file=sys.stderr)
        return 2
    chance = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        render = Render(arguments, Path(folder))
        whole, seconds = render.whole()
        good = resumed = killed = rounds = 0
        # Some are finished before they are killed.
        while killed < arguments.times and rounds < 10 * arguments.times:
            image, story = render.killed(arguments.kills, seconds, chance)
            same = are_equal(whole, image)
            good += same
            rounds += 1
            killed += story.count("killed")
            resumed += story.count("s, resumed")
            if not same:
                print(f"render {rounds} differs: {story}")
        print(
            f"{arguments.scene.stem} {arguments.options}: {seconds:.2f} s, {rounds} renders, {killed} kills, "
            f"{resumed} times with a checkpoint: {good} of {rounds} images identical in {len(whole)} channels"
        )
        return 0 if good == rounds and killed >= arguments.times else 1


if __name__ == "__main__":
    sys.exit(main())
