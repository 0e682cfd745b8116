import re

import pytest
import simpy

from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.interface import Datagram, Outcome
from wsnsim.net.routing.tree import RoutingError, tree_from_parents

PARENTS = {"base": None, "relay": "base", "near": "base", "far": "relay"}


class Bench:
    def __init__(self):
        self.env = simpy.Environment()
        self.network = IdealNetwork(self.env, tree_from_parents(PARENTS), self)
        self.heard, self.lost = [], []

    def delivered(self, datagram, receiver, hops):
        self.heard.append((self.env.now, datagram.number, receiver, hops, datagram.data))

    def dropped(self, datagram, receiver, outcome):
        self.lost.append((datagram.number, receiver, outcome))


def test_datagrams_arrive_at_once_but_not_inside_the_call_and_in_order():
    bench = Bench()
    bench.env.run(until=5)
    for number, source in enumerate(("far", "near", "base")):
        bench.network.send(Datagram(number, source, ("base",), bytes([number])))
    assert bench.heard == []
    bench.env.run(until=6)
    assert bench.heard == [
        (5, 0, "base", 2, b"\0"),
        (5, 1, "base", 1, b"\1"),
        (5, 2, "base", 0, b"\2"),
    ]


def test_bytes_are_counted_hop_by_hop():
    bench = Bench()
    bench.network.send(Datagram(0, "far", ("base",), bytes(300)))
    bench.network.send(Datagram(1, "base", ("relay", "near", "far"), bytes(80), disseminate=True))
    bench.env.run()
    counters = {node: bench.network.counters(node) for node in PARENTS}
    assert {n: c.mac_tx_bytes for n, c in counters.items()} == {
        "base": 80, "relay": 380, "near": 0, "far": 300
    }  # fmt: skip
    assert {n: c.mac_rx_bytes for n, c in counters.items()} == {
        "base": 300, "relay": 380, "near": 80, "far": 80
    }  # fmt: skip
    assert {n: c.frames_tx for n, c in counters.items()} == {"base": 1, "relay": 2, "near": 0, "far": 1}
    assert bench.network.fragments(8000) == 1
    assert [(r, h) for _, n, r, h, _ in bench.heard if n == 1] == [("relay", 1), ("near", 1), ("far", 2)]


def test_nothing_passes_a_stopped_node():
    bench = Bench()
    bench.network.send(Datagram(0, "far", ("base",), b"a"))
    bench.network.stop_node("relay")
    bench.network.send(Datagram(1, "near", ("base",), b"b"))
    bench.network.send(Datagram(2, "base", ("relay", "near", "far"), b"c", disseminate=True))
    bench.network.send(Datagram(3, "relay", ("far",), b"d", disseminate=True))
    bench.env.run()
    assert [(n, r) for _, n, r, _, _ in bench.heard] == [(1, "base"), (2, "near")]
    assert bench.lost == [
        (0, "base", Outcome.DEAD),
        (2, "relay", Outcome.DEAD),
        (2, "far", Outcome.DEAD),
        (3, "far", Outcome.DEAD),
    ]
    assert bench.network.counters("relay").mac_rx_bytes == 0
    assert bench.network.counters("far").mac_tx_bytes == 1


def test_impossible_datagrams_are_refused():
    with pytest.raises(RoutingError, match=re.escape("dissemination goes down the tree")):
        Bench().network.send(Datagram(0, "far", ("base",), b"", disseminate=True))
