"""Words on what arrived count what was fused by what became of its content."""

import runpy
from pathlib import Path

import pytest

from wsnsim.report.losses import delivery, network_verdict, offered_load, wanted_bps
from wsnsim.report.rows import message_notes, message_rows

bench = runpy.run_path(str(Path(__file__).parents[1] / "answers_bench.py"))
answer, state, estimate, tables, context = (
    bench[name] for name in ("answer", "state", "estimate", "tables", "context")
)
CHAIN = bench["CHAIN"]
FIGURES = {
    "channel_bps": 250_000.0,
    "offered_bps": 1_000.0,
    "unmeasured_steps": 0,
    "mac_bytes_per_step": 700.0,
    "base_ingress_bytes_per_step": 90.0,
    "delivery_ratio": 1 / 3,
    "delivery_ratio_down": 1.0,
}


def up_the_chain(last, after=0.14):
    """Return two steps of three cameras: at the first all arrives, at the second the last message ends so."""
    ends = [("delivered", 0.14), (last, after)]
    return [
        row
        for step, (end, created) in enumerate(ends, 1)
        for row in (
            answer(3 * step, "c3", step, "c2", 0.10, "fused", 3 * step + 1),
            answer(3 * step + 1, "c2", step, "c1", 0.12, "fused", 3 * step + 2),
            answer(3 * step + 2, "c1", step, "base", created, end),
        )
    ]


def told(rows, parents=CHAIN, **figures):
    steps = [estimate(1, 3, 3), estimate(2, 3, 0, kind="timed_out")]
    return context(tables(rows, steps, parents=parents), **{**FIGURES, **figures})


def plain(said):
    return " ".join(said).replace("\u202f", " ")


def test_fused_messages_count_by_what_became_of_their_content():
    (said,) = network_verdict(told(up_the_chain("dropped_no_ack"), unmeasured_steps=1))
    said = said.replace("\u202f", " ")
    assert "50.0 % of the mixture messages arrived; 1 of 2 steps had no measurement at all." in said
    assert said.endswith("What became of most lost mixture messages (100 %): never acknowledged.")
    assert network_verdict(told(up_the_chain("delivered"))) == []


def test_what_was_handed_over_too_late_is_not_laid_to_the_network():
    late = [answer(1, "c1", 1), answer(2, "c1", 2, after=0.24, outcome="dropped_expired")]
    assert network_verdict(told(late)) == []
    assert len(network_verdict(told([late[0], answer(2, "c1", 2, outcome="dropped_expired")]))) == 1


def test_messages_on_their_way_hop_by_hop_are_called_so():
    assert plain(delivery(told(up_the_chain("dropped_no_ack")))) == (
        "33.3 % of the messages on the way to the base station arrived there, by themselves or in another."
    )
    star = told([answer(1, "c1", 1)], parents=bench["STAR"])
    assert plain(delivery(star)) == "33.3 % of the messages to the base station arrived."


def test_the_load_of_messages_that_go_hop_by_hop_is_not_compared_unwarned():
    said = plain(offered_load(told(up_the_chain("delivered"))))
    assert "is counted there at every hop" in said
    assert "the data on the air, 700 B a step, and what reached the base station, 90.0 B a step." in said
    assert "hop" not in plain(offered_load(told([answer(1, "c1", 1)], parents=bench["STAR"])))


def test_the_wanted_load_is_that_of_one_message_of_each_camera_at_each_step():
    """Three cameras of 30 bytes and one state of 32 at each of two steps, in half a second."""
    rows = [answer(1, "c1", 1), state(2, 1, "c1"), state(2, 1, "c2")]
    star = told(rows, parents=bench["STAR"])
    assert wanted_bps(star) == pytest.approx(8 * 2 * (3 * 30 + 32) / 0.5)
    # two targets in a message do not make two messages
    both = [estimate(k, 3, 3, target=target) for k in (1, 2) for target in ("box", "cart")]
    assert wanted_bps(context(tables(rows, both), **FIGURES)) == wanted_bps(star)
    assert wanted_bps(told(up_the_chain("delivered"))) == 0.0


def test_the_table_tells_whose_content_arrived():
    rows = [tuple(cell.replace("\u202f", " ") for cell in row) for row in message_rows(told(
        up_the_chain("dropped_refused")))]  # fmt: skip
    assert rows == [
        ("mixture", "reached the next node and went on in its message", "4", "66.7 %", "2", "120 B"),
        ("mixture", "arrived", "1", "16.7 %", "1", "30.0 B"),
        ("mixture", "set aside by a relay's program", "1", "16.7 %", "0", "30.0 B"),
    ]


def test_batches_are_told_apart_by_their_direction_and_kinds_are_explained():
    down = (2, "batch", "base", "c1", 0.0, 0.1, 60, "delivered", None)
    found = told([answer(1, "c1", 1, kind="batch"), down, answer(3, "c2", 1, kind="ray")])
    assert [row[0] for row in message_rows(found)] == ["downward batch", "ray", "upward batch"]
    assert message_notes(found) == (
        "downward batch: states of several targets in one message; "
        "ray: the direction in which a camera sees the target; "
        "upward batch: answers about several targets in one message."
    )
    assert message_notes(told([answer(1, "c1", 1, kind="gossip")])) == ""
