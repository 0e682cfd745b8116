"""Which it was where estimates miss cameras or come late: processors, the radio, or the wait of relays."""

from collections.abc import Mapping
from functools import lru_cache
from statistics import median

from wsnsim.metrics.answers import BUSY, DEAD, LATE, REFUSED, SILENT, UNREADY, UNTOLD, Answers, answers
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import OUTCOMES, explained
from wsnsim.report.losses import fused_on_the_way
from wsnsim.report.wording import count, duration, listed, percent

_PROCESSORS, _RADIO, _WAY, _STOPPED, _USELESS, _QUIET, _HEAD = (
    "the motes' processors",
    "the radio",
    "the radio or the wait of relays",
    "motes that had stopped",
    "messages that were of no use and set aside",
    "cameras that had nothing to say",
    "what a mote that was cluster head heard too late, or had no time for",
)

_CULPRITS: Mapping[str, str] = {
    UNREADY: _PROCESSORS,
    BUSY: _PROCESSORS,
    DEAD: _STOPPED,
    REFUSED: _USELESS,
    "dropped_refused": _USELESS,
    "dropped_undecodable": _USELESS,
    SILENT: _QUIET,
}
"""Whom each reason is laid to; all others to the radio."""

_REASONS: Mapping[str, str] = {
    UNREADY: "ready too late",
    BUSY: "of an image that was not taken",
    UNTOLD: "the camera had not heard the question",
    LATE: "sent in time, but not there in time",
}

_HEADLINES: Mapping[str, str] = {
    _PROCESSORS: "The motes' processors are too slow for what they are asked.",
    _RADIO: "The radio kept answers from the base station.",
    _WAY: "Answers came through the relays too late.",
    _STOPPED: "Motes that had stopped were missed.",
}
_WORTH_A_HEADLINE = 0.1
"""Share of the answers asked for that one of the culprits above has on its conscience."""


def hearing(context: ReportContext, brief: bool) -> list[str]:
    """Return how many of the answers asked for were heard, and what became of the others.

    Parameters
    ----------
    brief : without what a verdict says
    """
    told = _told(context)
    if not told.asked:
        return []
    why = [] if brief else [*_missing(context, told), *_slowness(context, told)]
    return [_heard(told), *why, *_waits(context, told)]


def hearing_verdict(context: ReportContext, radio_is_told: bool) -> list[str]:
    """Return who kept many of the answers from the base station, where somebody did.

    Parameters
    ----------
    radio_is_told : whether the reader knows already that the network lost messages
    """
    told = _told(context)
    culprits = _culprits(context, told)
    worst = next((culprit for culprit in culprits if culprit in _HEADLINES), None)
    if worst is None or (worst == _RADIO and radio_is_told):
        return []
    if sum(culprits[worst].values()) < _WORTH_A_HEADLINE * told.asked:
        return []
    return [
        " ".join([_HEADLINES[worst], _heard(told), *_missing(context, told), *_slowness(context, told)]),
    ]


def readiness(context: ReportContext) -> str:
    """Return when answers are ready, as the end of a sentence on the latency of estimates."""
    ready_s = None if _mote_tracks(context) else _told(context).ready_s
    return "" if ready_s is None else f"; a camera had its answer ready after {duration(ready_s)} (median)"


def _mote_tracks(context: ReportContext) -> bool:
    """Return whether cameras answer to a mote, which tells the base station of the target."""
    return bool((context.tables["messages"]["kind"] == "track").any())


@lru_cache(maxsize=1)
def _told(context: ReportContext) -> Answers:
    return answers(context.tables, context.wait_s)


def _heard(told: Answers) -> str:
    if told.heard == told.asked:
        return f"All {count(told.asked)} answers that cameras were asked for were heard."
    share = "none" if not told.heard else count(told.heard)
    were = "was" if told.heard == 1 else "were"
    return (
        f"Of {count(told.asked)} answers that cameras were asked for, {share} {were} heard in time "
        f"({percent(told.heard / told.asked)})."
    )


def _missing(context: ReportContext, told: Answers) -> list[str]:
    """Return whom the missing answers are laid to, the most of them first."""
    missing = told.asked - told.heard
    if not missing:
        return []
    culprits = _culprits(context, told)
    if len(culprits) == 1:
        ((culprit, reasons),) = culprits.items()
        which = "The missing one is" if missing == 1 else f"The {count(missing)} missing are"
        return [f"{which} down to {culprit}{_details(reasons)}."]
    shares = [
        f"{count(sum(reasons.values()))} to {culprit}{_details(reasons)}"
        for culprit, reasons in culprits.items()
    ]
    verb = "is" if sum(next(iter(culprits.values())).values()) == 1 else "are"
    shares[0] = shares[0].replace(" to ", f" {verb} down to ", 1)
    return [f"Of the {count(missing)} missing, {listed(shares, most=len(shares))}."]


def _culprits(context: ReportContext, told: Answers) -> dict[str, dict[str, int]]:
    """Return the reasons of missing answers and their numbers by culprit, the largest first."""
    found: dict[str, dict[str, int]] = {}
    for reason, number in sorted(told.missing.items(), key=lambda item: -item[1]):
        culprit = _CULPRITS.get(reason, _RADIO)
        if reason == SILENT and _mote_tracks(context):
            # what reaches a mote does not reach the base station, nor the records of answers to it
            culprit = _HEAD
        if reason in (LATE, "dropped_expired") and fused_on_the_way(context):
            culprit = _WAY
        found.setdefault(culprit, {})[reason] = number
    return dict(sorted(found.items(), key=lambda item: -sum(item[1].values())))


def _details(reasons: Mapping[str, int]) -> str:
    """Return the reasons in brackets, counted where there are several; nothing where the culprit says all."""
    words = {
        reason: _REASONS.get(reason) or explained(OUTCOMES, reason).removeprefix("lost: ")
        for reason in reasons
        if _CULPRITS.get(reason) not in (_STOPPED, _USELESS, _QUIET)
    }
    if len(words) == 1:
        return f" ({next(iter(words.values()))})"
    parts = [f"{count(reasons[reason])} × {text}" for reason, text in words.items()]
    return f" ({', '.join(parts)})" if parts else ""


def _slowness(context: ReportContext, told: Answers) -> list[str]:
    """Return how long the motes take whose answers were ready too late."""
    if not told.slow_s or context.wait_s is None:
        return []
    by_platform: dict[str, list[float]] = {}
    for camera, ready_s in told.slow_s.items():
        by_platform.setdefault(context.platforms.get(camera, ""), []).append(ready_s)
    platform = max(sorted(by_platform), key=lambda name: len(by_platform[name]))
    whose = f"a mote of platform {platform}" if platform else "a mote"
    return [
        f"Where it was too late, {whose} had its answer ready {duration(median(by_platform[platform]))} "
        f"after the image (median); the base station waits {duration(context.wait_s)}."
    ]


def _waits(context: ReportContext, told: Answers) -> list[str]:
    """Return how many estimates came late because cameras were missing."""
    if not told.waited or context.wait_s is None:
        return []
    whole = told.waited == told.estimates
    share = f"All {count(told.waited)}" if whole else f"{count(told.waited)} of {count(told.estimates)}"
    was = "was" if told.waited == 1 else "were"
    return [
        f"{share} estimates from measurements {was} made only when the base station had waited "
        f"{duration(context.wait_s)} for missing answers."
    ]
