"""Tracks that are given up, targets looked for and tracks that begin: programs without a network."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pydantic import ValidationError

from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import Basis, Scope, Step
from wsnsim.systems.multiview.base import BaseProgram
from wsnsim.systems.multiview.camera import CameraProgram
from wsnsim.systems.multiview.params import MultiviewParams

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, PAIR, AWAY = scene.CENTRE, scene.UPRIGHT, scene.PAIR, scene.AWAY
at, give = scene.at, scene.give
box = scene.Scene(5)
M = 60


def params(**changes: object) -> MultiviewParams:
    """Return parameters of a tracker that gives up after 1 s; `loss` changes parts of that, or is None."""
    loss = {"similarity_min": 0.8, "after_s": 1.0, "sighting_min": 0.9, "cameras_min": 2}
    said = changes.pop("loss", {})
    merged = said if said is None else {**loss, **said}  # type: ignore[dict-item]
    return scene.params(**{"particles": M, "loss": merged, **changes})  # type: ignore[no-any-return]


def weights(step: int, similarity: float) -> WeightsPayload:
    return WeightsPayload(0, step, np.ones(M), similarity)


def sighting(node: str, step: int, place: np.ndarray = CENTRE, similarity: float = 0.95) -> SightingPayload:
    camera = scene.CAMERAS[node]
    (pixel,), _ = camera.project(place[None])
    return SightingPayload(0, step, pixel, float(np.linalg.norm(place - camera.position)), similarity)


def payloads(step: Step) -> list[object]:
    return [send.payload for send in step.sends]


def measured(base: BaseProgram, step: int, similarities: tuple[float, float]) -> Step:
    """Let both cameras answer a step with these similarities."""
    now = step / 4 + 0.05
    assert give(base, "c1", weights(step, similarities[0]), now).estimates == ()
    return give(base, "c2", weights(step, similarities[1]), now)


def started(steps: int = 40, **changes: object) -> BaseProgram:
    base = BaseProgram(params(**changes), box.site(steps=steps))
    base.on_start(at(0.0))
    return base


def lost(step: Step) -> bool:
    return "track_lost" in [note.kind for note in step.notes]


def given_up(**changes: object) -> tuple[BaseProgram, Step]:
    """Return a base station that has just given its track up, after step 4."""
    base = started(**changes)
    for step in range(1, 5):
        last = measured(base, step, (0.3, 0.3))
    return base, last


def test_a_track_without_images_that_bear_it_out_is_given_up_after_the_time_asked_for() -> None:
    """1 s at 4 Hz: the fourth bad step. The best camera decides whether a step is bad."""
    base = started()
    for step in range(1, 9):
        assert not lost(measured(base, step, (0.79, 0.1) if step % 4 else (0.81, 0.1)))
    for step in range(9, 12):
        assert not lost(measured(base, step, (0.79, 0.79)))
    last = measured(base, 12, (0.79, 0.79))
    assert lost(last)
    assert "box" in last.notes[0].detail
    assert "1 s" in last.notes[0].detail
    (send,) = last.sends
    assert send.to is Scope.TREE
    assert send.payload == SearchPayload(0, 13)
    (timer,) = last.timers
    assert 13 / 4 < timer.at < 14 / 4


def test_a_higher_bar_and_a_longer_patience_are_what_the_parameters_say() -> None:
    base = started(loss={"similarity_min": 0.2, "after_s": 0.25})
    assert not lost(measured(base, 1, (0.1, 0.21)))
    assert lost(measured(base, 2, (0.1, 0.19)))


def test_loss_null_never_declares() -> None:
    base = started(loss=None, steps=30)
    for step in range(1, 31):
        done = measured(base, step, (0.0, 0.0))
        assert not done.notes
        assert Basis.LOST not in [estimate.basis for estimate in done.estimates]


def test_without_search_a_loss_is_declared_once_and_the_track_goes_on() -> None:
    base = started(loss={"search": False})
    declared = []
    for step in range(1, 13):
        done = measured(base, step, (0.3, 0.3))
        assert [type(payload) for payload in payloads(done)] == [StatePayload]
        declared.append(lost(done))
    assert declared == [False] * 3 + [True] + [False] * 8
    assert not lost(measured(base, 13, (0.9, 0.3)))
    assert [lost(measured(base, step, (0.3, 0.3))) for step in range(14, 18)] == [False] * 3 + [True]


def test_what_is_left_of_a_lost_track_is_smoothed() -> None:
    _, last = given_up(smoothing_scans=10)
    smoothed = [estimate.time for estimate in last.estimates if estimate.basis is Basis.SMOOTHED]
    assert smoothed == [0.25, 0.5, 0.75, 1.0]


def test_while_it_is_looked_for_a_lost_target_stays_where_it_was_last() -> None:
    base, last = given_up(smoothing_scans=0)
    (update,) = last.estimates
    timer = last.timers[0]
    times, places = [], []
    for _ in range(6):
        done = base.on_timer(at(timer.at), timer.key)
        (held,) = done.estimates
        assert (held.basis, held.asked, held.heard) == (Basis.LOST, 0, 0)
        times.append(held.time)
        places.append(held.belief.position)
        (timer,) = done.timers
    np.testing.assert_allclose(times, np.arange(5, 11) / 4)
    # where the filter had it, with one camera's worth of disagreement between weights and filter at most
    assert np.ptp(places, axis=0).max() == 0.0
    assert np.linalg.norm(places[0] - update.belief.position) < 0.5


def test_the_cameras_are_told_again_every_second() -> None:
    """A search may be lost on its way."""
    base, last = given_up()
    timer, told = last.timers[0], []
    for _ in range(12):
        done = base.on_timer(at(timer.at), timer.key)
        told += [(timer.at, payload.step) for payload in payloads(done)]  # type: ignore[attr-defined]
        (timer,) = done.timers
    assert [step for _, step in told] == [9, 13, 17]
    np.testing.assert_allclose(np.diff([when for when, _ in told]), 1.0)


def test_sightings_that_meet_twice_begin_a_track() -> None:
    """The first meeting tells the place, the second the velocity."""
    base, last = given_up(smoothing_scans=0)
    timer, place, moved = last.timers[0], CENTRE + [0.5, -0.4, 0.2], np.array([0.2, 0.1, 0.0])
    for node in PAIR:
        assert give(base, node, sighting(node, 5, place), 1.3) == Step()
    first = base.on_timer(at(timer.at), timer.key)
    assert first.notes == ()
    assert [estimate.basis for estimate in first.estimates] == [Basis.LOST]
    for node in PAIR:
        assert give(base, node, sighting(node, 6, place + moved), 1.6) == Step()
    (timer,) = first.timers
    done = base.on_timer(at(timer.at), timer.key)
    assert [note.kind for note in done.notes] == ["track_started"]
    assert "c1, c2" in done.notes[0].detail
    (found,) = done.estimates
    assert (found.time, found.basis, found.heard) == (1.5, Basis.UPDATE, 2)
    np.testing.assert_allclose(found.belief.position, place + moved, atol=1e-9)
    np.testing.assert_allclose(found.belief.velocity, 4.0 * moved, atol=1e-8)
    (state,) = payloads(done)
    assert isinstance(state, StatePayload)
    assert state.step == 7
    np.testing.assert_allclose(state.position, place + moved, atol=1e-9)
    # and the track goes on as any other
    assert [estimate.basis for estimate in measured(base, 7, (0.95, 0.95)).estimates] == [Basis.UPDATE]


def test_a_second_meeting_needs_images_after_the_first() -> None:
    base, last = given_up()
    timer = last.timers[0]
    for node in PAIR:
        give(base, node, sighting(node, 5), 1.3)
    (timer,) = base.on_timer(at(timer.at), timer.key).timers
    assert [note.kind for note in give(base, "c1", sighting("c1", 5), 1.55).notes] == ["sighting_late"]
    assert base.on_timer(at(timer.at), timer.key).notes == ()


def test_one_sighting_or_rays_that_pass_each_other_begin_nothing() -> None:
    for places in ((CENTRE, None), (CENTRE, CENTRE + [0.0, 0.0, 1.0])):
        base, last = given_up()
        for node, place in zip(PAIR, places, strict=True):
            if place is not None:
                give(base, node, sighting(node, 5, place), 1.3)
        done = base.on_timer(at(last.timers[0].at), last.timers[0].key)
        assert done.notes == ()
        assert [estimate.basis for estimate in done.estimates] == [Basis.LOST]


def test_sightings_of_motes_that_search_for_longer_than_a_frame_still_count() -> None:
    """A 416 MHz mote takes 0.9 s for an image; meanwhile the base station's steps go on."""
    base, last = given_up(smoothing_scans=0)
    timer = last.timers[0]
    for seen, arrived in ((5, 8), (9, 12)):
        while timer.key != f"0:{arrived}":
            (timer,) = base.on_timer(at(timer.at), timer.key).timers
        for node in PAIR:
            assert give(base, node, sighting(node, seen), arrived / 4 + 0.1) == Step()
        done = base.on_timer(at(timer.at), timer.key)
        timer = done.timers[0]
    assert [note.kind for note in done.notes] == ["track_started"]
    assert [(e.time, e.basis) for e in done.estimates] == [
        (2.25, Basis.UPDATE),
        (2.5, Basis.SKIPPED),
        (2.75, Basis.SKIPPED),
        (3.0, Basis.SKIPPED),
    ]
    widths = [np.trace(estimate.cov) for estimate in done.estimates]
    assert (np.diff(widths) > 0).all()
    (state,) = payloads(done)
    assert isinstance(state, StatePayload)
    assert state.step == 13


def test_a_sighting_too_old_to_say_anything_is_late() -> None:
    base, last = given_up()
    timer = last.timers[0]
    for _ in range(6):
        (timer,) = base.on_timer(at(timer.at), timer.key).timers
    for step, kinds in ((6, ["sighting_late"]), (7, [])):
        assert [note.kind for note in give(base, "c1", sighting("c1", step), 2.8).notes] == kinds
    # one that has grown too old meanwhile meets nothing either
    for _ in range(3):
        (timer,) = base.on_timer(at(timer.at), timer.key).timers
    give(base, "c2", sighting("c2", 13), 3.3)
    assert base.on_timer(at(timer.at), timer.key).notes == ()


def test_messages_of_the_other_kind_are_late_and_strangers_are_refused() -> None:
    tracking = started()
    assert [note.kind for note in give(tracking, "c1", sighting("c1", 1), 0.3).notes] == ["sighting_late"]
    looking, _ = given_up()
    for source, payload, kind in (
        ("c1", weights(5, 0.9), "weights_late"),
        ("stranger", sighting("c1", 5), "sighting_refused"),
        ("c1", SightingPayload(3, 5, np.zeros(2), 1.0, 0.9), "sighting_refused"),
    ):
        assert [note.kind for note in give(looking, source, payload, 1.3).notes] == [kind]


def test_an_automatic_start_is_a_search_from_the_first_step() -> None:
    base = BaseProgram(params(start="automatic"), box.site(steps=5))
    first = base.on_start(at(0.0))
    assert payloads(first) == [SearchPayload(0, 1)]
    (timer,) = first.timers
    done = base.on_timer(at(timer.at), timer.key)
    assert done.estimates == ()  # nobody knows anything of the target yet
    for step, notes in ((2, []), (3, ["track_started"])):
        (timer,) = done.timers
        for node in PAIR:
            give(base, node, sighting(node, step), step / 4 + 0.05)
        done = base.on_timer(at(timer.at), timer.key)
        assert [note.kind for note in done.notes] == notes


def test_a_search_that_finds_nothing_ends_with_the_run() -> None:
    base = BaseProgram(params(start="automatic"), box.site(steps=5))
    (timer,) = base.on_start(at(0.0)).timers
    for _ in range(4):
        (timer,) = base.on_timer(at(timer.at), timer.key).timers
    assert base.on_timer(at(timer.at), timer.key).timers == ()


def test_an_automatic_start_needs_a_way_to_find_targets() -> None:
    for loss in (None, {"search": False}):
        with pytest.raises(ValidationError, match="automatic needs loss with search"):
            scene.params(start="automatic", loss=loss)


def test_a_camera_that_is_told_to_search_reports_what_it_finds_until_a_state_comes() -> None:
    mote = CameraProgram(params(), box.site(), "c1", box.models())
    give(mote, "base", SearchPayload(0, 2), 0.1)
    assert mote.on_frame(at(0.25), box.frame("c1", 1)).sends == ()  # not yet asked for
    for step in (2, 3):
        done = mote.on_frame(at(step / 4), box.frame("c1", step))
        (send,) = done.sends
        assert send.to is Scope.BASE
        assert isinstance(send.payload, SightingPayload)
        assert (send.payload.target, send.payload.step) == (0, step)
        assert send.payload.similarity > 0.9
        assert send.expires == pytest.approx(step / 4 + 1.0)
        assert done.work.int_ops > 1e7
    state = StatePayload(0, 4, CENTRE, np.zeros(3), UPRIGHT)
    give(mote, "base", state, 0.9)
    (send,) = mote.on_frame(at(1.0), box.frame("c1", 4)).sends
    assert isinstance(send.payload, WeightsPayload)


def test_a_camera_reports_nothing_where_nothing_like_the_target_is() -> None:
    mote = CameraProgram(params(), box.site(), "c1", box.models())
    give(mote, "base", SearchPayload(0, 1), 0.1)
    done = mote.on_frame(at(0.25), box.frame("c1", 1, place=None))
    assert done.sends == ()
    assert done.work.int_ops > 1e7  # it has looked all the same
    assert mote.on_frame(at(0.5), box.frame("c1", 2)).notes == ()


def test_a_target_that_no_camera_can_see_is_predicted_then_lost() -> None:
    """All particles outside every view: nobody is asked, nothing is waited for, the filter goes on."""
    base = BaseProgram(params(spread={"kind": "fixed"}), box.site({"away": AWAY}, steps=12))
    (timer,) = base.on_start(at(0.0)).timers
    kinds = []
    for step in range(1, 5):
        assert timer.at == pytest.approx(step / 4)
        done = base.on_timer(at(timer.at), timer.key)
        kinds += [estimate.basis for estimate in done.estimates if estimate.basis is not Basis.SMOOTHED]
        (timer,) = done.timers
    assert kinds == [Basis.UNASKED] * 4
    assert lost(done)
    assert payloads(done) == [SearchPayload(0, 5)]
