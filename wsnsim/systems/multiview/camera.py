"""What runs on a camera mote, whatever the tracker: frames and states in, answers out.

Kushwaha & Koutsoukos 2013, Algorithms 1 and 2, the camera's part. A frame is worked on
as soon as the state of its step is here; what is said of several targets at once goes
into one message. A target that is sought is looked for in the whole image.
"""

from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.messages.batch import batched, parts_of
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import (
    Context,
    GroupKey,
    Note,
    Received,
    Scope,
    Send,
    Site,
    Step,
)
from wsnsim.systems.multiview.eye import Eye
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import DRAW_FLOATS, propose, takes_part
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.search import find
from wsnsim.systems.multiview.thrift import fitted
from wsnsim.systems.multiview.variants import variant
from wsnsim.types import NodeId, Seconds
from wsnsim.vision.frame import Frame


class CameraProgram:
    """What runs on a camera mote.

    A camera without the state of its frame's step stays silent and says so.

    Parameters
    ----------
    models : the reference model of each target of the site
    """

    def __init__(
        self, params: MultiviewParams, site: Site, node: NodeId, models: tuple[ReferenceModel, ...]
    ) -> None:
        self._params = params
        self._site = site
        self._eye = Eye(params, site, node, models)
        self._variant = variant(params.variant)
        self._part = self._variant.camera(self._eye)
        self._frame: Frame | None = None
        self._unanswered: set[int] = set()
        self._states: dict[int, StatePayload] = {}
        self._sought: dict[int, int] = {}

    def on_start(self, ctx: Context) -> Step:
        """Wait for a state and a frame."""
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Do nothing: a camera sets no timers."""
        return Step()

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Take a frame; work on it as soon as the state of its step is here, or look for what is sought."""
        unused = tuple(
            Note(
                "frame_unused",
                f"frame {self._frame.step}: no state of {self._site.targets[target].id} for it",
            )
            for target in sorted(self._unanswered - self._sought.keys())
            if self._frame is not None
        )
        self._frame = frame
        self._unanswered = set(range(len(self._site.targets)))
        return self._answer(ctx, unused)

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take what the base station says of targets, and work on the frame that waits for it."""
        for payload in parts_of(message.payload):
            if isinstance(payload, StatePayload) and payload.target < len(self._site.targets):
                self._states[payload.target] = payload
                self._sought.pop(payload.target, None)
            elif isinstance(payload, SearchPayload) and payload.target < len(self._site.targets):
                self._sought[payload.target] = payload.step
        return self._answer(ctx)

    def _answer(self, ctx: Context, notes: tuple[Note, ...] = ()) -> Step:
        said: list[Payload] = []
        sightings: list[Payload] = []
        work = Work()
        frame = self._frame
        if frame is None:
            return Step(notes=notes)
        for target in sorted(self._unanswered):
            state = self._states.get(target)
            if frame.step >= self._sought.get(target, frame.step + 1):
                sighting, cost = self._search(frame, target)
                sightings += [] if sighting is None else [sighting]
            elif state is not None and state.step == frame.step:
                payload, cost = self._look(frame, state)
                said += [] if payload is None else [payload]
            else:
                continue
            self._unanswered.discard(target)
            work += cost
        params, rate_hz = self._params, self._site.rate_hz
        sends = []
        if said:
            said, cost = fitted(said, ctx.allowance_bytes)
            work += cost
            if not said:
                silent = f"frame {frame.step}: no form of the answer fits {ctx.allowance_bytes:g} bytes"
                notes = (*notes, Note("budget_silent", silent))
        if said:
            group = GroupKey(frame.step) if self._variant.fused_on_the_way else None
            sends.append(self._to_base(said, frame.step, params.deadline(rate_hz), group))
        if sightings:
            sends.append(self._to_base(sightings, frame.step, params.searching.after_s))
        return Step(sends=tuple(sends), work=work, notes=notes)

    def _look(self, frame: Frame, state: StatePayload) -> tuple[Payload | None, Work]:
        """Answer what the base station asks of one target, if it asks this camera."""
        proposal = propose(state, self._params, self._site)
        work = Work(float_ops=self._params.particles * DRAW_FLOATS)
        if not takes_part(self._eye.camera, proposal, state, self._params, self._site):
            return None, work
        payload, cost = self._part.answer(frame, state, proposal)
        return payload, work + cost

    def _search(self, frame: Frame, target: int) -> tuple[Payload | None, Work]:
        """Look for a target in the whole image, and tell where it is if it is there."""
        eye, params = self._eye, self._params
        found, work = find(
            frame.image, eye.camera, self._site.targets[target], eye.models[target], eye.features, params
        )
        if found is None or found.similarity < params.searching.sighting_min:
            return None, work
        sighting = SightingPayload(
            target, frame.step, found.pixel, found.distance_m, found.similarity, params.encoding
        )
        return sighting, work

    def _to_base(
        self, payloads: list[Payload], step: int, wanted_s: Seconds, group: GroupKey | None = None
    ) -> Send:
        return Send(Scope.BASE, batched(payloads), step / self._site.rate_hz + wanted_s, group)
