"""What the page says around its tables and figures: how to read them, and what they show, in numbers."""

import pandas as pd

from wsnsim.claims.markdown import paragraph, ratio_text
from wsnsim.claims.multiview.claims import DEPENDS, MUCH, SAME
from wsnsim.claims.multiview.evidence import (
    DEFAULT,
    ERROR_M,
    ERROR_PX,
    FORMS,
    LOST,
    OFFERED,
    TRACKERS,
    WITH_RELAYS,
    Evidence,
    turning,
)
from wsnsim.claims.multiview.measures import dependence_on_pixels, single_camera_interval, turning_over_fixed
from wsnsim.claims.multiview.paths import DRAWN, first_run
from wsnsim.metrics.statistics import mean_interval
from wsnsim.report.wording import count, length, listed, percent, plural, quantity

HEAD = """\
# Trackers P and T0 to T4 against the paper

Kushwaha & Koutsoukos (2013), *Collaborative 3D Target Tracking in Distributed Smart Camera Networks for
Wide-Area Surveillance*. Each tracker stands here in two forms: *published*, the printed equations, repaired
only where they cannot run (`preset: published`), and *default*, the mended ones. What was mended, and the
limits: [README](../README.md).
"""
RULE = paragraph(
    f"""The rule, in code (`wsnsim/claims/rules.py`): a claim is split into numbers, each with a band in which
it must lie. A number *holds* ✓ if its whole 95 % interval lies in the band, *fails* ✗ if the whole
interval lies outside, and is *undecided* ? otherwise. All hold: **reproduced**; none holds: not
reproduced; else *in part*. Ratios are geometric means over runs paired by their seed, with Student's
interval of the logarithm; what is counted has no interval. “Poor” and “diverges” mean an error at least
{MUCH:g} times as large, “as good” {SAME.low:g} to {SAME.high:g} times, “harm” a rank correlation of
{DEPENDS:g} or more. Of so many intervals about one in twenty misses the truth. A dash: no study ran it.
What decided each claim stands
[below](#what-decided-each-claim)."""
)
ACCURACY = """\
Mean over the runs ± 95 % interval; each seed has a path of its own, the same for every tracker. A run is lost
if the error at its end is above two target lengths, or if the tracker has given the target up. `25px`:
particles in the images that spread over 25 px, near or far.
"""
TABLE_1 = """\
Default forms in B, the paper's grades in brackets. T0, T1 and T2 weigh 1,000 particles in space, P, T3
and T4 500 in each image; computation is told in processor cycles, of all motes together. Errors are in A and
in B. A rank correlation near −1 means that fewer pixels go with larger errors.
"""
RADIO = """\
Setup B over IEEE 802.15.4 on a tree of up to four hops, motes Imote2 at 416 MHz, default forms, messages in 8
bits unless the name says `float64`. Bytes on the air are those of all frames, with headers, repeats and
acknowledgements; joules are those of all motes with their radios always on. *Cameras heard*: of the cameras
that were asked, the share whose answers were in an estimate. The base station waits 225 ms for all trackers
but T0 (450 ms), so that *cameras heard* tells more than the latency does. One run can decide a mean of 15:
T2's largest error is that of a seed in which one answer is missing just where two cameras see the target.
"""
DIFFERENCES = """\
## What differs from the paper

- In A all cameras are one hop from the base station, and T2 is T1. In B most mixtures have one component,
  whose product is exact: fusing on the way changes the error in the sixth digit.
- T3 with a fixed spread contains a prediction as wide as that spread, of which the prediction in space is
  divided out: a part of what `T3-25px` loses is that. `T4-25px` divides out what it contains.
- At 8 Hz an answer is wanted within 112 ms, and an Imote2 works about that long on a frame: the row `rate=8`
  shows the processor, not the frame rate.
- LCR and FGH have three seeds each: enough to see a failure, not to tell trackers apart.
- The paper gives neither the cameras' places nor the target, its path, the noise or the spread of particles:
  the worlds are ours (`scenarios/published/`), frozen by tests. Its rooms were real, ours are rendered.
- The paper shows its results as charts without numbers and without intervals: claims can be tested, values
  cannot be compared.
- Targets that turn have other seeds, hence other paths, than those that do not, as in the paper's 15
  experiments.
- The default forms sharpen the likelihood (raw Bhattacharyya coefficients have too little contrast to be
  weights), count the shared prior once where the densities of several cameras are multiplied, and choose
  cameras by the whole cloud of particles. The [README](../README.md) lists the rest.
- Cycles are operations priced by a table, not measured on a mote.
"""


def made_from(evidence: Evidence, record: str) -> str:
    """Say what the page was made of."""
    runs = sum(len(results.runs) for results in evidence.studies)
    return paragraph(
        f"Made by `make reports` from {plural(runs, 'run')}; nothing here is written by hand. The figures of "
        f"every run are in [`{record}`]({record}), and any row of it can be run again by itself."
    )


def means(evidence: Evidence) -> str:
    """Say which trackers are best and worst in each setup."""
    said = []
    for setup in ("A", "B"):
        for form in FORMS:
            seen = evidence.seen_as(form)
            errors = {}
            for tracker in TRACKERS:
                values = seen.figure(setup, tracker, ERROR_M)
                assert values is not None
                errors[tracker] = mean_interval(values.to_numpy()).value
            order = sorted(TRACKERS, key=lambda tracker: errors[tracker])
            best, worst = order[0], order[-1]
            said.append(
                f"{setup} {form}: {best} {length(errors[best])} to {worst} {length(errors[worst])}, "
                f"{_lost(seen, setup)} lost"
            )
    return paragraph(
        "Counterpart of Figs. 11 and 13, filled markers default, hollow ones published, bars 95 % intervals "
        "(cut at a tenth of the mean where they reach below zero). "
        f"From the least to the greatest mean error, runs of all six trackers: {'; '.join(said)}."
    )


def _lost(evidence: Evidence, setup: str) -> str:
    lost = total = 0
    for tracker in TRACKERS:
        values = evidence.figure(setup, tracker, LOST)
        assert values is not None
        lost, total = lost + int((values > 0).sum()), total + len(values)
    return f"{count(lost)} of {count(total)}"


def paths(evidence: Evidence) -> str:
    """Say how far the trackers of Fig. 9 are off in the run that is drawn."""
    return paragraph(
        "Counterpart of Fig. 9, the first seed of B from above: grey patches between true and estimated path "
        "are the errors; an estimate that runs off leaves the picture. Mean errors of this run: "
        + "; ".join(f"{form}: {_run_errors(evidence.seen_as(form))}" for form in FORMS)
        + "."
    )


def _run_errors(evidence: Evidence) -> str:
    errors = {tracker: float(first_run(evidence, "B", tracker)["error_m"].mean()) for tracker in DRAWN}
    return listed([f"{tracker} {length(error)}" for tracker, error in errors.items()])


def steps(evidence: Evidence) -> str:
    """Say when a single camera sees the target in the run that is drawn, and how small it is."""
    run = first_run(evidence, "B", "T2")
    single = single_camera_interval(run["participating"].to_numpy())
    when = "no single camera is ever alone with it"
    if single is not None:
        numbers = run["step"].to_numpy()
        when = f"a single one at steps {numbers[single[0]]} to {numbers[single[1]]} (red)"
    return paragraph(
        f"Counterpart of Fig. 10, of the same run: {_cameras(run)} cameras see the target, {when}, on "
        f"{percent(run['pixel_share'].min())} to {percent(run['pixel_share'].max())} of their pixels "
        "(dashed: 1 %)."
    )


def _cameras(run: pd.DataFrame) -> str:
    least, most = int(run["participating"].min()), int(run["participating"].max())
    return f"{least} to {most}" if most > least else f"always {least}"


def sight(evidence: Evidence) -> str:
    """Say how errors go with the pixel share."""
    said = []
    for form in FORMS:
        found = []
        for tracker in TRACKERS:
            value = dependence_on_pixels("B", tracker)(evidence.seen_as(form))
            assert value is not None
            found.append(f"{tracker} {ratio_text(value)}")
        said.append(f"{form}: {', '.join(found)}")
    return paragraph(
        "The question of Fig. 10 over all runs of B: median error in eight classes of pixel share with as "
        "many steps each, and by the number of cameras that see the target. Rank correlation of error and "
        f"pixel share within a run, mean over the runs: {'; '.join(said)}. After a target is lost its error "
        "follows its path, not its pixels."
    )


def turned(evidence: Evidence) -> str:
    """Say what turning costs."""
    turns = turning(evidence)
    said = []
    for form in FORMS:
        space, image = (turning_over_fixed(key)(evidence.seen_as(form)) for key in (ERROR_M, ERROR_PX))
        assert space is not None
        assert image is not None
        said.append(f"{form}: × {ratio_text(space)} in space, × {ratio_text(image)} in the images")
    return paragraph(
        f"Counterpart of Fig. 12. Filled: {plural(len(turns) - sum(turns.values()), 'run')} with a fixed "
        f"orientation; hollow: {count(sum(turns.values()))} that turn. Turning over fixed, all trackers "
        f"together: {'; '.join(said)}."
    )


def room(evidence: Evidence, world: str, tracker: str, figures: str) -> str:
    """Say how a tracker did in a room, and what its cameras saw."""
    run = first_run(evidence, world, tracker)
    return paragraph(
        f"Counterpart of {figures}: {tracker}, default, first seed, {count(len(run))} steps. The mean error "
        f"is {length(float(run['error_m'].mean()))}, the greatest {length(float(run['error_m'].max()))}; "
        f"{_cameras(run)} cameras see the target, on "
        f"{percent(run['pixel_share'].min())} to {percent(run['pixel_share'].max())} of their pixels."
    )


def sizes(evidence: Evidence) -> str:
    """Say what the paper's count of bytes comes to in bits."""
    counted = 80 + 8 * 1000 * 4

    def load(cell: str) -> str:
        return quantity(float(evidence.variants.figure(cell, OFFERED).mean()), "bit/s")

    return paragraph(
        f"The paper counts {count(counted)} bytes a step for T0, with four cameras and 1000 weights of eight "
        f"bytes, and calls that about 128 kbit/s at 4 Hz; eight bits a byte make it "
        f"{quantity(8.0 * counted * 4, 'bit/s')}. Measured: {load('A/T0')} in A, {load('B/T0')} in B; the "
        "whole channel of IEEE 802.15.4 is 250 kbit/s. The table counts bytes a step in float64 over the "
        "ideal network, with orientations and with the messages down the tree. *Sent* is what programs hand "
        "over (messages that are fused on their way are handed over at every hop), *with relays* counts each "
        "hop."
    )


def costs(evidence: Evidence) -> str:
    """Say where the trackers stand on the charts of costs."""
    results = evidence.radio
    said = []
    for name in (str(name) for name in results.cells["name"] if name in TRACKERS):
        error, size = (float(results.figure(name, key).mean()) for key in (ERROR_M, WITH_RELAYS))
        said.append(f"{name} {length(error)} for {quantity(size, 'B')}")
    return paragraph(
        "Down and to the left is better; filled: 8 bits, hollow: other settings. Error for bytes a step: "
        f"{', '.join(said)}."
    )


def factors(evidence: Evidence) -> str:
    """Say how the table of factors is to be read, and what the default comes to."""
    error = float(evidence.factors.figure("default", ERROR_M).mean())
    return paragraph(
        f"The default of T2 comes to {length(error)}. Every other row changes one thing; its ratio is the "
        f"geometric mean over the same seeds, with its 95 % interval. Form: {DEFAULT} unless the level says "
        "otherwise."
    )
