"""Several targets at once: one track each, and one message for all of a step. Programs without a network."""

import runpy
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.base import Payload
from wsnsim.messages.batch import BatchPayload, batched, parts_of
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Basis, Belief, GroupKey, Scope, Site, Step
from wsnsim.systems.multiview.base import BaseProgram
from wsnsim.systems.multiview.camera import CameraProgram
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.vision.frame import Frame
from wsnsim.vision.renderer import Renderer
from wsnsim.world.motion import Pose

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, CAMERAS, PAIR = scene.CENTRE, scene.UPRIGHT, scene.CAMERAS, scene.PAIR
at, give = scene.at, scene.give
box = scene.Scene(5)
PLACES = (CENTRE, CENTRE + [0.2, -0.1, 0.95])
"""One above the other, so that neither hides the other from any camera."""
OUT_OF_VIEW = np.array([-30.0, -30.0, 1.0])


def params(**changes: object) -> MultiviewParams:
    said = {"variant": "T2", "particles": 100, "image_particles": 100, "smoothing_scans": 0, "loss": None}
    return scene.params(**{**said, **changes})  # type: ignore[no-any-return]


def site(*places: np.ndarray, cameras: object = PAIR, steps: int = 20) -> Site:
    """Return a deployment with a box at each place."""
    targets = tuple(
        replace(box.target, id=f"box{number}", start=Belief(place, np.zeros(3), UPRIGHT))
        for number, place in enumerate(places or PLACES)
    )
    return Site(cameras, targets, scene.RATE_HZ, steps, box.streams)  # type: ignore[arg-type]


def photograph(node: str, step: int) -> np.ndarray:
    renderer = Renderer(CAMERAS[node], node, scene.GREY, 5.0, 0.02, scene.LIGHT, 0.6, box.streams)
    poses = [Pose(place, np.zeros(3), UPRIGHT) for place in PLACES]
    return renderer.render(step, [box.body, box.body], poses)


def frame(node: str, step: int) -> Frame:
    return Frame(step, step / scene.RATE_HZ, node, partial(photograph, node, step))


def mote(rule: MultiviewParams, there: Site, node: str = "c1") -> CameraProgram:
    return CameraProgram(rule, there, node, box.models() * len(there.targets))


def states(step: int, *places: np.ndarray) -> Payload:
    return batched(
        [
            StatePayload(number, step, place, np.zeros(3), UPRIGHT)
            for number, place in enumerate(places or PLACES)
        ]
    )


def said(target: int, step: int, *cameras: int, similarity: float = 0.9) -> MixturePayload:
    mixture = GaussianMixture.single(np.zeros(3), 0.2 * np.eye(3))
    return MixturePayload(target, step, mixture, cameras, similarity, (np.empty(0),) * len(cameras))


def targets_asked(step: Step) -> list[tuple[int, int]]:
    """Return target and step of every state that goes out, and see to it that it is in one message."""
    if not step.sends:
        return []
    (send,) = step.sends
    assert send.to is Scope.TREE
    parts = parts_of(send.payload)
    assert all(isinstance(part, StatePayload) for part in parts)
    return [(part.target, part.step) for part in parts]  # type: ignore[attr-defined]


def started(rule: MultiviewParams, there: Site) -> BaseProgram:
    base = BaseProgram(rule, there)
    base.on_start(at(0.0))
    return base


# Cameras


@pytest.mark.parametrize("name", ["P", "T0", "T1", "T2", "T3", "T4"])
def test_a_camera_answers_for_all_targets_in_one_message(name: str) -> None:
    rule, there = params(variant=name), site()
    one = mote(rule, there)
    assert give(one, "base", states(1), 0.1).sends == ()
    done = one.on_frame(at(0.25), frame("c1", 1))
    (send,) = done.sends
    assert isinstance(send.payload, BatchPayload)
    assert [(part.target, part.step) for part in send.payload.parts] == [(0, 1), (1, 1)]  # type: ignore[attr-defined]
    assert send.group == (GroupKey(1) if name in ("T2", "T3") else None)
    alone = mote(rule, there)
    give(alone, "base", parts_of(states(1))[1], 0.1)
    (single,) = alone.on_frame(at(0.25), frame("c1", 1)).sends
    # what it says of a target does not depend on the others
    assert single.payload.encode() == send.payload.parts[1].encode()
    assert one.on_payload(at(0.3), SimpleNamespace(source="base", payload=states(1))).sends == ()


def test_states_that_come_one_by_one_are_answered_one_by_one() -> None:
    one = mote(params(), site())
    one.on_frame(at(0.25), frame("c1", 1))
    for number, part in enumerate(parts_of(states(1))):
        (send,) = give(one, "base", part, 0.3).sends
        assert isinstance(send.payload, MixturePayload)
        assert send.payload.target == number
        assert give(one, "base", part, 0.31).sends == ()  # a duplicate is not answered again


def test_a_camera_is_asked_for_each_target_by_itself() -> None:
    one = mote(params(), site())
    give(one, "base", states(1, OUT_OF_VIEW, PLACES[1]), 0.1)
    (send,) = one.on_frame(at(0.25), frame("c1", 1)).sends
    assert isinstance(send.payload, MixturePayload)
    assert send.payload.target == 1


def test_one_target_is_followed_while_another_is_looked_for() -> None:
    one = mote(params(), site())
    give(one, "base", batched([parts_of(states(1))[0], SearchPayload(1, 1)]), 0.1)
    answer, sighting = one.on_frame(at(0.25), frame("c1", 1)).sends
    assert isinstance(answer.payload, MixturePayload)
    assert isinstance(sighting.payload, SightingPayload)
    assert (answer.payload.target, sighting.payload.target) == (0, 1)
    assert (answer.group, sighting.group) == (GroupKey(1), None)
    # boxes look alike: it is either of the two
    pixels, _ = CAMERAS["c1"].project(np.array(PLACES))
    assert np.linalg.norm(pixels - sighting.payload.pixel, axis=1).min() < 8.0


def test_a_frame_that_no_state_came_for_is_told_of_each_target() -> None:
    one = mote(params(), site())
    give(one, "base", parts_of(states(1))[1], 0.1)
    assert one.on_frame(at(0.25), frame("c1", 1)).sends
    notes = one.on_frame(at(0.5), frame("c1", 2)).notes
    assert [(note.kind, note.detail) for note in notes] == [
        ("frame_unused", "frame 1: no state of box0 for it")
    ]
    notes = one.on_frame(at(0.75), frame("c1", 3)).notes
    assert ["box0" in note.detail for note in notes] == [True, False]


# The base station


def test_all_targets_states_go_out_in_one_message() -> None:
    base = BaseProgram(params(), site())
    first = base.on_start(at(0.0))
    assert targets_asked(first) == [(0, 1), (1, 1)]
    assert sorted(timer.key for timer in first.timers) == ["0:1", "1:1"]
    done = give(base, "c1", batched([said(0, 1, 0, 1), said(1, 1, 0, 1)]), 0.3)
    assert [(e.track, e.basis, e.heard) for e in done.estimates] == [
        ("box0", Basis.UPDATE, 2),
        ("box1", Basis.UPDATE, 2),
    ]
    assert targets_asked(done) == [(0, 2), (1, 2)]
    for estimate, place in zip(done.estimates, PLACES, strict=True):
        np.testing.assert_allclose(estimate.belief.position, place, atol=1e-9)


def test_a_state_waits_for_the_other_targets_of_its_step() -> None:
    base = started(params(), site())
    done = give(base, "c1", said(0, 1, 0, 1), 0.3)
    assert len(done.estimates) == 1
    assert done.sends == ()
    (release,) = [timer for timer in done.timers if timer.key.startswith("states")]
    assert release.at == pytest.approx((1 + 0.9) / 4)
    assert give(base, "c1", said(1, 1, 0), 0.35).sends == ()
    done = give(base, "c2", said(1, 1, 1), 0.4)
    assert targets_asked(done) == [(0, 2), (1, 2)]
    # the timer of what has gone already does nothing
    assert base.on_timer(at(release.at), release.key) == Step()


def test_a_state_waits_no_longer_than_to_its_own_frame() -> None:
    """T0's deadline is 1.8 periods: a target that is behind must not hold the others up."""
    base = started(params(deadline_s=1.8 / 4), site())
    done = give(base, "c1", said(0, 1, 0, 1), 0.3)
    (release,) = [timer for timer in done.timers if timer.key.startswith("states")]
    done = base.on_timer(at(release.at), release.key)
    assert targets_asked(done) == [(0, 2)]
    # the other goes on by itself, with the first frame to come after its deadline
    done = base.on_timer(at(2.8 / 4), "1:1")
    assert [(e.track, e.basis) for e in done.estimates] == [
        ("box1", Basis.TIMED_OUT),
        ("box1", Basis.SKIPPED),
    ]
    # and now waits itself, for target 0, whose step 2 is under way
    assert done.sends == ()
    (release,) = [timer for timer in done.timers if timer.key.startswith("states")]
    assert release.at == pytest.approx(2.9 / 4)
    assert targets_asked(base.on_timer(at(release.at), release.key)) == [(1, 3)]


def test_a_payload_that_comes_late_releases_what_was_held_too_long() -> None:
    """However a program is called: what is held goes as soon as its time has come."""
    base = started(params(deadline_s=1.8 / 4), site())
    assert give(base, "c1", said(0, 1, 0, 1), 0.3).sends == ()
    done = give(base, "c1", said(1, 1, 0), 0.48)
    assert targets_asked(done) == [(0, 2)]


def test_a_target_that_is_sought_is_no_obstacle() -> None:
    loss = {"similarity_min": 0.8, "after_s": 0.25, "search": True}
    base = started(params(loss=loss), site())
    give(base, "c1", said(0, 1, 0, 1), 0.3)
    done = give(base, "c1", said(1, 1, 0, 1, similarity=0.1), 0.35)
    assert [note.kind for note in done.notes] == ["track_lost"]
    search, sent = (send.payload for send in done.sends)
    assert search == SearchPayload(1, 2)
    assert isinstance(sent, StatePayload)
    assert (sent.target, sent.step) == (0, 2)
    for step in (2, 3, 4):
        done = give(base, "c1", said(0, step, 0, 1), step / 4 + 0.05)
        assert targets_asked(done) == [(0, step + 1)]
        sought = base.on_timer(at(step / 4 + 0.225), f"1:{step}")
        assert [estimate.basis for estimate in sought.estimates] == [Basis.LOST]
        assert sought.sends == ()


def test_a_target_that_nobody_sees_is_no_obstacle() -> None:
    base = BaseProgram(params(), site(CENTRE, OUT_OF_VIEW))
    timers = {timer.key: timer.at for timer in base.on_start(at(0.0)).timers}
    assert timers == {"0:1": pytest.approx(1.9 / 4), "1:1": pytest.approx(0.25)}
    done = base.on_timer(at(0.25), "1:1")
    assert [estimate.basis for estimate in done.estimates] == [Basis.UNASKED]
    assert done.sends == ()
    done = give(base, "c1", said(0, 1, 0, 1), 0.3)
    assert targets_asked(done) == [(0, 2), (1, 2)]


def test_at_the_deadline_of_all_the_states_go_out_together_however_the_timers_fall() -> None:
    """0.9 periods are the deadline and the latest instant to go on alike."""
    base = started(params(), site())
    steps = [base.on_timer(at(1.9 / 4), key) for key in ("0:1", "1:1")]
    sent = [pair for step in steps for pair in targets_asked(step)]
    assert sorted(sent) == [(0, 2), (1, 2)]
    kinds = [(e.track, e.basis) for step in steps for e in step.estimates]
    assert kinds == [("box0", Basis.TIMED_OUT), ("box1", Basis.TIMED_OUT)]


def test_one_refused_part_does_not_cost_the_others() -> None:
    base = started(params(), site())
    odd = [said(7, 1, 0, 1), said(0, 2, 0, 1), said(1, 1, 0, 1), said(0, 1, 0, 1)]
    done = give(base, "c1", batched(odd), 0.3)
    assert [note.kind for note in done.notes] == ["mixture_refused", "mixture_late"]
    assert sorted(estimate.track for estimate in done.estimates) == ["box0", "box1"]
    assert targets_asked(done) == [(0, 2), (1, 2)]


def test_the_last_step_sends_nothing_more() -> None:
    base = started(params(), site(steps=1))
    assert give(base, "c1", said(0, 1, 0, 1), 0.3).sends == ()
    done = give(base, "c1", said(1, 1, 0, 1), 0.31)
    assert len(done.estimates) == 1
    assert (done.sends, done.timers) == ((), ())
    assert base.on_timer(at(1.9 / 4), "0:1") == Step()


# Both


@pytest.mark.parametrize("name", ["T2", "T4", "P"])
def test_two_targets_are_followed_at_once(name: str) -> None:
    """Each begun 0.15 m beside where it is; errors as of one alone, 0.05 m in the published experiments."""
    aside = np.array([0.1, -0.1, 0.05])
    rule = params(variant=name, particles=300, image_particles=300)
    there = site(*(place + aside for place in PLACES), cameras=CAMERAS)
    base, motes = BaseProgram(rule, there), {node: mote(rule, there, node) for node in CAMERAS}
    done = base.on_start(at(0.0))
    for step in (1, 2):
        (send,) = done.sends
        for node, one in motes.items():
            give(one, "base", send.payload, step / 4 - 0.05)
            (answer,) = one.on_frame(at(step / 4), frame(node, step)).sends
            done = give(base, node, answer.payload, step / 4 + 0.05)
    assert [(e.track, e.heard) for e in done.estimates] == [("box0", 4), ("box1", 4)]
    for estimate, place in zip(done.estimates, PLACES, strict=True):
        assert np.linalg.norm(estimate.belief.position - place) < 0.1
