"""The trackers behind one face: a step a frame, from what was heard to a place and how sure it is."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.hardware.work import Work
from wsnsim.systems.scanline.baselines import GRID, NEWTON_STEPS, Baseline
from wsnsim.systems.scanline.choices import KalmanTracker
from wsnsim.systems.scanline.filter import FilterParams, Tracker
from wsnsim.systems.scanline.measurement import Report
from wsnsim.systems.scanline.occlusion import Knowledge, KnownPlaces, NormalPriors, ScanLines, UniformPriors
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import FloatArray

# Floating-point operations, counted from the inner loops; a root counts 10, a logarithm or an exponential 15,
# a normal draw 10. Upper bounds: particles that fit hopelessly are left out of p(η). A mote is taken to have
# tables of the error function and of the mean direction over the room.
_FORESEE_FLOATS = 40.0  # κ; a particle
_MOVE_FLOATS = 65.0  # two directions with their roots, two normal draws, the new speed; a particle
_WEIGHT_FLOATS = 40.0  # log p(η), the weight, its share in resampling; a particle and stage
_REGION_INTS = 25.0  # a cell of the table; a particle and stage
_NORMAL_FLOATS = 40.0  # h, d, Eq. 2, one term of Eq. 3; a seeing camera
_COVER_FLOATS = 24.0  # Eq. 4: 12 to see that an occluder is far from the line, 23 more for every other one
_POLYGON_FLOATS = 150.0  # the same for a polygon: 70, and four cuts of some
_MOST_SUBSETS = 1 << 10  # of blind cameras that are reckoned with together
_DISC_FLOATS = 14.0  # a line of sight beside a disc; an occluder and a camera
_BLOB_FLOATS = 26.0  # three normal distribution functions; a blob of a blind camera
_WIDTH_FLOATS = 60.0  # what a cylinder would look like; a blind camera
_KALMAN_FLOATS = 600.0  # 4 × 4 in Joseph's form, or 8 sigma points; a camera
_FISHER_FLOATS = 60.0  # a step of Gauss–Newton; a camera
_PRIOR_FLOATS = 10.0  # of a place of the grid


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
        return Followed(state.mean, state.cov, velocity, state.replaced, self._work(report, knowledge))

    def _work(self, report: Report, knowledge: Knowledge) -> Work:
        """Return the operations of both stages; a plain filter has one."""
        count = self._tracker.params.particles
        plain = self._tracker.params.kind == "plain"
        stages = 1.0 if plain else 2.0
        floats = _MOVE_FLOATS + (0.0 if plain else _FORESEE_FLOATS)
        floats += stages * (_WEIGHT_FLOATS + _NORMAL_FLOATS * report.seeing.bit_count())
        floats += stages * _knowledge_floats(knowledge, report, self._occluders)
        return Work(int_ops=count * stages * _REGION_INTS, float_ops=count * floats)


def _knowledge_floats(knowledge: Knowledge, report: Report, occluders: int) -> float:
    """Return the operations of p(η | x) of one particle."""
    heard, blind = int(report.heard.sum()), report.blind.bit_count()
    if isinstance(knowledge, KnownPlaces):
        return _DISC_FLOATS * occluders * heard
    # each occluder has its sum of every subset, with which the product is multiplied
    subsets = 2.0 * min(1 << blind, _MOST_SUBSETS)
    if isinstance(knowledge, NormalPriors):
        return len(knowledge.means) * (_COVER_FLOATS * heard + subsets)
    if isinstance(knowledge, UniformPriors):
        return len(knowledge.polygons) * (_POLYGON_FLOATS * heard + subsets)
    if isinstance(knowledge, ScanLines):
        blobs = sum(len(ends) for k, ends in enumerate(knowledge.blobs) if report.blind >> k & 1)
        return _BLOB_FLOATS * blobs + _WIDTH_FLOATS * blind
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
        self._kind = params.kind
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
        return Followed(mean[:2], cov[:2, :2], mean[2:], work=self._work(report.seeing.bit_count()))

    def _work(self, seeing: int) -> Work:
        """Return the operations of a step; a most probable place is looked for on a grid first."""
        floats = _KALMAN_FLOATS * (1 + seeing)
        if self._kind != "map" or not seeing:
            return Work(float_ops=floats)
        places = GRID**2
        floats += places * (_PRIOR_FLOATS + _NORMAL_FLOATS * seeing) + NEWTON_STEPS * _FISHER_FLOATS * seeing
        return Work(int_ops=places * _REGION_INTS, float_ops=floats)


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
