"""What a CC2420 takes for a frame, as a network runs it: sending, hearing, waiting, sleeping.

At 3 V the chip draws 17.4 mA to send at 0 dBm and 18.8 mA to receive or listen.
A payload of 100 B is on the air for 192 µs + 111 · 32 µs = 3.744 ms.
"""

import runpy
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
RadioBench = runpy.run_path(str(TESTS / "radio_bench.py"))["RadioBench"]
LedgerMeter = runpy.run_path(str(TESTS / "sleep_bench.py"))["LedgerMeter"]
AIR_S = 117 * 32e-6


def metered(count, until_s=10.0):
    """Send messages of 100 B over one hop, and return what the two radios drew and how long, by cause."""
    meters = {"n0": LedgerMeter(), "n1": LedgerMeter()}
    bench = RadioBench.star(1, meters=meters)
    for k in range(count):
        bench.send("n1", "n0", bytes(100), at_ns=k * 50_000_000)
    bench.run(until_s)
    now = bench.env.now
    assert len(bench.delivered_at) == count
    for meter in meters.values():
        seconds = meter.ledger.seconds(now)
        assert sum(round(spent * 1e9) for spent in seconds.values()) == now
    return meters, now


def test_a_payload_of_100_bytes_costs_195_4_microjoules_to_send_and_211_2_to_hear():
    meters, now = metered(100)
    sender, base = (meters[node].ledger.drawn_j(now) for node in ("n1", "n0"))
    assert sender["radio", "transmit"] / 100 == pytest.approx(195.4e-6, rel=1e-3)
    assert base["radio", "receive"] / 100 == pytest.approx(211.2e-6, rel=1e-3)
    # the acknowledgement of 352 µs, the other way
    assert base["radio", "transmit"] / 100 == pytest.approx(352e-6 * 0.0522, rel=1e-3)
    assert sender["radio", "receive"] / 100 == pytest.approx(352e-6 * 0.0564, rel=1e-3)


def test_a_radio_that_listens_all_the_time_drains_18_720_joules_in_3_842_days():
    meters, now = metered(0)
    drawn_j = meters["n1"].ledger.total_drawn_j(now)
    assert 18_720.0 / (drawn_j / (now / 1e9)) / 86_400 == pytest.approx(3.842, rel=1e-3)


def test_the_mean_power_of_a_sender_follows_from_its_share_of_the_air():
    """Sending draws less than listening: at 20 frames a second it saves, and no more than this."""
    meters, now = metered(200)
    share = 200 * AIR_S / (now / 1e9)
    mean_w = meters["n1"].ledger.total_drawn_j(now) / (now / 1e9)
    assert mean_w == pytest.approx(0.0564 - share * (0.0564 - 0.0522), rel=1e-6)
