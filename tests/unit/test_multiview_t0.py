"""Tracker T0 as programs, without any network: who sends what, when, and what is refused."""

import runpy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.estimation.particles import without_prior
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.numbers import ENCODINGS
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Basis, Belief, Scope, Site
from wsnsim.systems.multiview.base import BaseProgram
from wsnsim.systems.multiview.camera import CameraProgram
from wsnsim.systems.multiview.proposal import participants, propose, spread
from wsnsim.systems.multiview.system import SYSTEM
from wsnsim.systems.multiview.viewpoints import nearest_viewpoint, viewpoints
from wsnsim.vision.frame import Frame

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, PAIR, AWAY = scene.CENTRE, scene.UPRIGHT, scene.PAIR, scene.AWAY
params, at, give = scene.params, scene.at, scene.give
box = scene.Scene(5)
site = box.site


def state(step: int = 1, place: np.ndarray = CENTRE, **more: object) -> StatePayload:
    return StatePayload(0, step, place, np.zeros(3), UPRIGHT, **more)  # type: ignore[arg-type]


def first_state(base: BaseProgram) -> StatePayload:
    (send,) = base.on_start(at(0.0)).sends
    assert send.to is Scope.TREE
    assert isinstance(send.payload, StatePayload)
    return send.payload


def weights(step: int, size: int = 200, **more: object) -> WeightsPayload:
    return WeightsPayload(0, step, np.ones(size), **more)  # type: ignore[arg-type]


def arrived(payload: Payload) -> Payload:
    return decode_any(payload.encode(), SYSTEM.payloads)


def test_there_are_26_distinct_unit_viewpoints() -> None:
    directions = viewpoints()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert len(np.unique(directions.round(9), axis=0)) == 26
    # the direction exactly towards the camera is found again, in a turned target too
    quarter_turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for index, direction in enumerate(directions):
        assert nearest_viewpoint(directions, quarter_turn @ direction, quarter_turn) == index


@pytest.mark.parametrize(("space", "bins"), [("hsv", 110), ("hs", 100)])
def test_the_reference_model_holds_distributions(space: str, bins: int) -> None:
    (model,) = box.models(space)
    assert model.sqrt_colour.shape == (26, bins)
    assert model.sqrt_texture.shape == (26, 10)
    np.testing.assert_allclose((model.sqrt_colour**2).sum(axis=1), 1.0)
    np.testing.assert_allclose((model.sqrt_texture**2).sum(axis=1), 1.0)


def test_all_nodes_draw_the_same_particles() -> None:
    moving = StatePayload(0, 3, CENTRE, np.array([1.0, 0.0, 0.0]), UPRIGHT)
    one, other = (propose(moving, params(), site()) for _ in range(2))
    np.testing.assert_array_equal(one.particles, other.particles)
    np.testing.assert_allclose(one.mean, CENTRE + [0.25, 0.0, 0.0])
    later = propose(state(4), params(), site())
    assert not np.array_equal(later.particles - later.mean, one.particles - one.mean)


def test_particles_of_fixed_spread_are_as_wide_as_asked_for() -> None:
    """Within five standard errors of a sample's standard deviation, sd / √(2M)."""
    many = propose(state(), params(particles=20_000, particle_sd_m=0.3), site())
    assert np.abs((many.particles - many.mean).std(axis=0) - 0.3).max() < 5 * 0.3 / np.sqrt(2 * 20_000)
    np.testing.assert_allclose(many.cov, 0.09 * np.eye(3))


def test_particles_of_predicted_spread_have_the_floor_and_the_filters_covariance() -> None:
    """floor² I + P; of P no direction beyond largest_sd_m, so that a lost target does not empty the cloud."""
    rule = params(particles=20_000, spread={"kind": "predicted", "floor_sd_m": 0.2, "largest_sd_m": 1.0})
    turn, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    said = spread(turn @ np.diag([0.01, 0.25, 9.0]) @ turn.T, rule)
    proposal = propose(state(spread=said), rule, site())
    expected = turn @ np.diag([0.01 + 0.04, 0.25 + 0.04, 1.0 + 0.04]) @ turn.T
    np.testing.assert_allclose(proposal.cov, expected, atol=1e-12)
    sample = np.cov(proposal.particles.T)
    # an element of a sample covariance has a standard error of at most √2 · σ_i σ_j / √M
    sds = np.sqrt(np.diag(expected))
    assert (np.abs(sample - expected) < 5 * np.sqrt(2 / 20_000) * np.outer(sds, sds)).all()
    assert spread(np.eye(3), params(spread={"kind": "fixed"})).size == 0


def test_cameras_are_asked_by_the_whole_cloud_or_by_its_middle() -> None:
    """A camera whose image the mean just misses can still correct a wrong prediction."""
    everyone = site({**PAIR, "away": AWAY})
    wide, point = params(particle_sd_m=1.0), params(participation={"kind": "point"})
    proposal = propose(state(), params(), everyone)
    assert participants(everyone, proposal, state(), params()) == ("c1", "c2")
    assert participants(everyone, proposal, state(), point) == ("c1", "c2")
    aside = state(place=CENTRE + [-1.9, 1.9, 0.0])
    beside = propose(aside, wide, site())
    (pixel,), _ = PAIR["c1"].project(beside.mean[None])
    assert not (0 <= pixel[0] < 320)
    assert participants(site(), beside, aside, wide) == ("c1", "c2")
    assert participants(site(), beside, aside, point) == ("c2",)


def test_a_camera_that_would_see_the_target_too_small_takes_no_part() -> None:
    """Sec. 6.2.2. At 4.5 m the ellipse has about π · 0.34 · 0.31 · (300 / 4.5)² = 1470 pixels."""
    far = {**PAIR, "far": scene.camera(-20.0, -22.0, 2.4)}
    proposal = propose(state(), params(), site(far))
    pair = ("c1", "c2")
    for least, asked in ((0.0, (*pair, "far")), (200.0, pair), (1000.0, pair), (2500.0, ())):
        assert participants(site(far), proposal, state(), params(usable_px_min=least)) == asked


def orientations(encoding: str, count: int) -> list[np.ndarray]:
    """Return orientations that move again when they are rounded twice; float64 rounds none."""
    generator = np.random.default_rng(0)
    drawn = generator.standard_normal((2000, 4))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    if encoding == "float64":
        return list(drawn[:count])
    found = []
    for orientation in drawn:
        once = arrived(StatePayload(0, 1, CENTRE, np.zeros(3), orientation, encoding=encoding))  # type: ignore[arg-type]
        if not np.array_equal(once.orientation, arrived(once).orientation):
            found.append(orientation)
    return found[:count]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_base_and_cameras_always_agree_on_particles_and_on_who_is_asked(encoding: str) -> None:
    """The base station works with the state as it arrives, rounded: else it would wait for nobody."""
    cameras = {**scene.CAMERAS, "far": scene.camera(-9.0, -9.0, 2.4)}
    for seed, orientation in enumerate(orientations(encoding, 8)):
        rule = params(
            encoding=encoding, particles=50, usable_px_min=120.0, initial_error={"position_sd_m": 0.9}
        )
        start = Belief(CENTRE, np.zeros(3), orientation)
        there = Site(cameras, (replace(box.target, start=start),), 4.0, 3, RandomStreams(seed))
        base = BaseProgram(rule, there)
        sent = arrived(first_state(base))
        assert isinstance(sent, StatePayload)
        track = base._tracks[0]
        drawn = propose(sent, rule, there)
        np.testing.assert_array_equal(drawn.particles, track.proposal.particles)
        np.testing.assert_array_equal(drawn.cov, track.proposal.cov)
        np.testing.assert_array_equal(sent.orientation, track.attitude.orientation)
        assert participants(there, drawn, sent, rule) == track.asked
    assert seed == 7


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("likelihood", ["raw", "bhattacharyya", "log_ratio"])
def test_a_camera_answers_frame_and_state_in_either_order(encoding: str, likelihood: str) -> None:
    answers = []
    rule = params(encoding=encoding, likelihood={"kind": likelihood})
    for state_first in (True, False):
        mote = CameraProgram(rule, site(), "c1", box.models())
        inputs = [
            lambda mote=mote: give(mote, "base", state(), 0.1),
            lambda mote=mote: mote.on_frame(at(0.25), box.frame("c1", 1)),
        ]
        first, second = (act() for act in (inputs if state_first else inputs[::-1]))
        assert first.sends == ()
        (send,) = second.sends
        assert isinstance(send.payload, WeightsPayload)
        assert (send.to, send.payload.encoding) == (Scope.BASE, encoding)
        assert send.expires == pytest.approx(0.25 + 1.8 / 4)
        assert second.work.int_ops > 0
        answers.append(send.payload.encode())
    assert answers[0] == answers[1]
    back = arrived(send.payload)
    assert isinstance(back, WeightsPayload)
    assert back.weights.size == 200
    assert 0.5 < back.similarity <= 1.0


@pytest.mark.parametrize(("kind", "numbers"), [("wahba", 3), ("average", 4), ("initial", 0)])
def test_what_a_camera_says_of_the_orientation_follows_the_rule(kind: str, numbers: int) -> None:
    mote = CameraProgram(params(orientation={"kind": kind}), site(), "c1", box.models())
    give(mote, "base", state(), 0.1)
    (send,) = mote.on_frame(at(0.25), box.frame("c1", 1)).sends
    assert send.payload.facing.shape == (numbers,)
    if kind == "wahba":
        # the camera really sees an upright target from here: to a viewpoint's distance of 45 degrees
        ray = PAIR["c1"].position - CENTRE
        facing = send.payload.facing / np.linalg.norm(send.payload.facing)
        assert facing @ ray / np.linalg.norm(ray) > np.cos(np.radians(45))


def test_a_camera_without_the_state_of_its_frame_stays_silent_and_says_so() -> None:
    mote = CameraProgram(params(), site(), "c1", box.models())
    give(mote, "base", state(), 0.1)
    assert mote.on_frame(at(0.25), box.frame("c1", 1)).sends
    assert mote.on_frame(at(0.50), box.frame("c1", 2)).sends == ()
    step = mote.on_frame(at(0.75), box.frame("c1", 3))
    assert step.sends == ()
    assert [note.kind for note in step.notes] == ["frame_unused"]
    assert "frame 2" in step.notes[0].detail


def test_a_camera_that_is_not_asked_never_looks_at_its_image() -> None:
    mote = CameraProgram(params(), site({"away": AWAY}), "away", box.models())
    give(mote, "base", state(), 0.1)

    def never() -> np.ndarray:
        raise AssertionError("this image must not be made")

    assert mote.on_frame(at(0.25), Frame(1, 0.25, "away", never)).sends == ()


def test_messages_on_a_target_that_does_not_exist_are_not_answered() -> None:
    mote = CameraProgram(params(), site(), "c1", box.models())
    give(mote, "base", StatePayload(7, 1, CENTRE, np.zeros(3), UPRIGHT), 0.1)
    assert mote.on_frame(at(0.25), box.frame("c1", 1)).sends == ()


def test_the_base_fuses_when_all_have_answered() -> None:
    base = BaseProgram(params(smoothing_scans=0), site())
    first_state(base)
    assert give(base, "c1", weights(1), 0.30).estimates == ()
    step = give(base, "c2", weights(1), 0.31)
    (estimate,) = step.estimates
    assert (estimate.time, estimate.basis, estimate.asked, estimate.heard) == (0.25, Basis.UPDATE, 2, 2)
    (send,) = step.sends
    assert isinstance(send.payload, StatePayload)
    assert send.payload.step == 2


def test_the_base_uses_what_came_by_the_deadline() -> None:
    base = BaseProgram(params(deadline_s=0.2), site())
    (timer,) = base.on_start(at(0.0)).timers
    assert timer.at == pytest.approx(0.25 + 0.2)
    give(base, "c1", weights(1), 0.30)
    step = base.on_timer(at(timer.at), timer.key)
    assert [(e.asked, e.heard) for e in step.estimates] == [(2, 1)]
    assert base.on_timer(at(timer.at), timer.key).estimates == ()  # a timer of the past does nothing


def test_frames_that_passed_while_the_base_waited_get_predictions() -> None:
    base = BaseProgram(params(), site())
    (timer,) = base.on_start(at(0.0)).timers
    step = base.on_timer(at(timer.at), timer.key)  # 1.8 periods after the first frame
    assert [(e.time, e.heard, e.basis) for e in step.estimates] == [
        (0.25, 0, Basis.TIMED_OUT),
        (0.5, 0, Basis.SKIPPED),
    ]
    (send,) = step.sends
    assert isinstance(send.payload, StatePayload)
    assert send.payload.step == 3


def test_the_run_ends_with_its_last_step() -> None:
    base = BaseProgram(params(), site(steps=1))
    first_state(base)
    give(base, "c1", weights(1), 0.3)
    step = give(base, "c2", weights(1), 0.3)
    assert [e.basis for e in step.estimates] == [Basis.UPDATE, Basis.SMOOTHED]
    assert step.sends == ()
    assert step.timers == ()


def test_weights_that_do_not_belong_are_not_mixed_in() -> None:
    base = BaseProgram(params(), site())
    first_state(base)
    for source, payload, kind in (
        ("c1", weights(2), "weights_late"),
        ("c1", weights(0), "weights_late"),
        ("c1", weights(1, size=7), "weights_refused"),
        ("stranger", weights(1), "weights_refused"),
        ("c1", WeightsPayload(9, 1, np.ones(200)), "weights_refused"),
    ):
        step = give(base, source, payload, 0.3)
        assert [note.kind for note in step.notes] == [kind]
        assert step.estimates == ()
    give(base, "c1", weights(1), 0.3)
    give(base, "c1", weights(1), 0.3)  # a duplicate changes nothing
    assert [e.heard for e in give(base, "c2", weights(1), 0.3).estimates] == [2]


def test_a_base_station_that_hears_its_own_state_does_nothing() -> None:
    base = BaseProgram(params(), site())
    sent = first_state(base)
    assert give(base, "c1", sent, 0.3) == BaseProgram(params(), site()).on_frame(at(0.3), box.frame("c1", 1))


def test_zero_weights_of_one_camera_do_not_rule_particles_out() -> None:
    base = BaseProgram(params(), site())
    sent = first_state(base)
    sd = np.sqrt(np.trace(propose(sent, params(), site()).cov) / 3)
    left, right = np.zeros(200), np.zeros(200)
    left[:100] = 1.0
    right[100:] = 1.0
    give(base, "c1", WeightsPayload(0, 1, left), 0.3)
    estimate, *_ = give(base, "c2", WeightsPayload(0, 1, right), 0.3).estimates
    # the mean of 200 particles, all alike: five standard errors of it
    assert np.linalg.norm(estimate.belief.position - sent.position) < 5 * sd * np.sqrt(3 / 200)


def test_the_initial_error_is_what_was_asked_for_and_the_same_each_time() -> None:
    wrong = params(initial_error={"position_sd_m": 0.3, "velocity_sd_mps": 0.1})
    offsets = [first_state(BaseProgram(wrong, site())).position - CENTRE for _ in range(2)]
    np.testing.assert_array_equal(offsets[0], offsets[1])
    assert 0.0 < np.linalg.norm(offsets[0]) < 0.3 * 5
    np.testing.assert_array_equal(first_state(BaseProgram(params(), site())).position, CENTRE)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 0, 1], [0.6, -0.5, 0.3]])
def test_a_long_and_thin_cloud_keeps_a_volume(encoding: str, axis: list[float]) -> None:
    """One camera never measures depth. In 8 bits the thin sides of the cloud would be rounded to nothing."""
    direction = np.array(axis) / np.linalg.norm(axis)
    rule = params(encoding=encoding, spread={"kind": "predicted", "floor_sd_m": 1e-3})
    long = 1.4**2 * np.outer(direction, direction)
    sent = state(spread=spread(long, rule), encoding=encoding)
    proposal = propose(arrived(sent), rule, site())
    sds = np.sqrt(np.linalg.eigvalsh(proposal.cov))
    assert sds[0] > 1e-4
    assert sds[2] == pytest.approx(1.4, rel=2 / 127)
    evidence = without_prior(proposal.mean, 0.02 * proposal.cov, proposal.mean, proposal.cov, 1e-4)
    assert evidence.values.size == 3
