#!/usr/bin/env python3
"""Kill a render repeatedly, resume it each time, and compare its image with the image of an uninterrupted render.

Each round starts a render without a checkpoint. The script kills it (SIGKILL) at a random time and resumes it, --kills times, and
then resumes it to its end. Each start has a random number of threads. All channels must be identical to the last bit.

A render that ends before it is killed does not count, and the next one is killed earlier. The script therefore reaches --times
kills on fast and on busy machines.

Exit codes: 0 all images are identical; 1 an image differs; 2 bad input; 130 interrupted.
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

import etendue
from user_error import UserError, exit_code

Planes = dict[str, np.ndarray]


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="a scene file")
    parser.add_argument("--times", type=int, default=50, help="number of kills in all (default: %(default)s)")
    parser.add_argument("--kills", type=int, default=1, help="number of kills in each round (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random times (default: %(default)s)")
    parser.add_argument("--options", default="--spp 64", help="options of etendue render (default: %(default)s)")
    parser.add_argument(
        "--checkpoint-every", "--every", dest="every", default="0s", help="time between checkpoints (default: %(default)s)"
    )
    etendue.add_program_option(parser)
    return parser.parse_args()


def planes(image: Path) -> Planes:
    """Every channel of an image, as bits."""
    with OpenEXR.File(str(image), separate_channels=True) as file:
        return {name: channel.pixels.view(np.uint32).copy() for name, channel in file.channels().items()}


def are_equal(one: Planes, other: Planes) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)


class Render:
    """One render with fixed options, its checkpoint, and the number of its kills so far."""

    def __init__(self, arguments: argparse.Namespace, folder: Path) -> None:
        self.command = [str(etendue.binary(arguments.etendue)), "render", "--quiet", str(arguments.scene.resolve())]
        self.command += shlex.split(arguments.options)
        self.every = arguments.every
        self.folder = folder
        self.checkpoint = folder / "render.ck"
        self.seconds = 0.0
        self.killed = self.resumed = 0

    def whole(self) -> Planes:
        """The image of an uninterrupted render, whose duration bounds the random times."""
        image, start = self.folder / "whole.exr", time.monotonic()
        etendue.run_command([*self.command, "-o", str(image)])
        self.seconds = time.monotonic() - start
        return planes(image)

    def start(self, image: Path, threads: int) -> subprocess.Popen[str]:
        """Start the render, from its checkpoint if there is one."""
        option = "--resume" if self.checkpoint.exists() else "--checkpoint"
        words = [option, str(self.checkpoint), "--checkpoint-every", self.every, "--threads", str(threads), "-o", str(image)]
        return subprocess.Popen([*self.command, *words], stderr=subprocess.PIPE, text=True)

    def kill(self, image: Path, chance: random.Random) -> bool:
        """Start the render and kill it at a random time; returns whether it was killed before its end."""
        process = self.start(image, chance.randint(1, 4))
        self.wait(process, chance)
        process.kill()
        _, stderr = process.communicate()
        if process.returncode not in (0, -9):
            raise UserError(etendue.error_line(stderr))
        if process.returncode == 0:
            self.seconds /= 2.0
        return process.returncode != 0

    def wait(self, process: subprocess.Popen[str], chance: random.Random) -> None:
        """Let a render run for a random time."""
        time.sleep(chance.uniform(0.0, self.seconds))

    def round(self, kills: int, chance: random.Random) -> Planes:
        """The image of a render that was killed `kills` times, or fewer times if it ended before."""
        image = self.folder / "killed.exr"
        self.checkpoint.unlink(missing_ok=True)
        for _ in range(kills):
            if not self.kill(image, chance):
                break
            self.killed += 1
            self.resumed += self.checkpoint.exists()
        image.unlink(missing_ok=True)
        process = self.start(image, chance.randint(1, 4))
        _, stderr = process.communicate()
        if process.returncode:
            raise UserError(etendue.error_line(stderr))
        return planes(image)


def work(arguments: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory() as folder:
        return rounds_of(arguments, Render(arguments, Path(folder)))


def rounds_of(arguments: argparse.Namespace, render: Render) -> int:
    """Kill and resume `render` until it was killed --times times; returns the exit code."""
    chance = random.Random(arguments.seed)
    whole, rounds, identical = render.whole(), 0, 0
    while render.killed < arguments.times:
        before = render.killed
        same = are_equal(whole, render.round(arguments.kills, chance))
        rounds += 1
        identical += same
        if not same:
            print(f"round {rounds} differs after {render.killed - before} kills")
    print(
        f"{arguments.scene.stem} {arguments.options}: {rounds} rounds, {render.killed} kills, {render.resumed} of them with a "
        f"checkpoint: {identical} of {rounds} images identical in {len(whole)} channels"
    )
    return 0 if identical == rounds else 1


def main() -> int:
    arguments = parse_arguments()
    return exit_code(lambda: work(arguments))


if __name__ == "__main__":
    sys.exit(main())
