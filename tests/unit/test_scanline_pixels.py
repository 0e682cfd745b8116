"""Scan lines of images: sums, blobs, places, the object's colours, and JPEG files in their place."""

from dataclasses import replace
from itertools import pairwise
from math import asin, atan2

import numpy as np
import pytest

from wsnsim.errors import DecodeError
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import IDENTITY
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Belief, TrackedTarget
from wsnsim.systems.scanline.front_end import FrontEnd
from wsnsim.systems.scanline.jpeg import compressed, opened
from wsnsim.systems.scanline.measurement import ScanCamera, project
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.vision.backprojection import FEATURES, learned_colours, object_pixels
from wsnsim.vision.photos import load_background
from wsnsim.vision.portrait import Studio
from wsnsim.vision.renderer import Renderer
from wsnsim.vision.scanline import blobs, column_sums, heaviest, line_places, middle_place, wide_runs
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

SIZE = (320, 240)
LIGHT, AMBIENT = np.array([0.0, -0.6, 0.8]), 0.5
RED = Body(np.array([0.1, 0.1, 0.9]), PatchTexture.plain((225.0, 40.0, 30.0)), "cylinder")
BLUE = Body(np.array([0.33, 0.33, 0.875]), PatchTexture.plain((60.0, 90.0, 200.0)), "cylinder")
RULES = PixelFrontEnd(kind="pixels")


def level(yaw=0.0, pitch=0.0, distortion=(0.0, 0.0)):
    return PinholeCamera.at_angles((0.0, 0.0, 1.5), yaw, pitch, 0.0, 320.0, SIZE, distortion)


def standing(body, depth, left):
    return Pose(np.array([depth, left, body.semi_axes_m[2]]), np.zeros(3), IDENTITY)


def tracked(body, streams):
    studio = Studio(body, IDENTITY, LIGHT, AMBIENT, 320.0, SIZE, 2.5, 5.0, streams, "object")
    start = Belief(np.zeros(3), np.zeros(3), IDENTITY)
    return TrackedTarget("object", body.semi_axes_m, start, studio.portrait)


def eye(camera, streams, photo="photo/coffee", rules=RULES):
    """Return a renderer, a front end, and the background that it starts with."""
    renderer = Renderer(camera, "c1", load_background(photo, SIZE), 5.0, 0.02, LIGHT, AMBIENT, streams)
    front_end = FrontEnd(rules, camera, tracked(RED, streams))
    return renderer, front_end, front_end.start(renderer.render(0, (), ()))


def test_column_sums():
    mask = np.zeros((4, 5), bool)
    mask[1:, 2] = mask[0, 4] = True
    assert column_sums(mask).tolist() == [0, 0, 3, 0, 1]


def line(*steps):
    return np.repeat(*np.array(steps).T)


def test_ends_lie_between_the_columns():
    # 0 0 0 | 20 20 20 20 | 0 0: columns 3 to 6, whose borders are at 2.5 and 6.5
    assert blobs(line((0, 3), (20, 4), (0, 2)), 6).tolist() == [[2.5, 6.5]]


def test_ends_are_interpolated():
    # half of the step to 20 is passed in the middle between 0 and 20, and a tenth more outside with 4 there
    assert blobs(line((0, 2), (4, 1), (20, 4), (0, 2)), 6).tolist() == [[3.0 - 10.0 / 16.0, 6.5]]
    # a run that begins low is cut at the threshold
    assert blobs(line((0, 2), (8, 1), (20, 3), (0, 2)), 6)[0, 0] == 2.0 - 2.0 / 8.0
    assert blobs(line((0, 2), (6, 3), (0, 2)), 6).tolist() == [[2.0, 4.0]]


def test_blobs_at_the_borders_end_with_the_image():
    assert blobs(line((12, 2), (0, 3), (12, 1)), 6).tolist() == [[-0.5, 1.5], [4.5, 5.5]]
    assert blobs(line((9, 5)), 6).tolist() == [[-0.5, 4.5]]


def test_close_blobs_become_one_and_narrow_ones_none():
    sums = line((0, 2), (15, 3), (0, 1), (12, 2), (0, 4), (20, 1), (0, 2))
    assert blobs(sums, 6).tolist() == [[1.5, 4.5], [5.5, 7.5], [11.5, 12.5]]
    assert blobs(sums, 6, gap_px=1.5).tolist() == [[1.5, 7.5], [11.5, 12.5]]
    assert blobs(sums, 6, width_px=2.0).tolist() == [[1.5, 4.5], [5.5, 7.5]]
    assert blobs(sums, 6, gap_px=100.0, width_px=11.0).tolist() == [[1.5, 12.5]]


def test_blobs_of_any_line_ascend_and_hold_what_reaches_the_threshold(test_seed):
    generator = np.random.default_rng((test_seed, 2))
    for _ in range(300):
        sums = generator.integers(0, 12, generator.integers(1, 40))
        ends = blobs(sums, 6)
        assert (np.diff(ends.ravel()) >= 0.0).all()
        columns = np.arange(len(sums))[:, None]
        inside = ((columns >= ends[:, 0]) & (columns <= ends[:, 1])).any(axis=1)
        assert (inside == (sums >= 6)).all()


def test_no_blobs():
    assert blobs(line((5, 9)), 6).shape == (0, 2)


def test_the_heaviest_run():
    sums = line((0, 1), (14, 2), (0, 2), (50, 1), (0, 1), (16, 2))
    assert heaviest(blobs(sums, 6), sums) == (1, 50.0)
    assert heaviest(blobs(sums, 6, width_px=1.5), sums) == (1, 32.0)
    with pytest.raises(ValueError, match="at least one"):
        heaviest(np.empty((0, 2)), sums)


@pytest.mark.parametrize(
    ("columns", "kept"),
    [
        (((20, 2),), False),  # two outlines side by side,
        (((24, 1), (0, 1), (20, 1)), False),  # or with a column between them that is as the background
        (((24, 1), (0, 1), (20, 3)), True),
        (((20, 3),), True),
        (((30, 3),), False),  # narrow for its height: 3.75 columns are wanted
        (((30, 4),), True),
        (((30, 2), (12, 2)), True),
    ],
)
def test_outlines_are_narrow_for_their_height(columns, kept):
    sums = line((0, 3), *columns, (0, 3))
    runs = blobs(sums, 6, gap_px=2.0)
    assert len(runs) == 1
    assert wide_runs(runs, sums, 6, 0.125).tolist() == (runs.tolist() if kept else [])


def test_wide_runs_keep_their_order():
    sums = line((20, 4), (0, 3), (30, 2), (0, 3), (8, 5))
    runs = blobs(sums, 6)
    assert wide_runs(runs, sums, 6, 0.125).tolist() == [[-0.5, 3.5], [11.75, 16.5]]
    assert wide_runs(blobs(sums, 100), sums, 100, 0.125).shape == (0, 2)


LENSES = [(0.0, 0.0), (-0.25, 0.05), (0.15, 0.05)]


@pytest.mark.parametrize("distortion", LENSES)
@pytest.mark.parametrize("pitch_deg", [-5.0, 0.0, 4.0])
@pytest.mark.parametrize("yaw", [0.0, 2.0, -1.2])
def test_places_are_those_of_the_measurement(yaw, pitch_deg, distortion):
    # what is at the camera's own height lies on the horizon
    camera = level(yaw, np.radians(pitch_deg), distortion)
    scan = ScanCamera((0.0, 0.0), yaw, 320.0, np.radians(50.0))
    turns = yaw + np.radians(np.linspace(-24.0, 24.0, 17))
    points = np.random.default_rng(0).uniform(1.0, 20.0, 17)[:, None] * np.stack(
        [np.cos(turns), np.sin(turns)], 1
    )
    pixels, _ = camera.project(np.column_stack((points, np.full(17, 1.5))))
    # a lens bends the horizon of a tilted camera, by less than a row: its middle row stands for all
    slack = 0.1 if pitch_deg and distortion != (0.0, 0.0) else 1e-6
    np.testing.assert_allclose(line_places(camera, pixels[:, 0]), project(scan, points), atol=slack)


def test_places_of_a_level_pinhole_count_from_the_middle_to_the_left():
    ends = np.array([[-0.5, 10.0], [159.5, 319.5]])
    np.testing.assert_allclose(line_places(level(), ends), 159.5 - ends, atol=1e-9)


def test_no_scan_line_straight_down():
    camera = PinholeCamera.look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), 320.0, SIZE)
    with pytest.raises(ValueError, match="straight down"):
        line_places(camera, np.zeros(1))
    with pytest.raises(ValueError, match="straight down"):
        FrontEnd(RULES, camera, tracked(RED, RandomStreams(0)))


@pytest.mark.parametrize(("depth", "left"), [(1.0, 0.45), (4.0, -1.7), (12.0, 0.0)])
def test_the_middle_of_a_cylinder(depth, left):
    half, turn = asin(0.3 / np.hypot(depth, left)), atan2(left, depth)
    ends = 320.0 * np.tan([turn - half, turn + half])
    assert middle_place(level(), ends) == pytest.approx(320.0 * left / depth, abs=1e-9)


def test_colours_of_the_object_and_of_others():
    streams = RandomStreams(3)
    colours = learned_colours([tracked(RED, streams).portrait(np.array([1.0, 0.0, 0.0]))], RED.semi_axes_m)
    assert colours.shares.sum() == pytest.approx(1.0)
    image = np.zeros((60, 80, 3), np.uint8)
    image[:, :40], image[:, 40:] = (225, 40, 30), (60, 90, 200)
    mask = np.zeros((60, 80), bool)
    mask[10:50, 30:70] = True
    found = object_pixels(colours, image, mask, 0.02, 0.5)
    assert (found == mask & (np.arange(80) < 40)).all()
    assert not object_pixels(colours, image, np.zeros_like(mask), 0.02, 0.5).any()
    # a colour that the object has here and there says nothing where all wear it
    (common,) = np.unique(FEATURES.bin_region(image, (0, 0, 40, 60)).colour)
    rare = replace(colours, shares=np.where(np.arange(FEATURES.colour_bins) == common, 0.1, 0.0))
    assert object_pixels(rare, image, mask, 0.02, 0.5).sum() == 0
    assert object_pixels(rare, image, mask, 0.02, 0.1).sum() == 400


def test_a_red_post_before_a_photograph():
    renderer, front_end, background = eye(level(), RandomStreams(4))
    image = renderer.render(1, (RED,), (standing(RED, 4.0, 0.8),))
    before = image.copy()
    reading, after, work = front_end.read(image, background)
    # each of its sides is told to a column: the middle to a pixel
    assert reading.value_px == pytest.approx(64.0, abs=1.0)
    half = 320.0 * 0.1 / 4.0
    np.testing.assert_allclose(reading.blobs, [[64.0 - half, 64.0 + half]], atol=2.0)
    assert (image == before).all()
    assert after is not background
    pixels = SIZE[0] * SIZE[1]
    assert 20.0 * pixels < work.int_ops < 100.0 * pixels
    assert work.float_ops == 0.0


def test_without_the_object_there_are_blobs_only():
    renderer, front_end, background = eye(level(), RandomStreams(5))
    poses = (standing(BLUE, 4.0, 1.2), standing(BLUE, 6.0, -2.0))
    reading, background, busy = front_end.read(renderer.render(1, (BLUE, BLUE), poses), background)
    assert np.isnan(reading.value_px)
    middles = [middle_place(level(), ends) for ends in reading.blobs]
    np.testing.assert_allclose(middles, [320.0 * -2.0 / 6.0, 320.0 * 1.2 / 4.0], atol=1.0)
    reading, _, idle = front_end.read(renderer.render(2, (), ()), background)
    assert np.isnan(reading.value_px)
    assert reading.blobs.shape == (0, 2)
    # colours are looked up in the foreground only
    assert busy.int_ops > idle.int_ops


def test_a_bent_lens_is_taken_out():
    camera = level(distortion=(-0.25, 0.05))
    renderer, front_end, background = eye(camera, RandomStreams(6))
    poses = (standing(RED, 5.0, 2.2),)
    reading, _, _ = front_end.read(renderer.render(1, (RED,), poses), background)
    # it bends the post too, whose feet are farther from the image's middle: within the read-out's error
    assert reading.value_px == pytest.approx(320.0 * 2.2 / 5.0, abs=2.0)
    pinhole = FrontEnd(RULES, level(), tracked(RED, RandomStreams(6)))
    bent, _, _ = pinhole.read(renderer.render(1, (RED,), poses), background)
    assert abs(bent.value_px - 320.0 * 2.2 / 5.0) > 5.0


def test_reading_is_the_same_again():
    renderer, front_end, background = eye(level(), RandomStreams(7))
    image = renderer.render(1, (RED, BLUE), (standing(RED, 4.0, 0.8), standing(BLUE, 5.0, -1.0)))
    one, other = front_end.read(image, background), front_end.read(image, background)
    assert one[0].value_px == other[0].value_px
    assert (one[0].blobs == other[0].blobs).all()
    assert (one[1].mean == other[1].mean).all()
    assert one[2] == other[2]


def test_an_image_of_another_size_is_refused():
    _, front_end, background = eye(level(), RandomStreams(8))
    with pytest.raises(ValueError, match="background's shape"):
        front_end.read(np.zeros((120, 160, 3), np.uint8), background)


@pytest.mark.parametrize("first", ["as it is", "compressed"])
def test_readings_from_jpeg_files(first):
    renderer, front_end, background = eye(level(), RandomStreams(9))
    if first == "compressed":
        background = front_end.start(opened(compressed(renderer.render(0, (), ()), 75)[0], SIZE))
    poses = (standing(RED, 4.0, 0.8), standing(BLUE, 5.0, -1.0))
    for step in range(1, 6):
        data, work = compressed(renderer.render(step, (RED, BLUE), poses), 75)
        reading, background, _ = front_end.read(opened(data, SIZE), background)
        assert reading.value_px == pytest.approx(64.0, abs=2.0)
        # beside a picture with other rounding there is something more here and there, at the beginning
        assert len(reading.blobs) == 2 or (first == "compressed" and len(reading.blobs) < 10)
    # colours and blocks of every pixel, as counted (38 of them in the references), and the file's bytes
    assert 40.0 < work.int_ops / (SIZE[0] * SIZE[1]) < 60.0


def test_jpeg_files_are_smaller_at_less_quality():
    renderer, _, _ = eye(level(), RandomStreams(10))
    image = renderer.render(1, (), ())
    files = [compressed(image, quality) for quality in (20, 50, 75, 95)]
    for (smaller, less), (larger, more) in pairwise(files):
        assert len(smaller) < len(larger)
        assert less.int_ops < more.int_ops
    data, _ = files[-1]
    assert data[:2] == b"\xff\xd8"
    assert data[-2:] == b"\xff\xd9"
    assert len(data) < image.nbytes / 2
    assert np.abs(opened(data, SIZE).astype(float) - image).mean() < 5.0


def test_jpeg_refusals():
    image = np.zeros((8, 8, 3), np.uint8)
    for quality in (0, 96):
        with pytest.raises(ValueError, match=f"1 to 95, got {quality}"):
            compressed(image, quality)
    with pytest.raises(ValueError, match="uint8"):
        compressed(image[:, :, 0], 75)
    with pytest.raises(DecodeError, match="0 bytes"):
        opened(b"", (8, 8))
    with pytest.raises(DecodeError, match=r"must have \(16, 8\) px, got \(8, 8\)"):
        opened(compressed(image, 75)[0], (16, 8))
