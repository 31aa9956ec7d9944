#!/usr/bin/env python3
"""Measure how many paths per core-second etendue and Mitsuba trace on the same scenes, and how busy they keep the cores.

The renderers take turns on each scene, several times, and the script reports medians. Core-seconds are the user CPU time of the
render alone, without the time to load the scene. For etendue this is the difference between a long and a short render. For
Mitsuba it is the second render in a process.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

HERE = Path(__file__).resolve().parent
SCRIPTS = HERE.parent / "scripts"
sys.path.insert(0, str(SCRIPTS))

import etendue

SCENES = ["cbox", "cbox-glass", "mesh", "dof"]
PIXELS = 256 * 256
SHORT_SPP = 1
OUTPUT = Path(tempfile.gettempdir()) / "etendue-bench.exr"

MITSUBA = """
import json, os, sys, time
scripts, variant, path, spp, threads = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5])
sys.path.insert(0, scripts)
import mitsuba_reference
mi = mitsuba_reference.start_mitsuba(variant).mi
import drjit as dr
import numpy as np
dr.set_thread_count(threads)
scene = mi.load_file(path)
np.array(mi.render(scene, spp=spp, seed=0))
before, start = os.times(), time.perf_counter()
np.array(mi.render(scene, spp=spp, seed=1))
after = os.times()
print(json.dumps([after.user - before.user, time.perf_counter() - start]))
"""


def measure_process(program: Path, scene: Path, spp: int, threads: int) -> tuple[float, float]:
    """User and wall-clock seconds of one process of etendue."""
    command = [program, "render", scene, "-o", OUTPUT, "--spp", str(spp), "--quiet"]
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime, time.perf_counter()
    subprocess.run([*map(str, command), "--threads", str(threads)], check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, time.perf_counter() - start


def measure_etendue(program: Path, scene: Path, spp: int, threads: int) -> tuple[float, float]:
    """User and wall-clock seconds of rendering alone."""
    long, short = (measure_process(program, scene, n, threads) for n in (spp + SHORT_SPP, SHORT_SPP))
    return long[0] - short[0], long[1] - short[1]


def measure_mitsuba(variant: str, scene: Path, spp: int, threads: int) -> tuple[float, float]:
    """User and wall-clock seconds of the second render in a process, whose kernels are already compiled."""
    command = [sys.executable, "-c", MITSUBA, str(SCRIPTS), variant, str(scene), str(spp), str(threads)]
    user, wall = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1])
    return user, wall


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES, help="names of scenes in benches/scenes (default: %(default)s)")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel (default: %(default)s)")
    parser.add_argument("--repeats", type=int, default=3, help="renders of each scene by each renderer (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="number of threads (default: one per core)")
    parser.add_argument("--variants", nargs="*", default=["llvm_ad_rgb", "scalar_rgb"], help="variants of Mitsuba (default: %(default)s)")
    etendue.add_program_option(parser)
    arguments = parser.parse_args()
    program = etendue.binary(arguments.etendue)
    print(f"{'scene':<12} {'renderer':<14} {'M paths/core-s':>15} {'cores busy':>11} {'etendue is':>12}")
    for name in arguments.scenes:
        scene = HERE / "scenes" / f"{name}.xml"
        runs = {"etendue": partial(measure_etendue, program, scene, arguments.spp, arguments.threads)}
        for variant in arguments.variants:
            runs[variant] = partial(measure_mitsuba, variant, scene, arguments.spp, arguments.threads)
        times = {key: [] for key in runs}
        for _ in range(arguments.repeats):
            for key, run in runs.items():
                times[key].append(run())
        rates = {key: PIXELS * arguments.spp / statistics.median(t[0] for t in values) / 1e6 for key, values in times.items()}
        for key, values in times.items():
            busy = statistics.median(user / wall / arguments.threads for user, wall in values)
            print(f"{name:<12} {key:<14} {rates[key]:>15.2f} {100 * busy:>10.0f}% {rates['etendue'] / rates[key]:>11.2f}x")


if __name__ == "__main__":
    main()
