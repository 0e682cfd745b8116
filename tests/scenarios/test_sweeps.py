"""Whole sweeps: the same whatever the workers, resumed, changed, with runs that fail and workers that die."""

import importlib.util
import json
import shlex
import sqlite3
from pathlib import Path

import pandas as pd
import pytest

import wsnsim
from wsnsim.errors import OutputError, OutputFolderError, ScenarioError
from wsnsim.metrics.figures import SUMMARY_KEYS
from wsnsim.sweeps.study import load_study
from wsnsim.sweeps.sweep import Sweep, missing_runs

_SPEC = importlib.util.spec_from_file_location("sweep_bench", Path(__file__).parents[1] / "sweep_bench.py")
bench = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(bench)

BY_MACHINE = ["wall_s", "cpu_s"]
STUDY = """
    name: guesses
    scenario: tiny.yaml
    seeds: [0, 1, 2]
    factors:
      sd: {system.sd_m: [0.1, 0.4]}
    keep: [steps]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("study")


@pytest.fixture(autouse=True)
def tracker_on_the_path(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tracker is a module that scenarios name; workers look where this process does."""
    monkeypatch.syspath_prepend(str(folder))


@pytest.fixture(scope="module")
def one_by_one(folder: Path) -> Sweep:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        return wsnsim.sweep(bench.write_study(folder, STUDY), out=folder / "serial", workers=1)


def rows(result: Sweep) -> pd.DataFrame:
    return result.runs.drop(columns=BY_MACHINE)


def test_a_sweep_is_one_row_a_run_with_every_figure_of_its_summary(folder: Path, one_by_one: Sweep) -> None:
    runs = one_by_one.runs
    assert list(runs["name"]) == [name for name in ("default", "sd=0.1", "sd=0.4") for _ in range(3)]
    assert list(runs["seed"]) == [0, 1, 2] * 3
    assert set(runs["status"]) == {"complete"}
    assert set(runs.columns) > SUMMARY_KEYS
    assert one_by_one.complete
    assert one_by_one.failed == ()
    # the default is the level 0.1: made once, shown twice
    assert one_by_one.done == 6
    single = wsnsim.run(folder / "tiny.yaml", seed=2, overrides=("system.sd_m=0.4",)).summary
    swept = runs[(runs["name"] == "sd=0.4") & (runs["seed"] == 2)].iloc[0]
    for key in SUMMARY_KEYS - {"wall_s"}:
        assert swept[key] == single[key] or (single[key] is None and pd.isna(swept[key])), key
    assert {file.name for file in one_by_one.folder.iterdir()} == {
        "sweep.sqlite",
        "summary.csv",
        "report.html",
    }


def test_kept_tables_have_cell_and_seed(one_by_one: Sweep) -> None:
    steps = one_by_one.table("steps")
    assert list(steps.columns[:3]) == ["cell", "seed", "time_s"]
    assert len(steps) == 9 * 4
    means = steps.groupby(["cell", "seed"])["error_m"].mean().to_numpy()
    assert means == pytest.approx(one_by_one.runs["position_error_mean_m"].to_numpy())


def test_cells_are_written_as_a_table(one_by_one: Sweep) -> None:
    written = pd.read_csv(one_by_one.folder / "summary.csv", keep_default_na=False, na_values=[""])
    assert list(written["name"]) == ["default", "sd=0.1", "sd=0.4"]
    pd.testing.assert_series_equal(
        written["position_error_mean_m"], one_by_one.cells["position_error_mean_m"]
    )
    assert (written["position_error_mean_m_low"] < written["position_error_mean_m"]).all()
    assert "wall_s" not in written.columns


def test_workers_change_nothing(folder: Path, one_by_one: Sweep) -> None:
    both = wsnsim.sweep(folder / "study.yaml", out=folder / "parallel", workers=2)
    pd.testing.assert_frame_equal(rows(both), rows(one_by_one))
    pd.testing.assert_frame_equal(both.table("steps"), one_by_one.table("steps"))
    for name in ("summary.csv", "report.html"):
        assert (both.folder / name).read_bytes() == (one_by_one.folder / name).read_bytes()


def test_what_is_there_is_not_run_again_and_a_changed_study_runs_what_changed(
    tmp_path: Path, folder: Path
) -> None:
    out = tmp_path / "r"
    study = folder / "changing.yaml"
    study.write_text("name: c\nscenario: tiny.yaml\nseeds: [0, 1]\ngrid: {system.sd_m: [0.1, 0.2]}")
    told: list[tuple[int, int, int]] = []
    first = wsnsim.sweep(study, out=out, limit=1, progress=lambda *counts: told.append(counts))
    assert told == [(0, 1, 0), (1, 1, 0)]
    assert list(first.runs["status"]) == ["complete", "pending", "pending", "pending"]
    assert not first.complete
    assert wsnsim.sweep(study, out=out, only=["sd_m=0.1"]).done == 1
    whole = wsnsim.sweep(study, out=out)
    assert (whole.done, whole.complete) == (2, True)
    assert missing_runs(load_study(study), out) == []
    study.write_text(
        "name: c\nscenario: tiny.yaml\nseeds: [1, 2]\ngrid: {system.sd_m: [0.2, 0.3]}\nbase: {duration_s: 1}"
    )
    assert len(missing_runs(load_study(study), out)) == 3
    changed = wsnsim.sweep(study, out=out)
    assert changed.done == 3
    assert sorted(set(changed.runs["seed"])) == [1, 2]
    kept = whole.runs[(whole.runs["name"] == "sd_m=0.2") & (whole.runs["seed"] == 1)]
    same = changed.runs[(changed.runs["name"] == "sd_m=0.2") & (changed.runs["seed"] == 1)]
    assert list(kept["wall_s"]) == list(same["wall_s"])
    study.write_text(study.read_text() + "\nkeep: [nodes]")
    assert len(missing_runs(load_study(study), out)) == 4
    assert len(missing_runs(load_study(study), out, ["sd_m=0.3"])) == 2


def test_the_file_of_another_study_is_refused(tmp_path: Path, folder: Path, one_by_one: Sweep) -> None:
    other = folder / "other.yaml"
    other.write_text("name: other\nscenario: tiny.yaml\nseeds: [0]")
    out = tmp_path / "r"
    wsnsim.sweep(other, out=out)
    before = (out / "sweep.sqlite").read_bytes()
    with pytest.raises(
        OutputFolderError, match=r"a sweep of the study 'guesses', got one of 'other'.*--fresh"
    ):
        wsnsim.sweep(folder / "study.yaml", out=out)
    assert (out / "sweep.sqlite").read_bytes() == before
    assert len(wsnsim.sweep(folder / "study.yaml", out=out, fresh=True, limit=0).runs) == 9


def test_other_files_are_refused(tmp_path: Path, folder: Path) -> None:
    study = folder / "other.yaml"
    study.write_text("name: other\nscenario: tiny.yaml\nseeds: [0]")
    (tmp_path / "manifest.json").write_text("of a single run")
    with pytest.raises(OutputFolderError, match="must not hold a single run"):
        wsnsim.sweep(study, out=tmp_path)
    (tmp_path / "manifest.json").unlink()
    (tmp_path / "sweep.sqlite").write_bytes(b"no database " * 400)
    with pytest.raises(OutputError, match="must be a readable file of a sweep, got 'file is not a database'"):
        wsnsim.sweep(study, out=tmp_path)
    (tmp_path / "sweep.sqlite").unlink()
    with sqlite3.connect(tmp_path / "sweep.sqlite") as connection:
        connection.execute("CREATE TABLE mine (x)")
    with pytest.raises(OutputError, match="its header says it is not"):
        wsnsim.sweep(study, out=tmp_path)


def test_a_run_that_raises_and_workers_that_die_cost_their_runs_only(tmp_path: Path, folder: Path) -> None:
    """A run whose worker dies is begun in another one, once."""
    study = folder / "poison.yaml"
    study.write_text(
        "name: poison\nscenario: tiny.yaml\nseeds: [4]\ncases:\n"
        "  - {name: fine}\n"
        "  - {name: raises, set: {system.do: raise}}\n"
        f"  - {{name: dies-once, set: {{system.do: die once, system.marker: {tmp_path}/m}}}}\n"
        "  - {name: dies, set: {system.do: die}}\n"
        "  - {name: leaves, set: {system.do: exit}}\n"
    )
    result = wsnsim.sweep(study, out=tmp_path / "r", workers=2)
    status = result.runs.groupby("name")["status"].unique().map(list).to_dict()
    assert status == {
        "fine": ["complete"],
        "raises": ["failed"],
        "dies-once": ["complete"],
        "dies": ["failed"],
        "leaves": ["failed"],
    }
    attempts = result.runs.groupby("name")["attempts"].sum().to_dict()
    assert attempts == {"fine": 1, "raises": 1, "dies-once": 2, "dies": 2, "leaves": 2}
    errors = {each.cell: each.error for each in result.failed}
    assert list(errors) == ["raises", "dies", "leaves"]
    assert "node 'c1': the program failed: RuntimeError('a bug of the user')" in errors["raises"]
    assert errors["dies"].startswith("its worker process died, 2 times: killed by SIGKILL")
    assert errors["leaves"] == "its worker process died, 2 times: it left with exit code 7"
    page = (result.folder / "report.html").read_text()
    assert "3 of the runs failed" in page
    assert list(result.cells["failed"]) == [0, 1, 0, 1, 1]
    command = shlex.split(next(each.command for each in result.failed if each.cell == "raises"))
    assert command[:3] == ["wsnsim", "run", str(folder / "tiny.yaml")]
    assert command[3:] == ["--seed", "4", "--set", 'system.do="raise"']


def test_what_failed_is_tried_again(tmp_path: Path, folder: Path) -> None:
    study = folder / "mended.yaml"
    study.write_text(
        "name: mended\nscenario: tiny.yaml\nseeds: [0]\n"
        f"base: {{system: {{kind: 'guessing:SYSTEM', do: raise once, marker: {tmp_path}/m}}}}"
    )
    assert len(wsnsim.sweep(study, out=tmp_path / "r").failed) == 1
    again = wsnsim.sweep(study, out=tmp_path / "r")
    assert (again.done, again.failed, again.complete) == (1, (), True)


def test_what_cannot_be_built_is_told_before_anything_runs(tmp_path: Path, folder: Path) -> None:
    study = folder / "apart.yaml"
    study.write_text(
        "name: apart\nscenario: tiny.yaml\nseeds: [0, 1]\ncases:\n  - {name: near}\n"
        '  - {name: far, set: {network.standard: ieee802154, "motes.base.position_m": [900, 0, 1]}}\n'
    )
    with pytest.raises(ScenarioError, match=r"\(cell far\)"):
        wsnsim.sweep(study, out=tmp_path / "r")
    assert missing_runs(load_study(study), tmp_path / "r")[0].cell.name == "near"


def test_cells_that_do_not_exist_are_refused(tmp_path: Path, folder: Path, one_by_one: Sweep) -> None:
    with pytest.raises(
        ScenarioError, match=r'--only sd=0\.5: must name a cell, got "sd=0\.5"; did you mean "sd=0\.'
    ):
        wsnsim.sweep(folder / "study.yaml", out=tmp_path / "r", only=["sd=0.5"])


def test_versions_are_kept(one_by_one: Sweep) -> None:
    (made,) = one_by_one.table("provenance").to_dict("records")
    assert made["wsnsim"] == wsnsim.__version__
    assert json.loads(made["libraries"])["numpy"]
    assert set(one_by_one.runs["provenance"]) == {made["provenance"]}
    assert one_by_one.other_versions == 0


def test_a_study_without_cameras_shows_load_delivery_and_delay(tmp_path: Path) -> None:
    (tmp_path / "packets.yaml").write_text(
        "{duration_s: 2, motes: {layout: {kind: star, nodes: 3, radius_m: 5}}, system: {kind: traffic}}"
    )
    study = tmp_path / "loads.yaml"
    study.write_text(
        "{scenario: packets.yaml, seeds: [0, 1], factors: {period: {system.period_s: [0.1, 0.4]}}}"
    )
    done = wsnsim.sweep(study, out=tmp_path / "loads", workers=1)
    assert done.complete
    offered = done.cells.set_index("level")["offered_bps"]
    assert offered["0.1"] == pytest.approx(4 * offered["0.4"])
    page = (done.folder / "report.html").read_text("utf-8")
    for words in ("Offered load [bit/s]", "Messages to the base station delivered", "95th percentile"):
        assert words in page
    for words in ("position error", "lost a target", "lost only here", "error in the images"):
        assert words not in page
    study.write_text(study.read_text()[:-1] + ", charts: {x: [cca_busy_ratio], y: control_share}}")
    page = (wsnsim.sweep(study, out=tmp_path / "loads", workers=1).folder / "report.html").read_text("utf-8")
    assert "Channel found busy" in page
    assert "Share of the routing protocol" in page
    assert "Offered load" not in page
