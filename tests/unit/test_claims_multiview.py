"""Planted worlds: one in which every claim of the paper is true, and one in which each is false."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from wsnsim.claims.multiview.claims import CLAIMS
from wsnsim.claims.multiview.evidence import DEFAULT, PUBLISHED
from wsnsim.claims.multiview.evidence import FIGURES as PAGE_FIGURES
from wsnsim.claims.multiview.page import FIGURES
from wsnsim.claims.record import FIGURES as RECORD_FIGURES
from wsnsim.claims.rules import Verdict, judged
from wsnsim.metrics.figures import SUMMARY_KEYS

_SPEC = importlib.util.spec_from_file_location("claims_bench", Path(__file__).parents[1] / "claims_bench.py")
bench = importlib.util.module_from_spec(_SPEC)
sys.modules[_SPEC.name] = bench  # dataclasses look their module up
_SPEC.loader.exec_module(bench)

AS_CLAIMED = bench.Plant(
    error_m={
        "B/T0": 0.12,
        "B/T1": 0.06,
        "B/T2": 0.06,
        "B/T3": 0.15,
        "B/T4": 0.15,
        "B/P": 0.5,
        "A/T0": 0.05,
        "A/T1": 0.06,
        "A/T2": 0.06,
        "A/T3": 0.05,
        "A/T4": 0.05,
        "A/P": 0.07,
        "LCR/P": 0.07,
    },
    single={"T0": 3.0, "T1": 3.0, "T2": 3.0},
    after={"T0": 3.0},
    pixels={"B/P": -1.0, "B/T3": -1.0, "B/T4": -1.0},
    turning=1.2,
    bytes_with_relays={"A/T0": 8_000.0},
    measured={"T0-float64": 0.05},
    cycles={"P": 1e6, "T3": 1e6, "T4": 1e6},
)
"""T0's load in A is what the paper calls 128 kbit/s."""
NEAR = [f"{world}/{tracker}" for world in ("A", "LCR") for tracker in ("P", "T3", "T4")]
THE_OPPOSITE = bench.Plant(
    error_m={
        "B/T0": 0.03,
        "B/T1": 0.04,
        "B/T2": 0.06,
        "B/T3": 0.03,
        "B/T4": 0.04,
        "B/P": 0.03,
        "A/T0": 0.1,
        "A/T1": 0.03,
        "A/T2": 0.06,
        **dict.fromkeys(NEAR, 0.2),
    },
    lost=frozenset([*NEAR, "FGH/T2"]),
    after={"T2": 3.0},
    pixels={"P": 1.0, "T3": 1.0, "T4": 1.0, "T0": -1.0, "T1": -1.0, "T2": -1.0},
    turning=0.7,
    turning_px=1.5,
    bytes_with_relays={"T0": 1e3, "T1": 1e3, "T2": 2e3, "T3": 6e3, "T4": 1e3, "P": 3e3, "A/T0": 6e4},
    cycles={"P": 1e9, "T3": 1e9, "T4": 1e9},
    share={"LCR": 0.5, "FGH": 6.0, "B": 6.0},
)


@pytest.fixture(scope="module")
def studies():
    return bench.shipped_studies()


@pytest.fixture(scope="module")
def as_claimed(studies):
    return bench.made_up_evidence(studies, AS_CLAIMED)


@pytest.fixture(scope="module")
def the_opposite(studies):
    return bench.made_up_evidence(studies, THE_OPPOSITE)


def told(findings) -> str:
    return "; ".join(f"{each.part.what}: {each.value}" for each in findings if each.mark is not None)


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.key)
def test_what_is_planted_is_found(claim, as_claimed, the_opposite) -> None:
    for form in (DEFAULT, PUBLISHED):
        found = judged(claim, as_claimed.seen_as(form))
        if form == DEFAULT or found.verdict is not Verdict.NOT_RUN:
            assert found.verdict is Verdict.REPRODUCED, told(found.findings)
            opposite = judged(claim, the_opposite.seen_as(form))
            assert opposite.verdict is Verdict.NOT_REPRODUCED, told(opposite.findings)


def test_each_form_is_judged_by_its_own_runs(studies) -> None:
    """P is poor as published only: the runs of the default cells must not decide for the others."""
    plant = bench.Plant(error_m={"P": 0.06})
    evidence = bench.made_up_evidence(studies, plant)
    table = evidence.variants.runs
    rows = table["name"] == "B/P-published"
    table.loc[rows, "position_error_mean_m"] *= 10
    claim = next(each for each in CLAIMS if each.key == "p-poor")
    assert judged(claim, evidence).verdict is Verdict.NOT_REPRODUCED
    assert judged(claim, evidence.seen_as(PUBLISHED)).verdict is Verdict.REPRODUCED


def test_rooms_that_were_not_run_as_published_are_told_apart(as_claimed) -> None:
    atrium = next(each for each in CLAIMS if each.key == "atrium")
    assert judged(atrium, as_claimed).verdict is Verdict.REPRODUCED
    rooms = as_claimed.deployed
    left = {name: steps for name, steps in rooms.steps.items() if not name.endswith("-published")}
    default_only = replace(
        rooms,
        runs=rooms.runs[~rooms.runs["name"].str.endswith("-published")],
        cells=rooms.cells[~rooms.cells["name"].str.endswith("-published")],
        steps=left,
    )
    evidence = replace(as_claimed, deployed=default_only)
    assert judged(atrium, evidence.seen_as(PUBLISHED)).verdict is Verdict.NOT_RUN


def test_every_figure_is_one_of_a_runs_summary() -> None:
    assert {*PAGE_FIGURES, *RECORD_FIGURES} <= SUMMARY_KEYS


def test_motes_are_those_that_the_page_names(studies) -> None:
    for run in studies["multiview-radio"].runs:
        assert run.loaded.scenario.motes.default.platform == "imote2_416"
        assert run.loaded.scenario.system["encoding"] in ("uint8", "float64")


def test_claims_have_different_keys() -> None:
    assert len({claim.key for claim in CLAIMS}) == len(CLAIMS)


@pytest.mark.parametrize("name", ["radio", "lcr"])
def test_a_figure_is_the_same_twice_and_says_neither_when_nor_where(name: str, as_claimed) -> None:
    first, second = (FIGURES[name](as_claimed) for _ in range(2))
    assert first == second
    assert "<dc:date>" not in first
    assert "currentColor" in first  # ink of the reader's scheme
    assert "prefers-color-scheme: dark" in first
    assert str(Path.cwd()) not in first
