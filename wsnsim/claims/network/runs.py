"""Runs of the 802.15.4 network as the peers have it: ns-3's radio, no mesh header, a layout's own tree."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wsnsim.claims.network.layouts import Layout, hidden_pair, line, star, stored
from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.links import floor_of, links_between
from wsnsim.net.config import CcaModel, CollisionModel, LinkConfig, RadioConfig
from wsnsim.net.mac.base import MacFamily
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.phy.base import RadioMeter
from wsnsim.net.radio import Stack
from wsnsim.sim.testbed import Tally, Testbed
from wsnsim.types import NodeId, Seconds

NOISE_DBM, SENSITIVITY_DBM, CCA_DBM = -106.99, -111.98, -96.6
"""ns-3's lr-wpan: kT × 5 MHz and no noise figure; frames 5 dB below that are not noticed; energy detection
10 dB above the sensitivity that it was built with."""
DRAIN_S = 5.0
PAYLOAD_BYTES = 100


@dataclass(frozen=True)
class Case:
    """One thing to run, under several seeds.

    Parameters
    ----------
    layout : `star_n5`, `line5`, `hidden2`, or the name of a stored one
    period_s : of each source's packets [s]; None: sources always have something to send
    duration_s : how long packets leave, or how long all of it lasts [s]
    """

    layout: str
    period_s: Seconds | None
    duration_s: Seconds
    collision: CollisionModel = "sinr"
    cca: CcaModel = "end_of_window"

    @property
    def name(self) -> str:
        """What it is called in `peers.csv`."""
        traffic = "saturated" if self.period_s is None else f"T={self.period_s:g}"
        return f"{self.layout} {traffic} {self.collision} {self.cca}"


def layout_named(name: str) -> Layout:
    """Return a layout by its name."""
    if name.startswith("star_n"):
        return star(int(name.removeprefix("star_n")))
    if name.startswith("line"):
        return line(int(name.removeprefix("line")))
    return hidden_pair() if name == "hidden2" else stored(name)


def bed(
    layout: Layout,
    seed: int,
    collision: CollisionModel = "sinr",
    cca: CcaModel = "end_of_window",
    *,
    radio: RadioConfig | None = None,
    family: MacFamily | None = None,
    record_frames: bool = False,
    meters: Mapping[NodeId, RadioMeter] | None = None,
) -> Testbed:
    """Return a network on a layout with ns-3's radio; no mesh header.

    Parameters
    ----------
    radio : another radio, in place of it, `collision` and `cca`
    family : the MAC; None: unslotted CSMA/CA of IEEE 802.15.4
    """
    radio = radio or RadioConfig(
        sensitivity_dbm=SENSITIVITY_DBM,
        noise_dbm=NOISE_DBM,
        cca_threshold_dbm=CCA_DBM,
        cca=cca,
        collision=collision,
    )
    floor_dbm = floor_of(layout.motes, radio.noise_dbm)
    links = links_between(layout.positions, layout.propagation, radio.tx_power_dbm, floor_dbm)
    stack = Stack(family or CsmaCaFamily(), radio, LinkConfig(mesh_header_bytes=0))
    return Testbed(layout.parents, Channel(links), stack, seed, record_frames=record_frames, meters=meters)


def run(case: Case, seed: int) -> dict[str, float]:
    """Run a case once and return its figures."""
    network = bed(layout_named(case.layout), seed, case.collision, case.cca)
    if case.period_s is None:
        network.saturate(bytes(PAYLOAD_BYTES))
        network.run(case.duration_s)
    else:
        network.periodic(case.period_s, round(case.duration_s / case.period_s), bytes(PAYLOAD_BYTES))
        network.run(case.duration_s + DRAIN_S)
    return figures(network.tally(), case.duration_s)


def figures(tally: Tally, duration_s: Seconds) -> dict[str, float]:
    """Return the figures that the peers have too."""
    counters = tally.counters
    acknowledged = counters.attempts - counters.attempts_failed
    return {
        "throughput_kbps": tally.delivered * PAYLOAD_BYTES * 8e-3 / duration_s,
        "pdr": tally.delivered / tally.generated,
        "delay_mean_ms": 1e3 * float(tally.delays_s.mean()),
        "delay_p95_ms": 1e3 * float(np.quantile(tally.delays_s, 0.95)),
        "frames": float(counters.frames_tx),
        "cca_busy": counters.cca_busy / counters.cca_total,
        "attempt_fails": counters.attempts_failed / counters.attempts,
        "acknowledged": acknowledged / (acknowledged + counters.frames_dropped),
    }
