"""The same scenario and seed give the same rows: again, in a fresh process, from the resolved scenario."""

import json
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

import wsnsim
from wsnsim.runs.result import Run


def dump(folder: Path) -> list[str]:
    """Return everything that the results hold, as SQL text."""
    with sqlite3.connect(folder / "results.sqlite") as connection:
        return list(connection.iterdump())


def figures(folder: Path) -> dict[str, float]:
    summary: dict[str, float] = json.loads((folder / "summary.json").read_text())
    del summary["wall_s"]
    return summary


@pytest.fixture(scope="module")
def first(quickstart: Run) -> Path:
    assert quickstart.folder is not None
    return quickstart.folder


def test_a_second_run_has_the_same_rows(first: Path, scenarios: Path, tmp_path: Path) -> None:
    wsnsim.run(scenarios / "quickstart.yaml", out=tmp_path)
    assert dump(tmp_path) == dump(first)
    assert figures(tmp_path) == figures(first)


def test_the_resolved_scenario_runs_to_the_same_rows_in_a_fresh_process(first: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "wsnsim", "run", str(first / "scenario.yaml"), "--out", str(tmp_path)]
    subprocess.run([*command, "--quiet"], check=True, env={"PYTHONHASHSEED": "77"})
    assert dump(tmp_path) == dump(first)
    assert figures(tmp_path) == figures(first)
    resolved = [
        (folder / "scenario.yaml").read_text().replace(str(folder), "") for folder in (first, tmp_path)
    ]
    assert resolved[0] == resolved[1]


def test_another_seed_is_another_run(first: Path, scenarios: Path) -> None:
    other = wsnsim.run(scenarios / "quickstart.yaml", seed=2)
    assert other.summary["position_error_mean_m"] != figures(first)["position_error_mean_m"]


def test_images_do_not_depend_on_tracker_or_radio(scenarios: Path) -> None:
    """Two trackers over two networks see the same world: every comparison is paired."""
    one = wsnsim.run(scenarios / "quickstart.yaml", overrides=("duration_s=2",))
    other = wsnsim.run(
        scenarios / "quickstart.yaml",
        overrides=(
            "duration_s=2",
            "network.standard=ideal",
            "system.particles=50",
            "motes.default.platform=telosb",
        ),
    )
    for table in ("truth", "views"):
        assert one.tables[table].equals(other.tables[table])


def test_the_python_api_gives_summary_and_tables(first: Path, quickstart: Run) -> None:
    assert quickstart.summary["steps"] == 48
    assert {
        "truth",
        "estimates",
        "steps",
        "load",
        "nodes",
        "messages",
        "events",
        "energy",
        "views",
        "frames",
        "images",
    } == set(quickstart.tables)
    assert len(quickstart.steps) == 48
    assert list(quickstart.nodes["node"]) == ["c1", "c2", "c3", "c4", "relay", "base"]
    assert quickstart.met
    in_memory = wsnsim.run(first / "scenario.yaml", overrides=("duration_s=1",))
    assert in_memory.folder is None
    assert len(in_memory.steps) == 4
