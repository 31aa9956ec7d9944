#!/usr/bin/env python3
"""Light tracing and photon mapping of etendue, against Mitsuba in the same run, all on one thread.

First, light paths per core-second: `ptracer` of both; and photons of etendue's `photonmapper`, emitted and stored. Then
core-seconds until the floor around the caustic of an area light is known to about 1 %: the root mean square error of 8 x 8
tiles in which only the floor is seen, relative to their mean. A photon map is biased: its error is measured. Of unbiased
estimators, the time to that same error follows from shorter renders, since it goes with its inverse square. The truth is a
long render by etendue's `ptracer`, whose own error is printed and taken off.

Core-seconds are user CPU time of the render alone, without loading: for etendue, a long render less a short one, for
Mitsuba, a second render in one process, when everything is compiled. What photons take is that of more photons less that
of fewer. The medians of several runs count.
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

import mitsuba_reference as ref

SCENES = ["caustic-point", "cbox-glass"]
FLOOR = "caustic-area"
PIXELS = 256 * 256
OUTPUT = Path(tempfile.gettempdir()) / "etendue-photons.exr"
# Direct light is sampled, all else is in the maps; numbers and radii for an error of about 1 %.
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


def etendue(binary: Path, scene: Path, integrator: str, spp: int, seed: int = 0, **parameters: str) -> tuple[float, str]:
    """User seconds of one process, and what it said."""
    command = [binary, "render", scene, "-o", OUTPUT, "--integrator", integrator, "--spp", spp, "--seed", seed, "--threads", 1]
    command += [word for name, value in parameters.items() for word in ("--param", f"{name}={value}")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    said = subprocess.run([*map(str, command)], check=True, capture_output=True, text=True).stderr
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, said


def etendue_image(*channels: str) -> Image:
    """The named channels of the image that was rendered last."""
    with OpenEXR.File(str(OUTPUT), separate_channels=True) as file:
        return np.stack([file.channels()[name].pixels.astype(np.float64) for name in channels], axis=-1)


class Mitsuba:
    """Scenes of benches in Mitsuba on one thread."""

    def __init__(self) -> None:
        import drjit

        self.renderer = ref.start_mitsuba()
        drjit.set_thread_count(1)

    def load(self, scene: Path, integrator: str) -> Any:
        loaded = self.renderer.mi.load_file(str(scene), integrator=integrator)
        self.render(loaded, 1, 0)
        return loaded

    def render(self, loaded: Any, spp: int, seed: int) -> tuple[float, Image]:
        """User seconds and the image."""
        before = os.times().user
        image = np.array(self.renderer.mi.render(loaded, spp=spp, seed=seed), dtype=np.float64)
        return os.times().user - before, image[..., :3]

    def floor(self, scene: Path) -> NDArray[np.bool_]:
        """The tiles in which all 64 samples of every pixel see the floor, known by its albedo."""
        albedo = self.renderer.mi.load_dict({"type": "aov", "aovs": "albedo:albedo"})
        loaded = self.renderer.mi.load_file(str(scene))
        seen = np.array(self.renderer.mi.render(loaded, integrator=albedo, spp=64, seed=0))[..., -3:]
        return tiles(np.abs(seen - 0.5).max(axis=-1, keepdims=True) < 1e-3)[..., 0] == 1.0


def tiles(image: NDArray[Any]) -> Image:
    """Means of 8 x 8 pixels."""
    height, width, channels = image.shape
    return image.reshape(height // ref.TILE, ref.TILE, width // ref.TILE, ref.TILE, channels).mean(axis=(1, 3), dtype=np.float64)


# --- rates ---------------------------------------------------------------------------------------------------------------


def light_paths(binary: Path, mitsuba: Mitsuba, spp: int, repeats: int) -> None:
    """Print light paths per core-second."""
    print(f"{'scene':<14} {'integrator':<22} {'M paths/core-s':>15} {'against':>9}")
    for name in SCENES:
        scene = HERE / "scenes" / f"{name}.xml"
        loaded = mitsuba.load(scene, "ptracer")
        times: dict[str, list[float]] = {"etendue": [], mitsuba.renderer.variant: []}
        for seed in range(repeats):
            long, short = (etendue(binary, scene, "ptracer", samples, seed)[0] for samples in (spp + 1, 1))
            times["etendue"].append(long - short)
            times[mitsuba.renderer.variant].append(mitsuba.render(loaded, spp, seed + 1)[0])
        rates = {key: PIXELS * spp / statistics.median(values) / 1e6 for key, values in times.items()}
        for key, rate in rates.items():
            print(f"{name:<14} {'ptracer ' + key:<22} {rate:>15.2f} {rates['etendue'] / rate:>8.2f}x", flush=True)


def photons(binary: Path, count: int, repeats: int) -> None:
    """Print photons per core-second, in the tree included."""
    print(f"\n{'scene':<14} {'map':<22} {'M emitted/core-s':>17} {'M stored/core-s':>16}")
    for name in SCENES:
        for kind, other in (("global", "caustic"), ("caustic", "global")):
            spent, stored = [], []
            for seed in range(repeats):
                few, many = (
                    etendue(
                        binary,
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


def stored_photons(said: str, kind: str) -> int:
    match = re.search(rf"^{kind} map: (\d+) photons of \d+ emitted", said, re.MULTILINE)
    if match is None:
        raise SystemExit(f"photons.py: etendue says nothing of its {kind} map:\n{said}")
    return int(match[1])


# --- time to an error ----------------------------------------------------------------------------------------------------


def time_to_error(binary: Path, mitsuba: Mitsuba, truth_spp: int, repeats: int) -> None:
    """Print core-seconds until the floor is known as well as by the photon map."""
    scene = HERE / "scenes" / f"{FLOOR}.xml"
    floor = mitsuba.floor(scene)
    etendue(binary, scene, "ptracer", truth_spp, 1_000_000)
    truth = tiles(etendue_image("R", "G", "B"))[floor]
    variance = tiles(etendue_image("variance.R", "variance.G", "variance.B"))[floor].mean() / ref.TILE**2
    own = float(np.sqrt(variance) / truth.mean())
    print(f"\n{FLOOR}: {floor.sum()} tiles of floor; the truth is known to {100 * own:.2f} %")

    def error(image: Image) -> float:
        """Mean square error relative to the squared mean, less that of the truth."""
        return float(((tiles(image)[floor] - truth) ** 2).mean() / truth.mean() ** 2) - own**2

    def ours(integrator: str, spp: int, **parameters: str) -> Callable[[int], tuple[float, float]]:
        def run(seed: int) -> tuple[float, float]:
            seconds, _ = etendue(binary, scene, integrator, spp, seed, **parameters)
            return seconds, error(etendue_image("R", "G", "B"))

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
    print(f"{'integrator':<22} {'core-s':>9} {'RMSE':>9} {'to same RMSE':>13} {'against':>9}")
    goal = None
    for name, run in runs.items():
        found = [run(seed) for seed in range(repeats)]
        seconds = statistics.median(s for s, _ in found)
        # Fireflies are rare: the mean of the squares counts, not their median.
        square = statistics.fmean(e for _, e in found)
        goal = goal or (seconds, square)
        needed = seconds * square / goal[1]
        print(f"{name:<22} {seconds:>9.2f} {100 * np.sqrt(square):>8.2f}% {needed:>13.2f} {needed / goal[0]:>8.2f}x", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spp", type=int, default=64, help="light paths for each pixel (default: %(default)s)")
    parser.add_argument("--photons", type=int, default=1_000_000, help="photons of the smaller map (default: %(default)s)")
    parser.add_argument("--truth", type=int, default=2048, metavar="SPP", help="samples of the truth (default: %(default)s)")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--etendue", type=Path, default=HERE.parent / "target" / "release" / "etendue")
    arguments = parser.parse_args()
    mitsuba = Mitsuba()
    light_paths(arguments.etendue, mitsuba, arguments.spp, arguments.repeats)
    photons(arguments.etendue, arguments.photons, arguments.repeats)
    time_to_error(arguments.etendue, mitsuba, arguments.truth, arguments.repeats)


if __name__ == "__main__":
    main()
