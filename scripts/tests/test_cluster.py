"""Studies on workers that die, are interrupted, and are jobs of a batch system. Each is held to the single run, bit for bit."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

import etendue
import study_parts

SCRIPT = str(etendue.ROOT / "scripts" / "study_cluster.py")
# Samples per pixel that take a core some ten seconds, longer than it takes to interrupt them.
LONG = 80_000
PATIENCE = 120.0


def start(*arguments: str | Path, **environment: str) -> subprocess.Popen[str]:
    """The script in a process group of its own, as a terminal starts it."""
    command = [sys.executable, SCRIPT, *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, **pipes, start_new_session=True, env={**os.environ, **environment})


def end(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    stdout, stderr = process.communicate(timeout=PATIENCE)
    return process.returncode, stdout, stderr


def wait_for(what: Callable[[], object], process: subprocess.Popen[str]) -> object:
    """What `what` finds as soon as it finds something, while the process runs."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and process.poll() is None:
        if found := what():
            return found
        time.sleep(0.02)
    process.kill()
    raise AssertionError(f"not found in time; the script said {end(process)}")


def words(process: psutil.Process) -> list[str]:
    """The command of a process; none if it has ended meanwhile."""
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def renders(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """The renders that workers of the script are at."""
    return [child for child in psutil.Process(process.pid).children(recursive=True) if words(child)[1:2] == ["render"]]


def checkpoints(out: Path) -> dict[Path, int]:
    """The parts that are under way, and when they were last kept."""
    found = {}
    for path in out.glob("parts/*/*/*.partial"):
        try:
            found[path] = path.stat().st_mtime_ns
        except FileNotFoundError:
            continue
    return found


def kill_a_worker(process: subprocess.Popen[str], out: Path) -> tuple[int, str]:
    """Kill the worker of a render that has kept something since the script was started; returns its process id and its part."""
    before = checkpoints(out)

    def find() -> tuple[psutil.Process, Path] | None:
        kept = [path for path, when in checkpoints(out).items() if before.get(path, 0) < when]
        return next(((child, path) for child in renders(process) for path in kept if str(path) in words(child)), None)

    render, path = wait_for(find, process)
    worker = render.parent()
    assert worker.pid != process.pid
    worker.send_signal(signal.SIGKILL)
    seed = path.parent.name.rpartition("-")[0]
    return worker.pid, f"{path.parent.parent.name}/{seed} {path.stem.replace('-of-', '/')}"


def single_runs(study: Path, out: Path) -> dict[str, dict[str, bytes]]:
    """The channels of each run of a study, by the path that the script writes it to, from one process each."""
    found = {}
    for run in etendue.plan(study, out=out, every=True):
        image = study.with_name("single.exr")
        etendue.run([*run["arguments"], "-o", image])
        found[run["output"]] = channels(image)
    return found


def channels(image: str | Path) -> dict[str, bytes]:
    return {name: plane.tobytes() for name, plane in etendue.read_image(image).planes().items()}


def test_killed_and_interrupted_is_the_single_run(tiny_study: Callable[..., Path], tmp_path: Path) -> None:
    study, out = tiny_study(("plain", "etendue", [LONG])), tmp_path / "out"
    study.write_text(study.read_text().replace("seeds = 2", "seeds = 1"))
    work = [study, "--out", out, "--workers", "2", "--shards", "2", "--every", "0.1s"]
    first = start(*work)
    wait_for(lambda: checkpoints(out), first)
    os.killpg(first.pid, signal.SIGINT)
    code, _, stderr = end(first)
    assert (code, stderr) == (130, "study_cluster.py: interrupted; the same command goes on\n")
    assert len(etendue.plan(study, out=out)) > 0 and checkpoints(out)

    second = start(*work)
    dead, part = kill_a_worker(second, out)
    code, stdout, stderr = end(second)
    assert (code, stderr) == (0, "")
    # Another worker, which stands at the end of the line, went on where the dead one was.
    line = next(line for line in stdout.splitlines() if line.startswith(part))
    assert ": continued in" in line and not line.endswith(f":{dead}")

    assert etendue.plan(study, out=out) == []
    assert sorted(path.name for path in out.iterdir() if path.is_dir()) == ["runs"]
    singles = single_runs(study, out)
    assert len(singles) == 2
    for image, expected in singles.items():
        assert channels(image) == expected, image
        assert list(expected) == ["R", "G", "B", "variance.R", "variance.G", "variance.B"]
    # Nothing is made again.
    code, stdout, _ = end(start(*work))
    assert code == 0 and " by " not in stdout


def test_jobs_of_a_batch_system(tiny_study: Callable[..., Path], tmp_path: Path) -> None:
    """A batch system that runs each job at once, with nothing of ours on its path."""
    study, out, system = tiny_study(("plain", "etendue", [4, 10])), tmp_path / "out", tmp_path / "bin"
    script(system / "sbatch", f'cp "$1" {tmp_path}/job; cd /; setsid bash {tmp_path}/job > {tmp_path}/log 2>&1 & echo job $!')
    script(system / "scancel", "kill -TERM -- -$1")
    jobs = ["--jobqueue", "slurm", "--jobs", "1", "--cores", "1", "--shards", "3"]
    code, stdout, stderr = end(start(study, "--out", out, *jobs, PATH=f"{system}:{os.environ['PATH']}"))
    assert (code, stderr) == (0, ""), (tmp_path / "log").read_text()
    # The reference and four runs, in three parts each.
    assert stdout.count(": made in") == 15
    for image, expected in single_runs(study, out).items():
        assert channels(image) == expected, image


@pytest.mark.parametrize(
    ("name", "program", "lines"),
    [
        ("slurm", "sbatch", ["#SBATCH -p long", "#SBATCH -A us", "#SBATCH --cpus-per-task=3", "#SBATCH -t 01:30"]),
        ("pbs", "qsub", ["#PBS -q long", "#PBS -A us", "#PBS -l select=1:ncpus=3:mem=1908MB", "#PBS -l walltime=01:30"]),
        ("lsf", "bsub", ["#BSUB -q long", '#BSUB -P "us"', "#BSUB -n 3", "#BSUB -W 01:30"]),
    ],
)
def test_a_job_that_is_refused(
    tiny_study: Callable[..., Path], tmp_path: Path, name: str, program: str, lines: list[str]
) -> None:
    script(tmp_path / "bin" / program, f'cat "$@" > {tmp_path}/job; echo no such queue >&2; exit 1')
    options = ["--queue", "long", "--account", "us", "--cores", "3", "--memory", "2GB", "--walltime", "01:30", "--prologue", "hi"]
    study = tiny_study(("plain", "etendue", [4]))
    path = f"{tmp_path / 'bin'}:{os.environ['PATH']}"
    code, _, stderr = end(start(study, "--out", tmp_path / "out", "--jobqueue", name, *options, PATH=path))
    assert code == 2 and stderr.startswith(f"study_cluster.py: {name}: refuses the job: ") and stderr.count("\n") == 1
    job = (tmp_path / "job").read_text().splitlines()
    assert [line for line in [*lines, "hi"] if line not in job] == []
    assert "--nthreads 1 --memory-limit 0" in job[-1]


def script(path: Path, text: str) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


def test_what_cannot_be_split_is_made_whole_and_faults_are_named(tiny_study: Callable[..., Path], tmp_path: Path) -> None:
    """A program that refuses shards, and one run for good; what is right is made."""
    study, out, fake = tiny_study(("plain", "etendue", [4, 6])), tmp_path / "out", tmp_path / "etendue"
    refuse = "echo no such thing >&2; exit 2"
    script(fake, f'case "$*" in *--shard*|*"--spp 6"*) {refuse};; esac; exec {etendue.binary()} "$@"')
    code, stdout, stderr = end(start(study, "--out", out, "--workers", "2", "--shards", "2", ETENDUE=str(fake)))
    faults = sorted(stderr.splitlines())
    assert code == 2 and len(faults) == 2
    for fault in faults:
        assert fault.startswith("study_cluster.py: tiny.plain.6/seed-") and fault.endswith(" 1/1: no such thing")
    assert stdout.count(" 1/1: made in") == 3
    assert [run["x"] for run in etendue.plan(study, out=out)] == [6, 6]


@pytest.mark.parametrize(
    ("arguments", "environment", "message"),
    [
        (["no-such.toml"], {}, "no-such.toml"),
        (["study.toml"], {"ETENDUE": "/no/such"}, "$ETENDUE names no program: /no/such"),
        (["study.toml", "--scheduler", "tcp://127.0.0.1:9"], {}, "tcp://127.0.0.1:9: no Dask scheduler there: "),
        (["study.toml", "--scheduler", "here"], {}, "here: no Dask scheduler there: missing port"),
        (["study.toml", "--jobqueue", "lsf"], {"PATH": "/no/such"}, "lsf: there is no bsub here"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    tiny_study: Callable[..., Path], tmp_path: Path, arguments: list[str], environment: dict[str, str], message: str
) -> None:
    study = tiny_study(("plain", "etendue", [4]))
    words = [str(study) if word == "study.toml" else word for word in arguments]
    given = {"ETENDUE": str(etendue.binary()), "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s", **environment}
    code, _, stderr = end(start(*words, "--out", tmp_path / "out", **given))
    assert code == 2 and stderr.startswith("study_cluster.py: ") and stderr.count("\n") == 1
    assert message in stderr
    assert not (tmp_path / "out").exists()


def test_a_render_does_not_outlive_its_worker() -> None:
    if sys.platform != "linux":
        assert study_parts.bound_to_us() == []
        return
    assert study_parts.bound_to_us() == [shutil.which("setpriv"), "--pdeathsig", "TERM"]
    program = "import subprocess, sys; import study_parts; subprocess.run([*study_parts.bound_to_us(), 'sleep', '100'])"
    parent = subprocess.Popen([sys.executable, "-c", program], cwd=etendue.ROOT / "scripts")
    child = wait_for(lambda: [c for c in psutil.Process(parent.pid).children() if words(c)[:1] == ["sleep"]], parent)[0]
    parent.kill()
    parent.wait()
    psutil.wait_procs([child], timeout=10)
    assert not child.is_running() or child.status() == psutil.STATUS_ZOMBIE
