"""Words and tables on a network without cameras."""

from wsnsim.metrics.energy import drawn_by_node_j
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import OUTCOMES, ROLES, explained
from wsnsim.report.packets import by_source, or_none
from wsnsim.report.wording import count, duration, percent, plural, quantity
from wsnsim.report.words import death_words, energy_words

_MOST_ROWS = 500
"""Nodes in the table at most."""
_LOW_DELIVERY = 0.9

Row = tuple[str, ...]

NODE_HEADS = (
    "node",
    "role",
    "next hop (hops)",
    "packets made",
    "arrived",
    "mean delay",
    "frames sent",
    "of them repeats",
    "attempts failed",
    "channel busy",
    "frames given up",
    "energy",
    "battery left",
    "stopped at",
)


def facts(context: ReportContext) -> str:
    """Return the line under the title."""
    motes = int((context.tables["nodes"]["role"] != "base").sum())
    made = int(context.summary["generated"] or 0)
    return (
        f"{plural(motes, 'mote')} over {context.standard}, {plural(made, 'packet')} in "
        f"{duration(context.summary['simulated_s'])}, seed {context.seed}"
    )


def verdicts(context: ReportContext) -> list[str]:
    """Return what a reader must not overlook: losses and dead motes."""
    messages = context.tables["messages"]
    found = []
    ratio = context.summary["delivery_ratio"]
    if ratio is not None and ratio < _LOW_DELIVERY:
        lost = messages.loc[messages["outcome"] != "delivered", "outcome"].value_counts().sort_index()
        reason = explained(OUTCOMES, str(lost.idxmax())).removeprefix("lost: ")
        share = percent(float(lost.max() / lost.sum()))
        found.append(
            f"The network lost many packets: {percent(ratio)} arrived. What became of most of the others "
            f"({share}): {reason}."
        )
    return [*found, *death_words(context)]


def service(context: ReportContext) -> str:
    """Return the paragraph of quality of service."""
    figures = context.summary
    made = int(figures["generated"] or 0)
    if not made:
        return " ".join(["No packet was made.", *energy_words(context)])
    channel, offered = figures["channel_bps"], figures["offered_bps"]
    limit = f", on a channel of {quantity(channel, 'bit/s')}" if channel else ""
    sentences = [f"{plural(made, 'packet')} were made, {quantity(offered, 'bit/s')} in all{limit}."]
    ratio = figures["delivery_ratio"]
    share = {0.0: "None", 1.0: "All"}.get(ratio or 0.0, percent(ratio))
    sentences.append(f"{share} of them arrived: {quantity(figures['throughput_bps'], 'bit/s')}.")
    if figures["latency_mean_s"] is not None:
        sentences.append(
            f"That took {duration(figures['latency_mean_s'])} on average, waiting in queues included (median "
            f"{duration(figures['latency_p50_s'])}, 95 % within {duration(figures['latency_p95_s'])}, "
            f"at most {duration(figures['latency_max_s'])})."
        )
    if channel and figures["bandwidth_mean_bps"]:
        sentences.append(
            f"On the air, with headers, relaying, repeats and acknowledgements, "
            f"{quantity(figures['bandwidth_mean_bps'], 'bit/s')} were sent."
        )
    if figures["mac_attempts_per_frame"] is not None:
        sentences.append(
            f"A frame was sent {figures['mac_attempts_per_frame']:.3g} times on average; "
            f"{percent(figures['attempt_failure_ratio'])} of the attempts failed."
        )
    if figures["cca_busy_ratio"] is not None:
        sentences.append(f"At {percent(figures['cca_busy_ratio'])} of the looks the channel was busy.")
    return " ".join([*sentences, *energy_words(context)])


def map_caption(context: ReportContext) -> str:
    """Return how to read the map."""
    return (
        "All nodes from above; dotted lines are the way of the packets to the base station. The colour of a "
        "source tells which share of its packets arrived."
    )


def node_rows(context: ReportContext) -> list[Row]:
    """Return what each node sent, what of it arrived, and what it drew."""
    nodes = context.tables["nodes"]
    sources = by_source(context)
    rows: list[Row] = []
    for node in nodes.assign(drawn_j=drawn_by_node_j(nodes)).head(_MOST_ROWS).to_dict("records"):
        made, delivery, delay_s = 0, None, None
        if node["node"] in sources.index:
            made, delivery, delay_s = sources.loc[node["node"], ["made", "delivery", "delay_s"]]
        parent = node["parent"] if isinstance(node["parent"], str) else "–"
        capacity, left, died = (
            or_none(node[key]) for key in ("battery_capacity_j", "battery_left_j", "died_at_s")
        )
        rows.append(
            (
                node["node"],
                explained(ROLES, node["role"]),
                f"{parent} ({count(node['depth'])})" if node["depth"] else "–",
                count(int(made)) if made else "–",
                percent(delivery),
                duration(or_none(delay_s)),
                count(node["frames_tx"]),
                count(node["frames_retried"]),
                _share(node["attempts_failed"], node["attempts"]),
                _share(node["cca_busy"], node["cca_total"]),
                count(node["frames_dropped"]),
                quantity(node["drawn_j"], "J"),
                "mains" if capacity is None or left is None else percent(left / capacity),
                "–" if died is None else duration(died),
            )
        )
    return rows


def _share(part: float, whole: float) -> str:
    return percent(part / whole) if whole else "–"
