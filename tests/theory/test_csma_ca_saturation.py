"""Saturated senders round a base, against an exact Monte Carlo of the protocol and against ns-3 3.37.

Senders start at random instants: the protocol's times are multiples of 64 µs,
so that senders which start together would meet in exact ties for ever.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

RUNS, RUN_S = 10, 5.0


@pytest.mark.parametrize(
    ("senders", "collision", "cca", "known_kbps"),
    [
        (2, "destructive", "whole_window", 122.2),
        (5, "destructive", "whole_window", 113.6),
        (5, "destructive", "end_of_window", 103.9),
        (2, "sinr", "end_of_window", 131.3),
    ],
)
def test_saturated_throughput(senders, collision, cca, known_kbps):
    starts = np.random.default_rng(12)
    throughputs = []
    for seed in range(RUNS):
        bench = RadioBench.star(senders, seed, collision=collision, cca=cca)
        leaves = [f"n{i}" for i in range(1, senders + 1)]
        bench.saturate(leaves, bytes(100), starts.integers(10_000_000, size=senders))
        bench.run(RUN_S)
        throughputs.append(len(bench.delivered_at) * 0.8 / RUN_S)
    mean, standard_error = np.mean(throughputs), np.std(throughputs, ddof=1) / np.sqrt(RUNS)
    assert 3 * standard_error < 0.03 * known_kbps
    assert abs(mean - known_kbps) < 3 * standard_error
