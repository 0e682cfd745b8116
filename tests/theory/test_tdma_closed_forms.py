"""TDMA against what can be computed by hand: latency of a hop and of a line, duty cycle, energy.

A message that is handed over at a time uniform in the superframe waits for its
node's slot: half a superframe in the mean, counted up to the instant at which
the sender must wake. It then takes start-up, turnaround and the frame. On a
line each further hop takes the time from one slot to the next, so that

    latency = F/2 + start-up + turnaround + air + Σ (slots from hop to hop).

Receivers are on for a start-up and two guards (and the header by which a frame
is noticed) in every slot that they must hear; a frame costs its sender
start-up, turnaround, the frame, turnaround, and the acknowledgement.
"""

import runpy
from pathlib import Path

import pytest

from wsnsim.net.mac.slots import Turn
from wsnsim.net.phy.ieee802154 import air_time_ns

TESTS = Path(__file__).parents[1]
RadioBench = runpy.run_path(str(TESTS / "radio_bench.py"))["RadioBench"]
SLEEP = runpy.run_path(str(TESTS / "sleep_bench.py"))
StateMeter, LedgerMeter, tdma, CC2420 = (
    SLEEP[name] for name in ("StateMeter", "LedgerMeter", "tdma", "CC2420")
)
START_UP, TURN, GUARD, SYNC = 860_000, 192_000, 1_000_000, 192_000
SLOT = START_UP + TURN + 2 * GUARD + air_time_ns(127) + 864_000
AIR, ACK = air_time_ns(111), air_time_ns(5)
STEADY = {"drift_ppm": 0.0, "resync_s": 1000.0, "proportional": False, "interference_dbm": -95.0}
ALONE = {"sensitivity_dbm": -95.0, "noise_dbm": -107.0, "spacing_m": 60.0}
"""On a line with these, neighbours hear and disturb each other and nobody else."""


def mean_latency_ns(bench, source, count, superframe_ns):
    """Send messages at all phases of the superframe alike, far apart; return their mean latency [ns]."""
    sent = {}
    for k in range(count):
        at_ns = k * 20 * superframe_ns + round((k + 0.5) / count * superframe_ns)
        sent[bench.send(source, "n0", bytes(100), at_ns=at_ns)] = at_ns
    bench.run((count + 1) * 20 * superframe_ns / 1e9)
    assert len(bench.delivered_at) == count
    return sum(at - sent[datagram.number] for at, datagram, _, _ in bench.delivered_at) / count


def test_a_hop_takes_half_a_superframe_and_the_frame():
    bench = RadioBench.star(3, family=tdma(**STEADY))
    superframe_ns = 4 * SLOT
    assert bench.network._stack.family.superframe_ns == superframe_ns
    expected_ns = superframe_ns / 2 + START_UP + TURN + AIR
    # a grid of phases misses the mean by half a step at most
    step_ns = superframe_ns / 100
    assert mean_latency_ns(bench, "n2", 100, superframe_ns) == pytest.approx(expected_ns, abs=step_ns / 2)


@pytest.mark.parametrize("hops", [2, 3, 8])
def test_a_line_takes_half_a_superframe_and_the_slots_between_its_hops(hops):
    bench = RadioBench.line(hops + 1, family=tdma(**STEADY), **ALONE)
    family = bench.network._stack.family
    slots = min(2 * hops, 6)
    assert family.superframe_ns == slots * SLOT
    ups = [family.table.slots_of[Turn(at, up=True)] for at in range(hops, 0, -1)]
    # three slots are used in turn, so a message climbs a hop a slot until it must wait for the turns down
    assert ups == [(hop % 3,) for hop in range(hops)]
    waits = sum(1 if hop % 3 else slots - 2 for hop in range(1, hops))
    expected_ns = slots * SLOT / 2 + START_UP + TURN + AIR + waits * SLOT
    step_ns = slots * SLOT / 60
    assert mean_latency_ns(bench, f"n{hops}", 60, slots * SLOT) == pytest.approx(expected_ns, abs=step_ns / 2)


def test_the_duty_cycle_without_traffic_is_what_the_slots_of_others_take():
    meters = {f"n{at}": StateMeter() for at in range(4)}
    bench = RadioBench.star(3, family=tdma(**STEADY), meters=meters)
    superframes = 50
    bench.run(superframes * 4 * SLOT / 1e9)
    for node, meter in meters.items():
        spent = meter.until(bench.env.now)
        heard = superframes * (3 if node == "n0" else 1)
        assert spent["start"] == heard * START_UP
        assert spent["listen"] == heard * (2 * GUARD + SYNC)
        assert spent["transmit"] == spent["receive"] == 0
        assert sum(spent.values()) == bench.env.now == superframes * 4 * SLOT


def test_the_energy_of_messages_follows_from_the_slots():
    meters = {"n0": LedgerMeter(), "n1": LedgerMeter()}
    bench = RadioBench.star(1, family=tdma(**STEADY), meters=meters)
    superframes, messages = 400, 100
    for k in range(messages):
        bench.send("n1", "n0", bytes(100), at_ns=k * 8 * SLOT + 3 * SLOT)
    bench.run(superframes * 2 * SLOT / 1e9)
    total_ns = superframes * 2 * SLOT
    sender_ns = {
        "transmit": messages * AIR,
        "receive": messages * ACK,
        # turning to send and back again; and the base's slot of every superframe
        "listen": messages * 2 * TURN + superframes * (2 * GUARD + SYNC),
        "start": (messages + superframes) * START_UP,
    }
    base_ns = {
        "transmit": messages * ACK,
        "receive": messages * AIR,
        "listen": messages * (GUARD + TURN) + (superframes - messages) * (2 * GUARD + SYNC),
        "start": superframes * START_UP,
    }
    power_w = {
        "transmit": CC2420.transmit_w(0.0),
        "receive": CC2420.receive_w,
        "listen": CC2420.listen_w,
        "start": CC2420.start_w,
    }
    for node, spent_ns in (("n1", sender_ns), ("n0", base_ns)):
        seconds = meters[node].ledger.seconds(total_ns)
        for cause, expected_ns in spent_ns.items():
            assert seconds["radio", cause] == pytest.approx(expected_ns / 1e9, rel=1e-9), (node, cause)
        asleep_ns = total_ns - sum(spent_ns.values())
        energy_j = sum(power_w[cause] * spent / 1e9 for cause, spent in spent_ns.items())
        energy_j += CC2420.sleep_w * asleep_ns / 1e9
        assert meters[node].ledger.total_drawn_j(total_ns) == pytest.approx(energy_j, rel=1e-9)


def test_a_dissemination_goes_down_a_hop_a_slot():
    bench = RadioBench.line(6, family=tdma(**STEADY), **ALONE)
    nodes = tuple(f"n{at}" for at in range(1, 6))
    bench.send("n0", nodes, bytes(100), at_ns=0, disseminate=True)
    bench.run(2.0)
    arrived = {receiver: at for at, _, receiver, _ in bench.delivered_at}
    # turns down come after those up: slots 3, 4, 5, and those of the next superframe
    down = [3, 4, 5, 9, 10]
    assert arrived == {
        node: slot * SLOT + START_UP + TURN + GUARD + AIR for node, slot in zip(nodes, down, strict=True)
    }


def test_one_sender_gets_a_frame_through_in_every_superframe():
    bench = RadioBench.star(1, family=tdma(**STEADY))
    bench.saturate(["n1"], bytes(100), [0])
    bench.run(1000 * 2 * SLOT / 1e9)
    assert len(bench.delivered_at) == 1000
