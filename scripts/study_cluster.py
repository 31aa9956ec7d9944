#!/usr/bin/env python3
"""Render the runs of a study on many workers with Dask, and evaluate the study.

By default the workers are processes of this machine. `--scheduler` uses the workers of a running Dask scheduler; `--jobqueue`
starts workers as jobs of a batch system. The workers and this command share a file system, in which the study, its scenes, the
program and the results have the same absolute paths. `--shards N` splits each run into N tasks; their merged image equals the
image of a single run, bit for bit.

When a worker dies, only the time since the last checkpoint of its part is lost, and the image is the same. An interrupted study
continues when the same command is run again. See CLUSTER.md.

Exit codes: 0 all is well; 1 a prediction of the study does not hold; 2 bad input, or runs failed; 130 interrupted.
"""

import argparse
import logging
import os
import queue
import shutil
import signal
import sys
from collections.abc import Sequence
from concurrent.futures import CancelledError
from dataclasses import asdict
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import etendue
import study_parts
from study_parts import Part
from user_error import UserError, exit_code

try:
    import dask
    import distributed
except ModuleNotFoundError as error:
    print(f"{error}; run: pip install -r scripts/requirements.txt", file=sys.stderr)
    sys.exit(2)

SCRIPTS = str(Path(__file__).resolve().parent)

# Dask's usual port of the dashboard may belong to another scheduler on this machine, which Dask would warn of.
ANY_PORT = ":0"
# By batch system: the program that submits a job, and the class of dask_jobqueue that starts workers as jobs.
QUEUES = {"slurm": ("sbatch", "SLURMCluster"), "pbs": ("qsub", "PBSCluster"), "lsf": ("bsub", "LSFCluster")}


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="a study file")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="folder of the results (default: the folder of etendue study)")
    parser.add_argument("--only", default="*", metavar="GLOB", help="only cells whose names match (default: all)")
    parser.add_argument("--shards", type=positive, default=1, metavar="N", help="number of tasks per run (default: 1)")
    parser.add_argument("--threads", type=positive, metavar="N", help="threads of each task (default: the threads of its worker)")
    parser.add_argument(
        "--checkpoint-every", "--every", default="30s", metavar="TIME", help="time between checkpoints (default: %(default)s)"
    )
    parser.add_argument("--retries", type=positive, default=10, metavar="N", help="retries if workers die (default: 10)")
    parser.add_argument("--no-evaluate", action="store_true", help="render the runs, and do not evaluate the study")
    where = parser.add_argument_group("workers").add_mutually_exclusive_group()
    where.add_argument("--workers", type=positive, metavar="N", help="worker processes of this machine (default: one per core)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="use a running scheduler, such as tcp://host:8786")
    where.add_argument("--jobqueue", choices=sorted(QUEUES), help="start workers as jobs of this batch system")
    jobs = parser.add_argument_group("jobs of --jobqueue, one worker each")
    jobs.add_argument("--jobs", type=positive, default=4, metavar="N", help="number of jobs (default: %(default)s)")
    jobs.add_argument("--cores", type=positive, default=1, metavar="N", help="cores of a job (default: %(default)s)")
    jobs.add_argument("--memory", default="4GB", help="memory of a job (default: %(default)s)")
    jobs.add_argument("--walltime", help="time limit of a job in the format of the batch system; a job that ends is replaced")
    jobs.add_argument("--queue", help="queue or partition")
    jobs.add_argument("--account", help="account or project")
    jobs.add_argument("--directive", action="append", default=[], metavar="TEXT", help="a line for the head of a job")
    jobs.add_argument("--prologue", action="append", default=[], metavar="LINE", help="a command for the start of a job")
    return parser.parse_args()


def positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive integer")
    return int(text)


# --- workers -----------------------------------------------------------------------------------------------------------


def connect(arguments: argparse.Namespace) -> tuple[distributed.Client, Any]:
    """The client, and the cluster to close after it; None instead of the cluster if this command did not start it."""
    # Jobs end at their time limit, so the death of a worker is not a fault of its part: it counts as one of the retries.
    dask.config.set({"distributed.scheduler.allowed-failures": arguments.retries})
    for noisy in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(noisy).setLevel(logging.CRITICAL)
    cluster = None
    try:
        if arguments.scheduler is None:
            cluster = local_cluster(arguments) if arguments.jobqueue is None else batch_cluster(arguments)
        return distributed.Client(cluster or arguments.scheduler), cluster
    except (OSError, ValueError, RuntimeError) as error:
        if cluster:
            cluster.close()
        where = arguments.scheduler or arguments.jobqueue or "this machine"
        raise UserError(f"{where}: no Dask scheduler there: {' '.join(str(error).split()) or type(error).__name__}") from error


def local_cluster(arguments: argparse.Namespace) -> distributed.LocalCluster:
    options = {
        "n_workers": workers(arguments),
        "threads_per_worker": 1,
        # The memory is used by a child process of the worker, which Dask does not measure.
        "memory_limit": 0,
        # A terminal sends SIGINT to all of its processes. Workers ignore it; this process ends them.
        "preload": ["import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"],
        "dashboard_address": ANY_PORT,
        "silence_logs": logging.CRITICAL,
    }
    return distributed.LocalCluster(**options)


def workers(arguments: argparse.Namespace) -> int:
    return arguments.workers or max(1, cores() // (arguments.threads or 1))


def cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def batch_cluster(arguments: argparse.Namespace) -> Any:
    import dask_jobqueue

    program, kind = QUEUES[arguments.jobqueue]
    if shutil.which(program) is None:
        raise UserError(f"{arguments.jobqueue}: {program} was not found; run this script on a machine that submits jobs")
    options = {
        "queue": arguments.queue,
        "account": arguments.account,
        "cores": arguments.cores,
        "processes": 1,
        "scheduler_options": {"dashboard_address": ANY_PORT},
        "memory": arguments.memory,
        "walltime": arguments.walltime,
        "job_extra_directives": arguments.directive,
        "job_script_prologue": arguments.prologue,
        # Each worker renders one part at a time with all threads of its job. The last --nthreads takes effect.
        "worker_extra_args": ["--nthreads", "1", "--memory-limit", "0"],
    }
    if arguments.jobqueue == "lsf":
        options["project"] = options.pop("account")
    submitted: queue.Queue[Exception | None] = queue.Queue()
    base = getattr(dask_jobqueue, kind)
    cls = type(kind, (base,), {"job_cls": reporting(base.job_cls, submitted)})
    cluster = cls(**{name: value for name, value in options.items() if value is not None})
    # Unlike a fixed number, this replaces jobs that end.
    cluster.adapt(minimum_jobs=arguments.jobs, maximum_jobs=arguments.jobs)
    # If the batch system refuses the first job, it would refuse every replacement too.
    if error := submitted.get():
        cluster.close()
        raise UserError(f"{arguments.jobqueue}: the job was refused: {' '.join(str(error).split())}")
    return cluster


def reporting(base: type, submitted: queue.Queue[Exception | None]) -> type:
    """A subclass of the job class `base` that puts the error of each submission into a queue, or None if it succeeded."""

    class Job(base):
        async def start(self) -> None:
            try:
                await super().start()
            except Exception as error:
                self.status = distributed.Status.failed
                submitted.put(error)
                raise
            submitted.put(None)

    return Job


def threads(arguments: argparse.Namespace) -> int:
    """The threads of a task: the cores of its job, an equal share of this machine, or 1 for workers of another scheduler."""
    if arguments.threads or arguments.scheduler:
        return arguments.threads or 1
    return arguments.cores if arguments.jobqueue else max(1, cores() // workers(arguments))


# --- the work ----------------------------------------------------------------------------------------------------------


def missing_runs(study: Path, out: Path | None, only: str) -> list[dict[str, Any]]:
    """The missing runs of etendue; prints the number of missing runs of Mitsuba."""
    runs = [run for run in etendue.plan(study, out=out) if fnmatch(run["cell"], only)]
    left = sum(run["renderer"] == "mitsuba" for run in runs)
    if left:
        print(f"{left} runs of Mitsuba are missing; scripts/convergence.py renders them", flush=True)
    # The largest runs start first, so that no worker is left with one at the end.
    return sorted((run for run in runs if run["renderer"] != "mitsuba"), key=lambda run: -float(run["x"]))


def make_part(scripts: str, part: dict[str, Any]) -> dict[str, Any]:
    """Render one `Part` on a worker.

    Dask sends functions of the main program by value, so this one can import our modules from `scripts` on the worker.
    """
    if scripts not in sys.path:
        sys.path.insert(0, scripts)
    import study_parts

    return asdict(study_parts.make(study_parts.Part(**part)))


def make_runs(client: distributed.Client, runs: Sequence[Sequence[Part]], retries: int) -> list[str]:
    """Render all parts, and merge each run as soon as its parts are complete; returns the faults, one line each.

    If a part is refused, its run is rendered whole: the samples of some integrators depend on those before.
    """

    def submit(part: Part) -> distributed.Future:
        # Equal keys are equal work. Keys that begin with the same word form one group, whose tasks Dask assigns one by one.
        key = ("part", part.name, part.folder)
        return client.submit(make_part, SCRIPTS, asdict(part), key=key, retries=retries, pure=False)

    parts_of, faults = {parts[0].run: list(parts) for parts in runs}, []
    left = {run: len(parts) for run, parts in parts_of.items()}
    futures = [submit(part) for parts in runs for part in parts]
    completed = distributed.as_completed(futures, with_results=True, raise_errors=False)
    for future, found in completed:
        if future.status != "finished":
            faults.append(f"{future.key[1]}: {fault(future, found)}")
            continue
        future.release()
        part = Part(**found["part"])
        if part not in parts_of[part.run]:
            continue
        print(f"{part.name}: {found['state']} in {found['seconds']:.1f} s by {found['worker']}", flush=True)
        if found["state"] != "refused":
            left[part.run] -= 1
            if left[part.run] == 0:
                study_parts.finish(parts_of[part.run])
        elif part.count == 1:
            faults.append(f"{part.name}: {found['reason']}")
        else:
            parts_of[part.run], left[part.run] = [part.whole()], 1
            completed.add(submit(part.whole()))
    return faults


def fault(future: distributed.Future, found: Any) -> str:
    """The reason why a future has no result, in one line."""
    error = found[1] if isinstance(found, tuple) else found
    if isinstance(error, distributed.scheduler.KilledWorker):
        return f"given up after {error.allowed_failures + 1} workers died while rendering it"
    if isinstance(error, CancelledError):
        return "lost with the connection to the scheduler; run the same command to continue"
    return " ".join(str(error).split()) or future.status


def work(arguments: argparse.Namespace) -> int:
    runs = missing_runs(arguments.study, arguments.out, arguments.only)
    faults: list[str] = []
    if runs:
        options = (etendue.binary(), arguments.shards, threads(arguments), arguments.checkpoint_every)
        parts = [study_parts.split(run, *options) for run in runs]
        client, cluster = connect(arguments)
        try:
            print(f"{len(runs)} runs in {sum(map(len, parts))} parts", flush=True)
            faults = make_runs(client, parts, arguments.retries)
        finally:
            client.close()
            if cluster:
                cluster.close()
    for line in faults:
        print(f"study_cluster.py: {line}", file=sys.stderr)
    if faults or arguments.no_evaluate:
        return 2 if faults else 0
    found = etendue.evaluate(arguments.study, out=arguments.out)
    print(found.text, end="")
    return 0 if found.holds else 1


def main() -> int:
    arguments = parse_arguments()
    # Batch systems end a job by SIGTERM.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    return exit_code(lambda: work(arguments), "interrupted; run the same command to continue")


if __name__ == "__main__":
    sys.exit(main())
