"""The script kill_and_resume: it always reaches its number of kills, and it reports an image that differs."""

import subprocess
import sys
from pathlib import Path

import pytest

import etendue

SCRIPT = etendue.ROOT / "scripts" / "kill_and_resume.py"


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("spp", [1, 100])
def test_killed_renders_are_identical(tiny: Path, spp: int) -> None:
    """With 1 sample, a render may end before the first attempt to kill it."""
    found = run(tiny, "--options", f"--spp {spp}", "--times", "4", "--kills", "2", "--checkpoint-every", "0s")
    assert (found.returncode, found.stderr) == (0, "")
    counted, identical = found.stdout.split("checkpoint: ")
    rounds, kills = (int(counted.split(": ")[1].split(", ")[k].split()[0]) for k in (0, 1))
    assert 4 <= kills <= 5 and identical == f"{rounds} of {rounds} images identical in 6 channels\n"


def test_an_image_that_differs_is_reported(tiny: Path, tmp_path: Path) -> None:
    """The program takes another seed wherever it writes a checkpoint."""
    program = tmp_path / "program"
    binary = etendue.binary()
    program.write_text(f'#!/bin/sh\ncase "$*" in *render.ck*) exec {binary} "$@" --seed 5;; esac; exec {binary} "$@"\n')
    program.chmod(0o755)
    found = run(tiny, "--options", "--spp 4", "--times", "1", "--etendue", program)
    assert found.returncode == 1 and "round 1 differs" in found.stdout


def test_bad_input_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    found = run(tmp_path / "no-such.xml")
    assert found.returncode == 2 and found.stderr.count("\n") == 1
    assert found.stderr.startswith("kill_and_resume.py: ") and "no-such.xml" in found.stderr
