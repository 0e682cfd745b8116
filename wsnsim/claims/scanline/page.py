"""`reports/scanline.md`, its figures and its table of all runs."""

from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

from wsnsim.claims.files import write_page
from wsnsim.claims.made import provenance_table, studies_table
from wsnsim.claims.markdown import picture
from wsnsim.claims.record import record_text
from wsnsim.claims.rules import Judgement, judged
from wsnsim.claims.scanline import charts, cost_charts, cost_words, findings, tables, words
from wsnsim.claims.scanline.claims import CLAIMS
from wsnsim.claims.scanline.evidence import FIGURES as RECORDED
from wsnsim.claims.scanline.evidence import Evidence, read_evidence
from wsnsim.claims.scanline.studies import FORMS
from wsnsim.claims.verdicts import details, overview

NAME = "scanline"
FIGURES: Mapping[str, Callable[[Evidence], str]] = {
    "cameras": charts.by_cameras,
    "priors": charts.by_priors,
    "tradeoff": charts.trade,
    "occluders": charts.by_crowd,
    "times": charts.times,
    "lab": charts.in_lab,
    "energy": cost_charts.energy,
    "radio": cost_charts.bargain,
}
"""Each file of `reports/scanline/` and what draws it."""


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
    text, record = page(evidence), record_text(evidence.studies, RECORDED)
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
            words.conventions(evidence),
            "## The claims, one by one\n",
            words.RULE,
            overview(verdicts, FORMS),
            "## More cameras\n",
            _picture("cameras", "Error against the number of cameras, by kind of priors"),
            findings.cameras(evidence),
            tables.cameras(evidence),
            "## Better priors\n",
            _picture("priors", "Error of the tracker against that of the priors"),
            findings.priors(evidence),
            tables.priors(evidence),
            "## Cameras for priors\n",
            _picture("tradeoff", "Error without the block, and how good priors must be for three units"),
            findings.trade(evidence),
            tables.trade(evidence),
            "## More occluders\n",
            _picture("occluders", "Error against the number of occluders, and what priors bring"),
            findings.crowds(evidence),
            tables.crowd(evidence),
            "## Time\n",
            _picture("times", "CPU time of a step against the number of cameras"),
            findings.times(evidence),
            tables.times(evidence),
            "## The lab\n",
            _picture("lab", "Error in the lab against the number of cameras"),
            findings.lab(evidence),
            tables.lab(evidence),
            "## Other trackers\n",
            cost_words.trackers(evidence),
            tables.trackers(evidence),
            "## The visual hull\n",
            cost_words.hulls(evidence),
            tables.hulls(evidence),
            "## What it costs, over IEEE 802.15.4\n",
            cost_words.radio(evidence),
            _picture("energy", "Energy of a camera's node a frame by component, and reports heard in time"),
            cost_words.costs(evidence),
            tables.energy(evidence),
            _picture("radio", "Error against bytes on the air and against joules of sending"),
            tables.radio(evidence),
            "## What decided each claim\n",
            details(verdicts, FORMS),
            words.differences(evidence),
            "## Versions\n",
            provenance_table(evidence.studies),
            f"Figures: matplotlib {version('matplotlib')}.\n",
        ]
    )


def _picture(name: str, caption: str) -> str:
    return picture(f"{NAME}/{name}.svg", caption)
