import numpy as np
import pytest

from wsnsim.vision.frame import Frame


def test_image_is_rendered_once_and_only_when_read():
    calls = []

    def render():
        calls.append(1)
        return np.zeros((2, 3, 3), np.uint8)

    frame = Frame(4, 1.0, "c1", render)
    assert not calls
    assert frame.image is frame.image
    assert len(calls) == 1
    assert (frame.step, frame.time, frame.camera) == (4, 1.0, "c1")
    assert repr(frame) == "Frame(step=4, time=1.0, camera='c1')"


def test_image_cannot_be_changed():
    frame = Frame(0, 0.0, "c1", lambda: np.zeros((2, 3, 3), np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        frame.image[0, 0, 0] = 1
