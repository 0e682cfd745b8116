"""The report says which it was where answers are missing: processors, the radio, or relays."""

import runpy
from pathlib import Path

import pytest

from wsnsim.report.hearing import hearing, hearing_verdict, readiness

bench = runpy.run_path(str(Path(__file__).parents[1] / "answers_bench.py"))
answer, state, estimate, event, tables, context = (
    bench[name] for name in ("answer", "state", "estimate", "event", "tables", "context")
)
CHAIN, WAIT_S = bench["CHAIN"], bench["WAIT_S"]


def words(messages, estimates, **others):
    said = hearing(context(tables(messages, estimates, **others)), brief=False)
    return " ".join(said).replace("\u202f", " ")


def verdict(messages, estimates, radio_is_told=False, **others):
    said = hearing_verdict(context(tables(messages, estimates, **others)), radio_is_told)
    return " ".join(said).replace("\u202f", " ")


def test_all_heard_is_one_sentence_and_no_verdict():
    rows = [answer(n, f"c{n}", 1) for n in (1, 2, 3)]
    assert words(rows, [estimate(1, 3, 3)]) == "All 3 answers that cameras were asked for were heard."
    assert verdict(rows, [estimate(1, 3, 3)]) == ""
    assert words([], [estimate(1, 0, 0, kind="unasked")]) == ""


def test_what_the_radio_lost_is_told_by_reason():
    rows = [
        answer(1, "c1", 1, outcome="dropped_no_ack"),
        answer(2, "c2", 1),
        state(3, 1, "c3", "dropped_not_heard"),
        *(answer(3 + n, f"c{n}", 2) for n in (1, 2, 3)),
        answer(7, "c1", 3, outcome="dropped_no_ack"),
    ]
    done = [estimate(1, 3, 1, WAIT_S), estimate(2, 3, 3), estimate(3, 1, 0, kind="timed_out")]
    lost = (
        "The 3 missing are down to the radio (2 × never acknowledged, "
        "1 × the camera had not heard the question)."
    )
    assert words(rows, done) == (
        f"Of 7 answers that cameras were asked for, 4 were heard in time (57.1 %). {lost} "
        "1 of 2 estimates from measurements was made only when the base station had waited 225 ms "
        "for missing answers."
    )
    headline = verdict(rows, done)
    assert headline.startswith("The radio kept answers from the base station. Of 7 answers")
    assert headline.endswith(lost)
    assert verdict(rows, done, radio_is_told=True) == ""


SLOW = (
    [answer(k, "c1", k, after=0.3, outcome="dropped_expired") for k in (1, 3)],
    [estimate(k, 1, 0, kind="timed_out") for k in (1, 2, 3, 4)],
)
SKIPPED = [event("frame_skipped", "c1", k) for k in (2, 4)]


def test_a_slow_platform_is_named_with_its_time_and_the_base_stations():
    said = verdict(*SLOW, radio_is_told=True, events=SKIPPED)
    assert said == (
        "The motes' processors are too slow for what they are asked. "
        "Of 4 answers that cameras were asked for, none were heard in time (0 %). "
        "The 4 missing are down to the motes' processors "
        "(2 × ready too late, 2 × of an image that was not taken). "
        "Where it was too late, a mote of platform snail had its answer ready 300 ms after the image "
        "(median); the base station waits 225 ms."
    )
    brief = hearing(context(tables(*SLOW, events=SKIPPED)), brief=True)
    assert " ".join(brief).replace("\u202f", " ") == (
        "Of 4 answers that cameras were asked for, none were heard in time (0 %)."
    )


def test_where_it_is_not_known_how_long_the_base_station_waits_no_processor_is_blamed():
    said = " ".join(hearing(context(tables(*SLOW, events=SKIPPED), wait_s=None), brief=False))
    assert "ready" not in said
    assert "the radio (sent in time, but not there in time)" in said


def test_what_came_too_late_through_relays_is_laid_to_them():
    rows = [
        answer(1, "c3", 1, "c2", 0.10, "fused", 2),
        answer(2, "c2", 1, "c1", 0.22, "dropped_expired"),
        answer(3, "c1", 1),
    ]
    done = [estimate(1, 3, 1, WAIT_S)]
    said = words(rows, done, parents=CHAIN)
    assert "The 2 missing are down to the radio or the wait of relays (sent in time, but" in said
    assert verdict(rows, done, radio_is_told=True, parents=CHAIN).startswith(
        "Answers came through the relays too late."
    )
    # the same without relays
    alone = [answer(1, "c1", 1), answer(2, "c2", 1, outcome="dropped_expired")]
    assert "The missing one is down to the radio (sent in time" in words(alone, [estimate(1, 2, 1)])


@pytest.mark.parametrize(
    ("others", "culprit"),
    [
        ({}, "cameras that had nothing to say"),
        ({"died_s": {"c2": 0.1}}, "motes that had stopped"),
        (
            {"events": [event("ray_refused", "base", 1)]},
            "messages that were of no use and set aside",
        ),
    ],
)
def test_a_culprit_who_says_all_needs_no_reason(others, culprit):
    said = words([answer(1, "c1", 1)], [estimate(1, 2, 1)], **others)
    assert said.endswith(f"(50.0 %). The missing one is down to {culprit}.")


def test_cameras_with_nothing_to_say_are_told_and_no_alarm():
    rows = [answer(1, "c1", 1), state(2, 1, "c3", "dropped_not_heard")]
    assert "Of the 3 missing, 2 are down to cameras that had nothing to say and 1 to the radio (" in words(
        rows, [estimate(1, 4, 1)]
    )
    assert verdict([answer(1, "c1", 1)], [estimate(1, 4, 1)]) == ""


def test_few_missing_answers_are_no_verdict():
    rows = [answer(n, "c1", n) for n in range(1, 11)] + [answer(11, "c1", 11, outcome="dropped_no_ack")]
    unseen = [(camera, k) for camera in ("c2", "c3") for k in range(1, 12)]
    done = [estimate(k, 1, 1) for k in range(1, 11)] + [estimate(11, 1, 0, kind="timed_out")]
    assert "The missing one is down to the radio (never acknowledged)." in words(rows, done, unseen=unseen)
    assert verdict(rows, done, unseen=unseen) == ""


def test_the_time_to_an_answer_ends_a_sentence():
    said = readiness(context(tables([answer(1, "c1", 1)], [estimate(1, 1, 1)])))
    assert said.replace("\u202f", " ") == "; a camera had its answer ready after 100 ms (median)"
    assert readiness(context(tables([], [estimate(1, 1, 0)]))) == ""


def test_what_a_mote_as_cluster_head_missed_is_laid_to_it():
    """Reports go to the mote: none stands among the answers to the base station, nor was one unsaid."""
    rows = [answer(1, "c1", 1, kind="track"), answer(2, "c2", 1, to="c1", kind="scan_line")]
    said = words(rows, [estimate(1, 3, 1)])
    assert "The 2 missing are down to what a mote that was cluster head heard too late" in said
    assert readiness(context(tables(rows, [estimate(1, 3, 1)]))) == ""
