"""The trackers behind one face: a step a frame, from what was heard to a place and how sure it is."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.hardware.work import Work
from wsnsim.systems.scanline.baselines import Baseline
from wsnsim.systems.scanline.choices import KalmanTracker
from wsnsim.systems.scanline.filter import FilterParams, Tracked, Tracker
from wsnsim.systems.scanline.measurement import Report
from wsnsim.systems.scanline.occlusion import Knowledge, KnownPlaces, NormalPriors, ScanLines, UniformPriors
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import FloatArray

# Operations of a particle and stage, counted from the equations' inner loops.
_MOVE_FLOATS = 45.0  # a direction with its root, two normal and three uniform draws, the new speed
_NORMAL_FLOATS = 30.0  # h, d, Eq. 2, one term of Eq. 3; a seeing camera
_REGION_INTS = 25.0  # a cell of the table
_COVER_FLOATS = 35.0  # Eq. 4 by a table of the error function; an occluder and a camera of the region
_DISC_FLOATS = 14.0  # a line of sight beside a disc; an occluder and a camera
_LINE_FLOATS = 40.0  # two normal distribution functions; a blob's ends and a blind camera
_RESAMPLE_FLOATS = 8.0
_KALMAN_FLOATS = 600.0  # 4 × 4 in Joseph's form; a camera
_BLOBS = 6.0  # in a scan line, as a rule


@dataclass(frozen=True, eq=False)
class Followed:
    """What a tracker believes after a frame.

    Parameters
    ----------
    place : (2,) [m]
    cov : (2, 2) of the place [m²]
    velocity : (2,) [m/step]
    replaced : the track was begun anew at this frame
    work : that the frame took
    """

    place: FloatArray
    cov: FloatArray
    velocity: FloatArray
    replaced: bool = False
    work: Work = field(default_factory=Work)


class Follower(Protocol):
    """A tracker and its state."""

    def begin(self, place: FloatArray, cov: FloatArray) -> None:
        """Begin with the object at a place (2,), known with a covariance (2, 2) [m²]."""

    def step(self, report: Report, knowledge: Knowledge) -> Followed:
        """Take a frame."""


class ParticleFollower:
    """The particle filter of Fig. 4 or one of its relatives."""

    def __init__(self, params: FilterParams, stage: Stage, generator: np.random.Generator) -> None:
        self._tracker = Tracker(stage.rig, stage.walk, params)
        self._generator = generator
        self._occluders = stage.occluders
        self._state = self._tracker.start(generator)

    def begin(self, place: FloatArray, cov: FloatArray) -> None:
        """Draw the particles about a place."""
        self._state = self._tracker.start_about(self._generator, place, cov)

    def step(self, report: Report, knowledge: Knowledge) -> Followed:
        """Take a frame."""
        self._state = self._tracker.step(self._generator, self._state, report, knowledge)
        state = self._state
        walkers, weights = state.particles.states, state.particles.weights
        velocity = np.asarray(weights @ walkers.velocities)
        return Followed(state.mean, state.cov, velocity, state.replaced, self._work(report, knowledge, state))

    def _work(self, report: Report, knowledge: Knowledge, state: Tracked) -> Work:
        """Return the operations of both stages; a plain filter has one."""
        count = self._tracker.params.particles
        stages = 1.0 if self._tracker.params.kind == "plain" else 2.0
        seeing, heard = report.seeing.bit_count(), int(report.heard.sum())
        floats = stages * (_MOVE_FLOATS + _NORMAL_FLOATS * seeing) + _RESAMPLE_FLOATS
        floats += stages * _knowledge_floats(knowledge, heard, heard - seeing, self._occluders)
        return Work(int_ops=count * stages * _REGION_INTS, float_ops=count * floats)


def _knowledge_floats(knowledge: Knowledge, heard: int, blind: int, occluders: int) -> float:
    """Return the operations of p(η | x) of one particle."""
    if isinstance(knowledge, KnownPlaces):
        return _DISC_FLOATS * occluders * heard
    if isinstance(knowledge, NormalPriors | UniformPriors):
        pieces = len(knowledge.means if isinstance(knowledge, NormalPriors) else knowledge.polygons)
        return _COVER_FLOATS * pieces * heard + pieces * 2.0**blind
    if isinstance(knowledge, ScanLines):
        return _LINE_FLOATS * _BLOBS * blind
    return 0.0


class KalmanFollower:
    """A Kalman filter: extended, unscented, or fed by a most probable place."""

    def __init__(self, params: KalmanTracker, stage: Stage, rate_hz: float) -> None:
        given = params.acceleration_sd_mps2
        sd = 0.5 * stage.walk.speed if given is None else given / rate_hz**2
        self._baseline = Baseline(stage.rig, sd)
        self._step = {
            "extended": self._baseline.extended,
            "unscented": self._baseline.unscented,
            "map": self._baseline.map_kalman,
        }[params.kind]
        self._speed = stage.walk.speed
        self._belief = self._baseline.start()

    def begin(self, place: FloatArray, cov: FloatArray) -> None:
        """Begin at a place, at rest."""
        whole = np.zeros((4, 4))
        whole[:2, :2] = cov + 1e-6 * self._speed**2 * np.eye(2)
        whole[2:, 2:] = self._speed**2 * np.eye(2)
        self._belief = Gaussian(np.concatenate([place, np.zeros(2)]), whole)

    def step(self, report: Report, knowledge: Knowledge) -> Followed:
        """Take a frame; what is known of the occluders has no place in these filters."""
        self._belief = self._step(self._belief, report)
        mean, cov = self._belief.mean, self._belief.cov
        work = Work(float_ops=_KALMAN_FLOATS * (1 + report.seeing.bit_count()))
        return Followed(mean[:2], cov[:2, :2], mean[2:], work=work)


def follower_for(
    params: ScanlineParams, stage: Stage, rate_hz: float, generator: np.random.Generator, given: bool = True
) -> Follower:
    """Return the tracker that a scenario asks for.

    Parameters
    ----------
    params : of the system
    stage : the deployment
    rate_hz : of the frames [Hz]
    generator : source of randomness
    given : whether it begins as the scenario says, not with an object that may be anywhere
    """
    tracker = params.tracker
    follower: Follower
    if isinstance(tracker, KalmanTracker):
        follower = KalmanFollower(tracker, stage, rate_hz)
    else:
        settings = FilterParams(
            kind=tracker.kind,
            particles=tracker.particles,
            visibility_floor=tracker.visibility_floor,
            first_stage_floor=tracker.first_stage_floor,
            lost_sd=tracker.lost_sd,
        )
        follower = ParticleFollower(settings, stage, generator)
    if given and params.start == "given":
        follower.begin(stage.start, stage.walk.noise_sd**2 * np.eye(2))
    return follower
