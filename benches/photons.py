#!/usr/bin/env python3
"""Compare etendue's light tracing and photon mapping with Mitsuba in the same run, each on one thread.

The script measures three things:

- light paths per core-second of the `ptracer` of both renderers
- photons per core-second of etendue's `photonmapper`, emitted and stored
- core-seconds until the floor around the caustic of an area light has an error of about 1 %. The error is the root mean square
  error of the 8 x 8 tiles in which only the floor is visible, relative to their mean

A photon map is biased, so its error is measured at fixed settings. The other estimators are unbiased: their squared error is
inversely proportional to time, so the time to the same error follows from shorter renders. The ground truth is a long render
with etendue's `ptracer`; its own error is printed and subtracted.

Core-seconds are the user CPU time of the render alone, without the time to load the scene. For etendue this is the difference
between a long and a short render. For Mitsuba it is the second render in a process, whose kernels are already compiled. The time
of photons is the difference between a render with many photons and one with few. The script reports medians of several runs.
"""

import argparse
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "scripts"))

import etendue
import mitsuba_reference as ref

SCENES = ["caustic-point", "cbox-glass"]
FLOOR = "caustic-area"
PIXELS = 256 * 256
OUTPUT = Path(tempfile.gettempdir()) / "etendue-photons.exr"
# Direct light is sampled, and the maps hold all other light. The photon counts and radii give an error of about 1 %.
MAPPED_SPP = 12
MAPPED = {
    "indirect": "map",
    "lookup_size": "0",
    "global_photons": "30000",
    "global_lookup_radius": "0.5",
    "caustic_photons": "600000",
    "caustic_lookup_radius": "0.02",
}

Image = NDArray[np.float64]


def render(program: Path, scene: Path, integrator: str, spp: int, seed: int = 0, **parameters: str) -> tuple[float, str]:
    """Render with etendue; returns the user seconds of the process and its stderr."""
    command = [program, "render", scene, "-o", OUTPUT, "--integrator", integrator, "--spp", spp, "--seed", seed, "--threads", 1]
    command += [word for name, value in parameters.items() for word in ("--param", f"{name}={value}")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    stderr = subprocess.run([*map(str, command)], check=True, capture_output=True, text=True).stderr
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, stderr


def rendered_image(*channels: str) -> Image:
    """The named channels of the image that etendue rendered last."""
    with OpenEXR.File(str(OUTPUT), separate_channels=True) as file:
        return np.stack([file.channels()[name].pixels.astype(np.float64) for name in channels], axis=-1)


class Mitsuba:
    """Mitsuba on one thread."""

    def __init__(self) -> None:
        import drjit

        self.renderer = ref.start_mitsuba()
        drjit.set_thread_count(1)

    def load(self, scene: Path, integrator: str) -> Any:
        loaded = self.renderer.mi.load_file(str(scene), integrator=integrator)
        self.render(loaded, 1, 0)
        return loaded

    def render(self, loaded: Any, spp: int, seed: int) -> tuple[float, Image]:
        """Render a loaded scene; returns user seconds and the image."""
        before = os.times().user
        image = np.array(self.renderer.mi.render(loaded, spp=spp, seed=seed), dtype=np.float64)
        return os.times().user - before, image[..., :3]

    def floor(self, scene: Path) -> NDArray[np.bool_]:
        """The tiles in which every one of 64 samples of every pixel shows the floor, recognized by its albedo."""
        albedo = self.renderer.mi.load_dict({"type": "aov", "aovs": "albedo:albedo"})
        loaded = self.renderer.mi.load_file(str(scene))
        seen = np.array(self.renderer.mi.render(loaded, integrator=albedo, spp=64, seed=0))[..., -3:]
        return tiles(np.abs(seen - 0.5).max(axis=-1, keepdims=True) < 1e-3)[..., 0] == 1.0


def tiles(image: NDArray[Any]) -> Image:
    """The mean of each tile of 8 x 8 pixels."""
    height, width, channels = image.shape
    return image.reshape(height // ref.TILE, ref.TILE, width // ref.TILE, ref.TILE, channels).mean(axis=(1, 3), dtype=np.float64)


# --- rates ---------------------------------------------------------------------------------------------------------------


def light_paths(program: Path, mitsuba: Mitsuba, spp: int, repeats: int) -> None:
    """Print light paths per core-second."""
    print(f"{'scene':<14} {'integrator':<22} {'M paths/core-s':>15} {'speedup':>9}")
    for name in SCENES:
        scene = HERE / "scenes" / f"{name}.xml"
        loaded = mitsuba.load(scene, "ptracer")
        times: dict[str, list[float]] = {"etendue": [], mitsuba.renderer.variant: []}
        for seed in range(repeats):
            long, short = (render(program, scene, "ptracer", samples, seed)[0] for samples in (spp + 1, 1))
            times["etendue"].append(long - short)
            times[mitsuba.renderer.variant].append(mitsuba.render(loaded, spp, seed + 1)[0])
        rates = {key: PIXELS * spp / statistics.median(values) / 1e6 for key, values in times.items()}
        for key, rate in rates.items():
            print(f"{name:<14} {'ptracer ' + key:<22} {rate:>15.2f} {rates['etendue'] / rate:>8.2f}x", flush=True)


def photons(program: Path, count: int, repeats: int) -> None:
    """Print photons per core-second; the time includes building the tree."""
    print(f"\n{'scene':<14} {'map':<22} {'M emitted/core-s':>17} {'M stored/core-s':>16}")
    for name in SCENES:
        for kind, other in (("global", "caustic"), ("caustic", "global")):
            spent, stored = [], []
            for seed in range(repeats):
                few, many = (
                    render(
                        program,
                        HERE / "scenes" / f"{name}.xml",
                        "photonmapper",
                        1,
                        seed,
                        **{f"{kind}_photons": str(emitted), f"{other}_photons": "1", "direct": "map", "indirect": "map"},
                    )
                    for emitted in (count, 3 * count)
                )
                spent.append(many[0] - few[0])
                stored.append(stored_photons(many[1], kind) - stored_photons(few[1], kind))
            seconds = statistics.median(spent)
            rates = (2 * count / seconds / 1e6, statistics.median(stored) / seconds / 1e6)
            print(f"{name:<14} {kind:<22} {rates[0]:>17.2f} {rates[1]:>16.2f}", flush=True)


def stored_photons(stderr: str, kind: str) -> int:
    match = re.search(rf"^{kind} map: (\d+) photons of \d+ emitted", stderr, re.MULTILINE)
    if match is None:
        raise SystemExit(f"photons.py: etendue did not report its {kind} map:\n{stderr}")
    return int(match[1])


# --- time to an error ----------------------------------------------------------------------------------------------------


def time_to_error(program: Path, mitsuba: Mitsuba, truth_spp: int, repeats: int) -> None:
    """Print the core-seconds after which each integrator has the error of the photon map on the floor."""
    scene = HERE / "scenes" / f"{FLOOR}.xml"
    floor = mitsuba.floor(scene)
    render(program, scene, "ptracer", truth_spp, 1_000_000)
    truth = tiles(rendered_image("R", "G", "B"))[floor]
    variance = tiles(rendered_image("variance.R", "variance.G", "variance.B"))[floor].mean() / ref.TILE**2
    own = float(np.sqrt(variance) / truth.mean())
    print(f"\n{FLOOR}: {floor.sum()} tiles of floor; relative error of the ground truth: {100 * own:.2f} %")

    def error(image: Image) -> float:
        """The mean squared error relative to the squared mean, minus the squared error of the ground truth."""
        return float(((tiles(image)[floor] - truth) ** 2).mean() / truth.mean() ** 2) - own**2

    def ours(integrator: str, spp: int, **parameters: str) -> Callable[[int], tuple[float, float]]:
        def run(seed: int) -> tuple[float, float]:
            seconds, _ = render(program, scene, integrator, spp, seed, **parameters)
            return seconds, error(rendered_image("R", "G", "B"))

        return run

    def theirs(integrator: str, spp: int) -> Callable[[int], tuple[float, float]]:
        loaded = mitsuba.load(scene, integrator)

        def run(seed: int) -> tuple[float, float]:
            seconds, image = mitsuba.render(loaded, spp, seed + 1)
            return seconds, error(image)

        return run

    variant = mitsuba.renderer.variant
    runs = {
        "photonmapper etendue": ours("photonmapper", MAPPED_SPP, **MAPPED),
        "ptracer etendue": ours("ptracer", 16),
        "path etendue": ours("path", 16),
        f"ptracer {variant}": theirs("ptracer", 16),
        f"path {variant}": theirs("path", 16),
    }
    print(f"{'integrator':<22} {'core-s':>9} {'RMSE':>9} {'to same RMSE':>13} {'speedup':>9}")
    goal = None
    for name, run in runs.items():
        found = [run(seed) for seed in range(repeats)]
        seconds = statistics.median(s for s, _ in found)
        # Fireflies are rare but large: the mean of the squared errors shows them, their median does not.
        square = statistics.fmean(e for _, e in found)
        goal = goal or (seconds, square)
        needed = seconds * square / goal[1]
        print(f"{name:<22} {seconds:>9.2f} {100 * np.sqrt(square):>8.2f}% {needed:>13.2f} {needed / goal[0]:>8.2f}x", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spp", type=int, default=64, help="light paths per pixel (default: %(default)s)")
    parser.add_argument("--photons", type=int, default=1_000_000, help="photons of the smaller of two maps (default: %(default)s)")
    truth = "samples per pixel of the ground truth (default: %(default)s)"
    parser.add_argument("--truth", type=int, default=2048, metavar="SPP", help=truth)
    parser.add_argument("--repeats", type=int, default=5, help="runs of each renderer (default: %(default)s)")
    etendue.add_program_option(parser)
    arguments = parser.parse_args()
    program, mitsuba = etendue.binary(arguments.etendue), Mitsuba()
    light_paths(program, mitsuba, arguments.spp, arguments.repeats)
    photons(program, arguments.photons, arguments.repeats)
    time_to_error(program, mitsuba, arguments.truth, arguments.repeats)


if __name__ == "__main__":
    main()
