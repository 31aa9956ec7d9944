#!/usr/bin/env python3
"""Render the runs of a study whose renderer is Mitsuba, and evaluate the study, to compare Mitsuba's error with etendue's.

Each run is a separate process (mitsuba_run.py). Only one process runs at a time, so that others do not disturb its time and
memory. The time covers the render alone, after a warm-up; the header records the time before it as `etendue.warm_up_seconds`.
Existing runs are kept.

Exit codes: 0 all is well; 1 a prediction of the study does not hold; 2 bad input, or a run failed; 130 interrupted.
"""

import argparse
import sys
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import etendue
from user_error import UserError, exit_code

MITSUBA_RUN = Path(__file__).resolve().with_name("mitsuba_run.py")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="a study file")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="folder of the results (default: the folder of etendue study)")
    parser.add_argument("--only", default="*", metavar="GLOB", help="only cells whose names match (default: all)")
    parser.add_argument("--threads", type=int, metavar="N", help="number of threads of Mitsuba (default: one per core)")
    parser.add_argument("--no-evaluate", action="store_true", help="render the runs, and do not evaluate the study")
    return parser.parse_args()


def command(run: dict[str, Any], threads: int | None) -> list[str]:
    """The command that renders one run of the plan."""
    try:
        words = [run["scene"], "-o", run["output"], "--spp", str(run["spp"]), "--seed", str(run["seed"])]
        options = {f"--{name}": run[name] for name in ("integrator", "sampler", "variant")} | {"--threads": threads}
        named = {"--param": run["params"], "-D": run["defines"]}
    except KeyError as error:
        raise UserError(f"{run.get('cell')}: the plan lacks {error}") from error
    words += [word for name, value in options.items() if value for word in (name, str(value))]
    for option, values in named.items():
        words += [word for name, value in values.items() for word in (option, f"{name}={etendue.value_text(value)}")]
    return [sys.executable, str(MITSUBA_RUN), *words]


def make_runs(study: Path, out: Path | None, only: str, threads: int | None) -> int:
    """Render the missing runs and print the cost of each on a line; returns the number of runs that failed."""
    runs = [run for run in etendue.plan(study, out=out) if run["renderer"] == "mitsuba" and fnmatch(run["cell"], only)]
    failed = 0
    for run in runs:
        name = f"{run['cell']} seed {run['seed']}"
        try:
            etendue.run_command(command(run, threads))
        except etendue.EtendueError as error:
            failed += 1
            print(f"convergence.py: {name}: {str(error).removeprefix('mitsuba_run.py: ')}", file=sys.stderr, flush=True)
            continue
        found = etendue.read_image(run["output"]).attributes
        seconds, core = found["etendue.seconds"], found["etendue.core_seconds"]
        print(f"{name}: {found['etendue.renderer']}: {seconds} s, {core} core-s", flush=True)
    return failed


def work(arguments: argparse.Namespace) -> int:
    failed = make_runs(arguments.study, arguments.out, arguments.only, arguments.threads)
    found = etendue.Evaluation(True, "") if arguments.no_evaluate else etendue.evaluate(arguments.study, out=arguments.out)
    print(found.text, end="")
    return 2 if failed else 0 if found.holds else 1


def main() -> int:
    arguments = parse_arguments()
    return exit_code(lambda: work(arguments), "interrupted; run the same command to continue")


if __name__ == "__main__":
    sys.exit(main())
