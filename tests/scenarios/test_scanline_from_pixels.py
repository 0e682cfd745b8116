"""The room of scan lines through pixels: what cameras send decides what it costs, hardly what it is worth."""

import numpy as np
import pytest

from wsnsim.runs.run import run

SMALL = (
    "cameras={only: [c1, c3, c5, c7]}",
    "cameras[*].resolution_px=[240, 180]",
    "cameras[*].focal_px=120",
    "world.people[walker].count=6",
    "duration_s=4",
    "system.front_end={kind: pixels}",
)
IDEAL = "network={standard: ideal}"
RADIO = "network={standard: ieee802154, propagation: {kind: log_distance, exponent: 3.0}}"


@pytest.fixture(scope="module")
def runs(scenarios):
    """Return runs over an ideal network by what cameras send."""
    room = scenarios / "published" / "scanline_room.yaml"
    return {
        message: run(room, overrides=(*SMALL, IDEAL, f"system.message={message}"))
        for message in ("bearing", "scan_line", "jpeg")
    }


def test_the_object_is_followed_through_pixels(runs):
    """The poses are exact here: the error is that of a body of .33 m radius half hidden, far below .4 m."""
    steps = runs["bearing"].steps
    assert steps["error_m"].iloc[5:].median() < 0.2
    assert runs["bearing"].summary["heard_ratio"] == 1.0
    # what cameras really see of it is counted in pixels
    assert steps["pixel_share"].notna().any()


def test_a_whole_line_or_frame_says_the_same_of_the_object(runs):
    np.testing.assert_array_equal(runs["bearing"].steps["error_m"], runs["scan_line"].steps["error_m"])
    # JPEG's losses move the middle by a pixel or two
    difference = runs["bearing"].steps["error_m"] - runs["jpeg"].steps["error_m"]
    assert difference.abs().median() < 0.1


def test_bytes_are_those_of_the_messages(runs):
    messages = {name: each.messages for name, each in runs.items()}
    assert set(messages["bearing"]["bytes"]) == {4}
    lines = messages["scan_line"]["bytes"]
    assert ((lines - 5) % 4 == 0).all()
    assert lines.max() > 5
    images = messages["jpeg"]
    assert set(images["kind"]) == {"image_part"}
    per_frame = images.groupby(["source", "created_s"])["bytes"].sum()
    assert len(per_frame) == 4 * 30
    # less than the pixels themselves, and never the same file twice
    assert per_frame.max() < 240 * 180 * 3
    assert per_frame.nunique() > 60


def test_who_sends_frames_computes_less_and_the_head_more(runs):
    cycles = {name: each.nodes.set_index("node")["cpu_cycles"] for name, each in runs.items()}
    assert cycles["jpeg"]["base"] > 5 * cycles["bearing"]["base"]
    assert cycles["scan_line"]["c1"] == cycles["bearing"]["c1"]


def test_frames_do_not_fit_the_radio(scenarios):
    """Four cameras at 7.5 Hz make far more than 250 kbit/s; bearings hardly fill it."""
    room = scenarios / "published" / "scanline_room.yaml"
    short = tuple("duration_s=2" if each.startswith("duration_s") else each for each in SMALL)
    bearings, frames = (
        run(room, overrides=(*short, RADIO, f"system.message={message}")) for message in ("bearing", "jpeg")
    )
    assert bearings.summary["heard_ratio"] > 0.95
    assert frames.summary["heard_ratio"] < 0.2
    joules = [float(each.nodes["energy_radio_tx_j"].sum()) for each in (bearings, frames)]
    assert joules[1] > 5 * joules[0]
