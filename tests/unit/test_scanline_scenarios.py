"""The scan-line system as a user meets it: a small room, its options, its messages, its extremes."""

import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import wsnsim
from wsnsim.metrics.conservation import violations

POST = runpy.run_path(str(Path(__file__).parents[1] / "scanline_post.py"))
IDEAL = ("network.standard=ideal",)
STEPS, PEOPLE = 30, 5
DISC = "{kind: cylinder, semi_axes_m: [0.2, 0.2, 0.9]}"


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return POST["room"](tmp_path_factory.mktemp("room"))


def run(room, *overrides):
    return wsnsim.run(room, overrides=overrides)


def told(result, kind):
    """Return the messages of a kind."""
    return result.messages[result.messages["kind"] == kind]


@pytest.mark.parametrize("priors", ["none", "stationary"])
def test_without_a_sensor_of_occluders_a_camera_says_four_bytes_a_frame(room, priors):
    messages = run(room, *IDEAL, f"system.priors.kind={priors}").messages
    assert set(messages["kind"]) == {"scan_line"}
    assert messages["bytes"].tolist() == [4] * 4 * STEPS


@pytest.mark.parametrize("priors", ["perfect", "kalman"])
def test_measured_places_are_six_bytes_an_occluder_and_two_a_message(room, priors):
    result = run(room, *IDEAL, f"system.priors.kind={priors}")
    assert told(result, "scan_line")["bytes"].tolist() == [4] * 4 * STEPS
    places = told(result, "places")
    assert ((places["bytes"] - 2) % 6 == 0).all()
    # each occluder is measured once a frame, by the mote nearest to it
    frames = (places["created_s"] * POST["RATE_HZ"]).round()
    assert (((places["bytes"] - 2) // 6).groupby(frames).sum() == PEOPLE).all()
    assert frames.nunique() == STEPS
    assert len(result.messages) == 4 * STEPS + len(places)


@pytest.mark.parametrize(
    "keys", [("system.priors.kind=hull",), ("system.priors.kind=scan_lines",), ("system.message=scan_line",)]
)
def test_a_whole_line_is_one_byte_more_and_four_a_blob(room, keys):
    messages = run(room, *IDEAL, *keys).messages
    assert len(messages) == 4 * STEPS
    assert ((messages["bytes"] - 5) % 4 == 0).all()
    # six bodies in the room: no camera sees more blobs than that, and on the average several
    assert ((messages["bytes"] - 5) // 4).between(0, PEOPLE + 1).all()
    assert 2.0 < ((messages["bytes"] - 5) // 4).mean() < PEOPLE


def test_a_head_that_is_a_mote_tells_the_base_station_seventeen_bytes_a_frame(room):
    result = run(room, *IDEAL, "system.head={kind: node, id: c3}")
    tracks = told(result, "track")
    assert tracks["bytes"].tolist() == [17] * STEPS
    assert set(tracks["source"]) == {"c3"}
    assert set(tracks["destination"]) == {"base"}
    assert len(told(result, "scan_line")) == 3 * STEPS  # its own camera sends nothing
    assert set(result.tables["estimates"]["node"]) == {"base"}


@pytest.mark.parametrize("kind", ["auxiliary", "printed", "plain", "extended", "unscented", "map"])
def test_every_tracker_runs(room, kind):
    result = run(room, *IDEAL, f"system.tracker={{kind: {kind}}}", "system.start=given")
    assert result.steps["error_m"].notna().all()
    # in an almost empty room all do well
    assert result.steps["error_m"].mean() < 0.3


def test_the_published_preset_is_the_printed_forms(room):
    """Keys that are not given are the published ones; to give them all is the same, and each matters."""
    file = room.with_name("preset.yaml")
    crowded = POST["ROOM"].replace("count: 5", "count: 20").split("system:")[0]
    file.write_text(crowded + "system: {kind: scanline, priors: {kind: kalman, sensor_sd_m: 0.1}}\n")

    def estimates(*overrides):
        return wsnsim.run(file, overrides=(*IDEAL, *overrides)).tables["estimates"]

    preset = estimates("system.preset=published")
    printed = {"kind": "printed", "joint": "printed", "visibility_exponent": 1.0, "lost_sd": 6.0}
    walk = {"memory": 0.7, "noise_sd_m": 0.066}
    written = [f"system.tracker.{key}={value}" for key, value in printed.items()]
    written += [f"system.walk.{key}={value}" for key, value in walk.items()]
    assert preset.equals(estimates(*written))
    for key, mended in (
        ("tracker.kind", "auxiliary"),
        ("tracker.joint", "subsets"),
        ("tracker.visibility_exponent", "0.25"),
        ("walk.memory", "0.3"),
        ("walk.noise_sd_m", "0.08"),
    ):
        assert not preset.equals(estimates("system.preset=published", f"system.{key}={mended}")), key


def test_a_start_that_is_given_is_known_at_once(room):
    unknown, given = (
        run(room, *IDEAL, f"system.start={start}").steps["error_m"] for start in ("unknown", "given")
    )
    assert given.iloc[0] < 0.2
    assert given.iloc[0] < unknown.iloc[0]


def reports(room, *overrides):
    """Return z of each camera and frame, (cameras, frames), as shares of the half width, NaN where blind."""
    post = POST["Post"](room, ("world.people=[]", "duration_s=20", *overrides)).run()
    said = [
        (said.source, each.step, each.share) for said in post.said if hasattr(each := said.payload, "share")
    ]
    frame = pd.DataFrame(said, columns=["camera", "step", "share"])
    frame["row"] = frame.groupby("camera").cumcount()
    return frame.pivot(index="camera", columns="row", values="share").to_numpy(np.float64)


def test_a_camera_that_may_miss_the_object_sees_it_less_often(room):
    """With nobody in the way every camera sees the object while it is in view: .8 of these remain."""
    sure, unsure = reports(room), reports(room, "system.detected=0.8")
    seen = ~np.isnan(sure)
    assert not (np.isnan(sure) & ~np.isnan(unsure)).any()
    share = np.isfinite(unsure[seen]).mean()
    assert abs(share - 0.8) < 4.0 * np.sqrt(0.16 / seen.sum())
    # what remains is the same: which draws belong to which frame hangs on nothing
    both = seen & ~np.isnan(unsure)
    np.testing.assert_array_equal(sure[both], unsure[both])


def test_a_biased_pose_errs_alike_from_frame_to_frame_and_a_white_one_does_not(room):
    noise = "system.noise={position_sd_m: 0.3, angle_sd_rad: 0.05, read_sd_px: 0.01}"
    exact = reports(room, "system.noise={position_sd_m: 0, angle_sd_rad: 0, read_sd_px: 0.01}")
    jumps, sizes = {}, {}
    for kind in ("white", "bias"):
        front_end = f"system.front_end={{kind: measurement, pose_error: {kind}}}"
        errors = reports(room, noise, front_end) - exact
        errors[:, np.abs(exact).max(axis=0) > 0.8] = np.nan  # what the line's end cuts
        jumps[kind] = np.nanstd(np.diff(errors, axis=1))
        sizes[kind] = np.nanstd(errors)
    assert 0.3 < sizes["bias"] / sizes["white"] < 3.0
    # white errors differ by √2 of their size
    assert abs(jumps["white"] / sizes["white"] / np.sqrt(2.0) - 1.0) < 0.15
    assert jumps["bias"] < 0.25 * jumps["white"]


@pytest.mark.parametrize(
    "overrides",
    [
        ("system.priors.kind=kalman", "system.head={kind: elected, period_s: 1}"),
        ("system.priors.kind=hull", "system.head={kind: node, id: c2}", "network.standard=ideal"),
    ],
)
def test_the_same_seed_gives_the_same_tables(room, overrides):
    overrides = (*overrides, "duration_s=3")
    first, second = (run(room, *overrides).tables for _ in range(2))
    assert first.keys() == second.keys()
    for name, table in first.items():
        pd.testing.assert_frame_equal(table, second[name], check_exact=True)
    other = run(room, *overrides, "seed=1").tables
    assert not other["estimates"].equals(first["estimates"])


FRAIL = "motes.nodes=[{id: c1, battery: {kind: capacity, capacity_j: 0.6}}, {id: r, position_m: [4, 2, 2]}]"


@pytest.mark.parametrize(
    "network", ["standard=ieee802154", "standard=ideal", "mac={kind: lpl}", "mac={kind: tdma}"]
)
@pytest.mark.parametrize("head", ["{kind: base}", "{kind: node, id: c1}", "{kind: elected, period_s: 1}"])
def test_messages_joules_and_time_are_conserved(room, network, head):
    result = run(room, f"network.{network}", f"system.head={head}", "system.priors.kind=kalman", FRAIL)
    assert violations(result.tables, result.summary["simulated_s"]) == []
    died = result.nodes.set_index("node")["died_at_s"]
    assert died.notna()["c1"]
    assert not died.notna()["c2"]


def test_when_the_head_dies_the_base_station_says_so_and_believes_no_more(room):
    result = run(
        room,
        "duration_s=12",
        "system.head={kind: node, id: c1}",
        "motes.nodes=[{id: c1, battery: {kind: capacity, capacity_j: 1.5}}]",
    )
    (death,) = result.tables["events"].query("kind == 'death'")["time_s"]
    (silent,) = result.tables["events"].query("kind == 'head_silent'")["time_s"]
    assert 1.0 < death < 4.0
    assert 5.0 < silent - death < 6.0
    steps = result.steps.set_index("time_s")["error_m"]
    assert steps[: death - 0.5].notna().all()
    assert steps[silent + 0.2 :].isna().all()
    kinds = result.steps.set_index("time_s")["kind"]
    assert set(kinds[death + 0.5 : silent - 1.0]) == {"timed_out"}


def test_a_head_by_election_spares_the_weakest_battery(room):
    """Who tracks works a third of its time: in turns the least battery lasts longer, and as much is known.

    Small images, so that it is to track that costs.
    """
    least_j, errors_m = {}, {}
    for head in ("{kind: node, id: c1}", "{kind: elected, period_s: 3, margin: 0.005}"):
        result = run(
            room,
            "duration_s=30",
            f"system.head={head}",
            "system.tracker.particles=500",
            "motes.default={platform: imote2_416, radio: cc2420, battery: {kind: capacity, capacity_j: 45}}",
        )
        least_j[head] = result.nodes["battery_left_j"].dropna().min()
        errors_m[head] = result.steps["error_m"].mean()
        sources = told(result, "track")["source"].nunique()
    fixed, elected = least_j.values()
    assert sources == 4
    assert elected > fixed + 0.4
    assert abs(errors_m[head] - errors_m["{kind: node, id: c1}"]) < 0.05


@pytest.mark.parametrize("priors", ["none", "perfect", "kalman", "stationary", "hull", "scan_lines"])
def test_a_room_without_occluders_is_like_any_other(room, priors):
    """M = 0, by an empty list, by a count, and by virtual occluders that are none."""
    empty = f"world.people=[{{id: walker, count: 0, shape: {DISC}, motion: {{kind: crowd}}}}]"
    virtual = ("world.people=[]", "system.virtual_occluders.count=0")
    for keys in (("world.people=[]",), (empty,), virtual)[: 3 if priors == "kalman" else 1]:
        result = run(room, *IDEAL, *keys, f"system.priors.kind={priors}")
        assert result.steps["error_m"].iloc[5:].mean() < 0.2
        assert "places" not in set(result.messages["kind"])


@pytest.mark.parametrize(
    "priors",
    ["{kind: stationary, sd_m: 1.0e-9}", "{kind: kalman, sensor_sd_m: 1.0e-9, acceleration_sd_mps2: 1.0e-9}"],
)
def test_priors_that_are_almost_singular_are_thin(room, priors):
    result = run(room, *IDEAL, f"system.priors={priors}")
    assert result.steps["error_m"].notna().all()
    assert result.steps["error_m"].iloc[5:].mean() < 0.3


def test_a_deadline_before_any_report_leaves_nothing_but_predictions(room):
    result = run(room, *IDEAL, "system.deadline_s=0.001")
    assert set(result.steps["kind"]) == {"timed_out"}
    assert result.summary["heard_ratio"] == 0
    assert len(result.tables["events"].query("kind == 'report_late'")) == 4 * STEPS


def test_blocks_that_hide_the_object_from_all_cameras_for_long(room):
    """Nobody sees it, everybody says so: the run goes on, and believes with bounds as wide as the room."""
    low, high = (2.2, 1.2), (5.8, 4.8)
    hall = [
        [[x, y], [x + width, y], [x + width, y + depth], [x, y + depth]]
        for x, y, width, depth in (
            (*low, 3.6, 0.1),
            (*low, 0.1, 3.6),
            (low[0], high[1], 3.7, 0.1),
            (high[0], low[1], 0.1, 3.7),
        )
    ]
    result = run(
        room,
        *IDEAL,
        "duration_s=20",
        f"system.virtual_occluders={{count: 0, blocks_m: {hall}}}",
        "world.people=[]",
        "world.crowd.area_m=[[2.5, 1.5], [5.5, 4.5]]",
    )
    assert result.summary["steps"] == 150
    assert result.steps["error_m"].notna().all()
    assert result.steps["participating"].sum() == 0
    sizes = result.tables["estimates"][["cov_xx_m2", "cov_yy_m2"]].sum(axis=1) ** 0.5
    assert (sizes > 1.0).all()
