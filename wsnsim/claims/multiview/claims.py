"""What Kushwaha & Koutsoukos (2013) say of their trackers, in our words, and the numbers that decide it."""

from collections.abc import Callable

from wsnsim.claims.markdown import signed
from wsnsim.claims.multiview.evidence import (
    AT_BASE,
    CYCLES,
    ERROR_M,
    ERROR_PX,
    OFFERED,
    TRACKERS,
    WITH_RELAYS,
    Evidence,
)
from wsnsim.claims.multiview.measures import (
    AFTER,
    Measure,
    dependence_on_pixels,
    error_after_return,
    given_up_steps,
    lost_runs,
    mean,
    measured_share,
    pixel_share_end,
    ratio,
    share_of_small_steps,
    single_camera_error,
    turning_over_fixed,
)
from wsnsim.claims.rules import Band, Claim, Part
from wsnsim.report.wording import count, number, percent, quantity

MUCH = 1.5
"""A ratio of errors that a reader of the paper's charts would call poor, or far better."""
SAME = Band(0.85, 1.15)
"""A ratio of errors that makes no difference."""
MANY_TIMES = 5.0
"""A ratio of bytes that makes a class of its own."""
DEPENDS = 0.3
"""A rank correlation with the pixel share that is more than weak (Cohen 1988)."""
_PAPER_BPS, _CHANNEL_BPS = 128e3, 250e3
_ONE_PERCENT = 0.01

_MORE, _LESS = Band(low=1.0, open=True), Band(high=1.0, open=True)
_POOR, _FINE = Band(low=MUCH), Band(high=MUCH)
_NONE = Band(0.0, 0.0)

MultiviewClaim = Claim[Evidence]
MultiviewPart = Part[Evidence]


def _times(value: float) -> str:
    return f"× {number(value)}"


def _bps(value: float) -> str:
    return quantity(value, "bit/s")


def _part(what: str, band: Band, value: Measure, show: Callable[[float], str] = _times) -> MultiviewPart:
    return Part(what, band, value, show)


def _error(world: str, tracker: str, other: str, band: Band) -> MultiviewPart:
    return _part(f"{world}: error of {tracker} over that of {other}", band, ratio(world, tracker, other))


def _bytes(tracker: str, other: str, band: Band, at_base: bool = False) -> MultiviewPart:
    where, key = ("that arrive at the base", AT_BASE) if at_base else ("with relays", WITH_RELAYS)
    return _part(f"B: bytes {where} of {tracker} over {other}", band, ratio("B", tracker, other, key))


def _fine(world: str, tracker: str) -> tuple[MultiviewPart, MultiviewPart]:
    return (
        _error(world, tracker, "T2", _FINE),
        _part(f"{world}: runs that {tracker} lost", _NONE, lost_runs(world, tracker), count),
    )


CLAIMS: tuple[MultiviewClaim, ...] = (
    Claim(
        "kernel-density-best",
        "In B the trackers of 3-D kernel densities, T1 and T2, are more accurate than the base tracker T0.",
        "Sec. 6.1, Figs. 11, 13",
        (_error("B", "T0", "T1", _MORE), _error("B", "T0", "T2", _MORE)),
    ),
    Claim(
        "aggregation-free",
        "Aggregation in the network costs no accuracy: T2 is as good as T1, and T3 as good as T4.",
        "Sec. 6.1, Fig. 13",
        (_error("B", "T2", "T1", SAME), _error("B", "T3", "T4", SAME)),
    ),
    Claim(
        "p-poor",
        "P, the rays of independent 2-D trackers, is poor in B.",
        "Sec. 6.1, Figs. 9–13",
        (_error("B", "P", "T2", _POOR),),
    ),
    Claim(
        "image-plane-poor",
        "T3 and T4, whose particles live in the images, are poor in B as well.",
        "Sec. 6.1, Figs. 9–13",
        (_error("B", "T3", "T2", _POOR), _error("B", "T4", "T2", _POOR)),
    ),
    Claim(
        "image-plane-fine-near",
        "Near the cameras (A, LCR) the trackers in the images do well.",
        "Sec. 6.1, 6.2.1, Fig. 16",
        tuple(
            part for world in ("A", "LCR") for tracker in ("T3", "T4", "P") for part in _fine(world, tracker)
        ),
    ),
    Claim(
        "topology-decides",
        "Where cameras are decides which tracker is best: T3 near the target (A), T2 far from it (B).",
        "Sec. 6.1",
        (_error("A", "T3", "T2", _LESS), _error("B", "T3", "T2", _MORE)),
    ),
    Claim(
        "single-camera",
        "While a single camera sees the target T0 and T2 diverge; when another one joins T2 comes back, T0 "
        "does not.",
        "Sec. 6.1, Fig. 10(a)",
        (
            *(
                _part(
                    f"B: error of {tracker} in the single-camera interval over that before",
                    _POOR,
                    single_camera_error(tracker),
                )
                for tracker in ("T0", "T2")
            ),
            _part(
                f"B: error of T2 from {AFTER} steps after the interval on over that before",
                _FINE,
                error_after_return("T2"),
            ),
            _part(
                f"B: error of T0 from {AFTER} steps after the interval on over that before",
                _POOR,
                error_after_return("T0"),
            ),
        ),
    ),
    Claim(
        "few-pixels",
        "Few pixels on the target harm trackers in the images (P, T3, T4), not those in space (T0–T2).",
        "Table 1, Fig. 10(b)",
        (
            *(
                _part(
                    f"B: rank correlation of {tracker}'s error with the pixel share",
                    Band(high=-DEPENDS),
                    dependence_on_pixels("B", tracker),
                    signed,
                )
                for tracker in ("P", "T3", "T4")
            ),
            *(
                _part(
                    f"B: rank correlation of {tracker}'s error with the pixel share",
                    Band(-DEPENDS, DEPENDS),
                    dependence_on_pixels("B", tracker),
                    signed,
                )
                for tracker in ("T0", "T1", "T2")
            ),
        ),
    ),
    Claim(
        "rotation",
        "A target that turns costs a little accuracy in space and none in the images.",
        "Sec. 6.1, Fig. 12",
        (
            _part(
                "B: error in space, turning over fixed, all trackers",
                Band(1.0, MUCH),
                turning_over_fixed(ERROR_M),
            ),
            _part("B: error in the images, turning over fixed", SAME, turning_over_fixed(ERROR_PX)),
        ),
    ),
    Claim(
        "bytes-order",
        "T0 sends by far the most, T1 much less, T2 the least of the three.",
        "Table 1, Sec. 5.1–5.2",
        (
            _bytes("T0", "T1", Band(low=MANY_TIMES)),
            _bytes("T1", "T2", _MORE),
            _bytes("T1", "T2", _MORE, at_base=True),
        ),
    ),
    Claim(
        "bytes-images",
        "T3 sends as little as T2, T4 more than T2, and P is among the cheapest.",
        "Table 1",
        (_bytes("T3", "T2", SAME), _bytes("T4", "T2", _MORE), _bytes("P", "T2", _LESS)),
    ),
    Claim(
        "work-images",
        "Particles in the images take less computation than particles in space.",
        "Table 1, Sec. 5.3",
        tuple(
            _part(f"B: processor cycles of {tracker} over T2", _LESS, ratio("B", tracker, "T2", CYCLES))
            for tracker in ("T3", "T4", "P")
        ),
    ),
    Claim(
        "table-accuracy",
        "In general T0, T3 and T4 are more accurate than T1 and T2 (read in A, where all are at home).",
        "Table 1",
        tuple(_error("A", tracker, "T2", _LESS) for tracker in ("T0", "T3", "T4")),
    ),
    Claim(
        "best-bargain",
        "T2 is the best bargain: no tracker is more accurate, and it sends less than T0 and T1.",
        "Sec. 7",
        (
            *(_error("B", "T2", other, Band(high=SAME.high)) for other in TRACKERS if other != "T2"),
            _bytes("T2", "T0", _LESS),
            _bytes("T2", "T1", _LESS),
        ),
    ),
    Claim(
        "t0-load",
        "T0 with 1000 particles and four cameras at 4 Hz needs about 128 kbit/s.",
        "Sec. 4.2",
        (
            _part(
                "A: offered load of T0",
                Band(0.9 * _PAPER_BPS, 1.1 * _PAPER_BPS),
                mean("A", "T0", OFFERED),
                _bps,
            ),
        ),
    ),
    Claim(
        "t0-radio",
        "Follows from it: T0's full weights do not fit into the 250 kbit/s of IEEE 802.15.4.",
        "ours",
        (
            _part("B: offered load of T0", Band(low=_CHANNEL_BPS), mean("B", "T0", OFFERED), _bps),
            _part(
                "B over 802.15.4, float64: steps of T0 that are measured",
                Band(high=0.5),
                measured_share("T0-float64"),
                percent,
            ),
        ),
    ),
    Claim(
        "near-is-large",
        "In LCR the target always covers more than 1 % of the pixels.",
        "Fig. 17",
        (
            _part(
                "LCR: least pixel share", Band(low=_ONE_PERCENT), pixel_share_end("LCR", lowest=True), percent
            ),
        ),
    ),
    Claim(
        "far-is-small",
        "In FGH the target never, and in B hardly ever, covers more than 1 % of the pixels.",
        "Figs. 21(b), 10(b)",
        (
            _part(
                "FGH: greatest pixel share",
                Band(high=_ONE_PERCENT),
                pixel_share_end("FGH", lowest=False),
                percent,
            ),
            _part(
                "B: steps at which it covers less",
                Band(low=0.9),
                share_of_small_steps("B", _ONE_PERCENT),
                percent,
            ),
        ),
    ),
    Claim(
        "atrium",
        "In FGH T2 follows a person for 160 frames through occlusions without being started again.",
        "Sec. 6.2.2, Figs. 19, 20",
        (
            _part("FGH: runs that T2 lost", _NONE, lost_runs("FGH", "T2"), count),
            _part(
                "FGH: steps at which T2 had given the target up", _NONE, given_up_steps("FGH", "T2"), count
            ),
        ),
    ),
)
"""In the order of the paper, as far as it has one."""
