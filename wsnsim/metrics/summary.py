"""The flat object of summary.json: every QoS and QoI figure of a run."""

import math
from collections.abc import Mapping

import pandas as pd

from wsnsim.metrics.accuracy import accuracy
from wsnsim.metrics.answers import heard_share
from wsnsim.metrics.energy import energy
from wsnsim.metrics.figures import TRACKING_KEYS, Figures
from wsnsim.metrics.latency import latency
from wsnsim.metrics.packets import access, message_latency, packet_fates
from wsnsim.metrics.traffic import traffic
from wsnsim.metrics.work import work
from wsnsim.types import NodeId, Seconds


def summary(
    *,
    steps: pd.DataFrame,
    nodes: pd.DataFrame,
    messages: pd.DataFrame,
    load: pd.DataFrame,
    base: NodeId,
    step_s: Seconds,
    lost_above_m: Mapping[str, float],
    channel_bps: float | None,
    simulated_s: Seconds,
    wall_s: Seconds,
    active_s: Seconds | None = None,
) -> Figures:
    """Return all figures of a run.

    Parameters
    ----------
    steps : the table of `steps_table`
    nodes, messages, load : the record tables
    base : name of the base station
    step_s : time from one tracking step to the next [s]
    lost_above_m : error of its last estimate above which a target counts as lost, by target [m]
    channel_bps : what the radio channel can carry [bit/s]; None for a network without limit
    simulated_s : time from the beginning to the end of the run [s]
    wall_s : time the run took on the computer [s]
    active_s : time in which messages are made in a run without cameras [s]; None: one with cameras, where it
        is the time in which frames are taken

    Returns
    -------
    figures by key, with None where there is nothing to measure, never NaN; a run without cameras has none of
    tracking, and the latency of its messages in place of its estimates'
    """
    count = int(steps["step"].max()) if len(steps) else 0
    seeing = active_s is None
    active_s = count * step_s if active_s is None else active_s
    figures: Figures = {
        **accuracy(steps, lost_above_m),
        **latency(steps),
        **({} if seeing else message_latency(messages)),
        **packet_fates(messages, base, active_s),
        **access(nodes),
        **heard_share(steps),
        **traffic(messages, nodes, load, base, count, step_s, simulated_s, active_s),
        "channel_bps": channel_bps,
        **energy(nodes, count, simulated_s),
        **work(nodes, simulated_s),
        "steps": count,
        "simulated_s": simulated_s,
        "wall_s": wall_s,
    }
    return {
        key: None if value is None or not math.isfinite(value) else value
        for key, value in figures.items()
        if seeing or key not in TRACKING_KEYS
    }
