"""Heads by election: motes tell the base station what their batteries hold, and it names the fullest.

An election begins every so many seconds. Each mote says what it has left, at a time of its own so that they
do not all speak at once; when all have had their turn the base station decides. Only a change is announced,
for a frame a little later, so that everybody changes at the same one. It is announced again if the new head
is not heard. The paper has a cluster head, and does not say which node it is.
"""

import math
from collections.abc import Mapping

from wsnsim.messages.scanline import EnergyPayload
from wsnsim.systems.base import Context, Note, Scope, Send, Site, Step, Timer
from wsnsim.systems.scanline.choices import ElectedHead
from wsnsim.systems.scanline.offices import Office, next_office
from wsnsim.types import NodeId, Seconds

SPEAK = "speak:"
DECIDE = "decide:"
ANNOUNCE = "announce:"
_MOST_COLLECT_S = 2.0
"""From the beginning of an election to its decision."""
_COLLECT_SHARE = 0.25
"""Of the period, where that is less."""
_SPEAKING_SHARE = 0.75
"""Of that time the part in which motes speak; the rest is for messages on their way."""
_LIVES_SHARE = 2.0
"""Of the same time, in which a track shows that a head lives of which no battery was heard."""
_TIMES = 3
"""A broadcast is not acknowledged: a head is announced so often before its first frame, once a frame."""
_QUIET = 0.2
"""Of a frame period after a frame images are still read out, and nobody reports yet."""
_REPEAT_S = 1.0
_MOST_REPEATS = 5
"""Of announcements of a head that is not heard, one a second."""


def collect_s(params: ElectedHead) -> Seconds:
    """Return how long after the beginning of an election the base station decides [s]."""
    return min(_MOST_COLLECT_S, _COLLECT_SHARE * params.period_s)


def chosen(left_j: Mapping[int, float], head: int, margin: float) -> int:
    """Return who is to be the head: the mote that has most, or the head where nobody has clearly more.

    Parameters
    ----------
    left_j : what each mote that was heard has left, by its number [J]
    head : number of the present head; one that was not heard does not keep its place
    margin : share by which another must have more than the head
    """
    if not left_j:
        return head
    fullest = max(sorted(left_j), key=lambda number: left_j[number])
    stays = head in left_j and not left_j[fullest] > (1.0 + margin) * left_j[head]
    return head if stays else fullest


class Candidate:
    """A mote's part: it says what its battery holds.

    Parameters
    ----------
    params : of elections
    site : of the run
    number : of the mote
    """

    def __init__(self, params: ElectedHead, site: Site, number: int) -> None:
        self._params = params
        self._end_s = site.steps / site.rate_hz
        self._turn_s = _SPEAKING_SHARE * collect_s(params) * number / len(site.motes)

    def start(self) -> Step:
        """Wait for the first election."""
        return self._wait(0)

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Say what is left, and wait for the next election."""
        election = int(key.removeprefix(SPEAK))
        decided_s = election * self._params.period_s + collect_s(self._params)
        said = Send(Scope.BASE, EnergyPayload(election & 0xFF, ctx.battery_j), decided_s)
        return Step(sends=(said,), timers=self._wait(election + 1).timers)

    def _wait(self, election: int) -> Step:
        begins_s = election * self._params.period_s
        if begins_s >= self._end_s:
            return Step()
        return Step(timers=(Timer(f"{SPEAK}{election}", begins_s + self._turn_s),))


class Election:
    """The base station's part: it counts, decides, and announces.

    Parameters
    ----------
    params : of elections
    site : of the run
    office : the first
    """

    def __init__(self, params: ElectedHead, site: Site, office: Office) -> None:
        self._params = params
        self._site = site
        self._names = {number: name for name, number in site.motes.items()}
        self._election = 0
        self._left_j: dict[int, float] = {}
        self._latest_j: dict[int, float] = {}
        self._head_s = -math.inf
        self.office = office
        """The latest."""
        self._settled = True
        self._announced = 0
        self._told_s = -math.inf

    def start(self) -> Step:
        """Begin the first election."""
        return self._wait()

    def take(self, node: NodeId, payload: EnergyPayload) -> None:
        """Note what a mote has left; who says so when the election is over does not stand in it."""
        number = self._site.motes[node]
        self._latest_j[number] = payload.left_j
        if payload.election == self._election & 0xFF:
            self._left_j[number] = payload.left_j

    def heard(self, ctx: Context, node: NodeId, step: int) -> tuple[bool, Step]:
        """Tell whether a mote's track of a frame is wanted, and what is to be done about it.

        As long as the new head is not heard anybody's is. Who goes on beside it has not heard of it, and is
        told.
        """
        if self._site.motes[node] == self.office.head:
            self._head_s = ctx.now
            self._settled = self._settled or step >= self.office.first
            return True, Step()
        if not self._settled or step < self.office.first:
            return True, Step()
        if ctx.now < self._told_s + _REPEAT_S:
            return False, Step()
        self._told_s = ctx.now
        return False, Step(sends=(Send(node, self.office.payload()),))

    def decide(self, ctx: Context) -> Step:
        """Elect, and wait for the next election."""
        office, left_j = self.office, self._left_j
        counted = f"election {self._election}: {len(left_j)} of {len(self._site.motes)} motes heard"
        if ctx.now - self._head_s <= _LIVES_SHARE * collect_s(self._params) and office.head in self._latest_j:
            # it may have been too busy to say what it has left
            left_j = {office.head: self._latest_j[office.head], **left_j}
        head = chosen(left_j, office.head, self._params.margin)
        self._election += 1
        self._left_j = {}
        step = int(ctx.now * self._site.rate_hz)
        first = step + _TIMES + 2
        if head == office.head or first > self._site.steps:
            kept = Note("head_kept", f"{counted}, {self._names.get(head, 'the base station')} stays")
            return Step(timers=self._wait().timers, notes=(kept,))
        self.office = next_office(office, head, first)
        self._settled, self._announced = False, 0
        left = "on mains" if math.isinf(left_j[head]) else f"{left_j[head]:.4g} J"
        said = f"{counted}, {self._names[head]} has most, {left}; head from frame {first} on"
        soon = self._reminder((step + 1 + _QUIET) / self._site.rate_hz)
        return Step(timers=(*self._wait().timers, soon), notes=(Note("head_elected", said),))

    def announce(self, ctx: Context, key: str) -> Step:
        """Announce the head, again if it is not heard."""
        known = self._settled or int(key.removeprefix(ANNOUNCE)) != self.office.term
        if known or self._announced >= _TIMES + _MOST_REPEATS:
            return Step()
        self._announced += 1
        period_s = 1.0 / self._site.rate_hz
        later = self._reminder(ctx.now + (period_s if self._announced < _TIMES else max(_REPEAT_S, period_s)))
        return Step(sends=(Send(Scope.TREE, self.office.payload()),), timers=(later,))

    def _reminder(self, at_s: Seconds) -> Timer:
        return Timer(f"{ANNOUNCE}{self.office.term}", at_s)

    def _wait(self) -> Step:
        begins_s = self._election * self._params.period_s
        if begins_s >= self._site.steps / self._site.rate_hz:
            return Step()
        return Step(timers=(Timer(f"{DECIDE}{self._election}", begins_s + collect_s(self._params)),))
