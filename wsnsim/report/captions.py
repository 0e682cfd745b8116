"""The captions of the figures whose look depends on the run."""

from wsnsim.report.context import ReportContext
from wsnsim.report.timeline import MOST_ROWS
from wsnsim.report.view import outside
from wsnsim.report.wording import count, listed, plural


def paths_caption(context: ReportContext) -> str:
    """Return how to read the map, and what its first view leaves out."""
    sentences = [
        "True and estimated path, joined at every step by a patch: the narrower the band, the better the "
        "estimate."
    ]
    if _targets(context) > 1:
        sentences.append(
            "Each target has a colour: dark for its true path, lighter and with points for its estimate."
        )
    sentences.append(
        "Hollow points rest on the prediction alone. Wedges show where each camera looks, dotted lines the "
        "way of the messages to the base station."
    )
    left_out = outside(context)
    if left_out:
        things = list(left_out.nodes)
        if left_out.estimates:
            things.append(plural(left_out.estimates, "estimate"))
        sentences.append(
            f"The map starts with the world and its cameras; {listed(things)} "
            f"{'lies' if len(things) == 1 and left_out.estimates < 2 else 'lie'} outside: "
            "the button “whole network” below shows everything."
        )
    return " ".join(sentences)


def timeline_caption(context: ReportContext) -> str:
    """Return how to read error and counts over time, and whether the counts are sums."""
    targets = _targets(context)
    if targets == 1:
        seen = "how many cameras really see the target, and how many of them were heard in time (below)"
        gap = "the two lines below"
    elif targets <= MOST_ROWS:
        seen = (
            "how many cameras really see a target, and how many of them were heard in time (below, a row for "
            "each target)"
        )
        gap = "area and line below"
    else:
        seen = (
            "how many cameras really see a target, and how many of them were heard in time (below, summed "
            f"over the {count(targets)} targets: a camera that sees two counts twice)"
        )
        gap = "area and line below"
    return (
        f"Distance between estimate and truth (above); {seen}. A gap between {gap} is what the network or a "
        "processor lost, a camera that was not asked, or a step that was passed over."
    )


def _targets(context: ReportContext) -> int:
    return max(1, int(context.tables["steps"]["target"].nunique()))
