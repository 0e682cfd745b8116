"""The paragraphs at the top of a report: what the run cost and what it was worth, in plain words."""

from typing import TYPE_CHECKING

from wsnsim.metrics.energy import ENERGY_COLUMNS, drawn_by_node_j
from wsnsim.metrics.figures import ARRIVED, mean_or_none
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import ENERGY_USES, OUTCOMES, explained
from wsnsim.report.timeline import turns
from wsnsim.report.wording import (
    count,
    duration,
    length,
    listed,
    number,
    percent,
    plural,
    quantity,
    with_unit,
)

if TYPE_CHECKING:
    import pandas as pd

_LOW_DELIVERY = 0.9


def verdicts(context: ReportContext) -> list[str]:
    """Return what a reader must not overlook: overload, losses, skipped images, dead motes."""
    return [
        *_blindness(context),
        *_network_verdict(context),
        *_skipped_images(context),
        *_deaths(context),
    ]


def service(context: ReportContext) -> str:
    """Return the paragraph of quality of service: what the run cost."""
    figures = context.summary
    sentences = _load(context)
    if figures["channel_bps"] and figures["bandwidth_mean_bps"]:
        sentences.append(
            f"On the air, with headers, relaying, repeats and acknowledgements, "
            f"{quantity(figures['bandwidth_mean_bps'], 'bit/s')} were sent on average and "
            f"{quantity(figures['bandwidth_peak_bps'], 'bit/s')} at the busiest, "
            "from one sampling instant to the next."
        )
    sentences += _delivery(context)
    if figures["latency_p50_s"] is not None:
        sentences.append(
            f"An estimate from measurements was there {duration(figures['latency_p50_s'])} after its images "
            f"were taken (median; 95 % within {duration(figures['latency_p95_s'])})."
        )
    return " ".join([*sentences, *_energy(context)])


def information(context: ReportContext) -> str:
    """Return the paragraph of quality of information: what the estimates were worth."""
    figures, steps = context.summary, context.tables["steps"]
    if figures["position_error_mean_m"] is None:
        return "No estimate was made of any target."
    sentences = [
        f"The estimates were {length(figures['position_error_mean_m'])} from the true position on average "
        f"(median {length(figures['position_error_median_m'])}, "
        f"root mean square {length(figures['position_rmse_m'])})"
    ]
    if figures["reprojection_error_mean_px"] is not None:
        sentences[0] += (
            f", which is {with_unit(figures['reprojection_error_mean_px'], 'pixels')} in the images"
        )
    sentences[0] += "."
    made = int(steps["error_m"].notna().sum())
    predicted = int(figures["unmeasured_steps"] or 0) - (len(steps) - made)
    if 2 * predicted > made:
        share = "This is" if predicted == made else "For the most part this is"
        sentences.append(f"{share} the error of a prediction, not of a measurement.")
    return " ".join([*sentences, _lost(context), *_measured(context), *_given_up(context), *_others(context)])


def base_supply(context: ReportContext) -> str:
    """Return why the base station is not among the motes where energy is shown."""
    nodes = context.tables["nodes"]
    base = nodes[nodes["role"] == "base"]
    supply = "on mains" if base["battery_capacity_j"].isna().all() else "on a battery of its own"
    return f"The base station is {supply} and not shown."


def _load(context: ReportContext) -> list[str]:
    channel, offered = context.summary["channel_bps"], context.summary["offered_bps"]
    if offered is None:
        return []
    limit = "which has no limit here"
    if channel:
        limit = (
            f"{_multiple(offered / channel)} the {quantity(channel, 'bit/s')} that "
            f"the {context.standard} channel carries at the very most"
        )
    return [f"The programs handed {quantity(offered, 'bit/s')} to the network, {limit}."]


def _delivery(context: ReportContext) -> list[str]:
    """Return what arrived at the base station, and what came from it unless all of that arrived."""
    up, down = context.summary["delivery_ratio"], context.summary["delivery_ratio_down"]
    sentences = []
    if up is not None:
        share = {0.0: "None of the", 1.0: "All"}.get(up, f"{percent(up)} of the")
        sentences.append(f"{share} messages to the base station arrived.")
    if down is not None and down < 1:
        sentences.append(f"Of the messages from it, {percent(down)} arrived.")
    return sentences


def _lost(context: ReportContext) -> str:
    steps = context.tables["steps"]
    targets = int(steps["target"].nunique())
    lost = round((context.summary["lost_fraction"] or 0) * targets)
    at_end = steps[steps["step"] == steps["step"].max()]
    tracked = at_end["error_m"].notna().all() and not (at_end["kind"] == "lost").any()
    kept = "tracked to the end" if tracked else "not lost"
    limit = length(context.lost_above_m)
    if targets == 1:
        if lost and (at_end["kind"] == "lost").any():
            return "The target was lost: the tracker itself had given it up at the end."
        fate, side = ("lost", "above") if lost else (kept, "below")
        return f"The target was {fate}: the error of its last estimate was {side} {limit}."
    if lost:
        were = "was" if lost == 1 else "were"
        return (
            f"{count(lost)} of {plural(targets, 'target')} {were} lost: the last estimate was further off "
            f"than fits the target's size ({limit} at most), or none was ever made."
        )
    everyone = "Both targets" if targets == 2 else f"All {plural(targets, 'target')}"
    return (
        f"{everyone} were {kept}: the error of each one's last estimate was below what fits its size "
        f"({limit} at most)."
    )


def _measured(context: ReportContext) -> list[str]:
    """Return how many steps had no measurement, and how many of them were not even tried."""
    figures = context.summary
    unmeasured, skipped = int(figures["unmeasured_steps"] or 0), int(figures["skipped_steps"] or 0)
    due, of_due = len(context.tables["steps"]), _due(context)
    if not unmeasured:
        return [f"All {of_due} had a measurement from at least one camera."]
    sentences = [f"{count(unmeasured)} of {of_due} ({percent(unmeasured / due)}) had no measurement at all."]
    if unmeasured == due:
        sentences = [f"None of {of_due} had a measurement."]
    if skipped:
        of_them = "All" if skipped == unmeasured else count(skipped)
        sentences.append(
            f"{of_them} of them {'was' if skipped == 1 else 'were'} passed over "
            "because an earlier step took too long."
        )
    return sentences


def _given_up(context: ReportContext) -> list[str]:
    """Return how often the tracker itself gave a target up, and whether it had one at the end."""
    steps, events = context.tables["steps"], context.tables["events"]
    without = int((steps["kind"] == "lost").sum())
    if not without:
        return []
    times = int((events["kind"] == "track_lost").sum())
    often = {0: "", 1: " once"}.get(times, f" {count(times)} times")
    last = steps[steps["step"] == steps["step"].max()]
    still = int((last["kind"] == "lost").sum())
    ended = "it had a track again at the end" if not still else "it had not found it again by the end"
    if steps["target"].nunique() > 1 and still:
        ended = f"{plural(still, 'target')} it had not found again by the end"
    return [
        f"The tracker gave up{often} and was without a track for {count(without)} of {_due(context)}; "
        f"{ended}."
    ]


def _others(context: ReportContext) -> list[str]:
    """Return what was estimated besides the present position: orientation, and older positions anew."""
    figures, steps = context.summary, context.tables["steps"]
    sentences = []
    if turns(steps):
        turned = with_unit(figures["orientation_error_mean_deg"], "°")
        sentences.append(f"Estimated orientations were {turned} off on average.")
    if figures["smoothed_error_mean_m"] is not None:
        again = steps["smoothed_error_m"].notna()
        sentences.append(
            f"Smoothed afterwards, {count(int(again.sum()))} of them were "
            f"{length(figures['smoothed_error_mean_m'])} off; the same had been "
            f"{length(mean_or_none(steps.loc[again, 'error_m']))} off at first."
        )
    return sentences


def _due(context: ReportContext) -> str:
    """Return the number of estimates there should be, as steps where there is one target."""
    steps = context.tables["steps"]
    return plural(len(steps), "step" if steps["target"].nunique() == 1 else "estimate")


def _multiple(ratio: float) -> str:
    return f"{number(ratio, 2)} times" if ratio > 1 else f"{percent(ratio)} of"


def _network_verdict(context: ReportContext) -> list[str]:
    figures = context.summary
    channel, offered = figures["channel_bps"], figures["offered_bps"]
    by_kind = _delivery_by_kind(context)
    wanted = _wanted_bps(context)
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
    unmeasured = f"{count(figures['unmeasured_steps'])} of {_due(context)}"
    return [f"{start} {kinds} arrived; {unmeasured} had no measurement at all.{_main_losses(context)}"]


def _wanted_bps(context: ReportContext) -> float:
    """Return the load of a run in which every camera that sees a target answers at every step.

    A camera that never heard the question stays silent, and a base station that
    waits in vain skips frames, so that an overloaded network looks less loaded
    than it is.
    """
    messages, nodes, steps = (context.tables[name] for name in ("messages", "nodes", "steps"))
    seconds = float(steps["time_s"].max()) if len(steps) else 0.0
    once = messages.drop_duplicates("message")
    answers = once["destination"].isin(nodes.loc[nodes["role"] == "base", "node"])
    if not answers.any() or not seconds > 0:
        return 0.0
    up = int(steps["participating"].sum()) * _usual_bytes(once[answers])
    down = len(steps) * _usual_bytes(once[~answers])
    return 8 * (up + down) / seconds


def _usual_bytes(messages: "pd.DataFrame") -> float:
    """Return the mean size of the kind that makes up most of the bytes: what measuring takes, 0 for none.

    What a base station says while it looks for a lost target is smaller, and stops when it is found.
    """
    if messages.empty:
        return 0.0
    bytes_of = messages.groupby("kind")["bytes"].sum()
    return float(messages.loc[messages["kind"] == bytes_of.idxmax(), "bytes"].mean())


def _delivery_by_kind(context: ReportContext) -> dict[str, float]:
    messages = context.tables["messages"]
    arrived = messages["outcome"].isin(ARRIVED)
    ratios = arrived.groupby(messages["kind"]).mean().sort_values(kind="stable")
    return {str(kind).replace("_", " "): float(ratio) for kind, ratio in ratios.items()}


def _main_losses(context: ReportContext) -> str:
    """Say what became of most of the lost messages of the kind that fared worst."""
    messages = context.tables["messages"]
    lost = messages[~messages["outcome"].isin(ARRIVED)]
    if lost.empty:
        return ""
    kind = min(ratios := _delivery_by_kind(context), key=lambda name: ratios[name])
    outcomes = lost.loc[lost["kind"].str.replace("_", " ") == kind, "outcome"]
    failed = outcomes.value_counts().sort_index()
    reason = explained(OUTCOMES, str(failed.idxmax())).removeprefix("lost: ")
    share = percent(float(failed.max() / failed.sum()))
    return f" What became of most lost {kind} messages ({share}): {reason}."


def _blindness(context: ReportContext) -> list[str]:
    """Say that nothing was ever measured, where that is so."""
    steps = context.tables["steps"]
    if len(steps) == 0 or context.summary["unmeasured_steps"] != len(steps):
        return []
    seen = "" if steps["participating"].any() else " No camera saw a target at any step."
    if steps["error_m"].isna().all():
        return [f"Nothing was measured, and no estimate was made.{seen}"]
    return [
        f"Nothing was measured.{seen} Every estimate is dead reckoning from the start that the scenario "
        "gives; its error says nothing of the tracker."
    ]


def _skipped_images(context: ReportContext) -> list[str]:
    nodes = context.tables["nodes"]
    slow = nodes[nodes["images_skipped"] > 0]
    if slow.empty:
        return []
    skipped, taken = int(slow["images_skipped"].sum()), int(slow["images_taken"].sum())
    names = listed([str(name) for name in slow["node"]])
    return [
        f"{names} could not keep up: {plural(skipped, 'image')} {'was' if skipped == 1 else 'were'} skipped "
        f"because the processor or the imager was still busy ({count(taken)} taken)."
    ]


def _deaths(context: ReportContext) -> list[str]:
    died = context.tables["nodes"].dropna(subset=["died_at_s"]).sort_values(["died_at_s", "node"])
    if died.empty:
        return []
    when = [f"{row['node']} at {duration(row['died_at_s'])}" for row in died.to_dict("records")]
    return [f"{plural(len(died), 'node')} stopped during the run: {listed(when)}."]


def _energy(context: ReportContext) -> list[str]:
    figures, nodes = context.summary, context.tables["nodes"]
    motes = nodes[nodes["role"] != "base"].reset_index(drop=True)
    if motes.empty:
        return []
    busiest = motes.to_dict("records")[int(drawn_by_node_j(motes).to_numpy().argmax())]
    causes = {column: busiest[column] for column in ENERGY_COLUMNS}
    column = max(causes, key=lambda name: causes[name])
    total = sum(causes.values())
    deaths = int(motes["died_at_s"].notna().sum())
    over = " on average over the whole run, the time after motes had stopped included" if deaths else ""
    sentences = [
        f"The motes drew {quantity(figures['energy_per_step_j'], 'J')} a step{over}, "
        f"{quantity(figures['energy_total_j'], 'J')} in all."
    ]
    if total > 0:
        sentences.append(
            f"The busiest, {busiest['node']}, drew {quantity(total, 'J')}, "
            f"{percent(causes[column] / total)} of it for {ENERGY_USES[column]}."
        )
    lifetime = figures["lifetime_first_death_extrapolated_s"]
    if deaths:
        first, motes_in_all = duration(figures["lifetime_first_death_s"]), plural(len(motes), "mote")
        stopped = "all" if deaths == len(motes) else f"{count(deaths)} of"
        sentences.append(
            f"The first battery was empty after {first}; by the end {stopped} {motes_in_all} had stopped."
        )
    elif lifetime is not None:
        sentences.append(f"At this pace the first battery lasts {duration(lifetime)}.")
    return sentences
