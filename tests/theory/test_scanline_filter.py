"""The tracker against the exact posterior on a grid, and what it does when it has lost the object."""

import numpy as np
import pytest

from wsnsim.estimation.particle_filter import Particles
from wsnsim.systems.scanline.filter import FilterParams, Tracked, Tracker
from wsnsim.systems.scanline.likelihood import Likelihood
from wsnsim.systems.scanline.measurement import MeasurementNoise, Report, ScanCamera, report
from wsnsim.systems.scanline.motion import TOWARDS, Walkers, WaypointWalk
from wsnsim.systems.scanline.occlusion import KnownPlaces, NoKnowledge, NormalPriors, ScanLines
from wsnsim.systems.scanline.regions import Rig, Room

ROOM = Room(np.zeros(2), np.full(2, 12.0), (np.array([[5.0, 7.0], [8.0, 7.0], [8.0, 9.0], [5.0, 9.0]]),))
CAMERAS = (ScanCamera((6.0, -1.0), np.pi / 2, 100.0, 1.2), ScanCamera((-1.0, 6.0), 0.0, 100.0, 1.2))
RIG = Rig(CAMERAS, MeasurementNoise(0.2, 0.01, 2.0), ROOM)
POOR = Rig(CAMERAS, MeasurementNoise(0.7, 0.05, 8.0), ROOM)
"""With errors so large that many particles count from the first report on."""
WALK = WaypointWalk(ROOM, speed=1e-9, noise_sd=0.7, memory=0.0, reached=(0.6, 0.0), under_way=(0.6, 0.0))
"""Nobody gets on: a step is noise with probability .6, or none. The place alone is a Markov chain."""
PRIORS = NormalPriors(
    np.array([[4.0, 3.0], [7.0, 5.0]]), np.array([[[2.0, 0.5], [0.5, 1.0]], [[1.0, 0.0], [0.0, 1.0]]]), 0.4
)
REPORTS = [(12.0, -20.0), (np.nan, -15.0), (5.0, np.nan)]


def on_a_grid(likelihood_of, cells=120):
    """Yield the exact posterior's mean and covariance after each report."""
    side = 12.0 / cells
    middles = (np.arange(cells) + 0.5) * side
    # beyond the room there is space too: nothing keeps the particles in
    margin = cells // 2
    middles = (np.arange(-margin, cells + margin) + 0.5) * side
    points = np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = ((points >= 0.0) & (points <= 12.0)).all(axis=1)
    size = len(middles)
    density = inside.astype(float).reshape(size, size)
    blur = np.exp(-0.5 * ((middles[:, None] - middles) / 0.7) ** 2)
    blur /= blur[size // 2].sum()
    for values in REPORTS:
        density = 0.4 * density + 0.6 * blur @ density @ blur
        logs = likelihood_of(report(np.array(values))).log_density(points)
        density *= np.exp(logs - logs.max()).reshape(size, size)
        density /= density.sum()
        weights = density.ravel()
        mean = weights @ points
        yield mean, (weights[:, None] * (points - mean)).T @ (points - mean)


@pytest.mark.parametrize("kind", ["auxiliary", "plain"])
def test_posterior_is_that_of_a_grid(test_seed, kind):
    params = FilterParams(kind=kind, particles=5000, lost_sd=1e9)
    runs = 12
    means, covs = [], []
    for run in range(runs):
        generator = np.random.default_rng([test_seed, run])
        tracker = Tracker(POOR, WALK, params)
        state = tracker.start(generator)
        row = []
        for values in REPORTS:
            state = tracker.step(generator, state, report(np.array(values)), PRIORS)
            row.append((state.mean, state.cov))
        means.append([mean for mean, _ in row])
        covs.append([cov for _, cov in row])
    found, error = np.mean(means, axis=0), np.std(means, axis=0, ddof=1) / np.sqrt(runs)
    cov_found, cov_error = np.mean(covs, axis=0), np.std(covs, axis=0, ddof=1) / np.sqrt(runs)
    grid = on_a_grid(lambda heard: Likelihood(POOR, heard, PRIORS))
    for k, (mean, cov) in enumerate(grid):
        # the tail of t with 11 degrees of freedom at 5.5 is 1e-4; a cell of the grid is .1
        assert (np.abs(found[k] - mean) < 5.5 * error[k] + 0.01).all()
        assert (np.abs(cov_found[k] - cov) < 5.5 * cov_error[k] + 0.02).all()


def at(place, count=500):
    """Return a tracker's state with all particles about a place."""
    generator = np.random.default_rng(3)
    places = np.asarray(place) + generator.normal(0.0, 0.3, (count, 2))
    walkers = Walkers(places, np.full((count, 2), 6.0), np.full(count, 0.3), np.full(count, TOWARDS))
    return Tracked(Particles(walkers, np.full(count, 1.0 / count)))


def test_a_lost_object_is_found_again_and_it_is_said(test_seed):
    generator = np.random.default_rng(test_seed)
    tracker = Tracker(RIG, WaypointWalk(ROOM, speed=0.3, noise_sd=0.1), FilterParams(particles=500))
    place = np.array([9.0, 4.0])
    z = np.array([-100.0 * 3.0 / 5.0, -100.0 * 2.0 / 10.0])
    wrong = at((2.0, 6.0))
    found = tracker.step(generator, wrong, report(z), NoKnowledge())
    assert found.replaced
    assert np.linalg.norm(found.mean - place) < 1.0
    again = tracker.step(generator, found, report(z), NoKnowledge())
    assert not again.replaced


@pytest.mark.parametrize("kind", ["auxiliary", "printed", "plain"])
@pytest.mark.parametrize("knowledge", [NoKnowledge(), PRIORS, KnownPlaces(np.array([[4.0, 3.0]]), 0.4)])
def test_nothing_seen_or_heard_leaves_numbers(test_seed, kind, knowledge):
    generator = np.random.default_rng(test_seed + 1)
    tracker = Tracker(
        RIG, WaypointWalk(ROOM, speed=0.3, noise_sd=0.1), FilterParams(kind=kind, particles=200)
    )
    state = tracker.start(generator)
    unseen = np.full(2, np.nan)
    reports = [
        report(unseen),
        Report(unseen, np.zeros(2, bool)),
        Report(np.array([5.0, np.nan]), np.array([True, False])),
    ]
    for heard in reports * 20:
        state = tracker.step(generator, state, heard, knowledge)
        assert state.particles.weights.sum() == pytest.approx(1.0)
        assert np.isfinite(state.mean).all()
        assert np.isfinite(state.cov).all()


def test_unheard_is_not_unseen():
    """A blind camera with a free view rules a place out; one that was not heard does not."""
    nobody = KnownPlaces(np.empty((0, 2)), 0.4)
    points = np.array([[6.0, 3.0]])
    blind, silent = report(np.full(2, np.nan)), Report(np.full(2, np.nan), np.zeros(2, bool))
    assert Likelihood(RIG, blind, nobody).log_density(points)[0] == pytest.approx(np.log(1e-3))
    assert Likelihood(RIG, silent, nobody).log_density(points)[0] == 0.0
    # behind the wall both say the same
    hidden = np.array([[6.5, 11.5]])
    assert RIG.masks(hidden)[0] == 0
    assert Likelihood(RIG, blind, nobody).log_density(hidden)[0] == 0.0


def test_the_printed_form_has_no_floors():
    """With 0/1 probabilities a report against all particles leaves the printed filter without any."""
    hidden_there = KnownPlaces(np.array([[6.0, 1.0], [1.0, 6.0]]), 0.4)
    reading = report(np.array([0.0, 0.0]))
    points = np.array([[6.0, 6.0]])
    assert Likelihood(RIG, reading, hidden_there, 0.0).log_density(points)[0] == -np.inf
    assert Likelihood(RIG, reading, hidden_there, 1e-3).log_density(points)[0] > -20.0
    generator = np.random.default_rng(5)
    for kind, replaced in (("printed", True), ("auxiliary", False)):
        walk = WaypointWalk(ROOM, speed=1e-6, noise_sd=1e-3)
        tracker = Tracker(RIG, walk, FilterParams(kind=kind, particles=500))
        assert tracker.step(generator, at((6.0, 6.0)), reading, hidden_there).replaced == replaced


def test_scan_lines_tell_what_may_hide():
    points = np.array([[6.0, 5.0], [3.0, 5.0]])
    masks, blind = np.array([0b11, 0b11]), 0b01
    assert (RIG.masks(points) == masks).all()
    # camera 0 shows a blob before the first point only, as wide as a cylinder of radius .4 two metres away
    blobs = [np.array([[-20.0, 20.0]]), np.empty((0, 2))]
    p = ScanLines(blobs).probabilities(RIG, points, masks, 0b10, blind, 0.0)
    assert p[0] > 0.9
    assert p[1] == pytest.approx(1e-3, rel=0.01)
    # a narrow one is somebody behind the point
    narrow = [np.array([[-4.0, 4.0]]), np.empty((0, 2))]
    assert ScanLines(narrow, 0.4).probabilities(RIG, points, masks, 0b10, blind, 0.0)[0] < 0.1
    assert ScanLines(blobs, 0.4).probabilities(RIG, points, masks, 0b10, blind, 0.0)[0] > 0.9
    # cameras that see are not asked, whatever is in their lines
    np.testing.assert_array_equal(ScanLines(blobs).probabilities(RIG, points, masks, 0b11, 0, 0.0), 1.0)


def test_a_camera_that_may_miss_the_object_weighs_less():
    nobody = KnownPlaces(np.empty((0, 2)), 0.4, detected=0.9)
    p = nobody.probabilities(RIG, np.array([[6.0, 3.0]]), np.array([0b11]), 0b01, 0b10, 0.0)
    assert p[0] == pytest.approx(0.1)
    no_priors = NormalPriors(np.empty((0, 2)), np.empty((0, 2, 2)), 0.4, detected=0.9)
    p = no_priors.probabilities(RIG, np.array([[6.0, 3.0]]), np.array([0b11]), 0b01, 0b10, 0.0)
    assert p[0] == pytest.approx(0.9 * 0.1)
