"""Bit errors of the 2.4 GHz O-QPSK formula, and what becomes of frames."""

from collections.abc import Sequence
from functools import partial
from math import exp
from typing import Any

from wsnsim.claims.network.rows import THEORY, Allowed, Estimate, Row
from wsnsim.claims.network.section import Section
from wsnsim.net.phy.ieee802154 import BIT_NS, O_QPSK, bit_error_rate

TITLE = "Bit errors"
WORDS = """
IEEE Std 802.15.4-2006, annex E, sec. E.4.1.8; the values are the formula's, computed apart to as many digits
as stand here.
"""
RATES = {-5: (7.517e-2, 5e-6), -3: (1.642e-2, 5e-6), -1: (1.149e-3, 5e-7)}
RATES |= {0: (1.6153e-4, 1.6e-8), 1: (1.2912e-5, 1.3e-9), 2: (5.131e-7, 5.1e-11)}
"""SINR [dB] to the rate and how far off it may be: a part in 10,000, or half of the last digit given."""
FRAMES = {(936, 0): 0.8597, (208, -1): 0.7873}
"""Bits and SINR [dB] to the share of frames that arrive."""


def computed() -> list[float]:
    """Return ours, in the order of the tables."""
    rates = [bit_error_rate(_ratio(sinr_db)) for sinr_db in RATES]
    return rates + [exp(O_QPSK.log_success(_ratio(sinr_db), 0, bits * BIT_NS)) for bits, sinr_db in FRAMES]


def _rows(results: Sequence[Any]) -> list[Row]:
    (ours,) = results
    cases = [(f"{sinr_db} dB", "bit_error_rate", *known) for sinr_db, known in RATES.items()]
    for (bits, sinr_db), share in FRAMES.items():
        cases.append((f"{bits} bits at {sinr_db} dB", "frame_success", share, 1e-4))
    return [
        Row(TITLE, case, figure, Estimate(value), THEORY, Estimate(known), Allowed(amount))
        for (case, figure, known, amount), value in zip(cases, ours, strict=True)
    ]


def _ratio(decibels: float) -> float:
    return float(10.0 ** (decibels / 10.0))


def section() -> Section:
    """Return the section."""
    return Section(TITLE, WORDS, (partial(computed),), _rows)
