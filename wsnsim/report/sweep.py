"""Writes the report of a sweep: one offline page with charts of cost against error, and comparisons."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from wsnsim.metrics.cells import Losses, compare, compare_losses
from wsnsim.metrics.statistics import Interval
from wsnsim.report.document import SCRIPTS, asset, figure_json, policy, template
from wsnsim.report.keyfigures import KEY_FIGURES
from wsnsim.report.sweepfigures import cost_figure
from wsnsim.report.wording import count, number, percent, plural
from wsnsim.store.folder import write_text

if TYPE_CHECKING:
    import pandas as pd

Row = tuple[str, ...]


@dataclass(frozen=True)
class _Subject:
    """What a study is about, and what its report shows unless it is told otherwise.

    Parameters
    ----------
    x, y : figures of the charts, across and up
    shown : those that stand in the table of cells beside them
    caption : how to read the charts
    """

    x: tuple[str, ...]
    y: str
    shown: tuple[str, ...]
    caption: str


_SCALES = (
    "Scales are logarithmic where means are far apart; an interval that reaches below a tenth of its mean is "
    "cut there."
)
_TRACKING = _Subject(
    ("mac_bytes_per_step", "energy_per_step_j"),
    "position_error_mean_m",
    ("reprojection_error_mean_px", "latency_p95_s"),
    "Each marker is a cell: the mean over its seeds of what it costs (across) and of its error (up), with "
    f"95 % intervals. Down and to the left is better. {_SCALES}",
)
_TRAFFIC = _Subject(
    ("offered_bps", "latency_p95_s"),
    "delivery_ratio",
    ("throughput_bps", "attempt_failure_ratio", "energy_total_j"),
    f"Each marker is a cell: means over its seeds with 95 % intervals. {_SCALES}",
)
_SHOW = {figure.key: figure for figure in KEY_FIGURES}


@dataclass(frozen=True, eq=False)
class SweepContext:
    """A sweep, as its report sees it.

    Parameters
    ----------
    name : of the study
    cells : the table of cells, with `baseline` (the cell it is compared to) and `settings` (JSON)
    runs : one row for each cell and seed
    x : figures that are costs, one chart each; None: those that fit the study
    y : the figure that they buy; None: the one that fits
    tracking : whether there are runs with cameras
    overrides : values from the command line in every run
    made_with : versions that results were made with
    """

    name: str
    cells: "pd.DataFrame"
    runs: "pd.DataFrame"
    x: tuple[str, ...] | None
    y: str | None
    tracking: bool
    overrides: tuple[str, ...]
    made_with: "pd.DataFrame"

    @property
    def subject(self) -> _Subject:
        """What the study is about."""
        return _TRACKING if self.tracking else _TRAFFIC

    @property
    def across(self) -> tuple[str, ...]:
        """Figures across, one chart each."""
        return self.x or self.subject.x

    @property
    def up(self) -> str:
        """Figure up, in all charts."""
        return self.y or self.subject.y


@dataclass(frozen=True)
class Section:
    """A part of the page: all cells of a scenario, or those of one factor beside the default."""

    title: str
    words: str
    charts: tuple[str, ...]
    tables: tuple["Table", ...]


@dataclass(frozen=True)
class Table:
    """A table as text."""

    caption: str
    heads: Row
    rows: list[Row]
    numbers: tuple[int, ...] = field(default=())


def write_sweep_report(path: Path, context: SweepContext) -> None:
    """Write the page; the same results give the same bytes.

    Raises
    ------
    OutputError : the file cannot be written
    """
    write_text(path, render_sweep(context))


def render_sweep(context: SweepContext) -> str:
    """Return the page as HTML."""
    scripts = [asset(name) for name in SCRIPTS]
    charts: dict[str, Markup] = {}
    sections = [
        section
        for scenario in context.cells["scenario"].unique()
        for section in _sections(context, str(scenario), charts)
    ]
    return template("sweep.html.j2").render(
        name=context.name,
        facts=_facts(context),
        overrides=context.overrides,
        failed=_failed_rows(context),
        pending=int((context.runs["status"] == "pending").sum()),
        sections=sections,
        caption=context.subject.caption,
        settings=_settings_table(context),
        versions=_versions(context),
        figures=charts,
        scripts=[Markup(script) for script in scripts],
        style=Markup(asset("page.css")),
        licence=asset("LICENSE-plotly.js"),
        policy=policy(scripts),
    )


def _sections(context: SweepContext, scenario: str, charts: dict[str, Markup]) -> list[Section]:
    """Return the sections of a scenario and put their charts in."""
    cells = context.cells[context.cells["scenario"] == scenario]
    baseline = cells[cells["cell"] == cells["baseline"].iloc[0]]
    groups = [str(factor) for factor in cells["factor"].unique() if factor]
    of = f" of {scenario}" if scenario else ""
    first = int(cells["cell"].iloc[0])
    overview = Section(
        title=f"All cells{of}",
        words=f"{plural(len(cells), 'cell')}; the others are compared to “{_label(baseline.iloc[0])}”.",
        charts=_draw(context, cells, f"cells{first}", charts, by_factor=len(groups) > 1),
        tables=(_cells_table(context, cells),),
    )
    sections = [overview]
    for at, group in enumerate(groups):
        own = cells[cells["factor"] == group]
        shown = cells[(cells["factor"] == group) | (cells["cell"] == baseline["cell"].iloc[0])]
        compared = _comparison_table(context, own, baseline.iloc[0])
        if len(groups) == 1:
            sections[0] = Section(
                overview.title, overview.words, overview.charts, (*overview.tables, compared)
            )
        else:
            drawn = _draw(context, shown, f"cells{first}factor{at}", charts, by_factor=False)
            sections.append(Section(f"{group}{of}", "", drawn, (compared,)))
    return sections


def _draw(
    context: SweepContext, cells: "pd.DataFrame", name: str, charts: dict[str, Markup], by_factor: bool
) -> tuple[str, ...]:
    made = []
    for at, key in enumerate(context.across):
        charts[f"{name}x{at}"] = figure_json(
            cost_figure(cells, key, context.up, (_axis_title(key), _axis_title(context.up)), by_factor)
        )
        made.append(f"{name}x{at}")
    return tuple(made)


def _cells_table(context: SweepContext, cells: "pd.DataFrame") -> Table:
    keys = list(dict.fromkeys([context.up, *context.across, *context.subject.shown]))
    lost_head = ("lost a target",) if context.tracking else ()
    heads = ("cell", "runs", *lost_head, *(_title(key) for key in keys))
    rows: list[Row] = []
    for cell in cells.to_dict("records"):
        lost = (_lost_text(cell),) if context.tracking else ()
        rows.append((_label(cell), count(cell["runs"]), *lost, *(_mean_text(cell, key) for key in keys)))
    return Table("Mean ± 95 % interval over the seeds", heads, rows, tuple(range(1, len(heads))))


def _lost_text(cell: Mapping[Any, Any]) -> str:
    if not cell["runs"]:
        return "–"
    ends = f"{percent(cell['lost_share_low'])} to {percent(cell['lost_share_high'])}"
    return f"{count(cell['lost_runs'])} of {count(cell['runs'])} ({ends})"


def _comparison_table(context: SweepContext, cells: "pd.DataFrame", baseline: "pd.Series[Any]") -> Table:
    name = _label(baseline)
    lost_head = (f"runs lost only here / only in {name} (p)",) if context.tracking else ()
    heads = (
        "cell",
        "seeds",
        f"{_title(context.up)}, ratio",
        f"{_title(context.up)}, difference",
        *(f"{_title(key)}, ratio" for key in context.across),
        *lost_head,
    )
    rows: list[Row] = []
    for cell in cells.to_dict("records"):
        if cell["cell"] == baseline["cell"]:
            continue
        pair = (context.runs, int(cell["cell"]), int(baseline["cell"]))
        main = compare(*pair, context.up)
        ratios = (_ratio_text(compare(*pair, key).ratio) for key in context.across)
        difference = main.difference
        apart = "–" if difference.n == 0 else _signed(context.up, difference)
        lost = (_losses_text(compare_losses(*pair)),) if context.tracking else ()
        rows.append((_label(cell), count(main.seeds), _ratio_text(main.ratio), apart, *ratios, *lost))
    caption = (
        f"Beside “{name}” on the same seeds: geometric mean of the paired ratios, mean of the paired "
        "differences, 95 % intervals"
    )
    if context.tracking:
        caption += "; exact test of McNemar for lost targets"
    return Table(caption, heads, rows, tuple(range(1, len(heads))))


def _losses_text(losses: Losses) -> str:
    return f"{losses.here} / {losses.there} ({number(losses.probability, 2)})"


def _facts(context: SweepContext) -> str:
    status = context.runs["status"]
    parts = [plural(len(context.cells), "cell"), plural(int(context.runs["seed"].nunique()), "seed")]
    scenarios = int(context.cells["scenario"].nunique())
    if scenarios > 1:
        parts.insert(0, plural(scenarios, "scenario"))
    done = int((status == "complete").sum())
    return f"{', '.join(parts)}; {count(done)} of {plural(len(status), 'run')} complete"


def _failed_rows(context: SweepContext) -> list[Row]:
    failed = context.runs[context.runs["status"] == "failed"]
    return [(str(row["name"]), str(row["seed"]), str(row["error"])) for row in failed.to_dict("records")]


def _settings_table(context: SweepContext) -> Table:
    rows: list[Row] = [(str(row["name"]), str(row["settings"])) for row in context.cells.to_dict("records")]
    return Table("What each cell sets", ("cell", "settings"), rows)


def _versions(context: SweepContext) -> list[str]:
    return [
        f"wsnsim {row['wsnsim']}, Python {row['python']}, {row['platform']}; {row['libraries']}"
        for row in context.made_with.to_dict("records")
    ]


def _label(cell: "Mapping[Any, Any] | pd.Series[Any]") -> str:
    """Return a cell's name without its scenario."""
    name, scenario = str(cell["name"]), str(cell["scenario"])
    return name.removeprefix(f"{scenario}/") if scenario else name


def _title(key: str) -> str:
    return _SHOW[key].label if key in _SHOW else key


def _axis_title(key: str) -> str:
    unit = _unit(key)
    return f"{_title(key)} [{unit}]" if unit else _title(key)


_UNITS = {"m": "m", "px": "px", "s": "s", "j": "J", "bps": "bit/s", "deg": "°"}


def _unit(key: str) -> str:
    if "_bytes_per_step" in key:
        return "B"
    return _UNITS.get(key.rpartition("_")[2], "")


def _shown(key: str, value: float | None) -> str:
    return _SHOW[key].show(value) if key in _SHOW else number(value)


def _mean_text(cell: Mapping[Any, Any], key: str) -> str:
    """Return ``6.10 cm ± 0.60 cm``."""
    if not cell[f"{key}_n"]:
        return "–"
    mean, low = float(cell[key]), float(cell[f"{key}_low"])
    text = _shown(key, mean)
    # a single run has no interval, and one without any spread needs none
    return text if not mean - low > 0 else f"{text} ± {_shown(key, mean - low)}"


def _ratio_text(ratio: Interval) -> str:
    if not ratio.n:
        return "–"
    text = f"× {number(ratio.value)}"
    return f"{text} ({number(ratio.low)} to {number(ratio.high)})" if ratio.high > ratio.low else text


def _signed(key: str, difference: Interval) -> str:
    sign = "−" if difference.value < 0 else "+"
    text = f"{sign}{_shown(key, abs(difference.value))}"
    half = difference.high - difference.value
    return f"{text} ± {_shown(key, half)}" if half > 0 else text
