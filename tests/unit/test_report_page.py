"""The report says in words what the tables hold, escapes what it is given, and repeats itself exactly."""

import dataclasses
import json
import re
from html.parser import HTMLParser

import pandas as pd
import pytest

from wsnsim.report import losses, words
from wsnsim.report.context import ReportContext
from wsnsim.report.keyfigures import KEY_FIGURES, key_rows
from wsnsim.report.page import render, write_report
from wsnsim.report.rows import event_rows

VOID = {"meta", "link", "br", "img", "input", "hr"}


class Checker(HTMLParser):
    """Notes tags that are not closed in order, addresses that a browser would ask for, and ids."""

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.ids, self.text, self.wrong = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.addresses += [attributes[name] for name in ("src", "href") if name in attributes]
        if "id" in attributes:
            self.ids.append(attributes["id"])
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if not self.open or self.open[-1] not in ("script", "style"):
            self.text.append(data)


def check(page):
    checker = Checker()
    checker.feed(page)
    assert checker.wrong == []
    assert checker.open == []
    assert len(checker.ids) == len(set(checker.ids))
    return checker


def plain(text):
    return " ".join(text.replace("\u202f", " ").split())


@pytest.fixture
def make_context(synthetic_run):
    def make(name="demo", standard="IEEE 802.15.4", **run_options):
        run = synthetic_run(**run_options)
        return ReportContext(
            name=name,
            seed=4,
            system="multi-view histograms, tracker T0",
            citation="Kushwaha & Koutsoukos (2013)",
            standard=standard,
            size_m=run.size_m,
            cameras=run.cameras,
            tables=run.tables,
            summary=run.summary,
            lost_above_m=1.6,
        )

    return make


def figures(page):
    pattern = r'<script type="application/json" id="(\w+)-data">(.*?)</script>'
    return {name: json.loads(text) for name, text in re.findall(pattern, page, re.DOTALL)}


def test_a_page_is_whole_offline_and_small(make_context, tmp_path):
    write_report(tmp_path / "report.html", make_context())
    page = (tmp_path / "report.html").read_text("utf-8")
    checker = check(page)
    assert [address for address in checker.addresses if not address.startswith("data:")] == []
    assert "@import" not in page.split("</style>")[0]
    assert '<html lang="en">' in page
    assert "<title>demo, seed 4 – wsnsim report</title>" in page
    assert (tmp_path / "report.html").stat().st_size < 1.5e6


def test_the_same_tables_give_the_same_bytes(make_context):
    assert render(make_context()) == render(make_context())


def test_the_words_hold_the_figures(make_context):
    context = make_context()
    text = plain(words.service(context))
    assert "The programs handed 107 kbit/s to the network" in text
    assert "43.0 % of the 250 kbit/s that the IEEE 802.15.4 channel carries" in text
    assert "All messages to the base station arrived. An estimate" in text
    assert "203 kbit/s were sent on average and 255 kbit/s at the busiest" in text
    assert "An estimate from measurements was there 210 ms after its images were taken" in text
    assert "J a step" in text
    assert "for its processor." in text
    assert "the first battery lasts 9.9" in text
    text = plain(words.information(context))
    assert "The target was tracked to the end: the error of its last estimate was below 1.60 m." in text
    assert "All 36 steps had a measurement" in text
    assert "prediction" not in text


def test_a_network_that_cannot_carry_it_is_told_first_and_in_figures(make_context):
    context = make_context(load="overloaded")
    verdict = plain(words.verdicts(context)[0])
    unmeasured = context.summary["unmeasured_steps"]
    assert unmeasured > context.summary["missed_deadlines"] > 0
    assert verdict.startswith(
        "The network could not carry it: 700 kbit/s were offered to a channel of 250 kbit/s."
    )
    assert "7.1 % of the weights messages and 100 % of the state messages arrived" in verdict
    assert f"{unmeasured} of 36 steps had no measurement at all." in verdict
    assert "What became of most lost weights messages (54.9 %): the channel was busy at every try." in verdict
    assert render(context).index("could not carry it") < render(context).index("Key figures")


def test_the_load_of_a_run_that_measures_everything_is_told(make_context):
    context = make_context(load="overloaded")
    messages = context.tables["messages"]
    seeing = int(context.tables["steps"]["participating"].sum())
    heard = messages[(messages["kind"] == "state") | (messages["message"] % 4 == 0)]
    offered = 8 * heard.drop_duplicates("message")["bytes"].sum() / 9.0
    silent = dataclasses.replace(
        context,
        tables={**context.tables, "messages": heard},
        summary={**context.summary, "offered_bps": offered},
    )
    assert offered < 250_000
    wanted_kbps = 8 * (seeing * 8_008 + 36 * 80) / 9.0 / 1e3
    verdict = plain(words.verdicts(silent)[0])
    assert f"every camera that sees the target would take {wanted_kbps:.0f} kbit/s." in verdict


def test_a_run_without_any_measurement_is_told(make_context):
    context = make_context()
    blind = changed(context, unmeasured_steps=36, latency_p50_s=None, latency_p95_s=None)
    assert "None of 36 steps had a measurement." in plain(words.information(blind))
    assert "This is the error of a prediction, not of a measurement." in plain(words.information(blind))
    assert "An estimate from measurements" not in words.service(blind)
    assert "nan" not in plain(words.service(blind)).lower()


def test_what_is_said_in_a_search_does_not_make_measuring_look_cheap(make_context):
    context = make_context(load="overloaded")
    messages = context.tables["messages"]
    sighting = messages[messages["kind"] == "weights"].head(400).assign(kind="sighting", bytes=38)
    more = pd.concat([messages, sighting.assign(message=range(10_000, 10_000 + len(sighting)))])
    searching = dataclasses.replace(context, tables={**context.tables, "messages": more})
    wanted = re.compile(r"would take ([\d.]+ \wbit/s)")
    bare, told = (wanted.search(plain(words.verdicts(c)[0])) for c in (context, searching))
    assert bare is None or bare[1] == told[1]
    assert losses.wanted_bps(searching) == losses.wanted_bps(context) > 0


def test_a_track_that_was_given_up_is_told_with_its_end(make_context):
    context = make_context()
    assert "gave up" not in words.information(context)

    def with_lost(steps_lost):
        steps = context.tables["steps"].copy()
        steps.loc[steps["step"].isin(steps_lost), "kind"] = "lost"
        events = pd.DataFrame(
            [(2.5, "base", "track_lost", "box: no fit")], columns=["time_s", "node", "kind", "detail"]
        )
        return dataclasses.replace(
            changed(context, unmeasured_steps=len(steps_lost)),
            tables={**context.tables, "steps": steps, "events": events},
        )

    text = plain(words.information(with_lost(range(10, 15))))
    assert "The tracker gave up once and was without a track for 5 of 36 steps; it had a track again" in text
    assert "tracked to the end" in text
    text = plain(words.information(with_lost(range(30, 37))))
    assert "without a track for 7 of 36 steps; it had not found it again by the end." in text
    assert "tracked to the end" not in text


def test_orientation_and_smoothing_are_told_where_there_is_any(make_context):
    context = make_context()
    for word in ("orientation", "Smoothed"):
        assert word not in words.information(context)
    steps = context.tables["steps"].assign(orientation_error_deg=7.5)
    steps["smoothed_error_m"] = steps["error_m"].where(steps["step"] > 6) / 2
    told = dataclasses.replace(
        changed(
            context, orientation_error_mean_deg=7.5, smoothed_error_mean_m=steps["smoothed_error_m"].mean()
        ),
        tables={**context.tables, "steps": steps},
    )
    text = plain(words.information(told))
    assert "Estimated orientations were 7.50 ° off on average." in text
    numbers = re.search(r"Smoothed afterwards, 30 of them were ([\d.]+) cm off; .* been ([\d.]+) cm", text)
    assert float(numbers[2]) == pytest.approx(2 * float(numbers[1]), rel=0.01)


def changed(context, **figures):
    return dataclasses.replace(context, summary={**context.summary, **figures})


@pytest.mark.parametrize(
    ("skipped", "sentence"),
    [
        (0, None),
        (1, "1 of them was passed over because an earlier step took too long."),
        (3, "3 of them were passed over because an earlier step took too long."),
        (5, "All of them were passed over because an earlier step took too long."),
    ],
)
def test_steps_that_were_passed_over_are_explained(make_context, skipped, sentence):
    text = plain(words.information(changed(make_context(), unmeasured_steps=5, skipped_steps=skipped)))
    assert "5 of 36 steps (13.9 %) had no measurement at all." in text
    assert f" {sentence} " in text if sentence else "passed over" not in text


def test_the_error_of_a_prediction_is_called_so_when_most_estimates_are_one(make_context):
    mostly = "For the most part this is the error of a prediction, not of a measurement."
    context = make_context()
    assert mostly not in words.information(changed(context, unmeasured_steps=18))
    assert mostly in words.information(changed(context, unmeasured_steps=19))
    # ten steps without any estimate add nothing to the error: 14 predictions among 26 estimates do
    steps = context.tables["steps"].copy()
    steps.loc[:9, "error_m"] = float("nan")
    gaps = dataclasses.replace(context, tables={**context.tables, "steps": steps})
    assert mostly not in words.information(changed(gaps, unmeasured_steps=23))
    assert mostly in words.information(changed(gaps, unmeasured_steps=24))


def test_delivery_is_told_of_messages_to_the_base_and_of_those_from_it_if_some_are_lost(make_context):
    context = make_context()
    assert "from it" not in words.service(context)
    poor = plain(words.service(changed(context, delivery_ratio=0.25, delivery_ratio_down=0.5)))
    assert "25.0 % of the messages to the base station arrived. Of the messages from it, 50.0 %" in poor
    deaf = plain(words.service(changed(context, delivery_ratio=0.0)))
    assert "None of the messages to the base station arrived." in deaf
    silent = words.service(changed(context, delivery_ratio=None, delivery_ratio_down=None))
    assert "arrived" not in silent


def test_the_base_station_is_on_mains_only_without_a_battery(make_context):
    context = make_context()
    assert "The base station is on mains and not shown." in render(context)
    nodes = context.tables["nodes"].copy()
    nodes.loc[nodes["role"] == "base", ["battery_capacity_j", "battery_left_j"]] = 100.0, 50.0
    page = render(dataclasses.replace(context, tables={**context.tables, "nodes": nodes}))
    assert "The base station is on a battery of its own and not shown." in page
    assert "mains" not in "".join(check(page).text)


def test_events_are_counted_and_explained(make_context):
    rows = event_rows(make_context(load="overloaded"))
    assert [row[:2] for row in rows] == [
        ("images that were not taken because the processor or the imager was still busy", "4"),
        ("images that no state arrived for, or that the base station passed over", "24"),
    ]


def test_a_fine_network_gets_no_verdict_but_a_slow_processor_does(make_context):
    (verdict,) = words.verdicts(make_context())
    assert "c3 could not keep up: 4 images were skipped" in plain(verdict)


def test_a_dead_mote_is_told_and_nothing_is_extrapolated(make_context):
    context = make_context(died=True)
    verdicts = [plain(verdict) for verdict in words.verdicts(context)]
    assert "1 node stopped during the run: c4 at 5.00 s." in verdicts
    text = plain(words.service(context))
    assert "a step on average over the whole run, the time after motes had stopped included," in text
    assert text.endswith("The first battery was empty after 5.00 s; by the end 1 of 5 motes had stopped.")
    page = plain("".join(check(render(context)).text))
    assert "extrapolated" not in page
    assert "At this pace" not in page
    (drawn,) = [row for row in key_rows(context.summary, main=True) if row[3] == "energy_per_step_j"]
    assert drawn[2].endswith("the time after motes had stopped included")
    assert ("First battery empty", "5.00 s") in [
        (label, plain(value)) for label, value, *_ in key_rows(context.summary, main=True)
    ]


def test_the_death_of_all_motes_is_told(make_context):
    context = make_context(died=True)
    nodes = context.tables["nodes"].copy()
    nodes.loc[nodes["role"] != "base", "died_at_s"] = 5.0
    dead = dataclasses.replace(context, tables={**context.tables, "nodes": nodes})
    assert "by the end all 5 motes had stopped." in plain(words.service(dead))


def test_a_lost_target_is_told(make_context):
    context = make_context()
    lost = plain(words.information(changed(context, lost_fraction=1.0)))
    assert "The target was lost: the error of its last estimate was above 1.60 m." in lost
    steps = context.tables["steps"].copy()
    steps.loc[35, "error_m"] = float("nan")
    ended = dataclasses.replace(context, tables={**context.tables, "steps": steps})
    assert "The target was not lost: the error of its last estimate was below" in words.information(ended)


def test_lost_targets_are_counted(make_context):
    context = make_context(targets=("box", "cart"))
    assert "Both targets were tracked to the end:" in words.information(context)
    half = plain(words.information(changed(context, lost_fraction=0.5)))
    assert "1 of 2 targets was lost: the last estimate was further off" in half


def test_an_ideal_network_has_no_limit(make_context):
    context = make_context(standard="an ideal network")
    ideal = dataclasses.replace(context, summary={**context.summary, "channel_bps": None})
    assert "which has no limit here" in words.service(ideal)
    assert "On the air" not in words.service(ideal)
    check(render(ideal))


def test_nothing_from_the_scenario_becomes_markup(make_context):
    evil = "</script><script>alert(1)</script>"
    page = render(make_context(name=evil, targets=("box", "<img src=x onerror=alert(2)>")))
    check(page)
    assert evil not in page
    assert "<img" not in page.replace("\\u003cimg", "")
    texts = [trace["text"] for trace in figures(page)["paths"]["data"] if "text" in trace]
    assert any("&lt;img" in entry for text in texts for entry in text)


def test_every_summary_figure_is_explained(make_context):
    context = make_context()
    assert {figure.key for figure in KEY_FIGURES} == set(context.summary)
    text = "".join(check(render(context)).text)
    for figure in KEY_FIGURES:
        told = not figure.optional or context.summary[figure.key] is not None
        assert (figure.label in text) == told
        assert (figure.meaning in text) == told


def test_of_what_a_system_does_not_estimate_there_is_no_row(make_context):
    for key, label in (
        ("orientation_error_mean_deg", "Mean orientation error"),
        ("smoothed_error_mean_m", "Mean error, smoothed"),
    ):
        for value in (0.0, None):
            rows = key_rows(changed(make_context(), **{key: value}).summary, main=False)
            assert (label in [row[0] for row in rows]) == (value is not None)


def test_the_paths_figure_joins_truth_and_estimate_by_patches(make_context):
    context = make_context()
    figure = figures(render(context))["paths"]
    traces = {trace["name"]: trace for trace in figure["data"]}
    steps = context.tables["steps"]
    assert traces["error, a patch a step"]["x"].count(None) == 36
    assert traces["error, a patch a step"]["x"][6:11][1] == pytest.approx(steps["truth_x_m"][1], abs=1e-4)
    assert traces["true path"]["x"][1:] == pytest.approx(steps["truth_x_m"].tolist(), abs=1e-4)
    assert traces["estimate"]["y"] == pytest.approx(steps["estimate_y_m"].tolist(), abs=1e-4)
    assert traces["routing tree"]["x"].count(None) == 5
    assert figure["layout"]["yaxis"]["scaleanchor"] == "x"
    assert figure["layout"]["yaxis"]["scaleratio"] == 1


def test_a_camera_looks_where_its_wedge_points(make_context):
    figure = figures(render(make_context()))["paths"]
    wedges = next(trace for trace in figure["data"] if trace["name"] == "camera and where it looks")
    place_x, left_x, right_x = wedges["x"][:3]
    place_y, left_y, right_y = wedges["y"][:3]
    assert (place_x, place_y) == (0.0, 0.0)
    middle = ((left_x + right_x) / 2 - place_x, (left_y + right_y) / 2 - place_y)
    assert middle[1] / middle[0] == pytest.approx(4.5 / 6.0, rel=0.02)
    assert (
        left_x * right_y - left_y * right_x < 0
    )  # the right edge of the image is clockwise, seen from above


def test_steps_without_a_measurement_are_marked(make_context):
    context = make_context(load="overloaded")
    figure = figures(render(context))["timeline"]
    marked = next(trace for trace in figure["data"] if trace["name"] == "no measurement")
    assert len(marked["x"]) == context.summary["unmeasured_steps"]
    heard = next(trace for trace in figure["data"] if trace["name"] == "heard in time")
    assert heard["y"] == context.tables["steps"]["heard"].tolist()


def test_bars_add_up_to_what_each_mote_drew(make_context):
    context = make_context()
    shown = figures(render(context))
    nodes = context.tables["nodes"].set_index("node")
    total = dict.fromkeys(shown["energy"]["data"][0]["y"], 0.0)
    assert "base" not in total
    for trace in shown["energy"]["data"]:
        for node, joules in zip(trace["y"], trace["x"], strict=True):
            total[node] += joules
    for node, joules in total.items():
        row = nodes.loc[node]
        assert joules == pytest.approx(row["battery_capacity_j"] - row["battery_left_j"], rel=1e-5)
    offered = next(trace for trace in shown["bandwidth"]["data"] if trace["name"] == "offered by its program")
    assert offered["x"][0] == pytest.approx(nodes["app_tx_bytes"]["c1"] * 8 / 9250, abs=1e-3)


def test_a_run_in_which_nothing_happened_still_has_a_report(make_context):
    context = make_context()
    tables = {name: frame.head(0) for name, frame in context.tables.items()} | {
        "nodes": context.tables["nodes"]
    }
    summary = dict.fromkeys(context.summary, None) | {"steps": 0, "simulated_s": 9.0}
    page = render(dataclasses.replace(context, tables=tables, summary=summary))
    text = plain("".join(check(page).text))
    assert "No message was sent." in text
    assert "Nothing out of the ordinary happened." in text
    assert "No estimate was made of any target." in text
    assert "nan" not in text.lower().split()


def test_the_systems_choices_stand_under_the_title(make_context):
    context = dataclasses.replace(make_context(), choices={"priors": "kalman", "head": "<elected>"})
    page = render(context)
    assert '<p class="soft">With priors “kalman”, head “&lt;elected&gt;”</p>' in page
    assert '<p class="soft">With' not in render(make_context())
    both = render(dataclasses.replace(context, settings=("message “bearing”", "2 cameras")))
    assert "“&lt;elected&gt;”, message “bearing”, 2 cameras</p>" in both


def test_the_error_is_told_in_the_published_unit(make_context):
    context = make_context()
    rmse_m = context.summary["position_rmse_m"]
    told = plain(words.information(dataclasses.replace(context, unit_m=rmse_m / 1.5)))
    assert "1.50 units of " in told
    for unit_m in (None, 1.0):
        assert "units" not in words.information(dataclasses.replace(context, unit_m=unit_m))


def test_motes_that_tracked_are_named_in_their_order(make_context):
    context = make_context()
    assert "Cluster head" not in words.information(context)
    messages = context.tables["messages"]
    mine = messages.head(3).assign(kind="track", source=["c3", "c1", "c1"])
    several = dict(context.tables) | {"messages": pd.concat([messages, mine], ignore_index=True)}
    told = plain(words.information(dataclasses.replace(context, tables=several)))
    assert "Cluster heads were, in this order, c3 (1 track) and c1 (2 tracks)." in told
