"""Finding a target without a prediction: in one camera's image, then in space.

Each camera looks at its whole image with outlines of several sizes, first by the
target's mean appearance, then, where that fits best, from each viewpoint and with
finer places. Sightings of several cameras make a place where their rays meet. Not in
Kushwaha & Koutsoukos 2013, whose targets are initialised by hand.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.work import Work
from wsnsim.messages.search import SightingPayload
from wsnsim.systems.base import TrackedTarget
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.sight import look
from wsnsim.systems.multiview.similarity import compare, view_similarities
from wsnsim.types import ByteArray, FloatArray, NodeId
from wsnsim.vision.features import FeatureSpace

_SMALLEST_PX = 5.0
_SIZE_RATIO = 1.6
_STRIDE = 0.6
"""Distance of neighbouring places, in radii of the outline."""
_LARGEST_SHARE = 0.25
"""Largest radius, as a share of the image's smaller side."""
_FINALISTS = 6
_FINER = 100
_FINER_SPREAD = 0.2
"""Of the finer places about a finalist, in radii, and of the logarithm of their distance."""


@dataclass(frozen=True, eq=False)
class Found:
    """The best place for a target in one image.

    Parameters
    ----------
    pixel : (2,) centre of the outline [px]
    distance_m : of the target's centre from the camera, by the outline's size [m]
    similarity : Bhattacharyya coefficient of the best viewpoint
    """

    pixel: FloatArray
    distance_m: float
    similarity: float


def find(
    image: ByteArray,
    camera: PinholeCamera,
    target: TrackedTarget,
    model: ReferenceModel,
    features: FeatureSpace,
    params: MultiviewParams,
) -> tuple[Found | None, Work]:
    """Look for a target in a whole image; None where no outline fits into it."""
    pixels, distances = _grid(camera, target)
    if not len(pixels):
        return None, Work()
    orientation, semi_axes = target.start.orientation, target.semi_axes_m
    mean_colour = np.sqrt((model.sqrt_colour**2).mean(axis=0))
    mean_texture = np.sqrt((model.sqrt_texture**2).mean(axis=0))
    sight = look(image, camera, _places(camera, pixels, distances), orientation, semi_axes, features)
    coarse = compare(sight, mean_colour, mean_texture, params.colour_share)
    work = sight.work + coarse.work
    best: Found | None = None
    for finalist in np.argsort(-coarse.rho, kind="stable")[:_FINALISTS]:
        found, cost = _refined(
            image, camera, target, model, features, params, pixels[finalist], float(distances[finalist])
        )
        work += cost
        if found is not None and (best is None or found.similarity > best.similarity):
            best = found
    return best, work


def _grid(camera: PinholeCamera, target: TrackedTarget) -> tuple[FloatArray, FloatArray]:
    """Return pixels (n, 2) and distances (n,) of a search: each size has places as dense as it needs."""
    width, height = camera.resolution_px
    radius_m = float(np.cbrt(np.prod(target.semi_axes_m)))
    pixels, distances = [np.empty((0, 2))], [np.empty(0)]
    radius = _SMALLEST_PX
    while radius <= _LARGEST_SHARE * min(width, height):
        xs = np.arange(0.5 * radius, width, _STRIDE * radius)
        ys = np.arange(0.5 * radius, height, _STRIDE * radius)
        pixels.append(np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2))
        distances.append(np.full(xs.size * ys.size, camera.focal_px * radius_m / radius))
        radius *= _SIZE_RATIO
    return np.concatenate(pixels), np.concatenate(distances)


def _places(camera: PinholeCamera, pixels: FloatArray, distances: FloatArray) -> FloatArray:
    """Return the points (n, 3) that pixels (n, 2) show at some distances (n,)."""
    return camera.position + distances[:, None] * _world_rays(camera, pixels)


def _world_rays(camera: PinholeCamera, pixels: FloatArray) -> FloatArray:
    """Return unit vectors (n, 3) in world axes along which pixels (n, 2) are seen."""
    rays = camera.rays(pixels) @ camera.rotation
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def _refined(
    image: ByteArray,
    camera: PinholeCamera,
    target: TrackedTarget,
    model: ReferenceModel,
    features: FeatureSpace,
    params: MultiviewParams,
    pixel: FloatArray,
    distance: float,
) -> tuple[Found | None, Work]:
    """Look closer at one place: from which side is it the target, and where exactly."""
    orientation, semi_axes = target.start.orientation, target.semi_axes_m
    radius = camera.focal_px * float(np.cbrt(np.prod(semi_axes))) / distance
    # a spiral of places about the finalist: the same at every call, without a draw
    turns = np.arange(_FINER)
    reach = _FINER_SPREAD * radius * np.sqrt(turns / _FINER) * 2.0
    golden = turns * np.pi * (3.0 - np.sqrt(5.0))
    offsets = reach[:, None] * np.stack([np.cos(golden), np.sin(golden)], axis=1)
    distances = distance * np.exp(_FINER_SPREAD * np.sin(golden * 7.0))
    finer = np.concatenate([pixel[None], pixel + offsets])
    distances = np.concatenate([[distance], distances])
    places = _places(camera, finer, distances)
    first = look(image, camera, places[:1], orientation, semi_axes, features)
    by_view, work = view_similarities(first, model, features, params.colour_share)
    view = int(np.argmax(by_view))
    sight = look(image, camera, places, orientation, semi_axes, features)
    fine = compare(sight, model.sqrt_colour[view], model.sqrt_texture[view], params.colour_share)
    work = work + first.work + sight.work + fine.work
    best = int(np.argmax(fine.rho))
    if not fine.judged[best]:
        return None, work
    return Found(finer[best], float(distances[best]), float(fine.rho[best])), work


def meeting_point(
    sightings: Mapping[NodeId, SightingPayload],
    cameras: Mapping[NodeId, PinholeCamera],
    tolerance_m: float,
    cameras_min: int,
) -> tuple[FloatArray, tuple[NodeId, ...]] | None:
    """Return the place (3,) where most rays meet, and the cameras they come from.

    Two rays meet where both pass within `tolerance_m` of a point that lies in
    front of both cameras, no nearer than half and no farther than twice of what
    the target's size in each image says.

    Parameters
    ----------
    sightings : by camera
    cameras_min : as many rays must meet, at least 2

    Returns
    -------
    None where fewer meet
    """
    names = tuple(sightings)
    if len(names) < cameras_min:
        return None
    origins = np.array([cameras[name].position for name in names])
    rays = np.concatenate([_world_rays(cameras[name], sightings[name].pixel[None]) for name in names])
    sizes_m = np.array([sightings[name].distance_m for name in names])
    similarities = np.array([sightings[name].similarity for name in names])
    best: tuple[float, FloatArray, tuple[int, ...]] | None = None
    for pair in combinations(range(len(names)), 2):
        point = _nearest_point(origins[list(pair)], rays[list(pair)])
        if point is None:
            continue
        along = np.einsum("ij,ij->i", point - origins, rays)
        aside = np.linalg.norm(point - origins - along[:, None] * rays, axis=1)
        fits = (aside <= tolerance_m) & (along > 0.5 * sizes_m) & (along < 2.0 * sizes_m)
        if not fits[list(pair)].all() or int(fits.sum()) < cameras_min:
            continue
        score = float(similarities[fits].sum())
        if best is None or score > best[0]:
            best = score, point, tuple(int(at) for at in np.flatnonzero(fits))
    if best is None:
        return None
    meeting = list(best[2])
    point = _nearest_point(origins[meeting], rays[meeting])
    return (best[1] if point is None else point), tuple(names[at] for at in meeting)


def _nearest_point(origins: FloatArray, rays: FloatArray) -> FloatArray | None:
    """Return the point nearest to lines in the least-squares sense; None where they are parallel."""
    projectors = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    normal = projectors.sum(axis=0)
    if np.linalg.cond(normal) > 1e8:
        return None
    right = np.einsum("nij,nj->i", projectors, origins)
    return np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
