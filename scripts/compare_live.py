#!/usr/bin/env python3
"""Render one scene with Mitsuba and with etendue, and compare the two images with `etendue compare`.

etendue checks the scene before Mitsuba renders it, so a mistake in the scene is reported at once.

Exit codes: 0 the images agree; 1 they do not agree, or there are too few samples to decide; 2 bad input; 130
interrupted.
"""

import argparse
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import etendue
import mitsuba_reference as ref
from user_error import UserError, exit_code


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="a scene file")
    parser.add_argument("-D", dest="parameters", action="append", default=[], metavar="NAME=VALUE", help="set a scene parameter")
    parser.add_argument(
        "--spp", type=int, default=ref.SAMPLES_PER_BATCH, help="Mitsuba: samples per pixel in each batch (default: %(default)s)"
    )
    parser.add_argument("--batches", type=int, default=ref.BATCHES, help="Mitsuba: independent batches (default: %(default)s)")
    parser.add_argument("--test-spp", type=int, help="etendue: samples per pixel (default: --spp times --batches)")
    parser.add_argument("--test-seed", type=int, default=0, help="etendue: seed (default: %(default)s)")
    parser.add_argument("--integrator", help="etendue: replace the scene's integrator")
    parser.add_argument("--threads", type=int, help="etendue: number of threads (default: one per core)")
    etendue.add_program_option(parser)
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="keep both images in this folder (default: keep neither)")
    parser.add_argument("--json", action="store_true", help="print the verdict as JSON")
    return parser.parse_args()


def parse_parameters(definitions: list[str]) -> dict[str, str]:
    """Turn NAME=VALUE strings into a dictionary."""
    parameters = {}
    for definition in definitions:
        name, equals, value = definition.partition("=")
        if not (name and equals):
            raise UserError(f"-D {definition}: expected NAME=VALUE")
        parameters[name] = value
    return parameters


def render_command(program: Path, arguments: argparse.Namespace, output: list[str]) -> list[str]:
    """The call of `etendue render`; `output` are the options that select its output."""
    samples = arguments.test_spp or arguments.spp * arguments.batches
    command = [str(program), "render", str(arguments.scene), *output]
    command += [word for definition in arguments.parameters for word in ("-D", definition)]
    command += ["--spp", str(samples), "--seed", str(arguments.test_seed)]
    if arguments.integrator:
        command += ["--integrator", arguments.integrator]
    if arguments.threads:
        command += ["--threads", str(arguments.threads)]
    return command


def check_scene(program: Path, arguments: argparse.Namespace) -> None:
    """Evaluate one sample of one pixel; raises UserError if etendue refuses the scene or the options."""
    etendue.run_command(render_command(program, arguments, ["--replay", "0,0,0"]))


def run(command: list[str]) -> int:
    """Run one command whose output goes to our stdout and stderr; returns its exit code."""
    print(shlex.join(command), file=sys.stderr, flush=True)
    try:
        return subprocess.run(command, check=False).returncode
    except OSError as error:
        raise UserError(f"cannot run {command[0]}: {error.strerror}") from error


def compare(arguments: argparse.Namespace, folder: Path) -> int:
    """Make both images in `folder` and return the exit code of the comparison."""
    parameters = parse_parameters(arguments.parameters)
    program = etendue.binary(arguments.etendue)
    check_scene(program, arguments)
    command = shlex.join(["python", "scripts/compare_live.py", *sys.argv[1:]])
    ref.make_reference(ref.start_mitsuba(), arguments.scene, folder, command, arguments.spp, arguments.batches, parameters)
    image = folder / "etendue.exr"
    if run(render_command(program, arguments, ["-o", str(image)])) != 0:
        raise UserError(f"etendue could not render {arguments.scene}")
    verdict = run([str(program), "compare", str(image), str(folder)] + ["--json"] * arguments.json)
    if verdict not in (0, 1):
        raise UserError(f"etendue compare ended with exit code {verdict}")
    return verdict


def work(arguments: argparse.Namespace) -> int:
    if arguments.out:
        return compare(arguments, arguments.out)
    with tempfile.TemporaryDirectory(prefix="etendue-live-") as folder:
        return compare(arguments, Path(folder))


def main() -> int:
    arguments = parse_arguments()
    return exit_code(lambda: work(arguments))


if __name__ == "__main__":
    sys.exit(main())
