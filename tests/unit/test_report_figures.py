"""The map starts with the world and can show all; several targets keep one look in every figure."""

import dataclasses
import itertools

import numpy as np
import pandas as pd
import pytest

from wsnsim.report.captions import paths_caption, timeline_caption
from wsnsim.report.charts import target_style
from wsnsim.report.context import ReportContext
from wsnsim.report.paths import paths_figure
from wsnsim.report.timeline import timeline_figure
from wsnsim.report.view import outside, whole_view, world_view

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
    names = {trace.name for trace in timeline_figure(make_context()).data}
    assert names == {"error", "see the target", "heard in time"}
    assert "yaxis3" not in timeline_figure(make_context()).layout


def test_two_targets_look_the_same_in_both_figures(make_context):
    context = make_context(targets=("box", "cart"), load="overloaded")
    paths, timeline = paths_figure(context), timeline_figure(context)
    looks = []
    for name, row in (("box", "y2"), ("cart", "y3")):
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
    domains = [timeline.layout[axis].domain for axis in ("yaxis", "yaxis2", "yaxis3")]
    assert all(lower[1] < upper[0] for upper, lower in itertools.pairwise(domains))
    assert "a row for each target" in timeline_caption(context)


def test_more_targets_than_rows_are_summed(make_context):
    one = make_context()

    def with_targets(number):
        steps = [one.tables["steps"].assign(target=f"t{k}") for k in range(number)]
        return with_table(one, "steps", pd.concat(steps, ignore_index=True))

    context = with_targets(7)
    chart = timeline_figure(context)
    assert "yaxis3" not in chart.layout
    seen = next(trace for trace in chart.data if trace.yaxis == "y2" and trace.name == "see the target")
    sums = context.tables["steps"].groupby("time_s")["participating"].sum()
    assert list(seen.y) == sums.tolist() == (7 * one.tables["steps"]["participating"]).tolist()
    assert chart.layout.yaxis2.range[1] >= max(sums)
    assert "summed over the 7 targets" in timeline_caption(context).replace("\u202f", " ")
    assert "yaxis7" in timeline_figure(with_targets(6)).layout


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
