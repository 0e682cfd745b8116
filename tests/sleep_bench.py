"""What the tests of MACs that sleep share: accounts of radio states, and a channel played by hand."""

from itertools import pairwise

import numpy as np
import simpy

from wsnsim.hardware.ledger import EnergyLedger
from wsnsim.hardware.profiles import RADIOS
from wsnsim.net.clock import Clock
from wsnsim.net.mac.frames import MacAck, MacData
from wsnsim.net.mac.lpl_config import LplConfig
from wsnsim.net.mac.lpl_family import LplFamily
from wsnsim.net.mac.tdma_config import TdmaConfig
from wsnsim.net.mac.tdma_family import TdmaFamily
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee802154 import TURNAROUND_NS, air_time_ns
from wsnsim.net.phy.medium import Radio

CC2420 = RADIOS["cc2420"]


class StateMeter:
    """Asks a radio for the time [ns] that it spends in each state."""

    def attend(self, times):
        self.times = times

    def until(self, now_ns):
        """Return the times so far [ns]."""
        return self.times.spent_ns(now_ns)


class LedgerMeter:
    """Prices the states of a CC2420, on two AA cells."""

    def __init__(self):
        self.ledger = EnergyLedger(18_720.0)

    def attend(self, times):
        powers_w = {
            "sleep": CC2420.sleep_w,
            "start": CC2420.start_w,
            "listen": CC2420.listen_w,
            "receive": CC2420.receive_w,
            "transmit": CC2420.transmit_w(0.0),
        }
        self.ledger.meter(0, "radio", times, powers_w)


def lpl(**config):
    """Return what a bench makes its low-power listening of."""
    return lambda tree, names, links, radio: LplFamily(LplConfig(**config))


def tdma(**config):
    """Return what a bench makes its TDMA of."""
    return lambda tree, names, links, radio: TdmaFamily(TdmaConfig(**config)).on_tree(
        tree, names, links, radio
    )


class Stand:
    """Medium and upper layer in one: carries nothing, writes down what the MAC of node 1 does.

    Parameters
    ----------
    make : (clock, medium, address, random generator) to the MAC
    """

    def __init__(self, make):
        self.env = simpy.Environment()
        self.clock = Clock(self.env)
        self.is_busy = False
        self.states = [(0, "listen")]
        self.sent, self.done_with, self.got, self.watched = [], [], [], []
        self.mac = make(self.clock, self, 1, np.random.default_rng(5))
        self.radio = Radio(1, np.random.default_rng(6), self.mac)
        self.asleep = self.silent = False
        self.mac.connect(self.radio, self)

    def sleep(self, radio):
        self.asleep = True
        self.enter("sleep")

    def start(self, radio):
        assert self.asleep
        self.enter("start")

    def wake(self, radio):
        assert self.states[-1][1] == "start"
        self.asleep = False
        self.enter("listen")

    def enter(self, state):
        self.states.append((self.env.now, state))

    def spent_ns(self, until_ns):
        """Return the time spent in each state [ns]."""
        spent = {}
        for (since, state), (end, _) in pairwise([*self.states, (until_ns, None)]):
            spent[state] = spent.get(state, 0) + end - since
        return spent

    def turn(self, radio):
        assert not self.asleep

    def listen(self, radio):
        assert not self.asleep

    def watch(self, radio):
        assert not self.asleep
        self.watched.append(self.env.now)
        return self.is_busy

    def unwatch(self, radio):
        pass

    def silence(self, radio):
        self.silent = True

    def transmit(self, frame):
        assert not self.asleep
        assert not self.silent
        self.sent.append((self.env.now, frame))
        self.enter("transmit")

        def end():
            if not self.silent:
                self.enter("listen")
                self.mac.sent(frame)

        self.clock.call(air_time_ns(len(frame.mpdu)), end, first=True)

    def received(self, payload, source, cargo):
        self.got.append((payload, source, cargo))

    def done(self, outcome):
        self.done_with.append((self.env.now, outcome))

    def at(self, time_ns, action):
        self.clock.call(time_ns - self.env.now, action, first=True)

    def run(self, until_ns):
        self.env.run(until=until_ns)

    def until_sent(self, frames=1):
        """Run until so many frames have been sent; return the last and when it began."""
        while len(self.sent) < frames:
            self.env.step()
        return self.sent[-1]

    def hear(self, time_ns, mpdu, address=1, kind="data", cargo=None):
        """Let the MAC receive a frame that ends at a time, if its radio is on then."""
        transmission = Transmission(2, mpdu, address, (), kind, cargo=cargo)

        def arrive():
            if not (self.asleep or self.silent):
                self.mac.received(transmission)

        self.at(time_ns, arrive)

    def acknowledge(self, begun_ns, frame, wrong=0):
        """Answer a frame of the MAC in time; return when the answer ends."""
        ends = begun_ns + air_time_ns(len(frame.mpdu)) + TURNAROUND_NS + air_time_ns(5)
        self.hear(ends, MacAck((frame.mpdu[2] + wrong) % 256).encode(), kind="ack")
        return ends


def data_for(address, sequence, source=2, payload=b"hello"):
    """Return a data frame, which asks for an acknowledgement unless it is for all."""
    return MacData(sequence, 0xCAFE, address, source, payload, address != BROADCAST).encode()
