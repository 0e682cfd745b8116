"""What every page is made with: its assets, its content policy, figures as JSON."""

import hashlib
import json
from base64 import b64encode
from importlib.resources import files

import jinja2
import plotly.graph_objects as go
from markupsafe import Markup

SCRIPTS = ("plotly-basic.min.js", "page.js")


def asset(name: str) -> str:
    """Return the text of a file that comes with the package."""
    return (files("wsnsim.report") / "assets" / name).read_text("utf-8")


def template(name: str) -> jinja2.Template:
    """Return a page's template, which escapes whatever it is given."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(asset(name))


def policy(scripts: list[str]) -> str:
    """Return a content policy: these scripts by their hashes, nothing from elsewhere."""
    hashes = (b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{value}'" for value in hashes)
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:"


def figure_json(figure: go.Figure) -> Markup:
    """Return a figure as JSON that can stand inside a script element."""
    text = json.dumps(figure.to_plotly_json(), separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))
