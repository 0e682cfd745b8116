"""Planted results of the scan-line studies: all claims true in one, all false in the other."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.claims.record import record_text
from wsnsim.claims.rules import Verdict, judged
from wsnsim.claims.scanline.claims import CLAIMS
from wsnsim.claims.scanline.evidence import DEFAULT, FIGURES, PRIOR_STUDY, PUBLISHED, STUDIES, UNIT_M, axis
from wsnsim.claims.scanline.measures import crossing, crossing_of, energy_a_frame, gain_from_crossing, needed
from wsnsim.claims.scanline.occluders import filter_rmse, unknown_rmse
from wsnsim.claims.scanline.page import FIGURES as DRAWN
from wsnsim.claims.scanline.page import page
from wsnsim.claims.scanline.speed import read_speed
from wsnsim.errors import OutputError
from wsnsim.metrics.figures import SUMMARY_KEYS
from wsnsim.sweeps.study import load_study
from wsnsim.systems.scanline.priors import VirtualSensor

BENCH = runpy.run_path(str(Path(__file__).parents[1] / "scanline_claims.py"))
ROOT = Path(__file__).parents[2]
IN_BOTH_FORMS = {"factor"}
"""Claims whose settings the studies run as printed, too, all of them."""


@pytest.fixture(scope="module")
def as_claimed():
    return BENCH["made_up_evidence"](BENCH["AS_CLAIMED"], BENCH["COSTS_AS_CLAIMED"], BENCH["FAST"])


@pytest.fixture(scope="module")
def the_opposite():
    return BENCH["made_up_evidence"](BENCH["THE_OPPOSITE"], BENCH["COSTS_OPPOSITE"], BENCH["SLOW"])


def told(findings) -> str:
    return "; ".join(
        f"{each.part.what}: {each.mark} {each.value}" for each in findings if each.mark is not None
    )


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.key)
def test_what_is_planted_is_found(claim, as_claimed, the_opposite) -> None:
    found, opposite = judged(claim, as_claimed), judged(claim, the_opposite)
    assert found.verdict is Verdict.REPRODUCED, told(found.findings)
    assert opposite.verdict is Verdict.NOT_REPRODUCED, told(opposite.findings)


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.key)
def test_the_printed_form_is_judged_by_its_own_runs(claim, as_claimed) -> None:
    found = judged(claim, as_claimed.seen_as(PUBLISHED))
    told_apart = {finding.mark is not None for finding in found.findings}
    if claim.key in IN_BOTH_FORMS:
        assert found.verdict is Verdict.REPRODUCED
    else:
        assert False in told_apart


def test_claims_have_different_keys() -> None:
    assert len({claim.key for claim in CLAIMS}) == len(CLAIMS)


def test_every_figure_is_one_of_a_runs_summary() -> None:
    assert set(FIGURES) <= SUMMARY_KEYS


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_the_studies_have_what_the_page_needs(study) -> None:
    loaded = load_study(ROOT / study.file)
    assert loaded.study.name == study.name
    assert set(study.cells) <= {cell.name for cell in loaded.cells}


def test_a_curve_crosses_where_a_straight_line_does() -> None:
    at = np.array([0.0, 2.0, 4.0, 30.0])
    assert crossing_of(at, np.array([3.0, 3.0, 3.0, 6.0])) == pytest.approx(3.0)
    assert crossing_of(at, 1.0 + 0.5 * at) == pytest.approx(2.0)
    assert np.isnan(crossing_of(at, at + 1.0))


def test_what_is_planted_in_fig_10_is_read_from_it(as_claimed) -> None:
    """From 3.3 at 3.0 to 3.8 at 5.2 the planted curve meets the diagonal at 3.388; 3 needs perfect priors."""
    met = 3.0 + 0.3 / 1.7 * 2.2
    assert crossing(as_claimed).value == pytest.approx(met, rel=0.02)
    assert gain_from_crossing(as_claimed).value == pytest.approx(6.0 / met, rel=0.02)
    assert needed(as_claimed, 3.55) == pytest.approx(3.0 + 0.5 * 2.2, rel=0.05)
    assert np.isnan(needed(as_claimed, 2.0))
    assert needed(as_claimed, 10.0) == BENCH["OCCLUDERS"].unknown


def test_energies_are_of_a_camera_and_a_frame(as_claimed) -> None:
    parts = energy_a_frame(as_claimed, "jpeg")
    assert parts["radio_tx"] == pytest.approx([0.01] * len(BENCH["SEEDS"]))
    assert parts["cpu"] == pytest.approx([0.6 / 8] * len(BENCH["SEEDS"]))


def test_one_axis_is_both_over_the_root_of_two() -> None:
    errors = np.random.default_rng(5).normal(0.0, 2.0, (100_000, 2))
    whole = np.sqrt((errors**2).sum(axis=1).mean())
    assert axis(whole) == pytest.approx(np.sqrt((errors[:, 0] ** 2).mean()), rel=0.02)


def test_the_page_says_every_claim_and_the_table_every_run(as_claimed) -> None:
    text = page(as_claimed)
    for claim in CLAIMS:
        assert f"(#{claim.key})" in text
        assert f'<a id="{claim.key}">' in text
    for name in DRAWN:
        assert f"](scanline/{name}.svg)" in text
    assert "nan" not in text
    rows = record_text(as_claimed.studies, FIGURES).splitlines()
    assert len(rows) == 1 + sum(len(results.runs) for results in as_claimed.studies)


@pytest.mark.parametrize("name", sorted(DRAWN))
def test_a_figure_is_the_same_twice(name: str, as_claimed) -> None:
    first, second = (DRAWN[name](as_claimed) for _ in range(2))
    assert first == second
    assert "currentColor" in first


def test_a_page_without_cpu_times_says_so(as_claimed) -> None:
    evidence = BENCH["made_up_evidence"](BENCH["AS_CLAIMED"], BENCH["COSTS_AS_CLAIMED"])
    assert "were not measured" in page(evidence)
    linear = next(claim for claim in CLAIMS if claim.key == "linear")
    assert judged(linear, evidence).verdict is Verdict.NOT_RUN
    assert judged(linear, as_claimed.seen_as(DEFAULT)).verdict is Verdict.REPRODUCED


def test_cpu_times_are_read_as_the_bench_prints_them(tmp_path: Path) -> None:
    file = tmp_path / "bench.json"
    assert read_speed(file) is None
    rows = [
        {"what": "a step, no prior", "setup": "N = 2", "cpu_ms": 0.5},
        {"what": "a step, Gaussian priors", "setup": "N = 8", "cpu_ms": 6.0},
        {"what": "resampling", "setup": "N = 8", "cpu_ms": 1.0},
    ]
    file.write_text(json.dumps(rows))
    speed = read_speed(file)
    assert speed.step_s == {("none", 2): pytest.approx(5e-4), ("kalman", 8): pytest.approx(6e-3)}
    assert speed.growth("none", 2, 8) is None
    for text in ("[]", "{}", '[{"what": "a step, magic", "setup": "N = 2", "cpu_ms": 1}]', "not json"):
        file.write_text(text)
        with pytest.raises(OutputError, match=r"must h|must be"):
            read_speed(file)


def test_the_filters_of_the_priors_err_as_they_say_themselves() -> None:
    """The acceleration that the filters reckon with fits the crowd: their error is the Riccati equation's."""
    runs = load_study(ROOT / PRIOR_STUDY.file, ("duration_s=26.7",)).runs
    loaded = next(run.loaded for run in runs if run.cell.name == "kalman-8")
    units = filter_rmse(loaded, steps=200) / UNIT_M
    assert units == pytest.approx(VirtualSensor(8.0).rmse_m, rel=0.1)


def test_who_is_said_to_be_in_the_middle_is_elsewhere() -> None:
    """Between waypoints walkers are nearer to the middle than at uniform places, 100 / √6 units off."""
    loaded = load_study(ROOT / PRIOR_STUDY.file, ("duration_s=26.7",)).runs[0].loaded
    assert 25.0 < unknown_rmse(loaded, steps=200) / UNIT_M < 100.0 / np.sqrt(6.0)
