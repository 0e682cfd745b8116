"""The command line on scenarios without cameras."""

import json
import os
import subprocess
import sys
from pathlib import Path


def wsnsim(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "wsnsim", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ},
    )


def test_a_new_folder_for_traffic_runs_at_once(tmp_path: Path) -> None:
    made = wsnsim("init", "net", "--template", "traffic", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    folder = tmp_path / "net"
    checked = wsnsim("validate", "scenario.yaml", cwd=folder)
    assert checked.stdout == "scenario.yaml: fine. 30 nodes, 2 hops to the base station at most, 50 s.\n"
    done = wsnsim("run", "scenario.yaml", "--set", "duration_s=10", cwd=folder)
    assert done.returncode == 0, done.stderr
    for words in ("throughput at the base", "mean latency", "attempts a frame"):
        assert words in done.stdout
    for words in ("position", "a step", "Warning"):
        assert words not in done.stdout + done.stderr
    summary = json.loads((folder / "runs" / "net-seed1" / "summary.json").read_text())
    assert summary["generated"] == 58
    assert "steps" not in summary


def test_an_unknown_template_is_refused(tmp_path: Path) -> None:
    refused = wsnsim("init", "net", "--template", "radio", cwd=tmp_path)
    assert refused.returncode == 2
    assert "'radio' is not one of 'cameras', 'scanline', 'traffic'" in refused.stderr


def test_maps_need_cameras(scenarios: Path, tmp_path: Path) -> None:
    refused = wsnsim("validate", scenarios / "network" / "line.yaml", "--maps", cwd=tmp_path)
    assert refused.returncode == 2
    assert "--maps needs cameras" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_a_bad_layout_is_an_error_of_the_scenario(scenarios: Path, tmp_path: Path) -> None:
    (tmp_path / "places.json").write_text('{"n": 2, "xy": [[0, 0], [0, 0]]}')
    layout = f"motes.layout={tmp_path}/places.json"
    refused = wsnsim("run", scenarios / "network" / "line.yaml", "--set", layout, cwd=tmp_path)
    assert refused.returncode == 2
    assert "motes.layout: must be a file with a layout" in refused.stderr
    assert "xy[1]: must be a place of its own, got that of node 0" in refused.stderr
    assert "Traceback" not in refused.stderr
