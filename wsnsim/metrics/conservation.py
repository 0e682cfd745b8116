"""What must hold in the tables of every run: nothing appears, nothing vanishes.

Used by the tests on whatever a run left behind, and by anyone who doubts a
result.
"""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from wsnsim.metrics.energy import ENERGY_COLUMNS, drawn_by_node_j
from wsnsim.metrics.figures import ARRIVED, ESTIMATE_KINDS, SMOOTHED

_RELATIVE = 1e-9
_SAME_INSTANT_S = 1e-9

_OUTCOME = "|".join((*ARRIVED, "in_flight", r"dropped_\w+"))

_ALWAYS_ON = ("cpu", "board")
"""Components that every node has, in one state or another from the beginning to the end of its life."""

_WHOLE_LIFE = (*_ALWAYS_ON, "radio")
"""Components that are so where there are any; over an ideal network there are no radios."""

_SAID = ("track", "time_s", "kind")

_RADIO_COLUMN = {
    "transmit": "energy_radio_tx_j",
    "receive": "energy_radio_rx_j",
    "listen": "energy_radio_listen_j",
    "start": "energy_radio_listen_j",
    "sleep": "energy_radio_sleep_j",
}


def violations(tables: Mapping[str, pd.DataFrame], simulated_s: float) -> list[str]:
    """Return a sentence for each law that the tables break; none for a sound run.

    Parameters
    ----------
    tables : the record tables by name; `nodes`, `energy`, `messages`, `load`, `events` and `estimates`
        are read
    simulated_s : time from the beginning to the end of the run [s]
    """
    return [
        *_messages(tables["messages"], tables["nodes"]),
        *_load(tables["load"], tables["nodes"]),
        *_energy(tables["energy"], tables["nodes"], simulated_s),
        *_deaths(tables),
        *_estimates(tables["estimates"]),
    ]


def _messages(messages: pd.DataFrame, nodes: pd.DataFrame) -> list[str]:
    found = []
    twice = messages[messages.duplicated(["message", "destination"])]
    found += [f"message {m} to {d}: more than one fate" for m, d in _values(twice, "message", "destination")]
    unclear = messages[~messages["outcome"].str.fullmatch(_OUTCOME)]
    found += [f"message {m}: unknown outcome {o!r}" for m, o in _values(unclear, "message", "outcome")]
    arrived = messages["outcome"].isin(ARRIVED)
    undated = messages[arrived != messages["delivered_s"].notna()]
    found += [
        f"message {m}: {o}, but its delivery time disagrees"
        for m, o in _values(undated, "message", "outcome")
    ]
    early = messages[messages["delivered_s"] < messages["created_s"]]
    found += [
        f"message {m}: delivered to {d} before it was created"
        for m, d in _values(early, "message", "destination")
    ]
    found += _fusions(messages)
    sent = messages.drop_duplicates("message").groupby("source")["bytes"].sum()
    for node, claimed in _values(nodes, "node", "app_tx_bytes"):
        if sent.get(node, 0) != claimed:
            found.append(
                f"node {node}: {claimed} application bytes counted, {sent.get(node, 0)} in its messages"
            )
    return found


def _fusions(messages: pd.DataFrame) -> list[str]:
    """Hold what messages were fused into against where and when they arrived."""
    unclear = messages[(messages["outcome"] == "fused") != messages["fused_into"].notna()]
    found = [
        f"message {m}: {o}, but what it was fused into disagrees"
        for m, o in _values(unclear, "message", "outcome")
    ]
    made = messages.drop_duplicates("message").set_index("message")
    parts = messages[messages["fused_into"].notna()].astype({"fused_into": "int64"})
    parts = parts.assign(
        maker=parts["fused_into"].map(made["source"]), made_s=parts["fused_into"].map(made["created_s"])
    )
    missing = parts[parts["maker"].isna()]
    found += [
        f"message {m}: fused into {into}, which nobody sent"
        for m, into in _values(missing, "message", "fused_into")
    ]
    parts = parts[parts["maker"].notna()]
    elsewhere = parts[parts["maker"] != parts["destination"]]
    found += [
        f"message {m} to {d}: fused into {into}, which {s} sent"
        for m, d, into, s in _values(elsewhere, "message", "destination", "fused_into", "maker")
    ]
    early = parts[(parts["fused_into"] <= parts["message"]) | (parts["made_s"] < parts["delivered_s"])]
    found += [
        f"message {m}: fused into {into}, which was made before it arrived"
        for m, into in _values(early, "message", "fused_into")
    ]
    return found


def _load(load: pd.DataFrame, nodes: pd.DataFrame) -> list[str]:
    if load.empty:
        return ["load: no row was written"]
    found = []
    for column in ("app_tx_bytes", "mac_tx_bytes"):
        if not load[column].is_monotonic_increasing:
            found.append(f"load: {column} decreases")
        counted, total = load[column].iloc[-1], nodes[column].sum()
        if counted != total:
            found.append(f"load: {column} ends at {counted}, the nodes sent {total}")
    return found


def _energy(energy: pd.DataFrame, nodes: pd.DataFrame, simulated_s: float) -> list[str]:
    found = []
    for node in nodes.assign(drawn_j=drawn_by_node_j(nodes)).to_dict("records"):
        name = node["node"]
        own = energy[energy["node"] == name]
        for column, joules in _by_column(own).items():
            if not _close(joules, node.get(column, 0.0)):
                found.append(f"node {name}: {column} is {node.get(column)}, its causes add up to {joules} J")
        if not pd.isna(node["battery_capacity_j"]):
            stored = node["battery_capacity_j"] + node["harvested_j"]
            accounted = node["drawn_j"] + node["battery_left_j"]
            if not _close(accounted, stored):
                found.append(
                    f"node {name}: {stored} J stored and harvested, but {accounted} J drawn and left"
                )
        found += _times(node, own, simulated_s)
    return found


def _times(node: Mapping[Hashable, Any], own: pd.DataFrame, simulated_s: float) -> list[str]:
    """Hold the seconds of one node's components against the time it lived and worked."""
    found = []
    name = node["node"]
    lived_s = simulated_s if pd.isna(node["died_at_s"]) else node["died_at_s"]
    on_s = dict.fromkeys(_ALWAYS_ON, 0.0) | own.groupby("component")["seconds"].sum().to_dict()
    for component, seconds in on_s.items():
        if component in _WHOLE_LIFE and not _close(seconds, lived_s):
            found.append(f"node {name}: its {component} was on for {seconds} s, not the {lived_s} s it lived")
        elif seconds > lived_s * (1 + _RELATIVE) + _SAME_INSTANT_S:
            found.append(f"node {name}: its {component} was on for {seconds} s of {lived_s} s")
    worked = own[(own["component"] == "cpu") & (own["cause"] == "work")]["seconds"].sum()
    if not _close(worked, node["cpu_busy_s"]):
        found.append(f"node {name}: cpu_busy_s is {node['cpu_busy_s']}, its processor worked {worked} s")
    return found


def _by_column(own: pd.DataFrame) -> dict[str, float]:
    """Return one node's energy [J] by the column of `nodes` it belongs to."""
    totals = dict.fromkeys(ENERGY_COLUMNS, 0.0)
    for component, cause, joules in _values(own, "component", "cause", "energy_j"):
        column = _RADIO_COLUMN.get(cause, "radio") if component == "radio" else f"energy_{component}_j"
        totals[column] = totals.get(column, 0.0) + joules
    return totals


def _deaths(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    found = []
    died = tables["nodes"].dropna(subset=["died_at_s"])
    traces = (
        ("estimates", "node", "made_at_s", "made an estimate"),
        ("events", "node", "time_s", "had an event"),
        ("messages", "source", "created_s", "sent a message"),
        ("messages", "destination", "delivered_s", "received a message"),
    )
    for node, died_at_s in _values(died, "node", "died_at_s"):
        for table, who, when, what in traces:
            rows = tables[table]
            late = rows[(rows[who] == node) & (rows[when] > died_at_s + _SAME_INSTANT_S)]
            found += [
                f"node {node}: {what} at {time} s, after its death at {died_at_s} s" for time in late[when]
            ]
    return found


def _estimates(estimates: pd.DataFrame) -> list[str]:
    """Hold what estimates say of themselves against when they were made and what they heard."""
    found = []
    unclear = estimates[~estimates["kind"].isin(ESTIMATE_KINDS)]
    found += [f"estimate of {t} for {s} s: unknown kind {k!r}" for t, s, k in _values(unclear, *_SAID)]
    early = estimates[estimates["made_at_s"] < estimates["time_s"] - _SAME_INSTANT_S]
    found += [f"estimate of {t} for {s} s: made before that time" for t, s, _ in _values(early, *_SAID)]
    own = estimates[estimates["kind"] != SMOOTHED]
    wrong = own[(own["kind"] == "update") != (own["heard"] > 0)]
    found += [
        f"estimate of {t} for {s} s: of kind {k!r}, with {heard} cameras heard"
        for t, s, k, heard in _values(wrong, *_SAID, "heard")
    ]
    return found


def _values(frame: pd.DataFrame, *columns: str) -> list[tuple[Any, ...]]:
    return list(zip(*(frame[column].tolist() for column in columns), strict=True))


def _close(value: float, other: float) -> bool:
    return bool(np.isclose(value, other, rtol=_RELATIVE, atol=1e-15))
