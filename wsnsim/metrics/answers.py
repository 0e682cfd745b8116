"""Whose answers a tracker had when it made an estimate, and what became of the others.

Estimates tell how many cameras were asked and heard, not which. Those that really
see the target are taken to have been asked, and those that answer, then or at the
step before; of an estimate never more answers are accounted for than it misses.
What remains is `SILENT`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from wsnsim.metrics.figures import Figures
from wsnsim.metrics.traffic import fates, last_messages, on_the_way_up
from wsnsim.types import FloatArray, IntArray, NodeId, Seconds

UNREADY = "unready"
"""Handed to the network when the base station wanted it no more: its mote's processor was too slow."""
BUSY = "busy"
"""The image was not taken, since the processor or the imager was still busy."""
UNTOLD = "untold"
"""The camera did not hear what the base station asks."""
LATE = "late"
"""Handed over in time and not lost, but not at the base station in time."""
DEAD = "dropped_dead_node"
"""The camera's mote, or one on the way, had stopped."""
REFUSED = "refused"
"""The base station had no use for it."""
SILENT = "silent"
"""Nothing in the records says why: the camera said nothing."""

_TRIED = ("update", "timed_out")
_SEARCHING = ("search", "sighting")
"""Messages that are no questions and answers of an estimate."""
_SAME_INSTANT_S = 1e-6


@dataclass(frozen=True)
class Answers:
    """The answers that cameras were asked for in a run.

    Parameters
    ----------
    asked, heard : how many, each camera, target and step counted once
    missing : how many of those that were not heard, by reason: one of this module's, or the outcome of
        the message that held the answer
    estimates, waited : estimates from measurements, and how many of them came only when the base station
        had waited for missing cameras as long as it does
    ready_s : median time from an image to its answer [s]; None without answers
    slow_s : the same of the answers that were `UNREADY`, by camera [s]
    """

    asked: int
    heard: int
    missing: Mapping[str, int]
    estimates: int = 0
    waited: int = 0
    ready_s: Seconds | None = None
    slow_s: Mapping[NodeId, Seconds] = field(default_factory=dict)


def heard_share(steps: pd.DataFrame) -> Figures:
    """Return the share of cameras heard among those asked, over all estimates that asked any.

    Parameters
    ----------
    steps : the table of `steps_table`
    """
    tried = _tried(steps)
    asked, heard = int(tried["asked"].sum()), int(tried["heard"].sum())
    return {"heard_ratio": heard / asked if asked else None}


def answers(tables: Mapping[str, pd.DataFrame], wait_s: Seconds | None) -> Answers:
    """Follow the answers to every estimate of a run.

    Parameters
    ----------
    tables : `steps` and the record tables by name
    wait_s : how long after a frame the base station waits for answers [s]; None: not known
    """
    wait_s = math.inf if wait_s is None else wait_s
    tried = _tried(tables["steps"])
    told = _answers_told(tables)
    expected = _expected(tables, tried, told)
    reasons = _reasons(tables, expected, wait_s)
    missed = expected[reasons.notna()].assign(reason=reasons.dropna())
    # where a camera said nothing it is not sure that it was asked
    missed = missed.sort_values("message", na_position="last", kind="stable")
    gaps = (tried["asked"] - tried["heard"]).astype("int64")
    gap = gaps.set_axis(pd.MultiIndex.from_frame(tried[["step", "target"]]))
    allowed = gap.reindex(pd.MultiIndex.from_frame(missed[["step", "target"]])).to_numpy()
    missed = missed[missed.groupby(["step", "target"]).cumcount().to_numpy() < allowed]
    counts = {str(reason): int(n) for reason, n in missed["reason"].value_counts().items()}
    rest = int(gaps.sum()) - sum(counts.values())
    refused = min(rest, int(tables["events"]["kind"].str.endswith("_refused").sum()))
    counts |= {reason: n for reason, n in ((REFUSED, refused), (SILENT, rest - refused)) if n}
    updates = tried[tried["kind"] == "update"]
    waited = (updates["heard"] < updates["asked"]) & (updates["latency_s"] > wait_s - _SAME_INSTANT_S)
    slow = missed[missed["reason"] == UNREADY].groupby("camera")["ready_s"].median()
    own_s = told.loc[~told["carries"], "ready_s"]
    return Answers(
        asked=int(tried["asked"].sum()),
        heard=int(tried["heard"].sum()),
        missing=counts,
        estimates=len(updates),
        waited=int(waited.sum()),
        ready_s=float(own_s.median()) if len(own_s) else None,
        slow_s={str(camera): float(ready_s) for camera, ready_s in slow.items()},
    )


def unready(tables: Mapping[str, pd.DataFrame], wait_s: Seconds) -> "pd.Series[bool]":
    """Tell for each row of `messages` whether it is an answer handed over when nobody wanted it any more."""
    told = _answers_told(tables)
    return tables["messages"]["message"].isin(told.loc[told["ready_s"] > wait_s, "message"])


def _tried(steps: pd.DataFrame) -> pd.DataFrame:
    return steps[steps["kind"].isin(_TRIED) & (steps["asked"] > 0)]


def _answers_told(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the messages on the way up that cameras made of their images.

    Returns
    -------
    `message, camera, step, ready_s, carries` (others were fused into it), `fate`, `arrived_s`
    """
    messages, nodes = tables["messages"], tables["nodes"]
    instants_s = _instants_s(tables)
    cameras = pd.Index(nodes.loc[nodes["role"] == "camera", "node"])
    delivered = messages["outcome"] == "delivered"
    arrivals_s = messages[delivered].drop_duplicates("message").set_index("message")["delivered_s"]
    rows = messages.assign(
        fate=fates(messages),
        arrived_s=last_messages(messages).map(arrivals_s),
        carries=messages["message"].isin(messages["fused_into"].dropna()),
    )
    told = on_the_way_up(messages, nodes, _base(tables)) & ~messages["kind"].isin(_SEARCHING)
    rows = rows[told & messages["source"].isin(cameras)].rename(columns={"source": "camera"})
    if rows.empty:
        return rows.assign(step=0, ready_s=0.0)
    # an image that is not taken is not answered: the answer is to the one before
    taken = np.tile(np.arange(len(instants_s)), (len(cameras), 1))
    skipped = _skipped(tables, instants_s)
    known = skipped["camera"].isin(cameras)
    taken[cameras.get_indexer(skipped.loc[known, "camera"]), skipped.loc[known, "step"]] = 0
    last = np.maximum.accumulate(taken, axis=1)
    step = last[cameras.get_indexer(rows["camera"]), _instant(instants_s, rows["created_s"])]
    return rows.assign(step=step, ready_s=rows["created_s"] - instants_s[step])


def _expected(tables: Mapping[str, pd.DataFrame], tried: pd.DataFrame, told: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each camera, step and target that an answer can be expected of, with that answer.

    Returns
    -------
    `camera, step, target, made_at_s` (when the estimate was), and the columns of an answer, NaN without any
    """
    instants_s = _instants_s(tables)
    views = tables["views"]
    seen = views[["camera", "target"]].assign(step=_instant(instants_s, views["time_s"]))
    made = tried[["step", "target"]].assign(made_at_s=tried["time_s"] + tried["latency_s"])
    seen = seen.merge(made, on=["step", "target"])
    keys = pd.MultiIndex.from_frame(seen[["camera", "step"]])
    sees = pd.MultiIndex.from_frame(told[["camera", "step"]]).isin(keys)
    # a camera that passes on what others say need not have been asked itself
    told = told[sees | ~told["carries"]].sort_values("message").drop_duplicates(["camera", "step"])
    answer = told[["camera", "step", "message", "ready_s", "fate", "arrived_s"]]
    # whoever answers this step or the one before is close enough to the view to be asked, seeing it or not
    near = pd.concat([answer[["camera", "step"]], answer[["camera"]].assign(step=answer["step"] + 1)])
    near = near[~pd.MultiIndex.from_frame(near).isin(keys)].drop_duplicates()
    expected = pd.concat([seen, near.merge(made.drop_duplicates("step"), on="step")], ignore_index=True)
    return expected.merge(answer, how="left", on=["camera", "step"])


def _reasons(tables: Mapping[str, pd.DataFrame], expected: pd.DataFrame, wait_s: Seconds) -> "pd.Series[str]":
    """Return why each expected answer was not heard; NaN where it was, or where nothing says why."""
    instants_s = _instants_s(tables)
    pairs = pd.MultiIndex.from_frame(expected[["camera", "step"]])
    answered = expected["message"].notna()
    delivered = expected["fate"] == "delivered"
    in_time = delivered & (expected["arrived_s"] <= expected["made_at_s"] + _SAME_INSTANT_S)
    unready = expected["ready_s"] > wait_s
    late = delivered | expected["fate"].isin(["dropped_expired", "in_flight"])
    busy = pairs.isin(pd.MultiIndex.from_frame(_skipped(tables, instants_s)))
    untold = pairs.isin(pd.MultiIndex.from_frame(_untold(tables, instants_s)))
    died_s = expected["camera"].map(tables["nodes"].set_index("node")["died_at_s"])
    dead = died_s.astype("float64") <= instants_s[expected["step"].to_numpy(np.int64)]
    why = pd.Series(None, index=expected.index, dtype="object")
    # what is further down is surer
    for reason, rows in ((UNTOLD, untold), (BUSY, busy), (DEAD, dead)):
        why = why.mask(rows, reason)
    why = why.mask(answered, expected["fate"]).mask(answered & late, LATE).mask(answered & unready, UNREADY)
    return why.mask(in_time, None)


def _skipped(tables: Mapping[str, pd.DataFrame], instants_s: FloatArray) -> pd.DataFrame:
    """Return (camera, step) of the images that were not taken."""
    events = tables["events"]
    rows = events[events["kind"] == "frame_skipped"]
    step = _instant(instants_s, rows["time_s"])
    return pd.DataFrame({"camera": rows["node"], "step": step})


def _untold(tables: Mapping[str, pd.DataFrame], instants_s: FloatArray) -> pd.DataFrame:
    """Return (camera, step) of the states that did not arrive; a state is for the frame after it was sent."""
    messages = tables["messages"]
    lost = messages[
        (messages["source"] == _base(tables))
        & (messages["outcome"] != "delivered")
        & ~messages["kind"].isin(_SEARCHING)
    ]
    step = _instant(instants_s, lost["created_s"]) + 1
    return pd.DataFrame({"camera": lost["destination"], "step": step})


def _instants_s(tables: Mapping[str, pd.DataFrame]) -> FloatArray:
    """Return when frames are taken, as steps number them from 1, and the beginning."""
    return np.unique(tables["truth"]["time_s"].to_numpy(np.float64))


def _base(tables: Mapping[str, pd.DataFrame]) -> NodeId:
    nodes = tables["nodes"]
    return str(nodes.loc[nodes["role"] == "base", "node"].iloc[0])


def _instant(instants_s: FloatArray, times_s: "pd.Series[float]") -> IntArray:
    """Return for each time the number of the last instant that it is not before."""
    later = np.searchsorted(instants_s, times_s.to_numpy(np.float64) + _SAME_INSTANT_S, side="right")
    return np.maximum(0, later - 1).astype(np.int64)
