"""The best place in space for densities in several images (Kushwaha & Koutsoukos 2013, Sec. 5.4).

The posterior is the prediction times each camera's mixture at the projected place.
Gauss-Newton steps on its logarithm, each component weighed by its share there, climb
from the prediction and from every component's place; the highest top is taken. The
printed form is one linear step in homogeneous coordinates (Eq. 45), which depends on
the mixture for how far it goes: it is there by name.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.products import limited, without_normal
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.work import Work
from wsnsim.systems.multiview.image_proposal import ImagePrediction
from wsnsim.types import FloatArray

_WIDEST = 0.98
"""Largest variance of a camera's density, in those of the prediction: a wider one says nothing."""
_MOST_STEPS = 30
_SMALLEST_STEP_M = 1e-7
_HALVINGS = 8
_HOMOGENEOUS = 1e9
"""Fourth diagonal element of the printed form's prior: the fourth coordinate stays 1."""
_STEP_FLOATS = 250.0  # one start, camera and iteration: projection, derivative, shares, normal equations


@dataclass(frozen=True, eq=False)
class ImageDensity:
    """What one camera says, as a density of the pixel at which it sees the target's centre.

    Parameters
    ----------
    camera : as calibrated
    mixture : of pixels
    guides : (k, 3) a place in space for each component, where climbing may begin [m]
    """

    camera: PinholeCamera
    mixture: GaussianMixture
    guides: FloatArray

    @classmethod
    def of(
        cls,
        camera: PinholeCamera,
        prediction: ImagePrediction,
        whitened: GaussianMixture,
        prior: Literal["once", "every_camera"],
        place: Gaussian,
    ) -> "ImageDensity":
        """Take a message's mixture out of the coordinates of the prediction.

        Parameters
        ----------
        prediction : in the camera's image
        whitened : in coordinates in which that is N(0, I)
        prior : whether the prediction is divided out
        place : the prediction in space [m]
        """
        standard = Gaussian(np.zeros(2), np.eye(2))
        density = whitened
        if prior == "once":
            density = limited(whitened, Gaussian(standard.mean, _WIDEST * standard.cov))
            density = without_normal(density, standard)
        origin = prediction.mean - prediction.offset
        root = np.asarray(np.linalg.cholesky(prediction.cov), dtype=np.float64)
        gain = np.linalg.solve(
            prediction.jacobian @ place.cov @ prediction.jacobian.T, prediction.jacobian @ place.cov
        )
        guides = place.mean + (whitened.means @ root.T) @ gain
        return cls(camera, density.moved(root, origin), guides)


@dataclass(frozen=True, eq=False)
class Found:
    """The best place (3,) [m], a covariance (3, 3) [m²] about it, and what it cost to find."""

    place: FloatArray
    cov: FloatArray
    work: Work


def best_place(
    prior: Gaussian,
    densities: Sequence[ImageDensity],
    solver: Literal["gauss_newton", "printed"] = "gauss_newton",
) -> Found:
    """Return the place that prediction and densities together make likeliest.

    Parameters
    ----------
    prior : N(mean (3,), cov (3, 3)) [m]
    densities : of cameras that see the prior's mean
    """
    starts = np.concatenate([prior.mean[None], *(density.guides for density in densities)])
    work = Work(float_ops=_STEP_FLOATS * len(starts) * len(densities) * 0.5 * _MOST_STEPS)
    if solver == "printed":
        place, work = _printed_step(prior, densities), Work(float_ops=_STEP_FLOATS * len(densities))
    else:
        place = _climbed(prior, densities, starts)
    return Found(place, _cov_about(place, prior, densities), work)


def _climbed(prior: Gaussian, densities: Sequence[ImageDensity], starts: FloatArray) -> FloatArray:
    """Return the highest of the tops (3,) that are reached from `starts` (n, 3)."""
    information = np.asarray(np.linalg.inv(prior.cov), dtype=np.float64)
    heights = _log_posterior(starts, prior.mean, information, densities)
    places = starts[np.isfinite(heights)]
    heights = heights[np.isfinite(heights)]
    for _ in range(_MOST_STEPS):
        steps = _gauss_newton_steps(places, prior.mean, information, densities)
        share = np.ones(len(places))
        moved = places
        climbed = heights
        for _ in range(_HALVINGS):
            tried = places + share[:, None] * steps
            reached = _log_posterior(tried, prior.mean, information, densities)
            better = reached >= climbed
            moved = np.where(better[:, None], tried, moved)
            climbed = np.where(better, reached, climbed)
            if better.all():
                break
            share = np.where(better, 0.0, 0.5 * share)
        change = float(np.abs(moved - places).max())
        places, heights = moved, climbed
        if change < _SMALLEST_STEP_M:
            break
    return np.asarray(places[int(np.argmax(heights))], dtype=np.float64)


def _log_posterior(
    places: FloatArray, mean: FloatArray, information: FloatArray, densities: Sequence[ImageDensity]
) -> FloatArray:
    """Return the logarithm (n,) of the posterior up to a constant; -inf behind a camera."""
    apart = places - mean
    logs = -0.5 * np.einsum("ni,ij,nj->n", apart, information, apart)
    for density in densities:
        pixels, _ = density.camera.project(places)
        seen = np.isfinite(pixels).all(axis=1)
        logs[seen] += density.mixture.log_density(pixels[seen])
        logs[~seen] = -np.inf
    return np.asarray(logs, dtype=np.float64)


def _gauss_newton_steps(
    places: FloatArray, mean: FloatArray, information: FloatArray, densities: Sequence[ImageDensity]
) -> FloatArray:
    """Return the steps (n, 3) to the maximum, were the shares of the components to stay."""
    normal = np.broadcast_to(information, (len(places), 3, 3)).copy()
    slope = (places - mean) @ information
    for density in densities:
        mixture = density.mixture
        pixels, _ = density.camera.project(places)
        jacobians = density.camera.jacobians(places)
        shares = _shares(mixture, pixels)
        precisions = np.linalg.inv(mixture.covs)
        pulls = np.einsum("kij,nkj->nki", precisions, pixels[:, None] - mixture.means)
        precision = np.einsum("nk,kij->nij", shares, precisions)
        pull = np.einsum("nk,nki->ni", shares, pulls)
        normal += np.einsum("nia,nij,njb->nab", jacobians, precision, jacobians)
        slope += np.einsum("nia,ni->na", jacobians, pull)
    return np.asarray(-np.linalg.solve(normal, slope[..., None])[..., 0], dtype=np.float64)


def _shares(mixture: GaussianMixture, pixels: FloatArray) -> FloatArray:
    """Return the shares (n, k) of the components in the density at pixels (n, 2)."""
    terms = mixture.log_terms(pixels)
    return np.asarray(np.exp(terms - np.logaddexp.reduce(terms, axis=1)[:, None]), dtype=np.float64)


def _cov_about(place: FloatArray, prior: Gaussian, densities: Sequence[ImageDensity]) -> FloatArray:
    """Return the covariance at a place, each camera's mixture as the Gaussian of its moments there."""
    information = np.linalg.inv(prior.cov)
    for density in densities:
        mixture = density.mixture
        pixels, _ = density.camera.project(place[None])
        jacobian = density.camera.jacobians(place[None])[0]
        if not np.isfinite(jacobian).all():
            continue
        shares = _shares(mixture, pixels)[0]
        apart = mixture.means - shares @ mixture.means
        spread = np.einsum("k,kij->ij", shares, mixture.covs) + (shares[:, None] * apart).T @ apart
        information = information + jacobian.T @ np.linalg.solve(spread, jacobian)
    return np.asarray(np.linalg.inv(information), dtype=np.float64)


def _printed_step(prior: Gaussian, densities: Sequence[ImageDensity]) -> FloatArray:
    """Return one step of Eq. 45 from the prior's mean, in homogeneous coordinates."""
    information = np.zeros((4, 4))
    information[:3, :3] = np.linalg.inv(prior.cov)
    information[3, 3] = _HOMOGENEOUS
    x = np.append(prior.mean, 1.0)
    total = information.copy()
    for density in densities:
        mixture, matrix = density.mixture, density.camera.matrix
        depth = float(matrix[2] @ x)
        shares = _shares(mixture, (matrix[:2] @ x / depth)[None])[0]
        kept = np.eye(4) - np.outer(x, matrix[2]) / depth
        for share, centre, cov in zip(shares, mixture.means, mixture.covs, strict=True):
            q = (matrix[:2] - np.outer(centre, matrix[2])) / depth
            total += share * q.T @ np.linalg.solve(cov, q) @ kept
    solution = np.linalg.solve(total.T, information @ x)
    return np.asarray(solution[:3] / solution[3], dtype=np.float64)
