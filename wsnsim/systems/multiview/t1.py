"""T1: every camera makes a Gaussian mixture of its weighted particles and sends that (Sec. 5.1).

A kernel density of the particles in space, approximated by the smallest mixture that
fits it (Kushwaha & Koutsoukos 2013, Eqs. 27 and 28); the base station multiplies the
cameras' mixtures. What a camera sends contains the prediction its particles were drawn
from; of the product all but one of them are divided out.
"""

from collections.abc import Sequence

from wsnsim.estimation.particles import spacing_variance
from wsnsim.hardware.work import Work
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.eye import Eye, shares
from wsnsim.systems.multiview.judgement import Judgement
from wsnsim.systems.multiview.mixing import at_base, fitted
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.variants import Posterior, Question, Report, Variant
from wsnsim.systems.multiview.whitening import Whitening
from wsnsim.types import FloatArray
from wsnsim.vision.frame import Frame


class T1Camera:
    """Weighs the particles in space and sends a mixture of them."""

    def __init__(self, eye: Eye) -> None:
        self._eye = eye

    def answer(self, frame: Frame, state: StatePayload, proposal: Proposal) -> tuple[MixturePayload, Work]:
        """Return the mixture of the step's weighted particles."""
        judgement = self._eye.weigh(frame, state, proposal)
        place = shares(judgement.weights) @ proposal.particles
        said, cost = self._eye.facing(frame, state, place)
        frame_of = Whitening.of(proposal.mean, proposal.cov)
        points = frame_of.whitened(proposal.particles)
        payload, fitting = mixture_message(self._eye, state, points, judgement, said)
        return payload, judgement.work + cost + fitting


def mixture_message(
    eye: Eye,
    state: StatePayload,
    points: FloatArray,
    judgement: Judgement,
    facing: FloatArray,
) -> tuple[MixturePayload, Work]:
    """Return what one camera sends of its weighted particles.

    Parameters
    ----------
    points : (m, d) in coordinates in which the prediction is N(0, I)
    facing : what the camera says of the orientation
    """
    mixture, work = fitted(eye, state, points, judgement, facing.size)
    payload = MixturePayload(
        state.target, state.step, mixture, (eye.number,), judgement.similarity, (facing,), eye.params.encoding
    )
    return payload, work


def posterior(
    params: MultiviewParams, site: Site, question: Question, reports: Sequence[Report]
) -> Posterior:
    """Multiply the mixtures that came, and take mean or mode (Eqs. 29 and 30)."""
    state = question.state
    rng = site.streams.stream("fusion", state.target, state.step)
    unresolved = spacing_variance(question.proposal.cov, params.particles)
    return at_base(reports, params, question.proposal, unresolved, rng)


VARIANT = Variant(MixturePayload, T1Camera, posterior, dimension=3)
