"""What the page says around its tables and figures: how to read them, and what they show, in numbers."""

from wsnsim.claims.markdown import paragraph, ratio_text
from wsnsim.claims.scanline.charts import needed_for
from wsnsim.claims.scanline.claims import LITTLE, POOR, SLACK, behind_block, crowd, in_lab, known
from wsnsim.claims.scanline.evidence import (
    ALONE,
    BYTES,
    CAMERAS,
    CROWDS,
    FORMS,
    HEARD,
    KALMAN,
    LAB_CAMERAS,
    LATE,
    NONE,
    PERFECT,
    TRADED,
    Evidence,
    axis,
)
from wsnsim.claims.scanline.measures import (
    COMPONENTS,
    WANTED,
    crossing,
    energy_a_frame,
    gain_from_crossing,
    ratio,
)
from wsnsim.metrics.statistics import Interval
from wsnsim.report.wording import count, listed, number, percent, plural, quantity

HEAD = """\
# One object among occluders, by scan lines, against the paper

Ercan, El Gamal & Guibas (2007), *Object Tracking in the Presence of Occlusions via a Camera Network*. The
tracker stands here in two forms: *published*, the printed equations (`preset: published`), where the page
says so; else *default*, the mended ones. What was mended, and the limits: [README](../README.md).
"""
CONVENTIONS = """\
Errors are root mean squares over all steps of a run, then means over the runs ± 95 % interval. *RMSE* is of
the distance on the floor, over both axes; *per axis* is the same on one of them, less by √2. The paper does
not say which it plots: its RMSE_max fit one axis, its RMSE_occ both. One unit is 20 cm: the room of 100 ×
100 units is one of 20 × 20 m, a step of one unit at 7.5 frames a second a walk of 1.5 m/s. The paper gives
neither the cameras' places nor their focal length nor the block's size: four cameras stand at the wall
middles here, eight at these and in the corners, 320 pixels of focal length, a block of 40 × 20 units. Where
cameras stand matters more than anything else, so that ratios can be compared, levels hardly. Runs of Fig. 10
have 4,000 steps, as the paper's; those of the other figures of the room 1,000, as all of them would take a
day.
"""
RULE = paragraph(
    f"""The rule, in code (`wsnsim/claims/rules.py`): a claim is split into numbers, each with a band in which
it must lie. A number *holds* ✓ if its whole 95 % interval lies in the band, *fails* ✗ if the whole
interval lies outside, and is *undecided* ? otherwise. All hold: **reproduced**; none holds: not
reproduced; else *in part*. Ratios are geometric means over runs paired by their seed, with Student's
interval of the logarithm; what is counted has no interval. “Poor” and “notably” mean a ratio of {POOR:g} and
{LITTLE:g}, “marginal” at most {LITTLE:g}, “ordered” at most {SLACK:g}. Of so many intervals about one in
twenty misses the truth. A dash: no study ran it. What decided each claim stands
[below](#what-decided-each-claim)."""
)
TRACKERS = """\
The setting of Fig. 10, 1,000 steps, with the trackers that Sec. 4 finds wanting. The Kalman filters have no
use for what is known of the occluders. *As printed* is without floors under the weights and without the
rescaling of Eq. 5; *one stage* draws its particles without a look at the measurements.
"""
HULLS = """\
Eight cameras without the block, 500 steps. Ellipses and polygons are the two readings of the visual hull in
Sec. 4.4; *scan_lines* uses the same messages without a hull: a blind camera must show a blob where the
object would be.
"""
RADIO = """\
Eight cameras with the block at 7.5 frames a second, 1,000 steps (JPEG: 20), motes Imote2 at 416 MHz with
radios always on, the base station as the cluster head. Bytes on the air are those of all frames, with
headers, repeats and acknowledgements. A report is heard in time if it is there 200 ms after its frame, one
and a half frame periods. The motes that measure the occluders' places for *kalman* and *perfect* do so for
nothing here: no sensor for it is reckoned with. Energies are of a camera's node; processing is priced by the
pixel (difference to the background, threshold, sum of the columns) whatever is said of it.
"""
DIFFERENCES = """\
## What is not as in the paper

- The crowd goes round each other by a rule of our own; a camera and its neighbours may stand in other
  places.
- The paper's Kalman filter is not given. The default one fits how the crowd moves, and its error at σ_v = 8
  units is less than the paper's 6.67.
- The lab was real: its cameras, its path and what they measured are ours. The occluders that delete
  measurements were virtual there too.
- JPEG frames are rendered; people and walls have less texture than in a real room, which makes them smaller.
- CPU times are those of this machine, compiled code against the paper's MATLAB, and of whole steps of the
  filter without the block.
"""


def made_from(evidence: Evidence, record: str) -> str:
    """Say what the page was made of."""
    runs = sum(len(results.runs) for results in evidence.studies)
    return paragraph(
        f"Made by `make scanline-report` from {plural(runs, 'run')}; nothing here is written by hand. The "
        f"figures of every run are in [`{record}`]({record}), and any row of it can be run again by itself."
    )


def cameras(evidence: Evidence) -> str:
    """Say what priors bring at each number of cameras with the block."""
    said = []
    for n in CAMERAS:
        found = ratio(behind_block(n, NONE), behind_block(n, PERFECT))(evidence)
        assert found is not None
        said.append(f"{n}: {ratio_text(found)}")
    return paragraph(
        "Counterpart of Fig. 9, 40 occluders and the block; *Kalman* is σ_v = 8 units. Not monotone in the "
        "number of cameras, as the subsets stand in different places. Error without priors over that with "
        f"perfect ones, by cameras: {', '.join(said)}."
    )


def priors(evidence: Evidence) -> str:
    """Say how the factor and the crossing compare to the paper's."""
    said = []
    for form in FORMS:
        found = ratio(known(NONE), known(PERFECT))(evidence.seen_as(form))
        if found is not None:
            said.append(f"{form} × {ratio_text(found)}")
    at, gain = crossing(evidence), gain_from_crossing(evidence)
    assert at is not None
    assert gain is not None
    worst = evidence.occluders.unknown
    return paragraph(
        f"Counterpart of Fig. 10, four cameras, no block. None over perfect: {listed(said)} (paper: 2.35). "
        f"The curve meets the dotted line of equal errors at {_interval(at)} units (paper: 3.72), from where "
        f"knowing less costs × {ratio_text(gain)} (paper: 1.94). Who takes all occluders to be in the middle "
        f"errs by {number(worst)} units over both axes, {number(axis(worst))} on one (paper: 21.3). RMSE of "
        "the priors is that of the head's own filters beside the true crowd, first seed, 1,000 steps. "
        "Dashed: what the paper does not try, knowledge that costs no sensor."
    )


def trade(evidence: Evidence) -> str:
    """Say how good priors must be for three units at each number of cameras."""
    said = []
    for n in TRADED:
        at = needed_for(evidence, n)
        if at != at:
            said.append(f"{n} do not get there")
        elif at >= evidence.occluders.unknown:
            said.append(f"{n} need none")
        else:
            said.append(f"{n} need {number(at)} units")
    return paragraph(
        f"Counterpart of Fig. 11, no block: for an RMSE of {WANTED:g} units, of the cameras, "
        f"{', '.join(said)}. Four are read from the curve of Fig. 10, others, where they need any priors, "
        "from a line between perfect ones and none."
    )


def crowds(evidence: Evidence) -> str:
    """Say what perfect priors bring at each number of occluders."""
    said = []
    for m in CROWDS:
        found = ratio(crowd(m, NONE), crowd(m, PERFECT))(evidence)
        assert found is not None
        said.append(f"{count(m)}: {ratio_text(found)}")
    return paragraph(
        "Counterpart of Fig. 12, four cameras, no block; right, the difference of the two with the interval "
        "of the paired runs. Error without priors over that with perfect ones, by occluders: "
        f"{', '.join(said)}."
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
    return paragraph(
        f"Counterpart of Fig. 13, CPU time of a whole step of the filter, 1,000 particles, 40 occluders. "
        f"From {numbers[0]} to {numbers[-1]} cameras: {listed(said)}; in proportion (dotted) it would be "
        f"× {number(numbers[-1] / numbers[0])}, and as the recursion's 2ᴺ "
        f"× {count(2 ** (numbers[-1] - numbers[0]))}."
    )


def lab(evidence: Evidence) -> str:
    """Say what priors bring in the lab."""
    said = []
    for n in LAB_CAMERAS:
        found = ratio(in_lab(n, NONE), in_lab(n, PERFECT))(evidence)
        assert found is not None
        said.append(f"{n}: {ratio_text(found)}")
    return paragraph(
        "Counterpart of Fig. 15: 22' × 19', cameras of 47°, 200 steps of one path, 20 virtual occluders of "
        "12 inches and a virtual block, a run for each crowd; errors in inches. *Kalman* errs by 14.2 "
        f"inches. Error without priors over that with perfect ones, by cameras: {', '.join(said)}."
    )


def costs(evidence: Evidence) -> str:
    """Say what bearings, scan lines and images cost."""
    said = []
    for cell, name in (("bearing", "bearings"), ("scan_line", "whole scan lines"), ("jpeg", "JPEG frames")):
        parts, place = energy_a_frame(evidence, cell), evidence.on_air(cell)
        assert place is not None
        whole = sum(float(parts[each].mean()) for each in COMPONENTS)
        heard = percent(float(place.figure(HEARD).mean()))
        said.append(
            f"{name} {quantity(_sent(evidence, cell), 'J')} of {quantity(whole, 'J')}, {heard} in time"
        )
    alone = evidence.on_air(ALONE)
    assert alone is not None
    size, late = float(alone.figure(BYTES).mean()), float(alone.figure(LATE).mean())
    return paragraph(
        "Left, all that a camera's node draws from one frame to the next. Energy for sending of all energy, "
        f"a frame: {'; '.join(said)}. Of JPEG frames at this rate next to nothing is sent before its time is "
        f"over. Right, what sending a whole frame takes: a camera that has the channel to itself needs "
        f"{quantity(_sent(evidence, ALONE), 'J')} and {number(late)} s for {quantity(size, 'B')}. The radio "
        "listens for most of its energy, and processor and board take far more: what is said matters for the "
        "channel, and for the battery only where radios sleep."
    )


def _sent(evidence: Evidence, cell: str) -> float:
    return float(energy_a_frame(evidence, cell)["radio_tx"].mean())


def _interval(found: Interval) -> str:
    return f"{number(found.value)} ({number(found.low)} to {number(found.high)})"
