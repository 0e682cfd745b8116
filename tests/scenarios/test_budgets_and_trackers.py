"""A tracker whose cameras may not send what they would: it says less, or waits, or goes without."""

import pytest

import wsnsim

OVERRIDES = (
    "system.encoding=float64",
    "network.propagation.exponent=2.2",
    "duration_s=6",
    "expect={}",
    "record={}",
)


@pytest.fixture(scope="module")
def runs(scenarios):
    """Return runs in which four cameras would send 1,639 bytes four times a second and may send 24 kbit/s."""

    def run(at_limit):
        budget = f"motes.default.budget={{bandwidth_bps: 24000, at_limit: {at_limit}}}"
        return wsnsim.run(scenarios / "quickstart.yaml", overrides=(*OVERRIDES, budget))

    return {at_limit: run(at_limit) for at_limit in ("degrade", "delay")}


def test_degraded_answers_are_shorter_and_come_in_time(runs):
    degraded, delayed = runs["degrade"], runs["delay"]
    sizes = {
        name: set(run.messages[run.messages["kind"] == "weights"]["bytes"]) for name, run in runs.items()
    }
    # 200 weights of 8 bytes, 4, 2, and 1, behind 7 bytes of header and with four numbers more
    assert sizes["delay"] == {1639}
    assert sizes["degrade"] <= {1639, 823, 415, 211}
    assert len(sizes["degrade"]) > 1
    assert degraded.summary["heard_ratio"] > 0.9
    assert delayed.summary["heard_ratio"] < 0.5
    assert degraded.summary["position_error_mean_m"] < 0.12
    assert delayed.summary["budget_waited_s"] > 1 > degraded.summary["budget_waited_s"]


def test_neither_sends_more_than_its_budget(runs):
    for run in runs.values():
        seconds = run.summary["simulated_s"]
        motes = run.nodes[run.nodes["role"] != "base"]
        assert (8 * motes["mac_tx_bytes"] <= 24_000 * seconds + 8 * 3000).all()
