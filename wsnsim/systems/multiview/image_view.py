"""What the cameras of T3 and T4 share: particles in the image, weighed, and a word on the orientation."""

from dataclasses import dataclass

from wsnsim.hardware.work import Work
from wsnsim.messages.state import StatePayload
from wsnsim.systems.multiview.eye import Eye, shares
from wsnsim.systems.multiview.image_proposal import ImageProposal, image_prediction, propose_in_image
from wsnsim.systems.multiview.judgement import Judgement
from wsnsim.systems.multiview.lifting import lifted
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.types import FloatArray
from wsnsim.vision.frame import Frame


@dataclass(frozen=True, eq=False)
class ImageView:
    """A camera's particles at a step.

    Parameters
    ----------
    cloud, judgement : the particles and their weights
    places : (m, 3) the particles lifted into space [m]
    facing : what the camera says of the orientation
    work : what all of it cost
    """

    cloud: ImageProposal
    judgement: Judgement
    places: FloatArray
    facing: FloatArray
    work: Work


def view_in_image(eye: Eye, frame: Frame, state: StatePayload, proposal: Proposal) -> ImageView | None:
    """Weigh particles in the image; None where the predicted outline is no ellipse there."""
    prediction = image_prediction(eye.camera, proposal, state, eye.params, eye.site)
    if prediction is None:
        return None
    cloud = propose_in_image(prediction, eye.number, state, eye.params, eye.site)
    judgement = eye.weigh_in_image(frame, state, proposal, cloud)
    places, cost = lifted(cloud, eye.camera, proposal)
    said, facing_cost = eye.facing(frame, state, shares(judgement.weights) @ places)
    return ImageView(cloud, judgement, places, said, judgement.work + cost + facing_cost)
