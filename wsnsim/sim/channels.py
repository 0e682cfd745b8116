"""The channel of a run from its scenario: who arrives where, and what changes there while it lasts."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wsnsim.net.channel.channel import Channel, Fading, Losses, Noise
from wsnsim.net.channel.fading import BlockFading
from wsnsim.net.channel.links import Links, floor_of
from wsnsim.net.channel.noise import NoisePattern, PatternNoise, WhiteNoise
from wsnsim.net.channel.propagation import mean_of
from wsnsim.net.channel.recorded import ConstantLosses, RecordedLosses, Track
from wsnsim.net.routing.linkquality import weakest_usable_dbm
from wsnsim.net.routing.search import radio_links
from wsnsim.rng import RandomStreams
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_channel import NoiseTrace
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.scenario.schema_propagation import LinkTable, RecordedLinks
from wsnsim.sim.link_files import GainTable, LinkRecord, read_gains, read_k7, read_noise, read_ratios
from wsnsim.sim.macs import mac_family, radio_config
from wsnsim.sim.propagations import Positions, node_propagation
from wsnsim.types import FloatArray
from wsnsim.units import to_ns

_CLEAR = 1.0 - 1e-6
"""Share of the longest frames that get through the noise where a file says how many get through at all."""
_HALF_ROUND = 0.55
"""A link that was measured once a round is never farther from a record than half of one; a little more for
rounds that are not all as long. One that was not heard in a round is so for nearly all of it."""


@dataclass(frozen=True, eq=False)
class Wires:
    """Links of a run, and what a file says of them besides.

    Parameters
    ----------
    links : who arrives where
    losses : of links that lose frames by themselves
    table : the gain table they come from
    """

    links: Links
    losses: Losses | None = None
    table: GainTable | None = None


def run_links(scenario: Scenario, positions: Positions, streams: RandomStreams) -> Links:
    """Return who arrives where in a run.

    Raises
    ------
    ScenarioError : a file of links that cannot be used
    LinksError : too many nodes within each other's reach
    ValueError : nodes at heights for which the path loss has no value
    """
    return _wires(scenario, positions, streams).links


def run_channel(scenario: Scenario, positions: Positions, streams: RandomStreams) -> Channel:
    """Return everything between the antennas of a run.

    Raises
    ------
    ScenarioError : a file of links or of noise that cannot be used
    """
    wires = _wires(scenario, positions, streams)
    return Channel(
        wires.links,
        _fading(scenario, streams),
        _noise(scenario, positions, wires.table, streams),
        wires.losses,
    )


def good_links(scenario: Scenario, positions: Positions, spare_db: float, success: float) -> str:
    """Return what links are like that lose less than the power to spare, for an error [dB]."""
    propagation = node_propagation(scenario, positions, RandomStreams(scenario.seed))
    if propagation is None:
        return f"that carry {success:.0%} of the longest frames"
    places = np.array(list(positions.values()), dtype=np.float64)
    return f"of up to {mean_of(propagation).reach_m(places, spare_db):.1f} m"


def _wires(scenario: Scenario, positions: Positions, streams: RandomStreams) -> Wires:
    network, nodes = scenario.network, tuple(positions)
    loss, radio = network.propagation, radio_config(network)
    floor_dbm = floor_of(len(nodes), radio.noise_dbm, network.link_margin_db)
    if isinstance(loss, RecordedLinks):
        records = read_k7(Path(loss.file), nodes, loss.nodes, loss.channel)
        return _recorded(records, loss, len(nodes), _clear_dbm(network))
    if isinstance(loss, LinkTable):
        if loss.file.lower().endswith(".csv"):
            ratios = read_ratios(Path(loss.file), nodes, loss.nodes)
            works = ratios.ratios > 0.0
            ends = ratios.senders[works], ratios.receivers[works]
            given_dbm = np.full(len(ends[0]), loss.power_dbm)
            power_dbm = np.maximum(given_dbm, _clear_dbm(network))
            links = Links.from_pairs(len(nodes), *ends, power_dbm, ratios.ratios[works])
            return Wires(links, ConstantLosses.of(*ends, ratios.ratios[works]))
        table = read_gains(Path(loss.file), nodes, loss.nodes)
        power_dbm = radio.tx_power_dbm + table.gain_db
        heard = power_dbm > floor_dbm
        ends = table.senders[heard], table.receivers[heard]
        return Wires(Links.from_pairs(len(nodes), *ends, power_dbm[heard]), table=table)
    propagation = node_propagation(scenario, positions, streams)
    assert propagation is not None
    return Wires(radio_links(positions, propagation, radio, network.link_margin_db))


def _clear_dbm(network: NetworkParams) -> float:
    """Return the power from which on the noise does nothing worth mentioning to a frame [dBm]."""
    return weakest_usable_dbm(mac_family(network).phy, radio_config(network), _CLEAR)


def _recorded(
    records: dict[tuple[int, int], LinkRecord], loss: RecordedLinks, nodes: int, clear_dbm: float
) -> Wires:
    """Return links as they were recorded: mean RSSI where there is any, and PDR by time."""
    senders, receivers = np.array(list(records), dtype=np.int64).T
    mean_dbm = np.array([_mean(record.rssi_dbm) for record in records.values()])
    ratios = np.array([float(record.ratios.mean()) for record in records.values()])
    power_dbm = np.maximum(np.nan_to_num(mean_dbm, nan=-np.inf), clear_dbm)
    spacing_s = np.concatenate([np.diff(record.times_s) for record in records.values()])
    last_s = max(float(record.times_s[-1]) for record in records.values())
    round_s = float(np.median(spacing_s)) if len(spacing_s) else max(last_s, 1.0)
    length_s = last_s + round_s
    gap_s = loss.gap_s if loss.gap_s is not None else _HALF_ROUND * round_s if len(spacing_s) else length_s
    tracks = {
        pair: Track([to_ns(time) for time in record.times_s.tolist()], record.ratios.tolist())
        for pair, record in records.items()
    }
    losses = RecordedLosses(tracks, to_ns(length_s), to_ns(gap_s), to_ns(loss.start_s))
    return Wires(Links.from_pairs(nodes, senders, receivers, power_dbm, ratios), losses)


def _mean(values: FloatArray) -> float:
    """Return the mean of what is not NaN, NaN of nothing."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")


def _noise(
    scenario: Scenario, positions: Positions, table: GainTable | None, streams: RandomStreams
) -> Noise | None:
    noise, nodes = scenario.network.noise, tuple(positions)
    if noise is None:
        return None
    if isinstance(noise, NoiseTrace):
        return PatternNoise(NoisePattern(read_noise(Path(noise.file))), nodes, streams)
    assert table is not None
    floors_dbm = np.where(np.isnan(table.floors_dbm), scenario.network.noise_dbm, table.floors_dbm)
    return WhiteNoise(floors_dbm, np.nan_to_num(table.noise_sd_db), nodes, streams)


def _fading(scenario: Scenario, streams: RandomStreams) -> Fading | None:
    fading = scenario.network.fading
    if fading is None:
        return None
    k_ratio = 0.0 if fading.kind == "rayleigh" else 10.0 ** (fading.k_db / 10.0)
    return BlockFading(to_ns(fading.coherence_s), k_ratio, streams)
