"""The command line on the scan-line system: a folder to begin with, and its report in a browser's eyes."""

import json
import subprocess
import sys
from pathlib import Path


def wsnsim(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "wsnsim", *map(str, arguments)], capture_output=True, text=True, cwd=cwd
    )


def test_a_new_folder_for_scan_lines_runs_at_once(tmp_path: Path) -> None:
    made = wsnsim("init", "hall", "--template", "scanline", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    folder = tmp_path / "hall"
    checked = wsnsim("validate", "scenario.yaml", cwd=folder)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    done = wsnsim("run", "scenario.yaml", "--set", "duration_s=12", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Warning" not in done.stderr
    summary = json.loads((folder / "runs" / "hall-seed1" / "summary.json").read_text())
    assert summary["steps"] == 90
    assert summary["app_bytes_per_step"] == 6 * 4
    page = (folder / "runs" / "hall-seed1" / "report.html").read_text()
    assert "people in the way" in page
    # nobody has looked at pixels: nothing is said of them
    assert "share of the image" not in page


def test_what_is_wrong_with_a_scenario_is_told_with_its_place(tmp_path: Path) -> None:
    wsnsim("init", "hall", "--template", "scanline", cwd=tmp_path)
    folder = tmp_path / "hall"
    for change, words in (
        ("cameras[c2].look_at_m=[6, 5, 0]", "must look level"),
        ("cameras[c2].position_m=[6, 5.2, 1.4]", "outside"),
        ("system.priors={kind: oracle}", "must be"),
        ("world.occluders[desk].size_m=[11.9, 9.9, 2]", "room"),
        ("system.message=jpeg", "pixels"),
    ):
        refused = wsnsim("run", "scenario.yaml", "--set", change, cwd=folder)
        assert refused.returncode == 2, change + refused.stdout + refused.stderr
        assert words in refused.stderr, refused.stderr
        assert "Traceback" not in refused.stderr


def test_a_head_that_cannot_keep_up_is_warned_of(tmp_path: Path) -> None:
    wsnsim("init", "hall", "--template", "scanline", cwd=tmp_path)
    folder = tmp_path / "hall"
    changes = (
        "motes.nodes=[{id: r, position_m: [6, 1, 2]}]",
        "system.head={kind: node, id: r}",
        "system.priors={kind: stationary}",
        "duration_s=4",
        "expect={}",
    )
    options = [option for change in changes for option in ("--set", change)]
    done = wsnsim("run", "scenario.yaml", *options, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (warning,) = (line for line in done.stderr.splitlines() if line.startswith("Warning"))
    assert warning.startswith("Warning: r could not keep up with tracking: ")
    assert "a frame period is 133 ms: take fewer particles (system.tracker.particles), a faster" in warning
    quiet = wsnsim("run", "scenario.yaml", "--force", "--quiet", *options, cwd=folder)
    assert quiet.stderr == ""
