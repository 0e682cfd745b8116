"""What the begin and the end of a frame do at all who hear it: one pass over the sender's links.

The state of all radios is two tables of integers, a row for each node: what
every frame touches that arrives, be it ever so weak, in a small one that stays
in the processor's cache, and the rest in another.
Powers are whole numbers of a tiny unit: what a frame adds at its begin it takes
away at its end to the last digit, however many frames have come and gone.

Where time has instants at which several frames begin and end, the power at a
node is what it is when all of them are through: what was there for no time at
all leaves no trace.
"""

from wsnsim.kernels.jit import kernel
from wsnsim.types import IntArray

TOTAL = 0
"""Sum of the powers that arrive now [unit of power]."""
FLAGS = 1
"""Sum of those of the following that hold."""
WANTED, WATCHED, TOLD = 1, 2, 4
"""It receives a frame that is for it; it wants to know when the channel becomes busy or idle; what it was
told last is busy."""
AIR_COLUMNS = 2

LOUD = 0
"""How many frames arrive now that a receiver would notice by themselves."""
LOCKED = 1
"""Sender of the frame that it is receiving, -1 for none."""
DEAF_NS = 2
"""Until when it cannot lock on a frame: sending, turning round or off [ns]."""
NOISE = 3
"""Noise in the receiver [unit of power]."""
STATE = 4
"""What it does: one of the following states."""
SINCE_NS = 5
"""Since when; where it receives a frame, that is when the frame began [ns]."""
UNLOCKED_NS = 6
"""When it last stopped receiving a frame [ns]."""
SPENT_NS = 6
"""Plus the number of a state: time spent in it before that, listening excepted, which is the rest [ns]."""
OPENED_NS = 11
"""When it was first switched on [ns]."""
ABOVE_NS = 12
"""Since when the total has been at the threshold of clear channel assessment or above [ns]."""
BURST_NS = 13
"""When a frame last began with the total at the threshold or above [ns]."""
BELOW_NS = 14
"""When the total last fell below it [ns]."""
EARLIER_BURST_NS = 15
"""The same, at an earlier instant [ns]."""
COLUMNS = 16
"""The first eight, which is what a frame touches at a node that notices it, are one line of the cache."""

LISTEN, RECEIVE, TRANSMIT, SLEEP, START = 0, 1, 2, 3, 4

CHANGED, BEFORE, LOUD_BEFORE, LOCKS, CARRIER = 0, 1, 2, 3, 4
"""Rows of what a kernel reports: nodes whose reception of a frame that is for them meets another power from
now on, the total and the number of loud frames until now; links whose receiver locked on the frame; nodes
whose channel has become busy or idle."""
LOCKS_SHIFT, CARRIER_SHIFT, COUNT_MASK = 20, 40, (1 << 20) - 1
"""How the three numbers of reports lie in the one that a kernel returns."""


@kernel
def enter(radios: IntArray, at: int, state: int, now_ns: int) -> None:
    """Let a node's radio be in a state from now on."""
    before = radios[at, STATE]
    if before != LISTEN:
        radios[at, SPENT_NS + before] += now_ns - radios[at, SINCE_NS]
    radios[at, STATE] = state
    radios[at, SINCE_NS] = now_ns


@kernel
def begin_frame(
    air: IntArray,
    radios: IntArray,
    receivers: IntArray,
    report: IntArray,
    sensitivity: int,
    cca: int,
    lock_ratio: float,
    capture_ratio: float,
    capture_ns: int,
    powers: IntArray,
    first: int,
    start: int,
    stop: int,
    sender: int,
    now_ns: int,
) -> int:
    """Let a frame begin.

    Parameters
    ----------
    air : (n, AIR_COLUMNS) - what arrives at all radios, changed in place
    radios : (n, COLUMNS) - the state of all radios, changed in place
    receivers : (m,) - ends of all links
    report : (5, >= m) - what is reported, see `CHANGED`, changed in place
    sensitivity : weakest frame that a receiver notices [unit]
    cca : threshold of clear channel assessment [unit]
    lock_ratio : smallest SINR at which it synchronises
    capture_ratio : how much stronger than all that arrives a frame must be to take over a receiver
    capture_ns : up to how long after the begin of the frame that it then loses [ns]; -1: it never does
    powers : (k,) - what arrives at the ends of links [unit], from link `first` on
    start, stop : the sender's links

    Returns
    -------
    how many reports there are, packed as `LOCKS_SHIFT` and `CARRIER_SHIFT` have it
    """
    changed = locks = told = 0
    enter(radios, sender, TRANSMIT, now_ns)
    for link in range(start, stop):
        at, power = receivers[link], powers[link - first]
        before, flags = air[at, TOTAL], air[at, FLAGS]
        if flags & WANTED:
            report[CHANGED, changed] = at
            report[BEFORE, changed] = before
            report[LOUD_BEFORE, changed] = radios[at, LOUD]
            changed += 1
        air[at, TOTAL] = before + power
        if before + power >= cca:
            if before < cca:
                radios[at, ABOVE_NS] = now_ns
            if radios[at, BURST_NS] != now_ns:
                radios[at, EARLIER_BURST_NS] = radios[at, BURST_NS]
                radios[at, BURST_NS] = now_ns
        if power >= sensitivity:
            radios[at, LOUD] += 1
            if power >= lock_ratio * (radios[at, NOISE] + before):
                if radios[at, LOCKED] < 0:
                    free = now_ns >= radios[at, DEAF_NS]
                else:
                    free = now_ns - radios[at, SINCE_NS] <= capture_ns and power >= capture_ratio * before
                if free:
                    enter(radios, at, RECEIVE, now_ns)
                    radios[at, LOCKED] = sender
                    flags &= ~WANTED
                    air[at, FLAGS] = flags
                    report[LOCKS, locks] = link
                    locks += 1
        if flags & WATCHED:
            busy = radios[at, LOCKED] >= 0 or air[at, TOTAL] >= cca
            if busy != (flags & TOLD != 0):
                air[at, FLAGS] = flags ^ TOLD
                report[CARRIER, told] = at
                told += 1
    return changed | locks << LOCKS_SHIFT | told << CARRIER_SHIFT


@kernel
def end_frame(
    air: IntArray,
    radios: IntArray,
    receivers: IntArray,
    report: IntArray,
    sensitivity: int,
    cca: int,
    turnaround_ns: int,
    powers: IntArray,
    first: int,
    start: int,
    stop: int,
    sender: int,
    now_ns: int,
) -> int:
    """Let a frame end; parameters and reports as those of `begin_frame`, but there are no locks.

    Parameters
    ----------
    turnaround_ns : how long the sender is deaf after it [ns]
    """
    changed = told = 0
    enter(radios, sender, LISTEN, now_ns)
    radios[sender, DEAF_NS] = now_ns + turnaround_ns
    for link in range(start, stop):
        at, power = receivers[link], powers[link - first]
        before, flags = air[at, TOTAL], air[at, FLAGS]
        if flags & WANTED:
            report[CHANGED, changed] = at
            report[BEFORE, changed] = before
            report[LOUD_BEFORE, changed] = radios[at, LOUD]
            changed += 1
        air[at, TOTAL] = before - power
        if power >= sensitivity:
            radios[at, LOUD] -= 1
            if radios[at, LOCKED] == sender:
                radios[at, LOCKED] = -1
                radios[at, UNLOCKED_NS] = now_ns
                flags &= ~WANTED
                air[at, FLAGS] = flags
                enter(radios, at, LISTEN, now_ns)
        if before >= cca and before - power < cca:
            if radios[at, ABOVE_NS] < now_ns:
                radios[at, BELOW_NS] = now_ns
            if radios[at, BURST_NS] == now_ns:
                radios[at, BURST_NS] = radios[at, EARLIER_BURST_NS]
        if flags & WATCHED:
            busy = radios[at, LOCKED] >= 0 or air[at, TOTAL] >= cca
            if busy != (flags & TOLD != 0):
                air[at, FLAGS] = flags ^ TOLD
                report[CARRIER, told] = at
                told += 1
    return changed | told << CARRIER_SHIFT
