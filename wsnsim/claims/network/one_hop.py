"""One hop without contention: every figure follows from the standard's constants."""

from collections.abc import Mapping, Sequence
from functools import partial
from math import nan
from typing import Any

import numpy as np

from wsnsim.claims.network.layouts import star
from wsnsim.claims.network.rows import NS3, THEORY, Allowed, Estimate, Row, beside_peers, mean_of, peers
from wsnsim.claims.network.runs import Case, bed, run
from wsnsim.claims.network.section import Section

TITLE = "One hop, one sender, one line"
WORDS = """
A single sender 10 m from the sink, one packet every 20 ms. The least delay is assessment 128 µs, turnaround
192 µs and the frame; the first backoff adds 0 to 7 periods of 320 µs, each as likely; the acknowledgement
ends 192 + 352 µs after the frame. ns-3's times have 33 ns of propagation in them, which ours leaves out.
`line5`: five motes in a row, each the parent of the next; each hop takes 5.184 ms on average, and a relay
answers and turns round before its own CSMA begins (0.736 ms).
"""
PAYLOADS_BYTES = (10, 50, 100)
PACKETS, PERIOD_NS = 20_000, 20_000_000
BACKOFF_NS, BACKOFFS = 320_000, 8
ACK_AIR_S = 352e-6
SATURATED = Case("star_n1", None, 400.0)
LINE = Case("line5", 10.0, 1000.0)
LINE_SEEDS = 5
MICROSECOND_MS = 1e-3


def least_ms(payload_bytes: int) -> float:
    """Return CCA, turnaround and the air time of a frame with 11 B of MAC and 6 B of PHY [ms]."""
    return 0.128 + 0.192 + 0.032 * (payload_bytes + 11 + 6)


def one_hop(payload_bytes: int, packets: int = PACKETS) -> dict[str, float]:
    """Send packets that do not meet and return the figures of their delays."""
    from scipy.stats import chisquare

    network = bed(star(1), seed=payload_bytes, record_frames=True)
    for k in range(packets):
        network.at(k * PERIOD_NS, partial(network.send, "n1", "n0", bytes(payload_bytes)))
    network.run(packets * PERIOD_NS / 1e9)
    delays_ms = 1e3 * network.tally().delays_s
    drawn, counts = np.unique(np.rint(delays_ms * 1e6) // BACKOFF_NS, return_counts=True)
    left_s = np.arange(packets) * PERIOD_NS / 1e9
    answered_ms = [1e3 * (row.time_s + ACK_AIR_S) for row in network.frames if row.kind == "ack"]
    # a time on the clock is a float of seconds here, good to a nanosecond
    confirmed_ms = np.round(np.array(answered_ms) - 1e3 * left_s - delays_ms, 6)
    return {
        "delay_min_ms": float(delays_ms.min()),
        "delay_span_ms": float(delays_ms.max() - delays_ms.min()),
        "delay_mean_ms": float(delays_ms.mean()),
        "delay_mean_ms_error": float(delays_ms.std(ddof=1) / np.sqrt(packets)),
        "values": float(len(drawn)),
        "chi_square_p": float(chisquare(counts).pvalue),
        "confirmed_later_min_ms": float(confirmed_ms.min()),
        "confirmed_later_max_ms": float(confirmed_ms.max()),
    }


def _one_hop_rows(payload_bytes: int, got: Mapping[str, float]) -> list[Row]:
    case = f"one hop {payload_bytes} B"
    mean_ms = least_ms(payload_bytes) + 3.5 * BACKOFF_NS / 1e6
    exact = Allowed(MICROSECOND_MS)
    expected: list[tuple[str, float, Allowed | None]] = [
        ("delay_min_ms", least_ms(payload_bytes), exact),
        ("delay_span_ms", 2.240, exact),
        ("values", BACKOFFS, Allowed(0.0)),
        ("confirmed_later_min_ms", 0.544, exact),
        ("confirmed_later_max_ms", 0.544, exact),
    ]
    rows = [
        Row(TITLE, case, figure, Estimate(got[figure]), THEORY, Estimate(value), allowed)
        for figure, value, allowed in expected
    ]
    # any p above .001 will do: half way, and half of the way
    p = Allowed(0.4995)
    rows.append(Row(TITLE, case, "chi_square_p", Estimate(got["chi_square_p"]), THEORY, Estimate(0.5005), p))
    mean = Estimate(got["delay_mean_ms"], got["delay_mean_ms_error"], PACKETS)
    allowed = Allowed(0.015, relative=True)
    rows.append(Row(TITLE, case, "delay_mean_ms", mean, THEORY, Estimate(mean_ms), allowed))
    rows.append(
        Row(
            TITLE, case, "delay_mean_ms", mean, NS3, peers()[case, "delay_mean_ms", NS3], Allowed(0.015, True)
        )
    )
    return rows


def line_mean_ms() -> float:
    """Return the mean delay of a line of five motes, one to four hops away [ms]."""
    hops = np.arange(1, 5)
    return float(np.mean(hops * (least_ms(100) + 3.5 * BACKOFF_NS / 1e6) + (hops - 1) * (0.544 + 0.192)))


def saturated_kbps() -> float:
    """Return what one saturated sender of 100 B gets through: the LIFS of 640 µs stands between frames."""
    cycle_ms = least_ms(100) + 3.5 * BACKOFF_NS / 1e6 + 0.544 + 0.640
    return 800.0 / cycle_ms


def _rows(results: Sequence[Any]) -> list[Row]:
    rows: list[Row] = []
    for payload_bytes, got in zip(PAYLOADS_BYTES, results, strict=False):
        rows += _one_hop_rows(payload_bytes, got)
    sender, *lines = results[len(PAYLOADS_BYTES) :]
    ours = Estimate(sender["throughput_kbps"], nan)
    name, allowed = SATURATED.name, Allowed(0.005, relative=True)
    rows.append(Row(TITLE, name, "throughput_kbps", ours, THEORY, Estimate(saturated_kbps()), allowed))
    rows += beside_peers(TITLE, name, [sender], {("throughput_kbps", NS3): allowed})
    mean = mean_of([run["delay_mean_ms"] for run in lines])
    allowed = Allowed(0.015, relative=True)
    rows.append(Row(TITLE, LINE.name, "delay_mean_ms", mean, THEORY, Estimate(line_mean_ms()), allowed))
    peer: dict[tuple[str, str], Allowed | None] = {
        ("delay_mean_ms", NS3): allowed,
        ("pdr", NS3): Allowed(0.01),
        ("frames", NS3): Allowed(0.05, relative=True),
    }
    return rows + beside_peers(TITLE, LINE.name, lines, peer)


def section() -> Section:
    """Return the section."""
    tasks = [partial(one_hop, payload_bytes) for payload_bytes in PAYLOADS_BYTES]
    runs = [partial(run, SATURATED, 0), *(partial(run, LINE, seed) for seed in range(LINE_SEEDS))]
    return Section(TITLE, WORDS, (*tasks, *runs), _rows)
