"""Traffic over whole trees: against ns-3 3.37 and an exact Monte Carlo, and beyond what a channel carries."""

import gc
import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.claims.network.hidden import MENDED
from wsnsim.claims.network.rows import NS3, peers
from wsnsim.claims.network.runs import Case, run
from wsnsim.net.fragmentation import Reassembler
from wsnsim.net.interface import Outcome

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

TREE_FIGURES = ("pdr", "delay_mean_ms", "delay_p95_ms", "frames")


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


@pytest.mark.parametrize(
    ("layout", "period_s", "duration_s", "pdr_within"),
    [
        ("rgg_n10", 10.0, 100.0, 0.01),
        ("rgg_n10", 1.0, 50.0, 0.01),
        ("rgg_n50", 10.0, 100.0, 0.01),
        ("rgg_n50", 1.0, 20.0, 0.02),
    ],
)
def test_trees_in_the_mode_of_ns3(layout, period_s, duration_s, pdr_within):
    """Five runs against ns-3's five; the whole set, 200 motes among it, stands in reports/network.md."""
    case = Case(layout, period_s, duration_s)
    runs = [run(case, seed) for seed in range(5)]
    ours = {figure: np.mean([each[figure] for each in runs]) for figure in runs[0]}
    known = {figure: peers()[case.name, figure, NS3].value for figure in TREE_FIGURES}
    assert ours["pdr"] == pytest.approx(known["pdr"], abs=pdr_within)
    assert ours["delay_mean_ms"] == pytest.approx(known["delay_mean_ms"], rel=0.06)
    assert ours["delay_p95_ms"] == pytest.approx(known["delay_p95_ms"], rel=0.10)
    # ns-3's are those of 100 s
    assert ours["frames"] * 100.0 / duration_s == pytest.approx(known["frames"], rel=0.05)


@pytest.mark.parametrize(("period_s", "duration_s"), [(0.2, 300.0), (0.05, 100.0)])
def test_two_hidden_senders_as_ns3_has_them(period_s, duration_s):
    """An attempt's failures within 12 %, the delay within 5 %: of ns-3 as it is, and mended."""
    case = Case("hidden2", period_s, duration_s, "destructive")
    runs = [run(case, seed) for seed in range(5)]
    for source in (NS3, MENDED):
        for figure, within in (("attempt_fails", 0.12), ("delay_mean_ms", 0.05)):
            ours = np.mean([each[figure] for each in runs])
            assert ours == pytest.approx(peers()[case.name, figure, source].value, rel=within)


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
