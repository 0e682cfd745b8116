"""Sight lines, coverage and joint probabilities against plain twins, enumeration and sampling."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from wsnsim.bench.scanline_twins import coverage, in_sight, likelihoods, recursion
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.sightlines import disc_masks, sight_masks, undisturbed
from wsnsim.kernels.waypoints import waypoint_steps
from wsnsim.systems.scanline.likelihood import Likelihood
from wsnsim.systems.scanline.measurement import MeasurementNoise, Report, ScanCamera, report
from wsnsim.systems.scanline.motion import CHANGE, TOWARDS, WAIT
from wsnsim.systems.scanline.occlusion import NormalPriors, UniformPriors, joint_probability
from wsnsim.systems.scanline.regions import Rig, Room

WALLS = (
    np.array([[30.0, 40.0], [70.0, 40.0], [70.0, 60.0], [30.0, 60.0]]),
    np.array([[10.0, 80.0], [25.0, 95.0], [12.0, 90.0]]),
    np.array([[80.0, 15.0], [90.0, 10.0], [95.0, 30.0], [85.0, 25.0]])[::-1],
)


def a_rig(generator, cameras=6, walls=WALLS):
    chosen = [
        ScanCamera(
            tuple(generator.uniform(0.0, 100.0, 2)),
            generator.uniform(-4.0, 4.0),
            320.0,
            generator.uniform(0.4, 2.6),
        )
        for _ in range(cameras)
    ]
    return Rig(chosen, MeasurementNoise(), Room(np.zeros(2), np.full(2, 100.0), walls))


def some_covs(generator, count, least, most):
    """Return covariances with standard deviations in a range and axes of any direction."""
    angles = generator.uniform(0.0, np.pi, count)
    turn = np.array([[np.cos(angles), -np.sin(angles)], [np.sin(angles), np.cos(angles)]]).transpose(2, 0, 1)
    variances = generator.uniform(least, most, (count, 2)) ** 2
    return turn * variances[:, None, :] @ turn.transpose(0, 2, 1)


def some_q(generator, points, occluders, cameras, largest=0.5):
    q = generator.uniform(0.0, largest, (points, occluders, cameras))
    q[generator.uniform(size=q.shape) < 0.3] = 0.0
    return q


def masks_of(generator, points, cameras):
    return generator.integers(0, 1 << cameras, points)


def test_sight_is_the_twins_and_the_table_changes_nothing(test_seed):
    generator = np.random.default_rng(test_seed)
    for _ in range(3):
        rig = a_rig(generator)
        # outside the room too, where the table has no cells
        points = generator.uniform(-20.0, 120.0, (700, 2))
        walls = [[tuple(corner) for corner in wall] for wall in rig.room.walls]
        expected = [
            sum(in_sight(camera, tuple(point), walls) << k for k, camera in enumerate(rig.cameras))
            for point in points
        ]
        np.testing.assert_array_equal(rig.masks(points), expected)
        many = generator.uniform(0.0, 100.0, (50_000, 2))
        np.testing.assert_array_equal(rig.masks(many), sight_masks(many, rig.rows, *rig.room.half_planes))


def test_discs_hide_what_is_behind_them(test_seed):
    generator = np.random.default_rng(test_seed + 1)
    rig = a_rig(generator, 3, ())
    points, centres = generator.uniform(0.0, 100.0, (60, 2)), generator.uniform(0.0, 100.0, (20, 2))
    masks = disc_masks(frozen(points, float), rig.rows, frozen(centres, float), 4.0)
    shares = np.linspace(0.0, 1.0, 1501)[:, None]
    for point, mask in zip(points, masks, strict=True):
        for k, camera in enumerate(rig.cameras):
            line = np.asarray(camera.position) + shares * (point - camera.position)
            nearest = np.linalg.norm(line[:, None] - centres, axis=2).min()
            if abs(nearest - 4.0) > 1e-3:
                assert bool(mask >> k & 1) == (nearest < 4.0)


def equal_covs(generator, count):
    """Return covariances that are the same for all occluders and in all directions."""
    return np.broadcast_to(generator.uniform(2.0, 8.0) ** 2 * np.eye(2), (count, 2, 2))


def round_covs(generator, count):
    """Return covariances that are the same in all directions, but not for all occluders."""
    return generator.uniform(0.5, 8.0, (count, 1, 1)) ** 2 * np.eye(2)


@pytest.mark.parametrize(
    "covs", [lambda g, k: some_covs(g, k, 0.5, 25.0), equal_covs, round_covs], ids=["any", "equal", "round"]
)
def test_coverage_is_the_twins(test_seed, covs):
    generator = np.random.default_rng(test_seed + 2)
    rig = a_rig(generator, 4, ())
    points = generator.uniform(0.0, 100.0, (50, 2))
    priors = NormalPriors(generator.uniform(-10.0, 110.0, (30, 2)), covs(generator, 30), 1.67)
    q = priors.coverage(rig, points, np.full(50, 0b1011))
    assert not q[:, :, 2].any()
    for i, j, s in product(range(50), range(30), (0, 1, 3)):
        cov = tuple(priors.covs[j].ravel()[[0, 1, 3]])
        expected = coverage(rig.cameras[s].position, tuple(points[i]), tuple(priors.means[j]), cov, 1.67)
        # culled beyond 4.5 standard deviations, tabled to 2e-7
        assert q[i, j, s] == pytest.approx(expected, abs=8e-6)


def test_joint_probability_by_enumeration(test_seed):
    """Every occluder hides nothing or one camera: add up all ways that give the report."""
    generator = np.random.default_rng(test_seed + 3)
    cameras, occluders = 4, 3
    q = some_q(generator, 40, occluders, cameras)
    q /= np.maximum(q.sum(axis=2, keepdims=True), 1.0)
    for detected in (1.0, 0.8):
        masks = masks_of(generator, 40, cameras)
        seeing, blind = 0b0001, 0b1110
        expected = np.zeros(40)
        for i in range(40):
            if not masks[i] & seeing and seeing:
                continue
            asked = [k for k in range(cameras) if masks[i] >> k & 1]
            for hidden in product([None, *asked], repeat=occluders):
                chance = 1.0
                for j, k in enumerate(hidden):
                    chance *= 1.0 - q[i, j, asked].sum() if k is None else q[i, j, k]
                for k in asked:
                    seen = seeing >> k & 1
                    chance *= (detected if seen else 1.0 - detected) if k not in hidden else 1.0 - seen
                expected[i] += chance
        for joint in ("subsets", "covering"):
            found = joint_probability(q, masks, seeing, blind, joint, detected)
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)


def test_coverage_at_a_step_of_the_table(test_seed):
    """Occluders as far across the line as the table of widths goes: none beyond it is read."""
    rig = Rig(
        [ScanCamera((0.0, 0.0), 0.0, 320.0, 2.0)], MeasurementNoise(), a_rig(np.random.default_rng(0)).room
    )
    radius, sd = 1.67, 4.0
    farthest = radius + 4.5 * np.hypot(sd, 1e-3 * radius)
    across = farthest * np.concatenate([np.arange(1025) / 1024, 1.0 + np.array([-1e-16, 1e-16, 1e-3])])
    means = np.stack([np.full(len(across), 30.0), across], axis=1)
    priors = NormalPriors(means, np.broadcast_to(sd**2 * np.eye(2), (len(across), 2, 2)), radius)
    q = priors.coverage(rig, np.array([[60.0, 0.0]]), np.array([1]))[0, :, 0]
    expected = [coverage((0.0, 0.0), (60.0, 0.0), tuple(mean), (sd**2, 0.0, sd**2), radius) for mean in means]
    np.testing.assert_allclose(q, expected, rtol=0.0, atol=8e-6)


@pytest.mark.parametrize("joint", ["subsets", "covering", "printed"])
@pytest.mark.parametrize("detected", [1.0, 0.8])
def test_at_once_is_one_after_the_other(test_seed, joint, detected):
    """p(η) point by point is that of the coverage's array, and so is what may be left out."""
    generator = np.random.default_rng(test_seed + 20)
    rig = a_rig(generator, 6, ())
    points = generator.uniform(0.0, 100.0, (400, 2))
    means = generator.uniform(0.0, 100.0, (25, 2))
    for covs in (some_covs(generator, 25, 2.0, 9.0), equal_covs(generator, 25)):
        priors = NormalPriors(means, covs, 1.67, joint, detected)
        masks = masks_of(generator, 400, 6)
        q = priors.coverage(rig, points, masks)
        for negligible in (0.0, 0.01):
            found = priors.probabilities(rig, points, masks, 0b000001, 0b101110, negligible)
            expected = joint_probability(q, masks, 0b000001, 0b101110, joint, detected, negligible)
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13)
        assert (found == 0.0).any()
        assert (found > 0.01).any()


def test_an_exponent_of_p(test_seed):
    generator = np.random.default_rng(test_seed + 25)
    rig = a_rig(generator, 6, ())
    points, means = generator.uniform(0.0, 100.0, (200, 2)), generator.uniform(0.0, 100.0, (25, 2))
    priors = NormalPriors(means, equal_covs(generator, 25), 1.67)
    masks = masks_of(generator, 200, 6)
    whole = priors.probabilities(rig, points, masks, 0b000001, 0b101110, 0.0)
    half = replace(priors, exponent=0.5)
    np.testing.assert_allclose(half.probabilities(rig, points, masks, 1, 0b101110, 0.0), whole**0.5)
    # what is left out is at most what may be
    found = half.probabilities(rig, points, masks, 1, 0b101110, 0.3)
    assert (whole[found == 0.0] ** 0.5 <= 0.3).all()
    np.testing.assert_allclose(found[found > 0.0], whole[found > 0.0] ** 0.5)
    polygons = UniformPriors([mean + 8.0 * np.array([[0, 0], [1, 0], [0, 1]]) for mean in means], 1.67)
    whole, half = (
        each.probabilities(rig, points, masks, 1, 0b101110, 0.0)
        for each in (polygons, replace(polygons, exponent=0.5))
    )
    assert (whole > 0.0).any()
    np.testing.assert_allclose(half, whole**0.5)


def test_many_blind_cameras_cost_a_bounded_time(test_seed):
    """Ten blind cameras count together, and further ones on their own: near to all together."""
    generator = np.random.default_rng(test_seed + 21)
    q = some_q(generator, 20, 30, 12, 0.05)
    masks = np.full(20, (1 << 12) - 1)
    all_blind = joint_probability(q, masks, 0, (1 << 12) - 1)
    alone = 1.0 - (1.0 - q[:, :, 10:]).prod(axis=1)
    together = joint_probability(q[:, :, :10], masks & 1023, 0, 1023)
    np.testing.assert_allclose(all_blind, together * alone.prod(axis=1), rtol=1e-12, atol=0.0)
    # a room full of cameras, none of which sees the object
    most = joint_probability(some_q(generator, 2, 30, 62), np.full(2, (1 << 62) - 1), 0, (1 << 62) - 1)
    assert ((most >= 0.0) & (most <= 1.0)).all()


@pytest.mark.parametrize("cameras", [2, 5, 8])
def test_subset_sums_equal_the_covering_recursion_and_eq_6(test_seed, cameras):
    generator = np.random.default_rng([test_seed, cameras])
    q = some_q(generator, 500, 40, cameras, 0.3)
    masks = masks_of(generator, 500, cameras)
    seeing = int(generator.integers(1 << cameras)) & 0b101
    blind = ~seeing & ((1 << cameras) - 1)
    fast, exact = (joint_probability(q, masks, seeing, blind, joint) for joint in ("subsets", "covering"))
    np.testing.assert_allclose(fast, exact, rtol=0.0, atol=1e-12)
    assert exact.min() >= 0.0
    # as printed, without rescaling: the recursion of Eq. 6
    printed = joint_probability(q, masks, seeing, blind, "printed")
    for i in range(0, 500, 25):
        if seeing & ~masks[i]:
            assert printed[i] == 0.0
            continue
        rows = [dict(enumerate(row)) for row in q[i]]
        asked = [[k for k in range(cameras) if masks[i] & group & 1 << k] for group in (seeing, blind)]
        assert printed[i] == pytest.approx(recursion(rows, *asked), abs=1e-12)


def test_no_probability_is_below_0_in_a_million_cases(test_seed):
    generator = np.random.default_rng(test_seed + 4)
    cases = 0
    below = 0
    for cameras in (2, 3, 5, 8):
        for occluders, largest in ((1, 1.0), (4, 1.0), (3, 0.02)):
            count = 1_000_000 // 12 + 1
            q = some_q(generator, count, occluders, cameras, largest)
            masks = masks_of(generator, count, cameras)
            seeing = int(generator.integers(1 << cameras))
            blind = ~seeing & ((1 << cameras) - 1)
            exact = joint_probability(q, masks, seeing, blind, "covering")
            assert exact.min() >= 0.0
            assert exact.max() <= 1.0 + 1e-12
            assert joint_probability(q, masks, seeing, blind).min() >= 0.0
            below += (joint_probability(q, masks, seeing, blind, "printed") < 0.0).sum()
            cases += count
    assert cases >= 1_000_000
    # the printed form is there to show what was mended
    assert below > 1000


def test_reports_are_all_there_is(test_seed):
    """The probabilities of all that the cameras of a place may report add up to 1."""
    generator = np.random.default_rng(test_seed + 5)
    q = some_q(generator, 200, 6, 4, 0.6)
    masks = masks_of(generator, 200, 4)
    for joint, detected in (("subsets", 1.0), ("covering", 1.0), ("subsets", 0.7), ("covering", 0.7)):
        total = sum(joint_probability(q, masks, s, 0b1111 & ~s, joint, detected) for s in range(16))
        np.testing.assert_allclose(total, 1.0, rtol=0.0, atol=1e-12)


def test_cameras_that_were_not_heard_say_nothing(test_seed):
    """What is left is the marginal: the sum over what the silent camera may have said."""
    generator = np.random.default_rng(test_seed + 6)
    q = some_q(generator, 200, 6, 3, 0.6)
    q /= np.maximum(q.sum(axis=2, keepdims=True), 1.0)
    masks = np.full(200, 0b111)
    silent = joint_probability(q, masks, 0b001, 0b010)
    both = joint_probability(q, masks, 0b101, 0b010) + joint_probability(q, masks, 0b001, 0b110)
    np.testing.assert_allclose(silent, both, rtol=0.0, atol=1e-12)


def test_free_places_are_free(test_seed):
    """Off the room's sides and each wall's sides by the margin, told corner by corner."""
    generator = np.random.default_rng(test_seed + 22)
    room = a_rig(generator).room
    points = generator.uniform(-5.0, 105.0, (500, 2))
    for margin in (0.0, 3.0):
        found = room.within(points, margin)
        for point, free in zip(points, found, strict=True):
            expected = bool(((point >= margin) & (point <= 100.0 - margin)).all())
            for wall in room.walls:
                ways = np.roll(wall, -1, axis=0) - wall
                offsets = point - wall
                areas = ways[:, 0] * offsets[:, 1] - ways[:, 1] * offsets[:, 0]
                turn = np.sign(ways[0, 0] * ways[1, 1] - ways[0, 1] * ways[1, 0])
                expected &= bool((-turn * areas / np.hypot(*ways.T)).max() >= margin)
            assert free == expected


def test_only_cameras_asked_for_are_disturbed(test_seed):
    generator = np.random.default_rng(test_seed + 23)
    rig = a_rig(generator, 5, ())
    points, centres = generator.uniform(0.0, 100.0, (300, 2)), generator.uniform(0.0, 100.0, (20, 2))
    masks = masks_of(generator, 300, 5)
    arguments = rig.rows, frozen(centres, float), 3.0
    found = undisturbed(frozen(points, float), frozen(masks, np.int64), *arguments)
    np.testing.assert_array_equal(found, masks & ~disc_masks(frozen(points, float), *arguments))
    # whoever stands in a disc sees nothing, and nobody sees him
    camera = rig.rows[0, :2]
    at_camera, elsewhere = frozen(camera[None], float), frozen([[50.0, 50.0]], float)
    for point, disc in ((elsewhere, at_camera), (elsewhere, elsewhere), (at_camera, at_camera)):
        assert disc_masks(point, rig.rows, disc, 1.0)[0] & 1 == 1
    assert disc_masks(at_camera, rig.rows, elsewhere, 1.0)[0] & 1 == 0


def test_waypoint_steps_are_the_twins(test_seed):
    """Sec. 4.1, particle by particle."""
    generator = np.random.default_rng(test_seed + 24)
    count, memory, reached, under_way = 500, 0.4, (0.1, 0.6), (0.7, 0.2)
    places, targets, fresh = generator.uniform(0.0, 10.0, (3, count, 2))
    targets[:5] = places[:5]
    speeds, draws = generator.uniform(0.5, 4.0, count), generator.uniform(size=count)
    noise = generator.normal(0.0, 0.3, (count, 2))
    found = waypoint_steps(
        *(frozen(a, float) for a in (places, targets, speeds, draws, fresh, noise)),
        memory,
        reached,
        under_way,
    )
    for i in range(count):
        way = targets[i] - places[i]
        towards, change = reached if np.linalg.norm(way) < speeds[i] else under_way
        place, target, speed, regime = places[i], targets[i], speeds[i], WAIT
        if draws[i] < towards + change:
            regime = TOWARDS if draws[i] < towards else CHANGE
            target = target if regime == TOWARDS else fresh[i]
            way = target - place
            step = speed * way / max(np.linalg.norm(way), 1e-300) + noise[i]
            place = place + step
            speed = (1.0 - memory) * speed + memory * np.linalg.norm(step)
        for array, expected in zip(found, (place, target, speed, regime), strict=True):
            np.testing.assert_allclose(array[i], expected, rtol=0.0, atol=1e-12)
    assert set(found[3]) == {TOWARDS, CHANGE, WAIT}


def test_likelihood_is_the_twins(test_seed):
    generator = np.random.default_rng(test_seed + 7)
    rig = a_rig(generator)
    priors = NormalPriors(generator.uniform(0.0, 100.0, (12, 2)), some_covs(generator, 12, 2.0, 9.0), 1.67)
    points = generator.uniform(-5.0, 105.0, (150, 2))
    every, some = np.ones(6, bool), np.array([True, True, False, True, True, True])
    for heard, bounded in ((every, True), (every, False), (some, True)):
        values = np.where(generator.uniform(size=6) < 0.3, generator.normal(0.0, 60.0, 6), np.nan)
        likelihood = Likelihood(rig, Report(values, heard), priors, bounded=bounded)
        found, expected = likelihood.log_density(points), np.array(likelihoods(likelihood, points))
        hopeless = expected < expected.max() - 35.0
        np.testing.assert_array_equal(np.isinf(found), np.isinf(expected))
        np.testing.assert_allclose(found[~hopeless], expected[~hopeless], rtol=0.0, atol=2e-3)
        assert (found[hopeless] <= found.max() - 25.0).all()


def test_uniform_priors_by_sampling(test_seed):
    generator = np.random.default_rng(test_seed + 8)
    rig = a_rig(generator, 3, ())
    corners = np.array([[40.0, 40.0], [52.0, 38.0], [60.0, 47.0], [55.0, 58.0], [43.0, 52.0]])
    triangle = np.array([[20.0, 70.0], [22.0, 70.0], [21.0, 90.0]])
    priors = UniformPriors((corners, triangle[::-1]), 3.0)
    points = generator.uniform(0.0, 100.0, (25, 2))
    q = priors.coverage(rig, points, np.full(25, 0b111))
    for j, polygon in enumerate((corners, triangle)):
        low, high = polygon.min(axis=0), polygon.max(axis=0)
        draws = generator.uniform(low, high, (30_000, 2))
        sides = np.roll(polygon, -1, axis=0) - polygon
        ways = draws[:, None] - polygon
        inside = draws[(sides[:, 0] * ways[..., 1] - sides[:, 1] * ways[..., 0] >= 0.0).all(axis=1)]
        for s, camera in enumerate(rig.cameras):
            ray = points - camera.position
            length = np.linalg.norm(ray, axis=1)
            unit = ray / length[:, None]
            offset = inside - camera.position
            along = offset @ unit.T
            across = np.abs(offset[:, :1] * unit[:, 1] - offset[:, 1:] * unit[:, 0])
            share = ((along > 0.0) & (along < length) & (across < 3.0)).mean(axis=0)
            np.testing.assert_allclose(q[:, j, s], share, rtol=0.0, atol=5.0 * 0.5 / np.sqrt(len(inside)))
    assert (q > 0.01).sum() > 10


def test_nothing_known_and_nobody_there():
    rig = a_rig(np.random.default_rng(1), 2, ())
    empty = NormalPriors(np.empty((0, 2)), np.empty((0, 2, 2)), 1.0)
    points = np.full((3, 2), 50.0)
    masks = np.array([0b11, 0b01, 0b00])
    np.testing.assert_array_equal(empty.probabilities(rig, points, masks, 0b01, 0b10, 0.0), [0.0, 1.0, 0.0])
    no_polygons = UniformPriors((), 1.0)
    np.testing.assert_array_equal(no_polygons.probabilities(rig, points, masks, 0b00, 0b11, 0.0), [0, 0, 1])


def test_singular_and_far_priors_stay_numbers():
    rig = a_rig(np.random.default_rng(2), 3, ())
    covs = np.array([np.zeros((2, 2)), [[1.0, 1.0], [1.0, 1.0]], np.eye(2) * 1e12, np.diag([1e-30, 9.0])])
    means = np.array([[50.0, 50.0], [40.0, 60.0], [0.0, 0.0], [1e9, -1e9]])
    points = np.random.default_rng(3).uniform(0.0, 100.0, (500, 2))
    q = NormalPriors(means, covs, 1.67).coverage(rig, points, np.full(500, 7))
    assert np.isfinite(q).all()
    assert q.min() >= -1e-9
    assert q.max() <= 1.0 + 1e-9
    # a place that is known hides all or nothing
    assert set(np.round(q[:, 0].ravel(), 6)) == {0.0, 1.0}
    assert report(np.array([np.nan])).blind == 1
