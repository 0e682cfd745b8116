"""Who is the cluster head from which frame on, as a node has heard."""

from dataclasses import dataclass

from wsnsim.messages.scanline import HeadPayload, step_near
from wsnsim.systems.base import Scope, Site
from wsnsim.systems.scanline.choices import Head, NodeHead
from wsnsim.types import NodeId

_TERMS = 256


@dataclass(frozen=True)
class Office:
    """One term of office.

    Parameters
    ----------
    term : counted in 8 bits
    head : number of the node that tracks; the base station is the one after the last mote
    first : number of the first frame that it takes
    """

    term: int
    head: int
    first: int

    def later_than(self, other: "Office") -> bool:
        """Tell whether it follows another, up to 127 terms later."""
        return 0 < (self.term - other.term) % _TERMS < _TERMS // 2

    def payload(self) -> HeadPayload:
        """Return what announces it."""
        return HeadPayload(self.term, self.head, self.first & 0xFF)


@dataclass(frozen=True)
class Offices:
    """What a node knows of who is the head.

    Parameters
    ----------
    now : the latest term that it has heard of
    before : the one that it knew before; it holds until the latest begins
    """

    now: Office
    before: Office

    def head_at(self, step: int) -> int:
        """Return the number of the head that takes a frame."""
        return (self.now if step >= self.now.first else self.before).head

    def after(self, office: Office) -> "Offices":
        """Return what is known when a later term was heard of; of an earlier one nobody takes notice."""
        return Offices(office, self.now) if office.later_than(self.now) else self


def announced(payload: HeadPayload, step: int) -> Office:
    """Return the term that a message is about, heard at about the time of a frame."""
    return Office(payload.term, payload.head, step_near(payload.first, step))


def next_office(office: Office, head: int, first: int) -> Office:
    """Return the term after another."""
    return Office((office.term + 1) % _TERMS, head, first)


def first_offices(head: Head, site: Site) -> Offices:
    """Return what all know at the beginning: where heads are elected, the base station is the first."""
    number = site.motes[head.id] if isinstance(head, NodeHead) else len(site.motes)
    office = Office(0, number, 0)
    return Offices(office, office)


def address(number: int, site: Site) -> NodeId | Scope:
    """Return where messages for a node go, by its number."""
    return next((name for name, each in site.motes.items() if each == number), Scope.BASE)
