"""Scan lines from rendered pixels against Eqs. 1 and 2 (Ercan, El Gamal & Guibas 2007).

Posts of .1 m radius among people of .33 m, one camera at 1.5 m that looks horizontally, before photographs.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import IDENTITY
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.sightlines import disc_masks
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Belief, TrackedTarget
from wsnsim.systems.scanline.front_end import FrontEnd
from wsnsim.systems.scanline.measurement import ScanCamera, camera_rows, project
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.vision.photos import load_background
from wsnsim.vision.portrait import Studio
from wsnsim.vision.renderer import Renderer
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

FOCAL, SIZE = 320.0, (320, 240)
READ_SD = 2.0
THIN, WIDE = 0.1, 0.33
SCAN = ScanCamera((0.0, 0.0), 0.0, FOCAL, 2.0 * np.arctan(0.5))
CAMERA = PinholeCamera.at_angles((0.0, 0.0, 1.5), 0.0, 0.0, 0.0, FOCAL, SIZE)
LIGHT, AMBIENT = np.array([0.3, 0.2, 0.93]) / np.linalg.norm([0.3, 0.2, 0.93]), 0.5
OBJECT_COLOURS = [(230, 40, 30), (240, 200, 40), (220, 40, 200)]
CLOTHES = [
    [(60, 90, 200)],
    [(40, 140, 70)],
    [(120, 120, 125)],
    [(40, 40, 45)],
    [(60, 170, 180), (30, 60, 120)],
    [(225, 225, 220)],
    [(110, 80, 60)],
    [(90, 60, 150)],
]
"""Dark, pale, grey, of one colour and of two; none of the object's."""


def cylinder(radius, height, colours, generator):
    centres = generator.standard_normal((12, 3))
    centres /= np.linalg.norm(centres, axis=1, keepdims=True)
    texture = PatchTexture(centres, np.array([colours[k % len(colours)] for k in range(12)], float))
    return Body(np.array([radius, radius, height / 2.0]), texture, "cylinder")


def upright(body, place, turn):
    quaternion = np.array([np.cos(turn / 2.0), 0.0, 0.0, np.sin(turn / 2.0)])
    return Pose(np.append(place, body.semi_axes_m[2]), np.zeros(3), quaternion)


class Seen(NamedTuple):
    """One frame: the reading, and the floor plan that it shows."""

    reading: object
    place: np.ndarray
    people: np.ndarray


@cache
def frames(photo, count, crowd):
    """Return readings of the object at many places, among so many people, none of them touching."""
    streams = RandomStreams(21)
    draws = streams.stream("places")
    target = cylinder(THIN, 1.8, OBJECT_COLOURS, streams.stream("object"))
    people = [cylinder(WIDE, 1.75, CLOTHES[k], streams.stream("clothes", k)) for k in range(crowd)]
    renderer = Renderer(CAMERA, "c1", load_background(photo, SIZE), 5.0, 0.02, LIGHT, AMBIENT, streams)
    studio = Studio(target, IDENTITY, LIGHT, AMBIENT, FOCAL, SIZE, 2.5, 5.0, streams, "object")
    start = Belief(np.zeros(3), np.zeros(3), IDENTITY)
    tracked = TrackedTarget("object", target.semi_axes_m, start, studio.portrait)
    front_end = FrontEnd(PixelFrontEnd(kind="pixels"), CAMERA, tracked)
    background = front_end.start(renderer.render(0, (), ()))
    result = []
    while len(result) < count:
        depths = draws.uniform(2.0, 14.0, 1 + crowd)
        places = np.stack([depths, draws.uniform(-0.45, 0.45, 1 + crowd) * depths], axis=1)
        radii = np.array([THIN] + crowd * [WIDE])
        gaps = np.hypot(*(places[:, None] - places).T) - radii[:, None] - radii
        turns = draws.uniform(0.0, 2.0 * np.pi, 1 + crowd)
        if (gaps[~np.eye(1 + crowd, dtype=bool)] < 0.02).any():
            continue
        bodies = (target, *people)
        poses = tuple(
            upright(body, place, turn) for body, place, turn in zip(bodies, places, turns, strict=True)
        )
        reading, background, _ = front_end.read(renderer.render(len(result) + 1, bodies, poses), background)
        result.append(Seen(reading, places[0], places[1:]))
    return result


def outline(place, radius):
    """Return the ends of a cylinder in the scan line, ascending."""
    turn, half = np.arctan2(place[1], place[0]), np.arcsin(radius / np.hypot(*place))
    return FOCAL * np.tan(np.clip([turn - half, turn + half], -np.arctan(0.5), np.arctan(0.5)))


def errors(seen):
    return np.array([each.reading.value_px - project(SCAN, each.place) for each in seen])


@pytest.mark.parametrize("photo", ["photo/coffee", "photo/gravel"])
def test_an_object_in_the_open_is_read_within_the_models_own_variance(photo):
    seen = frames(photo, 100, 0)
    z = errors(seen) / READ_SD
    assert not np.isnan(z).any()
    assert abs(z.mean()) < 3.0 / np.sqrt(len(z))
    assert (z**2).sum() < chi2.ppf(0.95, len(z))
    # an end is told to its column, or to the next one where colours mix at the edge: uniform over ± 1 px
    # at the worst, so that the mean of both has a variance of 1/3 · 2/4
    assert (6.0 * (READ_SD * z) ** 2).sum() < chi2.ppf(0.9999, len(z))


@pytest.mark.parametrize("photo", ["photo/coffee", "photo/flower"])
def test_hidden_is_what_the_measurement_says_is_hidden(photo):
    agreed, unambiguous, visible = 0, 0, []
    for each in frames(photo, 50, 8):
        low, high = outline(each.place, THIN)
        near = each.people[np.hypot(*each.people.T) < np.hypot(*each.place)]
        sides = np.array([outline(person, WIDE) for person in near]).reshape(-1, 2)
        clear = ((sides[:, 1] < low - 1.0) | (sides[:, 0] > high + 1.0)).all()
        gone = ((sides[:, 0] < low - 1.0) & (sides[:, 1] > high + 1.0)).any()
        centres, rows = frozen(each.people, np.float64), camera_rows([SCAN])
        hidden = bool(disc_masks(frozen(each.place[None], np.float64), rows, centres, WIDE)[0])
        if clear:
            visible.append(each)
        if clear or gone:
            assert hidden == gone
            unambiguous += 1
            agreed += np.isnan(each.reading.value_px) == hidden
    assert unambiguous >= 35
    assert agreed >= 0.95 * unambiguous
    z = errors(visible) / READ_SD
    z = z[~np.isnan(z)]
    assert len(z) >= 15
    assert (z**2).sum() < chi2.ppf(0.95, len(z))


@pytest.mark.parametrize("photo", ["photo/coffee", "photo/flower"])
def test_blobs_end_where_cylinders_do(photo):
    compared, close = 0, 0
    for each in frames(photo, 50, 8):
        ends = [outline(each.place, THIN), *(outline(person, WIDE) for person in each.people)]
        merged = []
        for low, high in sorted(map(tuple, ends)):
            if merged and low <= merged[-1][1]:
                merged[-1][1] = max(high, merged[-1][1])
            else:
                merged.append([low, high])
        wanted = np.array(merged)
        # blobs that nearly touch may be read as one
        if (wanted[1:, 0] - wanted[:-1, 1] < 4.0).any():
            continue
        assert len(each.reading.blobs) == len(wanted)
        off = np.abs(each.reading.blobs - wanted)
        compared += off.size
        close += np.count_nonzero(off <= 2.0)
    assert compared >= 100
    assert close >= 0.99 * compared
