"""etendue from Python: renders as function calls, images as numpy arrays, studies as pandas tables.

    import etendue
    etendue.render("scene.xml", "scene.exr", spp=64, seed=1, params={"max_depth": 6})
    image = etendue.read_image("scene.exr")
    image.color          # (height, width, 3) float32, linear RGB
    image["variance"]    # the variance of its mean
    image.attributes["etendue.seconds"]

Every fault is a `UserError` whose text is one line.
"""

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from json import JSONDecodeError, loads
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from user_error import UserError

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent

VERDICT_FAILED = 1

# The order in which the channels of a layer are stacked; other channels follow in alphabetical order.
CHANNEL_ORDER = "RGBAXYZUV"
COLOUR = "RGBA"

PathLike = str | os.PathLike[str]


class EtendueError(UserError):
    """The program refused its input, or failed: `str()` is the line that it wrote to stderr, `code` its exit code."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


# --- images ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Image:
    """An image of H x W pixels in layers.

    `layers` maps the name of a layer to an array (H, W, C) of the type in the file, which is float32 in etendue's images.
    `channels` maps it to the names of its C channels. The layer "" is the beauty, linear RGB. The channel `caustic.R` belongs to
    the layer `caustic`. A channel without a dot that is not a colour, such as `deterministic` of a reference, is its own layer.

    `attributes` holds the texts of the header, such as `etendue.spp`; `crop` is the position (x, y) of the first pixel within
    the film, `size` the (width, height) of the film.
    """

    layers: dict[str, "NDArray[Any]"]
    channels: dict[str, tuple[str, ...]]
    attributes: dict[str, str] = field(default_factory=dict)
    crop: tuple[int, int] = (0, 0)
    size: tuple[int, int] = (0, 0)

    @property
    def color(self) -> "NDArray[Any]":
        """The beauty, (H, W, 3), linear RGB."""
        return self[""][..., :3]

    def __getitem__(self, layer: str) -> "NDArray[Any]":
        if layer not in self.layers:
            raise UserError(f"the image has no layer {layer!r}; it has: {', '.join(map(repr, self.layers))}")
        return self.layers[layer]

    def planes(self) -> dict[str, "NDArray[Any]"]:
        """All channels (H, W) by their full names, such as `variance.R`."""
        return {
            _full_name(layer, channel): values[..., c]
            for layer, values in self.layers.items()
            for c, channel in enumerate(self.channels[layer])
        }


def _layer_of(name: str) -> tuple[str, str]:
    layer, dot, channel = name.rpartition(".")
    return (layer, channel) if dot or name in COLOUR else (name, "")


def _full_name(layer: str, channel: str) -> str:
    return f"{layer}.{channel}" if layer and channel else layer or channel


def _rank(channel: str) -> tuple[int, str]:
    place = CHANNEL_ORDER.find(channel) if channel else -1
    return (place if place >= 0 else len(CHANNEL_ORDER), channel)


def read_image(path: PathLike) -> Image:
    """Read all layers and header texts of an OpenEXR file; only the first part of a multi-part file is read.

    Raises UserError if the file is missing or is not an OpenEXR image.
    """
    import numpy as np
    import OpenEXR

    _need_file(path)
    try:
        with OpenEXR.File(os.fspath(path), separate_channels=True) as file:
            header = dict(file.header())
            planes = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    except Exception as error:  # The library raises RuntimeError, ValueError, or types of its own.
        raise UserError(f"{os.fspath(path)}: cannot read: {' '.join(str(error).split())}") from error
    grouped: dict[str, dict[str, NDArray[Any]]] = {}
    for name, plane in planes.items():
        layer, channel = _layer_of(name)
        grouped.setdefault(layer, {})[channel] = plane
    channels = {layer: tuple(sorted(found, key=_rank)) for layer, found in sorted(grouped.items())}
    layers = {layer: np.stack([grouped[layer][name] for name in names], axis=-1) for layer, names in channels.items()}
    texts = {name: value for name, value in header.items() if isinstance(value, str)}
    (data_min, _), (low, high) = header["dataWindow"], header["displayWindow"]
    crop = tuple(int(x) for x in data_min - low)
    size = tuple(int(x) for x in high - low + 1)
    return Image(layers, channels, texts, crop, size)


def write_image(path: PathLike, image: Image) -> None:
    """Write an image as a ZIP-compressed OpenEXR file.

    A temporary file in the same folder is renamed at the end, so the file is never incomplete. Raises UserError if it cannot be
    written.
    """
    import numpy as np
    import OpenEXR

    path = Path(path)
    planes = {name: np.ascontiguousarray(plane) for name, plane in image.planes().items()}
    height, width = next(iter(planes.values())).shape
    low = np.array(image.crop, np.int32)
    size = image.size if all(image.size) else (width, height)
    header = {
        **image.attributes,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "dataWindow": (low, low + np.array([width - 1, height - 1], np.int32)),
        "displayWindow": (np.zeros(2, np.int32), np.array(size, np.int32) - 1),
    }
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with OpenEXR.File(header, planes) as file:
                file.write(str(partial))
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
    except (OSError, RuntimeError) as error:
        raise UserError(f"{path}: cannot write: {' '.join(str(error).split())}") from error


def _need_file(path: PathLike) -> None:
    if not Path(path).is_file():
        raise UserError(f"{os.fspath(path)}: no such file")


# --- the program -------------------------------------------------------------------------------------------------------


def binary(named: PathLike | None = None) -> Path:
    """The etendue program that every script starts.

    It is `named`, else $ETENDUE, else target/release/etendue of this repository, else the one on the PATH. Raises UserError if
    there is none; the message says how to build one.
    """
    for source, name in (("--etendue", named), ("$ETENDUE", os.environ.get("ETENDUE"))):
        if name:
            found = shutil.which(name)
            if found is None:
                raise UserError(f"{source}: no such program: {os.fspath(name)}")
            return Path(found).resolve()
    built = ROOT / "target" / "release" / "etendue"
    found = str(built) if built.is_file() else shutil.which("etendue")
    if found is None:
        raise UserError(f"no etendue program: build it with `cargo build --release` in {ROOT}, or set $ETENDUE to one")
    return Path(found).resolve()


def add_program_option(parser: argparse.ArgumentParser) -> None:
    """Add the option `--etendue` to a script; its value is the argument of `binary`."""
    parser.add_argument("--etendue", metavar="PROGRAM", help="the program (default: $ETENDUE, else target/release/etendue)")


def run(arguments: Sequence[PathLike | int], good: Sequence[int] = (0,), cwd: PathLike | None = None) -> tuple[int, str]:
    """Run the program with these arguments; returns its exit code, which is one of `good`, and its stdout.

    Warnings of the program go to stderr. Raises EtendueError with the program's own line for any other exit code. If Python is
    interrupted, the program is interrupted too and writes the image so far.
    """
    command = [str(binary()), *(os.fspath(word) if isinstance(word, os.PathLike) else str(word) for word in arguments)]
    return run_command(command, good, cwd)


def run_command(command: Sequence[str], good: Sequence[int] = (0,), cwd: PathLike | None = None) -> tuple[int, str]:
    """The same as `run`, for a whole command whose first word is the program."""
    try:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace", cwd=cwd)
    except OSError as error:
        raise UserError(f"cannot run {command[0]}: {error.strerror}") from error
    with process:
        try:
            stdout, stderr = process.communicate()
        except BaseException:
            process.terminate()
            raise
    for line in stderr.splitlines():
        if line.startswith("warning: "):
            print(line, file=sys.stderr)
    if process.returncode not in good:
        raise EtendueError(error_line(stderr) or _ending(command[0], process.returncode), process.returncode)
    return process.returncode, stdout


def error_line(stderr: str) -> str:
    """The line of stderr that describes the fault: one that begins with `error:`, else the last."""
    lines = [line.strip() for line in stderr.splitlines() if line.strip() and not line.startswith("warning: ")]
    faults = [line for line in lines if line.startswith("error: ")]
    return faults[0].removeprefix("error: ") if faults else (lines[-1] if lines else "")


def _ending(program: str, code: int) -> str:
    return f"{program} was killed by signal {-code}" if code < 0 else f"{program} ended with exit code {code} without a message"


def render(
    scene: PathLike,
    output: PathLike | None = None,
    *,
    integrator: str | None = None,
    sampler: str | None = None,
    params: Mapping[str, Any] | None = None,
    defines: Mapping[str, Any] | None = None,
    spp: int | None = None,
    seed: int | None = None,
    shard: tuple[int, int] | None = None,
    checkpoint: PathLike | None = None,
    resume: PathLike | None = None,
    threads: int | None = None,
) -> None:
    """Render `scene` into the OpenEXR file `output` in a separate process; see `etendue render --help`.

    `params` are parameters of the integrator, `defines` are $parameters of the scene. Values are numbers, booleans, texts or
    sequences of numbers. `spp` is the number of samples per pixel, or of passes.

    `shard=(i, n)` renders the i-th of n parts of the samples (1 <= i <= n). It needs a `checkpoint`, the file of exact sums that
    `merge` reads; `output` may then be left out. `resume` continues from such a file.

    Raises EtendueError with the program's line, such as `box.xml:14:9: no texture is called "bitmab"; known: ...`.
    """
    options = {
        "-o": output,
        "--integrator": integrator,
        "--sampler": sampler,
        "--spp": spp,
        "--seed": seed,
        "--shard": None if shard is None else f"{shard[0]}/{shard[1]}",
        "--checkpoint": checkpoint,
        "--resume": resume,
        "--threads": threads,
    }
    words = ["render", os.fspath(scene), *_options(options)]
    words += [word for name, value in (params or {}).items() for word in ("--param", f"{name}={value_text(value)}")]
    words += [word for name, value in (defines or {}).items() for word in ("-D", f"{name}={value_text(value)}")]
    run(words)


def _options(options: Mapping[str, Any]) -> list[str]:
    return [word for name, value in options.items() if value is not None for word in (name, str(value))]


def value_text(value: Any) -> str:
    """The text of a value in a scene file: true, 0.5, "1.0, 0.5, 0.5"."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value
    return ", ".join(value_text(item) for item in value) if hasattr(value, "__iter__") else str(value)


def merge(shards: Sequence[PathLike], output: PathLike, *, checkpoint: PathLike | None = None, partial: bool = False) -> None:
    """Add the exact sums of the shards of one render and write the image `output`.

    Its channels equal the channels of a single run, bit for bit. Raises EtendueError if the shards belong to different renders,
    overlap, or (unless `partial`) do not hold all samples.
    """
    run(["merge", *shards, *_options({"-o": output, "--checkpoint": checkpoint}), *["--partial"] * partial])


# --- studies -----------------------------------------------------------------------------------------------------------


class Evaluation(NamedTuple):
    """The result of a study: whether all of its predictions hold, and the text that the program printed."""

    holds: bool
    text: str


def plan(study: PathLike, *, out: PathLike | None = None, every: bool = False) -> list[dict[str, Any]]:
    """The missing runs of a study (`every`: all runs), each as `etendue study --plan` prints it.

    `out` is the folder of the results (default: the folder of `etendue study`).

    The keys of a run are cell, scene, method, renderer ("etendue" or "mitsuba"), x, seed and output. A run of etendue also has
    `arguments`: the words after `etendue` that render it, except `-o`. A run of Mitsuba has integrator, sampler, params, defines,
    variant and spp instead. Raises EtendueError for a bad study.
    """
    _, text = run(["study", study, "--plan", *_options({"--out": out}), *["--all"] * every])
    try:
        return [loads(line) for line in text.splitlines() if line.strip()]
    except JSONDecodeError as error:
        raise UserError(f"{os.fspath(study)}: the plan is not JSON lines: {error}") from error


def run_study(
    study: PathLike,
    *,
    out: PathLike | None = None,
    jobs: int | None = None,
    threads: int | None = None,
    only: str | None = None,
) -> Evaluation:
    """Render the missing runs of a study with etendue and evaluate it.

    `jobs` renders run at a time with `threads` threads each; `only` selects cells by a glob. Raises EtendueError for a bad study.
    """
    return _evaluated([study, *_options({"--out": out, "--jobs": jobs, "--threads": threads, "--only": only})])


def evaluate(study: PathLike, *, out: PathLike | None = None) -> Evaluation:
    """Write the rows, cells, fits, plots and page of a study from its existing runs. Raises EtendueError for a bad study."""
    return _evaluated([study, "--evaluate", *_options({"--out": out})])


def _evaluated(words: Sequence[PathLike]) -> Evaluation:
    code, text = run(["study", *words], good=(0, VERDICT_FAILED))
    return Evaluation(code == 0, text)


def study_folder(study: PathLike, *, out: PathLike | None = None) -> Path:
    """The folder of a study's runs and results. Raises EtendueError for a bad study."""
    # Every study has at least one run; its image is <out>/runs/<cell>/seed-<K>.exr.
    return Path(plan(study, out=out, every=True)[0]["output"]).parents[2]


def read_rows(folder: PathLike) -> "pd.DataFrame":
    """The rows of a study, one per run, from `rows.jsonl` in its folder.

    Errors are in units of the image, times in seconds, memory in bytes. An incomplete last line, which is still being written, is
    left out. Raises UserError if the file does not exist.
    """
    return _read_lines(Path(folder) / "rows.jsonl")


def read_cells(folder: PathLike) -> "pd.DataFrame":
    """The cells of a study, one row per cell, from `cells.jsonl` in its folder; see `read_rows`."""
    return _read_lines(Path(folder) / "cells.jsonl")


def _read_lines(path: Path) -> "pd.DataFrame":
    import pandas as pd

    _need_file(path)
    lines = path.read_text().split("\n")[:-1]
    rows = []
    for number, line in enumerate(lines, start=1):
        try:
            rows.append(loads(line))
        except JSONDecodeError as error:
            raise UserError(f"{path}:{number}: not JSON: {error.msg}") from error
    table = pd.DataFrame(rows)
    # A column that is null in every row holds a number that was not measured.
    unknown = table.columns[table.isna().all()]
    return table.astype(dict.fromkeys(unknown, float))
