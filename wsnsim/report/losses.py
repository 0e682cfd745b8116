"""What the network did with the messages: words on the load, on what arrived, and on what did not."""

from typing import TYPE_CHECKING

from wsnsim.metrics.answers import unready
from wsnsim.metrics.traffic import content_arrived, fates, on_the_way_up
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import OUTCOMES, explained
from wsnsim.report.wording import count, listed, number, percent, plural, quantity

if TYPE_CHECKING:
    import pandas as pd

_LOW_DELIVERY = 0.9


def offered_load(context: ReportContext) -> list[str]:
    """Return what the programs handed to the network, beside what the channel can carry."""
    channel, offered = context.summary["channel_bps"], context.summary["offered_bps"]
    if offered is None:
        return []
    limit = "which has no limit here"
    if channel:
        limit = (
            f"{_multiple(offered / channel)} the {quantity(channel, 'bit/s')} that "
            f"the {context.standard} channel carries at the very most"
        )
    sentences = [f"The programs handed {quantity(offered, 'bit/s')} to the network, {limit}."]
    if fused_on_the_way(context):
        on_air, at_base = (
            context.summary[key] for key in ("mac_bytes_per_step", "base_ingress_bytes_per_step")
        )
        sentences.append(
            "What relays pass on as messages of their own is counted there at every hop; to compare with "
            f"other trackers, take the data on the air, {quantity(on_air, 'B')} a step, and what reached the "
            f"base station, {quantity(at_base, 'B')} a step."
        )
    return sentences


def delivery(context: ReportContext) -> list[str]:
    """Return what arrived at the base station, and what came from it unless all of that arrived."""
    up, down = context.summary["delivery_ratio"], context.summary["delivery_ratio_down"]
    sentences = []
    if up is not None:
        share = {0.0: "None of the", 1.0: "All"}.get(up, f"{percent(up)} of the")
        whose = "messages to the base station arrived"
        if fused_on_the_way(context):
            whose = "messages on the way to the base station arrived there, by themselves or in another"
        sentences.append(f"{share} {whose}.")
    if down is not None and down < 1:
        sentences.append(f"Of the messages from it, {percent(down)} arrived.")
    return sentences


def network_verdict(context: ReportContext) -> list[str]:
    """Return that the network was overloaded or lost many messages, where it was so."""
    figures = context.summary
    channel, offered = figures["channel_bps"], figures["offered_bps"]
    by_kind = _delivery_by_kind(context)
    wanted = wanted_bps(context)
    overloaded = channel is not None and max(offered or 0.0, wanted) > channel
    if not overloaded and min(by_kind.values(), default=1.0) >= _LOW_DELIVERY:
        return []
    start = "The network lost many messages."
    if overloaded:
        start = (
            f"The network could not carry it: {quantity(offered, 'bit/s')} were offered to a channel of "
            f"{quantity(channel, 'bit/s')}."
        )
        if wanted > 1.05 * (offered or 0.0):
            start += (
                " To measure every step with every camera that sees the target would take "
                f"{quantity(wanted, 'bit/s')}."
            )
    kinds = listed([f"{percent(ratio)} of the {kind} messages" for kind, ratio in by_kind.items()])
    unmeasured = f"{count(figures['unmeasured_steps'])} of {estimates_due(context)}"
    return [f"{start} {kinds} arrived; {unmeasured} had no measurement at all.{_main_losses(context)}"]


def estimates_due(context: ReportContext) -> str:
    """Return the number of estimates there should be, as steps where there is one target."""
    steps = context.tables["steps"]
    return plural(len(steps), "step" if steps["target"].nunique() == 1 else "estimate")


def wanted_bps(context: ReportContext) -> float:
    """Return the load of a run in which every camera that sees a target answers at every step.

    A camera that never heard the question stays silent, and a base station that
    waits in vain skips frames, so that an overloaded network looks less loaded
    than it is. What a camera says of several targets is one message. Where
    messages are fused on their way, their number depends on the tree as well,
    and nothing (0) is said.
    """
    messages, steps, views = (context.tables[name] for name in ("messages", "steps", "views"))
    seconds = float(steps["time_s"].max()) if len(steps) else 0.0
    once = messages.drop_duplicates("message")
    answers = _up(context, once)
    if not answers.any() or not seconds > 0 or fused_on_the_way(context):
        return 0.0
    seen = views[views["time_s"] >= steps["time_s"].min()]
    up = len(seen.drop_duplicates(["time_s", "camera"])) * _usual_bytes(once[answers])
    down = steps["step"].nunique() * _usual_bytes(once[~answers])
    return 8 * (up + down) / seconds


def message_kinds(context: ReportContext) -> "pd.Series[str]":
    """Return for each row of `messages` what a reader calls its kind; batches by their direction."""
    messages = context.tables["messages"]
    kinds = messages["kind"].str.replace("_", " ")
    batch, up = kinds == "batch", _up(context, messages)
    return kinds.mask(batch & up, "upward batch").mask(batch & ~up, "downward batch")


def fused_on_the_way(context: ReportContext) -> bool:
    """Tell whether messages went up hop by hop, each hop in a message of its own."""
    nodes = context.tables["nodes"]
    bases = nodes.loc[nodes["role"] == "base", "node"]
    messages = context.tables["messages"]
    return bool((_up(context, messages) & ~messages["destination"].isin(bases)).any())


def _up(context: ReportContext, messages: "pd.DataFrame") -> "pd.Series[bool]":
    nodes = context.tables["nodes"]
    base = str(nodes.loc[nodes["role"] == "base", "node"].iloc[0])
    return on_the_way_up(messages, nodes, base)


def _multiple(ratio: float) -> str:
    return f"{number(ratio, 2)} times" if ratio > 1 else f"{percent(ratio)} of"


def _usual_bytes(messages: "pd.DataFrame") -> float:
    """Return the mean size of the kind that makes up most of the bytes: what measuring takes, 0 for none.

    What a base station says while it looks for a lost target is smaller, and stops when it is found.
    """
    if messages.empty:
        return 0.0
    bytes_of = messages.groupby("kind")["bytes"].sum()
    return float(messages.loc[messages["kind"] == bytes_of.idxmax(), "bytes"].mean())


def _carried(context: ReportContext) -> "pd.DataFrame":
    """Return the messages that the network could bring in time, with `fate`, `arrived` and `named`."""
    messages = context.tables["messages"]
    carried = messages.assign(
        fate=fates(messages), arrived=content_arrived(messages), named=message_kinds(context)
    )
    if context.wait_s is None:
        return carried
    hopeless = (carried["outcome"] == "dropped_expired") & unready(context.tables, context.wait_s)
    return carried[~hopeless]


def _delivery_by_kind(context: ReportContext) -> dict[str, float]:
    carried = _carried(context)
    ratios = carried.groupby("named")["arrived"].mean().sort_values(kind="stable")
    return {str(kind): float(ratio) for kind, ratio in ratios.items()}


def _main_losses(context: ReportContext) -> str:
    """Say what became of most of the lost messages of the kind that fared worst."""
    carried = _carried(context)
    lost = carried[~carried["arrived"]]
    if lost.empty:
        return ""
    kind = next(iter(_delivery_by_kind(context)))
    failed = lost.loc[lost["named"] == kind, "fate"].value_counts().sort_index()
    reason = explained(OUTCOMES, str(failed.idxmax())).removeprefix("lost: ")
    share = percent(float(failed.max() / failed.sum()))
    return f" What became of most lost {kind} messages ({share}): {reason}."
