"""The tables at the foot of a report, as text."""

from wsnsim.metrics.energy import drawn_by_node_j
from wsnsim.metrics.traffic import content_arrived
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import EVENTS, MESSAGES, OUTCOMES, ROLES, explained
from wsnsim.report.losses import message_kinds
from wsnsim.report.wording import count, duration, listed, percent, quantity

Row = tuple[str, ...]

NODE_HEADS = (
    "node",
    "role",
    "next hop (hops)",
    "application data sent",
    "data on the air",
    "frames sent",
    "of them repeats",
    "frames given up",
    "images taken / skipped",
    "processor busy",
    "energy",
    "battery left",
    "stopped at",
)


def message_rows(context: ReportContext) -> list[Row]:
    """Return a row for each kind of message and what became of it.

    Returns
    -------
    kind, what became of it, messages, share of the kind, messages whose content arrived in the end, bytes
    """
    messages = context.tables["messages"]
    messages = messages.assign(kind=message_kinds(context), arrived=content_arrived(messages))
    totals = messages["kind"].value_counts()
    groups = messages.groupby(["kind", "outcome"], as_index=False).agg(
        rows=("bytes", "size"), arrived=("arrived", "sum"), size=("bytes", "sum")
    )
    groups = groups.sort_values(["kind", "rows", "outcome"], ascending=[True, False, True])
    return [
        (
            group["kind"],
            explained(OUTCOMES, group["outcome"]),
            count(group["rows"]),
            percent(group["rows"] / totals[group["kind"]]),
            count(group["arrived"]),
            quantity(group["size"], "B"),
        )
        for group in groups.to_dict("records")
    ]


def message_notes(context: ReportContext) -> str:
    """Return what the kinds of messages say, as far as that is known here."""
    kinds = sorted(set(message_kinds(context)) & MESSAGES.keys())
    return "; ".join(f"{kind}: {MESSAGES[kind]}" for kind in kinds) + "." if kinds else ""


def node_rows(context: ReportContext) -> list[Row]:
    """Return what each node did and drew."""
    nodes = context.tables["nodes"]
    seconds = float(context.summary["simulated_s"] or 1.0)
    rows: list[Row] = []
    for node in nodes.assign(drawn_j=drawn_by_node_j(nodes)).to_dict("records"):
        capacity, left, died = (
            _value(node[key]) for key in ("battery_capacity_j", "battery_left_j", "died_at_s")
        )
        parent = node["parent"] if isinstance(node["parent"], str) else "–"
        rows.append(
            (
                node["node"],
                explained(ROLES, node["role"]),
                f"{parent} ({count(node['depth'])})" if node["depth"] else "–",
                quantity(node["app_tx_bytes"], "B"),
                quantity(node["mac_tx_bytes"], "B"),
                count(node["frames_tx"]),
                count(node["frames_retried"]),
                count(node["frames_dropped"]),
                f"{count(node['images_taken'])} / {count(node['images_skipped'])}"
                if node["images_taken"]
                else "–",
                percent(node["cpu_busy_s"] / (died or seconds)),
                quantity(node["drawn_j"], "J"),
                "mains" if capacity is None or left is None else percent(left / capacity),
                "–" if died is None else duration(died),
            )
        )
    return rows


def event_rows(context: ReportContext) -> list[Row]:
    """Return (what happened, how often, where, first, last) for each kind of event."""
    events = context.tables["events"]
    rows: list[Row] = []
    for kind, group in events.groupby("kind", sort=True):
        places = listed(sorted(str(node) for node in group["node"].unique()))
        first, last = float(group["time_s"].min()), float(group["time_s"].max())
        rows.append(
            (explained(EVENTS, str(kind)), count(len(group)), places, duration(first), duration(last))
        )
    return rows


def _value(number: float | None) -> float | None:
    return None if number is None or number != number else number
