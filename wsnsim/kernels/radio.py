"""What the begin and the end of a frame do at all who hear it: one pass over the sender's links.

The state of all radios is two tables of integers, a row for each node: what
every frame touches that arrives, be it ever so weak, in a small one that stays
in the processor's cache, and the rest in another.
Powers are whole numbers of a tiny unit: what a frame adds at its begin it takes
away at its end to the last digit, however many frames have come and gone.

Of a sender's links those come first whose frames a receiver may notice by
themselves. What comes after them adds to sums and hardly ever does anything
else; mixed, the processor would guess wrong at every other link.

Where time has instants at which several frames begin and end, the power at a
node is what it is when all of them are through: what was there for no time at
all leaves no trace.
"""

from wsnsim.kernels.jit import kernel
from wsnsim.types import IntArray

TOTAL = 0
"""Sum of the powers that arrive now [unit of power]."""
FLAGS = 1
"""Sum of those of the following that hold, of `ONE_LOUD` for each frame that arrives now and that a receiver
would notice by itself, and of `ONE_LOCKED` times the number of the sender on whose frame it has locked,
counted from 1."""
WANTED, WATCHED, TOLD = 1, 2, 4
"""It receives a frame that is for it; it wants to know when the channel becomes busy or idle; what it was
told last is busy."""
ONE_LOUD, LOUD_SHIFT, LOUD_MASK = 1 << 8, 8, (1 << 24) - 1
ONE_LOCKED, LOCKED_SHIFT, NO_LOCK_MASK = 1 << 32, 32, (1 << 32) - 1
AIR_COLUMNS = 2

DEAF_NS = 0
"""Until when it cannot lock on a frame: sending, turning round or off [ns]."""
LOCKED_NS = 1
"""When the frame began that it receives, or received last [ns]."""
UNLOCKED_NS = 2
"""When it last stopped receiving a frame [ns]."""
RECEIVED_NS = 3
"""Time spent receiving frames before the present one [ns]."""
ABOVE_NS = 4
"""Since when the total has been at the threshold of clear channel assessment or above [ns]."""
BURST_NS = 5
"""When a frame last began with the total at the threshold or above [ns]."""
BELOW_NS = 6
"""When the total last fell below it [ns]."""
EARLIER_BURST_NS = 7
"""The same, at an earlier instant [ns]."""
NOISE = 8
"""Noise in the receiver, where it is not the same in all at all times [unit of power]."""
STATE = 9
"""What it does, one of the following states but `RECEIVE`: a radio that has locked on a frame listens."""
SINCE_NS = 10
"""Since when [ns]."""
SPENT_NS = 11
"""Time spent before that in `TRANSMIT`, and in the columns that follow, in the other states [ns]."""
OPENED_NS = 14
"""When it was first switched on [ns]."""
COLUMNS = 16
"""The first eight, which is what a frame touches at a node that hears it, are one line of the cache."""

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
        radios[at, SPENT_NS + before - TRANSMIT] += now_ns - radios[at, SINCE_NS]
    radios[at, STATE] = state
    radios[at, SINCE_NS] = now_ns


@kernel
def note(report: IntArray, changed: int, at: int, before: int, flags: int) -> None:
    """Report a node that receives a frame for it, and what it has met until now."""
    report[CHANGED, changed] = at
    report[BEFORE, changed] = before
    report[LOUD_BEFORE, changed] = flags >> LOUD_SHIFT & LOUD_MASK


@kernel
def burst(radios: IntArray, at: int, rises: bool, now_ns: int) -> None:
    """Note at a node that a frame has begun with the total at the threshold or above.

    Parameters
    ----------
    rises : whether the total was below it before
    """
    if rises:
        radios[at, ABOVE_NS] = now_ns
    if radios[at, BURST_NS] != now_ns:
        radios[at, EARLIER_BURST_NS] = radios[at, BURST_NS]
        radios[at, BURST_NS] = now_ns


@kernel
def fall(radios: IntArray, at: int, now_ns: int) -> None:
    """Note at a node that the total has fallen below the threshold."""
    if radios[at, ABOVE_NS] < now_ns:
        radios[at, BELOW_NS] = now_ns
    if radios[at, BURST_NS] == now_ns:
        radios[at, BURST_NS] = radios[at, EARLIER_BURST_NS]


@kernel
def tell(air: IntArray, report: IntArray, told: int, at: int, flags: int, loud: bool) -> int:
    """Report a node that watches the channel if that has become busy or idle; return how many that makes.

    Parameters
    ----------
    loud : whether the total is at the threshold or above
    """
    busy = flags >= ONE_LOCKED or loud
    if busy == (flags & TOLD != 0):
        return told
    air[at, FLAGS] = flags ^ TOLD
    report[CARRIER, told] = at
    return told + 1


@kernel
def begin_frame(
    air: IntArray,
    radios: IntArray,
    receivers: IntArray,
    report: IntArray,
    sensitivity: int,
    cca: int,
    noise: int,
    lock_ratio: float,
    capture_ratio: float,
    capture_ns: int,
    powers: IntArray,
    first: int,
    start: int,
    weak: int,
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
    noise : in every receiver [unit]; -1: what stands in `radios`
    lock_ratio : smallest SINR at which it synchronises
    capture_ratio : how much stronger than all that arrives a frame must be to take over a receiver
    capture_ns : up to how long after the begin of the frame that it then loses [ns]; -1: it never does
    powers : (k,) - what arrives at the ends of links [unit], from link `first` on
    start, stop : the sender's links
    weak : the first of those that never reach the sensitivity; they come last

    Returns
    -------
    how many reports there are, packed as `LOCKS_SHIFT` and `CARRIER_SHIFT` have it
    """
    changed = locks = told = 0
    enter(radios, sender, TRANSMIT, now_ns)
    for link in range(start, weak):
        at, power = receivers[link], powers[link - first]
        before, flags = air[at, TOTAL], air[at, FLAGS]
        total = before + power
        air[at, TOTAL] = total
        if flags & WANTED:
            note(report, changed, at, before, flags)
            changed += 1
        if total >= cca:
            burst(radios, at, before < cca, now_ns)
        if power >= sensitivity:
            flags += ONE_LOUD
            if power >= lock_ratio * ((noise if noise >= 0 else radios[at, NOISE]) + before):
                if flags < ONE_LOCKED:
                    free = now_ns >= radios[at, DEAF_NS]
                else:
                    held_ns = now_ns - radios[at, LOCKED_NS]
                    free = held_ns <= capture_ns and power >= capture_ratio * before
                    if free:
                        radios[at, RECEIVED_NS] += held_ns
                if free:
                    radios[at, LOCKED_NS] = now_ns
                    flags = flags & NO_LOCK_MASK & ~WANTED | (sender + 1) << LOCKED_SHIFT
                    report[LOCKS, locks] = link
                    locks += 1
            air[at, FLAGS] = flags
        if flags & WATCHED:
            told = tell(air, report, told, at, flags, total >= cca)
    for link in range(weak, stop):
        at, power = receivers[link], powers[link - first]
        before, flags = air[at, TOTAL], air[at, FLAGS]
        total = before + power
        air[at, TOTAL] = total
        if total < cca and not flags & (WANTED | WATCHED):
            continue
        if flags & WANTED:
            note(report, changed, at, before, flags)
            changed += 1
        if total >= cca:
            burst(radios, at, before < cca, now_ns)
        if flags & WATCHED:
            told = tell(air, report, told, at, flags, total >= cca)
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
    weak: int,
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
    for link in range(start, weak):
        at, power = receivers[link], powers[link - first]
        before, flags = air[at, TOTAL], air[at, FLAGS]
        total = before - power
        air[at, TOTAL] = total
        if flags & WANTED:
            note(report, changed, at, before, flags)
            changed += 1
        if power >= sensitivity:
            flags -= ONE_LOUD
            if flags >> LOCKED_SHIFT == sender + 1:
                flags &= NO_LOCK_MASK & ~WANTED
                radios[at, UNLOCKED_NS] = now_ns
                radios[at, RECEIVED_NS] += now_ns - radios[at, LOCKED_NS]
            air[at, FLAGS] = flags
        if before >= cca and total < cca:
            fall(radios, at, now_ns)
        if flags & WATCHED:
            told = tell(air, report, told, at, flags, total >= cca)
    for link in range(weak, stop):
        at, power = receivers[link], powers[link - first]
        before, flags = air[at, TOTAL], air[at, FLAGS]
        total = before - power
        air[at, TOTAL] = total
        if before < cca and not flags & (WANTED | WATCHED):
            continue
        if flags & WANTED:
            note(report, changed, at, before, flags)
            changed += 1
        if before >= cca and total < cca:
            fall(radios, at, now_ns)
        if flags & WATCHED:
            told = tell(air, report, told, at, flags, total >= cca)
    return changed | told << CARRIER_SHIFT
