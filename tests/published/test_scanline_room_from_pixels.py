"""The paper's room through pixels, at its own resolution: what is seen of the object is there.

Forty people in one colour before photographs: where two of their outlines nearly touch, the columns between
show mixtures of clothes and background, from head to foot, and many of those are among the object's colours.
"""

from typing import NamedTuple

import numpy as np
import pytest

from wsnsim.runs.run import run
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.systems.scanline.front_end import FrontEnd
from wsnsim.systems.scanline.jpeg import compressed, opened
from wsnsim.systems.scanline.measurement import project, variance
from wsnsim.systems.scanline.stage import stage_of

PIXELS = "system.front_end={kind: pixels}"
SEEDS, STEPS = range(1, 6), range(1, 5)
CORNERS = "cameras={only: [c2, c4, c6, c8]}"
"""Those that see most of the room, and people smallest."""
LEAST_SHOWN = 0.4
"""Share of its width with which the object is read."""


class Seen(NamedTuple):
    """A camera's frame: what is read of the object, where it is, and what of it shows.

    Parameters
    ----------
    value, value_of_jpeg : z from the image, and from the image through a JPEG file [px]
    true : z without an error [px]
    sd : of the model [px]
    half_width : of the object [px]
    share : of its pixels that nothing hides; 0 where its axis is hidden, whatever shows of its side
    """

    value: float
    value_of_jpeg: float
    true: float
    sd: float
    half_width: float
    share: float


def outline(camera, place, radius):
    """Return the ends of an upright cylinder in the scan line, in the order of their angles [px]."""
    way = place - camera.position
    turn = np.arctan2(way[1], way[0]) - camera.heading_rad
    turn, half = np.arctan2(np.sin(turn), np.cos(turn)), np.arcsin(radius / np.hypot(*way))
    return camera.focal_px * np.tan([turn - half, turn + half])


def frames(room, seed):
    """Return the first frames of a seed."""
    loaded = load_scenario(room, (PIXELS, CORNERS, "duration_s=1"), seed)
    simulation = build(loaded)
    rules, site, world = loaded.system_params.front_end, simulation.site, simulation.world
    stage = stage_of(loaded.system_params, site)
    for camera, scan in zip(simulation.cameras, stage.rig.cameras, strict=True):
        front_end = FrontEnd(rules, camera.renderer.camera, site.targets[0])
        plain = jpeg = front_end.start(site.empty_views[camera.node.id]())
        for step in STEPS:
            time = step / site.rate_hz
            bodies, poses = world.moving_bodies, world.moving_at(time)
            image = camera.renderer.render(step, bodies, poses)
            copy = opened(compressed(image, loaded.system_params.jpeg_quality)[0], image.shape[1::-1])
            reading, plain, _ = front_end.read(image, plain)
            again, jpeg, _ = front_end.read(copy, jpeg)
            share = 0.0
            if camera.sensor.in_view(time):
                shown, whole = (camera.renderer.visible_pixels(bodies[:k], poses[:k])[0] for k in (None, 1))
                share = shown / whole
            place = poses[0].position[:2]
            yield Seen(
                reading.value_px,
                again.value_px,
                float(project(scan, place)),
                float(np.sqrt(variance(scan, place, stage.rig.noise))),
                float(np.ptp(outline(scan, place, stage.target_radius_m))) / 2.0,
                share,
            )


@pytest.fixture(scope="module")
def room(scenarios):
    return scenarios / "published" / "scanline_room.yaml"


@pytest.fixture(scope="module")
def seen(room):
    """Return what all frames show, a row each, by the fields of `Seen`."""
    rows = [row for seed in SEEDS for row in frames(room, seed)]
    return Seen(*np.array(rows).T)


@pytest.mark.parametrize("images", ["as they are", "from JPEG files"])
def test_what_is_read_is_the_object(seen, images):
    """Hidden, or hidden partly, it must not be taken for somebody else.

    At least .4 of its width shows, so that the middle of what shows is .6 of its half width beside its axis
    at most; and each end is told to a column or two.
    """
    errors = (seen.value if images == "as they are" else seen.value_of_jpeg) - seen.true
    read = ~np.isnan(errors)
    assert np.count_nonzero(read) > 0.2 * len(errors)
    assert np.count_nonzero(~read) > 0.4 * len(errors)
    assert (np.abs(errors[read]) < (1.0 - LEAST_SHOWN) * seen.half_width[read] + 2.0).all()
    assert (np.abs(errors[read]) < 4.5 * seen.sd[read]).all()


def test_who_is_visible_is_read(seen):
    """As the model of measurements has it: where nothing hides the axis."""
    whole, axis = seen.share > 0.95, seen.share > 0.0
    assert np.count_nonzero(whole) >= 10
    assert (np.abs(seen.value[whole] - seen.true[whole]) < 1.0).all()
    # people on both sides can leave too little of it
    assert np.count_nonzero(np.isnan(seen.value[axis])) <= 0.1 * np.count_nonzero(axis)
    # with less than a half in view, but more than what counts, it is read too
    assert np.count_nonzero(~np.isnan(seen.value[~axis])) <= 0.1 * np.count_nonzero(~axis)


def test_the_object_is_followed_as_well_as_from_measurements(room):
    """The poses are exact in pixels, and wrong by 20 cm and .01 rad in the measurements."""
    short = ("network={standard: ideal}", "duration_s=0.6")
    pixels, measured = (
        run(room, seed=1, overrides=(*short, *more)).summary["position_rmse_m"] for more in ((PIXELS,), ())
    )
    assert pixels < 1.5 * measured
    assert measured < 0.5
