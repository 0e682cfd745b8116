"""Within a bandwidth budget a mote never puts more on the air than its rate and its burst."""

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wsnsim.net.budget import TokenBucket
from wsnsim.records import FrameRow, MemorySink, MessageRow
from wsnsim.scenario.load import scenario_from_dict
from wsnsim.sim.budgets import least_burst_bytes
from wsnsim.sim.build import build

MACS = (
    {"kind": "csma_ca"},
    {"kind": "csma_ca", "max_frame_retries": 0, "max_channel_retries": 0},
    {"kind": "tdma"},
    {"kind": "lpl", "wake_interval_s": 0.05},
)


def most_beyond(times_and_sizes, rate_bps):
    """Return the most that was sent in any window beyond what came in meanwhile [B]."""
    most, beyond, before = 0.0, 0.0, 0.0
    for time_s, size in sorted(times_and_sizes):
        beyond = max(0.0, beyond - (time_s - before) * rate_bps / 8) + size
        most, before = max(most, beyond), time_s
    return most


@given(
    rate=st.integers(1, 10**6),
    burst=st.integers(1, 2000),
    events=st.lists(st.tuples(st.integers(0, 10**9), st.integers(1, 2000)), max_size=40),
)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_who_waits_for_the_bucket_keeps_to_its_rate_in_every_window(rate, burst, events):
    bucket, now, sent = TokenBucket(rate, burst), 0, []
    for pause, size in events:
        now += pause
        size = min(size, burst)
        bucket.spend(0, now)
        now += bucket.wait_ns(size)
        bucket.spend(size, now)
        sent.append((now, size))
    for first in range(len(sent)):
        total = 0
        for time, size in sent[first:]:
            total += size
            # in billionths of a bit, where nothing is rounded
            assert total * 8 * 10**9 <= rate * (time - sent[first][0]) + burst * 8 * 10**9


@given(
    seed=st.integers(0, 1000),
    rates=st.lists(st.sampled_from([None, 10_000, 16_000, 40_000]), min_size=4, max_size=4),
    at_limit=st.sampled_from(["drop", "delay", "degrade"]),
    mac=st.sampled_from(MACS),
    kind=st.sampled_from(["line", "star"]),
    payload=st.sampled_from([10, 90, 300]),
    saturated=st.booleans(),
)
@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
def test_no_mote_sends_more_than_its_budget(seed, rates, at_limit, mac, kind, payload, saturated):
    """Acknowledgements are sent whatever the budget: rates are such that they alone never exceed it."""
    size = {"spacing_m": 20} if kind == "line" else {"radius_m": 20}
    data = {
        "seed": seed,
        "duration_s": 1.5,
        "motes": {"layout": {"kind": kind, "nodes": 5, **size}, "default": {"platform": "telosb"}},
        "network": {"mac": mac, "routing": {"kind": "tree", "parents": _parents(kind)}},
        "system": {
            "kind": "traffic",
            "payload_bytes": payload, "period_s": 0.1, "saturated": saturated, "drain_s": 0.2,
        },
        "record": {"frames": True},
    }  # fmt: skip
    burst = least_burst_bytes(scenario_from_dict(data).scenario.network) + 100
    data["motes"]["nodes"] = [
        {"id": f"n{number}", "budget": {"bandwidth_bps": rate, "burst_bytes": burst, "at_limit": at_limit}}
        for number, rate in enumerate(rates, start=1)
        if rate is not None
    ]
    simulation = build(scenario_from_dict(data))
    sink = MemorySink()
    simulation.run(sink)
    frames = [row for row in sink.rows if isinstance(row, FrameRow)]
    for number, rate in enumerate(rates, start=1):
        own = {(row.time_s, row.bytes) for row in frames if row.sender == f"n{number}"}
        # a broadcast has a row for each receiver; what is on the air at the end has none
        unseen = simulation.network.counters(f"n{number}").mac_tx_bytes - sum(size for _, size in own)
        assert 0 <= unseen <= 127
        if rate is not None:
            assert most_beyond(own, rate) <= burst
    messages = [row for row in sink.rows if isinstance(row, MessageRow)]
    assert len({row.message for row in messages}) == len(messages)
    assert {row.outcome for row in messages} - {"delivered", "in_flight"} <= {
        "dropped_queue", "dropped_budget", "dropped_channel_access", "dropped_no_ack", "dropped_reassembly",
    }  # fmt: skip


def _parents(kind):
    return {f"n{number}": f"n{number - 1}" if kind == "line" else "n0" for number in range(1, 5)}
