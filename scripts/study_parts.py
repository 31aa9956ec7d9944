"""The parts of a run of a study, and how a worker renders one.

An unfinished part has a checkpoint, `2-of-4.partial`, which etendue replaces periodically. A finished part has its exact sums in
`2-of-4.sums`. No other file matters, so a worker may die at any time. Two workers may even render the same part at once, because
a checkpoint is a pure function of the samples that it holds.
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
    """The `index`-th of `count` equal parts of the samples of one run; if the run is not split, the whole run.

    `arguments` are the words after `program` that render the whole run, except `-o`. `output` is the image of the run, `folder`
    holds its parts, and relative paths start from `start`. `threads` and `checkpoint_every` are options of `etendue render`.
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
    checkpoint_every: str

    @property
    def name(self) -> str:
        """The name of the part in Dask and in messages."""
        return f"{self.run} {self.index}/{self.count}"

    @property
    def sums(self) -> Path:
        return Path(self.folder) / f"{self.index}-of-{self.count}.sums"

    @property
    def partial(self) -> Path:
        return self.sums.with_suffix(".partial")

    def whole(self) -> "Part":
        """The whole run as one part."""
        return replace(self, index=1, count=1)

    def is_done(self) -> bool:
        return self.sums.is_file() and (self.count > 1 or Path(self.output).is_file())


@dataclass(frozen=True)
class Outcome:
    """The result of one part.

    `state` is "made", "continued" (from a checkpoint), "kept" (it was complete already), or "refused", with a `reason`.
    """

    part: Part
    state: str
    worker: str
    seconds: float
    reason: str = ""


def split(run: dict[str, Any], program: Path, shards: int, threads: int, checkpoint_every: str) -> list[Part]:
    """Split one run of the plan into `shards` parts, or fewer if it has fewer samples.

    The name of their folder contains a hash of the program, the arguments and the scene, so the parts of another program or scene
    are never used.
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
    return [Part(*common, index, count, threads, checkpoint_every) for index in range(1, count + 1)]


def samples_of(arguments: Sequence[str]) -> int | None:
    """The samples per pixel in the arguments of a render; None if they do not contain it."""
    given = [value for option, value in pairwise(arguments) if option in ("--spp", "--passes")]
    return int(given[-1]) if given else None


def hash_of(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise UserError(f"{file}: {error.strerror}") from error


def hash_of_scene(scene: Path, arguments: Sequence[str]) -> str:
    """The hash of all files of a scene, given the parameters in `arguments`."""
    import mitsuba_reference as ref

    given = [value for option, value in pairwise(arguments) if option == "-D"]
    return ref.scene_hash(scene, dict(value.split("=", 1) for value in given))


# --- on a worker -------------------------------------------------------------------------------------------------------


def make(part: Part) -> Outcome:
    """Render one part, from its checkpoint if there is one.

    If the program refuses the part (exit code 2), a retry would fail too, so the outcome reports the reason. Every other fault is
    raised, so that Dask retries the part.
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
    """The call of `etendue render` that renders a part; the image of a run that is not split is written directly."""
    option = "--resume" if state == "continued" else "--checkpoint"
    keep = [option, str(part.partial), "--checkpoint-every", part.checkpoint_every]
    what = ["--shard", f"{part.index}/{part.count}"] if part.count > 1 else ["-o", part.output]
    return [part.program, *part.arguments, *what, *keep, "--threads", str(part.threads)]


def bound_to_us() -> list[str]:
    """Words before a command that send it SIGTERM when this process dies, so that it writes its checkpoint and ends.

    Empty if this machine has no setpriv: then the program of a killed worker renders to its end, which only costs time.
    """
    program = shutil.which("setpriv") if sys.platform == "linux" else None
    if program is None or "--pdeathsig" not in subprocess.run([program, "--help"], capture_output=True, text=True).stdout:
        return []
    return [program, "--pdeathsig", "TERM"]


# --- on the client -----------------------------------------------------------------------------------------------------


def finish(parts: Sequence[Part]) -> None:
    """Merge the parts of a run into its image, then remove them and all older parts of the run."""
    if len(parts) > 1:
        shards = [str(part.sums) for part in parts]
        etendue.run_command([parts[0].program, "merge", *shards, "-o", parts[0].output], cwd=parts[0].start)
    folder, seed = Path(parts[0].folder).parent, Path(parts[0].output).stem
    for old in folder.glob(f"{seed}-*"):
        shutil.rmtree(old, ignore_errors=True)
    for empty in (folder, folder.parent):
        if not any(empty.iterdir()):
            empty.rmdir()
