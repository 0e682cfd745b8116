"""`reports/multiview.md`, its figures and its table of all runs."""

from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

from wsnsim.claims.markdown import NONE, picture, table
from wsnsim.claims.multiview import charts, paths, tables, words
from wsnsim.claims.multiview.claims import CLAIMS
from wsnsim.claims.multiview.evidence import DEFAULT, FORMS, PUBLISHED, Evidence, read_evidence
from wsnsim.claims.record import record_text
from wsnsim.claims.rules import Band, Finding, Judgement, Mark, Verdict, judged
from wsnsim.store.folder import write_text
from wsnsim.store.writer import cannot_write

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

_VERDICTS = {
    Verdict.REPRODUCED: "**reproduced**",
    Verdict.IN_PART: "*in part*",
    Verdict.NOT_REPRODUCED: "not reproduced",
    Verdict.NOT_RUN: NONE,
}
_MARKS = {Mark.HOLDS: "✓", Mark.FAILS: "✗", Mark.UNDECIDED: "?"}


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
    figures = {name: draw(evidence) for name, draw in FIGURES.items()}
    try:
        (out / NAME).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(out, error) from error
    for name, svg in figures.items():
        write_text(out / NAME / f"{name}.svg", svg)
    write_text(out / f"{NAME}.csv", record)
    write_text(out / f"{NAME}.md", text)


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
            tables.studies(evidence),
            "## The claims, one by one\n",
            words.RULE,
            _overview(verdicts),
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
            _details(verdicts),
            words.DIFFERENCES,
            "## Versions\n",
            tables.provenance(evidence),
            f"Figures: matplotlib {version('matplotlib')}.\n",
        ]
    )


def _picture(name: str, words: str) -> str:
    return picture(f"{NAME}/{name}.svg", words)


def _overview(verdicts: list[dict[str, Judgement[Evidence]]]) -> str:
    rows = []
    for at, both in enumerate(verdicts, start=1):
        claim = both[DEFAULT].claim
        marks = (_VERDICTS[both[form].verdict] for form in (PUBLISHED, DEFAULT))
        rows.append((f"[{at}](#{claim.key})", claim.text, claim.where, *marks))
    return table(("", "claim", "where", PUBLISHED, DEFAULT), rows, numbers_from=5)


def _details(verdicts: list[dict[str, Judgement[Evidence]]]) -> str:
    parts = []
    for at, both in enumerate(verdicts, start=1):
        claim = both[DEFAULT].claim
        rows = [
            (one.part.what, _band_text(one), _found(one), _found(other))
            for one, other in zip(both[PUBLISHED].findings, both[DEFAULT].findings, strict=True)
        ]
        parts += [
            f'<a id="{claim.key}"></a>\n**{at}. {claim.text}**\n',
            table(("number", "must be", PUBLISHED, DEFAULT), rows, numbers_from=4),
        ]
    return "\n".join(parts)


def _band_text(finding: Finding[Evidence]) -> str:
    band, show = finding.part.band, finding.part.show
    if band.low == band.high:
        return show(band.low)
    if band.low == -_NO_END:
        return f"{'below' if band.open else 'at most'} {show(band.high)}"
    if band.high == _NO_END:
        return f"{'above' if band.open else 'at least'} {show(band.low)}"
    return f"{show(band.low)} to {show(band.high)}"


_NO_END = Band().high


def _found(finding: Finding[Evidence]) -> str:
    value, mark = finding.value, finding.mark
    if value is None or mark is None:
        return NONE
    show = finding.part.show
    text = show(value.value)
    if value.high > value.low:
        text += f" ({show(value.low)} to {show(value.high)})".replace("× ", "")
    return f"{_MARKS[mark]} {text}"
