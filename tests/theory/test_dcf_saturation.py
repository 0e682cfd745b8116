"""Saturated stations round one receiver, against Bianchi's model of the DCF.

The model is that of Bianchi (IEEE JSAC 18(3), 2000) with the finite number of
attempts of Chatzimisios, Boucouvalas and Vitsas (GLOBECOM 2003), which is the
standard's and ours: seven, windows of 32 to 1024 slots. A success takes the
frame, SIFS, the acknowledgement and DIFS; a collision the frame and EIFS, after
which those who did not send count on. (Those who did know it after the
acknowledgement's timeout, 142 µs sooner; the model takes no account of that.)
"""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from wsnsim.net.mac.dcf_config import DcfConfig
from wsnsim.net.mac.dcf_family import DcfFamily

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

SLOT_S, SIFS_S, DIFS_S, EIFS_S = 20e-6, 10e-6, 50e-6, 364e-6
WINDOWS = np.array([32, 64, 128, 256, 512, 1024, 1024])
IDEAL = {"collision": "destructive", "noise_dbm": -120.0, "sensitivity_dbm": -110.0, "mesh_header_bytes": 0}


def bianchi(stations):
    """Return a station's probability of sending in a slot, and that of a collision then."""

    def sends(collides):
        stages = collides ** np.arange(len(WINDOWS))
        return stages.sum() / (stages * (WINDOWS + 1) / 2).sum()

    def excess(collides):
        return 1 - (1 - sends(collides)) ** (stations - 1) - collides

    collides = 0.0 if stations == 1 else brentq(excess, 0.0, 1.0)
    return sends(collides), collides


def model_bps(stations, payload_bytes, air_s, ack_s):
    """Return the saturation throughput of the model (Bianchi, eq. 13)."""
    tau, _ = bianchi(stations)
    some = 1 - (1 - tau) ** stations
    one = stations * tau * (1 - tau) ** (stations - 1)
    slot_s = (1 - some) * SLOT_S + one * (air_s + SIFS_S + ack_s + DIFS_S) + (some - one) * (air_s + EIFS_S)
    return one * 8 * payload_bytes / slot_s


def saturated(stations, payload_bytes, simulated_s, seed, **config):
    """Return the throughput [bit/s], the model's, and how many attempts there were and failed."""
    family = DcfFamily(DcfConfig(**config))
    bench = RadioBench.star(stations, seed, family=lambda *_: family, **IDEAL)
    nodes = [f"n{i}" for i in range(1, stations + 1)]
    bench.saturate(
        nodes, bytes(payload_bytes), np.random.default_rng(seed).integers(1_000_000, size=stations)
    )
    bench.run(simulated_s)
    counters = [bench.network.counters(node) for node in nodes]
    attempts, failed = np.sum([(each.attempts, each.attempts_failed) for each in counters], axis=0)
    air_s = family.phy.air_time_ns(36 + payload_bytes) * 1e-9
    ack_s = family.phy.air_time_ns(14, family.phy.control_mode) * 1e-9
    measured = len(bench.delivered_at) * 8 * payload_bytes / simulated_s
    return measured, model_bps(stations, payload_bytes, air_s, ack_s), attempts, failed


@pytest.mark.parametrize(
    ("stations", "payload_bytes", "config"),
    [
        (2, 1000, {}),
        (5, 1000, {}),
        (10, 1000, {}),
        (20, 1000, {}),
        (5, 500, {"rate_mbps": 1}),
        (5, 1000, {"rate_mbps": 2, "preamble": "short"}),
        (10, 1500, {"rate_mbps": 5.5, "preamble": "short"}),
        (10, 1500, {"rate_mbps": 11, "preamble": "short", "basic_rate_mbps": 2}),
    ],
)
def test_saturation_throughput_is_that_of_bianchis_model(test_seed, stations, payload_bytes, config):
    simulated_s = 1.5 if config.get("rate_mbps", 11) > 2 else 4.0
    runs = [saturated(stations, payload_bytes, simulated_s, (test_seed, run), **config) for run in range(2)]
    measured, model, attempts, failed = np.array(runs).T
    assert measured.mean() == pytest.approx(model[0], rel=0.03)
    _, collides = bianchi(stations)
    # attempts fail two or three at a time: three times the variance of independent ones
    standard_error = np.sqrt(3 * collides * (1 - collides) / attempts.sum())
    assert abs(failed.sum() / attempts.sum() - collides) < 3.5 * standard_error


def test_a_single_station_has_the_throughput_of_its_closed_form(test_seed):
    """Data 1673 µs, SIFS, ACK 304 µs, DIFS and 15.5 slots in the mean: 6817 kbit/s."""
    measured, model, _, failed = saturated(1, 2000, 6.0, test_seed)
    closed_form = 16000 / (1673e-6 + 10e-6 + 304e-6 + 50e-6 + 15.5 * SLOT_S)
    assert model == pytest.approx(closed_form)
    assert failed == 0
    # one standard error: slots' deviation of 185 µs over 2347 µs, in 2556 frames, is 0.16 %
    assert measured == pytest.approx(closed_form, rel=0.005)


def test_the_more_stations_the_longer_the_windows():
    taus, collisions = np.array([bianchi(n) for n in range(1, 21)]).T
    assert taus[0] == pytest.approx(2 / 33)
    assert np.all(np.diff(taus) < 0)
    assert np.all(np.diff(collisions) > 0)
