"""Whole runs over radios that sleep: books that balance, energy that differs, deaths in between."""

import pytest

import wsnsim
from wsnsim.metrics.conservation import violations
from wsnsim.metrics.figures import DROPPED

MACS = ("csma_ca", "lpl", "tdma")


def duty_cycle(scenarios, mac, *overrides):
    """Run the scenario that ships with the project under a MAC."""
    return wsnsim.run(
        scenarios / "network" / "duty_cycle.yaml", overrides=[f"network.mac={{kind: {mac}}}", *overrides]
    )


def sound(run):
    assert violations(run.tables, run.summary["simulated_s"]) == []
    figures = run.summary
    assert figures["generated"] == sum(figures[key] for key in ("delivered", "fused", "in_flight", *DROPPED))
    return figures


def test_radios_that_sleep_deliver_everything_for_a_fraction_of_the_energy(scenarios):
    figures = {mac: sound(duty_cycle(scenarios, mac, "duration_s=40")) for mac in MACS}
    assert [of["delivery_ratio"] for of in figures.values()] == [1.0, 1.0, 1.0]
    joules = {name: of["energy_total_j"] for name, of in figures.items()}
    # eleven TelosB motes that listen all the time draw 56.4 mW each, and little else
    assert joules["csma_ca"] == pytest.approx(11 * 0.0564 * figures["csma_ca"]["simulated_s"], rel=0.02)
    assert joules["lpl"] < 0.1 * joules["csma_ca"]
    assert joules["tdma"] < 0.05 * joules["csma_ca"]
    assert figures["csma_ca"]["latency_mean_s"] < 0.1 * figures["lpl"]["latency_mean_s"]


@pytest.mark.parametrize(("name", "capacity_j"), [("lpl", 0.06), ("tdma", 0.03)])
def test_motes_whose_batteries_empty_stop_wherever_they_are(scenarios, name, capacity_j):
    battery = f"motes.default.battery={{kind: capacity, capacity_j: {capacity_j}}}"
    run = duty_cycle(scenarios, name, "duration_s=30", "system.period_s=2", battery)
    figures = sound(run)
    dead = run.nodes["died_at_s"].notna()
    assert 0 < dead.sum() <= len(run.nodes) - 1
    assert figures["dropped_dead_node"] > 0
    assert figures["delivered"] > 0
