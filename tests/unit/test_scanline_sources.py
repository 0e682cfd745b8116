"""What the cluster head knows of occluders of whom it hears nothing."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.systems.scanline.regions import Room
from wsnsim.systems.scanline.sources import Exact, Heard, source_for
from wsnsim.systems.scanline.stage import anywhere_sds_m, stage_of

POST = runpy.run_path(str(Path(__file__).parents[1] / "scanline_post.py"))
RATE_HZ, CAMERAS = POST["RATE_HZ"], 4


@pytest.fixture(scope="module")
def filtered(tmp_path_factory):
    """Return a source of Kalman filters' beliefs of five occluders, and the deployment."""
    file = POST["room"](tmp_path_factory.mktemp("room"))
    loaded = load_scenario(file, ("system.priors={kind: kalman, sensor_sd_m: 0.3}",))
    stage = stage_of(loaded.system_params, build(loaded).site)
    return lambda: source_for(loaded.system_params, stage, RATE_HZ), stage


def know(source, places):
    heard = Heard(places=places)
    return source.knowledge(heard, heard.report(CAMERAS))[0]


def test_who_was_never_reported_may_be_anywhere_in_the_room(filtered):
    make, stage = filtered
    known = know(make(), {1: np.array([2.0, 5.0])})
    np.testing.assert_array_equal(known.means[1], [2.0, 5.0])
    np.testing.assert_array_equal(known.means[[0, 2, 3, 4]], np.tile(stage.rig.room.centre, (4, 1)))
    anywhere = np.diag(anywhere_sds_m(stage.rig.room) ** 2)
    np.testing.assert_array_equal(known.covs[[0, 2, 3, 4]], np.tile(anywhere, (4, 1, 1)))
    assert known.covs[1, 0, 0] < 0.1


def test_who_is_reported_no_more_does_not_walk_out_of_the_room(filtered):
    """He walks towards a side at 1 m/s when the reports end: first believed straight on, then anywhere."""
    make, stage = filtered
    source, anywhere = make(), float(anywhere_sds_m(stage.rig.room)[0] ** 2)
    for step in range(30):
        known = know(source, {0: np.array([2.0 + step / RATE_HZ, 3.0])})
    # he was told without an error: what is left is of the filter's beginning, at rest
    assert known.means[0] == pytest.approx([2.0 + 29 / RATE_HZ, 3.0], abs=0.1)
    spread = [known.covs[0, 0, 0]]
    for silent in range(1, 300):
        known = know(source, {})
        spread.append(known.covs[0, 0, 0])
        if spread[-1] == anywhere:
            break
        assert known.means[0] == pytest.approx([2.0 + (29 + silent) / RATE_HZ, 3.0], abs=0.1 + 0.05 * silent)
    assert (np.diff(spread) > 0.0).all()
    assert 10 < silent < 100
    for _ in range(300):
        known = know(source, {})
    np.testing.assert_array_equal(known.means[0], stage.rig.room.centre)
    assert known.covs[0, 0, 0] == anywhere
    # and one report is enough to know him again
    known = know(source, {0: np.array([6.0, 1.0])})
    assert known.means[0] == pytest.approx([6.0, 1.0], abs=0.01)
    assert known.covs[0, 0, 0] == pytest.approx(0.09, rel=0.01)


def test_who_is_measured_exactly_and_not_reported_once_is_where_he_was(filtered):
    _, stage = filtered
    source = Exact(stage, 1.0)
    know(source, {0: np.array([2.0, 5.0]), 3: np.array([6.0, 1.0])})
    known = know(source, {3: np.array([6.2, 1.0])})
    np.testing.assert_array_equal(known.centres, [[2.0, 5.0], [6.2, 1.0]])


def test_anywhere_in_a_long_hall_is_a_long_prior():
    hall = Room(np.zeros(2), np.array([40.0, 5.0]))
    np.testing.assert_allclose(anywhere_sds_m(hall), [8.52, 1.065])


def test_believed_poses_are_off_by_the_noise_where_pixels_have_a_bias(tmp_path):
    file = POST["room"](tmp_path)
    exact, biased = (
        stage_of(loaded.system_params, build(loaded).site).rig
        for loaded in (
            load_scenario(file, (f"system.front_end={{kind: pixels, pose_error: {error}}}",))
            for error in ("none", "bias")
        )
    )
    ways = [
        np.subtract(one.position, other.position)
        for one, other in zip(exact.cameras, biased.cameras, strict=True)
    ]
    sizes = np.hypot(*np.array(ways).T)
    # of the lengths of two normal errors one in some thousand is beyond these bounds
    assert ((sizes > 0.01 * exact.noise.position_sd_m) & (sizes < 4.3 * exact.noise.position_sd_m)).all()
    assert exact.cameras[0].half_width_px == biased.cameras[0].half_width_px
