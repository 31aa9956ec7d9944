"""The parts that a run of a study is split into, and what a worker does with one.

A part that is under way has a checkpoint, `2-of-4.partial`, which etendue writes whole every few seconds; a part that is
finished has its exact sums in `2-of-4.sums`. Nothing else counts, so a worker may die at any moment, and two may do the same part
at once: a checkpoint is a pure function of the samples that it holds.
"""

import hashlib
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import etendue
from user_error import UserError


@dataclass(frozen=True)
class Part:
    """The `index`-th of `count` equal parts of the samples of one run; the only one of a run that is not split.

    `arguments` are the words after `program` that make the whole run but for `-o`, `output` its image, `folder` where parts of
    this run are kept, `start` the folder that relative names begin at; `threads` and `every` are options of `etendue render`.
    """

    run: str
    arguments: tuple[str, ...]
    output: str
    program: str
    folder: str
    start: str
    index: int
    count: int
    threads: int
    every: str

    @property
    def name(self) -> str:
        """What Dask and the user know it by."""
        return f"{self.run} {self.index}/{self.count}"

    @property
    def sums(self) -> Path:
        return Path(self.folder) / f"{self.index}-of-{self.count}.sums"

    @property
    def partial(self) -> Path:
        return self.sums.with_suffix(".partial")

    def whole(self) -> "Part":
        """The run, not split."""
        return replace(self, index=1, count=1)

    def is_done(self) -> bool:
        return self.sums.is_file() and (self.count > 1 or Path(self.output).is_file())


@dataclass(frozen=True)
class Outcome:
    """What became of a part: `state` is made, continued (from a checkpoint), kept (it was there) or refused, with a `reason`."""

    part: Part
    state: str
    worker: str
    seconds: float
    reason: str = ""


def split(run: dict[str, Any], program: Path, shards: int, threads: int, every: str) -> list[Part]:
    """The parts of one run of the plan: `shards`, but no more than it has samples.

    Their folder is named after all that the run is made of: what another scene or program left behind is never taken up.
    """
    arguments, start = tuple(run["arguments"]), Path.cwd()
    output = start / run["output"]
    name = f"{run['cell']}/seed-{run['seed']}"
    made_of = [*arguments, hash_of(program), hash_of_scene(start / run["scene"], arguments)]
    digest = hashlib.sha256("\0".join(made_of).encode()).hexdigest()[:16]
    # Runs are in <out>/runs/<cell>/seed-<K>.exr, parts in <out>/parts/<cell>/seed-<K>-<digest>/.
    folder = output.parents[2] / "parts" / output.parent.name / f"{output.stem}-{digest}"
    count = min(shards, samples_of(arguments) or shards)
    common = (name, arguments, str(output), str(program), str(folder), str(start))
    return [Part(*common, index, count, threads, every) for index in range(1, count + 1)]


def samples_of(arguments: Sequence[str]) -> int | None:
    """The samples per pixel that a render is asked for; None if it is left to the scene."""
    given = [value for option, value in pairwise(arguments) if option in ("--spp", "--passes")]
    return int(given[-1]) if given else None


def hash_of(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise UserError(f"{file}: {error.strerror}") from error


def hash_of_scene(scene: Path, arguments: Sequence[str]) -> str:
    """The hash of all files of a scene with the parameters that are set in `arguments`."""
    import mitsuba_reference as ref

    given = [value for option, value in pairwise(arguments) if option == "-D"]
    return ref.scene_hash(scene, dict(value.split("=", 1) for value in given))


# --- on a worker -------------------------------------------------------------------------------------------------------


def make(part: Part) -> Outcome:
    """Make one part, from its checkpoint if it has one.

    What the program refuses (exit code 2) would be refused again, and is returned; whatever else goes wrong is raised, so that
    the part is tried again.
    """
    begun, worker = time.perf_counter(), f"{socket.gethostname()}:{os.getpid()}"
    if part.is_done():
        return Outcome(part, "kept", worker, 0.0)
    part.partial.parent.mkdir(parents=True, exist_ok=True)
    Path(part.output).parent.mkdir(parents=True, exist_ok=True)
    state = "continued" if part.partial.is_file() else "made"
    try:
        etendue.run_command([*bound_to_us(), *command(part, state)], cwd=part.start)
    except etendue.EtendueError as error:
        if error.code != 2:
            raise RuntimeError(f"{part.name}: {error}") from None
        return Outcome(part, "refused", worker, time.perf_counter() - begun, str(error))
    part.partial.replace(part.sums)
    return Outcome(part, state, worker, time.perf_counter() - begun)


def command(part: Part, state: str) -> list[str]:
    """The call of `etendue render` that makes a part; a run that is not split is written as an image at once."""
    keep = ["--resume" if state == "continued" else "--checkpoint", str(part.partial), "--every", part.every]
    what = ["--shard", f"{part.index}/{part.count}"] if part.count > 1 else ["-o", part.output]
    return [part.program, *part.arguments, *what, *keep, "--threads", str(part.threads)]


def bound_to_us() -> list[str]:
    """Words before a command that end it when this process dies; it then writes its checkpoint. None where there is no setpriv.

    Without it, the program of a killed worker renders on, which costs time and changes nothing.
    """
    program = shutil.which("setpriv") if sys.platform == "linux" else None
    if program is None or "--pdeathsig" not in subprocess.run([program, "--help"], capture_output=True, text=True).stdout:
        return []
    return [program, "--pdeathsig", "TERM"]


# --- on the client -----------------------------------------------------------------------------------------------------


def finish(parts: Sequence[Part]) -> None:
    """Merge the parts of a run into its image, bit for bit that of a single run, and remove them and what earlier ones left."""
    if len(parts) > 1:
        shards = [str(part.sums) for part in parts]
        etendue.run_command([parts[0].program, "merge", *shards, "-o", parts[0].output], cwd=parts[0].start)
    folder, seed = Path(parts[0].folder).parent, Path(parts[0].output).stem
    for old in folder.glob(f"{seed}-*"):
        shutil.rmtree(old, ignore_errors=True)
    for empty in (folder, folder.parent):
        if not any(empty.iterdir()):
            empty.rmdir()
