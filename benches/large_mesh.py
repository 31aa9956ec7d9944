#!/usr/bin/env python3
"""Measure the time and the peak memory to load a mesh of a million triangles, build its BVH and render 64 x 64 pixels once.

The script measures etendue, and also Mitsuba if it is installed. Each render is a separate process, measured from start to end.
The script reports the minimum over several runs.
"""

import argparse
import json
import math
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "scripts"))

import etendue

SCENE = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0, 2, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="64"/></film>
    <sampler type="independent"><integer name="sample_count" value="1"/></sampler>
  </sensor>
  <shape type="ply"><string name="filename" value="waves.ply"/></shape>
  <emitter type="constant"/>
</scene>
"""

MITSUBA = """
import sys
import mitsuba as mi
mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)
mi.render(mi.load_file(sys.argv[1]))
"""

MEASURED = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
subprocess.run(sys.argv[1:], check=True)
seconds = time.perf_counter() - start
print(json.dumps([seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024]))
"""


def write_waves(path: Path, side: int) -> int:
    """Write a height field as a binary PLY file; returns the number of its triangles."""
    triangles = 2 * (side - 1) ** 2
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {side * side}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with path.open("wb") as file:
        file.write(header.encode())
        for i in range(side):
            for j in range(side):
                x, z = 4 * i / (side - 1) - 2, 4 * j / (side - 1) - 2
                file.write(struct.pack("<3f", x, 0.2 * math.sin(9 * x) * math.cos(7 * z), z))
        for i in range(side - 1):
            for j in range(side - 1):
                a, b = i * side + j, (i + 1) * side + j
                file.write(struct.pack("<B3iB3i", 3, a, a + 1, b, 3, b, a + 1, b + 1))
    return triangles


def measure(command: list[str], repeats: int) -> tuple[float, float]:
    """The minimum wall-clock seconds and the minimum peak megabytes over several runs of a command."""
    call = [sys.executable, "-c", MEASURED, *command]
    runs = [json.loads(subprocess.run(call, check=True, capture_output=True).stdout) for _ in range(repeats)]
    return min(run[0] for run in runs), min(run[1] for run in runs)


def has_mitsuba() -> bool:
    return subprocess.run([sys.executable, "-c", "import mitsuba"], check=False, capture_output=True).returncode == 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=708, help="vertices along each side (default: %(default)s)")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each renderer (default: %(default)s)")
    etendue.add_program_option(parser)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "waves.xml"
        scene.write_text(SCENE)
        triangles = write_waves(scene.with_suffix(".ply"), arguments.side)
        print(f"{triangles} triangles")
        program = str(etendue.binary(arguments.etendue))
        commands = {"etendue": [program, "render", str(scene), "-o", str(scene.with_suffix(".exr"))]}
        if has_mitsuba():
            commands["scalar_rgb"] = [sys.executable, "-c", MITSUBA, str(scene)]
        for name, command in commands.items():
            seconds, megabytes = measure(command, arguments.repeats)
            print(f"{name:<12} {seconds:6.2f} s {megabytes:6.0f} MB")


if __name__ == "__main__":
    main()
