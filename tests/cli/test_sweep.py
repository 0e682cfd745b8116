"""`wsnsim sweep` as a user types it: output, exit codes, killed, interrupted, without room."""

import importlib.util
import json
import os
import shlex
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

_SPEC = importlib.util.spec_from_file_location("sweep_bench", Path(__file__).parents[1] / "sweep_bench.py")
bench = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(bench)

SMALL = "name: small\nscenario: tiny.yaml\nseeds: [0, 1]\ngrid: {system.sd_m: [0.1, 0.2]}\n"
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
from wsnsim.cli import main
sys.argv[1:] = sys.argv[2:]
main()
"""


def command(folder: Path, *arguments: str) -> list[str]:
    return [sys.executable, "-m", "wsnsim", "sweep", "study.yaml", "--out", "r", *arguments]


def environment(folder: Path) -> dict[str, str]:
    paths = [str(folder), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def sweep(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(folder, *arguments), capture_output=True, text=True, cwd=folder, env=environment(folder)
    )


def status(folder: Path) -> list[str]:
    with sqlite3.connect(folder / "r" / "sweep.sqlite") as connection:
        return [row[0] for row in connection.execute("SELECT status FROM runs")]


def test_a_sweep_shows_its_cells_and_where_the_report_is(tmp_path: Path) -> None:
    bench.write_study(tmp_path, SMALL)
    planned = sweep(tmp_path, "--dry-run")
    assert planned.returncode == 0
    assert "sd_m=0.1     2 of 2 to run" in planned.stdout
    assert "2 cells, 4 runs, 4 to run" in planned.stdout
    assert not (tmp_path / "r").exists()
    done = sweep(tmp_path, "--workers", "2")
    assert done.returncode == 0, done.stderr
    assert "sd_m=0.2      2      0" in done.stdout
    assert "report: r/report.html" in done.stdout
    assert "small: run 4 of 4" in done.stderr
    assert "\x1b" not in done.stdout + done.stderr
    again = sweep(tmp_path, "--json", "--quiet")
    assert again.stderr == ""
    document = json.loads(again.stdout)
    assert document["runs"] == {"total": 4, "made_now": 0, "complete": 4}
    assert [cell["name"] for cell in document["cells"]] == ["sd_m=0.1", "sd_m=0.2"]
    assert document["cells"][0]["position_error_mean_m"] > 0


def test_a_study_that_is_wrong_is_exit_code_2(tmp_path: Path) -> None:
    bench.write_study(tmp_path, SMALL + "sceds: 4\n")
    done = sweep(tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith('study.yaml:5:1: sceds: unknown key; did you mean "seeds"?')
    assert "Traceback" not in done.stderr


def test_failed_runs_are_exit_code_1_and_named_with_a_command(tmp_path: Path) -> None:
    bench.write_study(tmp_path, SMALL.replace("grid", "base: {system.do: raise}\ngrid"))
    done = sweep(tmp_path, "--set", "duration_s=0.5", "--only", "sd_m=0.2")
    assert done.returncode == 1
    assert "Failed: cell sd_m=0.2, seed 1:" in done.stderr
    line = next(line.strip() for line in done.stderr.splitlines() if "--seed 1" in line)
    assert line.endswith("--set 'system.do=\"raise\"' --set system.sd_m=0.2 --set duration_s=0.5")
    assert "2 of 2 runs failed." in done.stderr
    alone = subprocess.run(
        [sys.executable, "-m", *shlex.split(line)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment(tmp_path),
    )
    assert alone.returncode == 1
    assert "a bug of the user" in alone.stderr


def test_a_sweep_that_is_stopped_goes_on_where_it_was(tmp_path: Path) -> None:
    """Stopped in three ways, each time in the middle of a run; the last time only its worker is killed."""
    marker = tmp_path / "waiting"
    bench.write_study(
        tmp_path,
        "name: small\nscenario: tiny.yaml\nseeds: [0, 1]\ncases:\n  - {name: fine}\n"
        f"  - {{name: waits, set: {{system.do: wait, system.marker: {marker}}}}}\n",
    )
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        child, workers = begun(tmp_path, marker)
        child.send_signal(number)
        _, said = child.communicate(timeout=30)
        if number != signal.SIGKILL:
            assert child.returncode == 130
            assert "the same command goes on with the rest" in said
            assert "Interrupted" in said
        assert "Traceback" not in said
        assert sorted(status(tmp_path)) == ["complete"] + ["pending"] * 3
        assert not (tmp_path / "r" / "report.html").exists()
        patience = time.monotonic() + 20
        while any(alive(worker) for worker in workers):
            assert time.monotonic() < patience, "a worker outlives its sweep"
            time.sleep(0.05)
        marker.unlink()
    child, (worker,) = begun(tmp_path, marker)
    os.kill(worker, signal.SIGKILL)
    out, said = child.communicate(timeout=60)
    assert child.returncode == 0, said
    assert json.loads(out)["runs"] == {"total": 4, "made_now": 3, "complete": 4}
    with sqlite3.connect(tmp_path / "r" / "sweep.sqlite") as connection:
        assert list(connection.execute("SELECT attempts FROM runs")) == [(1,), (1,), (2,), (1,)]


def begun(folder: Path, marker: Path) -> "tuple[subprocess.Popen[str], list[int]]":
    """Return a sweep in the middle of a run that waits, and its workers."""
    child = subprocess.Popen(
        command(folder, "--workers", "1", "--json"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        env=environment(folder),
    )
    patience = time.monotonic() + 60
    while not marker.exists():
        assert child.poll() is None
        assert time.monotonic() < patience
        time.sleep(0.05)
    return child, children(child.pid)


def children(process: int) -> list[int]:
    """Return the processes that a process has started; only Linux tells."""
    listed = Path(f"/proc/{process}/task/{process}/children")
    if not listed.exists():
        pytest.skip("this system does not tell a process's children")
    return [int(each) for each in listed.read_text().split()]


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_disk_that_fills_up_is_told_and_the_sweep_goes_on_later(tmp_path: Path) -> None:
    """The limit is on each file: the sweep's own is the first to meet it, for it keeps all steps."""
    bench.write_study(
        tmp_path, SMALL.replace("seeds: [0, 1]", "seeds: {count: 6}\nkeep: [steps, nodes, views]")
    )
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, "400000", "sweep", "study.yaml", "--out", "r", "--workers", "1"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment(tmp_path),
    )
    assert done.returncode == 1, done.stderr
    assert "r/sweep.sqlite: results must be writable, got '" in done.stderr
    assert "free some space" in done.stderr
    assert "Traceback" not in done.stderr
    there = status(tmp_path).count("complete")
    assert 0 < there < 12
    resumed = json.loads(sweep(tmp_path, "--json").stdout)
    assert resumed["runs"] == {"total": 12, "made_now": 12 - there, "complete": 12}
