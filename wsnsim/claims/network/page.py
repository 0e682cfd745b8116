"""`reports/network.md` and `reports/network.csv`: all sections run, each row judged."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from math import isnan
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from wsnsim.claims.files import write_page
from wsnsim.claims.markdown import NONE, paragraph, signed, table
from wsnsim.claims.network import dcf, energy, errors, hidden, one_hop, stars, traces, trees
from wsnsim.claims.network.rows import Estimate, Row, record
from wsnsim.claims.network.section import Section
from wsnsim.report.wording import number
from wsnsim.runs.provenance import provenance

NAME = "network"
SECTIONS: tuple[Callable[[], Section], ...] = (
    one_hop.section,
    stars.section,
    trees.section,
    hidden.section,
    errors.section,
    energy.section,
    dcf.section,
)
"""What the page is made of, in its order, one module each; the traces come last where they are at hand."""
_MARKS = {True: "✓", False: "✗", None: NONE}
_DIGITS = 5
_ROUNDING = 1e-12
"""A difference below it is the machine's."""

_HEAD = """
Ours beside theory, an exact Monte Carlo of the protocol and ns-3 3.37, on the same layouts. Unless a section
says otherwise the radio is that of ns-3's lr-wpan module: log-distance loss 40.05 + 30 log10 d dB, 0 dBm,
noise −106.99 dBm, clear channel assessment at −96.6 dBm; 117 B on the air for 100 B of payload,
acknowledgements, 3 retries, queues of 30 frames; no mesh header.
"""
_RULE = """
Ours is the mean over independent runs ± its standard error; a reference shows one where its source gives it.
✓: the difference lies within what is allowed; ✗: it does not; –: the reference stands there for information.
Every row is in [`network.csv`](network.csv).
"""


def write_report(
    out: Path,
    data: Path | None = None,
    workers: int | None = None,
    said: Callable[[str], None] = lambda text: None,
) -> bool:
    """Run everything, write page and table; return whether all that is asked holds.

    Parameters
    ----------
    out : folder for both files
    data : folder of the traces; None leaves their section out
    workers : processes; None: one for each CPU
    said : told how far it is

    Raises
    ------
    OutputError : a file cannot be written, or a trace is not there
    """
    sections = [make() for make in SECTIONS]
    if data is not None:
        sections.append(traces.section(data))
    rows = computed(sections, workers, said)
    write_page(out, NAME, page(sections, rows), record([row for own in rows for row in own]), {})
    return all(row.passed is not False for own in rows for row in own)


def computed(
    sections: Sequence[Section], workers: int | None = None, said: Callable[[str], None] = lambda text: None
) -> list[list[Row]]:
    """Return the rows of each section; the same whatever the number of processes."""
    tasks = [task for section in sections for task in section.tasks]
    results: list[Any] = [None] * len(tasks)
    # fork would copy the threads of libraries that the caller has loaded
    with ProcessPoolExecutor(workers or os.cpu_count(), mp_context=get_context("spawn")) as pool:
        # the long ones stand last in most sections: who begins with them ends sooner
        futures = {at: pool.submit(tasks[at]) for at in reversed(range(len(tasks)))}
        for done, (at, future) in enumerate(futures.items(), start=1):
            results[at] = future.result()
            said(f"{done} of {len(tasks)} runs")
    rows, begin = [], 0
    for section in sections:
        end = begin + len(section.tasks)
        rows.append(section.rows(results[begin:end]))
        begin = end
    return rows


def page(sections: Sequence[Section], rows: Sequence[Sequence[Row]]) -> str:
    """Return the page's text."""
    asked = [row for own in rows for row in own if row.passed is not None]
    held = sum(row.passed is True for row in asked)
    parts = [
        "# The network against theory, an exact Monte Carlo and ns-3\n",
        paragraph(_HEAD.strip()),
        paragraph(
            f"Made by `make network-report`; nothing here is written by hand. **{held} of {len(asked)}** "
            "comparisons hold."
        ),
        paragraph(_RULE.strip()),
    ]
    for section, own in zip(sections, rows, strict=True):
        parts += [f"## {section.title}\n", paragraph(section.words.strip()), _table(own)]
    return "\n".join([*parts, "## Versions\n", _versions()])


def _table(rows: Sequence[Row]) -> str:
    heads = ("case", "figure", "source", "ours", "theirs", "difference", "allowed", "")
    lines, before = [], ("", "")
    for row in rows:
        case = "" if row.case == before[0] else row.case
        figure = "" if (row.case, row.figure) == before else f"`{row.figure}`"
        before = (row.case, row.figure)
        allowed = NONE if row.allowed is None else str(row.allowed)
        lines.append(
            (
                case,
                figure,
                row.source,
                _shown(row.ours),
                _shown(row.reference),
                _difference(row),
                allowed,
                _MARKS[row.passed],
            )
        )
    return table(heads, lines, numbers_from=3)


def _shown(estimate: Estimate) -> str:
    text = number(estimate.value, _DIGITS).replace("-", "−")
    if isnan(estimate.standard_error) or estimate.standard_error == 0.0:
        return text
    return f"{text} ± {number(estimate.standard_error, 2)}"


def _difference(row: Row) -> str:
    """Return it as what is allowed is counted: a share, or in the figure's unit."""
    if abs(row.difference) < _ROUNDING:
        return "0"
    if row.allowed is not None and not row.allowed.relative:
        return signed(row.difference)
    return f"{signed(100.0 * row.difference / row.reference.value)} %" if row.reference.value else NONE


def _versions() -> str:
    made = provenance()
    libraries = ", ".join(
        f"{name} {made['libraries'][name]}" for name in ("simpy", "numpy", "numba", "scipy")
    )
    return f"wsnsim {made['wsnsim']}, Python {made['python']}, {libraries}; {made['machine']}.\n"
