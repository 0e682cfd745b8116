"""What the page says under each figure: what was found, beside what the paper says, in numbers."""

from collections.abc import Callable, Sequence
from itertools import pairwise

from wsnsim.claims.markdown import paragraph, ratio_text
from wsnsim.claims.scanline.evidence import Evidence, axis
from wsnsim.claims.scanline.measures import (
    WANTED,
    Where,
    crossing,
    error,
    gain_from_crossing,
    needed_for,
    ratio,
)
from wsnsim.claims.scanline.parts import SLACK
from wsnsim.claims.scanline.settings import behind_block, crowd_gap, in_lab, known, lab_gap, open_room
from wsnsim.claims.scanline.studies import (
    CAMERA_STUDY,
    CAMERAS,
    CROWDS,
    FORMS,
    KALMAN,
    LAB_CAMERAS,
    NONE,
    PERFECT,
    PRIORS,
    TRADED,
    WHOLE,
    params_of,
    runs_of,
)
from wsnsim.metrics.statistics import Interval
from wsnsim.report.wording import count, listed, number
from wsnsim.systems.scanline.choices import ParticleTracker


def cameras(evidence: Evidence) -> str:
    """Say what priors bring at each number of cameras with the block."""
    said = [f"{n}: {_over(evidence, behind_block(n, NONE), behind_block(n, PERFECT))}" for n in CAMERAS]
    room = evidence.rooms.block
    return paragraph(
        "Counterpart of Fig. 9, 40 occluders and the block; *Kalman* is σ_v = 8 units, an error of "
        f"{number(room.filters[KALMAN])} units here. Error without priors over that with perfect ones, by "
        f"cameras: {', '.join(said)}. {_disorder(evidence, behind_block, CAMERAS)}{_rises(evidence)} Dotted: "
        "nothing is measured and the "
        f"object taken to be in the room's centre, {number(room.target)} units over both axes, "
        f"{number(axis(room.target))} on one (paper, of occluders: 25.0)."
    )


def priors(evidence: Evidence) -> str:
    """Say how the factor and the crossing compare to the paper's."""
    said = []
    for form in FORMS:
        found = ratio(known(NONE), known(PERFECT))(evidence.seen_as(form))
        if found is not None:
            said.append(f"{form} × {ratio_text(found)}")
    at, gain = _present(crossing(evidence)), _present(gain_from_crossing(evidence))
    levels = [number(_present(error(known(prior))(evidence)).value) for prior in (NONE, PERFECT)]
    room = evidence.rooms.open
    return paragraph(
        f"Counterpart of Fig. 10, four cameras, no block. None over perfect: {listed(said)} (paper: 2.35). "
        f"In units that is {levels[0]} over {levels[1]} (paper, from its ratios: 7.22 over 3.07). The curve "
        "meets the dotted line of equal "
        f"errors at {_interval(at)} units (paper: 3.72), from where knowing less costs × {ratio_text(gain)} "
        "(paper: 1.94). Who takes all occluders to be in the middle errs by "
        f"{number(room.occluders)} units over both axes, {number(axis(room.occluders))} on one (paper: "
        "21.3). RMSE of the priors is that of the head's own filters beside the true crowd. Dashed: what the "
        "paper does not try, knowledge that costs no sensor."
    )


def trade(evidence: Evidence) -> str:
    """Say how good priors must be for three units at each number of cameras."""
    said = []
    for n in TRADED:
        at = needed_for(evidence, n)
        if at != at:
            said.append(f"{n} do not get there")
        elif at >= evidence.rooms.open.occluders:
            said.append(f"{n} need none")
        else:
            said.append(f"{n} need {number(at)} units")
    text = (
        f"Counterpart of Fig. 11, no block: for an RMSE of {WANTED:g} units over both axes, of the cameras, "
        f"{', '.join(said)}. Four are read from the curve of Fig. 10, others, where they need any priors, "
        "from a line between perfect ones and none."
    )
    three, four = (_present(error(open_room(n, NONE))(evidence)).value for n in (3, 4))
    if three < four:
        text += (
            " Three do better than four: two of the three stand in corners, from where a camera of 90° sees "
            "the whole room, the four at wall middles, where it does not."
        )
    return paragraph(text)


def crowds(evidence: Evidence) -> str:
    """Say what perfect priors bring at each number of occluders."""
    said = [f"{count(m)}: {_over(evidence, *crowd_gap(m))}" for m in CROWDS]
    gaps = {m: [_present(error(where)(evidence)).value for where in crowd_gap(m)] for m in CROWDS}
    most = max(CROWDS, key=lambda m: gaps[m][0] - gaps[m][1])
    return paragraph(
        "Counterpart of Fig. 12, four cameras, no block; right, the difference of the two with the interval "
        f"of the paired runs. It is greatest at {count(most)} occluders. Error without priors over that with "
        f"perfect ones, by occluders: {', '.join(said)}."
    )


def times(evidence: Evidence) -> str:
    """Say how time grows with the number of cameras."""
    speed = evidence.speed
    if speed is None:
        return paragraph("CPU times were not measured: `make scanline-report` does it with the studies.")
    numbers = sorted({n for _, n in speed.step_s})
    said = []
    for prior in (KALMAN, PERFECT, NONE):
        grown = speed.growth(prior, numbers[0], numbers[-1])
        if grown is not None:
            said.append(f"{prior} × {number(grown)}")
    twins = [f"{number(over)} times as long at N = {n}" for n, over in sorted(speed.over_twin.items())]
    text = (
        f"Counterpart of Fig. 13, CPU time of a whole step of the filter, 1,000 particles, 40 occluders. "
        f"From {numbers[0]} to {numbers[-1]} cameras: {listed(said)}; in proportion (dotted) it would be "
        f"× {number(numbers[-1] / numbers[0])}, and as the recursion's 2ᴺ "
        f"× {count(2 ** (numbers[-1] - numbers[0]))}. The paper times the likelihood alone; of a step "
        "without priors most does not depend on the cameras here, and it grows the less."
    )
    if twins:
        text += f" The same likelihoods with Gaussian priors, written in plain Python, take {listed(twins)}."
    return paragraph(text)


def lab(evidence: Evidence) -> str:
    """Say what priors bring in the lab."""
    said = [f"{n}: {_over(evidence, *lab_gap(n))}" for n in LAB_CAMERAS]
    few, most = (
        [_present(error(where)(evidence)).value for where in lab_gap(n)]
        for n in (LAB_CAMERAS[0], LAB_CAMERAS[-1])
    )
    room = evidence.rooms.lab
    return paragraph(
        "Counterpart of Fig. 15: 22' × 19', cameras of 47°, one path, 20 virtual occluders of 12 inches and "
        "a virtual block, a run for each crowd; errors in inches. *Kalman* errs by "
        f"{number(room.filters[KALMAN])} inches over both axes (paper: 14.2), who takes all occluders to be "
        f"in the middle by {number(axis(room.occluders))} on one (paper: 61.8). Error without priors over "
        f"that with perfect ones, by cameras: {', '.join(said)}. Perfect priors save "
        f"{number(few[0] - few[1])} inches at N = {LAB_CAMERAS[0]} and {number(most[0] - most[1])} at "
        f"N = {LAB_CAMERAS[-1]}. {_disorder(evidence, in_lab, LAB_CAMERAS)} Where the exponent "
        f"is 1, Kalman priors at N = {LAB_CAMERAS[-1]} err "
        f"× {_over(evidence, in_lab(LAB_CAMERAS[-1], WHOLE), in_lab(LAB_CAMERAS[-1], KALMAN))} as much."
    )


def _disorder(evidence: Evidence, where: Callable[[int, str], Where], numbers: Sequence[int]) -> str:
    """Say at which numbers of cameras better priors are worse, by means, and why."""
    said = []
    for n in numbers:
        for worse, better in pairwise(PRIORS):
            found = _present(ratio(where(n, better), where(n, worse))(evidence))
            if found.value > SLACK:
                said.append(f"× {ratio_text(found)} at N = {n} ({better} over {worse})")
    if not said:
        return "In the paper's order everywhere."
    return (
        f"Not in the paper's order: {listed(said, len(said))}. A filter's error lasts from frame to frame, "
        "and the likelihood takes the occlusions of each frame as news: the more cameras, the surer it is of "
        f"what is not so. `tracker.visibility_exponent`, {number(_exponent())} here and 1 in the paper, "
        "takes from that, but not all."
    )


def _rises(evidence: Evidence) -> str:
    """Say from where to where one more camera behind the block is no help to who knows everything."""
    means = {n: _present(error(behind_block(n, PERFECT))(evidence)).value for n in CAMERAS}
    said = [f"from {n} to {more}" for n, more in pairwise(CAMERAS) if means[more] > means[n]]
    if not said:
        return ""
    return f" Errors rise {listed(said)} cameras, as the subsets stand in different places."


def _exponent() -> float:
    tracker = params_of(runs_of(CAMERA_STUDY)[0]).tracker
    assert isinstance(tracker, ParticleTracker)
    return tracker.visibility_exponent


def _over(evidence: Evidence, where: Where, other: Where) -> str:
    return ratio_text(_present(ratio(where, other)(evidence)))


def _present(found: Interval | None) -> Interval:
    assert found is not None
    return found


def _interval(found: Interval) -> str:
    return f"{number(found.value)} ({number(found.low)} to {number(found.high)})"
