"""Traffic over whole trees: against ns-3 3.37 and an exact Monte Carlo, and beyond what a channel carries."""

import gc
import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.net.fragmentation import Reassembler
from wsnsim.net.interface import Outcome

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]


def periodic(bench, period_s, duration_s, rng):
    """Each node's k-th packet of 100 B leaves at a random time of its k-th period; return delays [ms]."""
    sources = [node for node, parent in bench.network.tree.parent.items() if parent is not None]
    left = {}
    for source in sources:
        for k in range(round(duration_s / period_s)):
            at = int((k + rng.random()) * period_s * 1e9)
            left[bench.send(source, bench.network.tree.root, bytes(100), at_ns=at)] = at
    bench.run(duration_s + 5.0)
    assert bench.fates() == dict.fromkeys([(number, bench.network.tree.root) for number in left], 1)
    return np.array([(at - left[d.number]) / 1e6 for at, d, _, _ in bench.delivered_at]), len(left)


def test_ten_nodes_deliver_everything_as_ns3_does(shared):
    layout = json.loads((shared / "reference" / "radio" / "rgg_n10.json").read_text())
    places = {f"n{i}": (x, y, 0.0) for i, (x, y) in enumerate(layout["xy"])}
    parents = {f"n{i}": None if p < 0 else f"n{p}" for i, p in enumerate(layout["parent"])}
    radio = {"noise_dbm": -106.99, "sensitivity_dbm": -111.98, "cca_threshold_dbm": -96.6}
    delays, generated = [], 0
    for seed in range(5):
        bench = RadioBench(places, parents, seed, cca="end_of_window", mesh_header_bytes=0, **radio)
        took, sent = periodic(bench, 10.0, 100.0, np.random.default_rng(seed))
        delays.extend(took)
        generated += sent
    assert len(delays) / generated > 0.995
    standard_error = np.std(delays) / np.sqrt(len(delays))
    # ns-3: 5.866 ms, its five runs' standard error 0.024 ms
    assert abs(np.mean(delays) - 5.866) < 3.5 * np.hypot(standard_error, 0.024)


def test_a_star_of_twenty_as_the_exact_monte_carlo_has_it():
    """T = 0.25 s, destructive, standard CCA: mean delay 8.17 ms, 97.14 % delivered (80,000 packets)."""
    delays, ratios = [], []
    for seed in range(8):
        bench = RadioBench.star(20, seed, collision="destructive")
        took, sent = periodic(bench, 0.25, 10.0, np.random.default_rng(seed))
        delays.append(took.mean())
        ratios.append(len(took) / sent)
    for values, known in ((delays, 8.172), (ratios, 0.9714)):
        standard_error = np.std(values, ddof=1) / np.sqrt(len(values))
        assert abs(np.mean(values) - known) < 3.5 * standard_error
        assert 3.5 * standard_error < 0.05 * known


def held_buffers():
    """Count half-reassembled datagrams in a reassembler anywhere."""
    gc.collect()
    return sum(len(o._partial) for o in gc.get_objects() if isinstance(o, Reassembler))


@pytest.mark.parametrize("collision", ["sinr", "destructive"])
def test_four_times_more_than_the_channel_carries_ends_cleanly(collision):
    """Float64 weights of 1000 particles, four cameras, 4 Hz: 1.02 Mbit/s offered to 250 kbit/s."""
    places = {"base": (16.0, 0.0, 2.0)}
    places |= {f"c{i}": (x, y, 3.0) for i, (x, y) in enumerate([(0, 0), (32, 0), (32, 22), (0, 22)])}
    parents = {"base": None} | {f"c{i}": "base" for i in range(4)}
    bench = RadioBench(places, parents, collision=collision, outbox_datagrams=4)
    for step in range(40):
        for camera in range(4):
            bench.send(f"c{camera}", "base", bytes(8006), at_ns=step * 250_000_000)
    bench.run(10.0)
    assert held_buffers() <= 4 * 4 * 10
    bench.env.run()
    # the last thing that happens is the end of a reassembly timer
    assert bench.env.now < 21_000_000_000
    assert bench.fates() == {(number, "base"): 1 for number in range(160)}
    outcomes = {outcome for *_, outcome in bench.dropped_at}
    assert Outcome.CHANNEL in outcomes
    assert len(bench.delivered_at) < 40
    assert held_buffers() == 0
