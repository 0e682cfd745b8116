"""The captions of the figures whose look depends on the run."""

from wsnsim.report.context import ReportContext
from wsnsim.report.timeline import MOST_ROWS, counts_pixels, turns
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
        seen = "how many cameras really see the target, and how many of them were heard in time (at the foot)"
        gap = "the two lines at the foot"
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
    steps, events = context.tables["steps"], context.tables["events"]
    shown = ["Distance between estimate and truth (above)"]
    if turns(steps):
        shown.append("the angle between true and estimated orientation")
    if counts_pixels(steps):
        shown.append("the share of the image that shows it, as a mean of the cameras that see it")
    sentences = [
        f"{'; '.join([*shown, seen])}.",
        f"A gap between {gap} is what the network or a processor lost, a camera that was not asked or had "
        "nothing to say, or a step that was passed over.",
    ]
    if steps["smoothed_error_m"].notna().any():
        sentences.append(
            "Dotted: the error of what a smoother made of the same instants afterwards, too late to steer by."
        )
    if events["kind"].isin(["track_lost", "track_started"]).any():
        sentences.append("Marks on the ground line tell where the tracker gave a track up, or began one.")
    return " ".join(sentences)


def _targets(context: ReportContext) -> int:
    return max(1, int(context.tables["steps"]["target"].nunique()))
