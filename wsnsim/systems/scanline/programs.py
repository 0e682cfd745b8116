"""What runs on every node of the scan-line system: a camera's part, a head's, a voter's, the base station's.

Any node may be the head, for all of a run or from one election to the next. Everybody changes to a new head
at the same frame. The old one hands over what it believes when its last frame is closed; a new head to which
nothing is handed over before it closes its first begins with an object that may be anywhere. A mote that has
missed the announcement goes on as before, until a head that gets its report tells it better.
"""

from wsnsim.messages.base import Payload
from wsnsim.messages.scanline import (
    EnergyPayload,
    HandoverPayload,
    HeadPayload,
    TrackPayload,
    step_of,
)
from wsnsim.systems.base import Context, Note, Received, Role, Send, Site, Step
from wsnsim.systems.scanline.camera import Eye
from wsnsim.systems.scanline.choices import ElectedHead
from wsnsim.systems.scanline.desk import DUE, Desk
from wsnsim.systems.scanline.election import ANNOUNCE, DECIDE, SPEAK, Candidate, Election
from wsnsim.systems.scanline.head import CLOSE, CameraPayload, Tracking, joined
from wsnsim.systems.scanline.offices import Office, address, announced, first_offices
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import NodeId, Seconds
from wsnsim.vision.frame import Frame

_TELL_AGAIN_S = 1.0
"""Who sends a report to the wrong head is told who is the right one, not more often than this."""


class NodeProgram:
    """Looks where there is a camera, tracks while it is the head, believes where it is the base station."""

    def __init__(self, params: ScanlineParams, site: Site, stage: Stage, node: NodeId, role: Role) -> None:
        self._params = params
        self._site = site
        self._stage = stage
        self._node = node
        self._is_base = role is Role.BASE
        self._number = site.motes.get(node, len(site.motes))
        self._offices = first_offices(params.head, site)
        self._eye = Eye(params, site, stage, node) if role is Role.CAMERA else None
        is_head = self._offices.now.head == self._number
        self._tracking = self._tracker(1, given=True) if is_head else None
        self._desk = Desk(params, site, stage) if self._is_base and not is_head else None
        self._candidate: Candidate | None = None
        self._election: Election | None = None
        if isinstance(params.head, ElectedHead):
            if self._is_base:
                self._election = Election(params.head, site, self._offices.now)
            else:
                self._candidate = Candidate(params.head, site, self._number)
        self._told_s: dict[NodeId, Seconds] = {}

    def on_start(self, ctx: Context) -> Step:
        """Begin whatever is the node's part."""
        result = Step()
        for part in (self._tracking, self._desk, self._candidate, self._election):
            if part is not None:
                result = joined(result, part.start())
        return result

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Say what is seen, to the head."""
        if self._eye is None:
            return Step()
        said = self._eye.look(frame)
        result = Step(work=said.work)
        head = self._offices.head_at(frame.step)
        if head == self._number:
            for payload in said.payloads:
                result = joined(result, self._track(ctx, self._node, payload))
            return result
        wanted = frame.step / self._site.rate_hz + self._params.deadline(self._site.rate_hz)
        to = address(head, self._site)
        return joined(result, Step(sends=tuple(Send(to, payload, wanted) for payload in said.payloads)))

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take a message."""
        source, payload = message.source, message.payload
        if isinstance(payload, CameraPayload):
            return self._take_report(ctx, source, payload)
        if isinstance(payload, TrackPayload):
            return self._take_track(ctx, source, payload)
        if isinstance(payload, EnergyPayload) and self._election is not None:
            self._election.take(source, payload)
        if isinstance(payload, HeadPayload):
            return self._change(ctx, announced(payload, self._step(ctx)))
        if isinstance(payload, HandoverPayload):
            return self._take_over(ctx, payload)
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Do what is due."""
        if key.startswith(CLOSE) and self._tracking is not None:
            return self._handed_over(self._tracking.on_timer(ctx, key))
        if key.startswith(DUE) and self._desk is not None:
            return self._desk.on_timer(ctx, key)
        if key.startswith(SPEAK) and self._candidate is not None:
            return self._candidate.on_timer(ctx, key)
        if key.startswith(ANNOUNCE) and self._election is not None:
            return self._election.announce(ctx, key)
        if key.startswith(DECIDE) and self._election is not None:
            decided = self._election.decide(ctx)
            return joined(decided, self._change(ctx, self._election.office))
        return Step()

    def _step(self, ctx: Context) -> int:
        """Return the number of the frame that is taken about now."""
        return round(ctx.now * self._site.rate_hz)

    def _tracker(self, first: int, given: bool) -> Tracking:
        tells = not self._is_base
        return Tracking(self._params, self._site, self._stage, self._node, tells, first, given)

    def _track(self, ctx: Context, source: NodeId, payload: Payload) -> Step:
        tracking = self._tracking
        return Step() if tracking is None else self._handed_over(tracking.take(ctx, source, payload))

    def _take_report(self, ctx: Context, source: NodeId, payload: CameraPayload) -> Step:
        """Track by a report, or tell its sender who does."""
        if self._offices.head_at(step_of(payload.step, self._step(ctx))) == self._number:
            return self._track(ctx, source, payload)
        if ctx.now < self._told_s.get(source, -_TELL_AGAIN_S) + _TELL_AGAIN_S:
            return Step()
        self._told_s[source] = ctx.now
        note = Note("report_astray", f"{source} takes this node for the head")
        return Step(sends=(Send(source, self._offices.now.payload()),), notes=(note,))

    def _take_track(self, ctx: Context, source: NodeId, payload: TrackPayload) -> Step:
        """Believe what a head says."""
        if self._desk is None:
            return Step()
        wanted, result = True, Step()
        if self._election is not None:
            wanted, result = self._election.heard(ctx, source, step_of(payload.step, self._step(ctx)))
        return joined(result, self._desk.take(ctx, source, payload)) if wanted else result

    def _change(self, ctx: Context, office: Office) -> Step:
        """Follow another head from its first frame on, or be it, or be it no longer."""
        if not office.later_than(self._offices.now):
            return Step()
        self._offices = self._offices.after(office)
        if office.head == self._number:
            return self._enter(ctx, office)
        result = Step()
        if self._is_base and self._desk is None:
            self._desk = Desk(self._params, self._site, self._stage, office.first)
            result = self._desk.start()
        if self._tracking is not None:
            self._tracking.end(office.first - 1)
            result = joined(result, self._handed_over(Step()))
        return result

    def _enter(self, ctx: Context, office: Office) -> Step:
        """Begin to track."""
        if self._tracking is not None:
            # it has not left yet, and stays
            self._tracking.end(self._site.steps)
            return Step()
        self._tracking = self._tracker(max(office.first, self._step(ctx) + 1), given=False)
        return self._tracking.start()

    def _handed_over(self, result: Step) -> Step:
        """Leave to the next head what is believed, when the last frame is closed."""
        if self._tracking is None or not self._tracking.done or self._offices.now.head == self._number:
            return result
        belief = self._tracking.belief
        self._tracking = None
        if belief is None:
            return result
        step, followed = belief
        if self._desk is not None:
            self._desk.know(step, followed)
        office = self._offices.now
        left = HandoverPayload(office.term, followed.place, followed.cov.ravel()[[0, 1, 3]])
        return joined(result, Step(sends=(Send(address(office.head, self._site), left),)))

    def _take_over(self, ctx: Context, payload: HandoverPayload) -> Step:
        """Go on from what the head before believed."""
        here = self._step(ctx) + 1
        entered = self._change(ctx, Office(payload.term, self._number, here))
        if payload.term != self._offices.now.term or self._tracking is None:
            return entered
        if not self._tracking.fresh:
            late = Note("handover_late", "the new head had begun without what the old one believed")
            return joined(entered, Step(notes=(late,)))
        self._tracking.begin(payload.place, payload.cov)
        note = Note("handed_over", f"the track is this node's, term {payload.term}")
        return joined(entered, Step(notes=(note,)))
