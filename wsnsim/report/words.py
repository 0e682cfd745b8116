"""The paragraphs at the top of a report: what the run cost and what it was worth, in plain words."""

from wsnsim.metrics.energy import ENERGY_COLUMNS, drawn_by_node_j
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import ENERGY_USES, OUTCOMES, explained
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

_LOW_DELIVERY = 0.9


def verdicts(context: ReportContext) -> list[str]:
    """Return what a reader must not overlook: overload, losses, skipped images, dead motes."""
    return [*_network_verdict(context), *_skipped_images(context), *_deaths(context)]


def service(context: ReportContext) -> str:
    """Return the paragraph of quality of service: what the run cost."""
    figures = context.summary
    channel, offered = figures["channel_bps"], figures["offered_bps"]
    sentences = [f"The programs handed {quantity(offered, 'bit/s')} to the network"]
    if channel and offered is not None:
        sentences[0] += (
            f", {_multiple(offered / channel)} the {quantity(channel, 'bit/s')} that "
            f"the {context.standard} channel carries at the very most"
        )
    else:
        sentences[0] += ", which has no limit here"
    sentences[0] += "."
    if channel and figures["bandwidth_mean_bps"]:
        sentences.append(
            f"On the air, with headers, relaying, repeats and acknowledgements, "
            f"{quantity(figures['bandwidth_mean_bps'], 'bit/s')} were sent on average and about "
            f"{quantity(figures['bandwidth_peak_bps'], 'bit/s')} in the busiest step."
        )
    if figures["delivery_ratio"] is not None:
        share = "All" if figures["delivery_ratio"] == 1 else f"{percent(figures['delivery_ratio'])} of the"
        sentences.append(f"{share} messages arrived.")
    if figures["latency_p50_s"] is not None:
        sentences.append(
            f"An estimate was there {duration(figures['latency_p50_s'])} after its images were taken "
            f"(median; 95 % within {duration(figures['latency_p95_s'])})."
        )
    return " ".join([*sentences, *_energy(context)])


def information(context: ReportContext) -> str:
    """Return the paragraph of quality of information: what the estimates were worth."""
    figures, steps = context.summary, context.tables["steps"]
    due, targets = len(steps), int(steps["target"].nunique())
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
    lost = round((figures["lost_fraction"] or 0) * targets)
    limit = f"the error at the last step was {'above' if lost else 'below'} {length(context.lost_above_m)}"
    if targets == 1:
        sentences.append(f"The target was {'lost' if lost else 'tracked to the end'}: {limit}.")
    elif lost:
        sentences.append(f"{count(lost)} of {plural(targets, 'target')} were lost: {limit}.")
    else:
        everyone = "Both targets" if targets == 2 else f"All {plural(targets, 'target')}"
        sentences.append(f"{everyone} were tracked to the end: {limit}.")
    missed = int(figures["missed_deadlines"] or 0)
    of_due = plural(due, "step") if targets == 1 else plural(due, "estimate")
    if missed == due:
        sentences.append(f"None of {of_due} had a measurement: all rest on the prediction.")
    elif missed:
        sentences.append(
            f"{count(missed)} of {of_due} ({percent(missed / due)}) had no measurement at all "
            "and rest on the prediction."
        )
    else:
        sentences.append(f"All {of_due} had a measurement from at least one camera.")
    return " ".join(sentences)


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
    steps = context.tables["steps"]
    due = plural(len(steps), "step" if steps["target"].nunique() == 1 else "estimate")
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
    missed = count(figures["missed_deadlines"])
    return [f"{start} {kinds} arrived; {missed} of {due} had no measurement at all.{_main_losses(context)}"]


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
    up = int(steps["participating"].sum()) * float(once.loc[answers, "bytes"].mean())
    down = 0.0 if answers.all() else len(steps) * float(once.loc[~answers, "bytes"].mean())
    return 8 * (up + down) / seconds


def _delivery_by_kind(context: ReportContext) -> dict[str, float]:
    messages = context.tables["messages"]
    arrived = messages["outcome"].isin(["delivered", "fused"])
    ratios = arrived.groupby(messages["kind"]).mean().sort_values(kind="stable")
    return {str(kind).replace("_", " "): float(ratio) for kind, ratio in ratios.items()}


def _main_losses(context: ReportContext) -> str:
    outcomes = context.tables["messages"]["outcome"]
    failed = outcomes[~outcomes.isin(["delivered", "fused"])].value_counts().sort_index()
    if failed.empty:
        return ""
    reason = str(failed.idxmax())
    share = percent(float(failed.max() / failed.sum()))
    return f" The most frequent reason ({share}): {explained(OUTCOMES, reason).removeprefix('lost: ')}."


def _skipped_images(context: ReportContext) -> list[str]:
    nodes = context.tables["nodes"]
    slow = nodes[nodes["images_skipped"] > 0]
    if slow.empty:
        return []
    skipped, taken = int(slow["images_skipped"].sum()), int(slow["images_taken"].sum())
    names = listed([str(name) for name in slow["node"]])
    return [
        f"The processor of {names} was too slow: {count(skipped)} images were skipped "
        f"because it was still busy with the one before ({count(taken)} were used)."
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
    sentences = [
        f"The motes drew {quantity(figures['energy_per_step_j'], 'J')} a step, "
        f"{quantity(figures['energy_total_j'], 'J')} in all."
    ]
    if total > 0:
        sentences.append(
            f"The busiest, {busiest['node']}, drew {quantity(total, 'J')}, "
            f"{percent(causes[column] / total)} of it for {ENERGY_USES[column]}."
        )
    lifetime = figures["lifetime_first_death_extrapolated_s"]
    if lifetime is not None:
        sentences.append(f"At this pace the first battery lasts {duration(lifetime)}.")
    return sentences
