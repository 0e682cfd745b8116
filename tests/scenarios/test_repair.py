"""Trackers over routes that change: a relay's battery dies, and another relay takes over."""

from pathlib import Path

import pytest

import wsnsim
from wsnsim.metrics.conservation import violations
from wsnsim.metrics.traffic import content_arrived
from wsnsim.runs.result import Run
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.networks import routing_config

RELAYS = (
    "motes.nodes=[{id: relay, position_m: [17, 4, 3], battery: {kind: capacity, capacity_j: 0.8}}, "
    "{id: spare, position_m: [17.5, 6, 3]}]"
)
COMMON = ("duration_s=5", "expect={}", "system.particles=100", RELAYS)
REPAIRED = "network.routing={kind: min_hop_tree, repair: {}}"


def lasting(run: Run, node: str) -> list[tuple[str, str]]:
    """Return how a node's messages ended that were made a second after the relay's death or later."""
    died_s = run.nodes.set_index("node").loc["relay", "died_at_s"]
    late = run.messages[(run.messages["source"] == node) & (run.messages["created_s"] > died_s + 1.0)]
    # what was made in the last moment may still be on its way
    late = late[late["created_s"] < run.summary["simulated_s"] - 0.5]
    return list(zip(late["destination"], late["outcome"], strict=True))


@pytest.mark.parametrize("variant", ["T0", "T3"])
def test_below_a_dead_relay_cameras_are_heard_again(scenarios: Path, variant: str) -> None:
    """T0 sends to the base station; T3 fuses at every relay, hop by hop."""
    overrides = (*COMMON, f"system.variant={variant}", REPAIRED)
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=overrides)
    assert violations(run.tables, run.summary["simulated_s"]) == []
    nodes = run.nodes.set_index("node")
    died_s = nodes.loc["relay", "died_at_s"]
    assert 2.0 < died_s < 2.5
    moved = run.tables["events"].query("kind == 'reparented'")
    assert set(moved["node"]) >= {"c1", "c2", "c4"}
    assert moved["detail"].str.startswith("from relay to spare: ").all()
    assert (moved["time_s"] > died_s).all()
    assert (moved["time_s"] < died_s + 1.0).all()
    assert (nodes.loc[["c1", "c2", "c3", "c4"], "parent"] == "spare").all()
    for camera in ("c1", "c2", "c3", "c4"):
        fates = lasting(run, camera)
        assert len(fates) >= 5
        assert {to for to, _ in fates} == {"base" if variant == "T0" else "spare"}
        arrived = sum(outcome in ("delivered", "fused") for _, outcome in fates)
        assert arrived >= len(fates) - 1
    # all that motes say goes up, to whatever parent they had then
    arrived_up = content_arrived(run.messages)[run.messages["source"] != "base"]
    assert run.summary["delivery_ratio"] == pytest.approx(arrived_up.mean())
    # the tracker has its cameras again, and the target
    assert run.summary["lost_fraction"] == 0
    late = run.steps[run.steps["time_s"] > died_s + 1.0]
    # a broadcast of states may still be lost at the relay, and with it all answers
    assert (late["heard"] >= late["asked"] - 1).mean() >= 0.75
    assert 0.0 < run.summary["control_share"] < 0.2
    counted = nodes["control_tx_bytes"].sum() / nodes["mac_tx_bytes"].sum()
    assert run.summary["control_share"] == pytest.approx(counted)


def test_without_repair_they_are_lost_for_good(scenarios: Path) -> None:
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*COMMON, "system.variant=T0"))
    assert violations(run.tables, run.summary["simulated_s"]) == []
    assert {outcome for _, outcome in lasting(run, "c1")} <= {"dropped_no_ack"}
    assert run.summary["control_share"] == 0
    assert run.nodes["control_tx_bytes"].sum() == 0


def test_ways_may_be_found_by_the_motes_themselves(scenarios: Path) -> None:
    overrides = (
        *COMMON,
        "network.routing={repair: {initial: discover}}",
        "network.dissemination={repeats: 1}",
    )
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=overrides)
    assert violations(run.tables, run.summary["simulated_s"]) == []
    found = run.tables["events"].query("kind == 'reparented'")
    assert found["detail"].str.startswith("from nobody to ").sum() >= 6
    assert found["time_s"].min() < 0.3
    assert run.nodes["duplicates"].sum() > 0
    assert run.summary["lost_fraction"] == 0


SINK = "motes.sinks=[{id: gate, position_m: [-12, 4, 3]}]"


@pytest.mark.parametrize("network", ["ieee802154", "ideal"])
@pytest.mark.parametrize("variant", ["T0", "T3"])
def test_a_second_sink_takes_what_is_near_to_it(scenarios: Path, network: str, variant: str) -> None:
    overrides = (
        "duration_s=3",
        "expect={}",
        f"network.standard={network}",
        f"system.variant={variant}",
        SINK,
    )
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=overrides)
    assert violations(run.tables, run.summary["simulated_s"]) == []
    nodes = run.nodes.set_index("node")
    assert nodes.loc["gate", ["role", "parent", "depth"]].tolist() == ["sink", "base", 0]
    near = nodes.index[nodes["parent"] == "gate"]
    assert set(near) >= {"c1", "c4"}
    assert (nodes.loc[near, "depth"] == 1).all()
    direct = run.messages[run.messages["source"].isin(near)]
    assert (direct["destination"] == "base").all()
    assert (direct["outcome"] == "delivered").mean() > 0.9
    assert set(direct["hops"].dropna()) == {1}
    assert "gate" not in set(run.messages["source"]) | set(run.messages["destination"])
    assert run.summary["lost_fraction"] == 0
    assert nodes.loc["gate", "frames_tx"] > 0


def test_the_ends_of_ways_are_not_to_be_mixed_up(scenarios: Path) -> None:
    for override, words in (
        ("motes.sinks=[{id: base, position_m: [1, 1, 1]}]", "must be a name of its own"),
        ("motes.sinks=[{id: c1, position_m: [1, 1, 1]}]", "must be a name of its own"),
        ("network={mac: {kind: tdma}, routing: {repair: {}}}", "slots belong to the first tree"),
        ("network.routing={repair: {beacon_min_s: 0}}", "beacon_min_s"),
        ("network.dissemination={repeats: -1}", "repeats"),
        ("network.queue_policy=drop_all", "queue_policy"),
    ):
        with pytest.raises(wsnsim.ScenarioError, match=words):
            wsnsim.run(scenarios / "quickstart.yaml", overrides=("expect={}", override))


@pytest.mark.parametrize(
    ("mac", "given", "used_s"),
    [
        ("{kind: lpl, wake_interval_s: 0.1}", "null", 2.0),
        ("{kind: lpl, wake_interval_s: 0.1}", "0.5", 0.5),
        ("{kind: csma_ca}", "null", 0.128),
    ],
)
def test_beacons_are_rarer_where_each_holds_the_channel_for_long(scenarios, mac, given, used_s):
    overrides = (f"network.mac={mac}", f"network.routing={{repair: {{beacon_min_s: {given}}}}}")
    loaded = load_scenario(scenarios / "network" / "duty_cycle.yaml", overrides)
    repair = routing_config(loaded.scenario.network).repair
    assert repair is not None
    assert repair.beacon_min_s == pytest.approx(used_s)
