"""Noise and links that were measured, played again, beside what went in.

References
----------
Lee, Cerpa, Levis, Improving wireless simulation through noise modeling (IPSN 2007): closest-pattern matching.
Municio et al., Simulating 6TiSCH networks (Trans. Emerging Tel. Tech. 30(3), 2019): k7 traces.
"""

import csv
import gzip
from collections import defaultdict
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from wsnsim.claims.network.rows import Allowed, Estimate, Row
from wsnsim.claims.network.section import Section
from wsnsim.errors import OutputError
from wsnsim.net.channel.noise import STEP_NS, NoisePattern, PatternNoise
from wsnsim.net.config import LinkConfig, RadioConfig
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.radio import Stack
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import scenario_from_dict
from wsnsim.sim.channels import run_channel
from wsnsim.sim.link_files import read_noise
from wsnsim.sim.testbed import Testbed

TITLE = "Traces: noise and links"
WORDS = """
Noise by closest-pattern matching, learned from TOSSIM's `meyer-heavy` (196,608 samples of 1 ms): mean,
largest difference of the distribution functions, share of samples above −80 dBm and correlation with the next
sample, of five receivers together beside the trace's. Links of the k7 trace `grenoble_sim`, channel 26: at
each record of a mote it broadcasts 40 frames, alone on the air; what every neighbour of that record receives,
over all records of the link, must lie in the 95 % interval of the binomial distributions recorded, for about
95 % of the links.
"""
NOISE_FILE, LINKS_FILE = Path("tossim/noise/meyer-heavy.txt"), Path("k7/grenoble_sim.k7.gz")
TRACE = "trace"
RECEIVERS, SAMPLES = 5, 100_000
LOUD_DBM = -80.0
MOTES, CHANNEL, REPEATS, GAP_S = 50, "26", 40, 0.05
NORMAL_95 = 1.96
LEAST_VARIANCE = 5.0
"""A link whose count varies less than that is no normal variable."""


def noise(data: Path) -> dict[str, tuple[float, float]]:
    """Return figures of the noise that comes out and of the trace that went in."""
    trace_dbm = read_noise(data / NOISE_FILE)
    names = [f"n{i}" for i in range(RECEIVERS)]
    source = PatternNoise(NoisePattern(trace_dbm), names, RandomStreams(0))
    made = np.array([[source.level_mw(at, k * STEP_NS) for k in range(SAMPLES)] for at in range(RECEIVERS)])
    made_dbm = 10.0 * np.log10(made)
    levels = np.unique(trace_dbm)
    shares = [
        np.searchsorted(np.sort(values), levels, side="right") / values.size
        for values in (np.round(made_dbm.ravel(), 6), trace_dbm)
    ]
    made_lag = np.mean([_lag_1(row) for row in made_dbm])
    return {
        "mean_dbm": (float(made_dbm.mean()), float(trace_dbm.mean())),
        "distribution_distance": (float(np.abs(shares[0] - shares[1]).max()), 0.0),
        "loud_share": (float((made_dbm > LOUD_DBM).mean()), float((trace_dbm > LOUD_DBM).mean())),
        "lag_1_correlation": (float(made_lag), _lag_1(trace_dbm)),
    }


def links(data: Path) -> dict[str, float]:
    """Return the share of links that deliver what was recorded, and the mean delivery."""
    records = _records(data / LINKS_FILE)
    network = _replay(data / LINKS_FILE)
    expected: dict[tuple[str, str], float] = defaultdict(float)
    variance: dict[tuple[str, str], float] = defaultdict(float)
    for (time_s, source), heard in records.items():
        for repeat in range(REPEATS):
            at_ns = round((time_s + repeat * GAP_S) * 1e9)
            network.at(at_ns, partial(network.announce, source, list(heard), bytes(100)))
        for receiver, ratio in heard.items():
            expected[source, receiver] += REPEATS * ratio
            variance[source, receiver] += REPEATS * ratio * (1.0 - ratio)
    network.run(max(time_s for time_s, _ in records) + 60.0)
    unsure = [pair for pair in expected if variance[pair] >= LEAST_VARIANCE]
    off = [abs(network.arrivals[pair] - expected[pair]) / np.sqrt(variance[pair]) for pair in unsure]
    return {
        "links": float(len(expected)),
        "unsure": float(len(unsure)),
        "within": float(np.mean(np.array(off) < NORMAL_95)),
        "delivered": float(sum(network.arrivals.values())),
        "expected": float(sum(expected.values())),
    }


def _lag_1(values: "np.ndarray[Any, np.dtype[np.float64]]") -> float:
    return float(np.corrcoef(values[:-1], values[1:])[0, 1])


def _records(file: Path) -> dict[tuple[float, str], dict[str, float]]:
    """Return the shares recorded, by time [s] and sender, then by receiver; read apart from the simulator."""
    found: dict[tuple[float, str], dict[str, float]] = defaultdict(dict)
    with gzip.open(file, "rt", encoding="utf-8") as text:
        next(text)
        for row in csv.DictReader(text):
            if row["channel"] == CHANNEL:
                time_s = datetime.fromisoformat(f"{row['datetime']}+00:00").timestamp()
                found[time_s, f"n{row['src']}"][f"n{row['dst']}"] = float(row["pdr"])
    first_s = min(time_s for time_s, _ in found)
    return {(time_s - first_s, source): heard for (time_s, source), heard in found.items()}


def _replay(file: Path) -> Testbed:
    """Return the network of a scenario whose links are the recording's."""
    names = [f"n{i}" for i in range(MOTES)]
    nodes = [{"id": name, "position_m": [at, 0, 0]} for at, name in enumerate(names)]
    loss = {"kind": "recorded", "file": str(file.resolve()), "channel": int(CHANNEL)}
    loaded = scenario_from_dict(
        {
            "duration_s": 1.0,
            "system": {"kind": "traffic"},
            "motes": {"base": nodes[0], "nodes": nodes[1:]},
            "network": {"propagation": loss},
        }
    )
    positions = {name: (float(at), 0.0, 0.0) for at, name in enumerate(names)}
    channel = run_channel(loaded.scenario, positions, RandomStreams(0))
    parents = {name: None if name == "n0" else "n0" for name in names}
    stack = Stack(CsmaCaFamily(), RadioConfig(), LinkConfig(mesh_header_bytes=0))
    return Testbed(parents, channel, stack)


def _rows(results: Sequence[Any]) -> list[Row]:
    heard, replayed = results
    case = "closest-pattern matching"
    allowed = {
        "mean_dbm": Allowed(0.2),
        "distribution_distance": Allowed(0.02),
        "loud_share": Allowed(0.01),
        "lag_1_correlation": Allowed(0.03),
    }
    rows = [
        Row(TITLE, case, figure, Estimate(heard[figure][0]), TRACE, Estimate(heard[figure][1]), within)
        for figure, within in allowed.items()
    ]
    case = f"{replayed['links']:.0f} links"
    mean = Estimate(replayed["delivered"]), Estimate(replayed["expected"])
    rows.append(Row(TITLE, case, "frames_received", mean[0], TRACE, mean[1], Allowed(0.01, relative=True)))
    # twice the standard error of a share of .95
    within = Allowed(2.0 * float(np.sqrt(0.95 * 0.05 / replayed["unsure"])))
    case = f"{replayed['unsure']:.0f} links that lose some"
    share = Estimate(replayed["within"])
    rows.append(Row(TITLE, case, "within_95_percent", share, TRACE, Estimate(0.95), within))
    return rows


def section(data: Path) -> Section:
    """Return the section; the traces are public, and not part of the package.

    Parameters
    ----------
    data : folder that holds both files

    Raises
    ------
    OutputError : one of them is not there
    """
    for name in (NOISE_FILE, LINKS_FILE):
        if not (data / name).is_file():
            raise OutputError(f"{data / name}: the trace must exist; name the folder that holds it in --data")
    return Section(TITLE, WORDS, (partial(noise, data), partial(links, data)), _rows)
