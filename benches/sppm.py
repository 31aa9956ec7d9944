#!/usr/bin/env python3
"""Compare etendue's progressive photon mapping with SmallVCM in the same run, each on one thread.

Both render the same scene (benches/scenes/smallvcm-1.xml) with one light path and one camera path per pixel and pass. etendue
runs `sppm` twice, first with its default radii and then with SmallVCM's. In both runs photons also carry the direct light, as in
SmallVCM. SmallVCM runs `ppm`. Build SmallVCM (https://github.com/SmallVCM/SmallVCM) by
`g++ -O3 -march=native -fopenmp src/smallvcm.cxx`; without it, the script measures etendue alone.

Core-seconds are user CPU time without loading and writing: the time of a long render minus the time of a single pass. The
renderers take turns, and the script reports medians of several runs. Peak memory is measured for a whole process, first with few
passes and then with many: the memory of a progressive method does not grow with the passes. The mean radiance shows whether both
renderers compute the same image, up to bias and noise.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenEXR

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "scripts"))

import etendue

SCENE = HERE / "scenes" / "smallvcm-1.xml"
PIXELS = 512 * 512
OUTPUT = Path(tempfile.gettempdir()) / "etendue-sppm"
DEFAULTS = {"photon_count": str(PIXELS), "direct": "map"}
# SmallVCM's initial radius is 0.003 times the radius of the bounding sphere of the room, a cube with edges of 2.56004 m.
RADII = {"radius_schedule": "per_pass", "alpha": "0.75", "initial_radius": str(0.003 * 2.56004 * 3**0.5 / 2)}


class Run(NamedTuple):
    """Cost and result of one process."""

    seconds: float
    """User CPU time."""
    peak: float
    """Peak memory in MB."""
    radiance: float
    """The mean of all channels of its image."""


def process(command: list[str], mean: Callable[[], float]) -> Run:
    """Run a command on one processor; `mean` reads the mean radiance of its image."""
    # SmallVCM starts as many threads as it has processors.
    one = ["taskset", "--cpu-list", str(min(os.sched_getaffinity(0)))]
    child = subprocess.Popen([*one, *command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    stderr = child.stderr.read().decode()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        raise SystemExit(f"sppm.py: {' '.join(command)}: exit code {child.returncode}\n{stderr}")
    return Run(usage.ru_utime, usage.ru_maxrss / 1024, mean())


def measure_etendue(program: Path, parameters: dict[str, str], passes: int, seed: int) -> Run:
    image = OUTPUT.with_suffix(".exr")
    command = [program, "render", SCENE, "-o", image, "--integrator", "sppm", "--spp", passes, "--seed", seed, "--threads", 1]
    command += [word for name, value in parameters.items() for word in ("--param", f"{name}={value}")]

    def mean() -> float:
        with OpenEXR.File(str(image), separate_channels=True) as file:
            return float(np.mean([file.channels()[name].pixels for name in "RGB"], dtype=np.float64))

    return process([*map(str, command)], mean)


def measure_smallvcm(program: Path, passes: int, _seed: int) -> Run:
    """Run SmallVCM, whose seed is fixed."""
    image = OUTPUT.with_suffix(".hdr")
    command = [program, "-s", 1, "-a", "ppm", "-i", passes, "-o", image]

    def mean() -> float:
        pixels = np.frombuffer(image.read_bytes()[-4 * PIXELS :], np.uint8).reshape(-1, 4).astype(np.float64)
        # The format truncates mantissas: on average the value lies half a step higher.
        return float(((pixels[:, :3] + 0.5) * np.exp2(pixels[:, 3:] - 136.0)).mean())

    return process([*map(str, command)], mean)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smallvcm", type=Path, metavar="PATH", help="the program of SmallVCM (default: leave it out)")
    parser.add_argument("--passes", type=int, default=20, help="passes of the long renders (default: %(default)s)")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each renderer (default: %(default)s)")
    parser.add_argument(
        "--memory",
        type=int,
        nargs=2,
        default=[10, 1000],
        metavar=("FEW", "MANY"),
        help="passes after which peak memory is measured (default: 10 1000)",
    )
    etendue.add_program_option(parser)
    arguments = parser.parse_args()
    program = etendue.binary(arguments.etendue)
    runs: dict[str, Callable[[int, int], Run]] = {
        "etendue sppm": partial(measure_etendue, program, DEFAULTS),
        "etendue sppm, VCM radii": partial(measure_etendue, program, DEFAULTS | RADII),
    }
    if arguments.smallvcm:
        runs["SmallVCM ppm"] = partial(measure_smallvcm, arguments.smallvcm.resolve())
    spent: dict[str, list[float]] = {name: [] for name in runs}
    for seed in range(arguments.repeats):
        for name, run in runs.items():
            long, short = (run(passes, seed).seconds for passes in (arguments.passes + 1, 1))
            spent[name].append(long - short)
    few, many = arguments.memory
    print(f"{'':<26} {'passes':>7} {'passes/core-s':>14} {'M paths/core-s':>15} {'speedup':>8}", end="")
    print(f" {f'MB after {few}':>13} {f'MB after {many}':>14} {'mean radiance':>14}", flush=True)
    rates = {name: arguments.passes / statistics.median(values) for name, values in spent.items()}
    for name, rate in rates.items():
        against = f"{rate / rates['SmallVCM ppm']:.2f}x" if arguments.smallvcm else "-"
        print(f"{name:<26} {arguments.passes:>7} {rate:>14.3f} {2 * PIXELS * rate / 1e6:>15.3f} {against:>8}", end="", flush=True)
        after_few, after_many = (runs[name](passes, 0) for passes in (few, many))
        print(f" {after_few.peak:>13.1f} {after_many.peak:>14.1f} {after_many.radiance:>14.4f}", flush=True)


if __name__ == "__main__":
    main()
