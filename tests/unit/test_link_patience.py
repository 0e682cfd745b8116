"""The link layer's patience: messages that expire, and frames that never find a free channel."""

import runpy
from pathlib import Path

import pytest

from wsnsim.net.interface import Outcome

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
    assert [number for number, _ in outcomes(star)] == [0, waiting]
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
