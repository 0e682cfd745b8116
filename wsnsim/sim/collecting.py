"""Aggregation as a service of the network: what a node does with the messages of groups that pass it.

A node whose program is an `Aggregator` collects the messages of a group, its
own among them, until nothing more can come or its latest instant is there
(`wsnsim.net.collection`), has its program fuse them, and sends one message to
its parent. What comes after that goes on at once, as long as somebody wants
it. So a lost or late message costs its contribution, or its time, and never
the rest. Other nodes pass messages of groups on as they are.

Where the tree changes, everybody's parent, latest instant and what is below
follow it at once; what is on its way to a former parent is that one's, if it
arrives. The time that a hop takes is that of the tree at the beginning.

Left out: a child that its parent asks again for what is missing.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from wsnsim.errors import DecodeError, WsnsimError
from wsnsim.hardware.work import Work
from wsnsim.net.clock import Call, Clock
from wsnsim.net.collection import latest_s
from wsnsim.net.interface import Network, Outcome
from wsnsim.net.routing.tree import Tree
from wsnsim.sim.mail import REFUSED, UNDECODABLE, Letter, MailRoom
from wsnsim.sim.node import Node
from wsnsim.sim.places import Places
from wsnsim.systems.base import Aggregator, Context, GroupKey, Program, Received, Scope, Send
from wsnsim.types import Nanoseconds, NodeId, Seconds
from wsnsim.units import to_ns


class Way(Protocol):
    """What a node does with messages of groups."""

    def own(self, send: Send) -> None:
        """Take a message of the node's own program."""

    def arrived(self, number: int, letter: Letter) -> None:
        """Take a message from a child, and its number in the books."""

    def settled(self) -> None:
        """Learn that the node's program has finished with an input, and may know more."""

    def stop(self) -> None:
        """Stop for good: what waits here is lost."""


class Arriving:
    """Ends the way of messages of groups, at the base station."""

    def __init__(self, mail: MailRoom) -> None:
        self._mail = mail

    def own(self, send: Send) -> None:
        """Refuse a message that has nowhere to go.

        Raises
        ------
        WsnsimError : always
        """
        raise WsnsimError("send: a message of a group must go up to the base station, got one from there")

    def arrived(self, number: int, letter: Letter) -> None:
        """Give a message to the base station's program."""
        self._mail.arrived(number, letter.data)

    def settled(self) -> None:
        """Do nothing: nothing waits here."""

    def stop(self) -> None:
        """Do nothing: nothing waits here."""


class Forwarding:
    """Passes messages of groups on to the parent, each by itself and unchanged."""

    def __init__(self, node: NodeId, places: Places, network: Network, mail: MailRoom) -> None:
        self._node, self._places = node, places
        self._network, self._mail = network, mail

    def own(self, send: Send) -> None:
        """Send a message of the node's own."""
        expires_ns = None if send.expires is None else to_ns(send.expires)
        letter = Letter(self._node, send.payload.kind, send.payload.encode(), _group(send), expires_ns)
        self._mail.climb(self._network, self._node, self._places.of(self._node).parent, letter)

    def arrived(self, number: int, letter: Letter) -> None:
        """Send a child's message on."""
        onward = self._mail.climb(self._network, self._node, self._places.of(self._node).parent, letter)
        self._mail.fused((number,), onward)

    def settled(self) -> None:
        """Do nothing: nothing waits here."""

    def stop(self) -> None:
        """Do nothing: nothing waits here."""


@dataclass(frozen=True, slots=True)
class _Part:
    number: int | None
    """In the books; None for the node's own, which does not travel by itself."""
    received: Received


@dataclass(slots=True)
class _Gathering:
    """What a node has of one group."""

    due_ns: Nanoseconds
    latest_ns: Nanoseconds
    parts: list[_Part] = field(default_factory=list)
    making: list[_Part] = field(default_factory=list)
    """What the processor is fusing now."""
    timer: Call | None = None
    called: bool = False
    """Whether fusing waits for the processor; what comes until then is fused with the rest."""
    begun: bool = False
    """Whether an aggregate was made before, so that what comes now goes on at once."""


class Collecting:
    """Collects messages of groups, has the program fuse them, and sends the aggregate to the parent.

    Parameters
    ----------
    places : where each node stands in the tree
    frame_s : when the images of an epoch are taken [s]
    """

    def __init__(
        self,
        clock: Clock,
        node: Node,
        program: Aggregator,
        places: Places,
        network: Network,
        mail: MailRoom,
        frame_s: Callable[[int], Seconds],
    ) -> None:
        self._clock, self._node, self._program = clock, node, program
        self._places = places
        self._network, self._mail = network, mail
        self._frame_s = frame_s
        self._groups: dict[GroupKey, _Gathering] = {}

    def own(self, send: Send) -> None:
        """Take a message of the node's own as a part; whether to wait is asked when its step has settled."""
        gathering = self._open(_group(send))
        gathering.parts.append(_Part(None, Received(self._node.id, send.payload)))

    def arrived(self, number: int, letter: Letter) -> None:
        """Take a child's message as a part, if anybody still wants it."""
        try:
            payload = self._mail.decode(letter.data)
        except DecodeError:
            self._mail.set_aside((number,), UNDECODABLE)
            return
        with self._node.blamed():
            gathering = self._open(letter.group)
            if gathering.due_ns <= self._clock.now:
                self._mail.set_aside((number,), Outcome.EXPIRED.value)
                return
            gathering.parts.append(_Part(number, Received(letter.maker, payload)))
            self._consider(letter.group, gathering)

    def settled(self) -> None:
        """Ask again whether to wait."""
        for group, gathering in tuple(self._groups.items()):
            self._consider(group, gathering)

    def stop(self) -> None:
        """Stop for good: what waits here is lost."""
        for gathering in self._groups.values():
            if gathering.timer is not None:
                gathering.timer.cancel()
            self._drop(gathering.making + gathering.parts, Outcome.DEAD.value)
        self._groups.clear()

    def _open(self, group: GroupKey) -> _Gathering:
        gathering = self._groups.get(group)
        if gathering is None:
            now = self._clock.now
            self._groups = {
                key: old
                for key, old in self._groups.items()
                if old.due_ns > now or old.parts or old.making or old.called
            }
            due_s = self._program.due(group)
            latest = latest_s(due_s, self._places.of(self._node.id).lead_s, self._frame_s(group.epoch))
            gathering = self._groups[group] = _Gathering(to_ns(due_s), to_ns(latest))
        return gathering

    def _consider(self, group: GroupKey, gathering: _Gathering) -> None:
        """Have the parts fused now, or see to it that they will be."""
        if gathering.called or not gathering.parts:
            return
        received = tuple(part.received for part in gathering.parts)
        if gathering.begun or not self._program.awaits(group, received, self._places.of(self._node.id).below):
            self._call(group, gathering)
        elif gathering.timer is None:
            delay = max(0, gathering.latest_ns - self._clock.now)
            gathering.timer = self._clock.call(delay, lambda: self._call(group, gathering))

    def _call(self, group: GroupKey, gathering: _Gathering) -> None:
        """Have the processor fuse what is here when it comes to it."""
        if gathering.timer is not None:
            gathering.timer.cancel()
        gathering.called = True
        self._node.take(lambda ctx: self._begin(ctx, group, gathering))

    def _begin(self, ctx: Context, group: GroupKey, gathering: _Gathering) -> tuple[Work, Callable[[], None]]:
        """Fuse the parts; the result leaves when the work is done."""
        # what the node says itself goes to the network however late it is, as any other message does
        parts = gathering.parts
        if gathering.due_ns <= self._clock.now:
            self._drop(parts, Outcome.EXPIRED.value)
            parts = [part for part in parts if part.number is None]
        gathering.called, gathering.begun = False, True
        gathering.parts, gathering.making = [], parts
        if not parts:
            return Work(), _nothing
        aggregate = self._program.aggregate(ctx, group, tuple(part.received for part in parts))
        if aggregate.payload is None:
            return aggregate.work, partial(self._refuse, gathering)
        letter = Letter(
            self._node.id,
            aggregate.payload.kind,
            aggregate.payload.encode(),
            group,
            gathering.due_ns,
        )
        return aggregate.work, partial(self._send, gathering, letter)

    def _refuse(self, gathering: _Gathering) -> None:
        self._drop(gathering.making, REFUSED)
        gathering.making = []

    def _send(self, gathering: _Gathering, letter: Letter) -> None:
        onward = self._mail.climb(self._network, self._node.id, self._places.of(self._node.id).parent, letter)
        self._mail.fused(_numbers(gathering.making), onward)
        gathering.making = []

    def _drop(self, parts: list[_Part], outcome: str) -> None:
        self._mail.set_aside(_numbers(parts), outcome)


def ways(
    clock: Clock,
    tree: Tree,
    network: Network,
    mail: MailRoom,
    nodes: Mapping[NodeId, Node],
    programs: Mapping[NodeId, Program],
    frame_s: Callable[[int], Seconds],
) -> dict[NodeId, Way]:
    """Return what each node does with messages of groups.

    Parameters
    ----------
    nodes, programs : all nodes and what runs on them
    frame_s : when the images of an epoch are taken [s]
    """
    parents = {node: parent for node, parent in tree.parent.items() if parent is not None}
    aggregators = {node: program for node in parents if isinstance(program := programs[node], Aggregator)}
    usual = {node: program.usual() for node, program in aggregators.items()}
    # a node that only passes on carries what others have made
    carried_bytes = max((size for size, _ in usual.values()), default=0)
    hop_s = dict.fromkeys(parents, 0.0)
    # where nobody collects nobody waits, and in a large network the times take long to find
    for node in parents if aggregators else ():
        size, work = usual.get(node, (carried_bytes, Work()))
        hop_s[node] = nodes[node].platform.seconds(work) + network.hop_service_s(size, node)
    places = Places(tree, network, hop_s)
    mail.on_move(places.changed)
    found: dict[NodeId, Way] = {node: Arriving(mail) for node in tree.sinks}
    for node in parents:
        if node in found:
            continue
        if node in aggregators:
            found[node] = Collecting(clock, nodes[node], aggregators[node], places, network, mail, frame_s)
        else:
            found[node] = Forwarding(node, places, network, mail)
    return found


def _group(send: Send) -> GroupKey:
    """Return the group of a message that goes up the tree.

    Raises
    ------
    WsnsimError : it is for somebody else
    """
    assert send.group is not None
    if send.to is not Scope.BASE:
        to = f"Scope.{send.to.name}" if isinstance(send.to, Scope) else repr(send.to)
        raise WsnsimError(f"send: a message of a group must be for Scope.BASE, got one for {to}")
    return send.group


def _numbers(parts: list[_Part]) -> list[int]:
    return [part.number for part in parts if part.number is not None]


def _nothing() -> None:
    """Have no effect."""
