"""Tracker T0 as programs, without any network: who sends what, when, and what is refused."""

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import QuantisedWeightsPayload, WeightsPayload
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Belief, Context, Received, Scope, Site, Step, TrackedTarget
from wsnsim.systems.multiview.params import MultiviewParams, SharpenedLikelihood
from wsnsim.systems.multiview.proposal import participants, propose
from wsnsim.systems.multiview.reference_model import ReferenceModel, learn
from wsnsim.systems.multiview.similarity import Similarity, compare, particle_weights
from wsnsim.systems.multiview.t0 import T0Base, T0Camera
from wsnsim.systems.multiview.viewpoints import nearest_viewpoint, viewpoints
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.frame import Frame
from wsnsim.vision.portrait import Studio
from wsnsim.vision.renderer import Renderer
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
CENTRE = np.array([3.5, 3.5, 1.1])
LIGHT = np.array([0.0, 0.0, 1.0])
STREAMS = RandomStreams(5)
BODY = Body(np.array([0.40, 0.28, 0.34]), PatchTexture.random(STREAMS.stream("texture"), 18, 9))
STUDIO = Studio(BODY, UPRIGHT, LIGHT, 0.6, 300.0, (320, 240), 4.0, 5.0, STREAMS, "box")
TARGET = TrackedTarget("box", BODY.semi_axes_m, Belief(CENTRE, np.zeros(3), UPRIGHT), STUDIO.portrait)


def camera(x: float, y: float) -> PinholeCamera:
    return PinholeCamera.look_at((x, y, 2.4), CENTRE, 300.0, (320, 240))


CAMERAS = {"c1": camera(0.3, 0.6), "c2": camera(6.7, 0.6)}
AWAY = PinholeCamera.look_at((0.3, 0.6, 2.4), (-5.0, -5.0, 1.0), 300.0, (320, 240))


def site(cameras: dict[str, PinholeCamera] | None = None, steps: int = 3) -> Site:
    return Site(cameras or CAMERAS, (TARGET,), 4.0, steps, STREAMS)


def params(**changes: object) -> MultiviewParams:
    return MultiviewParams.model_validate({"kind": "multiview", "particles": 200, **changes})


@pytest.fixture(scope="module")
def models() -> tuple[ReferenceModel, ...]:
    return (learn(TARGET, FeatureSpace("hsv")),)


def at(now: float) -> Context:
    return Context("n", now, np.inf)


def frame(node: str, step: int) -> Frame:
    grey = np.full((240, 320, 3), 128, np.uint8)
    renderer = Renderer(CAMERAS[node], node, grey, 5.0, 0.02, LIGHT, 0.6, STREAMS)
    pose = Pose(CENTRE, np.zeros(3), UPRIGHT)
    return Frame(step, step / 4, node, lambda: renderer.render(step, [BODY], [pose]))


def first_state(base: T0Base) -> StatePayload:
    (send,) = base.on_start(at(0.0)).sends
    assert send.to is Scope.TREE
    assert isinstance(send.payload, StatePayload)
    return send.payload


def weights(step: int, size: int = 200) -> WeightsPayload:
    return WeightsPayload(0, step, np.ones(size))


def give(base: T0Base, source: str, payload: object, now: float) -> Step:
    return base.on_payload(at(now), Received(source, payload))  # type: ignore[arg-type]


def test_there_are_26_distinct_unit_viewpoints() -> None:
    directions = viewpoints()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert len(np.unique(directions.round(9), axis=0)) == 26
    # the direction exactly towards the camera is found again, in a turned target too
    quarter_turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for index, direction in enumerate(directions):
        assert nearest_viewpoint(directions, quarter_turn @ direction, quarter_turn) == index


def test_the_reference_model_holds_distributions(models: tuple[ReferenceModel, ...]) -> None:
    (model,) = models
    assert model.sqrt_colour.shape == (26, 110)
    assert model.sqrt_texture.shape == (26, 10)
    np.testing.assert_allclose((model.sqrt_colour**2).sum(axis=1), 1.0)
    np.testing.assert_allclose((model.sqrt_texture**2).sum(axis=1), 1.0)


def test_all_nodes_draw_the_same_particles() -> None:
    state = StatePayload(0, 3, CENTRE, np.array([1.0, 0.0, 0.0]), UPRIGHT)
    one, other = (propose(state, params(), site()) for _ in range(2))
    np.testing.assert_array_equal(one.particles, other.particles)
    np.testing.assert_allclose(one.mean, CENTRE + [0.25, 0.0, 0.0])
    later = propose(StatePayload(0, 4, CENTRE, np.zeros(3), UPRIGHT), params(), site())
    assert not np.array_equal(later.particles - later.mean, one.particles - one.mean)
    # the spread asked for, within five standard errors of a sample's standard deviation
    many = propose(state, params(particles=20_000), site())
    spread = (many.particles - many.mean).std(axis=0)
    assert np.abs(spread - 0.22).max() < 5 * 0.22 / np.sqrt(2 * 20_000)


def test_cameras_are_asked_by_the_whole_predictive_distribution() -> None:
    proposal = propose(StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT), params(), site())
    assert participants(site({**CAMERAS, "away": AWAY}), proposal, params()) == ("c1", "c2")
    # a camera whose image the mean just misses is still asked
    beside = propose(
        StatePayload(0, 1, CENTRE + [-1.9, 1.9, 0.0], np.zeros(3), UPRIGHT), params(particle_sd_m=1.0), site()
    )
    (pixel,), _ = CAMERAS["c1"].project(beside.mean[None])
    assert not (0 <= pixel[0] < 320)
    assert participants(site(), beside, params()) == ("c1", "c2")


def test_particles_near_the_target_weigh_most(models: tuple[ReferenceModel, ...]) -> None:
    proposal = propose(StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT), params(particles=1000), site())
    similarity = compare(
        frame("c1", 1).image,
        CAMERAS["c1"],
        proposal,
        UPRIGHT,
        BODY.semi_axes_m,
        models[0],
        FeatureSpace("hsv"),
        0.7,
    )
    assert similarity.judged.all()
    axis = (CENTRE - CAMERAS["c1"].position) / np.linalg.norm(CENTRE - CAMERAS["c1"].position)
    offset = proposal.particles - CENTRE
    across = np.linalg.norm(offset - np.outer(offset @ axis, axis), axis=1)
    assert similarity.rho[across < 0.1].mean() > similarity.rho[across > 0.4].mean() + 0.1
    w = particle_weights(similarity, SharpenedLikelihood())
    assert w.max() == 1.0
    assert np.linalg.norm((w @ proposal.particles) / w.sum() - CENTRE) < 0.15


def test_particles_out_of_view_get_the_mean_weight_of_the_others() -> None:
    from wsnsim.hardware.work import Work

    similarity = Similarity(np.array([0.9, 0.8, 0.0]), np.array([True, True, False]), Work())
    w = particle_weights(similarity, SharpenedLikelihood(sharpness=10.0))
    np.testing.assert_allclose(w, [1.0, np.exp(-1.0), (1.0 + np.exp(-1.0)) / 2])
    blind = Similarity(np.zeros(2), np.zeros(2, bool), Work())
    np.testing.assert_array_equal(particle_weights(blind, SharpenedLikelihood()), [1.0, 1.0])


@pytest.mark.parametrize(
    ("encoding", "kind"), [("float64", WeightsPayload), ("uint8", QuantisedWeightsPayload)]
)
def test_a_camera_answers_frame_and_state_in_either_order(
    encoding: str, kind: type, models: tuple[ReferenceModel, ...]
) -> None:
    state = StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT)
    answers = []
    for state_first in (True, False):
        mote = T0Camera(params(encoding=encoding), site(), "c1", models)
        inputs = [
            lambda mote=mote: mote.on_payload(at(0.1), Received("base", state)),
            lambda mote=mote: mote.on_frame(at(0.25), frame("c1", 1)),
        ]
        first, second = (act() for act in (inputs if state_first else inputs[::-1]))
        assert first.sends == ()
        (send,) = second.sends
        assert isinstance(send.payload, kind)
        assert send.expires == pytest.approx(0.25 + 1.8 / 4)
        assert second.work.int_ops > 0
        answers.append(send.payload.encode())
    assert answers[0] == answers[1]


def test_a_camera_without_the_state_of_its_frame_stays_silent_and_says_so(
    models: tuple[ReferenceModel, ...],
) -> None:
    mote = T0Camera(params(), site(), "c1", models)
    mote.on_payload(at(0.1), Received("base", StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT)))
    assert mote.on_frame(at(0.25), frame("c1", 1)).sends
    assert mote.on_frame(at(0.50), frame("c1", 2)).sends == ()
    step = mote.on_frame(at(0.75), frame("c1", 3))
    assert step.sends == ()
    assert [note.kind for note in step.notes] == ["frame_unused"]
    assert "frame 2" in step.notes[0].detail


def test_a_camera_that_sees_none_of_the_particles_sends_nothing(models: tuple[ReferenceModel, ...]) -> None:
    mote = T0Camera(params(), site({"away": AWAY}), "away", models)
    mote.on_payload(at(0.1), Received("base", StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT)))

    def never() -> np.ndarray:
        raise AssertionError("a camera that is not asked must not look at its image")

    assert mote.on_frame(at(0.25), Frame(1, 0.25, "away", never)).sends == ()


def test_the_base_fuses_when_all_have_answered() -> None:
    base = T0Base(params(), site())
    first_state(base)
    assert give(base, "c1", weights(1), 0.30).estimates == ()
    step = give(base, "c2", weights(1), 0.31)
    (estimate,) = step.estimates
    assert (estimate.time, estimate.asked, estimate.heard) == (0.25, 2, 2)
    (send,) = step.sends
    assert isinstance(send.payload, StatePayload)
    assert send.payload.step == 2


def test_the_base_uses_what_came_by_the_deadline() -> None:
    base = T0Base(params(deadline_s=0.2), site())
    (timer,) = base.on_start(at(0.0)).timers
    assert timer.at == pytest.approx(0.25 + 0.2)
    give(base, "c1", weights(1), 0.30)
    step = base.on_timer(at(timer.at), timer.key)
    assert [(e.asked, e.heard) for e in step.estimates] == [(2, 1)]
    assert base.on_timer(at(timer.at), timer.key).estimates == ()  # a timer of the past does nothing


def test_frames_that_passed_while_the_base_waited_get_predictions() -> None:
    base = T0Base(params(), site(steps=3))
    (timer,) = base.on_start(at(0.0)).timers
    step = base.on_timer(at(timer.at), timer.key)  # 1.8 periods after the first frame
    assert [(e.time, e.heard) for e in step.estimates] == [(0.25, 0), (0.5, 0)]
    (send,) = step.sends
    assert isinstance(send.payload, StatePayload)
    assert send.payload.step == 3


def test_the_run_ends_with_its_last_step() -> None:
    base = T0Base(params(), site(steps=1))
    first_state(base)
    give(base, "c1", weights(1), 0.3)
    step = give(base, "c2", weights(1), 0.3)
    assert len(step.estimates) == 1
    assert step.sends == ()
    assert step.timers == ()


def test_weights_that_do_not_belong_are_not_mixed_in() -> None:
    base = T0Base(params(), site())
    first_state(base)
    for source, payload, kind in (
        ("c1", weights(2), "weights_late"),
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


def test_zero_weights_of_one_camera_do_not_rule_particles_out() -> None:
    base = T0Base(params(), site())
    state = first_state(base)
    left, right = np.zeros(200), np.zeros(200)
    left[:100] = 1.0
    right[100:] = 1.0
    give(base, "c1", WeightsPayload(0, 1, left), 0.3)
    (estimate,) = give(base, "c2", WeightsPayload(0, 1, right), 0.3).estimates
    assert np.isfinite(estimate.belief.position).all()
    assert np.linalg.norm(estimate.belief.position - state.position) < 0.22


def test_the_initial_error_is_what_was_asked_for_and_the_same_each_time() -> None:
    wrong = params(initial_error={"position_sd_m": 0.3, "velocity_sd_mps": 0.1})
    offsets = []
    for _ in range(2):
        offsets.append(first_state(T0Base(wrong, site())).position - CENTRE)
    np.testing.assert_array_equal(offsets[0], offsets[1])
    assert 0.0 < np.linalg.norm(offsets[0]) < 0.3 * 5
    np.testing.assert_array_equal(first_state(T0Base(params(), site())).position, CENTRE)
