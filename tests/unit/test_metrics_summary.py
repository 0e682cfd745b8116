"""Every figure of the summary against a sum done by hand."""

import json
import math

import pandas as pd
import pytest

from wsnsim.metrics.accuracy import accuracy
from wsnsim.metrics.energy import ENERGY_COLUMNS, energy
from wsnsim.metrics.figures import SUMMARY_KEYS
from wsnsim.metrics.latency import latency
from wsnsim.metrics.summary import summary
from wsnsim.metrics.traffic import content_arrived, on_the_way_up, traffic

Q_SEEN = (0, "q", 9.0, math.nan, 0.2, "update")


def steps(rows):
    columns = ["step", "target", "error_m", "reprojection_px", "latency_s", "kind"]
    return pd.DataFrame(rows, columns=columns).assign(
        orientation_error_deg=math.nan, smoothed_error_m=math.nan, asked=4, heard=3
    )


STEPS = steps(
    [
        (1, "p", 1.0, 2.0, 0.1, "update"),
        (1, "q", 2.0, math.nan, 0.2, "timed_out"),
        (2, "p", 1.5, 4.0, 0.3, "update"),
        (2, "q", math.nan, math.nan, math.nan, None),
    ]
)
LIMITS_M = {"p": 1.5, "q": 1.5}


SEEN = pd.concat([steps([Q_SEEN]), STEPS])
"""The same, but q was measured once before."""


def test_errors_and_lost_targets():
    figures = accuracy(STEPS, LIMITS_M)
    assert figures["position_error_mean_m"] == pytest.approx(1.5)
    assert figures["position_error_median_m"] == pytest.approx(1.5)
    assert figures["position_rmse_m"] == pytest.approx(math.sqrt((1 + 4 + 2.25) / 3))
    assert figures["reprojection_error_mean_px"] == 3.0
    assert figures["lost_fraction"] == 0.5
    assert accuracy(STEPS, {"p": 1.49, "q": 1.5})["lost_fraction"] == 1.0


def test_orientation_and_smoothing_are_averaged_where_there_is_any():
    figures = accuracy(STEPS, LIMITS_M)
    assert figures["orientation_error_mean_deg"] is None
    assert figures["smoothed_error_mean_m"] is None
    told = STEPS.assign(
        orientation_error_deg=[10.0, 20.0, 60.0, math.nan], smoothed_error_m=[0.5, math.nan, 1.0, math.nan]
    )
    figures = accuracy(told, LIMITS_M)
    assert figures["orientation_error_mean_deg"] == pytest.approx(30.0)
    assert figures["smoothed_error_mean_m"] == pytest.approx(0.75)
    assert figures["position_error_mean_m"] == pytest.approx(1.5)


def test_a_track_that_was_declared_lost_is_unmeasured_and_no_missed_deadline():
    figures = latency(STEPS.assign(kind=["update", "lost", "update", "lost"]))
    assert figures["unmeasured_steps"] == 2
    assert figures["missed_deadlines"] == 0
    assert figures["skipped_steps"] == 0


@pytest.mark.parametrize(
    ("limits_m", "share"),
    [
        # the last errors there are: p 1.5 m at step 2, q 2.0 m at step 1
        ({"p": 1.5, "q": 2.0}, 0.0),
        ({"p": 1.5, "q": 1.9}, 0.5),
        ({"p": 1.4, "q": 2.0}, 0.5),
        ({"p": 1.4, "q": 1.9}, 1.0),
        ({"p": 1.5, "q": 2.0, "a target of another run": 0.0}, 0.0),
    ],
)
def test_each_target_is_judged_by_its_last_estimate_and_its_own_limit(limits_m, share):
    assert accuracy(SEEN, limits_m)["lost_fraction"] == share


def test_a_target_that_was_never_measured_is_lost_however_near_its_prediction():
    near = STEPS.assign(error_m=0.0)
    assert accuracy(near, {"p": 1.0, "q": 1.0})["lost_fraction"] == 0.5


def test_the_last_estimate_is_that_of_the_last_step_in_whatever_order_they_stand():
    backwards = SEEN.iloc[::-1].reset_index(drop=True)
    assert accuracy(backwards, {"p": 1.2, "q": 2.0})["lost_fraction"] == 0.5


def test_a_target_without_any_estimate_is_lost():
    unseen = STEPS.assign(error_m=STEPS["error_m"].where(STEPS["target"] != "q"))
    assert accuracy(unseen, {"p": 9.0, "q": math.inf})["lost_fraction"] == 0.5


def test_a_target_without_a_limit_is_an_error():
    with pytest.raises(KeyError, match="q"):
        accuracy(STEPS, {"p": 1.5})


KINDS = steps(
    [
        (1, "p", 0.1, 1.0, 0.1, "update"),
        (2, "p", 0.1, 1.0, 0.9, "timed_out"),
        (3, "p", 0.1, 1.0, 0.8, "skipped"),
        (4, "p", 0.1, 1.0, 0.7, "skipped"),
        (5, "p", 0.1, 1.0, 0.0, "unasked"),
        (6, "p", 0.1, 1.0, 0.3, "update"),
        (7, "p", math.nan, math.nan, math.nan, None),
        (8, "p", math.nan, math.nan, math.nan, math.nan),
        (9, "p", 0.1, 1.0, 0.6, "timed_out"),
    ]
)


def test_latency_is_that_of_estimates_from_measurements():
    figures = latency(KINDS)
    assert figures["latency_p50_s"] == pytest.approx((0.1 + 0.3) / 2)
    assert figures["latency_p95_s"] == pytest.approx(0.1 + 0.95 * 0.2)
    assert figures["latency_p99_s"] == pytest.approx(0.1 + 0.99 * 0.2)
    blind = latency(KINDS[KINDS["kind"] != "update"])
    assert (blind["latency_p50_s"], blind["latency_p95_s"]) == (None, None)


def test_steps_without_a_measurement_are_counted_by_their_reason():
    figures = latency(KINDS)
    assert figures["missed_deadlines"] == 2 + 2  # timed out, and no estimate at all
    assert figures["skipped_steps"] == 2
    assert figures["unmeasured_steps"] == 9 - 2


def messages():
    columns = ["message", "source", "destination", "created_s", "bytes", "outcome"]
    rows = [
        (0, "base", "a", 0.0, 10, "delivered"),
        (0, "base", "b", 0.0, 10, "dropped_not_heard"),
        (1, "a", "base", 0.5 - 1e-9, 100, "delivered"),
        (2, "b", "base", 0.6, 50, "dropped_queue"),
        (3, "b", "base", 0.9, 40, "in_flight"),
    ]
    return pd.DataFrame(rows, columns=columns).assign(fused_into=None, kind="packet")


ACCESS_COLUMNS = (
    "frames_tx",
    "frames_retried",
    "attempts",
    "attempts_failed",
    "cca_total",
    "cca_busy",
    "budget_waited_s",
)


def nodes():
    base = {
        "node": "base",
        "role": "base",
        "parent": None,
        "app_tx_bytes": 10,
        "mac_tx_bytes": 30,
        "cpu_cycles": 1e9,
    }
    base |= dict.fromkeys(ENERGY_COLUMNS, 1e6)
    base |= {"images_skipped": 0, "battery_capacity_j": math.nan, "died_at_s": math.nan}
    base |= {"cpu_busy_s": 1.0, "frame_work_mean_s": math.nan, "work_longest_s": 1.0}
    base |= dict.fromkeys(ACCESS_COLUMNS, 0)
    motes = []
    for i, name in enumerate(("a", "b")):
        mote = {
            "node": name,
            "role": "camera",
            "parent": "base",
            "app_tx_bytes": 95,
            "mac_tx_bytes": 200,
            "cpu_cycles": 500.0,
        }
        mote |= dict.fromkeys(ENERGY_COLUMNS, 1.0 + i)
        mote |= {"images_skipped": 3, "battery_capacity_j": 100.0, "died_at_s": math.nan}
        mote |= {"cpu_busy_s": 0.5, "frame_work_mean_s": 0.25, "work_longest_s": 0.2}
        mote |= dict.fromkeys(ACCESS_COLUMNS, 0)
        motes.append(mote)
    return pd.DataFrame([base, *motes])


def load(*rows):
    return pd.DataFrame(rows, columns=["time_s", "app_tx_bytes", "mac_tx_bytes"])


LOAD = load((0.0, 10, 0), (0.5, 110, 130), (1.0, 200, 350), (1.25, 200, 430))


def measure_traffic(message_rows=None, load_rows=LOAD):
    sent = messages() if message_rows is None else message_rows
    return traffic(sent, nodes(), load_rows, base="base", steps=2, step_s=0.5, simulated_s=1.25)


def test_the_peak_is_measured_between_consecutive_rows():
    # 130 and 220 bytes in half a second each, 80 in the last quarter: 260, 440 and 320 bytes a second
    assert measure_traffic()["bandwidth_peak_bps"] == 8 * 440
    # a short interval counts by its length: 80 bytes in an eighth of a second are 640 a second
    hurried = LOAD.assign(time_s=[0.0, 0.5, 1.0, 1.125])
    assert measure_traffic(load_rows=hurried)["bandwidth_peak_bps"] == 8 * 640
    assert measure_traffic(load_rows=LOAD.head(1))["bandwidth_peak_bps"] is None


def test_the_share_of_the_routing_protocol_is_one_of_bytes_on_the_air():
    sent = nodes()
    on_the_air = sent["mac_tx_bytes"].sum()
    told = sent.assign(control_tx_bytes=[0, 30, *[0] * (len(sent) - 2)])
    arguments = {"base": "base", "steps": 2, "step_s": 0.5, "simulated_s": 1.25}
    assert traffic(messages(), told, LOAD, **arguments)["control_share"] == 30 / on_the_air
    assert traffic(messages(), told.assign(mac_tx_bytes=0), LOAD, **arguments)["control_share"] is None
    # a run that was recorded before routes could change
    assert traffic(messages(), sent, LOAD, **arguments)["control_share"] is None


def test_messages_to_the_base_and_all_others_are_told_apart():
    figures = measure_traffic()
    assert figures["delivery_ratio"] == pytest.approx(1 / 3)
    assert figures["delivery_ratio_down"] == 1 / 2
    up = messages()["destination"] == "base"
    assert measure_traffic(messages()[up])["delivery_ratio_down"] is None
    assert measure_traffic(messages()[~up])["delivery_ratio"] is None


CHAIN = {"a": "b", "b": "c", "c": "base"}


@pytest.mark.parametrize(
    ("last", "reached"),
    [("delivered", (0, 1, 2, 3)), ("dropped_no_ack", ()), ("in_flight", ()), ("fused", ())],
)
def test_a_message_that_was_fused_shares_the_fate_of_what_it_is_in(last, reached):
    """Up a chain: 0 and 1 into 2, 2 into 3; 4 was refused, and 5 is between two nodes."""
    rows = [
        (0, "a", "b", 0.0, 10, "fused", 2),
        (1, "a", "b", 0.1, 10, "fused", 2),
        (2, "b", "c", 0.2, 20, "fused", 3),
        (3, "c", "base", 0.3, 25, last, 7 if last == "fused" else None),
        (4, "a", "b", 0.4, 10, "dropped_refused", None),
        (5, "a", "b", 0.5, 10, "in_flight", None),
    ]
    sent = pd.DataFrame(rows, columns=messages().columns.drop("kind")).assign(kind="packet")
    assert sent.loc[content_arrived(sent), "message"].tolist() == list(reached)
    towards_base = pd.DataFrame({"node": list(CHAIN), "parent": list(CHAIN.values())})
    figures = traffic(
        sent, nodes().merge(towards_base, on="node", how="outer", suffixes=("_star", "")), LOAD, base="base",
        steps=2, step_s=0.5, simulated_s=1.25,
    )  # fmt: skip
    assert figures["delivery_ratio"] == len(reached) / 6
    assert figures["delivery_ratio_down"] is None
    assert figures["base_ingress_bytes_per_step"] == (25 / 2 if reached else 0.0)


def test_what_went_to_a_former_parent_went_up_too():
    """The parent of b is c now, and was a; the base says something of the same kind to c."""
    rows = [
        (0, "b", "a", 0.0, 10, "fused", 2, "batch"),
        (1, "b", "a", 0.1, 10, "dropped_no_ack", None, "batch"),
        (2, "a", "base", 0.2, 20, "delivered", None, "batch"),
        (3, "base", "c", 0.3, 25, "delivered", None, "batch"),
        (4, "b", "a", 0.3, 25, "delivered", None, "greeting"),
    ]
    sent = pd.DataFrame(rows, columns=messages().columns)
    towards_base = pd.DataFrame({"node": ["a", "b", "c", "base"], "parent": ["base", "c", "base", None]})
    assert on_the_way_up(sent, towards_base, "base").tolist() == [True, True, True, False, False]


def test_four_cameras_of_a_thousand_weights_offer_a_megabit():
    rows = [
        (4 * k + c, f"c{c}", "base", k / 4, 8006, "delivered", None) for k in range(1, 37) for c in range(4)
    ]
    sent = pd.DataFrame(rows, columns=messages().columns.drop("kind")).assign(kind="packet")
    figures = traffic(sent, nodes(), LOAD, base="base", steps=36, step_s=0.25, simulated_s=9.5)
    assert figures["offered_bps"] == pytest.approx(4 * 4 * 8006 * 8)
    assert figures["offered_bps"] == pytest.approx(1.025e6, rel=1e-3)


def test_traffic():
    figures = measure_traffic()
    assert figures["offered_bps"] == 8 * 200 / 1.0
    assert figures["app_bytes_per_step"] == 100
    assert figures["mac_bytes_per_step"] == 215
    assert figures["bandwidth_mean_bps"] == 8 * 430 / 1.25
    assert figures["base_ingress_bytes_per_step"] == 50


def test_the_peak_is_never_below_the_mean(synthetic_run):
    for network in ("fine", "overloaded"):
        figures = synthetic_run(network).summary
        assert figures["bandwidth_peak_bps"] >= figures["bandwidth_mean_bps"]


def test_energy_counts_motes_and_not_the_base():
    figures = energy(nodes(), steps=2, simulated_s=1.0)
    assert figures["energy_total_j"] == 21.0
    assert figures["energy_per_step_j"] == 10.5
    assert figures["energy_max_node_j"] == 14.0
    assert figures["cpu_cycles_per_step"] == 500.0
    assert figures["images_skipped"] == 6
    assert figures["lifetime_first_death_s"] is None
    assert figures["lifetime_first_death_extrapolated_s"] == pytest.approx(100 / 14)


def test_a_mote_that_died_is_the_first_death():
    died = nodes()
    died.loc[1, "died_at_s"] = 0.25
    figures = energy(died, steps=2, simulated_s=1.0)
    assert figures["lifetime_first_death_s"] == 0.25
    assert figures["lifetime_first_death_extrapolated_s"] == pytest.approx(100 * 0.25 / 7)


def test_the_contract_keys_and_no_nan(synthetic_run):
    figures = synthetic_run().summary
    assert set(figures) == SUMMARY_KEYS
    assert "NaN" not in json.dumps(figures, allow_nan=False)
    assert figures["steps"] == 36
    assert figures["lost_fraction"] == 0.0
    assert figures["position_error_mean_m"] == pytest.approx(0.035 * math.sqrt(8 / math.pi), rel=0.25)


def test_the_offered_load_of_a_run_is_that_of_its_messages_over_its_frames(synthetic_run):
    run = synthetic_run("overloaded")
    weights = run.tables["messages"]["kind"] == "weights"
    # at every sixth step nothing is asked; frames are taken for 9 of the 9.25 seconds
    expected = 8 * (run.tables["messages"]["bytes"][weights].sum() + 30 * 80) / 9.0
    assert run.summary["offered_bps"] == pytest.approx(expected)
    assert run.summary["offered_bps"] > 2 * run.summary["channel_bps"]


def test_an_empty_run_has_no_figures_and_no_nan():
    empty = summary(
        steps=STEPS.head(0), nodes=nodes().head(1), messages=messages().head(0), load=LOAD.head(0),
        base="base", step_s=0.25, lost_above_m={}, channel_bps=None, simulated_s=1.0, wall_s=0.1,
    )  # fmt: skip
    json.dumps(empty, allow_nan=False)
    for key in (
        "position_error_mean_m",
        "lost_fraction",
        "delivery_ratio",
        "delivery_ratio_down",
        "offered_bps",
        "bandwidth_peak_bps",
        "energy_per_step_j",
        "latency_p50_s",
        "heard_ratio",
    ):
        assert empty[key] is None


def test_a_track_that_was_given_up_is_lost_however_near_it_stopped():
    ended = pd.concat([STEPS, steps([(3, "p", 0.2, 1.0, 0.3, "lost")])])
    assert accuracy(ended, LIMITS_M)["lost_fraction"] == 1.0
    found = pd.concat([ended, steps([(4, "p", 0.2, 1.0, 0.3, "update")])])
    assert accuracy(found, LIMITS_M)["lost_fraction"] == 0.5
