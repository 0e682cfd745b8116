"""What trackers P and T1 to T4 refuse at the base station, and what cannot stop it: no message, whatever."""

import runpy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.errors import DecodeError
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.numbers import ENCODINGS
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import GroupKey, Received, Site, Step
from wsnsim.systems.multiview.base import BaseProgram
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.relay import RelayProgram
from wsnsim.systems.multiview.system import SYSTEM
from wsnsim.systems.multiview.variants import variant

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, CAMERAS, AWAY = scene.CENTRE, scene.UPRIGHT, scene.CAMERAS, scene.AWAY
at, give = scene.at, scene.give
box = scene.Scene(5)

SAID = {
    "P": RayPayload,
    "T0": WeightsPayload,
    "T1": MixturePayload,
    "T2": MixturePayload,
    "T3": MixturePayload,
    "T4": MixturePayload,
}
DIMENSIONS = {"T1": 3, "T2": 3, "T3": 3, "T4": 2}
NEW = ("P", "T1", "T2", "T3", "T4")


def params(name: str, **changes: object) -> MultiviewParams:
    return scene.params(  # type: ignore[no-any-return]
        **{"variant": name, "image_particles": 150, "particles": 150, "smoothing_scans": 0, **changes}
    )


def site(cameras: dict[str, PinholeCamera] = CAMERAS) -> Site:
    return Site(cameras, (box.target,), scene.RATE_HZ, 20, box.streams)


def one(dimension: int, cameras: tuple[int, ...], step: int = 1, target: int = 0) -> MixturePayload:
    mixture = GaussianMixture.single(np.zeros(dimension), 0.3 * np.eye(dimension))
    return MixturePayload(target, step, mixture, cameras, 0.9, (np.empty(0),) * len(cameras))


def a_ray(step: int = 1) -> RayPayload:
    return RayPayload(0, step, np.array([160.0, 120.0]), np.array([2.0, 0.0, 2.0]), 0.9)


def some_weights(step: int = 1) -> WeightsPayload:
    return WeightsPayload(0, step, np.ones(150))


@pytest.mark.parametrize("name", NEW)
def test_what_belongs_to_another_tracker_is_refused(name: str) -> None:
    base = BaseProgram(params(name), site())
    base.on_start(at(0.0))
    wrong: list[Payload] = [some_weights()]
    wrong += [one(3, (0,)), one(2, (0,))] if name == "P" else [a_ray(), one(5 - DIMENSIONS[name], (0,))]
    for payload in wrong:
        done = give(base, "c1", payload, 0.3)
        assert [note.kind for note in done.notes] == [f"{payload.kind}_refused"]
        assert (done.estimates, done.sends) == ((), ())
    assert base._tracks[0].reports == []  # type: ignore[union-attr]


@pytest.mark.parametrize("name", ["T1", "T2", "T3", "T4"])
def test_mixtures_of_cameras_that_are_none_or_were_not_asked_or_are_heard_are_refused(name: str) -> None:
    base = BaseProgram(params(name), site({**CAMERAS, "away": AWAY}))
    base.on_start(at(0.0))
    size = DIMENSIONS[name]
    for payload, kind, why in (
        (one(size, (5,)), "mixture_refused", "camera 5: is no camera"),
        (one(size, (255,)), "mixture_refused", "camera 255: is no camera"),
        (one(size, (4,)), "mixture_refused", "away: was not asked at step 1"),
        (one(size, (0,), step=2), "mixture_late", "step 2 came during step 1"),
        (one(size, (0,), target=1), "mixture_refused", "no target 1"),
    ):
        done = give(base, "c1", payload, 0.3)
        assert [note.kind for note in done.notes] == [kind]
        assert why in done.notes[0].detail
        assert done.estimates == ()
    assert give(base, "c1", one(size, (0,)), 0.3) == Step()
    again = give(base, "c1", one(size, (0,)), 0.3)
    assert [note.kind for note in again.notes] == ["mixture_refused"]
    assert "c1: heard already" in again.notes[0].detail
    if name in ("T2", "T3"):
        overlapping = give(base, "c2", one(size, (0, 1, 2)), 0.3)
        assert "heard already" in overlapping.notes[0].detail
        assert len(give(base, "c2", one(size, (1, 2, 3)), 0.3).estimates) == 1
    else:
        for number, node in enumerate(("c2", "c3"), start=1):
            assert give(base, node, one(size, (number,)), 0.3) == Step()
        assert [estimate.heard for estimate in give(base, "c4", one(size, (3,)), 0.3).estimates] == [4]


@pytest.mark.parametrize("name", ["T1", "T4"])
def test_a_mixture_of_several_cameras_is_none_of_a_tracker_that_fuses_nothing_on_the_way(name: str) -> None:
    """In an image it would be a density of no camera's pixels."""
    base = BaseProgram(params(name), site())
    base.on_start(at(0.0))
    done = give(base, "c1", one(DIMENSIONS[name], (0, 1, 2, 3)), 0.3)
    if name == "T4":
        assert [note.kind for note in done.notes] == ["mixture_refused"]
    assert all(np.isfinite(estimate.belief.position).all() for estimate in done.estimates)


def sound(name: str, rng: np.random.Generator, number: int, encoding: str) -> Payload:
    """Return what camera `number` might say in the way of a tracker, or a message of the base station."""
    if name == "P":
        spread = np.array([rng.uniform(0.5, 9.0), rng.normal(), rng.uniform(0.5, 9.0)])
        return RayPayload(0, 1, rng.uniform(0.0, 240.0, 2), spread, 0.9, encoding)  # type: ignore[arg-type]
    if name == "T0":
        return WeightsPayload(0, 1, np.exp(-25.0 * rng.random(150)), 0.9, np.empty(0), encoding)  # type: ignore[arg-type]
    if name == "state":
        return StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT, encoding=encoding)  # type: ignore[arg-type]
    if name == "search":
        return SearchPayload(0, 1)
    if name == "sighting":
        return SightingPayload(0, 1, rng.uniform(0.0, 240.0, 2), 4.0, 0.9, encoding)  # type: ignore[arg-type]
    size, order = DIMENSIONS[name], int(rng.integers(1, 4))
    roots = 0.1 * rng.standard_normal((order, size, size)) + rng.uniform(0.2, 0.9, (order, 1, 1)) * np.eye(
        size
    )
    mixture = GaussianMixture(
        rng.standard_normal(order), rng.standard_normal((order, size)), roots @ roots.transpose(0, 2, 1)
    )
    facing = rng.uniform(-0.5, 0.5, 3)
    return MixturePayload(0, 1, mixture, (number,), 0.9, (facing,), encoding)  # type: ignore[arg-type]


def flipped(payload: Payload, flips: list[tuple[int, int]]) -> Payload | None:
    """Return what arrives of a message some of whose bits were flipped; None where it does not decode."""
    data = bytearray(payload.encode())
    for place, bit in flips:
        data[place % len(data)] ^= 1 << bit
    try:
        with np.errstate(invalid="ignore"):
            return decode_any(bytes(data), SYSTEM.payloads)
    except DecodeError:
        return None


def finite(done: Step) -> None:
    """Hold what a step says against what nodes can use: finite numbers, messages that can be sent."""
    for estimate in done.estimates:
        assert np.isfinite(estimate.belief.position).all()
        assert np.linalg.eigvalsh(estimate.cov).min() > 0.0
    for send in done.sends:
        send.payload.encode()


KINDS = [*SAID, "state", "search", "sighting"]
FLIPS = st.lists(st.tuples(st.integers(0, 400), st.integers(0, 7)), max_size=2)


@settings(max_examples=80, deadline=None)
@given(
    name=st.sampled_from(list(SAID)),
    encoding=st.sampled_from(ENCODINGS),
    flips=st.lists(FLIPS, min_size=4, max_size=4),
    odd=st.tuples(st.sampled_from(KINDS), st.integers(0, 5), FLIPS),
    relayed=st.booleans(),
    seed=st.integers(0, 10**6),
)
def test_no_message_whatever_stops_the_base_station(
    name: str,
    encoding: str,
    flips: list[list[tuple[int, int]]],
    odd: tuple[str, int, list[tuple[int, int]]],
    relayed: bool,
    seed: int,
) -> None:
    """Messages of any type, with flipped bits: the step ends in finite estimates, and the next one begins."""
    rng, there = np.random.default_rng(seed), site({**CAMERAS, "away": AWAY})
    rule = params(name, encoding=encoding)
    base = BaseProgram(rule, there)
    base.on_start(at(0.0))
    arriving = [flipped(sound(name, rng, number, encoding), some) for number, some in enumerate(flips)]
    kind, place, some = odd
    arriving.insert(place, flipped(sound(kind, rng, place, encoding), some))
    parts = [
        Received(f"c{number % 4 + 1}", payload)
        for number, payload in enumerate(arriving)
        if payload is not None
    ]
    if relayed and variant(name).fused_on_the_way and parts:
        relay = RelayProgram(rule, there, "r")
        made = relay.aggregate(at(0.3), GroupKey(1), parts).payload
        parts = [] if made is None else [Received("r", decode_any(made.encode(), SYSTEM.payloads))]
    for part in parts:
        finite(base.on_payload(at(0.3), part))
    done = base.on_timer(at(0.475), "0:1")
    finite(done)
    assert base._tracks[0].step == 2


@pytest.mark.parametrize(("kind", "size"), [("wahba", 4), ("average", 3), ("initial", 3)])
@pytest.mark.parametrize("name", ["T0", "T1"])
def test_a_facing_that_is_not_of_the_rules_kind_says_nothing(name: str, kind: str, size: int) -> None:
    """A direction where quaternions are averaged, or the other way round."""
    rule = params(name, orientation={"kind": kind})
    base = BaseProgram(rule, site())
    base.on_start(at(0.0))
    for number, node in enumerate(CAMERAS):
        facing = np.full(size, 0.5)
        payload: Payload = replace(some_weights(), facing=facing)
        if name == "T1":
            payload = replace(one(3, (number,)), facings=(facing,))
        done = give(base, node, payload, 0.3)
    (estimate,) = done.estimates
    np.testing.assert_allclose(estimate.belief.orientation, UPRIGHT, atol=1e-12)


def test_a_truncated_answer_does_not_decode() -> None:
    data = one(3, (0,)).encode()
    for size in range(len(data)):
        with pytest.raises(DecodeError):
            decode_any(data[:size], SYSTEM.payloads)
