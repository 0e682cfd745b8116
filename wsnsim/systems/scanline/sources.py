"""What the cluster head makes of all it has heard of the occluders: knowledge for one step of the filter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, Self

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.systems.scanline.choices import (
    HullPriors,
    KalmanPriors,
    NoPriors,
    ParticleTracker,
    PerfectPriors,
    ScanLinePriors,
    StationaryPriors,
)
from wsnsim.systems.scanline.hull import (
    TooManyPiecesError,
    visual_hull,
    without_own,
    without_phantoms,
    without_small,
)
from wsnsim.systems.scanline.measurement import Report
from wsnsim.systems.scanline.occluder_filter import OccluderBeliefs, stepped
from wsnsim.systems.scanline.occlusion import (
    Joint,
    Knowledge,
    KnownPlaces,
    NoKnowledge,
    NormalPriors,
    ScanLines,
    UniformPriors,
)
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.priors import CONSISTENT_Q, stationary
from wsnsim.systems.scanline.stage import Stage, anywhere_sds_m
from wsnsim.types import FloatArray, IntArray

_KALMAN_FLOATS = 60.0
"""Of one occluder's filter and step: prediction 14, gain and update 46."""
_CONE_FLOATS = 400.0
"""Of cutting the floor's pieces by one blob: corners of some ten pieces against two lines."""
_SMALL_SHARE = 0.8
"""Of a cylinder's diameter, which a piece must hold: blobs are a little off."""
_OWN_MARGIN_PX = 10.0
"""By which the object's place may be beside the outline of its own piece [px]."""


@dataclass(frozen=True, eq=False)
class Heard:
    """Everything that came of one frame.

    Parameters
    ----------
    values_px : z by the camera's number, NaN where it is blind [px]
    blobs : (b, 2) by the camera's number, of those that sent a whole line [px]
    places : (2,) by the occluder's number [m]
    """

    values_px: Mapping[int, float] = field(default_factory=dict)
    blobs: Mapping[int, FloatArray] = field(default_factory=dict)
    places: Mapping[int, FloatArray] = field(default_factory=dict)

    def with_line(self, number: int, value_px: float, blobs: FloatArray | None) -> Self:
        """Return this and what a camera said of its scan line; None: nothing of blobs."""
        lines = self.blobs if blobs is None else {**self.blobs, number: blobs}
        return replace(self, values_px={**self.values_px, number: value_px}, blobs=lines)

    def with_places(self, ids: IntArray, places: FloatArray) -> Self:
        """Return this and the places (k, 2) of some occluders (k,)."""
        named = {int(each): place for each, place in zip(ids, places, strict=True)}
        return replace(self, places={**self.places, **named})

    def report(self, cameras: int) -> Report:
        """Return what so many cameras said of the object."""
        values, heard = np.full(cameras, np.nan), np.zeros(cameras, np.bool_)
        for number, value in self.values_px.items():
            values[number], heard[number] = value, True
        return Report(values, heard)


class Source(Protocol):
    """Turns what was heard into knowledge, frame by frame, every frame once and in order."""

    def knowledge(self, heard: Heard, report: Report) -> tuple[Knowledge, Work]:
        """Return what is known of the occluders at a frame, and what it took to know it.

        A source that gives up on a frame returns `NoKnowledge`.
        """


@dataclass(frozen=True)
class Rules:
    """How p(η) is evaluated, as `NormalPriors` and `UniformPriors` take it.

    Parameters
    ----------
    joint : how Eq. 6 is evaluated
    detected : probability that a camera that could see the object recognises it
    exponent : of p(η)
    """

    joint: Joint = "subsets"
    detected: float = 1.0
    exponent: float = 1.0

    def normal(self, means: FloatArray, covs: FloatArray, radius_m: float) -> NormalPriors:
        """Return occluders of that radius [m] with means (k, 2) [m] and covariances (k, 2, 2) [m²]."""
        return NormalPriors(means, covs, radius_m, self.joint, self.detected, self.exponent)

    def uniform(self, polygons: Sequence[FloatArray], radius_m: float) -> UniformPriors:
        """Return occluders of that radius [m], each somewhere in its convex polygon (k, 2) [m]."""
        return UniformPriors(polygons, radius_m, self.joint, self.detected, self.exponent)


class Nothing:
    """Nothing is known."""

    def knowledge(self, heard: Heard, report: Report) -> tuple[Knowledge, Work]:
        """Return that."""
        return NoKnowledge(), Work()


class Exact:
    """Places without an error; who was not reported is taken to be where he was last."""

    def __init__(self, stage: Stage, detected: float) -> None:
        self._stage = stage
        self._detected = detected
        self._places: dict[int, FloatArray] = {}

    def knowledge(self, heard: Heard, report: Report) -> tuple[Knowledge, Work]:
        """Return the places."""
        self._places |= heard.places
        places = np.array(list(self._places.values())).reshape(-1, 2)
        return KnownPlaces(places, self._stage.radius_m, self._detected), Work()


class Filtered:
    """A Kalman filter an occluder; who was never reported is anywhere in the room."""

    def __init__(self, stage: Stage, priors: KalmanPriors, rate_hz: float, rules: Rules) -> None:
        self._stage = stage
        self._sd_m = priors.sensor_sd_m
        speed_m = stage.walk.speed
        given = priors.acceleration_sd_mps2
        self._q = CONSISTENT_Q * speed_m**2 if given is None else (given / rate_hz**2) ** 2
        self._rules = rules
        self._beliefs = OccluderBeliefs.unknown(stage.occluders)

    def knowledge(self, heard: Heard, report: Report) -> tuple[Knowledge, Work]:
        """Return the filters' beliefs after this frame."""
        stage = self._stage
        measured = np.full((stage.occluders, 2), np.nan)
        for number, place in heard.places.items():
            if number < stage.occluders:
                measured[number] = place
        self._beliefs = stepped(self._beliefs, measured, self._sd_m, self._q, stage.walk.speed)
        room = stage.rig.room
        widest = anywhere_sds_m(room) ** 2
        # who was not reported for long is somewhere in the room, and not where he would have gone straight on
        told = (self._beliefs.known & (self._beliefs.variances < widest.max()))[:, np.newaxis]
        means = np.where(told, self._beliefs.places, room.centre)
        variances = np.where(told, self._beliefs.variances[:, np.newaxis], widest)
        covs = variances[:, np.newaxis] * np.eye(2)
        knowledge = self._rules.normal(means, covs, stage.radius_m)
        return knowledge, Work(float_ops=_KALMAN_FLOATS * stage.occluders)


class Somewhere:
    """Nothing but the room."""

    def __init__(self, stage: Stage, priors: StationaryPriors, rules: Rules) -> None:
        room = stage.rig.room
        sds_m = anywhere_sds_m(room) if priors.sd_m is None else np.full(2, priors.sd_m)
        self._priors = rules.normal(*stationary(stage.occluders, room.centre, sds_m), stage.radius_m)

    def knowledge(self, heard: Heard, report: Report) -> tuple[Knowledge, Work]:
        """Return the same for every frame."""
        return self._priors, Work()


class Hulls:
    """The visual hull of the scan lines that came."""

    def __init__(self, stage: Stage, priors: HullPriors, rules: Rules) -> None:
        self._stage = stage
        self._priors = priors
        self._rules = rules

    def knowledge(self, heard: Heard, report: Report) -> tuple[Knowledge, Work]:
        """Return the pieces of the floor as priors."""
        stage, priors = self._stage, self._priors
        rig = stage.rig
        blobs = [heard.blobs.get(k, np.empty((0, 2))) for k in range(len(rig.cameras))]
        said = np.array([k in heard.blobs for k in range(len(rig.cameras))], dtype=np.bool_)
        work = Work(float_ops=_CONE_FLOATS * (1 + sum(len(each) for each in blobs)))
        try:
            hull = visual_hull(rig, blobs, said, priors.margin_px)
        except TooManyPiecesError:
            return NoKnowledge(), work
        hull = without_small(hull, 2.0 * _SMALL_SHARE * stage.radius_m)
        if priors.own_blob == "remove":
            hull = without_own(hull, rig, report, _OWN_MARGIN_PX)
        if priors.phantoms == "remove":
            hull = without_phantoms(hull, rig, blobs)
        if priors.shape == "polygons":
            return self._rules.uniform(hull.polygons, stage.radius_m), work
        return self._rules.normal(*hull.priors(), stage.radius_m), work


class Lines:
    """Whole scan lines; of a camera that said less, anything may be before the object."""

    def __init__(self, stage: Stage, priors: ScanLinePriors) -> None:
        self._stage = stage
        self._priors = priors

    def knowledge(self, heard: Heard, report: Report) -> tuple[Knowledge, Work]:
        """Return the blobs."""
        cameras = self._stage.rig.cameras
        blobs = [
            heard.blobs.get(k, np.array([[-camera.half_width_px, camera.half_width_px]]))
            for k, camera in enumerate(cameras)
        ]
        radius_m = self._stage.radius_m if self._priors.width_test else 0.0
        return ScanLines(blobs, radius_m, self._priors.missed), Work()


def source_for(params: ScanlineParams, stage: Stage, rate_hz: float) -> Source:
    """Return where the knowledge that a scenario asks for comes from."""
    priors, tracker, detected = params.priors, params.tracker, params.detected
    rules = Rules(detected=detected)
    if isinstance(tracker, ParticleTracker):
        rules = Rules(tracker.joint, detected, tracker.visibility_exponent)
    if isinstance(priors, PerfectPriors):
        return Exact(stage, detected)
    if isinstance(priors, KalmanPriors):
        return Filtered(stage, priors, rate_hz, rules)
    if isinstance(priors, StationaryPriors):
        return Somewhere(stage, priors, rules)
    if isinstance(priors, HullPriors):
        return Hulls(stage, priors, rules)
    if isinstance(priors, ScanLinePriors):
        return Lines(stage, priors)
    assert isinstance(priors, NoPriors)
    return Nothing()
