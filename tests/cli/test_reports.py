"""`python -m wsnsim.claims`: pages from finished sweeps, or what is missing and how to make it."""

import importlib.util
import os
import re
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from click.testing import CliRunner

from wsnsim.claims.__main__ import command
from wsnsim.claims.multiview.evidence import DEPLOYED, STUDIES, read_evidence, turning
from wsnsim.claims.multiview.page import FIGURES, page
from wsnsim.claims.record import planned, read_record, record_text
from wsnsim.claims.results import read_results
from wsnsim.errors import OutputError

_SPEC = importlib.util.spec_from_file_location("claims_bench", Path(__file__).parents[1] / "claims_bench.py")
bench = importlib.util.module_from_spec(_SPEC)
sys.modules[_SPEC.name] = bench  # dataclasses look their module up
_SPEC.loader.exec_module(bench)


@pytest.fixture(scope="module")
def studies():
    return bench.shipped_studies()


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, studies) -> Path:
    return bench.write_sweeps(tmp_path_factory.mktemp("claims") / "runs", studies)


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory, runs: Path) -> Path:
    """Made in a process of its own, whose sets are in an order of their own."""
    out = tmp_path_factory.mktemp("reports")
    subprocess.run(
        [sys.executable, "-m", "wsnsim.claims", "--runs", str(runs), "--out", str(out)],
        env={**os.environ, "PYTHONHASHSEED": "7"},
        check=True,
        timeout=300,
    )
    return out


def test_the_same_sweeps_give_the_same_bytes(runs: Path, reports: Path) -> None:
    evidence = read_evidence(runs)
    assert (reports / "multiview.md").read_text() == page(evidence)
    assert (reports / "multiview.csv").read_text() == record_text(evidence.studies)
    for name in ("factors", "sight"):
        assert (reports / "multiview" / f"{name}.svg").read_text() == FIGURES[name](evidence)


def test_the_page_links_to_what_exists_and_names_no_place_of_this_machine(runs: Path, reports: Path) -> None:
    text = (reports / "multiview.md").read_text()
    assert str(runs) not in text
    assert str(bench.ROOT) not in text
    files = [link for link in re.findall(r"\]\(([^)#]+)\)", text) if not link.startswith("http")]
    assert {f"multiview/{name}.svg" for name in FIGURES} < set(files)
    for link in files:
        beside = bench.ROOT / "reports" / link
        assert (reports / link).exists() or beside.resolve().exists(), link
    for anchor in re.findall(r"\]\(#([^)]+)\)", text):
        heading = re.search(rf"^#+ {anchor.replace('-', ' ')}$", text, re.IGNORECASE | re.MULTILINE)
        assert f'<a id="{anchor}"></a>' in text or heading, anchor


def test_the_table_holds_every_run(runs: Path, reports: Path) -> None:
    rows = read_record(reports / "multiview.csv")
    evidence = read_evidence(runs)
    assert len(rows) == sum(len(results.runs) for results in evidence.studies)
    row = rows[(rows["study"] == "multiview-variants") & (rows["cell"] == "B/T2") & (rows["seed"] == 10)]
    made = evidence.variants.of("B/T2").loc[10]
    assert row["position_error_mean_m"].iloc[0] == pytest.approx(made["position_error_mean_m"], rel=1e-8)
    assert row["scenario_sha256"].iloc[0] == made["scenario_sha256"]


def test_a_sweep_that_is_not_there_is_named_with_its_command(tmp_path: Path) -> None:
    said = CliRunner().invoke(command, ["--runs", str(tmp_path), "--out", str(tmp_path / "reports")])
    assert said.exit_code == 1
    assert f"run: wsnsim sweep {STUDIES[0].file} --out {tmp_path / STUDIES[0].name}" in said.output
    assert not (tmp_path / "reports").exists()


def _spoil(folder: Path, *statements: str) -> None:
    with closing(sqlite3.connect(folder / "sweep.sqlite")) as connection, connection:
        for statement in statements:
            connection.execute(statement)


@pytest.fixture
def deployed(tmp_path: Path, studies) -> Path:
    folder = tmp_path / DEPLOYED.name
    bench.write_sweep(folder, studies[DEPLOYED.name], bench.Plant())
    return folder


_OF = "SELECT scenario_sha256 FROM plan JOIN cells USING (cell) WHERE name = 'FGH/T3' AND seed = 1"


def test_a_missing_run_is_named_with_its_command(deployed: Path) -> None:
    _spoil(deployed, f"DELETE FROM results WHERE scenario_sha256 IN ({_OF})")
    with pytest.raises(
        OutputError, match=r"cell FGH/T3 must have all of its 3 runs, got 2; run: wsnsim sweep"
    ):
        read_results(DEPLOYED, deployed)


def test_a_failed_run_is_told_with_its_error(deployed: Path) -> None:
    change = "UPDATE results SET status = 'failed', error = 'a bug'"
    _spoil(deployed, f"{change} WHERE scenario_sha256 IN ({_OF})")
    with pytest.raises(OutputError, match=r"got 2; seed 1 failed: a bug; run: wsnsim sweep"):
        read_results(DEPLOYED, deployed)


def test_a_missing_cell_is_named_with_its_command(deployed: Path) -> None:
    _spoil(deployed, "DELETE FROM cells WHERE name IN ('LCR/T4', 'FGH/T4')")
    expected = r"cell LCR/T4 must be in the study \(and 1 more cells\); run: wsnsim sweep"
    with pytest.raises(OutputError, match=expected):
        read_results(DEPLOYED, deployed)


def test_another_study_in_the_folder_is_refused(deployed: Path) -> None:
    with pytest.raises(OutputError, match="must be a sweep of the study 'multiview-variants'"):
        read_results(STUDIES[0], deployed)


def test_seeds_that_turn_are_known_from_their_orientations(runs: Path) -> None:
    assert turning(read_evidence(runs)) == {seed: seed >= 10 for seed in bench.SEEDS}


def test_a_table_that_is_not_there_says_how_to_make_it(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="run: make reports"):
        read_record(tmp_path / "multiview.csv")


def test_a_row_leads_to_its_run_unless_the_study_has_moved_on(studies) -> None:
    wanted = next(run for run in studies[DEPLOYED.name].runs if run.cell.name == "FGH/T2" and run.seed == 2)
    row = {
        "study": DEPLOYED.name,
        "cell": "FGH/T2",
        "seed": 2,
    }
    found = planned(row, STUDIES, bench.ROOT)
    assert found.loaded.scenario == wanted.loaded.scenario
    with pytest.raises(OutputError, match="cell FGH/T9, seed 2: the study has no such run any more"):
        planned({**row, "cell": "FGH/T9"}, STUDIES, bench.ROOT)
