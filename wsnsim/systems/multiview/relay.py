"""What runs on nodes that fuse messages on their way (T2, T3): relays, and cameras that relay.

A relay hears the states that go down to the cameras, and so knows which of those below
it have been asked: when all of them have been heard of, it need not wait any longer.
"""

from collections.abc import Sequence
from zlib import crc32

from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.messages.batch import batched, parts_of
from wsnsim.messages.mixture import MixturePayload, mixture_bytes
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Aggregate, Context, GroupKey, Received, Site, Step
from wsnsim.systems.multiview.camera import CameraProgram
from wsnsim.systems.multiview.eye import camera_numbers
from wsnsim.systems.multiview.joining import join
from wsnsim.systems.multiview.mixing import joining_work, largest_order, plausible
from wsnsim.systems.multiview.orientation import facing_numbers
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import VIEW_FLOATS, propose, takes_part
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.thrift import fitted
from wsnsim.systems.multiview.variants import variant
from wsnsim.types import NodeId, Seconds
from wsnsim.vision.frame import Frame

_USUAL_CAMERAS = 3


class RelayProgram:
    """Fuses the mixtures of a step."""

    def __init__(self, params: MultiviewParams, site: Site, node: NodeId) -> None:
        self._params = params
        self._site = site
        self._number = crc32(node.encode())
        self._numbers = camera_numbers(site)
        self._dimension = variant(params.variant).dimension
        self._states: dict[int, StatePayload] = {}
        self._asked: tuple[int, frozenset[tuple[int, int]]] | None = None
        self._telling = Work()

    def on_start(self, ctx: Context) -> Step:
        """Wait for what passes."""
        return Step()

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Do nothing: a relay has no camera."""
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Do nothing: a relay sets no timers."""
        return Step()

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Note which cameras are asked at a step."""
        for payload in parts_of(message.payload):
            if isinstance(payload, StatePayload) and payload.target < len(self._site.targets):
                self._states[payload.target] = payload
                self._asked = None
        return Step()

    def due(self, group: GroupKey) -> Seconds:
        """Return by when the base station wants the messages of a step."""
        return group.epoch / self._site.rate_hz + self._params.deadline(self._site.rate_hz)

    def usual(self) -> tuple[int, Work]:
        """Return the size [bytes] of a message of some cameras and the work of fusing two."""
        params = self._params
        facing = facing_numbers(params.orientation)
        cameras = tuple(self._numbers.values())[-_USUAL_CAMERAS:]
        order = largest_order(params, self._dimension, cameras, facing)
        size = mixture_bytes(order, self._dimension, cameras, facing, params.encoding)
        return size, joining_work(order, order)

    def awaits(self, group: GroupKey, parts: Sequence[Received], below: frozenset[NodeId]) -> bool:
        """Tell whether a camera below was asked and has not been heard of.

        Without the states of the step nobody knows who was asked: then the timeout decides.
        """
        asked = self._asked_at(group.epoch, below)
        if asked is None:
            return len(below) > 1
        heard = {(payload.target, camera) for payload in _mixtures(parts) for camera in payload.cameras}
        return not asked <= heard

    def aggregate(self, ctx: Context, group: GroupKey, parts: Sequence[Received]) -> Aggregate:
        """Make one message of what came of each target."""
        by_target: dict[int, list[MixturePayload]] = {}
        for payload in _mixtures(parts):
            if payload.step == group.epoch and self._sound(payload):
                by_target.setdefault(payload.target, []).append(payload)
        if not by_target:
            return Aggregate(None)
        said: list[Payload] = []
        work = Work()
        for target in sorted(by_target):
            payload, cost = join(by_target[target], self._params, self._site, self._number)
            said.append(payload)
            work += cost
        said, cost = fitted(said, ctx.allowance_bytes)
        work, self._telling = work + cost + self._telling, Work()
        return Aggregate(batched(said) if said else None, work)

    def _sound(self, payload: MixturePayload) -> bool:
        """Tell whether a mixture can be one of this tracker's: a broken one must not spoil the others."""
        numbers = facing_numbers(self._params.orientation)
        return (
            payload.target < len(self._site.targets)
            and payload.cameras[-1] < len(self._site.cameras)
            and payload.mixture.dimension == self._dimension
            and plausible(payload.mixture)
            and all(facing.size in (0, numbers) for facing in payload.facings)
        )

    def _asked_at(self, step: int, below: frozenset[NodeId]) -> frozenset[tuple[int, int]] | None:
        """Return target and camera of each question to those below; None where no state was heard."""
        if self._asked is None or self._asked[0] != step:
            states = [state for state in self._states.values() if state.step == step]
            if not states:
                return None
            cameras = {node: camera for node, camera in self._site.cameras.items() if node in below}
            asked: set[tuple[int, int]] = set()
            for state in states:
                proposal = propose(state, self._params, self._site)
                asked.update(
                    (state.target, self._numbers[node])
                    for node, camera in cameras.items()
                    if takes_part(camera, proposal, state, self._params, self._site)
                )
            views = float(self._params.particles * len(cameras) * len(states))
            self._telling = Work(float_ops=VIEW_FLOATS * views)
            self._asked = (step, frozenset(asked))
        return self._asked[1]


def _mixtures(parts: Sequence[Received]) -> list[MixturePayload]:
    """Return the mixtures in messages, those in batches too."""
    return [
        payload for part in parts for payload in parts_of(part.payload) if isinstance(payload, MixturePayload)
    ]


class RelayingCamera(CameraProgram):
    """A camera mote that fuses what passes it with what it says itself."""

    def __init__(
        self, params: MultiviewParams, site: Site, node: NodeId, models: tuple[ReferenceModel, ...]
    ) -> None:
        super().__init__(params, site, node, models)
        self._relay = RelayProgram(params, site, node)

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take a state, as a camera and as a relay."""
        self._relay.on_payload(ctx, message)
        return super().on_payload(ctx, message)

    def due(self, group: GroupKey) -> Seconds:
        """Return by when the base station wants the messages of a step."""
        return self._relay.due(group)

    def usual(self) -> tuple[int, Work]:
        """Return the size [bytes] of a message of some cameras and the work of fusing two."""
        return self._relay.usual()

    def awaits(self, group: GroupKey, parts: Sequence[Received], below: frozenset[NodeId]) -> bool:
        """Tell whether a camera below was asked and has not been heard of."""
        return self._relay.awaits(group, parts, below)

    def aggregate(self, ctx: Context, group: GroupKey, parts: Sequence[Received]) -> Aggregate:
        """Make one message of what came of each target."""
        return self._relay.aggregate(ctx, group, parts)
