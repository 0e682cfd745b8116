"""What runs on every node of the scan-line system: a camera's part, a head's part, or both."""

from wsnsim.systems.base import Context, Received, Role, Scope, Send, Site, Step
from wsnsim.systems.scanline.camera import Eye
from wsnsim.systems.scanline.choices import NodeHead
from wsnsim.systems.scanline.head import Tracking, joined
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import NodeId
from wsnsim.vision.frame import Frame


class NodeProgram:
    """Looks where there is a camera, tracks where it is the head."""

    def __init__(self, params: ScanlineParams, site: Site, stage: Stage, node: NodeId, role: Role) -> None:
        self._params = params
        self._site = site
        self._node = node
        self._eye = Eye(params, site, stage, node) if role is Role.CAMERA else None
        head = params.head
        is_head = node == head.id if isinstance(head, NodeHead) else role is Role.BASE
        self._head: NodeId | Scope = head.id if isinstance(head, NodeHead) else Scope.BASE
        self._tracking = Tracking(params, site, stage, node) if is_head else None

    def on_start(self, ctx: Context) -> Step:
        """Begin to track, where it is the head."""
        return Step() if self._tracking is None else self._tracking.start()

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Say what is seen, to the head."""
        if self._eye is None:
            return Step()
        said = self._eye.look(frame)
        if self._tracking is not None:
            result = Step(work=said.work)
            for payload in said.payloads:
                result = joined(result, self._tracking.take(ctx, self._node, payload))
            return result
        wanted = frame.step / self._site.rate_hz + self._params.deadline(self._site.rate_hz)
        return Step(
            sends=tuple(Send(self._head, payload, wanted) for payload in said.payloads), work=said.work
        )

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take what a camera says."""
        return Step() if self._tracking is None else self._tracking.take(ctx, message.source, message.payload)

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Close a frame."""
        return Step() if self._tracking is None else self._tracking.on_timer(ctx, key)
