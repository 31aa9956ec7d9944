"""Helpers that several tests share."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

import etendue
import mitsuba_reference as ref

SCRIPTS = etendue.ROOT / "scripts"
# The seconds after which a wait fails, so that a broken test ends. A correct test never reaches them.
PATIENCE = 600.0

Process = subprocess.Popen[str]


def need_wavefront(mi: Any) -> None:
    """Fail if Mitsuba runs a scalar variant, whose calls take single numbers instead of arrays."""
    if "scalar" in mi.variant():
        pytest.fail(f"this test needs a wavefront, but Mitsuba runs {mi.variant()}: {ref.INSTALL_LLVM}", pytrace=False)


def run_script(
    script: str, *arguments: str | Path, environment: Mapping[str, str] = os.environ
) -> subprocess.CompletedProcess[str]:
    """Run a script of the folder scripts/ to its end."""
    command = [sys.executable, str(SCRIPTS / script), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=dict(environment))


def end(process: Process) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a process after its end."""
    stdout, stderr = process.communicate(timeout=PATIENCE)
    return process.returncode, stdout, stderr


def wait_for(find: Callable[[], object], process: Process) -> object:
    """The first result of `find` that is true; fails if the process ends first."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and process.poll() is None:
        if found := find():
            return found
        time.sleep(0.02)
    process.kill()
    raise AssertionError(f"nothing was found; the process wrote {end(process)}")


def check_bad_input(script: str, code: int, stderr: str, message: str) -> None:
    """Check that a script ended with exit code 2 and one line, which begins with its name and contains `message`."""
    assert code == 2 and stderr.startswith(f"{script}: ") and stderr.count("\n") == 1, stderr
    assert message in stderr


def write_program(path: Path, text: str) -> Path:
    """Write an executable shell script."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


def gated_program(folder: Path) -> tuple[Path, Path]:
    """A program that renders only while a gate is open, and the gate: a file that closes it while it exists.

    While the gate is closed, a render takes one sample of each pixel, writes its checkpoint, and waits. When the gate opens, the
    render continues from its checkpoint.
    """
    gate = folder / "closed"
    gate.touch()
    text = f"""
if [ "$1" = render ] && [ -e {gate} ]; then
    {etendue.binary()} "$@" --time-limit 0s || exit
    while [ -e {gate} ]; do sleep 0.1; done
    for word; do
        shift
        [ "$word" = --checkpoint ] && word=--resume
        set -- "$@" "$word"
    done
fi
exec {etendue.binary()} "$@"
"""
    return write_program(folder / "gated", text), gate
