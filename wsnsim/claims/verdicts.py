"""Verdicts on claims as Markdown: a table of all, and what decided each."""

from collections.abc import Mapping, Sequence
from typing import TypeVar

from wsnsim.claims.markdown import NONE, table
from wsnsim.claims.rules import Band, Finding, Judgement, Mark, Verdict

E = TypeVar("E")

_VERDICTS = {
    Verdict.REPRODUCED: "**reproduced**",
    Verdict.IN_PART: "*in part*",
    Verdict.NOT_REPRODUCED: "not reproduced",
    Verdict.NOT_RUN: NONE,
}
_MARKS = {Mark.HOLDS: "✓", Mark.FAILS: "✗", Mark.UNDECIDED: "?"}
_NO_END = Band().high


def overview(verdicts: Sequence[Mapping[str, Judgement[E]]], forms: Sequence[str]) -> str:
    """Return a row for each claim with its verdict in each form.

    Parameters
    ----------
    verdicts : of each claim, by form
    forms : the columns
    """
    rows = []
    for at, judged in enumerate(verdicts, start=1):
        claim = judged[forms[0]].claim
        marks = (_VERDICTS[judged[form].verdict] for form in forms)
        rows.append((f"[{at}](#{claim.key})", claim.text, claim.where, *marks))
    return table(("", "claim", "where", *forms), rows, numbers_from=3 + len(forms))


def details(verdicts: Sequence[Mapping[str, Judgement[E]]], forms: Sequence[str]) -> str:
    """Return for each claim the numbers that it turns on, in each form."""
    parts = []
    for at, judged in enumerate(verdicts, start=1):
        claim = judged[forms[0]].claim
        rows = [
            (findings[0].part.what, _band_text(findings[0]), *(_found(each) for each in findings))
            for findings in zip(*(judged[form].findings for form in forms), strict=True)
        ]
        parts += [
            f'<a id="{claim.key}"></a>\n**{at}. {claim.text}**\n',
            table(("number", "must be", *forms), rows, numbers_from=2 + len(forms)),
        ]
    return "\n".join(parts)


def _band_text(finding: Finding[E]) -> str:
    band, show = finding.part.band, finding.part.show
    if band.low == band.high:
        return show(band.low)
    if band.low == -_NO_END:
        return f"{'below' if band.open else 'at most'} {show(band.high)}"
    if band.high == _NO_END:
        return f"{'above' if band.open else 'at least'} {show(band.low)}"
    return f"{show(band.low)} to {show(band.high)}"


def _found(finding: Finding[E]) -> str:
    value, mark = finding.value, finding.mark
    if value is None or mark is None:
        return NONE
    show = finding.part.show
    text = show(value.value)
    if value.high > value.low:
        text += f" ({show(value.low)} to {show(value.high)})".replace("× ", "")
    return f"{_MARKS[mark]} {text}"
