"""Saturated senders round a base, against an exact Monte Carlo of the protocol and against ns-3 3.37."""

import numpy as np
import pytest

from wsnsim.claims.network.rows import MONTE_CARLO, NS3, peers
from wsnsim.claims.network.runs import Case, run

RUNS, RUN_S = 8, 8.0


def saturated(senders, collision, cca, run_s=RUN_S):
    """Return the case's name in the peers' table, and the mean of each figure over the runs."""
    case = Case(f"star_n{senders}", None, run_s, collision, cca)
    runs = [run(case, seed) for seed in range(RUNS)]
    return case.name, {figure: np.mean([each[figure] for each in runs]) for figure in runs[0]}


@pytest.mark.parametrize(
    ("senders", "run_s", "kbps", "busy", "fails"),
    [
        (2, RUN_S, 122.2, 0.547, 0.168),
        (5, RUN_S, 113.6, 0.797, 0.412),
        (10, 0.75 * RUN_S, 97.2, 0.879, 0.629),
        (20, 0.5 * RUN_S, 66.0, 0.920, 0.845),
    ],
)
def test_as_the_exact_monte_carlo_has_it(senders, run_s, kbps, busy, fails):
    """One standard error of all runs is at most 0.8 % of the throughput, .0025 and .005 of the shares."""
    name, ours = saturated(senders, "destructive", "whole_window", run_s)
    known = {figure: peers()[name, figure, MONTE_CARLO].value for figure in ("throughput_kbps", "cca_busy")}
    assert known == {
        "throughput_kbps": pytest.approx(kbps, abs=0.05),
        "cca_busy": pytest.approx(busy, abs=5e-4),
    }
    assert ours["throughput_kbps"] == pytest.approx(kbps, rel=0.02)
    assert ours["cca_busy"] == pytest.approx(busy, abs=0.01)
    assert ours["attempt_fails"] == pytest.approx(fails, abs=0.015)


@pytest.mark.parametrize(
    ("senders", "collision", "kbps", "within"),
    [
        (5, "destructive", 103.9, 0.03),
        (20, "destructive", 60.5, 0.03),
        (2, "sinr", 131.3, 0.04),
        (20, "sinr", 99.7, 0.04),
    ],
)
def test_as_ns3_has_it(senders, collision, kbps, within):
    """One standard error of 20 s is at most 1 %."""
    name, ours = saturated(senders, collision, "end_of_window", run_s=2.5)
    assert peers()[name, "throughput_kbps", NS3].value == pytest.approx(kbps, abs=0.05)
    assert ours["throughput_kbps"] == pytest.approx(kbps, rel=within)
