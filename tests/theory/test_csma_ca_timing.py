"""One hop of unslotted CSMA/CA, to the nanosecond: every figure follows from the standard's constants."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chisquare

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

BACKOFF_NS = 320_000
AIR_NS = {10: 864_000, 50: 2_144_000, 100: 3_744_000}
SENSE_AND_TURN_NS = 128_000 + 192_000
CONFIRM_NS = 192_000 + 352_000
PERIOD_NS = 20_000_000
PACKETS = 800


def one_hop_delays(payload_bytes, **config):
    bench = RadioBench.star(1, record_frames=True, **config)
    for k in range(PACKETS):
        bench.send("n1", "n0", bytes(payload_bytes), at_ns=k * PERIOD_NS)
    bench.run(PACKETS * PERIOD_NS / 1e9)
    assert len(bench.delivered_at) == PACKETS
    return bench, np.array([at - d.number * PERIOD_NS for at, d, _, _ in bench.delivered_at])


@pytest.mark.parametrize(("payload_bytes", "least_ns"), [(10, 1_184_000), (50, 2_464_000), (100, 4_064_000)])
def test_one_hop_takes_one_of_eight_equally_likely_times(payload_bytes, least_ns):
    bench, delays = one_hop_delays(payload_bytes)

    assert least_ns == SENSE_AND_TURN_NS + AIR_NS[payload_bytes]
    assert delays.min() == least_ns
    assert delays.max() == least_ns + 7 * BACKOFF_NS == least_ns + 2_240_000
    drawn, counts = np.unique((delays - least_ns) // BACKOFF_NS, return_counts=True)
    assert np.array_equal(drawn * BACKOFF_NS, np.unique(delays - least_ns))
    assert list(drawn) == list(range(8))
    assert chisquare(counts).pvalue > 1e-3
    standard_error = BACKOFF_NS * np.sqrt((64 - 1) / 12 / PACKETS)
    assert delays.mean() == pytest.approx(least_ns + 3.5 * BACKOFF_NS, abs=3.5 * standard_error)

    ends = [round(row.time_s * 1e9) + 352_000 for row in bench.frames if row.kind == "ack"]
    assert [row.outcome for row in bench.frames if row.kind == "ack"] == ["received"] * PACKETS
    confirmed = np.array(ends) - np.array([at for at, *_ in bench.delivered_at])
    assert set(confirmed) == {CONFIRM_NS} == {544_000}


def test_the_mesh_header_costs_five_octets_on_the_air():
    _, delays = one_hop_delays(50, mesh_header_bytes=5)
    assert delays.min() == 2_464_000 + 5 * 32_000


def test_a_saturated_sender_keeps_the_long_space_and_reaches_the_known_throughput():
    bench = RadioBench.star(1)
    bench.saturate(["n1"], bytes(100), [0])
    simulated_s = 60.0
    bench.run(simulated_s)

    times = np.array([at for at, *_ in bench.delivered_at])
    cycles = np.diff(times) - (CONFIRM_NS + 640_000 + SENSE_AND_TURN_NS + AIR_NS[100])
    assert set(cycles) == {k * BACKOFF_NS for k in range(8)}
    # one standard error is 0.12 % of 125.63 kbit/s
    assert len(times) * 800 / simulated_s == pytest.approx(125_630, rel=0.005)


def test_a_short_frame_is_followed_by_the_short_space():
    bench = RadioBench.star(1)
    bench.saturate(["n1"], bytes(7), [0])
    bench.run(2.0)
    cycles = np.diff([at for at, *_ in bench.delivered_at])
    assert min(cycles) == CONFIRM_NS + 192_000 + SENSE_AND_TURN_NS + 192_000 + 18 * 32_000


def test_a_relay_answers_turns_back_and_then_contends():
    bench = RadioBench.line(5)
    packets, period_ns = 400, 100_000_000
    for k in range(packets):
        bench.send(f"n{1 + k % 4}", "n0", bytes(100), at_ns=k * period_ns)
    bench.run(packets * period_ns / 1e9)

    delays_ms = [(at - d.number * period_ns) / 1e6 for at, d, _, _ in bench.delivered_at]
    hops = np.array([hops for *_, hops in bench.delivered_at])
    expected_ms = hops * 5.184 + (hops - 1) * (0.544 + 0.192)
    assert expected_ms.mean() == pytest.approx(14.064)
    # the sum of `hops` uniform draws of 0 to 7 periods of 0.32 ms
    standard_error_ms = np.sqrt(hops.sum() * (64 - 1) / 12) * 0.32 / packets
    assert abs(np.mean(delays_ms) - expected_ms.mean()) < 3.5 * standard_error_ms
    least_ms = hops * 4.064 + (hops - 1) * 0.736
    assert np.all(np.array(delays_ms) >= least_ms - 1e-9)
