"""The settings that claims compare, each a question to the evidence."""

from wsnsim.claims.scanline.evidence import Evidence, Place
from wsnsim.claims.scanline.measures import Where
from wsnsim.claims.scanline.studies import NONE, PERFECT


def known(prior: str) -> Where:
    """Return the setting of Fig. 10."""
    return lambda evidence: evidence.known(prior)


def open_room(cameras: int, prior: str) -> Where:
    """Return a setting of Fig. 11."""
    return lambda evidence: evidence.open_room(cameras, prior)


def behind_block(cameras: int, prior: str) -> Where:
    """Return a setting of Fig. 9."""
    return lambda evidence: evidence.behind_block(cameras, prior)


def crowd(occluders: int, prior: str) -> Where:
    """Return a setting of Fig. 12."""
    return lambda evidence: evidence.crowd(occluders, prior)


def crowd_gap(occluders: int) -> tuple[Where, Where]:
    """Return what lies between nothing and everything known, in Fig. 12."""
    return crowd(occluders, NONE), crowd(occluders, PERFECT)


def in_lab(cameras: int, prior: str) -> Where:
    """Return a setting of Fig. 15."""
    return lambda evidence: evidence.in_lab(cameras, prior)


def lab_gap(cameras: int) -> tuple[Where, Where]:
    """Return what lies between nothing and everything known, in Fig. 15."""
    return in_lab(cameras, NONE), in_lab(cameras, PERFECT)


def tracked(tracker: str) -> Where:
    """Return the setting of Fig. 10 with another tracker."""
    return lambda evidence: evidence.tracked(tracker)


def hulled(occluders: int, kind: str) -> Where:
    """Return a setting with the visual hull."""
    return lambda evidence: evidence.hulled(occluders, kind)


def on_air(cell: str) -> Where:
    """Return a setting over IEEE 802.15.4."""

    def where(evidence: Evidence) -> Place | None:
        return evidence.on_air(cell)

    return where
