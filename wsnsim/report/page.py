"""Writes report.html: one offline file with words, figures and tables.

The page holds everything it needs, plotly's basic bundle included, and its
own content policy forbids it to ask anybody for more.
"""

import hashlib
import json
from base64 import b64encode
from importlib.resources import files
from pathlib import Path

import jinja2
import plotly.graph_objects as go
from markupsafe import Markup

from wsnsim.report import rows, words
from wsnsim.report.bynode import bandwidth_figure, energy_figure
from wsnsim.report.captions import paths_caption, timeline_caption
from wsnsim.report.context import ReportContext
from wsnsim.report.keyfigures import key_rows
from wsnsim.report.paths import paths_figure
from wsnsim.report.timeline import timeline_figure
from wsnsim.report.view import world_view
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
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    scripts = [_asset("plotly-basic.min.js"), _asset("page.js")]
    style = _asset("page.css")
    return environment.from_string(_asset("page.html.j2")).render(
        run=context,
        facts=_facts(context),
        verdicts=words.verdicts(context),
        service=words.service(context),
        information=words.information(context),
        base_supply=words.base_supply(context),
        key_rows=key_rows(context.summary, main=True),
        more_rows=key_rows(context.summary, main=False),
        message_rows=rows.message_rows(context),
        node_rows=rows.node_rows(context),
        event_rows=rows.event_rows(context),
        aspect=world_view(context).aspect,
        paths_caption=paths_caption(context),
        timeline_caption=timeline_caption(context),
        figures={
            "paths": _json(paths_figure(context)),
            "timeline": _json(timeline_figure(context)),
            "bandwidth": _json(bandwidth_figure(context)),
            "energy": _json(energy_figure(context)),
        },
        scripts=[Markup(script) for script in scripts],
        style=Markup(style),
        licence=_asset("LICENSE-plotly.js"),
        policy=_policy(scripts),
    )


def _asset(name: str) -> str:
    return (files("wsnsim.report") / "assets" / name).read_text("utf-8")


def _policy(scripts: list[str]) -> str:
    """Return a content policy: these scripts by their hashes, nothing from elsewhere."""
    hashes = (b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{value}'" for value in hashes)
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:"


def _json(figure: go.Figure) -> Markup:
    """Return a figure as JSON that can stand inside a script element."""
    text = json.dumps(figure.to_plotly_json(), separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))


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
