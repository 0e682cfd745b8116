"""What the programs of the scan-line system do with lost and late reports, and with too little time."""

import runpy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from wsnsim.messages.scanline import ScanLinePayload, TrackPayload
from wsnsim.systems.base import Received
from wsnsim.systems.scanline.reading import Measured, Reading
from wsnsim.systems.scanline.sources import Heard

POST = runpy.run_path(str(Path(__file__).parents[1] / "scanline_post.py"))
RATE_HZ, STEPS = POST["RATE_HZ"], 30
DEADLINE_S = 0.9 / RATE_HZ
BASE = ("system.head.kind=base",)
MOTE = ("system.head={kind: node, id: c3}",)
RELAY = (
    "system.head={kind: node, id: r}",
    "motes.nodes=[{id: r, position_m: [4, 2, 2]}]",
)


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return POST["room"](tmp_path_factory.mktemp("room"))


def is_report(said, *cameras):
    return isinstance(said.payload, ScanLinePayload) and (not cameras or said.source in cameras)


def blinded(post, cameras, steps):
    """Let cameras say to the base station that they do not see the object."""
    program = post.programs["base"]
    on_payload = program.on_payload

    def altered(ctx, message):
        payload = message.payload
        if message.source in cameras and isinstance(payload, ScanLinePayload):
            now = round(ctx.now * RATE_HZ)
            if now in steps:
                message = Received(message.source, ScanLinePayload(payload.step, None))
        return on_payload(ctx, message)

    program.on_payload = altered
    return post


@pytest.mark.parametrize("head", [BASE, MOTE, RELAY])
def test_whoever_tracks_the_base_station_believes_the_same(room, head):
    post = POST["Post"](room, head).run()
    assert [(node, round(estimate.time * RATE_HZ)) for node, estimate, _ in post.told] == [
        ("base", step) for step in range(1, STEPS + 1)
    ]
    assert {(estimate.asked, estimate.heard) for _, estimate, _ in post.told} == {(4, 4)}
    assert np.mean(list(post.errors_m().values())[5:]) < 0.15
    tracks = [said for said in post.said if isinstance(said.payload, TrackPayload)]
    assert len(tracks) == (0 if head is BASE else STEPS)


def test_a_track_says_what_the_head_believes(room):
    """The base station's estimate is the head's, to what 16 bits hold."""
    post = POST["Post"](room, MOTE).run()
    tracks = [said.payload for said in post.said if isinstance(said.payload, TrackPayload)]
    for track, (_, estimate, _) in zip(tracks, post.told, strict=True):
        np.testing.assert_allclose(estimate.belief.position[:2], track.shares * [8.0, 6.0])
        np.testing.assert_allclose(estimate.belief.velocity[:2], track.velocity)
        np.testing.assert_allclose(estimate.cov[[0, 0, 1], [0, 1, 1]], track.cov)
    speeds = [np.hypot(*estimate.belief.velocity[:2]) for _, estimate, _ in post.told]
    assert 0.1 < np.median(speeds) < 2.0


def test_a_camera_that_was_not_heard_says_nothing_not_that_it_is_blind():
    report = Heard({0: 3.0, 2: np.nan}).report(4)
    assert (report.seeing, report.blind) == (0b0001, 0b0100)
    assert report.heard.tolist() == [True, False, True, False]


def test_a_report_that_is_lost_does_less_harm_than_a_false_one(room):
    """A camera that says it is blind rules out what it would see if nobody hid it; a lost report does not.

    Each report counts in full: an exponent below 1 makes less of false ones too.
    """
    steps, blocked = [step for step in range(6, 150) if step % 20 > 9], ("c2", "c4")
    off = np.zeros(2)
    for seed in (0, 1):
        options = ("system.priors.kind=kalman", "system.tracker.visibility_exponent=1")
        keys = (*BASE, *options, "duration_s=20", f"seed={seed}")
        lost = POST["Post"](
            room, keys, lambda said: is_report(said, *blocked) and said.payload.step in steps
        ).run()
        false = blinded(POST["Post"](room, keys), blocked, steps).run()
        counts = {round(estimate.time * RATE_HZ): estimate.heard for _, estimate, _ in lost.told}
        assert counts == {step: 2 if step in steps else 4 for step in range(1, 151)}
        assert {estimate.heard for _, estimate, _ in false.told} == {4}
        off += [np.mean([post.errors_m()[step] for step in steps]) for post in (lost, false)]
    assert off[0] / 2 < 0.3
    assert off[0] < 0.8 * off[1]


@pytest.mark.parametrize("priors", ["none", "kalman", "perfect", "stationary", "hull", "scan_lines"])
def test_when_every_report_is_lost_for_a_while_the_object_is_found_again(room, priors):
    gap = range(10, 22)
    post = POST["Post"](
        room,
        (*BASE, f"system.priors.kind={priors}"),
        lambda said: is_report(said) and said.payload.step in gap,
    ).run()
    kinds = {round(estimate.time * RATE_HZ): estimate.basis.value for _, estimate, _ in post.told}
    assert kinds == {step: "timed_out" if step in gap else "update" for step in range(1, STEPS + 1)}
    assert all(np.isfinite(estimate.cov).all() for _, estimate, _ in post.told)
    errors = post.errors_m()
    assert np.mean([errors[step] for step in range(24, STEPS + 1)]) < 0.4
    # who is not seen is believed to be within ever wider bounds
    spread = {round(estimate.time * RATE_HZ): np.trace(estimate.cov) for _, estimate, _ in post.told}
    assert spread[21] > 4.0 * spread[9]


@pytest.mark.parametrize(
    ("tracker", "priors"),
    [
        ("auxiliary", "none"),
        ("auxiliary", "kalman"),
        ("auxiliary", "perfect"),
        ("printed", "kalman"),
        ("plain", "scan_lines"),
        ("unscented", "none"),
        ("map", "none"),
    ],
)
def test_an_object_that_no_camera_sees_for_hundreds_of_steps_is_found_again(room, tracker, priors):
    steps, unseen = 330, range(20, 320)
    keys = (
        f"system.tracker={{kind: {tracker}}}",
        f"system.priors.kind={priors}",
        f"duration_s={steps / RATE_HZ}",
    )
    post = blinded(POST["Post"](room, (*BASE, *keys)), ("c1", "c2", "c3", "c4"), unseen).run()
    assert len(post.told) == steps
    for _, estimate, _ in post.told:
        assert np.isfinite(estimate.belief.position).all()
        assert np.linalg.eigvalsh(estimate.cov[:2, :2]).min() >= -1e-9
    # the unscented filter's points are far outside by then, and never come back: that is how it fails
    if tracker != "unscented":
        assert np.mean([post.errors_m()[step] for step in range(325, steps + 1)]) < 0.5


def test_late_reports_are_noted_and_not_used(room):
    post = POST["Post"](room, (*BASE, "system.deadline_s=0.05"), lambda said: is_report(said, "c1"))
    program = post.programs["base"]
    post.run()
    assert {estimate.heard for _, estimate, _ in post.told} == {3}
    before = len(post.told)
    late = Received("c1", ScanLinePayload(20, 0.1))
    step = program.on_payload(POST["Context"]("base", 20.0 / RATE_HZ + 0.3, 1.0), late)
    assert [note.kind for note in step.notes] == ["report_late"]
    assert (step.estimates, step.work.float_ops) == ((), 0.0)
    assert len(post.told) == before


def test_frames_are_closed_at_once_when_all_are_heard_and_at_their_deadline_else(room):
    early = POST["Post"](room, BASE).run()
    assert {round(made - estimate.time, 9) for _, estimate, made in early.told} == {0.0}
    silent = POST["Post"](room, BASE, lambda said: is_report(said, "c1")).run()
    np.testing.assert_allclose([made - estimate.time for _, estimate, made in silent.told], DEADLINE_S)


def follows(node, step):
    """Return the time of a slow processor: half a second for a step of the filter."""
    return 0.5 if step.work.float_ops > 1000.0 else 0.0


@pytest.mark.parametrize("head", [BASE, MOTE])
def test_a_head_too_slow_for_the_frames_leaves_some_out(room, head):
    """Half a second of work for a frame in 0.13 s: the delay stays within that and a little more."""
    post = POST["Post"](room, (*head, "duration_s=20"), work_s=follows).run()
    last = {}
    for _, estimate, made in post.told:
        last[round(estimate.time * RATE_HZ)] = (estimate.basis.value, made - estimate.time)
    assert sorted(last) == list(range(1, 151))
    kinds = Counter(kind for kind, _ in last.values())
    # a frame in four or five is followed
    assert 0.18 < kinds["update"] / 150 < 0.3
    assert kinds["skipped" if head is BASE else "timed_out"] == 150 - kinds["update"]
    latest = max(delay for _, delay in last.values())
    deadline_s = DEADLINE_S if head is BASE else 1.2 / RATE_HZ
    assert latest < deadline_s + 1.0 / RATE_HZ + 2 * 0.5
    errors = post.errors_m()
    assert np.mean([errors[step] for step in range(50, 151)]) < 0.6


@pytest.mark.parametrize(("occluders", "most"), [(0, 3), (5, 10), (15, 15)])
def test_to_catch_up_costs_a_step_without_reports_for_each_frame_left_out(room, occluders, most):
    """Thirty are left out: it catches up with fifteen at most, for hardly more than a step with reports."""
    costs = []

    def slow(node, step):
        """Take four seconds for the second frame; note what each costs."""
        if node != "base" or not step.work.float_ops:
            return 0.0
        costs.append(step.work.float_ops)
        return 4.0 if len(costs) == 2 else 0.0

    crowd = f"system.virtual_occluders={{count: {occluders}, diameter_m: 0.2}}"
    keys = (*BASE, "world.people=[]", crowd, "system.priors.kind=stationary", "duration_s=6")
    POST["Post"](room, keys, lambda said: is_report(said) and said.payload.step == 44, slow).run()
    before, caught_up, alone, empty = costs[1], costs[2], costs[3], min(costs)
    # what a frame alone costs depends on how many cameras see the object
    steps = (caught_up - alone) / empty
    assert steps == pytest.approx(most, abs=1.0)
    assert (steps - 1.5) * empty <= before


def test_a_silent_head_is_believed_for_a_while_and_then_nothing_is(room):
    def lost(said):
        return isinstance(said.payload, TrackPayload) and 2.0 < said.at < 12.0

    post = POST["Post"](room, (*MOTE, "duration_s=16"), lost).run()
    kinds = {round(estimate.time * RATE_HZ): estimate.basis.value for _, estimate, _ in post.told}
    predicted = [step for step, kind in kinds.items() if kind == "timed_out"]
    patience = round(5.0 * RATE_HZ)
    # the three that are still awaited when the first track comes again are reckoned back from it
    assert predicted == [*range(16, 16 + patience), 87, 88, 89]
    assert set(range(1, 121)) - set(kinds) == set(range(16 + patience, 87))
    assert [(node, kind) for _, node, kind in post.notes if kind.startswith("head_")] == [
        ("base", "head_silent"),
        ("base", "head_heard"),
    ]
    spread = [np.trace(estimate.cov) for _, estimate, _ in post.told if estimate.basis.value == "timed_out"]
    assert (np.diff(spread[:patience]) > 0.0).all()


@pytest.mark.parametrize("step", [1, 15, 16, STEPS])
def test_a_track_that_is_lost_is_reckoned_from_its_neighbour(room, step):
    def lost(said):
        return isinstance(said.payload, TrackPayload) and said.payload.step == step

    post = POST["Post"](room, MOTE, lost).run()
    kinds = {round(estimate.time * RATE_HZ): estimate.basis.value for _, estimate, _ in post.told}
    assert kinds == {k: "timed_out" if k == step else "update" for k in range(1, STEPS + 1)}
    assert post.errors_m()[step] < 0.5


def test_a_step_of_the_filter_costs_what_its_inner_loops_do(room):
    """More cameras that see, more occluders that may hide: dearer; nothing known: cheapest."""
    costs = {}
    for priors in ("none", "scan_lines", "perfect", "kalman", "stationary"):
        work = []

        def noted(node, step, work=work):
            if node == "base" and step.estimates:
                work.append(step.work.float_ops)
            return 0.0

        POST["Post"](room, (*BASE, f"system.priors.kind={priors}"), work_s=noted).run()
        costs[priors] = np.mean(work)
    assert costs["none"] <= costs["scan_lines"] < costs["kalman"]
    assert costs["none"] < costs["perfect"] < costs["stationary"] < costs["kalman"]


def test_of_more_blobs_than_a_message_holds_the_widest_are_told(room):
    post = POST["Post"](room, (*BASE, "system.message=scan_line"))
    ends = np.linspace(-150.0, 150.0, 601)[:600].reshape(-1, 2)
    ends[10, 1] += 0.4
    frame = POST["Frame"](1, 1.0 / RATE_HZ, "c1", lambda: None, Measured(Reading(0.0, ends)))
    step = post.programs["c1"].on_frame(POST["Context"]("c1", 0.1, 1.0), frame)
    (send,) = step.sends
    blobs = send.payload.blobs
    assert blobs.shape == (255, 2)
    np.testing.assert_allclose(blobs[10] * 160.0, ends[10])
    assert (np.diff(blobs.ravel()) >= 0.0).all()


def test_a_place_far_beside_the_line_is_told_as_the_farthest_that_a_message_holds(room):
    program = POST["Post"](room, BASE).programs["c1"]
    told = {}
    for value_px in (900.0, -900.0, 190.0, float("nan")):  # half the line is 160 px wide
        frame = POST["Frame"](1, 1.0 / RATE_HZ, "c1", lambda: None, Measured(Reading(value_px)))
        (send,) = program.on_frame(POST["Context"]("c1", 0.1, 1.0), frame).sends
        told[value_px] = ScanLinePayload.decode(send.payload.encode()).share
    assert list(told.values()) == [1.25, -1.25, pytest.approx(190.0 / 160.0, abs=4e-5), None]
