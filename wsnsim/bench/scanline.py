"""What the scan-line tracker computes for one frame, timed: whole steps of the filter, and their parts.

The room, the crowd and the cameras are those of Ercan et al. 2007, Sec. 5; that time grows little with the
number of cameras is their Fig. 13.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from math import atan2, pi

import numpy as np

from wsnsim.bench.scanline_twins import likelihoods
from wsnsim.bench.timing import by_turns
from wsnsim.bench.vision import Measure
from wsnsim.estimation.particle_filter import systematic
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.sightlines import disc_masks
from wsnsim.rng import RandomStreams
from wsnsim.systems.scanline.filter import FilterParams, Tracked, Tracker
from wsnsim.systems.scanline.likelihood import Likelihood
from wsnsim.systems.scanline.measurement import MeasurementNoise, Report, ScanCamera, measure, report
from wsnsim.systems.scanline.motion import WaypointWalk
from wsnsim.systems.scanline.occlusion import (
    Knowledge,
    KnownPlaces,
    NoKnowledge,
    NormalPriors,
    joint_probability,
)
from wsnsim.systems.scanline.priors import PUBLISHED_Q, VirtualSensor
from wsnsim.systems.scanline.regions import Rig, Room
from wsnsim.types import FloatArray
from wsnsim.world.crowd import Crowd

PARTICLES, TURNS, STEPS, FEW = 1000, 7, 60, 20
QUICK_PARTICLES, QUICK_TURNS, QUICK_STEPS, QUICK_FEW = 40, 1, 12, 4

SIDE_M, DIAMETER_M, OCCLUDERS, SENSOR_SD_M = 100.0, 3.33, 40, 8.0
PLACES = ((50, 0), (50, 100), (0, 50), (100, 50), (0, 0), (100, 0), (0, 100), (100, 100))
"""Middles of the walls, then the corners: the first two, four or eight stand there [m]."""
CAMERAS = {2: (0, 2), 4: (0, 1, 2, 3), 8: tuple(range(8))}
"""Two look at right angles."""
NONE, NORMAL, KNOWN = "no prior", "Gaussian priors", "known places"
TWIN = "plain Python, likelihoods only"
_TIMED = 8
"""Frames at the end of a run, over which a measure is the mean."""


@dataclass(frozen=True, eq=False)
class Moment:
    """What a step of the filter starts from.

    Parameters
    ----------
    state : of the tracker after the frame before
    report : of the cameras
    occluders : (k, 2) - where they are [m]
    priors : what a Kalman filter of each knows
    """

    state: Tracked
    report: Report
    occluders: FloatArray
    priors: NormalPriors

    @property
    def places(self) -> FloatArray:
        """Of the particles (m, 2) [m]."""
        return self.state.particles.states.places

    def known(self, kind: str) -> Knowledge:
        """Return what is known of the occluders."""
        if kind == NONE:
            return NoKnowledge()
        return self.priors if kind == NORMAL else KnownPlaces(self.occluders, 0.5 * DIAMETER_M)


def bench_scanline(*, quick: bool = False, said: Callable[[str], None] = lambda text: None) -> list[Measure]:
    """Time steps of the filter with two, four and eight cameras, and their parts.

    Parameters
    ----------
    quick : few particles and one turn, to see that everything runs; its ratios say nothing
    said : told what is being timed

    Returns
    -------
    the measures, number of cameras by number of cameras
    """
    particles, turns, steps, few = (
        (QUICK_PARTICLES, QUICK_TURNS, QUICK_STEPS, QUICK_FEW) if quick else (PARTICLES, TURNS, STEPS, FEW)
    )
    said(f"a room with {OCCLUDERS} occluders: {particles} particles")
    trackers = {cameras: _tracker(cameras, particles) for cameras in CAMERAS}
    moments = {cameras: _moments(tracker, steps) for cameras, tracker in trackers.items()}
    measures = _steps(trackers, moments, turns, particles / few, few)
    for cameras in (4, 8):
        said(f"{cameras} cameras: parts of a step")
        measures += _parts(trackers[cameras], moments[cameras], turns)
    return measures


def _steps(
    trackers: Mapping[int, Tracker],
    moments: Mapping[int, list[Moment]],
    turns: int,
    scale: float,
    few: int,
) -> list[Measure]:
    """Time whole steps with each kind of knowledge, and the twin's two likelihoods of a few particles."""
    functions: dict[str, Callable[[], object]] = {}
    for cameras, tracker in trackers.items():
        for kind in (NONE, NORMAL, KNOWN):
            functions[f"{cameras} {kind}"] = partial(_step_all, tracker, moments[cameras], kind)
        functions[f"{cameras} {TWIN}"] = partial(_twin_all, tracker, moments[cameras], few)
    times = by_turns(functions, turns)

    measures = []
    for cameras, tracker in trackers.items():
        for kind in (NONE, NORMAL, KNOWN):
            name, twin = f"{cameras} {kind}", f"{cameras} {TWIN}"
            growth = times.ratio(name, f"{min(CAMERAS)} {kind}")
            compared = kind == NORMAL
            note = f"× {growth:.2f} of N = {min(CAMERAS)}"
            if compared:
                note += (
                    f"; log likelihoods within {_deviation(tracker, moments[cameras][-1], few):.0e} of its"
                )
            measures.append(
                Measure(
                    f"a step, {kind}",
                    f"N = {cameras}",
                    1e3 * times.typical(name) / _TIMED,
                    TWIN if compared else None,
                    1e3 * scale * times.typical(twin) / _TIMED if compared else None,
                    scale * times.ratio(twin, name) if compared else None,
                    note=note,
                )
            )
    return measures


def _parts(tracker: Tracker, moments: list[Moment], turns: int) -> list[Measure]:
    """Time what a step with Gaussian priors is made of; all but the resampling and the motion come twice."""
    rig, walk = tracker.rig, tracker.walk
    generator, negligible = RandomStreams(0).stream("bench-parts"), tracker.params.visibility_floor
    masks = [rig.masks(moment.places) for moment in moments]
    q = [
        moment.priors.coverage(rig, moment.places, mask) for moment, mask in zip(moments, masks, strict=True)
    ]
    explained = [Likelihood(rig, moment.report, moment.priors) for moment in moments]

    def each(function: Callable[[int, Moment], object]) -> Callable[[], object]:
        return lambda: [function(k, moment) for k, moment in enumerate(moments)]

    functions = {
        "masks by the table of regions": each(lambda k, m: rig.masks(m.places)),
        "normal part": each(lambda k, m: explained[k].log_normal(m.places)),
        "coverage, Eq. 4": each(lambda k, m: m.priors.coverage(rig, m.places, masks[k])),
        "joint probability, Eqs. 5 and 6": each(
            lambda k, m: joint_probability(
                q[k], masks[k], m.report.seeing, m.report.blind, negligible=negligible
            )
        ),
        "both at once, as in a step": each(
            lambda k, m: m.priors.probabilities(
                rig, m.places, masks[k], m.report.seeing, m.report.blind, negligible
            )
        ),
        "resampling": each(lambda k, m: systematic(generator, m.state.particles.weights)),
        "motion, expected and drawn": each(
            lambda k, m: (
                walk.expected(m.state.particles.states),
                walk.propagate(generator, m.state.particles.states),
            )
        ),
    }
    times = by_turns(functions, turns)
    setup = f"N = {len(rig.cameras)}"
    return [Measure(what, setup, 1e3 * times.typical(what) / _TIMED) for what in functions]


def _tracker(cameras: int, particles: int) -> Tracker:
    middle = 0.5 * SIDE_M
    stations = [PLACES[k] for k in CAMERAS[cameras]]
    room = Room(np.zeros(2), np.full(2, SIDE_M))
    rig = Rig(
        [
            ScanCamera((float(x), float(y)), atan2(middle - y, middle - x), 320.0, 0.5 * pi)
            for x, y in stations
        ],
        MeasurementNoise(),
        room,
    )
    return Tracker(rig, WaypointWalk(room), FilterParams(particles=particles))


def _moments(tracker: Tracker, steps: int) -> list[Moment]:
    """Follow an object among occluders, and return the last frames; known places keep it from being lost."""
    rig, streams = tracker.rig, RandomStreams(0)
    crowd = Crowd(
        count=OCCLUDERS + 1,
        diameter_m=DIAMETER_M,
        low=rig.room.low,
        high=rig.room.high,
        speed_mps=1.0,
        noise_sd_m=0.33,
        step_s=1.0,
    )
    paths = crowd.paths(streams.stream("bench-crowd"), steps)
    generator = streams.stream("bench-tracker")
    sensor = VirtualSensor(SENSOR_SD_M, PUBLISHED_Q)
    tracks = sensor.start(generator, paths[0, 1:])
    state, moments = tracker.start(generator), []
    for places in paths[1:]:
        truth, occluders = places[0], places[1:]
        point, centres = frozen(truth[np.newaxis], np.float64), frozen(occluders, np.float64)
        allowed = rig.masks(point)[0] & ~disc_masks(point, rig.rows, centres, 0.5 * DIAMETER_M)[0]
        values = np.array([measure(camera, truth, rig.noise, generator) for camera in rig.cameras])
        values[[not allowed >> k & 1 for k in range(len(values))]] = np.nan
        tracks = sensor.step(generator, tracks, occluders)
        priors = NormalPriors(tracks.places, tracks.covs, 0.5 * DIAMETER_M)
        moment = Moment(state, report(values), occluders, priors)
        state = tracker.step(generator, state, moment.report, moment.known(KNOWN))
        moments.append(moment)
    return moments[-_TIMED:]


def _step_all(tracker: Tracker, moments: list[Moment], kind: str) -> None:
    generator = RandomStreams(0).stream("bench-steps")
    for moment in moments:
        tracker.step(generator, moment.state, moment.report, moment.known(kind))


def _twin_all(tracker: Tracker, moments: list[Moment], few: int) -> None:
    """Evaluate the likelihoods of both stages for a few particles."""
    for moment in moments:
        places = moment.places[:few]
        for _ in range(2):
            likelihoods(Likelihood(tracker.rig, moment.report, moment.priors), places)


def _deviation(tracker: Tracker, moment: Moment, few: int) -> float:
    """Return by how much the log likelihoods of a few particles differ from the twin's, where they matter."""
    likelihood = Likelihood(tracker.rig, moment.report, moment.priors)
    places = moment.places[:few]
    found, expected = likelihood.log_density(places), np.array(likelihoods(likelihood, places))
    matter = expected > expected.max() - 35.0
    return float(np.abs(found[matter] - expected[matter]).max())
