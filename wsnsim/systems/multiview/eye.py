"""What every tracker's camera can do with a frame: weigh particles, and say from where it sees the target."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wsnsim.estimation.particles import normalised
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.hardware.work import Work
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.image_proposal import ImageProposal
from wsnsim.systems.multiview.judgement import Judgement, judge
from wsnsim.systems.multiview.orientation import facing
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.rules import InitialOrientation
from wsnsim.systems.multiview.sight import Sight, facing_viewpoint, look, look_at_outlines
from wsnsim.systems.multiview.similarity import view_similarities
from wsnsim.types import FloatArray, NodeId
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.frame import Frame

_TINY = float(np.finfo(np.float64).tiny)


def camera_numbers(site: Site) -> Mapping[NodeId, int]:
    """Return the number by which messages name each camera: its place in the site's list."""
    return {node: number for number, node in enumerate(site.cameras)}


@dataclass(frozen=True, eq=False)
class Eye:
    """A camera mote's camera, and what the mote knows.

    Parameters
    ----------
    node : the mote
    models : the reference model of each target of the site
    """

    params: MultiviewParams
    site: Site
    node: NodeId
    models: tuple[ReferenceModel, ...]

    @property
    def camera(self) -> PinholeCamera:
        """The camera, as calibrated."""
        return self.site.cameras[self.node]

    @cached_property
    def number(self) -> int:
        """By which messages name the camera."""
        return camera_numbers(self.site)[self.node]

    @cached_property
    def features(self) -> FeatureSpace:
        """Bins of colour and texture."""
        return FeatureSpace(self.params.colour_space)

    def semi_axes(self, target: int) -> FloatArray:
        """Return the semi-axes (3,) of a target [m]."""
        return self.site.targets[target].semi_axes_m

    def weigh(self, frame: Frame, state: StatePayload, proposal: Proposal) -> Judgement:
        """Weigh the particles in space (Kushwaha & Koutsoukos 2013, Eqs. 11-17)."""
        semi_axes = self.semi_axes(state.target)
        sight = look(
            frame.image, self.camera, proposal.particles, state.orientation, semi_axes, self.features
        )
        return self._judged(sight, state, proposal)

    def weigh_in_image(
        self, frame: Frame, state: StatePayload, proposal: Proposal, cloud: ImageProposal
    ) -> Judgement:
        """Weigh particles in the image, all of the predicted size and shape (Eqs. 36-40)."""
        sight = look_at_outlines(frame.image, self.camera, cloud.outlines, self.features)
        return self._judged(sight, state, proposal)

    def _judged(self, sight: Sight, state: StatePayload, proposal: Proposal) -> Judgement:
        model = self.models[state.target]
        view = facing_viewpoint(model, self.camera, proposal.mean, state.orientation)
        judgement = judge(sight, model.sqrt_colour[view], model.sqrt_texture[view], self.params)
        return replace(judgement, work=sight.work + judgement.work)

    def facing(self, frame: Frame, state: StatePayload, place: FloatArray) -> tuple[FloatArray, Work]:
        """Return what the camera says of the orientation, from its own idea (3,) of where the target is."""
        rule = self.params.orientation
        if isinstance(rule, InitialOrientation):
            return np.empty(0), Work()
        model, features = self.models[state.target], self.features
        semi_axes = self.semi_axes(state.target)
        sight = look(frame.image, self.camera, place[None], state.orientation, semi_axes, features)
        rho, cost = view_similarities(sight, model, features, self.params.colour_share)
        if not rho.any():
            return np.empty(0), sight.work + cost
        towards = self.camera.position - place
        expected = quaternion_to_matrix(state.orientation).T @ (towards / np.linalg.norm(towards))
        return facing(rho, model.directions, self.camera, expected, rule), sight.work + cost


def shares(weights: FloatArray) -> FloatArray:
    """Return weights (m,) as shares that sum to one, none of them so small that it vanishes."""
    return normalised(np.log(np.maximum(weights, _TINY)))
