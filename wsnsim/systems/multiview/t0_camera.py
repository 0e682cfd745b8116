"""Tracker T0 on a camera mote: draw, compare, send (Kushwaha & Koutsoukos 2013, Algorithm 1, lines 2–10)."""

import numpy as np

from wsnsim.estimation.particles import normalised
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.hardware.work import Work
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import Context, Note, Received, Scope, Send, Site, Step
from wsnsim.systems.multiview.judgement import judge
from wsnsim.systems.multiview.orientation import facing
from wsnsim.systems.multiview.params import InitialOrientation, MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal, propose, takes_part
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.search import find
from wsnsim.systems.multiview.sight import look
from wsnsim.systems.multiview.similarity import view_similarities
from wsnsim.types import FloatArray, NodeId, Seconds
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.frame import Frame

DRAW_FLOATS = 60.0
"""One particle: three normal draws, projection, test against the image's border."""


class T0Camera:
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
        self._camera = site.cameras[node]
        self._models = models
        self._features = FeatureSpace(params.colour_space)
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
        return self._answer(unused)

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take what the base station says of a target, and work on the frame that waits for it."""
        payload = message.payload
        if isinstance(payload, StatePayload) and payload.target < len(self._site.targets):
            self._states[payload.target] = payload
            self._sought.pop(payload.target, None)
        elif isinstance(payload, SearchPayload) and payload.target < len(self._site.targets):
            self._sought[payload.target] = payload.step
        return self._answer()

    def _answer(self, notes: tuple[Note, ...] = ()) -> Step:
        sends: list[Send] = []
        work = Work()
        frame = self._frame
        if frame is not None:
            for target in sorted(self._unanswered):
                state = self._states.get(target)
                if frame.step >= self._sought.get(target, frame.step + 1):
                    sent, cost = self._search(frame, target)
                elif state is not None and state.step == frame.step:
                    sent, cost = self._weigh(frame, state)
                else:
                    continue
                self._unanswered.discard(target)
                sends += sent
                work += cost
        return Step(sends=tuple(sends), work=work, notes=notes)

    def _weigh(self, frame: Frame, state: StatePayload) -> tuple[list[Send], Work]:
        """Give every particle a weight, and say from where the target is seen."""
        params = self._params
        proposal = propose(state, params, self._site)
        work = Work(float_ops=params.particles * DRAW_FLOATS)
        if not takes_part(self._camera, proposal, state, params, self._site):
            return [], work
        semi_axes = self._site.targets[state.target].semi_axes_m
        model = self._models[state.target]
        sight = look(
            frame.image, self._camera, proposal.particles, state.orientation, semi_axes, self._features
        )
        judgement = judge(sight, self._camera, proposal, state.orientation, model, params)
        said, cost = self._facing(frame, state, proposal, judgement.weights)
        payload = WeightsPayload(
            state.target, state.step, judgement.weights, judgement.similarity, said, params.encoding
        )
        wanted_s = params.deadline(self._site.rate_hz)
        return [self._to_base(payload, state.step, wanted_s)], work + sight.work + judgement.work + cost

    def _facing(
        self, frame: Frame, state: StatePayload, proposal: Proposal, weights: FloatArray
    ) -> tuple[FloatArray, Work]:
        """Return what the camera sends of the orientation, from its own idea of where the target is."""
        rule = self._params.orientation
        if isinstance(rule, InitialOrientation):
            return np.empty(0), Work()
        place = normalised(np.log(np.maximum(weights, np.finfo(np.float64).tiny))) @ proposal.particles
        semi_axes = self._site.targets[state.target].semi_axes_m
        model = self._models[state.target]
        sight = look(frame.image, self._camera, place[None], state.orientation, semi_axes, self._features)
        rho, cost = view_similarities(sight, model, self._features, self._params.colour_share)
        if not rho.any():
            return np.empty(0), sight.work + cost
        towards = self._camera.position - place
        expected = quaternion_to_matrix(state.orientation).T @ (towards / np.linalg.norm(towards))
        return facing(rho, model.directions, self._camera, expected, rule), sight.work + cost

    def _search(self, frame: Frame, target: int) -> tuple[list[Send], Work]:
        """Look for a target in the whole image, and tell where it is if it is there."""
        site_target = self._site.targets[target]
        found, work = find(
            frame.image, self._camera, site_target, self._models[target], self._features, self._params
        )
        if found is None or found.similarity < self._params.searching.sighting_min:
            return [], work
        sighting = SightingPayload(
            target, frame.step, found.pixel, found.distance_m, found.similarity, self._params.encoding
        )
        return [self._to_base(sighting, frame.step, self._params.searching.after_s)], work

    def _to_base(self, payload: WeightsPayload | SightingPayload, step: int, wanted_s: Seconds) -> Send:
        return Send(Scope.BASE, payload, step / self._site.rate_hz + wanted_s)
