"""What the begin and the end of a frame do at all who hear it: one pass over the sender's links.

The state of all radios is one table of integers, a row for each node, so that
all that a frame touches at a node lies side by side in memory, and what it
touches where it is too weak to be noticed lies in one line of the cache.
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
WANTED = 1
"""1 while it receives a frame that is for it."""
WATCHED = 2
"""1 while it wants to know when the channel becomes busy or idle."""
LOUD = 3
"""How many frames arrive now that a receiver would notice by themselves."""
LOCKED = 4
"""Sender of the frame that it is receiving, -1 for none."""
DEAF_NS = 5
"""Until when it cannot lock on a frame: sending, turning round or off [ns]."""
NOISE = 6
"""Noise in the receiver [unit of power]."""
LOCKED_NS = 7
"""Begin of the frame that it is receiving [ns]."""
ABOVE_NS = 8
"""Since when the total has been at the threshold of clear channel assessment or above [ns]."""
BURST_NS = 9
"""When a frame last began with the total at the threshold or above [ns]."""
BELOW_NS = 10
"""When the total last fell below it [ns]."""
EARLIER_BURST_NS = 11
"""The same, at an earlier instant [ns]."""
STATE = 12
"""What it does: one of the following."""
SINCE_NS = 13
"""Since when [ns]."""
UNLOCKED_NS = 14
"""When it last stopped receiving a frame [ns]."""
TOLD = 15
"""1 if what it was told last is busy."""
SPENT_NS = 16
"""First of five columns: the time spent in each state before that [ns]."""
COLUMNS = 24

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
    radios[at, SPENT_NS + radios[at, STATE]] += now_ns - radios[at, SINCE_NS]
    radios[at, STATE] = state
    radios[at, SINCE_NS] = now_ns


@kernel
def begin_frame(
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
        before = radios[at, TOTAL]
        if radios[at, WANTED]:
            report[CHANGED, changed] = at
            report[BEFORE, changed] = before
            report[LOUD_BEFORE, changed] = radios[at, LOUD]
            changed += 1
        radios[at, TOTAL] = before + power
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
                    if free:
                        enter(radios, at, RECEIVE, now_ns)
                else:
                    free = now_ns - radios[at, LOCKED_NS] <= capture_ns and power >= capture_ratio * before
                if free:
                    radios[at, LOCKED] = sender
                    radios[at, LOCKED_NS] = now_ns
                    radios[at, WANTED] = 0
                    report[LOCKS, locks] = link
                    locks += 1
        if radios[at, WATCHED]:
            busy = radios[at, LOCKED] >= 0 or radios[at, TOTAL] >= cca
            if busy != (radios[at, TOLD] == 1):
                radios[at, TOLD] = busy
                report[CARRIER, told] = at
                told += 1
    return changed | locks << LOCKS_SHIFT | told << CARRIER_SHIFT


@kernel
def end_frame(
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
        before = radios[at, TOTAL]
        if radios[at, WANTED]:
            report[CHANGED, changed] = at
            report[BEFORE, changed] = before
            report[LOUD_BEFORE, changed] = radios[at, LOUD]
            changed += 1
        radios[at, TOTAL] = before - power
        if power >= sensitivity:
            radios[at, LOUD] -= 1
        if before >= cca and before - power < cca:
            if radios[at, ABOVE_NS] < now_ns:
                radios[at, BELOW_NS] = now_ns
            if radios[at, BURST_NS] == now_ns:
                radios[at, BURST_NS] = radios[at, EARLIER_BURST_NS]
        if radios[at, LOCKED] == sender:
            radios[at, LOCKED] = -1
            radios[at, UNLOCKED_NS] = now_ns
            radios[at, WANTED] = 0
            enter(radios, at, LISTEN, now_ns)
        if radios[at, WATCHED]:
            busy = radios[at, LOCKED] >= 0 or radios[at, TOTAL] >= cca
            if busy != (radios[at, TOLD] == 1):
                radios[at, TOLD] = busy
                report[CARRIER, told] = at
                told += 1
    return changed | told << CARRIER_SHIFT
