"""Saturated 802.11b stations against Bianchi's model of the distributed coordination function.

References
----------
Bianchi, Performance analysis of the IEEE 802.11 distributed coordination function (IEEE JSAC 18(3), 2000),
eq. 13; the finite number of attempts is that of Chatzimisios, Boucouvalas, Vitsas (GLOBECOM 2003).
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from wsnsim.claims.network.dcf_slots import failures
from wsnsim.claims.network.layouts import star
from wsnsim.claims.network.rows import MONTE_CARLO, Allowed, Estimate, Row, mean_of
from wsnsim.claims.network.runs import bed
from wsnsim.claims.network.section import Section
from wsnsim.net.mac.dcf_config import DcfConfig
from wsnsim.net.mac.dcf_family import DcfFamily
from wsnsim.rng import RandomStreams

TITLE = "802.11b: saturated stations"
BIANCHI = "Bianchi"
WORDS = """
Stations on a circle of 10 m that always have 1000 B to send to the sink: 11 Mbit/s, long preamble,
acknowledgements at 1 Mbit/s, seven attempts; whatever overlaps is lost. Bianchi's model with a finite number
of attempts: all stations see the same chance of a collision in every slot. As the standard has it, counters
stand still while somebody sends, and so they do in the Monte Carlo, a process of slots; Bianchi's chain
counts a busy slot down too, by which windows last longer and two stations collide less, while of many more
may be due right after a frame, where only its sender can be.
"""
STATIONS = (1, 2, 5, 10, 20)
PAYLOAD_BYTES, RUNS, RUN_S = 1000, 8, 3.0
ATTEMPTS = 100_000
"""Of the Monte Carlo, in each of as many runs."""
SLOT_S, SIFS_S, DIFS_S, EIFS_S = 20e-6, 10e-6, 50e-6, 364e-6
WINDOWS = np.array([32, 64, 128, 256, 512, 1024, 1024])
OVERHEAD_BYTES, ACK_BYTES = 36, 14


def bianchi(stations: int) -> tuple[float, float]:
    """Return a station's chance of sending in a slot, and that of a collision then."""
    from scipy.optimize import brentq

    def sends(collides: float) -> float:
        stages = collides ** np.arange(len(WINDOWS))
        return float(stages.sum() / (stages * (WINDOWS + 1) / 2).sum())

    def excess(collides: float) -> float:
        return 1.0 - (1.0 - sends(collides)) ** (stations - 1) - collides

    collides = 0.0 if stations == 1 else float(brentq(excess, 0.0, 1.0))
    return sends(collides), collides


def model_kbps(stations: int) -> float:
    """Return the saturation throughput of the model (eq. 13)."""
    phy = DcfFamily(DcfConfig()).phy
    air_s = 1e-9 * phy.air_time_ns(OVERHEAD_BYTES + PAYLOAD_BYTES)
    ack_s = 1e-9 * phy.air_time_ns(ACK_BYTES, phy.control_mode)
    tau, _ = bianchi(stations)
    some = 1.0 - (1.0 - tau) ** stations
    one = stations * tau * (1.0 - tau) ** (stations - 1)
    success_s, collision_s = air_s + SIFS_S + ack_s + DIFS_S, air_s + EIFS_S
    slot_s = (1.0 - some) * SLOT_S + one * success_s + (some - one) * collision_s
    return 8e-3 * one * PAYLOAD_BYTES / slot_s


def saturated(stations: int, seed: int) -> dict[str, float]:
    """Run it once and return throughput [kbit/s] and the share of attempts that fail."""
    network = bed(star(stations), seed, "destructive", "whole_window", family=DcfFamily(DcfConfig()))
    network.saturate(bytes(PAYLOAD_BYTES))
    network.run(RUN_S)
    tally = network.tally()
    return {
        "throughput_kbps": 8e-3 * PAYLOAD_BYTES * tally.delivered / RUN_S,
        "attempt_fails": tally.counters.attempts_failed / tally.counters.attempts,
    }


def frozen(stations: int, seed: int) -> float:
    """Return the share of attempts that fail where counters stand still in busy slots."""
    rng = RandomStreams(seed).stream("claims.dcf", stations)
    return failures(stations, WINDOWS.tolist(), ATTEMPTS, rng)


def _rows(results: Sequence[Any]) -> list[Row]:
    rows = []
    counted = results[len(STATIONS) * RUNS :]
    for at, stations in enumerate(STATIONS):
        batch = slice(at * RUNS, (at + 1) * RUNS)
        runs = results[batch]
        case = f"{stations} stations"
        known = {"throughput_kbps": model_kbps(stations), "attempt_fails": bianchi(stations)[1]}
        allowed = {"throughput_kbps": Allowed(0.03, relative=True), "attempt_fails": None}
        for figure, value in known.items():
            ours = mean_of([run[figure] for run in runs])
            rows.append(Row(TITLE, case, figure, ours, BIANCHI, Estimate(value), allowed[figure]))
        fails, slots = mean_of([run["attempt_fails"] for run in runs]), mean_of(counted[batch])
        rows.append(Row(TITLE, case, "attempt_fails", fails, MONTE_CARLO, slots, Allowed(0.015)))
    return rows


def section() -> Section:
    """Return the section."""
    studies = (saturated, frozen)
    tasks = tuple(partial(study, n, seed) for study in studies for n in STATIONS for seed in range(RUNS))
    return Section(TITLE, WORDS, tasks, _rows)
