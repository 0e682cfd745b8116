"""Nodes on a tree that count themselves: what the tests of aggregation on the way run, over any network."""

import runpy
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
import simpy

from wsnsim.errors import DecodeError
from wsnsim.hardware.profiles import PLATFORMS, RADIOS
from wsnsim.hardware.work import Work
from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.propagation import LogDistance
from wsnsim.net.clock import Clock
from wsnsim.net.collection import GUARD_S
from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.interface import LinkCounters, Outcome
from wsnsim.net.radio import RadioNetwork
from wsnsim.net.routing.search import radio_links
from wsnsim.net.routing.tree import tree_from_parents
from wsnsim.records import MemorySink, MessageRow
from wsnsim.rng import RandomStreams
from wsnsim.sim.collecting import ways
from wsnsim.sim.mail import MailRoom
from wsnsim.sim.node import Node
from wsnsim.sim.power import NodePower
from wsnsim.systems.base import Aggregate, GroupKey, Role, Scope, Send, Step, Timer
from wsnsim.units import to_ns, to_s

stack_of = runpy.run_path(str(Path(__file__).parent / "radio_bench.py"))["stack_of"]
PLATFORM = PLATFORMS["imote2_416"]
CHAIN = {"base": None, "a": "base", "b": "a", "c": "b"}
STAR = {"base": None, "a": "base", "b": "base", "c": "base", "d": "base"}
BINARY = {"base": None, "a": "base", "b": "base", "c": "a", "d": "a", "e": "b", "f": "b"}
TREES = {"chain": CHAIN, "star": STAR, "binary": BINARY}


def work_s(seconds):
    """Return work that takes the bench's platform that long [s]."""
    return Work(int_ops=seconds * PLATFORM.clock_hz / PLATFORM.cycles_per_int_op)


@dataclass(frozen=True)
class Tally:
    """How often each node is counted."""

    tag: ClassVar[int] = 9
    kind: ClassVar[str] = "tally"
    epoch: int
    counts: dict[str, int]

    def encode(self):
        body = b"".join(
            bytes((len(name), count)) + name.encode() for name, count in sorted(self.counts.items())
        )
        return struct.pack("<BI", self.tag, self.epoch) + body

    @classmethod
    def decode(cls, data):
        if len(data) < 5:
            raise DecodeError("tally: too short")
        counts, at = {}, 5
        while at < len(data):
            size, count = data[at : at + 2]
            counts[data[at + 2 : at + 2 + size].decode()] = count
            at += 2 + size
        return cls(struct.unpack_from("<BI", data)[1], counts)


@dataclass
class Plan:
    """What the programs of a bench do, and when: epoch k begins at k · period_s."""

    epochs: int = 1
    period_s: float = 1.0
    due_s: float = 0.8
    """After an epoch's beginning."""
    fuse_s: float = 0.0
    """Time of making an aggregate."""
    usual_s: float | None = None
    """What the programs say of `fuse_s`; None for the truth."""
    speaks_s: dict = None
    """Node, or (node, epoch), to when it speaks after an epoch's beginning; 0.01 s for the others."""
    silent: tuple = ()
    """Nodes that are waited for, but say nothing."""
    refusing: tuple = ()
    """Nodes whose programs send nothing on."""
    plain: tuple = ()
    """Nodes whose programs are no aggregators."""
    expires_s: float | None = None

    def due(self, epoch):
        return epoch * self.period_s + self.due_s

    def speaks(self, node, epoch):
        times = self.speaks_s or {}
        return epoch * self.period_s + times.get((node, epoch), times.get(node, 0.01))


class Counting:
    """Counts its node once an epoch."""

    def __init__(self, plan, node):
        self.plan, self.node = plan, node
        self.heard = []
        self.fused = []

    def on_start(self, ctx):
        if self.node in ("base", *self.plan.silent):
            return Step()
        epochs = range(1, self.plan.epochs + 1)
        return Step(timers=tuple(Timer(str(k), self.plan.speaks(self.node, k)) for k in epochs))

    def on_frame(self, ctx, frame):
        return Step()

    def on_payload(self, ctx, message):
        self.heard.append((ctx.now, message.source, message.payload))
        return Step()

    def on_timer(self, ctx, key):
        epoch = int(key)
        expires = None if self.plan.expires_s is None else epoch * self.plan.period_s + self.plan.expires_s
        return Step(sends=(Send(Scope.BASE, Tally(epoch, {self.node: 1}), expires, group=GroupKey(epoch)),))


class Summing(Counting):
    """Adds up what passes its node; it does not look whether anything is counted twice."""

    def due(self, group):
        return self.plan.due(group.epoch)

    def usual(self):
        plan = self.plan
        return 30, work_s(plan.fuse_s if plan.usual_s is None else plan.usual_s)

    def awaits(self, group, parts, below):
        here = {name for part in parts for name in part.payload.counts}
        return not set(below) <= here

    def aggregate(self, ctx, group, parts):
        assert parts
        self.fused.append((ctx.now, tuple(part.source for part in parts)))
        total = {}
        for part in parts:
            assert part.payload.epoch == group.epoch
            for name, count in part.payload.counts.items():
                total[name] = total.get(name, 0) + count
        refused = self.node in self.plan.refusing
        return Aggregate(None if refused else Tally(group.epoch, total), work_s(self.plan.fuse_s))


class WildNetwork:
    """Delays, loses and repeats datagrams as they come.

    Parameters
    ----------
    fate : datagram to (delays of its copies [s]; none: it is lost), called once for each
    spoil : bytes of a datagram to those that arrive
    """

    def __init__(self, env, observer, fate, spoil=lambda datagram: datagram.data):
        self.clock, self.observer, self.fate, self.spoil = Clock(env), observer, fate, spoil
        self.stopped = set()

    def fragments(self, data_bytes):
        return 1

    def hop_service_s(self, data_bytes, node):
        return GUARD_S

    def send(self, datagram):
        (receiver,) = datagram.destinations
        delays = self.fate(datagram)
        if not delays:
            self.clock.call(0, lambda: self.observer.dropped(datagram, receiver, Outcome.NO_ACK))
            return
        told = []

        def arrive():
            if receiver not in self.stopped:
                told.append("delivered")
                self.observer.delivered(replace(datagram, data=self.spoil(datagram)), receiver, 1)
            elif not told:
                told.append("dropped")
                self.observer.dropped(datagram, receiver, Outcome.DEAD)

        for delay in delays:
            self.clock.call(to_ns(delay), arrive)

    def stop_node(self, node):
        self.stopped.add(node)

    def counters(self, node):
        return LinkCounters()


class CollectionBench:
    """A tree of nodes that count themselves, a base station that hears the sums, and the books.

    Parameters
    ----------
    parents : node to its parent, None for the base
    plan : what the programs do
    network : `ideal`, `ieee802154`, or a function of (environment, observer)
    capacities_j : batteries; all others are on mains
    """

    def __init__(self, parents, plan=None, network="ideal", capacities_j=None, seed=0, **config):
        self.plan = plan or Plan()
        self.env = simpy.Environment()
        self.clock = Clock(self.env)
        self.sink = MemorySink()
        self.tree = tree_from_parents(parents)
        self.nodes, self.programs = {}, {}
        upward = self.upward = {}
        self.mail = MailRoom(
            self.clock, self.sink, (Tally,), "base", tuple(node for node in parents if node != "base"),
            lambda receiver, message: self.nodes[receiver].take_message(message),
            lambda receiver, number, letter: upward[receiver].arrived(number, letter),
        )  # fmt: skip
        powers = {
            node: NodePower(self.clock, (capacities_j or {}).get(node), PLATFORM, RADIOS["cc2420"], 0.0, None)
            for node in parents
        }
        if network == "ideal":
            self.network = IdealNetwork(self.env, self.tree, self.mail)
        elif network == "ieee802154":
            stack = stack_of(config)
            links = radio_links(_places(self.tree), LogDistance(), stack.radio)
            self.network = RadioNetwork(
                self.env, tuple(self.tree.parent), self.tree, Channel(links), stack,
                RandomStreams(seed), self.mail, powers,
            )  # fmt: skip
        else:
            self.network = network(self.env, self.mail)
        for node in parents:
            plain = node == "base" or node in self.plan.plain
            self.programs[node] = (Counting if plain else Summing)(self.plan, node)

            def send(message, node=node):
                if message.group is None:
                    self.mail.post(self.network, node, message)
                else:
                    upward[node].own(message)

            def die(node):
                self.network.stop_node(node)
                upward[node].stop()

            self.nodes[node] = Node(
                self.clock, node, Role.BASE if node == "base" else Role.CAMERA, self.programs[node], PLATFORM,
                powers[node], self.sink, send, die, lambda node: upward[node].settled(),
            )  # fmt: skip
        upward |= ways(
            self.clock, self.tree, self.network, self.mail, self.nodes, self.programs,
            lambda epoch: epoch * self.plan.period_s,
        )  # fmt: skip

    def at(self, time_s, action):
        """Do something at a time [s]."""
        self.clock.call(to_ns(time_s) - self.clock.now, action)

    def run(self, until_s=None):
        """Run to the end, by default half a second after the last epoch's due, and return the messages."""
        plan = self.plan
        for node in self.nodes.values():
            node.start()
        until_s = plan.due(plan.epochs) + 0.5 if until_s is None else until_s
        self.env.run(until=to_ns(until_s))
        self.mail.close()
        return self.messages()

    def messages(self):
        """Return the table of messages, in the order of their numbers."""
        names = MessageRow.__dataclass_fields__
        rows = [row for row in self.sink.rows if isinstance(row, MessageRow)]
        table = pd.DataFrame([[getattr(row, name) for name in names] for row in rows], columns=list(names))
        return table.sort_values("message", kind="stable", ignore_index=True)

    def nodes_table(self):
        """Return of `nodes` what the laws of messages are checked against."""
        return pd.DataFrame(
            {
                "node": list(self.nodes),
                "parent": [self.tree.parent[node] for node in self.nodes],
                "app_tx_bytes": [self.mail.app_tx_bytes[node] for node in self.nodes],
            }
        )

    def counted(self, epoch=1):
        """Return how often the base station has each node in an epoch."""
        total = {}
        for _, _, tally in self.programs["base"].heard:
            if tally.epoch == epoch:
                for name, count in tally.counts.items():
                    total[name] = total.get(name, 0) + count
        return total

    def now_s(self):
        """Return the time [s]."""
        return to_s(self.clock.now)


def _places(tree):
    """Put nodes 8 m from their parents, in directions that keep them apart."""
    places = {tree.root: (0.0, 0.0, 0.0)}
    for node in tree.descendants(tree.root):
        parent = tree.parent[node]
        siblings = tree.children[parent]
        angle = np.pi * (siblings.index(node) + 1) / (len(siblings) + 1) + 0.1 * tree.depth[node]
        x, y, z = places[parent]
        places[node] = (x + 8.0 * float(np.cos(angle)), y + 8.0 * float(np.sin(angle)), z)
    return {node: places[node] for node in tree.parent}
