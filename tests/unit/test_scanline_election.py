"""Heads by election: who is chosen, who hears of it, and what happens where somebody does not."""

import math
import runpy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from wsnsim.messages.scanline import (
    EnergyPayload,
    HandoverPayload,
    HeadPayload,
    PlacesPayload,
    ScanLinePayload,
    TrackPayload,
)
from wsnsim.systems.scanline.election import chosen
from wsnsim.systems.scanline.offices import Office, Offices, announced

POST = runpy.run_path(str(Path(__file__).parents[1] / "scanline_post.py"))
RATE_HZ = POST["RATE_HZ"]
ELECTED = ("system.head={kind: elected, period_s: 1}",)
FIRST = 1 + 1 + 3 + 1
"""Frame from which the first elected head tracks: decided in frame 1, told in three, changed at the next."""


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return POST["room"](tmp_path_factory.mktemp("room"))


def heads(post):
    """Return whose reports went where: receivers of each frame's reports."""
    where = {}
    for said in post.said:
        if isinstance(said.payload, ScanLinePayload):
            where.setdefault(said.payload.step, set()).add(said.to)
    return where


def tracks(post):
    """Return who sent the track of each frame."""
    return {(said.payload.step, said.source) for said in post.said if isinstance(said.payload, TrackPayload)}


@pytest.mark.parametrize(
    ("left_j", "head", "expected"),
    [
        ({0: 5.0, 1: 6.0}, 9, 1),
        ({0: 5.0, 1: 5.05}, 0, 0),
        ({0: 5.0, 1: 5.2}, 0, 1),
        ({0: 5.0, 1: 5.0}, 9, 0),
        ({1: 5.0, 0: 5.0}, 9, 0),
        ({1: 5.0}, 0, 1),
        ({0: math.inf, 1: math.inf}, 1, 1),
        ({0: math.inf, 1: math.inf}, 9, 0),
        ({0: 7.0, 1: math.inf}, 0, 1),
        ({0: 0.0, 1: 0.0}, 1, 1),
        ({}, 3, 3),
    ],
)
def test_the_fullest_is_chosen_but_for_a_head_that_has_almost_as_much(left_j, head, expected):
    assert chosen(left_j, head, 0.02) == expected


def test_terms_are_counted_in_eight_bits():
    for term in range(256):
        for ahead in range(256):
            later = Office((term + ahead) % 256, 0, 0).later_than(Office(term, 0, 0))
            assert later == (0 < ahead < 128)


def test_a_term_begins_at_its_first_frame():
    offices = Offices(Office(3, 1, 40), Office(2, 7, 10))
    assert [offices.head_at(step) for step in (39, 40)] == [7, 1]
    assert offices.after(Office(3, 5, 50)) == offices
    assert offices.after(Office(2, 5, 50)) == offices
    assert [offices.after(Office(4, 5, 50)).head_at(step) for step in (49, 50)] == [1, 5]


@pytest.mark.parametrize(("first", "heard_at"), [(300, 295), (300, 305), (255, 258), (256, 250)])
def test_the_first_frame_is_told_by_a_byte(first, heard_at):
    payload = HeadPayload.decode(Office(1, 2, first).payload().encode())
    assert announced(payload, heard_at) == Office(1, 2, first)


def test_all_change_to_the_fullest_at_the_same_frame(room):
    post = POST["Post"](room, ELECTED)
    post.battery_j["c3"] = 120.0
    post.run()
    assert heads(post) == {step: {"base"} if step < FIRST else {"c3"} for step in range(1, 31)}
    assert tracks(post) == {(step, "c3") for step in range(FIRST, 31)}
    assert sorted(errors := post.errors_m()) == list(range(1, 31))
    assert all(node == "base" for node, _, _ in post.told)
    assert {kind for _, _, kind in post.notes} >= {"head_elected", "handed_over", "head_kept"}
    # what was handed over is as good as what a head for all of the run knows
    assert max(errors[step] for step in range(FIRST, 31)) < 0.6


def test_the_head_changes_when_it_has_spent_more_than_others(room):
    """Each track costs 3 J of 100: the next election finds another fuller, each in turn."""

    def drain(said):
        if isinstance(said.payload, TrackPayload):
            post.battery_j[said.source] -= 3.0
        return False

    post = POST["Post"](room, ELECTED, drain)
    post.run()
    who = [source for _, source in sorted(tracks(post))]
    assert [name for k, name in enumerate(who) if k == 0 or name != who[k - 1]] == ["c1", "c2", "c3", "c4"]
    assert len(who) == len(set(tracks(post))) == 30 - FIRST + 1
    handed = [said for said in post.said if isinstance(said.payload, HandoverPayload)]
    assert [(said.source, said.to) for said in handed] == [
        ("base", "c1"),
        ("c1", "c2"),
        ("c2", "c3"),
        ("c3", "c4"),
    ]
    assert max(post.errors_m()[step] for step in range(FIRST, 31)) < 0.6
    assert "handover_late" not in {kind for _, _, kind in post.notes}


def test_mains_is_infinite_and_wins(room):
    post = POST["Post"](room, ELECTED)
    post.battery_j["c2"] = math.inf
    post.run()
    energies = {said.payload.left_j for said in post.said if isinstance(said.payload, EnergyPayload)}
    assert energies == {100.0, math.inf}
    assert {source for _, source in tracks(post)} == {"c2"}


def test_a_lost_announcement_to_the_new_head_is_made_good_by_the_handover(room):
    post = POST["Post"](room, ELECTED, lambda said: isinstance(said.payload, HeadPayload) and said.to == "c1")
    post.run()
    assert tracks(post) >= {(step, "c1") for step in range(FIRST + 1, 31)}
    assert post.errors_m()[30] < 0.6


def test_without_announcement_and_handover_the_head_is_announced_again(room):
    """The cameras have changed; the new head knows nothing until it is told a second later."""

    def lost(said):
        return isinstance(said.payload, HeadPayload | HandoverPayload) and said.to == "c1" and said.at < 1.5

    post = POST["Post"](room, ELECTED, lost)
    post.run()
    began = min(step for step, _ in tracks(post))
    assert {source for _, source in tracks(post)} == {"c1"}
    assert FIRST < began <= 15
    kinds = Counter(kind for _, _, kind in post.notes)
    assert kinds["report_astray"] > 0
    # the object is found again by particles all over the room
    assert post.errors_m()[30] < 0.6


def test_an_old_head_that_has_not_heard_goes_on_and_is_told(room):
    """c1 is head, then c2; c1 hears nothing of it from the broadcast, and is told when its track comes."""

    def lost(said):
        if isinstance(said.payload, TrackPayload) and said.source == "c1":
            post.battery_j["c1"] = 1.0
        late = isinstance(said.payload, HeadPayload) and said.payload.term == 2
        return late and said.to == "c1" and said.source == "base" and said.at < 1.7

    post = POST["Post"](room, ELECTED, lost)
    post.run()
    second = min(step for step, source in tracks(post) if source == "c2")
    both = {step for step, _ in tracks(post) if {(step, "c1"), (step, "c2")} <= tracks(post)}
    assert 0 < len(both) <= 4
    assert {source for step, source in tracks(post) if step > second + 5} == {"c2"}
    # of two tracks of a frame the new head's is believed
    made = Counter(round(estimate.time * RATE_HZ) for _, estimate, _ in post.told)
    assert set(made.values()) == {1}


def test_a_camera_that_has_not_heard_is_told_by_who_gets_its_report(room):
    def lost(said):
        return isinstance(said.payload, HeadPayload) and said.to == "c4" and said.at < FIRST / RATE_HZ

    post = POST["Post"](room, ELECTED, lost)
    post.run()
    wrong = [step for step, where in heads(post).items() if step >= FIRST and where != {"c1"}]
    assert wrong == [FIRST]
    assert Counter(kind for _, _, kind in post.notes)["report_astray"] == 1


def test_without_a_handover_the_new_head_begins_with_an_object_that_may_be_anywhere(room):
    post = POST["Post"](
        room, (*ELECTED, "system.start=given"), lambda s: isinstance(s.payload, HandoverPayload)
    )
    post.run()
    assert "handed_over" not in {kind for _, _, kind in post.notes}
    assert sorted(tracks(post)) == [(step, "c1") for step in range(FIRST, 31)]
    assert post.errors_m()[30] < 0.6


def test_a_handover_that_comes_when_the_new_head_tracks_is_no_longer_wanted(room):
    payloads = []

    def late(said):
        if isinstance(said.payload, HandoverPayload):
            payloads.append(said)
            return True
        return False

    post = POST["Post"](room, ELECTED, late)
    post.run()
    (said,) = payloads
    program = post.programs["c1"]
    base = POST["Received"]("base", said.payload)
    step = program.on_payload(POST["Context"]("c1", 4.0, 100.0), base)
    assert [note.kind for note in step.notes] == ["handover_late"]


def test_a_dead_head_is_followed_by_another_at_the_next_election(room):
    def dies(said):
        if isinstance(said.payload, TrackPayload) and said.payload.step == 10:
            post.dead.add("c1")
        return False

    post = POST["Post"](room, ("duration_s=4", "system.head={kind: elected, period_s: 2}"), dies)
    post.battery_j["c1"] = 101.0
    post.run()
    assert {source for _, source in tracks(post)} == {"c1", "c2"}
    assert post.errors_m()[30] < 0.6
    # meanwhile the base station goes on from the last track
    assert {estimate.basis.value for _, estimate, _ in post.told} == {"update", "timed_out"}


def test_a_head_too_busy_to_say_what_it_has_left_stays(room):
    """Its tracks show that it lives."""

    def silent(said):
        return isinstance(said.payload, EnergyPayload) and said.source == "c1" and said.payload.election > 0

    post = POST["Post"](room, ELECTED, silent)
    post.run()
    assert {source for _, source in tracks(post)} == {"c1"}


def test_nobody_is_elected_where_nobody_is_heard(room):
    post = POST["Post"](room, ELECTED, lambda said: isinstance(said.payload, EnergyPayload))
    post.run()
    assert set().union(*heads(post).values()) == {"base"}
    assert {kind for _, _, kind in post.notes if kind.startswith("head")} == {"head_kept"}
    assert len(post.told) == 30


def test_occluders_places_change_heads_too(room):
    post = POST["Post"](room, (*ELECTED, "system.priors.kind=kalman"))
    post.run()
    where = {
        said.to
        for said in post.said
        if isinstance(said.payload, PlacesPayload) and said.payload.step >= FIRST
    }
    assert where <= {"c1"}
    assert np.mean([error for step, error in post.errors_m().items() if step > 3]) < 0.3


def test_until_the_new_head_is_heard_the_base_station_reckons_from_what_it_believed_as_head(room):
    def lost(said):
        return isinstance(said.payload, HeadPayload | HandoverPayload) and said.to == "c1" and said.at < 1.5

    post = POST["Post"](room, ELECTED, lost)
    post.run()
    assert sorted(post.errors_m()) == list(range(1, 31))
    gap = range(FIRST, min(step for step, _ in tracks(post)))
    reckoned = [e for _, e, _ in post.told if e.basis.value == "timed_out"]
    assert [round(estimate.time * RATE_HZ) for estimate in reckoned] == list(gap)
    assert post.errors_m()[FIRST] < 0.5
