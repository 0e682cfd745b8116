"""A small radio network on a bench: what the network's tests send through it, and what they hear."""

import itertools
from dataclasses import fields, replace

import numpy as np
import simpy

from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.propagation import LogDistance
from wsnsim.net.config import LinkConfig, RadioConfig, RouteConfig
from wsnsim.net.interface import Datagram
from wsnsim.net.mac.csma_ca import CsmaCaConfig, CsmaCaFamily
from wsnsim.net.radio import RadioNetwork, Stack
from wsnsim.net.routing.search import radio_links, radio_tree
from wsnsim.net.routing.tree import tree_from_parents
from wsnsim.rng import RandomStreams

OTHERS = {
    "noise_dbm": -106.99,
    "sensitivity_dbm": -111.98,
    "cca_threshold_dbm": -96.6,
    "mesh_header_bytes": 0,
}
"""The radio of ns-3's lr-wpan module, which has no mesh header."""


def of_class(kind, config):
    """Return the entries of flat parameters that a class of parameters has."""
    return kind(**{field.name: config[field.name] for field in fields(kind) if field.name in config})


def stack_of(config):
    """Sort flat parameters of unslotted CSMA/CA over 802.15.4 by layer."""
    classes = (CsmaCaConfig, RadioConfig, LinkConfig, RouteConfig)
    unknown = set(config) - {field.name for kind in classes for field in fields(kind)}
    assert not unknown, unknown
    family = CsmaCaFamily(of_class(CsmaCaConfig, config))
    return Stack(family, of_class(RadioConfig, config), of_class(LinkConfig, config))


def tree_to(base, positions, propagation=None, **config):
    """Return the tree that the links of a 802.15.4 network suggest."""
    stack = stack_of(config)
    propagation = LogDistance() if propagation is None else propagation
    routes = of_class(RouteConfig, config)
    return radio_tree(positions, base, propagation, stack.family, stack.radio, routes)


class RadioBench:
    """A network, an observer that writes everything down, and a clock.

    Parameters
    ----------
    positions : node to (x, y, z) [m]
    parents : node to its parent, None for the base; or the name of the base
    routing : what becomes of routes while the network runs
    sinks : nodes whose parent, the base, they reach by wire
    config : flat parameters of all layers; `budgets` of nodes; whether to `record_frames`
    family : another MAC than CSMA/CA: makes a family of (tree, names, links, radio configuration)
    """

    def __init__(
        self, positions, parents, seed=0, meters=None, family=None, routing=None, sinks=(), **config
    ):
        self.env = simpy.Environment()
        self.delivered_at = []
        self.dropped_at = []
        self.frames = []
        self.on_fate = None
        self._numbers = itertools.count()
        record_frames, budgets = config.pop("record_frames", False), config.pop("budgets", None)
        stack, propagation = stack_of(config), LogDistance(exponent=3.0, reference_loss_db=40.05)
        if isinstance(parents, str):
            tree = tree_to(parents, positions, propagation, **config)
        else:
            tree = tree_from_parents(parents, frozenset(sinks))
        links = radio_links(positions, propagation, stack.radio)
        if family is not None:
            stack = replace(stack, family=family(tree, tuple(positions), links, stack.radio))
        if routing is not None:
            stack = replace(stack, routing=routing)
        self.moves, self.phy = [], stack.family.phy
        self.network = RadioNetwork(
            self.env,
            tuple(positions),
            tree,
            Channel(links),
            stack,
            RandomStreams(seed),
            self,
            {} if meters is None else meters,
            record_frames,
            budgets,
        )

    @classmethod
    def star(cls, leaves, seed=0, **config):
        """Put `leaves` nodes on a circle of 10 m round the base, with ns-3's radio."""
        angles = 2 * np.pi * np.arange(leaves) / leaves
        places = {f"n{i}": (10 * np.cos(a), 10 * np.sin(a), 0.0) for i, a in enumerate(angles, start=1)}
        parents = {"n0": None} | dict.fromkeys(places, "n0")
        return cls({"n0": (0.0, 0.0, 0.0), **places}, parents, seed, **(OTHERS | config))

    @classmethod
    def line(cls, nodes, spacing_m=50.0, seed=0, **config):
        """Put nodes in a row, each the parent of the next, with ns-3's radio."""
        places = {f"n{i}": (spacing_m * i, 0.0, 0.0) for i in range(nodes)}
        parents = {f"n{i}": f"n{i - 1}" if i else None for i in range(nodes)}
        return cls(places, parents, seed, **(OTHERS | config))

    def delivered(self, datagram, receiver, hops):
        self.delivered_at.append((self.env.now, datagram, receiver, hops))
        if self.on_fate is not None:
            self.on_fate(datagram)

    def dropped(self, datagram, receiver, outcome):
        self.dropped_at.append((self.env.now, datagram, receiver, outcome))
        if self.on_fate is not None:
            self.on_fate(datagram)

    def frame(self, row):
        self.frames.append(row)

    def reparented(self, node, old, new, why):
        self.moves.append((self.env.now, node, old, new, why))

    def at(self, time_ns, action):
        """Do something at a time [ns]."""
        self.env.timeout(time_ns - self.env.now).callbacks.append(lambda _: action())

    def send(self, source, destinations, data, at_ns=None, disseminate=False, expires_ns=None, one_hop=False):
        """Send now, or at a time [ns]; return the datagram's number."""
        if isinstance(destinations, str):
            destinations = (destinations,)
        number = next(self._numbers)
        datagram = Datagram(number, source, destinations, data, disseminate, expires_ns, one_hop)
        if at_ns is None:
            self.network.send(datagram)
        else:
            self.at(at_ns, lambda: self.network.send(datagram))
        return datagram.number

    def saturate(self, nodes, data, start_ns):
        """Let `nodes` always have something to say to the base, each from its own start on."""
        base = self.network.tree.root
        self.on_fate = lambda datagram: self.send(datagram.source, base, data)
        for node, start in zip(nodes, start_ns, strict=True):
            for _ in range(2):
                self.send(node, base, data, at_ns=int(start))

    def run(self, until_s):
        """Let time pass until `until_s` [s]."""
        self.env.run(until=round(until_s * 1e9))

    def fates(self):
        """Return how often each (datagram number, receiver) was delivered or dropped."""
        counted = {}
        for _, datagram, receiver, _ in (*self.delivered_at, *self.dropped_at):
            counted[datagram.number, receiver] = counted.get((datagram.number, receiver), 0) + 1
        return counted
