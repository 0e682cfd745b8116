"""The small things everybody stands on: messages of errors, random streams, the clock's conversions."""

from pathlib import Path

import numpy as np
import pytest

import wsnsim
from wsnsim.errors import Problem, ScenarioError, SimulationError
from wsnsim.rng import RandomStreams
from wsnsim.units import instant_ns, to_ns, to_s


def test_a_problem_says_where_and_what() -> None:
    file = Path("a.yaml")
    assert str(Problem("x.y", "must be 1, got 2", file, 3, 4)) == "a.yaml:3:4: x.y: must be 1, got 2"
    assert str(Problem("x.y", "must be 1, got 2", file)) == "a.yaml: x.y: must be 1, got 2"
    assert str(Problem("", "must be 1, got 2")) == "must be 1, got 2"


def test_errors_carry_all_their_problems_and_places() -> None:
    error = ScenarioError([Problem("a", "one"), Problem("b", "two")])
    assert str(error) == "a: one\nb: two"
    assert str(SimulationError("broke", 1.5, "c1")) == "t = 1.500000 s: node 'c1': broke"


def test_errors_come_back_whole_from_another_process() -> None:
    from pickle import dumps, loads

    error = loads(dumps(ScenarioError([Problem("a", "one", Path("s.yaml"), 3)])))
    assert error.problems == (Problem("a", "one", Path("s.yaml"), 3),)
    failed = loads(dumps(SimulationError("broke", 1.5, "c1")))
    assert (str(failed), failed.time_s, failed.node) == ("t = 1.500000 s: node 'c1': broke", 1.5, "c1")


def test_streams_are_the_documented_generators() -> None:
    """Anybody can make the same numbers: SeedSequence(seed, spawn_key=(crc32(name), ids))."""
    from zlib import crc32

    sequence = np.random.SeedSequence(7, spawn_key=(crc32(b"image"), crc32(b"c1"), 3))
    expected = np.random.default_rng(sequence).random(4)
    np.testing.assert_array_equal(RandomStreams(7).stream("image", "c1", 3).random(4), expected)


def test_streams_do_not_depend_on_each_other() -> None:
    streams = RandomStreams(7)
    first = streams.stream("a", 1).random(3)
    streams.stream("b").random(1000)
    np.testing.assert_array_equal(streams.stream("a", 1).random(3), first)
    others = [streams.stream("a", 2), streams.stream("c", 1), RandomStreams(8).stream("a", 1)]
    assert all(other.random() != first[0] for other in others)


def test_instants_never_accumulate_rounding() -> None:
    assert instant_ns(0.0, 3, 3.0) == 1_000_000_000
    assert instant_ns(0.5, 30_000_000, 30.0) == 1_000_000_500_000_000
    assert to_ns(1e-9) == 1
    assert to_s(1_500_000_000) == 1.5


def test_the_public_names_are_these_and_no_others() -> None:
    assert sorted(wsnsim.__all__) == [
        "OutputError",
        "Run",
        "Scenario",
        "ScenarioError",
        "SimulationError",
        "Sweep",
        "WsnsimError",
        "load",
        "run",
        "sweep",
    ]
    for name in wsnsim.__all__:
        assert getattr(wsnsim, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'runn'"):
        wsnsim.runn  # noqa: B018
