"""What relays make of mixtures that pass them: one message of several; when they wait for more (T2, T3)."""

import runpy
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.batch import BatchPayload, batched, parts_of
from wsnsim.messages.mixture import MixturePayload, mixture_bytes
from wsnsim.messages.numbers import ENCODINGS
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import GroupKey, Received, Site, TrackedTarget
from wsnsim.systems.multiview.camera import CameraProgram
from wsnsim.systems.multiview.joining import disjoint, join
from wsnsim.systems.multiview.mixing import largest_order
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.relay import RelayingCamera, RelayProgram
from wsnsim.systems.multiview.system import SYSTEM

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, CAMERAS, AWAY = scene.CENTRE, scene.UPRIGHT, scene.CAMERAS, scene.AWAY
at, give = scene.at, scene.give
box = scene.Scene(5)
SIX = {**CAMERAS, "c5": scene.camera(3.5, 0.3, 2.4), "away": AWAY}
NAMES = tuple(SIX)


def params(**changes: object) -> MultiviewParams:
    return scene.params(**{"variant": "T2", "particles": 100, **changes})  # type: ignore[no-any-return]


def site(targets: int = 1) -> Site:
    boxes: tuple[TrackedTarget, ...] = tuple(replace(box.target, id=f"box{i}") for i in range(targets))
    return Site(SIX, boxes, scene.RATE_HZ, 20, box.streams)


def said(
    cameras: Sequence[int],
    order: int = 2,
    step: int = 1,
    target: int = 0,
    facing: int = 3,
    seed: int | None = None,
    encoding: str = "float64",
) -> MixturePayload:
    """Return a message of some cameras, each component narrower than the prediction; the same each time."""
    generator = np.random.default_rng((*cameras, target) if seed is None else seed)
    roots = 0.08 * generator.standard_normal((order, 3, 3)) + generator.uniform(
        0.2, 0.5, (order, 1, 1)
    ) * np.eye(3)
    mixture = GaussianMixture(
        generator.standard_normal(order),
        0.5 * generator.standard_normal((order, 3)),
        roots @ roots.transpose(0, 2, 1) + 1e-3 * np.eye(3),
    )
    similarity = float(generator.uniform(0.5, 1.0))
    facings = tuple(generator.uniform(-0.5, 0.5, facing) for _ in cameras)
    return MixturePayload(target, step, mixture, tuple(cameras), similarity, facings, encoding)  # type: ignore[arg-type]


def received(*payloads: Payload) -> list[Received]:
    return [Received(f"n{number}", payload) for number, payload in enumerate(payloads)]


def aggregate(
    parts: Sequence[Received], step: int = 1, targets: int = 1, **changes: object
) -> Payload | None:
    relay = RelayProgram(params(**changes), site(targets), "r1")
    return relay.aggregate(at(0.3), GroupKey(step), parts).payload


def state(step: int = 1, target: int = 0, place: np.ndarray = CENTRE) -> StatePayload:
    return StatePayload(target, step, place, np.zeros(3), UPRIGHT)


def gaussian_product(*parts: MixturePayload) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and covariance of single normal densities multiplied, N(0, I) in them but once."""
    informations = [np.linalg.inv(part.mixture.covs[0]) for part in parts]
    information = sum(informations) - (len(parts) - 1) * np.eye(3)
    pull = sum(inverse @ part.mixture.means[0] for inverse, part in zip(informations, parts, strict=True))
    cov = np.linalg.inv(information)
    return cov @ pull, cov


# Several messages in one


@pytest.mark.parametrize("count", [2, 3, 5])
def test_messages_of_single_components_fuse_as_normal_densities_do(count: int) -> None:
    parts = [said((number,), order=1) for number in range(count)]
    fused = aggregate(received(*parts))
    assert isinstance(fused, MixturePayload)
    mean, cov = gaussian_product(*parts)
    np.testing.assert_allclose(fused.mixture.means, [mean], atol=1e-12)
    np.testing.assert_allclose(fused.mixture.covs, [cov], atol=1e-12)
    assert (fused.target, fused.step) == (0, 1)
    assert fused.cameras == tuple(range(count))
    assert fused.similarity == max(part.similarity for part in parts)
    for facing, part in zip(fused.facings, parts, strict=True):
        np.testing.assert_array_equal(facing, part.facings[0])


def test_facings_stay_with_their_cameras_whatever_the_order() -> None:
    parts = [said((1, 4)), said((0,)), said((2, 3), facing=0)]
    by_camera = {
        camera: facing for part in parts for camera, facing in zip(part.cameras, part.facings, strict=True)
    }
    for order in permutations(parts):
        fused = aggregate(received(*order))
        assert isinstance(fused, MixturePayload)
        assert fused.cameras == (0, 1, 2, 3, 4)
        for camera, facing in zip(fused.cameras, fused.facings, strict=True):
            np.testing.assert_array_equal(facing, by_camera[camera])
        back = decode_any(fused.encode(), SYSTEM.payloads)
        assert isinstance(back, MixturePayload)
        assert [facing.size for facing in back.facings] == [3, 3, 0, 0, 3]


def test_a_single_message_goes_on_unchanged() -> None:
    """Not even reduced or limited: its bytes are what the camera made."""
    for payload in (said((2,), order=4), said((0, 3), order=9)):
        fused = aggregate(received(payload), mixtures={"components": 2})
        assert fused is not None
        assert fused.encode() == payload.encode()


def test_a_duplicate_changes_nothing() -> None:
    parts = [said((0,)), said((3,)), said((1, 4))]
    once = aggregate(received(*parts))
    twice = aggregate(received(*parts, parts[1], parts[2], parts[0]))
    assert once is not None
    assert twice is not None
    assert once.encode() == twice.encode()
    alone = aggregate(received(parts[0], parts[0]))
    assert alone is not None
    assert alone.encode() == parts[0].encode()


def test_of_messages_that_share_a_camera_the_one_of_most_cameras_counts() -> None:
    """No image counts twice; what overlaps is left out whole, for nothing can be taken out of a product."""
    pair, triple, lone, other = said((0, 1)), said((1, 2, 3)), said((4,)), said((0,), seed=9)
    fused = aggregate(received(pair, lone, triple))
    assert isinstance(fused, MixturePayload)
    assert fused.cameras == (1, 2, 3, 4)
    expected = aggregate(received(triple, lone))
    assert expected is not None
    assert fused.encode() == expected.encode()
    fused = aggregate(received(other, lone, triple, pair))
    assert isinstance(fused, MixturePayload)
    assert fused.cameras == (0, 1, 2, 3, 4)


def test_disjoint_messages_share_no_camera_and_every_other_shares_one_with_them(test_seed: int) -> None:
    generator = np.random.default_rng(test_seed)
    for _ in range(100):
        sets = [
            tuple(sorted(generator.choice(6, size=int(generator.integers(1, 5)), replace=False).tolist()))
            for _ in range(int(generator.integers(1, 7)))
        ]
        kept = disjoint([said(cameras, order=1) for cameras in sets])
        numbers = [camera for part in kept for camera in part.cameras]
        assert len(numbers) == len(set(numbers))
        assert all(set(cameras) & set(numbers) for cameras in sets)
        assert max(len(cameras) for cameras in sets) == len(kept[0].cameras)


def test_messages_of_another_step_are_not_in_it() -> None:
    now, before, after = said((0,)), said((1,), step=0), said((2,), step=2)
    fused = aggregate(received(before, now, after))
    assert fused is not None
    assert fused.encode() == now.encode()
    relay = RelayProgram(params(), site(), "r1")
    assert relay.aggregate(at(0.3), GroupKey(1), received(before, after)).payload is None
    ray = RayPayload(0, 1, np.zeros(2), np.array([1.0, 0.0, 1.0]), 0.9)
    assert relay.aggregate(at(0.3), GroupKey(1), received(ray)).payload is None


def test_each_target_is_fused_for_itself_and_all_leave_in_one_message() -> None:
    first = batched([said((0,), target=0), said((0,), target=1)])
    second = batched([said((1,), target=1), said((1,), target=2)])
    alone = said((2,), target=0)
    fused = aggregate(received(first, second, alone), targets=3)
    assert isinstance(fused, BatchPayload)
    heard = {part.target: part.cameras for part in fused.parts}  # type: ignore[attr-defined]
    assert heard == {0: (0, 2), 1: (0, 1), 2: (1,)}
    by_itself = aggregate(received(said((0,), target=1), said((1,), target=1)), targets=3)
    assert by_itself is not None
    assert fused.parts[1].encode() == by_itself.encode()
    assert parts_of(decode_any(fused.encode(), SYSTEM.payloads))[2].encode() == said((1,), target=2).encode()


def test_fusing_costs_work_and_more_for_more() -> None:
    relay = RelayProgram(params(), site(), "r1")
    work = [
        relay.aggregate(at(0.3), GroupKey(1), received(*[said((number,)) for number in range(count)])).work
        for count in (1, 2, 4)
    ]
    assert work[0].float_ops == 0.0
    assert 0.0 < work[1].float_ops < work[2].float_ops


@pytest.mark.parametrize("reduction", ["runnalls", "kmeans", "kmeans_best"])
def test_a_reduced_message_keeps_the_products_mean_and_covariance(reduction: str) -> None:
    parts = [said((number,), order=3) for number in range(2)]
    fused = aggregate(received(*parts), mixtures={"components": 3, "reduction": reduction})
    whole = aggregate(received(*parts), mixtures={"components": 16})
    assert isinstance(fused, MixturePayload)
    assert isinstance(whole, MixturePayload)
    assert (fused.mixture.order, whole.mixture.order) == (3, 9)
    for found, expected in zip(fused.mixture.mean_and_cov(), whole.mixture.mean_and_cov(), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)
    assert fused.mixture.log_mass == pytest.approx(whole.mixture.log_mass, abs=1e-9)
    # the same each time: a relay's draws are named by step, relay and cameras
    again = aggregate(received(*parts), mixtures={"components": 3, "reduction": reduction})
    assert again is not None
    assert again.encode() == fused.encode()


def test_no_number_of_an_argument_is_changed() -> None:
    parts = [said((number,), order=3) for number in range(3)]
    before = [part.encode() for part in parts]
    aggregate(received(*parts), mixtures={"components": 2})
    assert [part.encode() for part in parts] == before


# How large it is


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("limit", [40, 63, 100, 200, 500])
@pytest.mark.parametrize("facing", [0, 3, 4])
def test_no_message_is_larger_than_allowed_unless_one_component_is(
    encoding: str, limit: int, facing: int
) -> None:
    rule = params(
        encoding=encoding,
        orientation={"kind": {0: "initial", 3: "wahba", 4: "average"}[facing]},
        mixtures={"components": 8, "message_bytes": limit},
    )
    for count in (1, 2, 4, 6):
        cameras = tuple(range(count))
        order = largest_order(rule, 3, cameras, facing)
        least = mixture_bytes(1, 3, cameras, facing, rule.encoding)
        size = mixture_bytes(order, 3, cameras, facing, rule.encoding)
        assert size <= limit or (order == 1 and least > limit)
        # and one component more would not have fitted
        assert order == 8 or mixture_bytes(order + 1, 3, cameras, facing, rule.encoding) > limit
        if count > 1:
            parts = [said((number,), order=4, facing=facing, encoding=encoding) for number in cameras]
            payload, _ = join(parts, rule, site(), 1)
            assert payload.mixture.order == order
            assert payload.encoding == encoding
            assert len(payload.encode()) == size


@pytest.mark.parametrize("name", ["T1", "T4"])
def test_cameras_keep_to_the_size_of_a_message(name: str) -> None:
    """Log ratios and `argmin` want all eight components; 200 bytes hold two in space, three in an image."""
    rule = params(
        variant=name,
        image_particles=200,
        particles=200,
        likelihood={"kind": "log_ratio"},
        mixtures={"components": 8, "order": "argmin", "message_bytes": 202},
    )
    there = Site(CAMERAS, (box.target,), scene.RATE_HZ, 20, box.streams)
    mote = CameraProgram(rule, there, "c1", box.models())
    give(mote, "base", state(), 0.1)
    (send,) = mote.on_frame(at(0.25), box.frame("c1", 1, photo=True)).sends
    dimension = 2 if name == "T4" else 3
    largest = largest_order(rule, dimension, (0,), 3)
    assert largest == (3 if name == "T4" else 2)
    assert 1 <= send.payload.mixture.order <= largest
    assert len(send.payload.encode()) <= 202


# When to wait


def test_a_relay_waits_for_the_cameras_below_that_were_asked() -> None:
    relay = RelayProgram(params(), site(), "r1")
    below = frozenset({"r1", "c1", "c2", "away"})
    give(relay, "base", state(), 0.1)
    group = GroupKey(1)
    assert relay.awaits(group, (), below)
    assert relay.awaits(group, received(said((0,))), below)
    # the camera that looks away was not asked, c3 is elsewhere
    assert not relay.awaits(group, received(said((0,)), said((1,))), below)
    assert not relay.awaits(group, received(said((0, 1))), below)
    assert relay.awaits(group, received(said((0, 2))), below)
    assert relay.awaits(group, received(said((0,)), said((0,))), below)
    assert not relay.awaits(group, received(batched([said((0,)), said((1,), target=0)])), below)


def test_without_the_states_a_relay_waits_for_its_time() -> None:
    relay = RelayProgram(params(), site(), "r1")
    below = frozenset({"r1", "c1", "c2"})
    everyone = received(*[said((number,)) for number in range(5)])
    assert relay.awaits(GroupKey(1), everyone, below)
    give(relay, "base", state(step=1), 0.1)
    assert not relay.awaits(GroupKey(1), everyone, below)
    # the states of one step tell nothing of another
    assert relay.awaits(GroupKey(2), everyone, below)


def test_a_relay_below_which_nobody_was_asked_does_not_wait() -> None:
    """What comes to it all the same, from a camera that heard another state, goes on at once."""
    relay = RelayProgram(params(), site(), "r1")
    give(relay, "base", state(), 0.1)
    assert not relay.awaits(GroupKey(1), received(said((5,))), frozenset({"r1", "away"}))


def test_a_camera_that_no_other_is_behind_need_not_wait() -> None:
    mote = RelayingCamera(params(), site(), "c1", box.models())
    assert not mote.awaits(GroupKey(1), received(said((0,))), frozenset({"c1"}))
    assert mote.awaits(GroupKey(1), received(said((0,))), frozenset({"c1", "c2"}))


def test_a_camera_that_relays_waits_for_its_own_answer_too() -> None:
    mote = RelayingCamera(params(), site(), "c1", box.models())
    below = frozenset({"c1", "c2"})
    assert give(mote, "base", state(), 0.1).sends == ()
    assert mote.awaits(GroupKey(1), received(said((1,))), below)
    (send,) = mote.on_frame(at(0.25), box.frame("c1", 1)).sends
    assert send.group == GroupKey(1)
    parts = received(said((1,)), send.payload)
    assert not mote.awaits(GroupKey(1), parts, below)
    made = mote.aggregate(at(0.3), GroupKey(1), parts)
    assert isinstance(made.payload, MixturePayload)
    assert made.payload.cameras == (0, 1)
    assert made.work.float_ops > 0.0


def test_states_of_one_step_may_come_in_two_messages() -> None:
    """The second tells of cameras that the first has not asked, though the relay was asked in between."""
    elsewhere = CENTRE + [-1.9, 1.9, 0.0]
    rule = params(participation={"kind": "point"})
    relay = RelayProgram(rule, site(targets=2), "r1")
    below = frozenset({"r1", "c1", "c2"})
    give(relay, "base", state(place=elsewhere), 0.1)  # only c2 has it in view
    assert relay.awaits(GroupKey(1), received(said((0,))), below)
    assert not relay.awaits(GroupKey(1), received(said((1,))), below)
    give(relay, "base", state(target=1), 0.15)  # c1 and c2
    assert relay.awaits(GroupKey(1), received(said((1,))), below)
    # an answer on the first target is none on the second
    assert relay.awaits(GroupKey(1), received(said((0, 1))), below)
    assert not relay.awaits(GroupKey(1), received(said((1,)), said((0, 1), target=1)), below)


def test_asking_whether_to_wait_changes_nothing() -> None:
    parts = received(said((0,)), said((1,)))
    asked, other = RelayProgram(params(), site(), "r1"), RelayProgram(params(), site(), "r1")
    for relay in (asked, other):
        give(relay, "base", state(), 0.1)
    below = frozenset({"r1", "c1", "c2"})
    for _ in range(3):
        assert not asked.awaits(GroupKey(1), parts, below)
    mine, others = (relay.aggregate(at(0.3), GroupKey(1), parts) for relay in (asked, other))
    assert mine.payload is not None
    assert others.payload is not None
    assert mine.payload.encode() == others.payload.encode()


def test_a_state_of_a_target_that_does_not_exist_is_no_state() -> None:
    relay = RelayProgram(params(), site(), "r1")
    give(relay, "base", state(target=3), 0.1)
    assert relay.awaits(GroupKey(1), received(said((0, 1, 2, 3, 4))), frozenset({"r1", "c1"}))


@pytest.mark.parametrize("deadline", [None, 0.2, 1.0])
def test_messages_are_due_when_the_base_station_wants_them(deadline: float | None) -> None:
    relay = RelayProgram(params(deadline_s=deadline), site(), "r1")
    wait = 0.9 / 4 if deadline is None else deadline
    assert relay.due(GroupKey(3)) == pytest.approx(0.75 + wait)
    mote = RelayingCamera(params(deadline_s=deadline), site(), "c1", box.models())
    assert mote.due(GroupKey(3)) == relay.due(GroupKey(3))


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize(("kind", "facing"), [("wahba", 3), ("average", 4), ("initial", 0)])
def test_the_usual_message_is_as_large_as_one_of_three_cameras(encoding: str, kind: str, facing: int) -> None:
    rule = params(encoding=encoding, orientation={"kind": kind}, mixtures={"components": 4})
    size, work = RelayProgram(rule, site(), "r1").usual()
    parts = [said((number,), order=4, facing=facing) for number in (3, 4, 5)]
    payload, cost = join(parts[:2], rule, site(), 1)
    payload, _ = join(parts, rule, site(), 1)
    assert payload.mixture.order == 4
    assert size == len(payload.encode())
    assert work == cost
    assert RelayingCamera(rule, site(), "c1", box.models()).usual() == (size, work)


# What nobody should have sent


def test_a_relay_survives_what_no_camera_of_its_tracker_says() -> None:
    """Another target, dimension, camera or facing: nothing may stop a relay, or spoil what the base gets."""
    flat = MixturePayload(
        0, 1, GaussianMixture.single(np.zeros(2), np.eye(2) * 0.3), (3,), 0.9, (np.empty(0),)
    )
    for odd in (flat, said((4,), facing=4), said((200,)), said((2,), target=7)):
        parts = received(said((0,)), said((1,)), odd)
        made = RelayProgram(params(), site(), "r1").aggregate(at(0.3), GroupKey(1), parts)
        assert made.payload is not None
        back = parts_of(decode_any(made.payload.encode(), SYSTEM.payloads))
        (kept,) = [part for part in back if isinstance(part, MixturePayload) and part.target == 0]
        assert {0, 1} <= set(kept.cameras) < set(range(len(SIX)))
