#!/usr/bin/env python3
"""Render one image with Mitsuba and measure its cost, with the same scene files, options and header texts as `etendue render`.

The header contains the same texts as etendue's (spp, seed, integrator, sampler, parameters, scene_sha256), and also:

- `etendue.renderer`         mitsuba, its version and its variant
- `etendue.seconds`          wall time of the render alone, after a warm-up: nothing is loaded or compiled during this time
- `etendue.core_seconds`     CPU time (user + system, all threads) of the same render
- `etendue.warm_up_seconds`  wall time before that render: reading the scene, compiling kernels, a render to warm up
- `etendue.peak_bytes`       peak resident memory of the whole process, including Python and Mitsuba
- `etendue.stand_ins`        the stand-ins for the plugins that Mitsuba lacks

Light tracing (`ptracer`) runs on all threads like the other integrators, so the last bits of its images vary between runs.
Exit codes: 0 the image is written; 2 bad input; 130 interrupted.
"""

import argparse
import resource
import sys
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import etendue
import mitsuba_reference as ref
from compare_live import parse_parameters
from stand_ins import INTEGRATOR_PARAMETERS, Tree
from user_error import UserError, exit_code

# Seeds of Mitsuba are 32-bit.
MAX_SEED = 2**32 - 1
# The integrators that share INTEGRATOR_PARAMETERS.
WITH_PATH_LIMITS = ("path", "volpath", "volpathmis", "ptracer", "photonmapper", "sppm")


@dataclass(frozen=True)
class Run:
    """The input of one render. `params` are parameters of the integrator, `defines` are $parameters of the scene."""

    scene: Path
    output: Path
    spp: int
    seed: int
    integrator: str | None
    sampler: str
    params: dict[str, str]
    defines: dict[str, str]


@dataclass(frozen=True)
class Measured:
    """An image (H, W, 3) and its cost; the docstring of this file explains the times."""

    pixels: Any
    seconds: float
    core_seconds: float
    warm_up_seconds: float


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="a scene file")
    parser.add_argument("-o", dest="output", type=Path, required=True, metavar="OUT.exr", help="the image to write")
    parser.add_argument("--spp", type=int, required=True, metavar="N", help="samples per pixel")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed (default: %(default)s)")
    parser.add_argument("--integrator", metavar="NAME", help="replace the scene's integrator; path limits and hide_emitters stay")
    parser.add_argument("--sampler", default="independent", metavar="NAME", help="sampler of the render (default: %(default)s)")
    parser.add_argument("--param", action="append", default=[], metavar="NAME=VALUE", help="set a parameter of the integrator")
    parser.add_argument("-D", dest="define", action="append", default=[], metavar="NAME=VALUE", help="set a scene parameter")
    parser.add_argument("--variant", metavar="NAME", help="variant of Mitsuba (default: llvm_ad_rgb, or scalar_rgb without LLVM)")
    parser.add_argument("--threads", type=int, metavar="N", help="number of threads (default: one per core)")
    return parser.parse_args()


def typed(text: str) -> bool | int | float | str:
    """The value of a parameter: a boolean, an integer or a float if its text is one, else the text."""
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def change_scene(mi: Any, state: Any, run: Run) -> None:
    """Give a parsed scene the sampler, integrator and parameters of a run; path limits and hide_emitters are kept."""
    tree, name = Tree(mi, state), run.integrator
    for node in tree.every("Sampler"):
        tree.props(node).set_plugin_name(run.sampler)
    # The child of the scene is the outer integrator; it may contain others.
    found = [node for _, node in tree.children(0, "Integrator")]
    if not found:
        raise UserError("the scene has no integrator")
    props = tree.props(found[0])
    if name and name != props.plugin_name():
        kept = INTEGRATOR_PARAMETERS if {name, props.plugin_name()} <= set(WITH_PATH_LIMITS) else ()
        for other in [other for other in props if other not in kept]:
            del props[other]
        props.set_plugin_name(name)
    for param, value in run.params.items():
        props[param] = typed(value)


def warm_up_samples(spp: int) -> int:
    """The smallest number of samples that compiles the same kernels as `spp`.

    Mitsuba compiles separate kernels for fewer than four samples, and for powers of two.
    """
    return min(spp, 4 if spp.bit_count() == 1 else 5)


def render(renderer: ref.Renderer, loaded: Any, spp: int, seed: int, since: float) -> Measured:
    """Render after a warm-up that compiles the kernels; render again if a kernel was still missing. `since` is the start time."""
    import drjit
    import numpy as np

    def once(samples: int) -> tuple[Any, bool, float, float]:
        drjit.kernel_history_clear()
        wall, cpu = time.perf_counter(), time.process_time()
        pixels = np.array(renderer.mi.render(loaded, spp=samples, seed=seed), dtype=np.float32)[..., :3]
        taken = time.perf_counter() - wall, time.process_time() - cpu
        kernels = [kernel for kernel in drjit.kernel_history() if "cache_hit" in kernel]
        return pixels, all(kernel["cache_hit"] and not kernel["cache_disk"] for kernel in kernels), *taken

    drjit.set_flag(drjit.JitFlag.KernelHistory, True)
    if not renderer.variant.startswith("scalar"):
        once(warm_up_samples(spp))
    warm_up = time.perf_counter() - since
    pixels, warm, seconds, core_seconds = once(spp)
    if not warm:
        # The kernels of some integrators, such as ptracer, depend on the number of samples.
        warm_up = time.perf_counter() - since
        pixels, _, seconds, core_seconds = once(spp)
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise UserError("the film does not have three colour channels; set pixel_format to rgb")
    return Measured(pixels, seconds, core_seconds, warm_up)


def make(run: Run, variant: str | None = None, threads: int | None = None) -> None:
    """Render, measure and write one image. Raises UserError for bad input."""
    since = time.perf_counter()
    if run.spp < 1 or not 0 <= run.seed <= MAX_SEED:
        raise UserError(f"spp must be at least 1 and the seed within 0 .. {MAX_SEED}")
    scene_hash = ref.scene_hash(run.scene, run.defines)
    renderer = ref.start_mitsuba(variant)
    if threads:
        import drjit

        drjit.set_thread_count(threads)
    try:
        loaded, used = ref.load_with_stand_ins(renderer, run.scene, run.defines, partial(change_scene, renderer.mi, run=run))
        measured = render(renderer, loaded, run.spp, run.seed, since)
        # Some samplers round the number of samples up.
        if (taken := loaded.sensors()[0].sampler().sample_count()) != run.spp:
            raise UserError(f"{run.scene}: Mitsuba's {run.sampler} takes {taken} samples per pixel instead of {run.spp}")
    except RuntimeError as error:
        raise UserError(f"{run.scene}: Mitsuba: {' '.join(str(error).split())}") from error
    attributes = {
        "etendue.renderer": f"mitsuba {renderer.mi.__version__} {renderer.variant}",
        "etendue.scene": str(run.scene),
        "etendue.scene_sha256": scene_hash,
        "etendue.integrator": run.integrator or ref.integrator_name(run.scene, run.defines),
        "etendue.parameters": " ".join(f"{name}={value}" for name, value in [*run.params.items(), *run.defines.items()]),
        "etendue.sampler": run.sampler,
        "etendue.spp": str(run.spp),
        "etendue.seed": str(run.seed),
        "etendue.seconds": f"{measured.seconds:.3f}",
        "etendue.core_seconds": f"{measured.core_seconds:.3f}",
        "etendue.warm_up_seconds": f"{measured.warm_up_seconds:.3f}",
        "etendue.peak_bytes": str(peak_bytes()),
        **({"etendue.stand_ins": "; ".join(used)} if used else {}),
    }
    film = loaded.sensors()[0].film()
    crop, size = (tuple(int(x) for x in pair) for pair in (film.crop_offset(), film.size()))
    etendue.write_image(run.output, etendue.Image({"": measured.pixels}, {"": ("R", "G", "B")}, attributes, crop, size))


def peak_bytes() -> int:
    """The peak resident memory of this process."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # ru_maxrss is in kilobytes, on macOS in bytes.
    return peak if sys.platform == "darwin" else 1024 * peak


def work(arguments: argparse.Namespace) -> int:
    params, defines = parse_parameters(arguments.param), parse_parameters(arguments.define)
    given = arguments.scene, arguments.output, arguments.spp, arguments.seed, arguments.integrator, arguments.sampler
    make(Run(*given, params, defines), arguments.variant, arguments.threads)
    return 0


def main() -> int:
    arguments = parse_arguments()
    return exit_code(lambda: work(arguments))


if __name__ == "__main__":
    sys.exit(main())
