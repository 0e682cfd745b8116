"""Planted results of the scan-line studies: all claims true in one, all false in the other."""

import json
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wsnsim.claims.record import record_text
from wsnsim.claims.rules import Verdict, judged
from wsnsim.claims.scanline.claims import CLAIMS
from wsnsim.claims.scanline.evidence import FIGURES, axis
from wsnsim.claims.scanline.measures import (
    crossing,
    crossing_of,
    energy_a_frame,
    gain_from_crossing,
    head_cycles,
    needed,
    needed_for,
)
from wsnsim.claims.scanline.page import FIGURES as DRAWN
from wsnsim.claims.scanline.page import page
from wsnsim.claims.scanline.rooms import known_in
from wsnsim.claims.scanline.speed import read_speed
from wsnsim.claims.scanline.studies import DEFAULT, LAB_STUDY, PRIOR_STUDY, PUBLISHED, STUDIES, units_m
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


def words_of(evidence) -> str:
    """Return the page as one line."""
    return " ".join(page(evidence).split())


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
    assert needed(as_claimed, 10.0) == BENCH["ROOMS"].open.occluders


def test_fig_11_is_read_between_perfect_priors_and_none(as_claimed) -> None:
    """From 1.5 to 6.5 units of error, 3 is at three tenths of RMSE_max; planted N = 3 errs by 7 at best."""
    worst = BENCH["ROOMS"].open.occluders
    assert np.isnan(needed_for(as_claimed, 3))
    assert needed_for(as_claimed, 5) == worst
    planted = {**BENCH["AS_CLAIMED"], "tradeoff/N6-none": 6.5}
    evidence = BENCH["made_up_evidence"](planted, BENCH["COSTS_AS_CLAIMED"])
    assert needed_for(evidence, 6) == pytest.approx(0.3 * worst, rel=0.1)


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


def test_what_does_not_agree_is_said(as_claimed, the_opposite) -> None:
    agreed, opposed = words_of(as_claimed), words_of(the_opposite)
    assert "Not in the paper's order" not in agreed
    assert opposed.count("Not in the paper's order: ×") == 2
    assert "(perfect over kalman)" in opposed
    assert "Three do better than four" not in agreed
    assert "Three do better than four" in opposed
    assert "nan" not in opposed


def test_lost_runs_are_counted(as_claimed) -> None:
    row = next(line for line in page(as_claimed).splitlines() if line.startswith("| extended Kalman |"))
    assert "| 0 of 3 |" in row
    gone = {**BENCH["AS_CLAIMED"], "trackers/extended": 2 * BENCH["ROOMS"].open.target}
    lost = page(BENCH["made_up_evidence"](gone, BENCH["COSTS_AS_CLAIMED"]))
    assert "| 3 of 3 |" in next(line for line in lost.splitlines() if line.startswith("| extended Kalman |"))


def test_steps_are_those_of_the_runs(as_claimed) -> None:
    assert f"A run has {BENCH['STEPS']} steps for Fig. 9, " in words_of(as_claimed)
    cameras = as_claimed.cameras
    longer = replace(as_claimed, cameras=replace(cameras, runs=cameras.runs.assign(steps=4000)))
    # split() takes the narrow space for one, too
    assert "A run has 4 000 steps for Fig. 9; 100 steps for Fig. 10, " in words_of(longer)


def test_the_cluster_heads_cycles_are_of_a_frame(as_claimed) -> None:
    assert head_cycles(as_claimed, "bearing") == pytest.approx(1e6 / BENCH["STEPS"])


def test_fig_9_shows_who_measures_nothing(as_claimed) -> None:
    """The dotted line is where the evidence says, not where the paper does."""
    rooms = as_claimed.rooms
    farther = replace(as_claimed, rooms=replace(rooms, block=replace(rooms.block, target=60.0)))
    assert DRAWN["cameras"](farther) != DRAWN["cameras"](as_claimed)
    assert "60.0 units over both axes, 42.4 on one" in words_of(farther)


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
        {"what": "a step, Gaussian priors", "setup": "N = 8", "cpu_ms": 6.0, "ratio": 200.0},
        {"what": "resampling", "setup": "N = 8", "cpu_ms": 1.0},
    ]
    file.write_text(json.dumps(rows))
    speed = read_speed(file)
    assert speed.step_s == {("none", 2): pytest.approx(5e-4), ("kalman", 8): pytest.approx(6e-3)}
    assert speed.over_twin == {8: 200.0}
    assert speed.growth("none", 2, 8) is None
    for text in ("[]", "{}", '[{"what": "a step, magic", "setup": "N = 2", "cpu_ms": 1}]', "not json"):
        file.write_text(text)
        with pytest.raises(OutputError, match=r"must h|must be"):
            read_speed(file)


@pytest.fixture(scope="module")
def open_room():
    return known_in(PRIOR_STUDY, {"kalman-8": "kalman-8"}, runs=1, frames=200)


def test_the_filters_of_the_priors_err_as_they_say_themselves(open_room) -> None:
    """The acceleration that the filters reckon with fits the crowd: their error is the Riccati equation's."""
    assert open_room.filters["kalman-8"] == pytest.approx(VirtualSensor(8.0).rmse_m, rel=0.1)


def test_who_is_said_to_be_in_the_middle_is_elsewhere(open_room) -> None:
    """Between waypoints walkers are nearer to the middle than at uniform places, 100 / √6 units off."""
    assert 25.0 < open_room.occluders < 100.0 / np.sqrt(6.0)
    # the object is one of the crowd; one walker's way tells less than forty
    assert open_room.target == pytest.approx(open_room.occluders, rel=0.15)


def test_the_labs_filters_err_as_the_papers() -> None:
    """14.2 inches over both axes; RMSE_max, 61.8 on one (Sec. 6), is less by a tenth at most."""
    lab = known_in(LAB_STUDY, {"kalman": "N2-kalman"}, runs=2)
    assert lab.filters["kalman"] == pytest.approx(14.2, rel=0.05)
    assert axis(lab.occluders) == pytest.approx(61.8, rel=0.1)


def test_units_are_the_scenarios_own() -> None:
    units = units_m()
    assert units[LAB_STUDY.name] == 0.0254
    assert units[PRIOR_STUDY.name] == 0.2
