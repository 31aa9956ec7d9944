"""Studies on workers that die, are interrupted, or are jobs of a batch system. Each image equals the image of a single run."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

import etendue
import study_parts
from helpers import PATIENCE, SCRIPTS, Process, check_bad_input, end, gated_program, wait_for, write_program

SCRIPT = str(SCRIPTS / "study_cluster.py")
# Far more samples per pixel than any machine can render: such a render ends only by a signal.
ENDLESS = 2_000_000_000

Start = Callable[..., Process]


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts the script in a process group of its own, as a terminal does. What is left of the group is killed after the test."""
    started: list[Process] = []

    def call(*arguments: str | Path, **environment: str) -> Process:
        command = [sys.executable, SCRIPT, *map(str, arguments)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        process = subprocess.Popen(command, **pipes, start_new_session=True, env={**os.environ, **environment})
        started.append(process)
        return process

    yield call
    for process in started:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def words(process: psutil.Process) -> list[str]:
    """The command of a process; empty if it has ended."""
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def renders(process: Process, program: Path) -> list[psutil.Process]:
    """The processes of `program` that workers of the script have started and that render."""
    children = psutil.Process(process.pid).children(recursive=True)
    return [child for child in children if str(program) in words(child) and "render" in words(child)]


def checkpoints(out: Path) -> dict[Path, int]:
    """The checkpoints of unfinished parts with their times of modification, without temporary files."""
    found = {}
    for path in out.glob("parts/*/*/*-of-[0-9].partial"):
        try:
            found[path] = path.stat().st_mtime_ns
        except FileNotFoundError:
            continue
    return found


def kill_a_worker(process: Process, program: Path, before: dict[Path, int]) -> tuple[int, str]:
    """Kill the worker of a render whose checkpoint is newer than in `before`; returns its process id and the name of its part."""
    out = next(iter(before)).parents[3]

    def find() -> tuple[psutil.Process, Path] | None:
        written = [path for path, when in checkpoints(out).items() if before.get(path, 0) < when]
        return next(((child, path) for child in renders(process, program) for path in written if str(path) in words(child)), None)

    render, path = wait_for(find, process)
    worker = render.parent()
    assert worker.pid != process.pid
    worker.send_signal(signal.SIGKILL)
    seed = path.parent.name.rpartition("-")[0]
    return worker.pid, f"{path.parent.parent.name}/{seed} {path.stem.replace('-of-', '/')}"


def single_runs(study: Path, out: Path) -> dict[str, dict[str, bytes]]:
    """The channels of each run of a study, rendered by one process, by the path of the image that the script writes."""
    found = {}
    for run in etendue.plan(study, out=out, every=True):
        image = study.with_name("single.exr")
        etendue.run([*run["arguments"], "-o", image])
        found[run["output"]] = channels(image)
    return found


def channels(image: str | Path) -> dict[str, bytes]:
    return {name: plane.tobytes() for name, plane in etendue.read_image(image).planes().items()}


def one_seed(study: Path) -> Path:
    study.write_text(study.read_text().replace("seeds = 2", "seeds = 1"))
    return study


def test_killed_and_interrupted_is_the_single_run(start: Start, tiny_study: Callable[..., Path], tmp_path: Path) -> None:
    study, out = one_seed(tiny_study(("plain", "etendue", [100]))), tmp_path / "out"
    program, gate = gated_program(tmp_path)
    work = [study, "--out", out, "--workers", "2", "--shards", "2"]
    first = start(*work, ETENDUE=str(program))
    wait_for(lambda: checkpoints(out), first)
    os.killpg(first.pid, signal.SIGINT)
    code, _, stderr = end(first)
    assert (code, stderr) == (130, "study_cluster.py: interrupted; run the same command to continue\n")
    assert len(etendue.plan(study, out=out)) == 2

    before = checkpoints(out)
    second = start(*work, ETENDUE=str(program))
    dead, part = kill_a_worker(second, program, before)
    gate.unlink()
    code, stdout, stderr = end(second)
    assert (code, stderr) == (0, "")
    # The line ends with the process id of the worker: another worker continued from the checkpoint of the dead one.
    line = next(line for line in stdout.splitlines() if line.startswith(part))
    assert ": continued in" in line and not line.endswith(f":{dead}")

    assert etendue.plan(study, out=out) == []
    assert sorted(path.name for path in out.iterdir() if path.is_dir()) == ["runs"]
    singles = single_runs(study, out)
    assert len(singles) == 2
    for image, expected in singles.items():
        assert channels(image) == expected, image
        assert list(expected) == ["R", "G", "B", "variance.R", "variance.G", "variance.B"]
    # Nothing is rendered again.
    code, stdout, _ = end(start(*work, ETENDUE=str(program)))
    assert code == 0 and " by " not in stdout


def test_a_script_that_is_ended_ends_its_renders_and_keeps_their_samples(
    start: Start, tiny_study: Callable[..., Path], tmp_path: Path
) -> None:
    study, out = one_seed(tiny_study(("plain", "etendue", [ENDLESS]))), tmp_path / "out"
    # The reference is left out, because its render ends by itself.
    options = ["--only", "tiny.plain.*", "--workers", "2", "--shards", "2", "--checkpoint-every", "0s"]
    process = start(study, "--out", out, *options)
    wait_for(lambda: len(checkpoints(out)) == 2, process)
    rendering = renders(process, etendue.binary())
    assert len(rendering) == 2
    # Batch systems end a job by SIGTERM to its first process.
    process.terminate()
    assert end(process)[0] == 130
    assert psutil.wait_procs(rendering, timeout=PATIENCE)[1] == []
    image = tmp_path / "partial.exr"
    etendue.merge(list(checkpoints(out)), image, partial=True)
    assert int(etendue.read_image(image).attributes["etendue.spp"]) >= 2


def test_jobs_of_a_batch_system(start: Start, tiny_study: Callable[..., Path], tmp_path: Path) -> None:
    """A batch system that runs each job at once, without our modules on its path."""
    study, out, system = tiny_study(("plain", "etendue", [4, 10])), tmp_path / "out", tmp_path / "bin"
    job, log = tmp_path / "job", tmp_path / "log"
    write_program(system / "sbatch", f'cp "$1" {job}; cd /; setsid bash {job} > {log} 2>&1 & echo job $!')
    write_program(system / "scancel", "kill -TERM -- -$1")
    jobs = ["--jobqueue", "slurm", "--jobs", "1", "--cores", "1", "--shards", "3"]
    code, stdout, stderr = end(start(study, "--out", out, *jobs, PATH=f"{system}:{os.environ['PATH']}"))
    assert (code, stderr) == (0, ""), log.read_text()
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
    start: Start, tiny_study: Callable[..., Path], tmp_path: Path, name: str, program: str, lines: list[str]
) -> None:
    write_program(tmp_path / "bin" / program, f'cat "$@" > {tmp_path}/job; echo no such queue >&2; exit 1')
    options = ["--queue", "long", "--account", "us", "--cores", "3", "--memory", "2GB", "--walltime", "01:30", "--prologue", "hi"]
    study = tiny_study(("plain", "etendue", [4]))
    path = f"{tmp_path / 'bin'}:{os.environ['PATH']}"
    code, _, stderr = end(start(study, "--out", tmp_path / "out", "--jobqueue", name, *options, PATH=path))
    check_bad_input("study_cluster.py", code, stderr, f"{name}: the job was refused: ")
    job = (tmp_path / "job").read_text().splitlines()
    assert [line for line in [*lines, "hi"] if line not in job] == []
    assert "--nthreads 1 --memory-limit 0" in job[-1]


def test_runs_that_cannot_be_split_are_rendered_whole_and_faults_are_named(
    start: Start, tiny_study: Callable[..., Path], tmp_path: Path
) -> None:
    """The program refuses all shards, and all runs of 6 samples; the other runs are rendered."""
    study, out, fake = tiny_study(("plain", "etendue", [4, 6])), tmp_path / "out", tmp_path / "etendue"
    refuse = "echo no such thing >&2; exit 2"
    write_program(fake, f'case "$*" in *--shard*|*"--spp 6"*) {refuse};; esac; exec {etendue.binary()} "$@"')
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
        (["study.toml"], {"ETENDUE": "/no/such"}, "$ETENDUE: no such program: /no/such"),
        (["study.toml", "--scheduler", "tcp://127.0.0.1:9"], {}, "tcp://127.0.0.1:9: no Dask scheduler there: "),
        (["study.toml", "--scheduler", "here"], {}, "here: no Dask scheduler there: missing port"),
        (["study.toml", "--jobqueue", "lsf"], {"PATH": "/no/such"}, "lsf: bsub was not found"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    start: Start, tiny_study: Callable[..., Path], tmp_path: Path, arguments: list[str], environment: dict[str, str], message: str
) -> None:
    study = tiny_study(("plain", "etendue", [4]))
    words = [str(study) if word == "study.toml" else word for word in arguments]
    given = {"ETENDUE": str(etendue.binary()), "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s", **environment}
    code, _, stderr = end(start(*words, "--out", tmp_path / "out", **given))
    check_bad_input("study_cluster.py", code, stderr, message)
    assert not (tmp_path / "out").exists()


def test_a_render_does_not_outlive_its_worker() -> None:
    if sys.platform != "linux":
        assert study_parts.bound_to_us() == []
        return
    assert study_parts.bound_to_us() == [shutil.which("setpriv"), "--pdeathsig", "TERM"]
    program = "import subprocess, sys; import study_parts; subprocess.run([*study_parts.bound_to_us(), 'sleep', 'infinity'])"
    parent = subprocess.Popen([sys.executable, "-c", program], cwd=SCRIPTS)
    child = wait_for(lambda: [c for c in psutil.Process(parent.pid).children() if words(c)[:1] == ["sleep"]], parent)[0]
    try:
        parent.kill()
        parent.wait()
        psutil.wait_procs([child], timeout=PATIENCE)
        assert not child.is_running() or child.status() == psutil.STATUS_ZOMBIE
    finally:
        with contextlib.suppress(psutil.NoSuchProcess):
            child.kill()
