"""References rendered with Mitsuba: independent batches of one scene, reduced to the data of a statistical comparison.

A reference folder contains

- reference.exr      float32 `R, G, B`: mean over the batches; float16 `se.R, se.G, se.B`: standard error of that mean,
                     estimated from the batches; float16 `deterministic`: 1 where a pixel hardly varies, else 0;
                     values outside the range of float16 are 0 (below 3e-8) or infinite (above 65504)
- tiles.npy          float32 (batches, height/8, width/8, 3): mean over the stochastic pixels of each 8 x 8 tile in each
                     batch; NaN for a tile without stochastic pixels
- PROVENANCE.toml    how the reference was rendered, and the SHA-256 of each file that the scene reads
"""

import ctypes
import datetime
import hashlib
import json
import os
import re
import sys
import tempfile
import time
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

try:
    import numpy as np
    from numpy.typing import NDArray
except ModuleNotFoundError as error:
    print(f"{error}; run: pip install -r scripts/requirements.txt", file=sys.stderr)
    sys.exit(2)

import mitsuba_bsdfs
import stand_ins
from user_error import UserError

ROOT = Path(__file__).resolve().parent.parent
SCENES = ROOT / "assets" / "scenes"
REFERENCES = ROOT / "reference"

TILE = 8
BATCHES = 64
SAMPLES_PER_BATCH = 64
MAX_BATCHES = 4096
MAX_INCLUDE_DEPTH = 15

# A pixel is steady if the coefficient of variation of one batch stays below this limit in each channel. The mean of 64 batches
# of such a pixel has a relative error of at most 1.3e-5. A pixel lit by a point light varies by about 1e-3 within its footprint,
# which is above the limit.
STEADY_CV = 1e-4
DETERMINISTIC_RULE = (
    f"deterministic: the standard deviation of one batch is at most {STEADY_CV:g} of the mean in every channel, "
    "for the pixel and for its eight neighbours as far as they are in the same 8 x 8 tile"
)

SEED_RULE = (
    "seed(k) = 4096 * h + k for batch k = 0, 1, ...; h = first 20 bits of SHA-256 of the scene's name (file name without .xml)"
)

LLVM_FOLDERS = (
    "/usr/lib/*-linux-gnu",
    "/usr/lib/llvm-*/lib",
    "/usr/lib64",
    "/usr/local/lib",
    "/usr/lib",
    "/opt/homebrew/opt/llvm*/lib",
)
# LLVM 14, 15 and 16 abort during instruction selection. Versions 19 and 22 work. Versions 17 and 18 were not tested.
OLDEST_LLVM = 19
# How to get a libLLVM where none is found.
INSTALL_LLVM = (
    f"install libLLVM {OLDEST_LLVM} or later (Debian: apt-get install libllvm19), or set DRJIT_LIBLLVM_PATH to its path"
)

# The parameter of a scene that selects the stand-in for `photonmapper`: <default name="photons_by" value="ptracer"/>.
PHOTONS_BY = "photons_by"

Params = Mapping[str, str]


# --- the renderer ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Renderer:
    """Mitsuba in one variant; `llvm` is the version of its LLVM library, or "none"."""

    mi: ModuleType
    variant: str
    llvm: str


def llvm_version(path: Path) -> tuple[int, ...]:
    """The version in the file name of a libLLVM, such as (19, 1) for libLLVM.so.19.1; () if the name has none.

    Other forms are libLLVM-15.so, libLLVM-14.0.6.so.1, and Rust's libLLVM.so.22.1-rust-1.95.0-stable. Rust's
    libLLVM-22-rust-1.95.0-stable.so has no version here: it is a text file for linkers.
    """
    match = re.fullmatch(r"libLLVM(?:-([\d.]+?)(?:\.so(?:\.\d+)*)?|\.so\.([\d.]+)(?:-rust-.+)?)", path.name)
    return tuple(int(part) for part in (match[1] or match[2]).split(".")) if match else ()


def find_llvm() -> Path | None:
    """The newest libLLVM of the system, else of the Rust toolchains: on Linux, each toolchain of rustup contains one."""
    rustup = Path(os.environ.get("RUSTUP_HOME") or Path.home() / ".rustup")
    return newest_llvm(LLVM_FOLDERS) or newest_llvm([f"{rustup}/toolchains/*/lib"])


def newest_llvm(folders: Sequence[str]) -> Path | None:
    """The newest libLLVM in `folders` that Mitsuba can use, or None. Folders may contain wildcards."""
    found = []
    for pattern in folders:
        for path in Path("/").glob(f"{pattern.lstrip('/')}/libLLVM*"):
            version = llvm_version(path)
            if version and version[0] >= OLDEST_LLVM:
                found.append((version, path.name, path))
    return max(found)[2] if found else None


def full_llvm_version(path: Path) -> str:
    """The version that the library reports, or the version in its file name if the library is too old to report one."""
    library = ctypes.CDLL(str(path))
    parts = [ctypes.c_uint(), ctypes.c_uint(), ctypes.c_uint()]
    try:
        library.LLVMGetVersion(*(ctypes.byref(part) for part in parts))
    except AttributeError:
        return ".".join(str(part) for part in llvm_version(path)) or path.name
    return ".".join(str(part.value) for part in parts)


def start_mitsuba(variant: str | None = None) -> Renderer:
    """Import Mitsuba in `variant`.

    The default is `llvm_ad_rgb`, or `scalar_rgb` (about twenty times slower) if no LLVM library is found.
    """
    named = os.environ.get("DRJIT_LIBLLVM_PATH")
    library = Path(named) if named else find_llvm()
    if library is not None:
        if not library.is_file():
            raise UserError(f"DRJIT_LIBLLVM_PATH: no such file: {library}")
        os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
    try:
        import mitsuba as mi
    except ImportError as error:
        raise UserError(f"cannot import mitsuba ({error}); install scripts/requirements.txt") from error
    if library is None and variant is None:
        print(f"no libLLVM was found: falling back to scalar_rgb, which is slow; {INSTALL_LLVM}", file=sys.stderr)
    variant = variant or ("scalar_rgb" if library is None else "llvm_ad_rgb")
    if variant not in mi.variants():
        raise UserError(f"Mitsuba has no variant {variant!r}; it has: {', '.join(mi.variants())}")
    if library is None and variant.startswith("llvm"):
        raise UserError(f"{variant} needs libLLVM, which was not found; {INSTALL_LLVM}")
    try:
        mi.set_variant(variant)
    except (ImportError, RuntimeError) as error:
        raise UserError(f"cannot start Mitsuba's {variant}: {' '.join(str(error).split())}") from error
    mi.set_log_level(mi.LogLevel.Error)
    mitsuba_bsdfs.register(mi)
    return Renderer(mi, variant, "none" if library is None else full_llvm_version(library))


# --- the files and elements of a scene ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Element:
    """One element of a scene after substitution of parameters.

    `parent` is the tag of its parent element ("" at the root of a file); `folder` is the folder of its file.
    """

    tag: str
    attributes: dict[str, str]
    parent: str
    folder: Path


def all_scenes() -> list[Path]:
    """The scenes that have a reference: those in assets/scenes and in its folder figures. Included parts are not scenes."""
    return sorted([*SCENES.glob("*.xml"), *(SCENES / "figures").glob("*.xml")], key=lambda path: path.stem)


def scene_elements(scene: Path, params: Params | None = None) -> Iterator[Element]:
    """The elements of a scene in document order; the elements of an included file follow its <include>."""
    return _file_elements(scene, dict(params or {}), scene.parent, "", 0)


def _file_elements(file: Path, params: dict[str, str], root: Path, parent: str, depth: int) -> Iterator[Element]:
    if depth > MAX_INCLUDE_DEPTH:
        raise UserError(f"{file}: includes nest deeper than {MAX_INCLUDE_DEPTH}")
    try:
        tree = ET.parse(file).getroot()
    except OSError as error:
        raise UserError(f"{file}: {error.strerror}") from error
    except ET.ParseError as error:
        raise UserError(f"{file}: not well-formed XML: {error}") from error
    yield from _node_elements(tree, params, root, file.parent, parent, depth)


def _node_elements(
    node: ET.Element, params: dict[str, str], root: Path, folder: Path, parent: str, depth: int
) -> Iterator[Element]:
    element = Element(node.tag, {name: substitute(text, params) for name, text in node.attrib.items()}, parent, folder)
    yield element
    if node.tag == "default":
        # The first definition of a parameter takes effect; definitions on the command line come first.
        params.setdefault(element.attributes.get("name", ""), element.attributes.get("value", ""))
    elif node.tag == "include":
        yield from _file_elements(include_path(element, root), params, root, parent, depth + 1)
    for child in node:
        yield from _node_elements(child, params, root, folder, node.tag, depth)


def include_path(include: Element, root: Path) -> Path:
    """The path of an included file: Mitsuba searches the folder of the including file, then the folder of the scene."""
    name = include.attributes.get("filename", "")
    return include.folder / name if (include.folder / name).exists() else root / name


def substitute(text: str, params: Params) -> str:
    """Replace each $name by its value, longest names first; a backslash before a dollar sign keeps it."""
    if "$" not in text:
        return text
    names = sorted(params, key=len, reverse=True)
    pattern = re.compile("|".join([r"\\\$", *(re.escape(f"${name}") for name in names)]))
    return pattern.sub(lambda match: "$" if match[0] == r"\$" else params[match[0][1:]], text)


def scene_files(scene: Path, params: Params | None = None) -> list[str]:
    """The sorted paths of all files that a scene reads, including its own file, relative to its folder.

    The paths of meshes and textures start from the folder of the scene, even in an included file of another folder.
    """
    root = scene.parent
    found = {scene}
    for element in scene_elements(scene, params):
        if element.tag == "include":
            found.add(include_path(element, root))
        elif element.attributes.get("name") == "filename":
            found.add(root / element.attributes.get("value", ""))
    return sorted(Path(os.path.relpath(path, root)).as_posix() for path in found)


def file_hashes(scene: Path, params: Params | None = None) -> dict[str, str]:
    """The SHA-256 of each file that a scene reads, by its path relative to the scene's folder."""
    hashes = {}
    for name in scene_files(scene, params):
        try:
            hashes[name] = hashlib.sha256((scene.parent / name).read_bytes()).hexdigest()
        except OSError as error:
            raise UserError(f"{scene}: cannot read {name}: {error.strerror}") from error
    return hashes


def scene_hash(scene: Path, params: Params | None = None) -> str:
    """The `etendue.scene_sha256` in the header of etendue's images.

    It is the SHA-256 of the hashes of all files: first the XML files in their order of reading, then the other files, sorted.
    """
    files, others = [scene], set()
    for element in scene_elements(scene, params):
        if element.tag == "include" and (path := include_path(element, scene.parent)) not in files:
            files.append(path)
        elif element.attributes.get("name") == "filename":
            others.add(scene.parent / element.attributes.get("value", ""))
    try:
        hashes = [hashlib.sha256(path.read_bytes()).hexdigest() for path in [*files, *sorted(others)]]
    except OSError as error:
        raise UserError(f"{scene}: cannot read {error.filename}: {error.strerror}") from error
    return hashlib.sha256("".join(hashes).encode()).hexdigest()


def integrator_name(scene: Path, params: Params | None = None) -> str:
    """The integrator of a scene, with nested integrators in brackets: "moment(path)"."""
    outer, nested = "", []
    for element in scene_elements(scene, params):
        if element.tag == "integrator" and element.parent == "integrator":
            nested.append(element.attributes.get("type", ""))
        elif element.tag == "integrator":
            outer = element.attributes.get("type", "")
    return f"{outer}({', '.join(nested)})" if nested else outer


def parameter(scene: Path, name: str, params: Params | None = None) -> str | None:
    """The value of a parameter of a scene, from `params` or its first <default>; None if neither has it."""
    defaults = (e.attributes.get("value", "") for e in scene_elements(scene, params) if _defines(e, name))
    return (params or {}).get(name, next(defaults, None))


def _defines(element: Element, name: str) -> bool:
    return element.tag == "default" and element.attributes.get("name") == name


# --- rendering ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Batches:
    """Independent images of one scene, (batches, height, width, 3), linear RGB; times in seconds."""

    images: NDArray[np.float32]
    samples: int
    wall_seconds: float
    cpu_seconds: float


def batch_seed(scene_name: str, batch: int) -> int:
    """The 32-bit seed of one batch; see SEED_RULE."""
    if not 0 <= batch < MAX_BATCHES:
        raise UserError(f"batch {batch} is outside 0 .. {MAX_BATCHES - 1}")
    return MAX_BATCHES * (int(hashlib.sha256(scene_name.encode()).hexdigest(), 16) >> 236) + batch


def render_batches(renderer: Renderer, scene: Path, samples: int, batches: int, params: Params | None = None) -> Batches:
    """Render `batches` independent images of `samples` per pixel with the scene's own integrator and film.

    See `load_scene` for the sampler.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        loaded = load_scene(renderer, scene, params)
        images = [_render(renderer, loaded, samples, batch_seed(scene.stem, k)) for k in range(batches)]
    except RuntimeError as error:
        raise UserError(f"{scene}: Mitsuba: {' '.join(str(error).split())}") from error
    return Batches(np.stack(images), samples, time.perf_counter() - wall, time.process_time() - cpu)


def load_scene(renderer: Renderer, scene: Path, params: Params | None = None) -> Any:
    """Load a scene for Mitsuba; see `load_with_stand_ins`."""
    return load_with_stand_ins(renderer, scene, params)[0]


def load_with_stand_ins(
    renderer: Renderer, scene: Path, params: Params | None = None, change: Callable[[Any], None] | None = None
) -> tuple[Any, list[str]]:
    """Load a scene for Mitsuba with an `independent` sampler, and with stand-ins for the plugins that Mitsuba lacks.

    `change` alters the nodes of the parsed scene before the stand-ins are inserted. Returns the scene and a list of stand-ins,
    such as "cone: mesh of 392192 triangles".

    The standard errors need independent samples. Some of Mitsuba's other samplers are also biased: with `ldsampler` and 64
    samples per pixel, the image behind glass is off by 0.5 %.
    """
    mi = renderer.mi
    config = mi.parser.ParserConfig(renderer.variant)
    # Mitsuba refuses unused parameters, and no plugin uses this one.
    used_params = {name: value for name, value in (params or {}).items() if name != PHOTONS_BY}
    state = mi.parser.parse_file(config, str(scene), **used_params)
    for node in state.nodes:
        if node.type == mi.ObjectType.Sampler:
            for name in list(node.props.keys()):
                del node.props[name]
            node.props.set_plugin_name("independent")
    mi.parser.transform_upgrade(config, state)
    mi.parser.transform_resolve(config, state)
    if change:
        change(state)
    with tempfile.TemporaryDirectory(prefix="etendue-stand-ins-") as folder:
        photons_by = parameter(scene, PHOTONS_BY, params) or "path"
        used = stand_ins.put_in(mi, state, scene.parent, Path(folder), photons_by)
        if used:
            # Neither optimization supports objects that were created in Python.
            config.merge_equivalent = config.merge_meshes = False
        mi.parser.transform_all(config, state)
        # Like mi.load_file, search for meshes and textures in the folder of the scene.
        usual = mi.file_resolver()
        beside = mi.FileResolver(usual)
        beside.prepend(str(scene.parent))
        mi.set_file_resolver(beside)
        try:
            return mi.parser.instantiate(config, state), used
        finally:
            mi.set_file_resolver(usual)


def exact_tolerance(loaded: Any) -> float:
    """The largest relative difference that is accepted in a pixel without noise.

    Mitsuba's LLVM variants evaluate the Gaussian filter with a polynomial whose error is up to 4e-4 of the peak.
    """
    return 4e-4 if "Gaussian" in str(loaded.sensors()[0].film().rfilter()) else 1e-4


@contextmanager
def _repeatable(renderer: Renderer, loaded: Any) -> Iterator[None]:
    """Run light tracing on one thread: several threads add to a pixel in an order that varies between runs."""
    import drjit

    threads = drjit.thread_count()
    if isinstance(loaded.integrator(), renderer.mi.AdjointIntegrator):
        drjit.set_thread_count(1)
    try:
        yield
    finally:
        drjit.set_thread_count(threads)


def _render(renderer: Renderer, loaded: Any, samples: int, seed: int) -> NDArray[np.float32]:
    with _repeatable(renderer, loaded):
        # The channels of aov and moment follow the colour channels.
        image = np.array(renderer.mi.render(loaded, spp=samples, seed=seed), dtype=np.float32)[..., :3]
    height, width, channels = image.shape
    if channels != 3:
        raise UserError("the film does not have three colour channels; set pixel_format to rgb")
    if height % TILE or width % TILE:
        raise UserError(f"the image is {width} x {height}, but width and height must be multiples of {TILE}")
    return image


# --- reduction ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reduction:
    """The reduction of K batches of H x W pixels to a reference.

    `mean` (H, W, 3) is the mean over the batches and `standard_error` (H, W, 3) its standard error; `deterministic` is (H, W).
    `tiles` (K, H/8, W/8, 3) are means of tiles, NaN where a tile has only deterministic pixels.
    """

    mean: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    deterministic: NDArray[np.bool_]
    tiles: NDArray[np.float64]


def reduce_batches(images: NDArray[np.float32]) -> Reduction:
    """Reduce batches (K, H, W, 3) to a reference, with sums in float64."""
    if len(images) < 2:
        raise UserError("a standard error needs at least two batches")
    exact = images.astype(np.float64)
    mean, deviation = exact.mean(axis=0), exact.std(axis=0, ddof=1)
    deterministic = deterministic_pixels(np.all(deviation <= STEADY_CV * np.abs(mean), axis=-1))
    return Reduction(mean, deviation / np.sqrt(len(images)), deterministic, tile_means(exact, ~deterministic))


def deterministic_pixels(steady: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The steady pixels (H, W) whose neighbours within their tile are steady too.

    A steady pixel next to a noisy one may contain an event too rare for these batches, such as a sliver of a silhouette. Such a
    pixel belongs to the mean of its tile. In a tile without noise all pixels are deterministic, because its mean has no scatter.
    """
    height, width = steady.shape
    tiles = steady.reshape(height // TILE, TILE, width // TILE, TILE).transpose(0, 2, 1, 3)
    padded = np.pad(tiles, ((0, 0), (0, 0), (1, 1), (1, 1)), constant_values=True)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(2, 3))
    return windows.all(axis=(-1, -2)).transpose(0, 2, 1, 3).reshape(height, width)


def tile_means(images: NDArray[np.float64], mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The mean over the pixels of `mask` (H, W) in each 8 x 8 tile of images (K, H, W, 3); NaN for a tile without such pixels."""
    batches, height, width, channels = images.shape
    kept = np.where(mask[..., None], images, 0.0)
    sums = kept.reshape(batches, height // TILE, TILE, width // TILE, TILE, channels).sum(axis=(2, 4))
    counts = mask.reshape(height // TILE, TILE, width // TILE, TILE).sum(axis=(1, 3))
    return np.where(counts[..., None] > 0, sums / np.maximum(counts, 1)[..., None], np.nan)


def summary(images: NDArray[np.float32], reduction: Reduction) -> dict[str, Any]:
    """Statistics of a reference: relative standard errors, and the excess kurtosis of its tiles over the batches."""
    batches = len(images)
    means = images.astype(np.float64).mean(axis=(1, 2))
    scatter = means.std(axis=0, ddof=1) / np.sqrt(batches)
    centre = reduction.tiles.mean(axis=0)
    deviation = reduction.tiles.std(axis=0, ddof=1)
    lit = np.nan_to_num(centre) > 0
    relative = deviation[lit] / centre[lit] / np.sqrt(batches)
    fourth = ((reduction.tiles - centre) ** 4).mean(axis=0)[lit] / reduction.tiles.var(axis=0)[lit] ** 2 - 3.0
    return {
        "global_relative_se": [float(x) for x in scatter / means.mean(axis=0)],
        "tile_relative_se_median": float(np.median(relative)) if lit.any() else 0.0,
        "tile_relative_se_p95": float(np.percentile(relative, 95)) if lit.any() else 0.0,
        "tile_excess_kurtosis_median": float(np.median(fourth)) if lit.any() else 0.0,
        "tile_excess_kurtosis_max": float(fourth.max()) if lit.any() else 0.0,
        "deterministic_fraction": float(reduction.deterministic.mean()),
    }


# --- files -------------------------------------------------------------------------------------------------------------


def make_reference(
    renderer: Renderer,
    scene: Path,
    folder: Path,
    command: str,
    samples: int = SAMPLES_PER_BATCH,
    batches: int = BATCHES,
    params: Params | None = None,
) -> dict[str, Any]:
    """Render a scene and write its reference into `folder`; returns the statistics written to PROVENANCE.toml."""
    # The files are hashed before rendering: if one is edited during the render, the reference is stale.
    files = file_hashes(scene, params)
    rendered = render_batches(renderer, scene, samples, batches, params)
    reduction = reduce_batches(rendered.images)
    statistics = summary(rendered.images, reduction)
    _, height, width, _ = rendered.images.shape
    loaded, used = load_with_stand_ins(renderer, scene, params)
    provenance = {
        "renderer": "mitsuba",
        "version": renderer.mi.__version__,
        "variant": renderer.variant,
        "llvm": renderer.llvm,
        "integrator": integrator_name(scene, params),
        "sampler": "independent",
        "spp_per_batch": samples,
        "batches": batches,
        "seed_rule": SEED_RULE,
        "first_seed": batch_seed(scene.stem, 0),
        "width": width,
        "height": height,
        "deterministic_rule": DETERMINISTIC_RULE,
        "exact_tolerance": exact_tolerance(loaded),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "command": command,
        "wall_seconds": round(rendered.wall_seconds, 1),
        "cpu_seconds": round(rendered.cpu_seconds, 1),
        **({"stand_ins": used} if used else {}),
        "parameters": dict(params or {}),
        "files": files,
        "statistics": statistics,
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_exr(folder / "reference.exr", reduction)
        with (folder / "tiles.npy").open("wb") as out:
            np.lib.format.write_array(out, np.ascontiguousarray(reduction.tiles, dtype="<f4"), version=(1, 0))
        (folder / "PROVENANCE.toml").write_text(toml_text(provenance))
    except OSError as error:
        raise UserError(f"cannot write {folder}: {error.strerror}") from error
    return statistics


def write_exr(path: Path, reduction: Reduction) -> None:
    """Write the mean (float32), the standard error and the deterministic mask (float16) as one ZIP-compressed EXR file."""
    import OpenEXR

    channels = {name: plane(reduction.mean[..., c], np.float32) for c, name in enumerate("RGB")}
    channels |= {f"se.{name}": plane(reduction.standard_error[..., c], np.float16) for c, name in enumerate("RGB")}
    channels["deterministic"] = plane(reduction.deterministic, np.float16)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))


def plane(values: NDArray[Any], kind: type[np.floating[Any]]) -> NDArray[Any]:
    """One contiguous channel of an EXR file."""
    return np.ascontiguousarray(values, dtype=kind)


def toml_text(table: Mapping[str, Any]) -> str:
    """The TOML text of a table of strings, numbers, lists of either, and one level of sub-tables."""
    lines = [f"{_key(key)} = {_value(value)}" for key, value in table.items() if not isinstance(value, dict)]
    for name, inner in table.items():
        if isinstance(inner, dict):
            lines += ["", f"[{_key(name)}]"]
            lines += [f"{_key(key)} = {_value(value)}" for key, value in inner.items()]
    return "\n".join(lines) + "\n"


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, str):
        # JSON escapes are a subset of TOML's; DEL alone must be escaped in TOML and is not in JSON.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return repr(value)


def stale_reasons(scene: Path, folder: Path) -> list[str]:
    """The reasons why a reference does not belong to the current scene; empty if it does."""
    missing = [name for name in ("PROVENANCE.toml", "reference.exr", "tiles.npy") if not (folder / name).is_file()]
    if missing:
        return [f"missing {name}" for name in missing]
    try:
        provenance = tomllib.loads((folder / "PROVENANCE.toml").read_text())
        recorded, params = provenance["files"], provenance["parameters"]
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, KeyError) as error:
        return [f"PROVENANCE.toml cannot be read: {error}"]
    current = file_hashes(scene, params)
    reasons = [f"{name} has changed" for name in current if name in recorded and current[name] != recorded[name]]
    reasons += [f"{name} is read but not recorded" for name in current if name not in recorded]
    return reasons + [f"{name} is recorded but not read" for name in recorded if name not in current]
