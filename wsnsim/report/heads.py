"""Who tracked and could not keep up with the frames, and what helps."""

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from wsnsim.report.wording import count, duration, listed, percent, plural

if TYPE_CHECKING:
    import pandas as pd

_LEFT_OUT = "frame_left_out"


def overworked(tables: "Mapping[str, pd.DataFrame]") -> frozenset[str]:
    """Return the nodes that left frames out since they were still busy."""
    events = tables["events"]
    return frozenset(events.loc[events["kind"] == _LEFT_OUT, "node"])


def overwork(
    tables: "Mapping[str, pd.DataFrame]", simulated_s: float | None, particles: str | None
) -> list[str]:
    """Say that a tracker left frames out, and what helps; nothing where none did.

    Parameters
    ----------
    tables : `steps` and the record tables by name
    simulated_s : time from the beginning to the end of the run [s]
    particles : key of the number of the tracker's particles; None: it has none
    """
    steps, nodes = tables["steps"], tables["nodes"]
    heads = nodes[nodes["node"].isin(overworked(tables))].to_dict("records")
    if not heads:
        return []
    alone = len(heads) == 1
    frames = int((tables["events"]["kind"] == _LEFT_OUT).sum())
    images = sum(head["images_skipped"] for head in heads)
    own = f"; {plural(images, 'image')} of {'its' if alone else 'their'} own {_were(images)} skipped as well"
    names = listed([_name(head) for head in heads])
    return [
        f"{names[0].upper() if heads[0]['role'] == 'base' else names[0]}{names[1:]} could not keep up with "
        f"tracking: {plural(frames, 'frame')} of {count(steps['step'].nunique())} {_were(frames)} left out "
        f"because the {'processor was' if alone else 'processors were'} still busy{own if images else ''}. "
        f"{_pace(heads, steps.loc[steps['step'] == 1, 'time_s'].iloc[0], simulated_s)}: "
        f"take {_remedies(heads, particles)}."
    ]


def _were(number: int) -> str:
    return "was" if number == 1 else "were"


def _name(head: Mapping[Hashable, Any]) -> str:
    return "the base station" if head["role"] == "base" else str(head["node"])


def _pace(heads: Sequence[Mapping[Hashable, Any]], period_s: float, simulated_s: float | None) -> str:
    """Return how long the slowest head works, beside the time that it has."""
    slowest = max(heads, key=lambda head: float(head["work_longest_s"]))
    longest_s, died_s = slowest["work_longest_s"], slowest["died_at_s"]
    if longest_s > period_s:
        return (
            f"A step takes {_name(slowest)} up to {duration(longest_s)}, "
            f"a frame period is {duration(period_s)}"
        )
    lived_s = died_s if died_s == died_s else simulated_s
    busy = f", and it worked for {percent(slowest['cpu_busy_s'] / lived_s)} of its time" if lived_s else ""
    return f"All work on a frame takes {_name(slowest)} more than a frame period, {duration(period_s)}{busy}"


def _remedies(heads: Sequence[Mapping[Hashable, Any]], particles: str | None) -> str:
    """Return what to do about it."""
    ways = [] if particles is None else [f"fewer particles ({particles})"]
    ways.append("a faster platform")
    if all(head["role"] != "base" for head in heads):
        ways.append("the base station as head (system.head={kind: base})")
    return f"{', '.join(ways[:-1])}{' or ' if ways[:-1] else ''}{ways[-1]}"
