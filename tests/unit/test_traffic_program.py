"""What a traffic source sends when: a program on its own, without a network."""

import numpy as np
import pytest
from pydantic import ValidationError

from wsnsim.errors import DecodeError, EncodeError, ScenarioError
from wsnsim.messages.packet import LARGEST_BYTES, SMALLEST_BYTES, PacketPayload
from wsnsim.net.fragmentation import MAX_DATAGRAM_BYTES
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Context, Role, Scope, Site
from wsnsim.systems.silent import SilentProgram
from wsnsim.systems.traffic.params import TrafficParams
from wsnsim.systems.traffic.program import SourceProgram
from wsnsim.systems.traffic.system import SYSTEM

END_S = 100.0


def params(**given):
    return TrafficParams(kind="traffic", **given)


def site(motes=("a", "b"), duration_s=END_S, seed=0):
    numbers = {name: number for number, name in enumerate(motes)}
    return Site({}, (), 1.0, 0, RandomStreams(seed), numbers, duration_s)


def source(seed=0, end_s=END_S, **given):
    return SourceProgram(params(**given), 3, end_s, np.random.default_rng(seed))


def departures(program):
    """Let a program's own timers run out; return times and sends."""
    times, sends = [], []
    step = program.on_start(Context("a", 0.0, np.inf))
    while step.timers:
        (timer,) = step.timers
        step = program.on_timer(Context("a", timer.at, np.inf), timer.key)
        times += [timer.at] * len(step.sends)
        sends += step.sends
    return np.array(times), sends


def test_packet_k_leaves_at_a_random_time_of_the_kth_period():
    times, sends = departures(source(period_s=10.0, payload_bytes=50))
    assert len(times) == 10
    phases = times / 10.0 - np.arange(10)
    assert ((phases >= 0) & (phases < 1)).all()
    assert len(set(phases.round(9))) == 10
    assert [send.payload.number for send in sends] == list(range(10))
    assert {(send.to, send.payload.origin, len(send.payload.encode())) for send in sends} == {
        (Scope.BASE, 3, 50)
    }


def test_the_phases_of_many_periods_are_uniform(test_seed):
    from scipy.stats import kstest

    times, _ = departures(source(test_seed, end_s=2000.0, period_s=1.0))
    assert len(times) == 2000
    assert kstest(times % 1.0, "uniform").pvalue > 1e-3


def test_without_jitter_packets_leave_on_the_period_and_none_at_the_end():
    times, _ = departures(source(period_s=0.1, jitter="none", start_s=1.0, end_s=2.0))
    # 2.0 is the end and 1.9 the last period's beginning, whatever 0.1 is as a float
    np.testing.assert_allclose(times, 1.0 + 0.1 * np.arange(10))


def test_poisson_gaps_are_exponential(test_seed):
    from scipy.stats import kstest

    times, _ = departures(source(test_seed, end_s=3000.0, period_s=1.0, jitter="poisson"))
    assert kstest(np.diff(times), "expon").pvalue > 1e-3
    # Poisson: the count's standard deviation is the root of its mean
    assert abs(len(times) - 3000) < 4 * np.sqrt(3000)


def test_a_start_after_the_end_says_nothing():
    times, _ = departures(source(start_s=200.0))
    assert len(times) == 0


def test_a_saturated_source_goes_on_when_the_last_packet_is_gone():
    program = source(saturated=True, jitter="none", period_s=2.0, end_s=10.0)
    (timer,) = program.on_start(Context("a", 0.0, np.inf)).timers
    (first,) = program.on_timer(Context("a", 0.0, np.inf), timer.key).sends
    assert first.when_left is not None
    (second,) = program.on_timer(Context("a", 0.004, np.inf), first.when_left).sends
    assert second.payload.number == 1
    # refused on the spot: it waits a period, or time would stand still
    refused = program.on_timer(Context("a", 0.004, np.inf), second.when_left)
    assert refused.sends == ()
    (again,) = refused.timers
    assert again.at == 2.004
    (third,) = program.on_timer(Context("a", 2.004, np.inf), again.key).sends
    assert program.on_timer(Context("a", 10.0, np.inf), third.when_left) == program.on_payload(None, None)


def test_who_sends_is_who_is_named():
    given = params(sources=("b",))
    assert isinstance(SYSTEM.program(given, site(), "a", Role.MOTE), SilentProgram)
    assert isinstance(SYSTEM.program(given, site(), "b", Role.MOTE), SourceProgram)
    assert isinstance(SYSTEM.program(params(), site(), "a", Role.MOTE), SourceProgram)
    for sources, path in (
        (("c",), r"system\.sources\[0\]"),
        ((), r"system\.sources"),
        (("a", "a"), r"\[1\]"),
    ):
        with pytest.raises(ScenarioError, match=path):
            SYSTEM.program(params(sources=sources), site(), "base", Role.BASE)


def test_sources_draw_from_streams_of_their_own():
    one, other, again = (
        departures(SYSTEM.program(params(), site(motes), node, Role.MOTE))[0]
        for motes, node in ((("a", "b"), "a"), (("a", "b"), "b"), (("b", "a", "z"), "a"))
    )
    assert (one != other).all()
    assert (one == again).all()


@pytest.mark.parametrize("size", [SMALLEST_BYTES, 11, 100, 5000])
def test_a_packet_comes_back_from_its_bytes(size):
    packet = PacketPayload(7, 70_000, 5_000_000_123, size)
    data = packet.encode()
    assert len(data) == size
    assert PacketPayload.decode(data) == PacketPayload(7, 70_000, 5_000_000_123 % 2**32, size)


@pytest.mark.parametrize(
    "packet", [(0, 0, 0, 9), (0, 0, 0, LARGEST_BYTES + 1), (65536, 0, 0, 20), (0, 2**24, 0, 20)]
)
def test_what_is_no_packet_is_not_encoded(packet):
    with pytest.raises(EncodeError, match="packet: "):
        PacketPayload(*packet).encode()


@pytest.mark.parametrize("data", [b"", b"\x20" * 9, b"\x21" * 10])
def test_what_is_no_packet_is_not_decoded(data):
    with pytest.raises(DecodeError, match="packet: must have 10 bytes or more"):
        PacketPayload.decode(data)


def test_the_longest_packet_is_the_longest_datagram():
    assert LARGEST_BYTES == MAX_DATAGRAM_BYTES
    params(payload_bytes=LARGEST_BYTES)
    for size in (SMALLEST_BYTES - 1, LARGEST_BYTES + 1):
        with pytest.raises(ValidationError):
            params(payload_bytes=size)
