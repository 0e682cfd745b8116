"""What the page says at its head and its end: how to read it, by which rule it judges, what differs."""

from wsnsim.claims.markdown import paragraph
from wsnsim.claims.scanline.evidence import Evidence, axis
from wsnsim.claims.scanline.parts import LITTLE, POOR, SLACK
from wsnsim.claims.scanline.studies import KALMAN, PAPER_SD, PERFECT
from wsnsim.report.wording import count, listed, number, plural

HEAD = """\
# One object among occluders, by scan lines, against the paper

Ercan, El Gamal & Guibas (2007), *Object Tracking in the Presence of Occlusions via a Camera Network*. The
tracker stands here in two forms: *published*, the printed equations (`preset: published`), where the page
says so; else *default*, the mended ones. What was mended, and the limits: [README](../README.md).
"""
RULE = paragraph(
    f"""The rule, in code (`wsnsim/claims/rules.py`): a claim is split into numbers, each with a band in which
it must lie. A number *holds* ✓ if its whole 95 % interval lies in the band, *fails* ✗ if the whole
interval lies outside, and is *undecided* ? otherwise. All hold: **reproduced**; none holds: not
reproduced; else *in part*. Ratios are geometric means over runs paired by their seed, with Student's
interval of the logarithm; what is counted has no interval. “Poor” and “notably” mean a ratio of {POOR:g} and
{LITTLE:g}, “close” at most {POOR:g}, “marginal” at most {LITTLE:g}, “ordered” at most {SLACK:g}. Of so many
intervals about one in twenty misses the truth. A dash: no study ran it. What decided each claim stands
[below](#what-decided-each-claim)."""
)
_ROOM = (
    "One unit is 20 cm: the room of 100 × 100 units is one of 20 × 20 m, a step of one unit at 7.5 frames a "
    "second a walk of 1.5 m/s. The paper gives neither the cameras' places nor their focal length nor the "
    "block's size: four cameras stand at the wall middles here, eight at these and in the corners, 320 "
    "pixels of focal length, a block of 40 × 20 units. Where cameras stand matters more than anything "
    "else, so that ratios can be compared, levels hardly."
)
_RUN_FOR = {
    "cameras": "Fig. 9",
    "priors": "Fig. 10",
    "tradeoff": "Fig. 11",
    "occluders": "Fig. 12",
    "lab": "Fig. 15",
    "trackers": "the other trackers",
    "hull": "the visual hull",
    "radio": "the radio",
}
_PAPERS_MAX = {"block": "25.0", "open": "21.3", "lab": "61.8"}
"""RMSE_max of the paper's rooms, the last in inches."""
_PAPERS_PERFECT = 1.94 * 3.72 / 2.35
"""RMSE_tr with perfect priors in Fig. 10, from the factors that the paper tells [unit]."""


def made_from(evidence: Evidence, record: str) -> str:
    """Say what the page was made of."""
    runs = sum(len(results.runs) for results in evidence.studies)
    return paragraph(
        f"Made by `make scanline-report` from {plural(runs, 'run')}; nothing here is written by hand. The "
        f"figures of every run are in [`{record}`]({record}), and any row of it can be run again by itself."
    )


def conventions(evidence: Evidence) -> str:
    """Say how errors are told here, and most likely in the paper, and how long runs are."""
    rooms, perfect = evidence.rooms, evidence.known(PERFECT)
    assert perfect is not None
    middles = {"block": rooms.block, "open": rooms.open, "lab": rooms.lab}
    ours = [
        f"{paper} ({number(axis(middles[room].occluders))} on one axis here, "
        f"{number(middles[room].occluders)} over both)"
        for room, paper in _PAPERS_MAX.items()
    ]
    own = rooms.open.filters[f"{KALMAN}-{PAPER_SD}"]
    level = float(perfect.rmse().mean())
    return "\n".join(
        [
            paragraph(
                "Errors are root mean squares over all steps of a run, then means over the runs ± 95 % "
                "interval. *RMSE* is of the distance on the floor, over both axes; *per axis* is the same on "
                "one of them, less by √2. Charts and limits of claims in units or inches are over both axes; "
                "ratios are the same in either."
            ),
            paragraph(
                "The paper does not say which it plots, and uses both: its RMSE_max is of one axis, "
                f"{listed(ours)}. Its RMSE_occ of 6.67 at σ_v = {PAPER_SD} is over both, where ours is "
                f"{number(own)}: on one, a measurement alone errs by {PAPER_SD}, a filter would hardly "
                "do anything. Its RMSE_tr is likely over both, too: with perfect priors in Fig. 10 it is "
                f"{number(_PAPERS_PERFECT)}, here {number(level)} over both, {number(axis(level))} on one."
            ),
            paragraph(f"{_steps(evidence)} The paper's simulations have 4,000 steps, its lab 200."),
            paragraph(_ROOM),
        ]
    )


def steps_of(evidence: Evidence, study: str) -> int:
    """Return the steps of most runs of a study, by its name's end."""
    own = next(results for results in evidence.studies if results.study.name == f"scanline-{study}")
    return int(own.runs["steps"].mode().iloc[0])


def _steps(evidence: Evidence) -> str:
    """Say how long the runs of each study are."""
    by_length: dict[int, list[str]] = {}
    for results in evidence.studies:
        short = results.study.name.removeprefix("scanline-")
        by_length.setdefault(steps_of(evidence, short), []).append(_RUN_FOR[short])
    said = [
        f"{count(steps)} steps for {listed(names, len(names))}"
        for steps, names in sorted(by_length.items(), reverse=True)
    ]
    return f"A run has {'; '.join(said)}."


def differences(evidence: Evidence) -> str:
    """Say what is not as in the paper."""
    own = evidence.rooms.open.filters[f"{KALMAN}-{PAPER_SD}"]
    return f"""\
## What is not as in the paper

- The crowd goes round each other by a rule of our own; a camera and its neighbours may stand in other
  places.
- The paper's Kalman filter is not given. The default one fits how the crowd moves, and its error at σ_v = 8
  units is {number(own)}, less than the paper's 6.67.
- The lab was real: its cameras, its path and what they measured are ours. The occluders that delete
  measurements were virtual there too.
- JPEG frames are rendered; people and walls have less texture than in a real room, which makes them smaller.
- CPU times are those of this machine, compiled code against the paper's MATLAB, and of whole steps of the
  filter without the block.
"""
