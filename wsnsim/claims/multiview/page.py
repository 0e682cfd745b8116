"""`reports/multiview.md`, its figures and its table of all runs."""

from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

from wsnsim.claims.files import write_page
from wsnsim.claims.made import provenance_table, studies_table
from wsnsim.claims.markdown import picture
from wsnsim.claims.multiview import charts, paths, tables, words
from wsnsim.claims.multiview.claims import CLAIMS
from wsnsim.claims.multiview.evidence import FORMS, Evidence, read_evidence
from wsnsim.claims.record import record_text
from wsnsim.claims.rules import Judgement, judged
from wsnsim.claims.verdicts import details, overview

NAME = "multiview"
FIGURES: Mapping[str, Callable[[Evidence], str]] = {
    "paths": paths.patch_graphs,
    "steps": paths.errors_by_step,
    "means": charts.means,
    "turning": charts.turning_or_fixed,
    "sight": charts.errors_by_sight,
    "lcr": paths.conference_room,
    "fgh": paths.atrium,
    "radio": charts.radio_costs,
    "factors": charts.factor_ratios,
}
"""Each file of `reports/multiview/` and what draws it."""


def write_report(runs: Path, out: Path) -> None:
    """Write page, figures and table; the same sweeps give the same bytes.

    Parameters
    ----------
    runs : folder that holds the sweeps' folders
    out : folder for the page

    Raises
    ------
    OutputError : a sweep is missing or not complete, or a file cannot be written
    """
    evidence = read_evidence(runs)
    # all of it is made before any of it is written
    text, record = page(evidence), record_text(evidence.studies)
    write_page(out, NAME, text, record, {name: draw(evidence) for name, draw in FIGURES.items()})


def judgements(evidence: Evidence) -> list[dict[str, Judgement[Evidence]]]:
    """Return the verdict on each claim in both forms."""
    return [{form: judged(claim, evidence.seen_as(form)) for form in FORMS} for claim in CLAIMS]


def page(evidence: Evidence) -> str:
    """Return the page's text."""
    verdicts = judgements(evidence)
    return "\n".join(
        [
            words.HEAD,
            words.made_from(evidence, f"{NAME}.csv"),
            studies_table(evidence.studies),
            "## The claims, one by one\n",
            words.RULE,
            overview(verdicts, FORMS),
            "## Accuracy in the simulated setups\n",
            words.ACCURACY,
            tables.accuracy(evidence),
            _picture("means", "Mean errors of all trackers in setups A and B"),
            words.means(evidence),
            _picture("paths", "True and estimated paths in setup B"),
            words.paths(evidence),
            _picture("steps", "Errors by step in setup B, cameras and pixel share"),
            words.steps(evidence),
            _picture("sight", "Median error by pixel share and by number of cameras"),
            words.sight(evidence),
            _picture("turning", "Errors of turning and of fixed targets"),
            words.turned(evidence),
            "## The conference room and the atrium\n",
            tables.deployments(evidence),
            _picture("lcr", "LCR: path, error and pixel share"),
            words.room(evidence, "LCR", "T3", "Figs. 16 and 17"),
            _picture("fgh", "FGH: path, error, cameras and pixel share"),
            words.room(evidence, "FGH", "T2", "Figs. 20 and 21, with people who walk before the target"),
            "## Table 1 in numbers\n",
            words.TABLE_1,
            tables.table_1(evidence),
            "## Bytes are not bits\n",
            words.sizes(evidence),
            tables.sizes(evidence),
            "## Quality of service against quality of information, over IEEE 802.15.4\n",
            words.RADIO,
            _picture("radio", "Error against bytes on the air and against joules"),
            words.costs(evidence),
            tables.radio(evidence),
            "## One factor at a time: T2 in B\n",
            _picture("factors", "Error of T2 over that of the default, factor by factor"),
            words.factors(evidence),
            tables.factors(evidence),
            "## What decided each claim\n",
            details(verdicts, FORMS),
            words.DIFFERENCES,
            "## Versions\n",
            provenance_table(evidence.studies),
            f"Figures: matplotlib {version('matplotlib')}.\n",
        ]
    )


def _picture(name: str, words: str) -> str:
    return picture(f"{NAME}/{name}.svg", words)
