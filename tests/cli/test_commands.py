"""The commands as a user types them: output, errors, exit codes, interruption."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

FILES = {"manifest.json", "scenario.yaml", "results.sqlite", "summary.json", "report.html"}
SHORT = ("--set", "duration_s=1", "--set", "system.particles=50", "--set", "expect={}")


def wsnsim(*arguments: str | Path, cwd: Path | None = None, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "wsnsim", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, **env},
    )


@pytest.fixture(scope="module")
def scenario(scenarios: Path) -> Path:
    return scenarios / "quickstart.yaml"


def test_run_writes_the_five_files_and_says_where(scenario: Path, tmp_path: Path) -> None:
    done = wsnsim("run", scenario, *SHORT, "--seed", 3, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "runs" / "quickstart-seed3"
    assert {file.name for file in folder.iterdir()} == FILES
    assert "runs/quickstart-seed3/report.html" in done.stdout
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["status"] == "complete"
    assert manifest["seed"] == 3
    assert len(manifest["scenario_sha256"]) == 64
    assert manifest["peak_memory_bytes"] > 1e7


def test_json_is_one_document_on_stdout(scenario: Path, tmp_path: Path) -> None:
    done = wsnsim("run", scenario, *SHORT, "--json", "--out", tmp_path / "r")
    document = json.loads(done.stdout)
    assert document["summary"]["steps"] == 4
    assert document["summary"] == json.loads((tmp_path / "r" / "summary.json").read_text())


def test_quiet_says_nothing(scenario: Path, tmp_path: Path) -> None:
    done = wsnsim("run", scenario, *SHORT, "--quiet", "--out", tmp_path / "r")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_pipe_gets_no_colour(scenario: Path, tmp_path: Path) -> None:
    done = wsnsim("run", scenario, *SHORT, "--out", tmp_path / "r")
    assert "\x1b" not in done.stdout + done.stderr


def test_a_folder_with_another_run_is_refused_without_force(scenario: Path, tmp_path: Path) -> None:
    assert wsnsim("run", scenario, *SHORT, "--out", tmp_path).returncode == 0
    (tmp_path / "notes.txt").write_text("mine")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    refused = wsnsim("run", scenario, *SHORT, "--out", tmp_path)
    assert refused.returncode == 2
    assert "--force" in refused.stderr
    assert "Traceback" not in refused.stderr
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
    assert wsnsim("run", scenario, *SHORT, "--seed", 2, "--out", tmp_path, "--force").returncode == 0
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert json.loads((tmp_path / "manifest.json").read_text())["seed"] == 2


def test_an_expectation_that_fails_is_exit_code_3_and_named(scenario: Path, tmp_path: Path) -> None:
    wishes = "position_error_mean_m: '< 1e-9', steps: '== 4', lifetime_first_death_s: '< 1'"
    expect = ("--set", f"expect={{{wishes}}}")
    done = wsnsim("run", scenario, *SHORT, *expect, "--out", tmp_path / "r", "--json")
    assert done.returncode == 3
    assert "position_error_mean_m < 1e-9: NOT met, got 0." in done.stderr
    assert "lifetime_first_death_s < 1: NOT met, this run has no such figure" in done.stderr
    assert [e["met"] for e in json.loads(done.stdout)["expectations"]] == [False, True, False]
    assert (tmp_path / "r" / "report.html").exists()
    noted = json.loads((tmp_path / "r" / "manifest.json").read_text())["expectations"]
    assert [line.split(":")[1].split(",")[0].strip() for line in noted] == ["NOT met", "met", "NOT met"]


def test_an_expectation_of_no_figure_is_refused_before_the_run(scenario: Path, tmp_path: Path) -> None:
    for command in ("validate", "run"):
        done = wsnsim(command, scenario, "--set", "expect.position_eror_mean_m='< 1'", cwd=tmp_path)
        assert done.returncode == 2
        assert 'did you mean "position_error_mean_m"' in done.stderr
    assert not (tmp_path / "runs").exists()


def test_what_cannot_be_built_is_told_all_at_once(scenario: Path, tmp_path: Path) -> None:
    (tmp_path / "broken.jpg").write_bytes(b"no picture")
    done = wsnsim(
        "validate",
        scenario,
        *("--set", f"cameras[c1].background={tmp_path / 'broken.jpg'}"),
        *("--set", f"cameras[c2].background={tmp_path / 'broken.jpg'}"),
        *("--set", "motes.base.position_m=[900, 0, 1]"),
    )
    assert done.returncode == 2
    for what in ("cameras[0].background", "cameras[1].background", "every node must reach"):
        assert what in done.stderr


def test_nothing_measured_is_warned_of_and_is_lost(scenario: Path, tmp_path: Path) -> None:
    away = {"c1": [-9, 0, 3], "c2": [99, 0, 3], "c3": [99, 8, 3], "c4": [-9, 8, 3]}
    looks = (word for name, to in away.items() for word in ("--set", f"cameras[{name}].look_at_m={to}"))
    done = wsnsim("run", scenario, *SHORT, *looks, cwd=tmp_path)
    assert done.returncode == 0
    assert "nothing was measured" in done.stderr
    folder = tmp_path / "runs" / "quickstart-seed1"
    assert json.loads((folder / "summary.json").read_text())["lost_fraction"] == 1.0
    assert "No camera saw a target at any step" in (folder / "report.html").read_text()


def test_every_problem_of_a_scenario_at_once(tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text(
        "duration_s: .nan\n"
        "world:\n"
        "  size_m: [5, 5, 3]\n"
        "  targets:\n"
        "    - {id: a, shape: {kind: ellipsoid, semi_axes_m: [1, 1, 1]}, motion: {kind: recorded, file: n}}\n"
        "cameras:\n"
        "  - {id: c1, position_m: [0, 0, 3], look_at_m: [1, 1, 1], focal_pix: 300}\n"
        "  - {id: c1, position_m: [0, 0, 3], look_at_m: [1, 1, 1]}\n"
        "motes: {base: {position_m: [1, 1, 1]}}\n"
        "network: {mac: {min_be: three}, mac: {}}\n"
        "system: {kind: multiview, particles: 0}\n"
    )
    for command in ("validate", "run"):
        done = wsnsim(command, bad, cwd=tmp_path)
        assert done.returncode == 2
        assert done.stdout == ""
        lines = done.stderr.splitlines()
        for place, word in [
            (":1:", "duration_s"),
            (":5:", "file"),
            (":7:", 'did you mean "focal_px"'),
            (":8:", "c1"),
            (":10:", "mac"),
            (":11:", "particles"),
        ]:
            assert any(line.startswith(f"{bad}{place}") and word in line for line in lines), (place, word)
        assert "problems in the scenario; nothing was run." in lines[-1]
        assert "Traceback" not in done.stderr
        assert "pydantic" not in done.stderr
    assert not (tmp_path / "runs").exists()


def test_validate_looks_beyond_the_schema(scenario: Path) -> None:
    fine = wsnsim("validate", scenario)
    assert fine.returncode == 0
    assert "4 cameras, 6 nodes, 2 hops" in fine.stdout
    cut_off = wsnsim("validate", scenario, "--set", "motes.base.position_m=[500,4,2]", "--json")
    assert cut_off.returncode == 2
    (problem,) = json.loads(cut_off.stdout)["problems"]
    assert problem["path"] == "network"
    assert "'c1' cannot" in problem["message"]
    too_loud = wsnsim("validate", scenario, "--set", "network.tx_power_dbm=10")
    assert too_loud.returncode == 2
    assert "--set network.tx_power_dbm=10" in too_loud.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("rum",), "Did you mean 'run'?"),
        (("run",), "Missing argument"),
        (("run", "nowhere.yaml"), "nowhere.yaml"),
        (("run", "."), "file"),
    ],
)
def test_usage_errors_are_exit_code_2(arguments: tuple[str, ...], says: str, tmp_path: Path) -> None:
    done = wsnsim(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert says in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("number", "records"),
    [(signal.SIGINT, 120_000), (signal.SIGINT, 200_000), (signal.SIGINT, 280_000), (signal.SIGTERM, 150_000)],
)
def test_a_run_that_is_stopped_says_so_and_keeps_its_records(
    scenario: Path, tmp_path: Path, number: signal.Signals, records: int
) -> None:
    """Wherever the signal finds it, in compiled code too; SIGTERM is what batch systems send."""
    folder = tmp_path / "r"
    child = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "wsnsim",
            "run",
            str(scenario),
            "--set",
            "duration_s=5000",
            "--set",
            "record.images=[]",
            "--out",
            str(folder),
        ],
        stderr=subprocess.PIPE,
        text=True,
    )
    patience = time.monotonic() + 60
    wal = folder / "results.sqlite-wal"
    while not (wal.exists() and wal.stat().st_size > records):
        assert child.poll() is None
        assert time.monotonic() < patience
        time.sleep(0.05)
    child.send_signal(number)
    _, said = child.communicate(timeout=30)
    assert child.returncode == 130
    assert "Interrupted" in said
    assert "Traceback" not in said
    assert json.loads((folder / "manifest.json").read_text())["status"] == "interrupted"
    assert {file.name for file in folder.iterdir()} == {"manifest.json", "scenario.yaml", "results.sqlite"}
    from wsnsim.store.reader import RunStore

    assert len(RunStore(folder / "results.sqlite").table("estimates")) > 0


def test_a_run_that_fails_is_exit_code_1_and_marked(tmp_path: Path, scenario: Path) -> None:
    (tmp_path / "broken.py").write_text(
        "from wsnsim.systems.base import *\n"
        "class Broken:\n"
        "    def on_start(self, ctx): raise RuntimeError('a bug of the user')\n"
        "class P(SystemParams): pass\n"
        "SYSTEM = System('broken', 'nobody', P, (), lambda params, site, node, role: Broken())\n"
    )
    done = wsnsim(
        "run",
        scenario,
        "--set",
        "system={kind: 'broken:SYSTEM'}",
        "--out",
        "r",
        cwd=tmp_path,
        PYTHONPATH=str(tmp_path),
    )
    assert done.returncode == 1
    assert "node 'c1': the program failed: RuntimeError('a bug of the user')" in done.stderr
    assert json.loads((tmp_path / "r" / "manifest.json").read_text())["status"] == "failed"
    assert not (tmp_path / "r" / "summary.json").exists()


def test_help_names_the_exit_codes_and_needs_no_heavy_library() -> None:
    done = wsnsim("--help")
    assert done.returncode == 0
    for code in ("0 fine", "1 a run failed", "2 usage", "3 an expectation", "130"):
        assert code in " ".join(done.stdout.split())
    heavy = ["numpy", "pandas", "scipy", "numba", "pydantic", "simpy", "plotly", "networkx", "rich", "PIL"]
    code = f"import sys, wsnsim.cli.main; print([m for m in {heavy!r} if m in sys.modules])"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "[]"
