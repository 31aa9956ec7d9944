#!/usr/bin/env python3
"""Render one scene with Mitsuba and with etendue now, and pass on the verdict of `etendue compare`.

Exit codes: 0 they agree; 1 they do not, or there are too few samples to tell; 2 bad input.
"""

import argparse
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import mitsuba_reference as ref


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="a scene file")
    parser.add_argument("-D", dest="parameters", action="append", default=[], metavar="NAME=VALUE", help="set a parameter")
    parser.add_argument("--spp", type=int, default=ref.SAMPLES_PER_BATCH, help="Mitsuba: samples a batch (default: %(default)s)")
    parser.add_argument("--batches", type=int, default=ref.BATCHES, help="Mitsuba: independent batches (default: %(default)s)")
    parser.add_argument("--test-spp", type=int, help="etendue: samples per pixel (default: the product of the two above)")
    parser.add_argument("--test-seed", type=int, default=0, help="etendue: seed (default: %(default)s)")
    parser.add_argument("--integrator", help="etendue: use this integrator instead of the scene's")
    parser.add_argument("--threads", type=int, help="etendue: threads (default: its own)")
    parser.add_argument("--etendue", type=Path, default=ref.ROOT / "target" / "release" / "etendue", help="the etendue binary")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="keep both results here (default: a temporary folder)")
    parser.add_argument("--json", action="store_true", help="print the verdict as JSON")
    return parser.parse_args()


def parse_parameters(definitions: list[str]) -> dict[str, str]:
    """Turn NAME=VALUE strings into a dictionary."""
    parameters = {}
    for definition in definitions:
        name, equals, value = definition.partition("=")
        if not (name and equals):
            raise ref.UserError(f"-D {definition}: expected NAME=VALUE")
        parameters[name] = value
    return parameters


def render_command(arguments: argparse.Namespace, image: Path) -> list[str]:
    """The call of `etendue render` that makes `image`."""
    samples = arguments.test_spp or arguments.spp * arguments.batches
    command = [str(arguments.etendue.resolve()), "render", str(arguments.scene), "-o", str(image)]
    command += [word for definition in arguments.parameters for word in ("-D", definition)]
    command += ["--spp", str(samples), "--seed", str(arguments.test_seed)]
    if arguments.integrator:
        command += ["--integrator", arguments.integrator]
    if arguments.threads:
        command += ["--threads", str(arguments.threads)]
    return command


def run(command: list[str]) -> int:
    """Run one command, its output passed on to stderr and stdout as it comes; returns its exit code."""
    print(shlex.join(command), file=sys.stderr, flush=True)
    try:
        return subprocess.run(command, check=False).returncode
    except OSError as error:
        raise ref.UserError(f"cannot run {command[0]}: {error.strerror}") from error


def compare(arguments: argparse.Namespace, folder: Path) -> int:
    """Make both images in `folder` and return the exit code of the comparison."""
    parameters = parse_parameters(arguments.parameters)
    if not arguments.etendue.is_file():
        raise ref.UserError(f"no etendue binary at {arguments.etendue}; build it with `cargo build --release`")
    command = shlex.join(["python", "scripts/compare_live.py", *sys.argv[1:]])
    ref.make_reference(ref.start_mitsuba(), arguments.scene, folder, command, arguments.spp, arguments.batches, parameters)
    image = folder / "etendue.exr"
    if run(render_command(arguments, image)) != 0:
        raise ref.UserError(f"etendue could not render {arguments.scene}")
    verdict = run([str(arguments.etendue.resolve()), "compare", str(image), str(folder)] + ["--json"] * arguments.json)
    if verdict not in (0, 1):
        raise ref.UserError(f"etendue compare ended with exit code {verdict}")
    return verdict


def main() -> int:
    arguments = parse_arguments()
    try:
        if arguments.out:
            return compare(arguments, arguments.out)
        with tempfile.TemporaryDirectory(prefix="etendue-live-") as folder:
            return compare(arguments, Path(folder))
    except ref.UserError as error:
        print(f"compare_live.py: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
