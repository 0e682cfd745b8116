"""The tables of the page: accuracy, Table 1 in numbers, bytes, the radio, the factors."""

import numpy as np

from wsnsim.claims.markdown import NONE, mean_text, ratio_text, table
from wsnsim.claims.multiview.evidence import (
    AT_BASE,
    CYCLES,
    DEPLOYMENTS,
    ERROR_M,
    ERROR_PX,
    FIXED_SPREAD,
    FORMS,
    JOULES,
    LATE,
    LOST,
    OFFERED,
    PUBLISHED,
    SENT,
    SETUPS,
    TRACKERS,
    WITH_RELAYS,
    Evidence,
)
from wsnsim.claims.multiview.measures import dependence_on_pixels, in_time_share, measured_share
from wsnsim.claims.results import Results
from wsnsim.metrics.cells import compare
from wsnsim.metrics.statistics import Interval, mean_interval
from wsnsim.report.wording import count, number, percent, quantity

DEADLINE_S = 0.25
"""The frame period at 4 Hz: an estimate that is later meets the next image."""

_GRADES = {  # accuracy, computation, message size, robustness against few pixels (Table 1)
    "P": ("poor", "low", "low", "no"),
    "T0": ("good", "high", "very high", "yes"),
    "T1": ("medium", "high", "medium", "yes"),
    "T2": ("medium", "high", "low", "yes"),
    "T3": ("good", "medium", "low", "no"),
    "T4": ("good", "medium", "medium", "no"),
}


def mean_of(results: Results, cell: str, key: str) -> Interval:
    """Return the mean of a figure over a cell's runs."""
    return mean_interval(results.figure(cell, key).to_numpy())


def whole(value: float) -> str:
    """Return a number without decimals, nothing where there is none."""
    return NONE if np.isnan(value) else count(round(value))


def lost_text(results: Results, cell: str) -> str:
    """Return ``2 of 15``: runs that lost the target."""
    lost = results.figure(cell, LOST)
    return f"{count(int((lost > 0).sum()))} of {count(len(lost))}"


def accuracy(evidence: Evidence) -> str:
    """Return errors and lost runs of all trackers in A and B, printed and mended."""
    heads = ["tracker", "form"]
    for setup in SETUPS:
        heads += [f"{setup}: error [m]", f"{setup}: error [px]", f"{setup}: lost"]
    rows = []
    for cell in (*TRACKERS, *FIXED_SPREAD):
        for form in FORMS:
            names = [f"{setup}/{cell}" + ("-published" if form == PUBLISHED else "") for setup in SETUPS]
            if all(name in evidence.variants for name in names):
                rows.append([cell, form, *(each for name in names for each in _accuracy(evidence, name))])
    return table(heads, rows, numbers_from=2)


def _accuracy(evidence: Evidence, name: str) -> tuple[str, str, str]:
    results = evidence.variants
    return (
        mean_text(mean_of(results, name, ERROR_M)),
        mean_text(mean_of(results, name, ERROR_PX), 1),
        lost_text(results, name),
    )


def deployments(evidence: Evidence) -> str:
    """Return errors and lost runs of all trackers in the two rooms."""
    results = evidence.deployed
    heads = [
        "tracker",
        *(f"{place}: {what}" for place in DEPLOYMENTS for what in ("error [m]", "error [px]", "lost")),
    ]
    rows = []
    for tracker in TRACKERS:
        row = [tracker]
        for place in DEPLOYMENTS:
            cell = f"{place}/{tracker}"
            row += [
                mean_text(mean_of(results, cell, ERROR_M)),
                mean_text(mean_of(results, cell, ERROR_PX), 1),
                lost_text(results, cell),
            ]
        rows.append(row)
    return table(heads, rows)


def table_1(evidence: Evidence) -> str:
    """Return the paper's qualitative table with numbers for its grades, which stand in brackets."""
    results = evidence.variants
    heads = (
        "tracker",
        "error in A, B [m]",
        "processor cycles a step, B",
        "bytes a step, B: sent / with relays / at the base",
        "rank correlation of error and pixel share, B",
    )
    rows = []
    for tracker in TRACKERS:
        accuracy, work, size, robust = _GRADES[tracker]
        errors = ", ".join(
            number(mean_of(results, f"{setup}/{tracker}", ERROR_M).value, 2) for setup in SETUPS
        )
        cycles = mean_of(results, f"B/{tracker}", CYCLES).value / 1e6
        sizes = " / ".join(
            whole(mean_of(results, f"B/{tracker}", key).value) for key in (SENT, WITH_RELAYS, AT_BASE)
        )
        dependence = dependence_on_pixels("B", tracker)(evidence)
        rows.append(
            (
                tracker,
                f"{errors} ({accuracy})",
                f"{number(cycles)} million ({work})",
                f"{sizes} ({size})",
                f"{ratio_text(dependence) if dependence else NONE} (robust: {robust})",
            )
        )
    return table(heads, rows)


def sizes(evidence: Evidence) -> str:
    """Return the bytes of a step over the ideal network, numbers of eight bytes."""
    results = evidence.variants
    heads = [
        "tracker",
        *(f"{setup}: {what}" for setup in SETUPS for what in ("sent", "with relays", "at the base")),
        "B: with relays, over T2",
        "B: offered load",
    ]
    rows = []
    least = results.number_of("B/T2")
    for tracker in TRACKERS:
        row = [tracker]
        for setup in SETUPS:
            for key in (SENT, WITH_RELAYS, AT_BASE):
                row.append(whole(mean_of(results, f"{setup}/{tracker}", key).value))
        over = compare(results.runs, results.number_of(f"B/{tracker}"), least, WITH_RELAYS).ratio
        load = mean_of(results, f"B/{tracker}", OFFERED).value
        rows.append([*row, f"× {number(over.value)}", quantity(load, "bit/s")])
    return table(heads, rows)


def radio(evidence: Evidence) -> str:
    """Return accuracy, costs and punctuality of each cell over IEEE 802.15.4."""
    results = evidence.radio
    heads = (
        "cell",
        "error [m]",
        "lost",
        "bytes on the air a step",
        "joules a step",
        "steps measured, or the target found anew",
        f"in {1000 * DEADLINE_S:.0f} ms",
        "cameras heard",
        "latency, 95th percentile [s]",
    )
    rows = []
    for name in (str(name) for name in results.cells["name"]):
        measured, timely = measured_share(name)(evidence), in_time_share(name, DEADLINE_S)(evidence)
        rows.append(
            (
                name,
                mean_text(mean_of(results, name, ERROR_M)),
                lost_text(results, name),
                whole(mean_of(results, name, WITH_RELAYS).value),
                number(mean_of(results, name, JOULES).value),
                percent(measured.value) if measured else NONE,
                percent(timely.value) if timely else NONE,
                percent(heard_share(results, name)),
                number(mean_of(results, name, LATE).value),
            )
        )
    return table(heads, rows)


def heard_share(results: Results, cell: str) -> float:
    """Return of the cameras that were asked the share whose answers were in time, over all runs."""
    return float(mean_of(results, cell, "heard_ratio").value)


def factors(evidence: Evidence) -> str:
    """Return T2 in B, one factor at a time, beside the default on the same seeds."""
    results = evidence.factors
    base = results.number_of("default")
    heads = (
        "factor",
        "level",
        "error [m]",
        "over the default",
        "lost",
        "bytes with relays",
        "over the default",
    )
    rows = []
    for cell in results.cells.to_dict("records"):
        name, own = str(cell["name"]), int(cell["cell"])
        error, size = (compare(results.runs, own, base, key).ratio for key in (ERROR_M, WITH_RELAYS))
        rows.append(
            (
                str(cell["factor"]) or "–",
                str(cell["level"]),
                mean_text(mean_of(results, name, ERROR_M)),
                ratio_text(error) if own != base else "1",
                lost_text(results, name),
                whole(mean_of(results, name, WITH_RELAYS).value),
                number(size.value) if own != base else "1",
            )
        )
    return table(heads, rows, numbers_from=2)
