"""Small tables of a run by hand: three cameras that see the target, asked four times a second."""

import math

import pandas as pd

from wsnsim.report.context import ReportContext

PERIOD_S = 0.25
WAIT_S = 0.225
CAMERAS = ("c1", "c2", "c3")
STAR = {"c1": "base", "c2": "base", "c3": "base"}
CHAIN = {"c1": "base", "c2": "c1", "c3": "c2"}


def answer(number, camera, step, to="base", after=0.1, outcome="delivered", into=None, kind="mixture"):
    """Return a message of a camera, created `after` its image; what arrives does so 10 ms later."""
    created_s = PERIOD_S * step + after
    arrived = outcome in ("delivered", "fused")
    return (number, kind, camera, to, created_s, created_s + 0.01 if arrived else None, 30, outcome, into)


def state(number, step, camera, outcome="delivered"):
    """Return the row of one receiver of the state for a step, which is sent just after the one before."""
    created_s = PERIOD_S * (step - 1) + 0.15
    delivered_s = created_s + 0.01 if outcome == "delivered" else None
    return (number, "state", "base", camera, created_s, delivered_s, 32, outcome, None)


def estimate(step, asked, heard, latency_s=0.15, kind="update", target="box"):
    """Return a row of `steps`."""
    return (PERIOD_S * step, step, target, asked, heard, kind, latency_s)


def event(kind, node, step):
    """Return an event at the instant of a step."""
    return (PERIOD_S * step, node, kind, "")


def tables(messages=(), estimates=(), events=(), parents=STAR, died_s=None, unseen=()):
    """Return the tables that tell of answers.

    Parameters
    ----------
    died_s : when motes stopped, by name [s]
    unseen : (camera, step) in which the camera does not see the target
    """
    frames = {
        "messages": (
            "message kind source destination created_s delivered_s bytes outcome fused_into", messages
        ),
        "steps": ("time_s step target asked heard kind latency_s", estimates),
        "events": ("time_s node kind detail", events),
    }  # fmt: skip
    found = {name: pd.DataFrame(list(rows), columns=head.split()) for name, (head, rows) in frames.items()}
    steps = found["steps"]
    last, targets = int(steps["step"].max()), sorted(set(steps["target"]))
    found["truth"] = pd.DataFrame({"time_s": [PERIOD_S * k for k in range(last + 1)]})
    seen = [
        (PERIOD_S * k, camera, target)
        for k in range(1, last + 1)
        for camera in CAMERAS
        for target in targets
        if (camera, k) not in unseen
    ]
    found["views"] = pd.DataFrame(seen, columns=["time_s", "camera", "target"])
    nodes = [(name, "camera", parents[name], (died_s or {}).get(name, math.nan)) for name in CAMERAS]
    nodes.append(("base", "base", None, math.nan))
    found["nodes"] = pd.DataFrame(nodes, columns=["node", "role", "parent", "died_at_s"])
    return found


def context(found, wait_s=WAIT_S, **figures):
    """Return what a report is made from, with cameras on the platform `snail`."""
    return ReportContext(
        name="small",
        seed=0,
        system="multiview",
        citation="",
        standard="IEEE 802.15.4",
        size_m=(1.0, 1.0, 1.0),
        cameras={},
        tables=found,
        summary=figures,
        lost_above_m=1.6,
        wait_s=wait_s,
        platforms=dict.fromkeys(CAMERAS, "snail"),
    )
