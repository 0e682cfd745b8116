"""Images at the cluster head: each is read once, as soon as it is whole."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.errors import DecodeError
from wsnsim.messages.image_part import parts_of_image
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.systems.scanline.darkroom import Darkroom
from wsnsim.systems.scanline.jpeg import coding_work, compressed

POST = runpy.run_path(str(Path(__file__).parents[1] / "scanline_post.py"))
FILE, _ = compressed(np.full((24, 320, 3), 90, np.uint8), 75)


@pytest.fixture(scope="module")
def deployment(tmp_path_factory):
    file = POST["room"](tmp_path_factory.mktemp("room"))
    loaded = load_scenario(file, ("system.front_end={kind: pixels}", "system.message=jpeg"))
    return loaded.system_params, build(loaded).site


def parts(step, data=FILE, count=3):
    return parts_of_image(step, data, -(-len(data) // count))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (0, 0, 2, 1), (1, 2, 1, 0), (0, 1, 2, 2, 0)])
def test_an_image_is_read_once_however_its_parts_come(deployment, order):
    """In any order, and where a part comes twice: once before all are there, or once more afterwards."""
    darkroom = Darkroom(*deployment)
    taken = [darkroom.take(1, "c1", parts(1)[number]) for number in order]
    whole = max(order.index(number) for number in range(3))
    assert [reading is not None for reading, _ in taken] == [at == whole for at in range(len(order))]
    decoding = coding_work(320 * 24, len(FILE))
    assert taken[whole][1].int_ops > decoding.int_ops
    assert sum(work.int_ops for _, work in taken) == taken[whole][1].int_ops


def test_cameras_and_frames_are_kept_apart(deployment):
    darkroom = Darkroom(*deployment)
    assert all(darkroom.take(1, camera, part)[0] is None for camera in ("c1", "c2") for part in parts(1)[:2])
    assert darkroom.take(1, "c2", parts(1)[2])[0] is not None
    # a later frame takes the place of one that is not whole
    assert [darkroom.take(2, "c1", part)[0] is not None for part in parts(2)] == [False, False, True]
    assert darkroom.take(1, "c1", parts(1)[2])[0] is None


def test_a_damaged_image_is_refused_and_the_next_one_read(deployment):
    darkroom = Darkroom(*deployment)
    for part in parts(1, FILE[:-40])[:2]:
        darkroom.take(1, "c1", part)
    with pytest.raises(DecodeError, match="must be a whole JPEG file"):
        darkroom.take(1, "c1", parts(1, FILE[:-40])[2])
    assert [darkroom.take(2, "c1", part)[0] is not None for part in parts(2)] == [False, False, True]
