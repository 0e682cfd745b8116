"""The tables of the page."""

from collections.abc import Callable, Sequence

from wsnsim.claims.markdown import NONE as NOTHING
from wsnsim.claims.markdown import mean_text, ratio_text, table
from wsnsim.claims.scanline.cost_charts import PARTS
from wsnsim.claims.scanline.evidence import BYTES, CYCLES, HEARD, JOULES, LATE, ON_AIR, Evidence, Place, axis
from wsnsim.claims.scanline.measures import COMPONENTS, energy_a_frame, head_cycles, ratio
from wsnsim.claims.scanline.settings import known, tracked
from wsnsim.claims.scanline.studies import (
    ALONE,
    BEYOND,
    CAMERAS,
    CROWDS,
    FORMS,
    HULL_CROWDS,
    HULLS,
    KALMAN,
    KALMAN_TRACKERS,
    LAB_CAMERAS,
    NONE,
    PARTICLE_TRACKERS,
    PERFECT,
    PRIORS,
    RADIO_CELLS,
    SDS,
    TRADED,
)
from wsnsim.metrics.statistics import Interval, mean_interval
from wsnsim.report.wording import count, number, percent

_PER_AXIS = "per axis"
_TRACKERS = {
    "auxiliary": "particles, auxiliary",
    "extended": "extended Kalman",
    "unscented": "unscented Kalman",
    "map": "maximum a posteriori, Kalman",
    "plain": "particles, one stage",
    "printed": "particles, as printed",
}


def error_of(place: Place | None) -> Interval | None:
    """Return the mean RMSE of a setting [unit]."""
    return None if place is None else mean_interval(place.rmse().to_numpy())


def both(place: Place | None) -> tuple[str, str]:
    """Return a setting's RMSE over both axes with its interval, and that on one axis."""
    found = error_of(place)
    return (NOTHING, NOTHING) if found is None else (mean_text(found, 2), f"{axis(found.value):.2f}")


def cameras(evidence: Evidence) -> str:
    """Return Fig. 9 as numbers."""
    return _grid("cameras", CAMERAS, PRIORS, evidence.behind_block)


def trade(evidence: Evidence) -> str:
    """Return Fig. 11 as numbers."""
    return _grid("cameras", TRADED, PRIORS, evidence.open_room)


def crowd(evidence: Evidence) -> str:
    """Return Fig. 12 as numbers."""
    return _grid("occluders", CROWDS, (NONE, PERFECT), evidence.crowd)


def lab(evidence: Evidence) -> str:
    """Return Fig. 15 as numbers [inches]."""
    return _grid("cameras", LAB_CAMERAS, PRIORS, evidence.in_lab)


def _grid(
    what: str, rows: Sequence[int], priors: Sequence[str], place: Callable[[int, str], Place | None]
) -> str:
    heads = [what, *(head for prior in priors for head in (prior, _PER_AXIS))]
    return table(
        heads, [[str(at), *(text for prior in priors for text in both(place(at, prior)))] for at in rows]
    )


def priors(evidence: Evidence) -> str:
    """Return Fig. 10 as numbers, in both forms, with the kinds of knowledge beyond the paper."""
    heads = ["priors", "RMSE of the priors", _PER_AXIS]
    for form in FORMS:
        heads += [f"{form}: RMSE", _PER_AXIS, "over perfect"]
    room = evidence.rooms.open
    at = {PERFECT: 0.0, NONE: room.occluders, **room.filters}
    rows = []
    for name in (PERFECT, *(f"{KALMAN}-{sd}" for sd in SDS), NONE, *BEYOND):
        row = [name]
        row += [f"{at[name]:.2f}", f"{axis(at[name]):.2f}"] if name in at else [NOTHING, NOTHING]
        for form in FORMS:
            seen = evidence.seen_as(form)
            over = ratio(known(name), known(PERFECT))(seen)
            row += [*both(seen.known(name)), NOTHING if over is None else ratio_text(over)]
        rows.append(row)
    return table(heads, rows)


def trackers(evidence: Evidence) -> str:
    """Return the errors of the other trackers, with and without perfect priors."""
    heads = (
        "tracker",
        "none",
        _PER_AXIS,
        "over the auxiliary filter",
        "worse than nothing",
        "perfect",
        _PER_AXIS,
    )
    rows = []
    for name in (*PARTICLE_TRACKERS, *KALMAN_TRACKERS):
        cell = f"{name}-{NONE}" if name in PARTICLE_TRACKERS else name
        over = ratio(tracked(cell), tracked(f"auxiliary-{NONE}"))(evidence)
        rows.append(
            (
                _TRACKERS[name],
                *both(evidence.tracked(cell)),
                NOTHING if over is None else ratio_text(over),
                _lost(evidence.tracked(cell), evidence.rooms.open.target),
                *both(evidence.tracked(f"{name}-{PERFECT}")),
            )
        )
    return table(heads, rows)


def hulls(evidence: Evidence) -> str:
    """Return the errors with the visual hull."""
    heads = ("priors", *(head for m in HULL_CROWDS for head in (f"{m} occluders", _PER_AXIS, "bytes a step")))
    rows = []
    for kind in HULLS:
        row = [kind]
        for m in HULL_CROWDS:
            place = evidence.hulled(m, kind)
            row += [*both(place), NOTHING if place is None else _whole(place, BYTES)]
        rows.append(row)
    return table(heads, rows)


def radio(evidence: Evidence) -> str:
    """Return accuracy and costs of each setting over IEEE 802.15.4."""
    heads = (
        "setting",
        "RMSE",
        _PER_AXIS,
        "bytes a step",
        "bytes on the air",
        "heard in time",
        "latency, 95th percentile [s]",
        "joules of all motes",
        "cycles of all motes, millions",
    )
    rows = []
    for cell in RADIO_CELLS:
        place = evidence.on_air(cell)
        assert place is not None
        rows.append(
            (
                cell,
                *both(place),
                _whole(place, BYTES),
                _whole(place, ON_AIR),
                percent(float(place.figure(HEARD).mean())),
                number(float(place.figure(LATE).mean())),
                number(float(place.figure(JOULES).mean())),
                number(float(place.figure(CYCLES).mean()) / 1e6),
            )
        )
    return table(heads, rows)


def energy(evidence: Evidence) -> str:
    """Return the millijoules of a camera's node a frame, by component."""
    heads = (
        "setting",
        *(PARTS[each] for each in COMPONENTS),
        "together",
        "the head's cycles a frame",
    )
    rows = []
    for cell in (*RADIO_CELLS, ALONE):
        parts = {name: 1e3 * float(values.mean()) for name, values in energy_a_frame(evidence, cell).items()}
        rows.append(
            (
                cell,
                *(number(parts[each]) for each in COMPONENTS),
                number(sum(parts.values())),
                count(round(head_cycles(evidence, cell))),
            )
        )
    return table(heads, rows)


def times(evidence: Evidence) -> str:
    """Return Fig. 13 as numbers."""
    speed = evidence.speed
    if speed is None:
        return ""
    numbers = sorted({n for _, n in speed.step_s})
    heads = ("priors", *(f"N = {n} [ms]" for n in numbers), f"N = {numbers[-1]} over {numbers[0]}")
    rows = []
    for prior in PRIORS:
        grown = speed.growth(prior, numbers[0], numbers[-1])
        cells = [number(1e3 * speed.step_s[prior, n]) for n in numbers]
        rows.append((prior, *cells, NOTHING if grown is None else number(grown)))
    return table(heads, rows)


def _whole(place: Place, key: str) -> str:
    return count(round(float(place.figure(key).mean())))


def _lost(place: Place | None, worst: float) -> str:
    """Return how many runs have an error above one."""
    if place is None:
        return NOTHING
    errors = place.rmse()
    return f"{int((errors > worst).sum())} of {len(errors)}"
