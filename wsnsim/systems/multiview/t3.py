"""T3: particles in each camera's image, lifted into space; then as T2 (Sec. 5.3).

Every camera draws its own particles in its image about the predicted outline, all of
the predicted size and shape (Kushwaha & Koutsoukos 2013, Algorithm 2). Each particle
becomes a point in space, as far along its ray as the prediction says; the mixture of
those is fused on its way as T2's.
"""

from collections.abc import Sequence

from wsnsim.hardware.work import Work
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview import t1
from wsnsim.systems.multiview.eye import Eye
from wsnsim.systems.multiview.image_proposal import image_spacing_variance
from wsnsim.systems.multiview.image_view import view_in_image
from wsnsim.systems.multiview.mixing import at_base
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.variants import Posterior, Question, Report, Variant
from wsnsim.systems.multiview.whitening import Whitening
from wsnsim.vision.frame import Frame


class T3Camera:
    """Weighs particles in the image and sends a mixture in space."""

    def __init__(self, eye: Eye) -> None:
        self._eye = eye

    def answer(
        self, frame: Frame, state: StatePayload, proposal: Proposal
    ) -> tuple[MixturePayload | None, Work]:
        """Return the mixture of the lifted particles."""
        view = view_in_image(self._eye, frame, state, proposal)
        if view is None:
            return None, Work()
        points = Whitening.of(proposal.mean, proposal.cov).whitened(view.places)
        payload, fitting = t1.mixture_message(self._eye, state, points, view.judgement, view.facing)
        return payload, view.work + fitting


def posterior(
    params: MultiviewParams, site: Site, question: Question, reports: Sequence[Report]
) -> Posterior:
    """Multiply the mixtures that came, as T1 does."""
    state, proposal = question.state, question.proposal
    rng = site.streams.stream("fusion", state.target, state.step)
    return at_base(reports, params, proposal, image_spacing_variance(proposal, params), rng)


VARIANT = Variant(MixturePayload, T3Camera, posterior, dimension=3, fused_on_the_way=True)
