"""Who was heard, and what became of the answers that were not, in tables small enough to count by hand."""

import runpy
from pathlib import Path

import pytest

from wsnsim.metrics.answers import (
    BUSY,
    DEAD,
    LATE,
    REFUSED,
    SILENT,
    UNREADY,
    UNTOLD,
    answers,
    heard_share,
    unready,
)

bench = runpy.run_path(str(Path(__file__).parents[1] / "answers_bench.py"))
answer, state, estimate, event, tables = (
    bench[name] for name in ("answer", "state", "estimate", "event", "tables")
)
CHAIN, WAIT_S = bench["CHAIN"], bench["WAIT_S"]


def told(messages, estimates, **others):
    return answers(tables(messages, estimates, **others), WAIT_S)


def test_the_share_heard_is_that_of_estimates_that_asked():
    found = tables(
        estimates=[
            estimate(1, 4, 3),
            estimate(2, 5, 0, kind="timed_out"),
            estimate(3, 0, 0, kind="unasked"),
            estimate(4, 7, 7, kind="lost"),
        ]
    )
    assert heard_share(found["steps"]) == {"heard_ratio": 3 / 9}
    assert heard_share(found["steps"].tail(2)) == {"heard_ratio": None}


def test_when_all_are_heard_nothing_is_missing():
    done = told([answer(n, f"c{n}", 1) for n in (1, 2, 3)], [estimate(1, 3, 3)])
    assert (done.asked, done.heard, dict(done.missing)) == (3, 3, {})
    assert done.ready_s == pytest.approx(0.1)
    assert (done.estimates, done.waited) == (1, 0)


REASONS = {
    "lost on the way": (answer(3, "c3", 1, outcome="dropped_no_ack"), {}, "dropped_no_ack"),
    "handed over too late": (answer(3, "c3", 1, after=0.24, outcome="dropped_expired"), {}, UNREADY),
    "handed over too late and lost": (answer(3, "c3", 1, after=0.24, outcome="dropped_queue"), {}, UNREADY),
    "held up in the network": (answer(3, "c3", 1, outcome="dropped_expired"), {}, LATE),
    "still on its way": (answer(3, "c3", 1, outcome="in_flight"), {}, LATE),
    "there after the estimate": (answer(3, "c3", 1, after=0.22), {}, LATE),
    "no image": (None, {"events": [event("frame_skipped", "c3", 1)]}, BUSY),
    "no state": (state(3, 1, "c3", "dropped_not_heard"), {}, UNTOLD),
    "stopped before": (None, {"died_s": {"c3": 0.2}}, DEAD),
    "stopped after": (None, {"died_s": {"c3": 0.3}}, SILENT),
    "refused": (answer(3, "c3", 1), {"events": [event("mixture_refused", "base", 1)]}, REFUSED),
    "nothing is known": (None, {}, SILENT),
}


@pytest.mark.parametrize("case", REASONS)
def test_the_reason_of_a_missing_answer_is_found(case):
    row, others, reason = REASONS[case]
    rows = [answer(1, "c1", 1), answer(2, "c2", 1)] + ([] if row is None else [row])
    done = told(rows, [estimate(1, 3, 2, latency_s=WAIT_S)], **others)
    assert dict(done.missing) == {reason: 1}
    assert done.waited == 1


def test_an_answer_that_takes_longer_than_a_period_is_to_the_image_before_those_skipped():
    """c1 works 0.3 s on each image and so takes only every second; the base station waits 0.225 s."""
    rows = [answer(k, "c1", k, after=0.3, outcome="dropped_expired") for k in (1, 3)]
    done = told(
        rows,
        [estimate(k, 1, 0, kind="timed_out") for k in (1, 2, 3, 4)],
        events=[event("frame_skipped", "c1", k) for k in (2, 4)],
        unseen=[(camera, k) for camera in ("c2", "c3") for k in (1, 2, 3, 4)],
    )
    assert dict(done.missing) == {UNREADY: 2, BUSY: 2}
    assert done.slow_s == pytest.approx({"c1": 0.3})
    assert done.ready_s == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("end", "reason"),
    [("dropped_no_ack", "dropped_no_ack"), ("dropped_expired", LATE), ("dropped_refused", "dropped_refused")],
)
def test_what_was_fused_shares_the_reason_at_the_end_of_its_chain(end, reason):
    """The answer of c3 goes into that of c2, which goes into that of c1."""
    rows = [
        answer(1, "c3", 1, "c2", 0.10, "fused", 2),
        answer(2, "c2", 1, "c1", 0.12, "fused", 3),
        answer(3, "c1", 1, "base", 0.14, end),
    ]
    done = told(rows, [estimate(1, 3, 0, WAIT_S, "timed_out")], parents=CHAIN)
    assert dict(done.missing) == {reason: 3}
    # only what nothing was fused into tells how long an answer takes
    assert done.ready_s == pytest.approx(0.10)


def test_who_only_passes_on_was_not_asked():
    rows = [answer(1, "c3", 1, "c2", 0.10, "fused", 2), answer(2, "c2", 1, "c1", 0.12, "dropped_no_ack")]
    done = told(rows, [estimate(1, 2, 1)], parents=CHAIN, unseen=[("c2", 1)])
    assert dict(done.missing) == {"dropped_no_ack": 1}


def test_no_more_reasons_are_given_than_answers_miss_and_sure_ones_first():
    """c2 and c3 did not hear the state, but only one more than c1 was asked."""
    rows = [
        answer(1, "c1", 1, outcome="dropped_no_ack"),
        state(2, 1, "c2", "dropped_not_heard"),
        state(2, 1, "c3", "dropped_not_heard"),
    ]
    assert dict(told(rows, [estimate(1, 2, 0)]).missing) == {"dropped_no_ack": 1, UNTOLD: 1}
    assert dict(told(rows, [estimate(1, 1, 0)]).missing) == {"dropped_no_ack": 1}


def test_a_camera_that_answered_just_before_counts_as_asked_though_the_target_has_left_its_view():
    rows = [answer(1, "c1", 1)]
    unseen = [(camera, 2) for camera in ("c1", "c2", "c3")]
    done = told(
        rows, [estimate(1, 1, 1), estimate(2, 1, 0)], events=[event("frame_skipped", "c1", 2)], unseen=unseen
    )
    assert dict(done.missing) == {BUSY: 1}


def test_a_message_on_two_targets_holds_two_answers():
    rows = [answer(1, "c1", 1, outcome="dropped_no_ack", kind="batch")]
    both = [estimate(1, 1, 0, target=target) for target in ("box", "cart")]
    assert dict(told(rows, both).missing) == {"dropped_no_ack": 2}


def test_what_is_said_in_a_search_is_no_answer():
    rows = [answer(1, "c1", 1, outcome="dropped_no_ack", kind="sighting")]
    done = told(rows, [estimate(1, 1, 0)])
    assert dict(done.missing) == {SILENT: 1}
    assert done.ready_s is None


def test_messages_that_come_too_late_from_their_mote_are_known():
    found = tables(
        [answer(1, "c1", 1, after=0.2), answer(2, "c2", 1, after=0.24), state(3, 2, "c1")],
        [estimate(1, 3, 1)],
    )
    assert unready(found, WAIT_S).tolist() == [False, True, False]


def test_a_run_without_messages_or_estimates_has_no_answers():
    done = told([], [estimate(1, 0, 0, kind="unasked")])
    assert (done.asked, done.heard, dict(done.missing), done.ready_s) == (0, 0, {}, None)
