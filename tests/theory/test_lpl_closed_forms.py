"""Low-power listening against what can be computed by hand: duty cycle, latency, copies, energy.

One hop, nobody else on the air. A sender that sleeps takes

    S = start-up + mean backoff + quiet time + turnaround

until its first copy begins. Copies begin every D = air + macAckWaitDuration +
turnaround. The receiver listens C long in each interval T; the copies begin
within that with probability C/T, and the first is received. Else its next
check opens after u, uniform on (0, T - C), and the first copy to begin after
that is received: u/D copies more, and half a one in the mean. So

    latency = S + air + (T - C)/T · ((T - C)/2 + D/2).

The crystal's start-up belongs to the check: it shifts all checks alike.
"""

import runpy
from pathlib import Path

import pytest

from wsnsim.net.mac.lpl_config import quiet_ns, step_ns
from wsnsim.net.phy.ieee802154 import air_time_ns

TESTS = Path(__file__).parents[1]
RadioBench = runpy.run_path(str(TESTS / "radio_bench.py"))["RadioBench"]
SLEEP = runpy.run_path(str(TESTS / "sleep_bench.py"))
StateMeter, LedgerMeter, lpl, CC2420 = (
    SLEEP[name] for name in ("StateMeter", "LedgerMeter", "lpl", "CC2420")
)
START_UP_S, CHECK_S, AFTER_S, TURN_S = 0.86e-3, 5.5e-3, 20e-3, 0.192e-3
MEAN_BACKOFF_S = 7.5 * 0.32e-3


def one_hop(interval_s, count, meters=None, payload_bytes=100):
    """Send messages whose times meet the receiver's checks at all phases alike; return the latencies [s]."""
    bench = RadioBench.star(1, family=lpl(wake_interval_s=interval_s), meters=meters)
    period_ns = round(5 * interval_s * 1e9)
    sent = {}
    for k in range(count):
        at_ns = k * period_ns + round(k / count * interval_s * 1e9)
        sent[bench.send("n1", "n0", bytes(payload_bytes), at_ns=at_ns)] = at_ns
    bench.run((count + 1) * period_ns / 1e9)
    assert len(bench.delivered_at) == count
    latencies = [(at - sent[datagram.number]) / 1e9 for at, datagram, _, _ in bench.delivered_at]
    return bench, latencies


@pytest.mark.parametrize("interval_s", [0.02, 0.1, 1.0])
def test_the_duty_cycle_without_traffic_is_start_up_and_check_over_the_interval(interval_s):
    meters = {"n0": StateMeter(), "n1": StateMeter()}
    bench = RadioBench.star(1, family=lpl(wake_interval_s=interval_s), meters=meters)
    bench.run(interval_s)
    before = {node: meter.until(bench.env.now) for node, meter in meters.items()}
    bench.run(101 * interval_s)
    for node, meter in meters.items():
        spent = meter.until(bench.env.now)
        assert sum(spent.values()) == bench.env.now
        awake_ns = {cause: spent[cause] - before[node][cause] for cause in ("start", "listen")}
        assert awake_ns == {"start": 100 * round(START_UP_S * 1e9), "listen": 100 * round(CHECK_S * 1e9)}
        assert spent["receive"] == spent["transmit"] == 0


def test_the_lifetime_on_two_aa_cells_follows_from_the_duty_cycle():
    meter = LedgerMeter()
    bench = RadioBench.star(1, family=lpl(wake_interval_s=0.5), meters={"n1": meter})
    bench.run(200.0)
    start, check = START_UP_S / 0.5, CHECK_S / 0.5
    mean_w = start * CC2420.start_w + check * CC2420.listen_w + (1 - start - check) * CC2420.sleep_w
    lasts_s = 18_720.0 * 200.0 / meter.ledger.total_drawn_j(bench.env.now)
    assert lasts_s == pytest.approx(18_720.0 / mean_w, rel=1e-3)
    # 3.842 days of listening become ten months
    assert lasts_s / 86_400 == pytest.approx(316.0, rel=0.01)


@pytest.mark.parametrize("interval_s", [0.05, 0.1, 0.5])
def test_the_mean_latency_of_a_hop_is_half_an_interval_and_what_a_copy_takes(interval_s):
    bench, latencies = one_hop(interval_s, 400)
    air_s, step_s = air_time_ns(111) / 1e9, step_ns(111) / 1e9
    setup_s = START_UP_S + MEAN_BACKOFF_S + quiet_ns() / 1e9 + TURN_S
    asleep_s = interval_s - CHECK_S
    mean_s = setup_s + air_s + asleep_s / interval_s * (asleep_s + step_s) / 2.0
    # phases are spread evenly: what is left is the backoffs' part of one copy, below 1 %
    assert sum(latencies) / len(latencies) == pytest.approx(mean_s, rel=0.03)
    least_s = quiet_ns() / 1e9 + TURN_S + air_s
    assert min(latencies) >= least_s
    assert max(latencies) <= setup_s + MEAN_BACKOFF_S + interval_s + step_s + air_s
    copies = bench.network.counters("n1").frames_tx / 400
    assert copies == pytest.approx(1 + asleep_s / interval_s * (asleep_s / step_s + 1.0) / 2.0, rel=0.03)


def test_the_energy_of_a_message_follows_from_the_copies():
    """What a message costs the sender, beyond a node's looks: copies, the gaps after them, waking time."""
    interval_s, count = 0.1, 400
    meters = {"n0": LedgerMeter(), "n1": LedgerMeter()}
    bench, _ = one_hop(interval_s, count, meters)
    air_s, ack_s, step_s = air_time_ns(111) / 1e9, air_time_ns(5) / 1e9, step_ns(111) / 1e9
    asleep_s = interval_s - CHECK_S
    copies = 1 + asleep_s / interval_s * (asleep_s / step_s + 1.0) / 2.0
    seconds = meters["n1"].ledger.seconds(bench.env.now)
    assert seconds["radio", "transmit"] == pytest.approx(count * copies * air_s, rel=0.03)
    awake_s = START_UP_S + MEAN_BACKOFF_S + quiet_ns() / 1e9 + TURN_S + copies * step_s
    awake_s += TURN_S + ack_s + AFTER_S - (step_s - air_s)
    # looks that fall into the waking time are left out, the share of the time that a message takes
    looks = count * 5 * (1 - awake_s / (5 * interval_s))
    on_s = sum(spent for (_, cause), spent in seconds.items() if cause != "sleep")
    assert on_s == pytest.approx(count * awake_s + looks * (START_UP_S + CHECK_S), rel=0.05)
    starts_s = (count + looks) * START_UP_S
    assert seconds["radio", "start"] == pytest.approx(starts_s, rel=0.05)
    energy_j = count * copies * air_s * CC2420.transmit_w(0.0) + starts_s * CC2420.start_w
    energy_j += (count * (awake_s - START_UP_S - copies * air_s) + looks * CHECK_S) * CC2420.listen_w
    energy_j += (bench.env.now / 1e9 - on_s) * CC2420.sleep_w
    assert meters["n1"].ledger.total_drawn_j(bench.env.now) == pytest.approx(energy_j, rel=0.05)
    answers_s = meters["n0"].ledger.seconds(bench.env.now)["radio", "transmit"]
    assert answers_s == pytest.approx(count * ack_s, rel=1e-9)


def test_a_burst_finds_its_receiver_awake():
    """Of the frames of a long message only the first waits for the receiver to look."""
    bench = RadioBench.star(1, family=lpl(wake_interval_s=0.5))
    bench.send("n1", "n0", bytes(1000), at_ns=0)
    bench.run(2.0)
    ((_, _, _, _),) = bench.delivered_at
    fragments = bench.network.fragments(1000)
    assert fragments == 10
    counters = bench.network.counters("n1")
    base = bench.network.counters("n0")
    assert base.frames_tx == fragments
    assert counters.attempts_failed == counters.attempts - fragments
    assert bench.delivered_at[0][0] / 1e9 < 0.5 + 10 * 0.02


def test_a_broadcast_wakes_every_child_once_and_reaches_all():
    bench = RadioBench.star(6, family=lpl(wake_interval_s=0.2), record_frames=True)
    children = tuple(f"n{at}" for at in range(1, 7))
    bench.send("n0", children, bytes(80), at_ns=10_000_000, disseminate=True)
    bench.run(1.0)
    assert {receiver for _, _, receiver, _ in bench.delivered_at} == set(children)
    assert len(bench.delivered_at) == 6
    air_s = air_time_ns(91) / 1e9
    least_s, most_s = 0.2 + START_UP_S, 0.2 + START_UP_S + 2 * step_ns(91) / 1e9
    copies = bench.network.counters("n0").frames_tx
    gap_s = air_s + 0.64e-3
    assert least_s / gap_s <= copies <= most_s / gap_s + 1
    by_children_s = [at / 1e9 - 0.01 for at, _, _, _ in bench.delivered_at]
    assert max(by_children_s) <= START_UP_S + 2 * MEAN_BACKOFF_S + quiet_ns() / 1e9 + TURN_S + most_s + air_s
