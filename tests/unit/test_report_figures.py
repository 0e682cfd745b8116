"""The map starts with the world and can show all; several targets keep one look in every figure."""

import dataclasses
import itertools

import numpy as np
import pandas as pd
import pytest

from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.metrics.latency import latency
from wsnsim.report.captions import paths_caption, timeline_caption
from wsnsim.report.charts import target_style
from wsnsim.report.context import ReportContext
from wsnsim.report.floorplan import footprint
from wsnsim.report.latency import latency_figure
from wsnsim.report.paths import paths_figure
from wsnsim.report.timeline import timeline_figure
from wsnsim.report.view import outside, whole_view, world_view
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose
from wsnsim.world.world import Placed

# Machado, Oliveira, Fernandes (2009), table 1, severity 1, for linear RGB.
BLINDNESS = {
    "none": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}


@pytest.fixture
def make_context(synthetic_run):
    def make(**run_options):
        run = synthetic_run(**run_options)
        return ReportContext(
            name="demo", seed=4, system="tracker", citation="", standard="IEEE 802.15.4", size_m=run.size_m,
            cameras=run.cameras, tables=run.tables, summary=run.summary, lost_above_m=1.6,
        )  # fmt: skip

    return make


def with_table(context, name, table):
    return dataclasses.replace(context, tables={**context.tables, name: table})


def with_base_at(context, x_m):
    nodes = context.tables["nodes"].copy()
    nodes.loc[nodes["node"] == "base", "x_m"] = x_m
    return with_table(context, "nodes", nodes)


def named(chart, name):
    return [trace for trace in chart.data if trace.name == name]


def test_a_map_that_holds_everything_has_no_buttons(make_context):
    context = make_context()
    assert not outside(context)
    assert not paths_figure(context).layout.updatemenus
    assert "button" not in paths_caption(context)
    (edge,) = named(paths_figure(context), "edge of the world")
    assert max(edge.x) == 12.0
    assert max(edge.y) == 9.0


def test_a_far_base_station_is_left_out_at_first_and_told(make_context):
    context = with_base_at(make_context(), 60.0)
    chart = paths_figure(context)
    world, network = chart.layout.updatemenus[0].buttons
    assert (world.label, network.label) == ("world", "whole network")
    assert tuple(world.args[0]["xaxis.range"]) == tuple(chart.layout.xaxis.range)
    assert tuple(world.args[0]["yaxis.range"]) == tuple(chart.layout.yaxis.range)
    assert -2 < chart.layout.xaxis.range[0] < 0
    assert 12 < chart.layout.xaxis.range[1] < 14
    assert network.args[0]["xaxis.range"][1] > 60
    assert "base lies outside: the button “whole network” below" in paths_caption(context)


def test_a_far_base_station_leaves_the_wedges_as_they_are_and_a_far_camera_does_not(make_context):
    def wedge_m(context):
        (wedges,) = named(paths_figure(context), "camera and where it looks")
        return np.hypot(wedges.x[1] - wedges.x[0], wedges.y[1] - wedges.y[0])

    context = make_context()
    assert wedge_m(with_base_at(context, 60.0)) == pytest.approx(wedge_m(context))
    away = dataclasses.replace(context.cameras["c2"], position=np.array([24.0, 0.0, 3.0]))
    far = dataclasses.replace(context, cameras={**context.cameras, "c2": away})
    assert world_view(far).x[1] > 24
    assert wedge_m(far) == pytest.approx(2 * wedge_m(context), rel=1e-3)


def test_estimates_outside_are_counted_and_missing_ones_are_not(make_context):
    context = make_context()
    steps = context.tables["steps"].copy()
    steps.loc[3:4, "estimate_x_m"] = -50.0
    steps.loc[5, ["estimate_x_m", "estimate_y_m"]] = np.nan
    lost = with_table(context, "steps", steps)
    assert outside(lost).estimates == 2
    assert "2 estimates lie outside" in paths_caption(lost).replace("\u202f", " ")
    assert world_view(lost) == world_view(context)
    assert whole_view(lost).x[0] < -50


def test_one_target_keeps_plain_names(make_context):
    chart = timeline_figure(make_context())
    names = {trace.name for trace in chart.data if trace.showlegend is not False}
    assert names == {"error", "see the target", "heard in time"}
    assert "yaxis4" not in chart.layout


def test_two_targets_look_the_same_in_both_figures(make_context):
    context = make_context(targets=("box", "cart"), load="overloaded")
    paths, timeline = paths_figure(context), timeline_figure(context)
    looks = []
    for name, row in (("box", "y3"), ("cart", "y4")):
        (truth,), (estimate,) = named(paths, f"{name}: true path"), named(paths, f"{name}: estimate")
        (error,) = named(timeline, f"{name}: error")
        counts = {t.name: t for t in timeline.data if t.yaxis == row}
        assert estimate.line.color == error.line.color == counts["heard in time"].line.color
        assert truth.line.color == counts["see the target"].line.color != estimate.line.color
        assert {symbol.removesuffix("-open") for symbol in estimate.marker.symbol} == {error.marker.symbol}
        rows = context.tables["steps"].query("target == @name")
        assert list(counts["see the target"].y) == rows["participating"].tolist()
        assert list(counts["heard in time"].y) == rows["heard"].tolist()
        looks.append((truth.line.color, estimate.line.color, error.marker.symbol))
    assert all(a != b for a, b in zip(*looks, strict=True))
    for chart in (paths, timeline):
        shown = [trace.name for trace in chart.data if trace.showlegend is not False]
        assert len(shown) == len(set(shown))
    domains = [timeline.layout[axis].domain for axis in ("yaxis", "yaxis2", "yaxis3", "yaxis4")]
    assert all(lower[1] < upper[0] for upper, lower in itertools.pairwise(domains))
    assert "a row for each target" in timeline_caption(context)


def test_more_targets_than_rows_are_summed(make_context):
    one = make_context()

    def with_targets(number):
        steps = [one.tables["steps"].assign(target=f"t{k}") for k in range(number)]
        return with_table(one, "steps", pd.concat(steps, ignore_index=True))

    context = with_targets(7)
    chart = timeline_figure(context)
    assert "yaxis4" not in chart.layout
    seen = next(trace for trace in chart.data if trace.yaxis == "y3" and trace.name == "see the target")
    sums = context.tables["steps"].groupby("time_s")["participating"].sum()
    assert list(seen.y) == sums.tolist() == (7 * one.tables["steps"]["participating"]).tolist()
    assert chart.layout.yaxis3.range[1] >= max(sums)
    assert "summed over the 7 targets" in timeline_caption(context).replace("\u202f", " ")
    assert "yaxis8" in timeline_figure(with_targets(6)).layout


def panel(chart, title):
    """Return the traces of the panel under the annotation of that title."""
    (note,) = (note for note in chart.layout.annotations if note.text.startswith(title))
    axes = {name for name in chart.layout if name.startswith("yaxis")}
    (found,) = (name for name in axes if chart.layout[name].domain[1] == pytest.approx(note.y))
    return [trace for trace in chart.data if (trace.yaxis or "y") == found.replace("axis", "")]


def test_the_pixel_share_is_that_of_the_steps_in_percent(make_context):
    context = make_context(targets=("box", "cart"))
    steps = context.tables["steps"]
    lines = panel(timeline_figure(context), "share of the image")
    for line, target in zip(lines, ("box", "cart"), strict=True):
        shares = steps.loc[steps["target"] == target, "pixel_share"]
        assert list(line.y) == pytest.approx((100 * shares).tolist(), abs=1e-4)


def test_orientations_have_a_panel_only_where_there_is_an_error(make_context):
    context = make_context()
    titles = [note.text for note in timeline_figure(context).layout.annotations]
    assert not any("orientation" in title for title in titles)
    assert "orientation" not in timeline_caption(context)
    steps = context.tables["steps"].assign(orientation_error_deg=np.linspace(0, 30, 36))
    turned = with_table(context, "steps", steps)
    (line,) = panel(timeline_figure(turned), "orientation error")
    assert line.y[-1] == 30.0
    assert "the angle between true and estimated orientation" in timeline_caption(turned)


def test_lost_and_smoothed_estimates_and_track_events_are_shown_and_told(make_context):
    context = make_context()
    assert "smoother" not in timeline_caption(context)
    assert "gave a track up" not in timeline_caption(context)
    steps = context.tables["steps"].copy()
    steps["smoothed_error_m"] = np.where(steps["step"] > 3, 0.01, np.nan)
    steps.loc[10, "kind"] = "lost"
    found = pd.DataFrame(
        [(2.5, "base", "track_lost", "no fit for 2 s"), (4.0, "base", "track_started", "seen by <b>")],
        columns=["time_s", "node", "kind", "detail"],
    )
    told = with_table(with_table(context, "steps", steps), "events", found)
    chart = timeline_figure(told)
    (smoothed,) = named(chart, "smoothed afterwards")
    assert len(smoothed.y) == 33
    assert set(smoothed.y) == {0.01}
    (guessed,) = named(chart, "no measurement")
    assert list(guessed.text) == ["the track was given up, its last place is held"]
    (lost,), (started,) = named(chart, "track lost"), named(chart, "track started")
    assert (list(lost.x), list(started.x)) == ([2.5], [4.0])
    assert started.text == ("base: seen by &lt;b&gt;",)
    assert "smoother" in timeline_caption(told)
    assert "gave a track up, or began one" in timeline_caption(told)


def test_the_latency_is_the_distribution_of_measured_steps(make_context):
    context = make_context()
    steps = context.tables["steps"].assign(latency_s=lambda table: 0.1 + 0.003 * (table["step"] % 7) ** 2)
    context = with_table(context, "steps", steps)
    waited_ms = 1e3 * steps.loc[steps["kind"] == "update", "latency_s"]
    chart = latency_figure(context)
    curve = chart.data[0]
    highest = dict(zip(curve.x, curve.y, strict=True))  # estimates that took equally long are one stair
    assert len(highest) == 7
    for value_ms, percent in highest.items():
        assert percent == pytest.approx(100 * (waited_ms <= value_ms + 1e-3).mean(), abs=1e-2)
    assert max(curve.x) == pytest.approx(waited_ms.max(), abs=1e-3)
    marks = [trace for trace in chart.data if trace.mode == "lines+text"]
    told = latency(steps)
    assert [mark.x[0] for mark in marks] == pytest.approx(
        [1e3 * told["latency_p50_s"], 1e3 * told["latency_p95_s"]], abs=1e-3
    )
    blind = with_table(context, "steps", steps.assign(kind="timed_out"))
    assert latency_figure(blind) is None


def test_a_long_run_is_drawn_with_few_points_and_the_same_ends(make_context):
    context = make_context()
    one = context.tables["steps"]
    steps = pd.concat([one.assign(latency_s=0.1 + 1e-4 * k) for k in range(100)])
    curve = latency_figure(with_table(context, "steps", steps)).data[0]
    assert len(curve.x) <= 501
    assert (curve.x[0], curve.x[-1]) == pytest.approx((100.0, 109.9))
    assert curve.y[-1] == 100.0


def test_things_and_people_are_drawn_on_the_map(make_context):
    context = make_context()
    texture = PatchTexture.random(np.random.default_rng(0), 2, 2)
    wall = Placed(
        "wall", Body(np.array([2.0, 0.1, 1.5]), texture, "box"),
        Pose(np.array([3.0, 4.0, 1.5]), np.zeros(3), np.array([1.0, 0, 0, 0])),
    )  # fmt: skip
    furnished = dataclasses.replace(
        context, scenery=(wall,), walks={"passer-by": np.array([[1.0, 1.0], [2.0, 5.0]])}
    )
    chart = paths_figure(furnished)
    (things,), (people,) = named(chart, "walls and things"), named(chart, "people in the way")
    assert {(x, y) for x, y in zip(things.x, things.y, strict=True) if x is not None} == {
        (1.0, 3.9), (5.0, 3.9), (5.0, 4.1), (1.0, 4.1),
    }  # fmt: skip
    assert list(people.y) == [1.0, 5.0, None]
    assert not named(paths_figure(context), "walls and things")


@pytest.mark.parametrize("form", ["ellipsoid", "box", "cylinder"])
def test_a_footprint_is_the_convex_hull_of_the_bodys_points_from_above(form, test_seed):
    """Each corner is reached by a point of the surface, and no point of the body is outside."""
    generator = np.random.default_rng(test_seed)
    texture = PatchTexture.random(generator, 1, 1)
    body = Body(np.array([0.5, 0.2, 0.9]), texture, form)
    q = generator.standard_normal(4)
    pose = Pose(np.array([4.0, 3.0, 1.0]), np.zeros(3), q / np.linalg.norm(q))
    outline = footprint(body, pose)
    unit = generator.uniform(-1, 1, (20_000, 3))
    inside = {
        "box": np.ones(len(unit), dtype=bool),
        "ellipsoid": (unit**2).sum(axis=1) <= 1,
        "cylinder": (unit[:, :2] ** 2).sum(axis=1) <= 1,
    }[form]
    points = (unit[inside] * body.semi_axes_m) @ quaternion_to_matrix(pose.orientation).T + pose.position
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    for direction in np.column_stack((np.cos(angles), np.sin(angles))):
        reach, sampled = (outline @ direction).max(), (points[:, :2] @ direction).max()
        # a polygon of 48 corners falls short of a circle by 1 - cos(π/48); samples fall short of the rim
        assert sampled <= reach + 0.9 * (1 - np.cos(np.pi / 48)) + 1e-9
        assert reach <= sampled + 0.12
    assert np.array_equal(outline[0], outline[-1])


def lab(colour, sight):
    """Return CIE L*a*b* of an sRGB colour as somebody with this colour sight sees it."""
    encoded = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4125, 0.3576, 0.1804], [0.2127, 0.7152, 0.0722], [0.0193, 0.1192, 0.9503]])
    xyz = to_xyz @ np.clip(sight @ linear, 0, 1) / to_xyz.sum(axis=1)
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("kind", BLINDNESS)
def test_the_colours_of_targets_stay_apart_for_the_colour_blind(kind):
    styles = [target_style(number, 6) for number in range(6)]
    for role, least in (("truth", 18), ("estimate", 24)):
        seen = [lab(getattr(style, role), BLINDNESS[kind]) for style in styles]
        assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > least
    for style in styles:
        dark, light = lab(style.truth, BLINDNESS[kind]), lab(style.estimate, BLINDNESS[kind])
        assert light[0] - dark[0] > 15


def test_a_hue_that_comes_again_has_another_shape():
    styles = [target_style(number, 42) for number in range(42)]
    assert len({(style.estimate, style.symbol) for style in styles}) == 42
