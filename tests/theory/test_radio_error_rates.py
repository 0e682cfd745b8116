"""Bit errors of the O-QPSK formula, and what they do to frames on the channel."""

import runpy
from itertools import pairwise
from math import exp
from pathlib import Path

import numpy as np
import pytest

from wsnsim.net.phy.ieee802154 import BIT_NS, O_QPSK, air_time_ns, bit_error_rate
from wsnsim.net.routing.linkquality import weakest_sinr

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]


def ratio(decibels):
    return 10.0 ** (decibels / 10.0)


def log_success(sinr, bits):
    return O_QPSK.log_success(sinr, 0, bits * BIT_NS)


@pytest.mark.parametrize(
    ("sinr_db", "rate"),
    [(-5, 7.517e-2), (-3, 1.642e-2), (-1, 1.149e-3), (0, 1.6153e-4), (1, 1.2912e-5), (2, 5.131e-7)],
)
def test_bit_error_rate(sinr_db, rate):
    digits = len(f"{rate:e}".rstrip("0").split("e")[0].replace(".", "").rstrip("0"))
    half_a_digit = 0.5 * 10.0 ** (1 - digits) / (rate / 10 ** np.floor(np.log10(rate)))
    assert bit_error_rate(ratio(sinr_db)) == pytest.approx(rate, rel=max(1e-4, half_a_digit))


def test_bit_error_rate_is_a_half_in_noise_and_falls_to_nothing():
    assert bit_error_rate(0.0) == pytest.approx(0.5)
    rates = [bit_error_rate(ratio(db)) for db in np.arange(-20, 25, 0.5)]
    assert all(a >= b >= 0.0 for a, b in pairwise(rates))
    assert rates[-1] == 0.0


@pytest.mark.parametrize(("bits", "sinr_db", "success"), [(936, 0, 0.8597), (208, -1, 0.7873)])
def test_frame_success(bits, sinr_db, success):
    assert exp(log_success(ratio(sinr_db), bits)) == pytest.approx(success, abs=1e-4)
    # two stretches multiply
    halves = log_success(ratio(sinr_db), bits / 4) + log_success(ratio(sinr_db), 3 * bits / 4)
    assert exp(halves) == pytest.approx(success, abs=1e-4)


def test_weakest_sinr_is_where_a_frame_just_succeeds():
    sinr = weakest_sinr(O_QPSK, 127, 0.9)
    assert exp(log_success(sinr, 8 * (127 + 6))) == pytest.approx(0.9, abs=1e-9)
    with pytest.raises(ValueError, match="success"):
        weakest_sinr(O_QPSK, 127, 1.0)


def test_air_time():
    assert [air_time_ns(n) for n in (5, 21, 111, 127)] == [352_000, 864_000, 3_744_000, 4_256_000]


def test_equal_frames_at_once_decode_as_the_formula_says():
    """The base locks on one of two hidden senders; 936 bits at 0 dB get through at .859."""
    tried = 600
    places = {"base": (0.0, 0.0, 0.0), "west": (-60.0, 0.0, 0.0), "east": (60.0, 0.0, 0.0)}
    parents = {"base": None, "west": "base", "east": "base"}
    config = {"min_be": 0, "max_be": 0, "max_frame_retries": 0, "mesh_header_bytes": 0, "noise_dbm": -150.0}
    bench = RadioBench(places, parents, **config)
    for k in range(tried):
        for node in ("west", "east"):
            bench.send(node, "base", bytes(100), at_ns=k * 10_000_000)
    bench.run(tried * 0.01)
    arrived = len(bench.delivered_at)
    assert len(bench.dropped_at) == 2 * tried - arrived
    expected = exp(log_success(1.0, 936))
    assert abs(arrived / tried - expected) < 3.5 * np.sqrt(expected * (1 - expected) / tried)
