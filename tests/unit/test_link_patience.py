"""The link layer's patience: messages that expire, and frames that never find a free channel."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.net.interface import Outcome
from wsnsim.net.link import Link

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

EIGHT_KB = bytes(8000)
"""81 fragments of a star without mesh header: 0.6 s on an idle channel."""


def outcomes(bench):
    return [(datagram.number, outcome) for _, datagram, _, outcome in bench.dropped_at]


def test_a_message_that_expires_is_dropped_then_and_its_rest_never_sent():
    star = RadioBench.star(1, seed=3)
    late = star.send("n1", "n0", EIGHT_KB, expires_ns=100_000_000)
    star.run(5.0)
    assert outcomes(star) == [(late, Outcome.EXPIRED)]
    (at, *_) = star.dropped_at[0]
    assert 100_000_000 <= at < 120_000_000  # the frame on the air is finished first
    # 0.1 s hold at most 0.1 / 4.0 ms frames, nothing near all 81
    assert 5 < star.network.counters("n1").frames_tx < 26


def test_an_expired_message_does_not_hold_up_the_next():
    star = RadioBench.star(1, seed=3)
    star.send("n1", "n0", EIGHT_KB, expires_ns=50_000_000)
    waiting = star.send("n1", "n0", EIGHT_KB, expires_ns=40_000_000)
    fresh = star.send("n1", "n0", bytes(50))
    star.run(1.0)
    assert sorted(outcomes(star), key=lambda row: row[0]) == [
        (0, Outcome.EXPIRED),
        (waiting, Outcome.EXPIRED),
    ]
    ((at, datagram, _, _),) = star.delivered_at
    assert datagram.number == fresh
    assert at < 70_000_000


def test_a_message_in_time_is_not_touched():
    star = RadioBench.star(1, seed=3)
    star.send("n1", "n0", EIGHT_KB, expires_ns=3_000_000_000)
    star.run(3.0)
    assert len(star.delivered_at) == 1
    assert star.dropped_at == []


@pytest.mark.parametrize("retries", [0, 8])
def test_a_busy_channel_costs_a_frame_only_where_the_link_layer_gives_up(retries):
    """Ten nodes begin at once: the bare standard's five tries last about 18 ms, their frames 45 ms."""
    dropped = 0
    for seed in range(10):
        star = RadioBench.star(10, seed=seed, max_channel_retries=retries)
        for node in range(1, 11):
            star.send(f"n{node}", "n0", bytes(100))
        star.run(2.0)
        assert len(star.delivered_at) + len(star.dropped_at) == 10
        dropped += sum(outcome is Outcome.CHANNEL for _, outcome in outcomes(star))
    assert dropped > 10 if retries == 0 else dropped == 0


def test_a_frame_that_starts_again_is_passed_up_once(monkeypatch):
    """A lost acknowledgement and then a busy channel: the same sequence number comes again, and is known."""
    passed = []
    received = Link.received

    def overheard(link, payload, source, cargo):
        if link is at_base:
            passed.append(cargo)
        received(link, payload, source, cargo)

    monkeypatch.setattr(Link, "received", overheard)
    for seed in range(20):
        star = RadioBench.star(10, seed=seed, max_channel_retries=5, collision="destructive")
        for node in range(1, 11):
            for k in range(5):
                star.send(f"n{node}", "n0", bytes(30), at_ns=k * 30_000_000)
        at_base = star.network._layers["n0"]
        passed.clear()
        star.run(3.0)
        assert len(passed) == len({id(cargo) for cargo in passed})
        assert sum(star.fates().values()) == 50


@pytest.mark.parametrize("seed", range(10))
def test_every_fate_is_told_once_among_expiries_deaths_and_busy_channels(seed, test_seed):
    rng = np.random.default_rng([seed, test_seed])
    line = RadioBench.line(
        4, seed=seed, max_channel_retries=int(rng.integers(0, 4)), queue_frames=5, outbox_datagrams=3
    )
    sent = set()
    for _ in range(60):
        source = f"n{rng.integers(1, 4)}"
        at_ns = int(rng.integers(0, 3_000_000_000))
        patience = int(rng.integers(0, 400_000_000))
        expires = None if rng.random() < 0.3 else at_ns + patience
        size = int(rng.integers(0, 900))
        line.at(
            at_ns,
            lambda source=source, size=size, expires=expires: sent.add(
                (line.send(source, "n0", bytes(size), expires_ns=expires), "n0")
            ),
        )
    if seed % 2:
        line.at(1_500_000_000, lambda: line.network.stop_node("n2"))
    line.run(30.0)
    fates = line.fates()
    assert set(fates) <= sent
    assert all(times == 1 for times in fates.values())
    assert set(fates) == sent, "after the last timeout nothing is in flight"
