"""A cluster head that cannot keep up says so, whoever it is; and what a report says of a scan-line run."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

import wsnsim
from wsnsim.messages.scanline import EnergyPayload
from wsnsim.metrics.conservation import violations
from wsnsim.report.heads import overwork
from wsnsim.runs.report_context import particles_key
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.systems.base import Context
from wsnsim.systems.scanline import hull
from wsnsim.systems.scanline.choices import ElectedHead
from wsnsim.systems.scanline.election import Election
from wsnsim.systems.scanline.occlusion import NoKnowledge
from wsnsim.systems.scanline.offices import Office
from wsnsim.systems.scanline.sources import Heard, source_for
from wsnsim.systems.scanline.stage import stage_of

POST = runpy.run_path(str(Path(__file__).parents[1] / "scanline_post.py"))
RATE_HZ, STEPS = POST["RATE_HZ"], 60
SLOW = ("system.priors={kind: stationary}", "system.tracker.particles=4000", "duration_s=8")
"""Half a second of work for a frame on a mote."""
HEADS = {
    "the base station": ("motes.base.platform=imote2_416",),
    "c3": ("system.head={kind: node, id: c3}",),
    "r": ("system.head={kind: node, id: r}", "motes.nodes=[{id: r, position_m: [4, 2, 2]}]"),
    "c1": ("system.head={kind: elected, period_s: 60}",),
}


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return POST["room"](tmp_path_factory.mktemp("room"))


@pytest.fixture(scope="module", params=HEADS)
def overworked(request, room, tmp_path_factory):
    """Return the name of a head that is too slow, its run, and its report's text."""
    folder = tmp_path_factory.mktemp("overworked") / "run"
    result = wsnsim.run(room, overrides=(*SLOW, *HEADS[request.param]), out=folder)
    return request.param, result, (folder / "report.html").read_text("utf-8").replace("\u202f", " ")


def test_every_frame_that_a_busy_head_leaves_out_is_an_event(overworked):
    head, result, _ = overworked
    events = result.tables["events"].query("kind == 'frame_left_out'")
    assert set(events["node"]) == {"base" if head == "the base station" else head}
    assert 10 < len(events) < STEPS
    frames = events["step"].astype(int)
    assert frames.is_unique
    assert events["detail"].str.extract(r"^frame (\d+): the processor was busy until")[0].astype(
        int
    ).tolist() == (frames.tolist())
    # nobody knows before its deadline that a frame is left out
    assert (events["time_s"] > frames / RATE_HZ).all()
    kinds = result.steps.set_index("step")["kind"]
    assert set(kinds[frames]) == {"skipped"}
    assert set(kinds[kinds == "skipped"].index) == set(frames)


def test_all_steps_are_accounted_for(overworked):
    _, result, _ = overworked
    figures = result.summary
    measured = int((result.steps["kind"] == "update").sum())
    left_out = int((result.tables["events"]["kind"] == "frame_left_out").sum())
    assert figures["skipped_steps"] == left_out
    assert figures["unmeasured_steps"] == figures["missed_deadlines"] + figures["skipped_steps"]
    assert measured + figures["unmeasured_steps"] == figures["steps"] == STEPS
    assert violations(result.tables, figures["simulated_s"]) == []


def test_the_report_says_at_its_top_who_was_too_slow_and_what_helps(overworked):
    head, result, page = overworked
    (said,) = overwork(result.tables, result.summary["simulated_s"], "system.tracker.particles")
    said = said.replace("\u202f", " ")
    node = result.nodes.set_index("node").loc["base" if head == "the base station" else head]
    left_out = result.summary["skipped_steps"]
    assert said.startswith(
        f"{head[0].upper() if ' ' in head else head[0]}{head[1:]} could not keep up with tracking: "
        f"{left_out} frames of {STEPS} were left out because the processor was still busy"
    )
    assert 0.3 < node["work_longest_s"] < 3.0
    assert f"A step takes {head} up to " in said
    assert "a frame period is 133 ms: take fewer particles (system.tracker.particles)" in said
    assert ("or the base station as head (system.head={kind: base})." in said) == (head != "the base station")
    images = int(node["images_skipped"])
    assert (f"; {images} images of its own were skipped as well." in said) == (head in ("c1", "c3"))
    assert f'<p class="alert" role="note">{said}</p>' in page
    assert "frames that a tracker left out because its processor was still busy" in page
    # its own images are told of with that, not as if to look were too much
    assert page.count("could not keep up") == 1


def test_a_head_that_keeps_up_says_nothing(room):
    result = wsnsim.run(room, overrides=HEADS["r"])
    assert "frame_left_out" not in set(result.tables["events"]["kind"])
    assert overwork(result.tables, 4.0, None) == []
    assert result.summary["skipped_steps"] == 0


def test_work_that_is_too_much_only_in_sum_is_told_as_that(room):
    """To look takes less than a frame period, to track as well; together they take more."""
    result = wsnsim.run(room, overrides=(*SLOW, *HEADS["c3"]))
    tables = dict(result.tables)
    tables["nodes"] = tables["nodes"].assign(work_longest_s=0.12, cpu_busy_s=4.0, died_at_s=math.nan)
    (said,) = overwork(tables, 5.0, None)
    assert (
        "All work on a frame takes c3 more than a frame period, 133 ms, and it worked for 80.0 % of its "
        "time: take a faster platform or the base station as head (system.head={kind: base})."
    ) in said.replace("\u202f", " ")


@pytest.mark.parametrize(
    ("tracker", "key"), [("{kind: plain}", "system.tracker.particles"), ("{kind: map}", None)]
)
def test_particles_are_named_where_a_tracker_has_them(room, tracker, key):
    assert particles_key(load_scenario(room, (f"system.tracker={tracker}",))) == key


def test_an_election_says_mains_of_a_mote_without_a_battery(room):
    site = build(load_scenario(room)).site
    said = {}
    for left_j in (12.5, math.inf):
        election = Election(ElectedHead(kind="elected"), site, Office(0, len(site.motes), 0))
        election.take("c2", EnergyPayload(0, left_j))
        (note,) = election.decide(Context("base", 2.0, math.inf)).notes
        said[left_j] = note.detail
    assert "c2 has most, 12.5 J; head from frame" in said[12.5]
    assert "c2 has most, on mains; head from frame" in said[math.inf]


def test_a_tracker_without_orientations_has_no_error_of_them(overworked):
    _, result, page = overworked
    assert result.summary["orientation_error_mean_deg"] is None
    assert result.tables["estimates"][["qw", "qx", "qy", "qz"]].isna().all(axis=None)
    assert "orientation" not in page.split('<script type="application/json"')[0]
    assert "Mean orientation error" not in page


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ((), "message “bearing”, probability of detection 1, 4 cameras, 5 occluders 0.4 m wide"),
        (
            (
                "system.preset=published",
                "system.priors={kind: hull}",
                "system.detected=0.9",
                "world.people=[]",
            ),
            "preset “published”, message “scan line”, probability of detection 0.9, 4 cameras, no occluders",
        ),
        (
            (
                "world.people=[]",
                "system.virtual_occluders={count: 1, diameter_m: 0.25, blocks_m: [[[0, 0], [1, 0], [0, 1]]]}",
            ),
            "4 cameras, 1 virtual occluder 0.25 m wide, 1 virtual block",
        ),
        (("system.message=jpeg", "system.front_end={kind: pixels}"), "message “jpeg”"),
    ],
)
def test_what_decides_a_result_is_told(room, keys, words):
    loaded = load_scenario(room, keys)
    assert words in ", ".join(loaded.system_params.told(build(loaded).site))


def test_a_hull_of_too_many_pieces_leaves_the_frame_without_knowledge(room):
    loaded = load_scenario(room, ("system.priors={kind: hull, margin_px: 0}",))
    source = source_for(loaded.system_params, stage_of(loaded.system_params, build(loaded).site), RATE_HZ)
    ends = np.arange(-160.0, 160.0, 2.0)
    fine, coarse = (
        Heard({}, {k: np.stack([some, some + 1.0], axis=1) for k in range(4)}) for some in (ends, ends[::40])
    )
    knowledge, work = source.knowledge(fine, fine.report(4))
    assert isinstance(knowledge, NoKnowledge)
    other, less = source.knowledge(coarse, coarse.report(4))
    assert not isinstance(other, NoKnowledge)
    # to find that out costs what its blobs do
    assert work.float_ops == less.float_ops * (1 + 4 * 160) / (1 + 4 * 4)


def test_a_run_goes_on_where_hulls_have_too_many_pieces(room, monkeypatch):
    keys = ("system.priors={kind: hull}", "network.standard=ideal")
    before = wsnsim.run(room, overrides=keys)
    monkeypatch.setattr(hull, "_MOST_PIECES", 5)
    result = wsnsim.run(room, overrides=keys)
    events = result.tables["events"]
    unknown = events[events["kind"] == "occluders_unknown"]
    assert len(unknown) > 10
    assert "occluders_unknown" not in set(before.tables["events"]["kind"])
    assert unknown["detail"].str.contains("too many pieces").all()
    assert (result.steps["kind"] == "update").all()
    assert result.messages.equals(before.messages)
    assert result.steps["error_m"].iloc[10:].mean() < 0.3
