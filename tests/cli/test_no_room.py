"""A disk without room, a folder that another run writes into: told, and nothing half-written looks whole."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from wsnsim.errors import OutputError, SimulationError
from wsnsim.runs.result import Run
from wsnsim.store.folder import RunFolder
from wsnsim.store.reader import RunStore

# wsnsim.run is the function; the module behind it has the same name
run_module = importlib.import_module("wsnsim.runs.run")

LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
from wsnsim.cli import main
sys.argv[1:] = sys.argv[2:]
main()
"""
SHORT = (
    *("--set", "duration_s=1", "--set", "system.particles=50", "--set", "expect={}"),
    *("--set", "record.images=[]", "--force"),
)


@pytest.fixture(scope="module")
def scenario(scenarios: Path, quickstart: Run) -> Path:
    """Return a scenario that has run before: its kernels are compiled, their cache needs no more room."""
    assert quickstart.met
    return scenarios / "quickstart.yaml"


@pytest.mark.parametrize(
    ("limit_bytes", "file"), [(2_000, "scenario.yaml"), (30_000, "results.sqlite"), (400_000, "report.html")]
)
def test_a_disk_that_fills_up_leaves_a_run_that_failed(
    scenario: Path, tmp_path: Path, limit_bytes: int, file: str
) -> None:
    """The limit is on each file, and what the manifest needs is always there."""
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("summary.json", "report.html"):
        (folder / name).write_text("of an earlier run")
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, str(limit_bytes), "run", scenario, *SHORT, "--out", folder],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert f"{folder / file}: results must be writable, got '" in done.stderr
    assert "free some space, or choose a folder on another disk with --out" in done.stderr
    assert "Traceback" not in done.stderr
    assert json.loads((folder / "manifest.json").read_text())["status"] == "failed"
    left = {name.name for name in folder.iterdir()}
    assert not left & {"summary.json", "report.html"}
    assert not [name for name in left if name.endswith(".tmp")]
    if file == "report.html":
        assert len(RunStore(folder / "results.sqlite").table("steps")) == 4


def test_no_room_for_compiled_kernels_is_told_as_that(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numba keeps them where a kernel is first called: inside of a program."""

    def fail(*_: object) -> None:
        try:
            raise OSError(28, "No space left on device")
        except OSError as error:
            raise SimulationError("the program failed", 0.25, "c1") from error

    monkeypatch.setattr(run_module, "build", fail)
    with pytest.raises(
        OutputError, match="room for results and compiled kernels, got 'No space left"
    ) as told:
        run_module.run(scenario, out=tmp_path / "run")
    assert str(tmp_path / "run") in str(told.value)
    assert "free some space" in str(told.value)


def test_a_second_run_into_a_folder_is_refused_while_the_first_goes_on(
    scenario: Path, tmp_path: Path
) -> None:
    (tmp_path / "manifest.json").write_text("of the first run")
    with RunFolder(tmp_path).held():
        done = subprocess.run(
            [sys.executable, "-m", "wsnsim", "run", scenario, *SHORT, "--out", tmp_path],
            capture_output=True,
            text=True,
        )
    assert done.returncode == 2
    assert f"{tmp_path}: output folder must not be in use, another run is writing into it" in done.stderr
    assert (tmp_path / "manifest.json").read_text() == "of the first run"
