"""The garbage collector leaves alone what was there before a run, and nothing else; then all is as it was."""

import gc
import weakref

import pytest

from wsnsim.sim.collector import only_the_new


class Ring:
    def __init__(self):
        self.itself = self


def test_old_objects_are_left_alone_and_new_garbage_is_found():
    ring = Ring()
    old = weakref.ref(ring)
    with only_the_new():
        assert gc.get_freeze_count() > 0
        new = weakref.ref(Ring())
        del ring
        gc.collect()
        assert new() is None
        assert old() is not None
    assert gc.get_freeze_count() == 0
    gc.collect()
    assert old() is None


def test_what_one_run_has_left_goes_when_the_next_begins():
    left = []
    for _ in range(3):
        with only_the_new():
            left.append(weakref.ref(Ring()))
            assert [ring() is None for ring in left[:-1]] == [True] * (len(left) - 1)


def test_all_is_as_before_after_an_error():
    with pytest.raises(KeyError, match="lost"), only_the_new():
        raise KeyError("lost")
    assert gc.get_freeze_count() == 0


def test_who_froze_objects_keeps_them_frozen():
    with only_the_new():
        frozen = gc.get_freeze_count()
        with only_the_new():
            pass
        assert gc.get_freeze_count() == frozen
