"""The script kill_and_resume: it always reaches its number of kills, and it reports an image that differs."""

import random
import sys
from pathlib import Path

import pytest

import etendue
import kill_and_resume
from helpers import Process, check_bad_input, gated_program, run_script, wait_for, write_program

SCRIPT = "kill_and_resume.py"


@pytest.mark.parametrize("spp", [1, 100])
def test_killed_renders_are_identical(tiny: Path, spp: int) -> None:
    """With 1 sample, a render may end before the first attempt to kill it."""
    found = run_script(SCRIPT, tiny, "--options", f"--spp {spp}", "--times", "4", "--kills", "2", "--checkpoint-every", "0s")
    assert (found.returncode, found.stderr) == (0, "")
    counted, identical = found.stdout.split("checkpoint: ")
    rounds, kills = (int(counted.split(": ")[1].split(", ")[k].split()[0]) for k in (0, 1))
    assert 4 <= kills <= 5 and identical == f"{rounds} of {rounds} images identical in 6 channels\n"


class KilledWithCheckpoint(kill_and_resume.Render):
    """Each kill waits until the render has written a checkpoint; a gate keeps the render from its end until then."""

    def kill(self, image: Path, chance: random.Random) -> bool:
        self.gate.touch()
        self.before = self.written()
        try:
            return super().kill(image, chance)
        finally:
            self.gate.unlink()

    def wait(self, process: Process, chance: random.Random) -> None:
        wait_for(lambda: self.written() > self.before, process)

    def written(self) -> int:
        return self.checkpoint.stat().st_mtime_ns if self.checkpoint.exists() else 0


def test_renders_continue_from_their_checkpoints(
    tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every kill leaves a checkpoint, unlike kills at random times."""
    program, gate = gated_program(tmp_path)
    gate.unlink()
    words = [SCRIPT, tiny, "--options", "--spp 100", "--times", "4", "--kills", "2", "--etendue", program]
    monkeypatch.setattr(sys, "argv", list(map(str, words)))
    arguments = kill_and_resume.parse_arguments()
    render = KilledWithCheckpoint(arguments, tmp_path)
    render.gate = gate
    assert kill_and_resume.rounds_of(arguments, render) == 0
    expected = "2 rounds, 4 kills, 4 of them with a checkpoint: 2 of 2 images identical in 6 channels\n"
    assert capsys.readouterr().out.endswith(expected)


def test_an_image_that_differs_is_reported(tiny: Path, tmp_path: Path) -> None:
    """The program uses another seed whenever it writes a checkpoint."""
    binary = etendue.binary()
    text = f'case "$*" in *render.ck*) exec {binary} "$@" --seed 5;; esac; exec {binary} "$@"'
    program = write_program(tmp_path / "program", text)
    found = run_script(SCRIPT, tiny, "--options", "--spp 4", "--times", "1", "--etendue", program)
    assert found.returncode == 1 and "round 1 differs" in found.stdout


def test_bad_input_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    found = run_script(SCRIPT, tmp_path / "no-such.xml")
    check_bad_input(SCRIPT, found.returncode, found.stderr, "no-such.xml")
