"""T4: a Gaussian mixture in each image, and the best place for all of them at the base station (Sec. 5.4).

Particles in the image as T3's, but what a camera sends is a density in its own image,
five numbers a component instead of nine. The base station looks for the place in space
that explains all of them (`map_estimate`). Nothing is fused on the way: densities in
different images have no product.
"""

from collections.abc import Sequence

from wsnsim.estimation.kalman import Gaussian
from wsnsim.hardware.work import Work
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview import t1
from wsnsim.systems.multiview.eye import Eye
from wsnsim.systems.multiview.image_proposal import image_prediction, image_spacing_variance
from wsnsim.systems.multiview.image_view import view_in_image
from wsnsim.systems.multiview.map_estimate import ImageDensity, best_place
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.variants import Posterior, Question, Report, Variant
from wsnsim.systems.multiview.whitening import Whitening
from wsnsim.vision.frame import Frame


class T4Camera:
    """Weighs particles in the image and sends a mixture in the image."""

    def __init__(self, eye: Eye) -> None:
        self._eye = eye

    def answer(
        self, frame: Frame, state: StatePayload, proposal: Proposal
    ) -> tuple[MixturePayload | None, Work]:
        """Return the mixture of the image's particles."""
        view = view_in_image(self._eye, frame, state, proposal)
        if view is None:
            return None, Work()
        points = Whitening(view.cloud.prediction.mean, view.cloud.root).whitened(view.cloud.particles)
        payload, fitting = t1.mixture_message(self._eye, state, points, view.judgement, view.facing)
        return payload, view.work + fitting


def posterior(
    params: MultiviewParams, site: Site, question: Question, reports: Sequence[Report]
) -> Posterior:
    """Find the best place for the densities that came (Eqs. 41 to 45)."""
    proposal = question.proposal
    prior = Gaussian(proposal.mean, proposal.cov)
    densities = []
    for report in reports:
        assert isinstance(report.said, MixturePayload)
        (node,) = report.cameras
        camera = site.cameras[node]
        prediction = image_prediction(camera, proposal, question.state, params, site)
        if prediction is not None:
            densities.append(
                ImageDensity.of(camera, prediction, report.said.mixture, params.mixtures.prior, prior)
            )
    found = best_place(prior, densities, params.map_solver)
    return Posterior(
        position=found.place,
        mean=found.place,
        cov=found.cov,
        prior=prior,
        unresolved=image_spacing_variance(proposal, params),
        work=found.work,
    )


VARIANT = Variant(MixturePayload, T4Camera, posterior, dimension=2)
