"""The network's report: layouts, rows, tables, and that the same seeds give the same bytes."""

import json
from collections import Counter
from functools import partial
from math import nan

import numpy as np
import pytest
from click.testing import CliRunner

from wsnsim.claims.__main__ import command
from wsnsim.claims.network import dcf, energy, errors, hidden, page, stars, traces, trees
from wsnsim.claims.network.dcf_slots import failures
from wsnsim.claims.network.layouts import (
    LINK_RANGE_M,
    STORED,
    hidden_pair,
    line,
    random_layout,
    read_layout,
    star,
    stored,
)
from wsnsim.claims.network.rows import NS3, Allowed, Estimate, Row, mean_of, peers, record
from wsnsim.claims.network.runs import Case, bed, run
from wsnsim.claims.network.section import Section, section_of, shortened
from wsnsim.errors import OutputError
from wsnsim.net.interface import Outcome
from wsnsim.net.routing.tree import tree_from_parents


def longest_link_m(layout):
    steps = [layout.xy[i] - layout.xy[p] for i, p in enumerate(layout.parent) if p >= 0]
    return max(np.linalg.norm(step) for step in steps)


@pytest.mark.parametrize("name", STORED)
def test_stored_layouts_are_trees_of_short_links(name):
    layout = stored(name)
    assert layout.motes == int(name.removeprefix("rgg_n"))
    assert longest_link_m(layout) <= LINK_RANGE_M
    assert tree_from_parents(layout.parents).root == "n0"


def test_stored_layouts_are_those_of_the_peers(shared):
    for name in STORED:
        theirs = json.loads((shared / "reference" / "radio" / f"{name}.json").read_text())
        ours = stored(name)
        assert ours.xy.tolist() == theirs["xy"]
        assert list(ours.parent) == theirs["parent"]
    assert star(5).xy == pytest.approx(
        np.array(json.loads((shared / "reference" / "radio" / "star_n5.json").read_text())["xy"]), abs=1e-4
    )
    pair = json.loads((shared / "reference" / "radio" / "hidden2.json").read_text())
    assert hidden_pair().xy.tolist() == pair["xy"]
    assert line(5).xy.tolist() == json.loads((shared / "reference/radio/line5.json").read_text())["xy"]


def test_random_layouts_are_of_the_stored_ones_kind(test_seed):
    layout = random_layout(400, test_seed)
    assert longest_link_m(layout) <= LINK_RANGE_M
    tree = tree_from_parents(layout.parents)
    assert len(tree.descendants(tree.root)) == 399
    # a parent is one hop nearer, and no mote within reach is two hops nearer
    depth = np.array([tree.depth[f"n{i}"] for i in range(400)])
    apart = np.linalg.norm(layout.xy[:, None] - layout.xy[None, :], axis=2)
    near = (apart <= LINK_RANGE_M) & ~np.eye(400, dtype=bool)
    least = np.array([depth[row].min() for row in near])
    assert np.all(depth[1:] == least[1:] + 1)
    # pi 50² / 25.583² motes within reach away from the edges
    middle = np.all(np.abs(layout.xy - layout.xy[0]) < layout.xy.max() / 2 - LINK_RANGE_M, axis=1)
    expected = np.pi * LINK_RANGE_M**2 / 25.583**2
    assert near.sum(axis=1)[middle].mean() == pytest.approx(expected, abs=2.0)


@pytest.mark.parametrize(
    "text",
    ["{", "[]", '{"xy": [[0, 0]]}', '{"xy": [[0, 0], [1, 1]], "parent": [-1]}', '{"xy": [], "parent": []}'],
)
def test_a_file_that_is_no_layout_is_refused(tmp_path, text):
    path = tmp_path / "mine.json"
    path.write_text(text)
    with pytest.raises(OutputError, match="must be a JSON object with `xy`"):
        read_layout(path)


def test_a_layout_of_ones_own_is_read(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text('{"xy": [[0, 0], [30, 0]], "parent": [-1, 0], "path_loss": {"exponent": 2.5}}')
    layout = read_layout(path)
    assert (layout.name, layout.motes, layout.propagation.exponent) == ("mine", 2, 2.5)


def test_each_study_has_its_reference():
    for study in (*stars.studies(), *trees.studies(), *hidden.studies()):
        for figure, source in study.allowed:
            assert (study.case.name, figure, source) in peers()


@pytest.mark.parametrize(
    ("ours", "reference", "allowed", "passed"),
    [
        (1.04, 1.0, Allowed(0.05), True),
        (1.06, 1.0, Allowed(0.05), False),
        (104.0, 100.0, Allowed(0.05, relative=True), True),
        (94.0, 100.0, Allowed(0.05, relative=True), False),
        (nan, 100.0, Allowed(0.05, relative=True), False),
        (1.0, 2.0, None, None),
    ],
)
def test_a_row_passes_within_what_is_allowed(ours, reference, allowed, passed):
    row = Row("s", "c", "f", Estimate(ours), NS3, Estimate(reference), allowed)
    assert row.passed is passed


def test_standard_errors_are_those_of_means():
    found = mean_of([1.0, 2.0, 3.0])
    assert (found.value, found.standard_error, found.runs) == (2.0, pytest.approx(1 / np.sqrt(3)), 3)
    assert np.isnan(mean_of([1.0]).standard_error)


def small_sections() -> list[Section]:
    studies = [shortened(trees.studies()[1], 5.0, 2), shortened(stars.studies()[0], 0.5, 2)]
    return [section_of("Small", "Words.", studies), errors.section()]


def test_the_same_seeds_give_the_same_bytes_whatever_the_number_of_processes():
    first = page.computed(small_sections(), workers=1)
    again = page.computed(small_sections(), workers=2)
    text = record([row for rows in first for row in rows])
    assert text == record([row for rows in again for row in rows])
    assert page.page(small_sections(), first) == page.page(small_sections(), again)
    lines = text.splitlines()
    assert len(lines) == 1 + 4 + 5 + 8
    assert lines[1].startswith("Small,rgg_n10 T=1 sinr end_of_window,pdr,")
    shown = page.page(small_sections(), first)
    assert "## Small\n\nWords.\n" in shown
    assert shown.count("✓") + shown.count("✗") - 2 == sum(
        row.passed is not None for rows in first for row in rows
    )


def test_the_command_writes_page_and_table_and_says_whether_all_holds(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "SECTIONS", (errors.section,))
    said = CliRunner().invoke(command, ["network", "--out", str(tmp_path), "--workers", "1"])
    assert said.exit_code == 0, said.output
    assert "8 of 8" in (tmp_path / "network.md").read_text()
    assert (tmp_path / "network.csv").read_text().count(",true\n") == 8

    wrong = Section("Wrong", "Words.", (partial(float, 1),), lambda results: [_wrong(results[0])])
    monkeypatch.setattr(page, "SECTIONS", (lambda: wrong,))
    said = CliRunner().invoke(command, ["network", "--out", str(tmp_path), "--workers", "1"])
    assert said.exit_code == 1
    assert "✗ |" in (tmp_path / "network.md").read_text()


def _wrong(value):
    return Row("Wrong", "case", "figure", Estimate(value), NS3, Estimate(2.0), Allowed(0.5))


def test_every_packet_of_a_test_bench_is_accounted_for():
    network = bed(stored("rgg_n50"), 3, "destructive")
    network.periodic(0.2, 10, bytes(100))
    seen = []
    for until_s in (0.5, 1.0, 2.5, 10.0):
        network.run(until_s)
        tally = network.tally()
        assert tally.queued >= 0
        seen.append(tally.queued)
        assert tally.generated == tally.delivered + sum(tally.dropped.values()) + tally.queued
    assert seen[0] > 0
    assert seen[-1] == 0
    assert tally.generated == 49 * 10
    assert {Outcome.CHANNEL, Outcome.NO_ACK} >= {o for o in tally.dropped if o is not Outcome.QUEUE}
    assert tally.counters.attempts >= tally.delivered
    assert np.all(tally.delays_s >= 4.064e-3 - 1e-9)


def test_packets_of_one_hop_go_to_the_parent():
    layout = line(4)
    network = bed(layout, 0, record_frames=True)
    network.periodic(1.0, 5, bytes(10), one_hop=True)
    network.run(10.0)
    sent = Counter((row.sender, row.receiver) for row in network.frames if row.kind == "data")
    assert sent.keys() == {("n1", "n0"), ("n2", "n1"), ("n3", "n2")}
    assert network.tally().delivered == 15


def test_a_saturated_sender_never_rests():
    figures = run(Case("star_n1", None, 5.0), 0)
    assert figures["attempt_fails"] == figures["cca_busy"] == 0.0
    assert figures["throughput_kbps"] == pytest.approx(125.6, rel=0.03)


def test_bianchis_model_of_one_station_is_a_cycle_of_fixed_parts():
    """Data 192 + 8288/11 µs, SIFS, ACK 304 µs, DIFS and 15.5 slots in the mean."""
    assert dcf.bianchi(1) == (pytest.approx(2 / 33), 0.0)
    cycle_ms = 0.192 + 8e-3 * 1036 / 11 + 0.010 + 0.304 + 0.050 + 15.5 * 0.020
    assert dcf.model_kbps(1) == pytest.approx(8000 / cycle_ms, rel=1e-3)
    chances = [dcf.bianchi(n)[1] for n in (2, 5, 10, 20)]
    assert chances == sorted(chances)
    # with two stations one collides where the other sends
    assert chances[0] == pytest.approx(dcf.bianchi(2)[0])


def test_counters_that_stand_still_in_busy_slots(test_seed):
    """Two that draw 0 or 1: both are due at the beginning of each idle slot.

    They collide once, and again with 1/4: 8/3 attempts fail. In 2 cases of 3 one
    of them is left over and sends 2 times in the mean: 4/3 attempts do not.
    """
    rng = np.random.default_rng(test_seed)
    assert failures(1, [32], 1000, rng) == 0.0
    assert failures(3, [1, 1], 1000, rng) == 1.0
    # per slot 4 attempts; the share's standard error over 25,000 slots is below 0.003
    assert failures(2, [2], 100_000, rng) == pytest.approx(2 / 3, abs=0.01)
    # with windows that hardly overlap in time Bianchi's chain is near
    assert failures(5, dcf.WINDOWS.tolist(), 100_000, rng) == pytest.approx(dcf.bianchi(5)[1], rel=0.03)


def test_the_rows_of_energy_hold():
    hop = energy.one_hop()
    assert hop["send_uj"] == pytest.approx(195.4, rel=1e-3)
    assert hop["hear_uj"] == pytest.approx(211.2, rel=1e-3)
    assert hop["unaccounted_ns"] == 0.0
    assert energy.latency_ms(1.0) == pytest.approx(500.0, rel=0.02)


def test_traces_that_are_not_there_are_named(tmp_path):
    said = CliRunner().invoke(command, ["network", "--out", str(tmp_path), "--data", str(tmp_path)])
    assert said.exit_code == 1
    assert "meyer-heavy.txt: the trace must exist" in said.output
    with pytest.raises(OutputError):
        traces.section(tmp_path)
