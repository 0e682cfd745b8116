"""Fates, delays and channel access of messages against sums done by hand."""

import pandas as pd
import pytest

from wsnsim.metrics.figures import DROPPED, SUMMARY_KEYS, TRACKING_KEYS
from wsnsim.metrics.packets import access, message_latency, packet_fates
from wsnsim.net.interface import Outcome

MESSAGES = pd.DataFrame(
    [
        ("base", 0.0, 0.010, 100, "delivered"),
        ("base", 0.5, 0.530, 100, "delivered"),
        ("base", 1.0, 1.020, 50, "delivered"),
        ("a", 1.0, 1.100, 40, "delivered"),
        ("a", 1.0, 1.200, 100, "fused"),
        ("base", 2.0, None, 100, "dropped_queue"),
        ("base", 2.0, None, 100, "dropped_queue"),
        ("base", 2.0, None, 100, "dropped_budget"),
        ("base", 3.0, None, 100, "in_flight"),
    ],
    columns=["destination", "created_s", "delivered_s", "bytes", "outcome"],
)


def test_every_message_is_counted_once_by_what_became_of_it():
    figures = packet_fates(MESSAGES, "base", active_s=2.0)
    assert figures["generated"] == 9
    assert figures["delivered"] == 4
    assert figures["fused"] == figures["in_flight"] == figures["dropped_budget"] == 1
    assert figures["dropped_queue"] == 2
    assert figures["dropped_no_ack"] == 0
    parts = ("delivered", "fused", "in_flight", *DROPPED)
    assert sum(figures[key] for key in parts) == figures["generated"]
    # 250 bytes of messages came to the base station in two seconds, those for others left out
    assert figures["throughput_bps"] == 8 * 250 / 2.0
    assert packet_fates(MESSAGES.head(0), "base", active_s=0.0)["throughput_bps"] is None


def test_the_causes_are_those_of_the_network():
    assert {outcome.value for outcome in Outcome} < set(DROPPED) < SUMMARY_KEYS
    assert TRACKING_KEYS < SUMMARY_KEYS


def test_delays_count_from_the_making_of_a_message():
    figures = message_latency(MESSAGES)
    assert figures["latency_mean_s"] == pytest.approx((0.010 + 0.030 + 0.020 + 0.100) / 4)
    assert figures["latency_p50_s"] == pytest.approx(0.025)
    assert figures["latency_max_s"] == pytest.approx(0.100)
    assert set(message_latency(MESSAGES.head(0)).values()) == {None}


def test_attempts_a_frame_and_looks_at_the_channel():
    nodes = pd.DataFrame(
        {
            "frames_tx": [30, 12],
            "frames_retried": [5, 1],
            "attempts": [20, 4],
            "attempts_failed": [6, 0],
            "cca_total": [40, 10],
            "cca_busy": [20, 0],
            "budget_waited_s": [0.5, 0.25],
        }
    )
    assert access(nodes) == {
        "mac_frames_tx": 42,
        "mac_frames_retried": 6,
        "mac_attempts_per_frame": 24 / 18,
        "attempt_failure_ratio": 0.25,
        "cca_busy_ratio": 0.4,
        "budget_waited_s": 0.75,
    }
    silent = access(nodes * 0)
    assert silent["mac_attempts_per_frame"] is silent["cca_busy_ratio"] is None
