"""The paragraphs at the top of a report: what the run cost and what it was worth, in plain words."""

from wsnsim.metrics.energy import ENERGY_COLUMNS, drawn_by_node_j
from wsnsim.metrics.figures import mean_or_none
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import ENERGY_USES
from wsnsim.report.heads import overwork, overworked
from wsnsim.report.hearing import hearing, hearing_verdict, readiness
from wsnsim.report.losses import delivery, estimates_due, network_verdict, offered_load
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


def verdicts(context: ReportContext) -> list[str]:
    """Return what a reader must not overlook: overload, losses, slow or dead motes."""
    network = network_verdict(context)
    return [
        *_blindness(context),
        *network,
        *hearing_verdict(context, radio_is_told=bool(network)),
        *overwork(context.tables, context.summary["simulated_s"], context.particles),
        *_skipped_images(context),
        *death_words(context),
    ]


def service(context: ReportContext) -> str:
    """Return the paragraph of quality of service: what the run cost."""
    figures = context.summary
    sentences = offered_load(context)
    if figures["channel_bps"] and figures["bandwidth_mean_bps"]:
        sentences.append(
            f"On the air, with headers, relaying, repeats and acknowledgements, "
            f"{quantity(figures['bandwidth_mean_bps'], 'bit/s')} were sent on average and "
            f"{quantity(figures['bandwidth_peak_bps'], 'bit/s')} at the busiest, "
            "from one sampling instant to the next."
        )
    sentences += delivery(context)
    if figures["latency_p50_s"] is not None:
        sentences.append(
            f"An estimate from measurements was there {duration(figures['latency_p50_s'])} after its images "
            f"were taken (median; 95 % within {duration(figures['latency_p95_s'])}){readiness(context)}."
        )
    return " ".join([*sentences, *energy_words(context)])


def information(context: ReportContext) -> str:
    """Return the paragraph of quality of information: what the estimates were worth."""
    figures, steps = context.summary, context.tables["steps"]
    if figures["position_error_mean_m"] is None:
        return "No estimate was made of any target."
    sentences = [
        f"The estimates were {length(figures['position_error_mean_m'])} from the true position on average "
        f"(median {length(figures['position_error_median_m'])}, "
        f"root mean square {length(figures['position_rmse_m'])}{_in_units(context)})"
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
    told_above = bool(hearing_verdict(context, radio_is_told=bool(network_verdict(context))))
    heard = hearing(context, brief=told_above)
    more = [*_measured(context), *heard, *_heads(context), *_given_up(context), *_others(context)]
    return " ".join([*sentences, _lost(context), *more])


def chosen(context: ReportContext) -> str:
    """Return what the parts of the tracking system are, where there is a choice, and what else decides."""
    return ", ".join([*(f"{part} “{kind}”" for part, kind in context.choices.items()), *context.settings])


def base_supply(context: ReportContext) -> str:
    """Return why the base station is not among the motes where energy is shown."""
    nodes = context.tables["nodes"]
    base = nodes[nodes["role"] == "base"]
    supply = "on mains" if base["battery_capacity_j"].isna().all() else "on a battery of its own"
    return f"The base station is {supply} and not shown."


def _in_units(context: ReportContext) -> str:
    """Return the root mean square in the units of the published figures, where they are not metres."""
    unit_m, rmse_m = context.unit_m, context.summary["position_rmse_m"]
    if unit_m is None or unit_m == 1.0 or rmse_m is None:
        return ""
    return f", {number(rmse_m / unit_m)} units of {length(unit_m)}"


def _heads(context: ReportContext) -> list[str]:
    """Return which motes were the cluster head, where some were: those that told where the target is."""
    messages = context.tables["messages"]
    tracks = messages.loc[messages["kind"] == "track", "source"].value_counts(sort=False)
    if tracks.empty:
        return []
    heads = [f"{node} ({plural(int(tracks[node]), 'track')})" for node in tracks.index]
    return [f"Cluster head{' was' if len(heads) == 1 else 's were, in this order,'} {listed(heads)}."]


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
    due, of_due = len(context.tables["steps"]), estimates_due(context)
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
    of_due = estimates_due(context)
    return [f"The tracker gave up{often} and was without a track for {count(without)} of {of_due}; {ended}."]


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
    # of those that tracked too slowly it is told with that
    slow = nodes[(nodes["images_skipped"] > 0) & ~nodes["node"].isin(overworked(context.tables))]
    if slow.empty:
        return []
    skipped, taken = int(slow["images_skipped"].sum()), int(slow["images_taken"].sum())
    names = listed([str(name) for name in slow["node"]])
    return [
        f"{names} could not keep up: {plural(skipped, 'image')} {'was' if skipped == 1 else 'were'} skipped "
        f"because the processor or the imager was still busy ({count(taken)} taken)."
    ]


def death_words(context: ReportContext) -> list[str]:
    """Return which nodes stopped, and when."""
    died = context.tables["nodes"].dropna(subset=["died_at_s"]).sort_values(["died_at_s", "node"])
    if died.empty:
        return []
    when = [f"{row['node']} at {duration(row['died_at_s'])}" for row in died.to_dict("records")]
    return [f"{plural(len(died), 'node')} stopped during the run: {listed(when)}."]


def energy_words(context: ReportContext) -> list[str]:
    """Return what the motes drew, and how long their batteries last."""
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
    total_j = quantity(figures["energy_total_j"], "J")
    sentences = [f"The motes drew {total_j} in all."]
    if "energy_per_step_j" in figures:
        a_step = quantity(figures["energy_per_step_j"], "J")
        sentences = [f"The motes drew {a_step} a step{over}, {total_j} in all."]
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
