"""Writes report.html: one offline file with words, figures and tables.

The page holds everything it needs, plotly's basic bundle included, and its
own content policy forbids it to ask anybody for more.
"""

from pathlib import Path
from typing import Any

from markupsafe import Markup

from wsnsim.report import packet_words, packets, rows, words
from wsnsim.report.bynode import bandwidth_figure, energy_figure
from wsnsim.report.captions import paths_caption, timeline_caption
from wsnsim.report.context import ReportContext
from wsnsim.report.document import SCRIPTS, asset, figure_json, policy, template
from wsnsim.report.images import gallery
from wsnsim.report.keyfigures import key_rows
from wsnsim.report.latency import delay_figure, latency_figure
from wsnsim.report.paths import paths_figure
from wsnsim.report.timeline import timeline_figure
from wsnsim.report.view import nodes_view, world_view
from wsnsim.report.wording import duration, listed, plural
from wsnsim.store.folder import write_text


def write_report(path: Path, context: ReportContext) -> None:
    """Write the report of a run; the same context gives the same bytes.

    Raises
    ------
    OutputError : the file cannot be written
    """
    write_text(path, render(context))


def render(context: ReportContext) -> str:
    """Return the report as HTML."""
    scripts = [asset(name) for name in SCRIPTS]
    parts = _tracking(context) if context.cameras else _network(context)
    charts = {name: chart for name, chart in parts.pop("charts").items() if chart is not None}
    return template("page.html.j2").render(
        run=context,
        chosen=words.chosen(context),
        base_supply=words.base_supply(context),
        key_rows=key_rows(context.summary, main=True),
        more_rows=key_rows(context.summary, main=False),
        message_rows=rows.message_rows(context),
        message_notes=rows.message_notes(context),
        event_rows=rows.event_rows(context),
        figures={name: figure_json(chart) for name, chart in charts.items()},
        scripts=[Markup(script) for script in scripts],
        style=Markup(asset("page.css")),
        licence=asset("LICENSE-plotly.js"),
        policy=policy(scripts),
        **parts,
    )


def _tracking(context: ReportContext) -> dict[str, Any]:
    """Return the parts that tell of cameras and targets."""
    return {
        "charts": {
            "paths": paths_figure(context),
            "timeline": timeline_figure(context),
            "bandwidth": bandwidth_figure(context),
            "energy": energy_figure(context),
            "latency": latency_figure(context),
        },
        "facts": _facts(context),
        "verdicts": words.verdicts(context),
        "service": words.service(context),
        "information": words.information(context),
        "aspect": world_view(context).aspect,
        "paths_caption": paths_caption(context),
        "timeline_caption": timeline_caption(context),
        "gallery": gallery(context),
        "node_heads": rows.NODE_HEADS,
        "node_rows": rows.node_rows(context),
    }


def _network(context: ReportContext) -> dict[str, Any]:
    """Return the parts that tell of a network without cameras."""
    return {
        "charts": {
            "paths": packets.network_map(context),
            "delivery": packets.delivery_figure(context),
            "losses": packets.losses_figure(context),
            "delay": delay_figure(context),
            "bandwidth": bandwidth_figure(context),
            "energy": energy_figure(context),
        },
        "facts": packet_words.facts(context),
        "verdicts": packet_words.verdicts(context),
        "service": packet_words.service(context),
        "information": None,
        "aspect": nodes_view(context).aspect,
        "paths_caption": packet_words.map_caption(context),
        "timeline_caption": None,
        "gallery": None,
        "node_heads": packet_words.NODE_HEADS,
        "node_rows": packet_words.node_rows(context),
    }


def _facts(context: ReportContext) -> str:
    """Return the line under the title."""
    nodes, steps = context.tables["nodes"], context.tables["steps"]
    relays = int((nodes["role"] == "relay").sum())
    parts = [plural(int(steps["target"].nunique()), "target"), plural(len(context.cameras), "camera")]
    if relays:
        parts.append(plural(relays, "relay"))
    steps_made = int(context.summary["steps"] or 0)
    return (
        f"{listed(parts)} over {context.standard}, {plural(steps_made, 'step')} in "
        f"{duration(context.summary['simulated_s'])}, seed {context.seed}"
    )
