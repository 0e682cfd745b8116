"""The likelihood of Ercan et al. 2007 done plainly: one particle, camera and occluder after another.

What Eqs. 1 to 6 say, in Python: walls by crossing sides, erf from the library, the recursion of Eq. 6.
The twin is the oracle of the kernels' tests too.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import cos, erf, hypot, inf, log, pi, sin, sqrt, tan

from wsnsim.systems.scanline.likelihood import Likelihood
from wsnsim.systems.scanline.measurement import ScanCamera
from wsnsim.systems.scanline.occlusion import NormalPriors
from wsnsim.types import FloatArray

_Point = tuple[float, float]


def likelihoods(likelihood: Likelihood, points: FloatArray) -> list[float]:
    """Do what `Likelihood.log_density` does for normal priors, but for its short cut.

    Raises
    ------
    TypeError : the knowledge is not that of normal priors
    """
    priors = likelihood.knowledge
    if not isinstance(priors, NormalPriors):
        raise TypeError(f"knowledge: must be normal priors, got {type(priors).__name__}")
    occluders = [
        ((float(mean[0]), float(mean[1])), (float(cov[0, 0]), float(cov[0, 1]), float(cov[1, 1])))
        for mean, cov in zip(priors.means, priors.covs, strict=True)
    ]
    return [_one(likelihood, priors, occluders, (float(x), float(y))) for x, y in points]


def _one(
    likelihood: Likelihood,
    priors: NormalPriors,
    occluders: Sequence[tuple[_Point, tuple[float, float, float]]],
    point: _Point,
) -> float:
    rig, report = likelihood.rig, likelihood.report
    walls = [[(float(x), float(y)) for x, y in wall] for wall in rig.room.walls]
    allowed = [k for k, camera in enumerate(rig.cameras) if in_sight(camera, point, walls)]
    logs = 0.0
    for k, camera in enumerate(rig.cameras):
        if not report.seeing >> k & 1:
            continue
        dx, dy = point[0] - camera.position[0], point[1] - camera.position[1]
        c, s = cos(camera.heading_rad), sin(camera.heading_rad)
        h, d = c * dy - s * dx, c * dx + s * dy
        if d <= 0.0:
            return -inf
        noise = rig.noise
        spread = (camera.focal_px * (1.0 + (h / d) ** 2) * noise.angle_sd_rad) ** 2
        spread += camera.focal_px**2 * (h * h + d * d) / d**4 * noise.position_sd_m**2 + noise.read_sd_px**2
        error = float(report.values_px[k]) - camera.focal_px * h / d
        logs -= 0.5 * (error * error / spread + log(2.0 * pi * spread))
    low, high = rig.room.low, rig.room.high
    free = low[0] <= point[0] <= high[0] and low[1] <= point[1] <= high[1]
    free = free and not any(_within(point, [*wall, wall[0]]) for wall in walls)
    probability = 0.0
    if (free or not likelihood.bounded) and all(
        k in allowed for k in range(len(rig.cameras)) if report.seeing >> k & 1
    ):
        seeing = [k for k in allowed if report.seeing >> k & 1]
        blind = [k for k in allowed if report.blind >> k & 1]
        q = [
            {k: coverage(rig.cameras[k].position, point, *occluder, priors.radius_m) for k in seeing + blind}
            for occluder in occluders
        ]
        for row in q:
            total = sum(row.values())
            if total > 1.0:
                for k in row:
                    row[k] /= total
        probability = recursion(q, seeing, blind)
    return logs + log(max(probability, likelihood.floor))


def recursion(q: Sequence[dict[int, float]], seeing: list[int], blind: list[int]) -> float:
    """Return p(η) by Eqs. 5 and 6 as printed.

    Parameters
    ----------
    q : for each occluder, by camera
    seeing, blind : the cameras
    """
    if not blind:
        product = 1.0
        for row in q:
            product *= 1.0 - sum(row[k] for k in seeing)
        return product
    rest = blind[1:]
    return recursion(q, seeing, rest) - recursion(q, [*seeing, blind[0]], rest)


def coverage(
    camera: _Point, point: _Point, mean: _Point, cov: tuple[float, float, float], radius: float
) -> float:
    """Return q by Eq. 4, turned into the frame of the line of sight instead of the occluder's."""
    dx, dy = point[0] - camera[0], point[1] - camera[1]
    length = hypot(dx, dy)
    ux, uy = dx / length, dy / length
    rx, ry = mean[0] - camera[0], mean[1] - camera[1]
    along, across = ux * rx + uy * ry, ux * ry - uy * rx
    xx, xy, yy = cov
    aa = ux * ux * xx + 2.0 * ux * uy * xy + uy * uy * yy
    bb = uy * uy * xx - 2.0 * ux * uy * xy + ux * ux * yy
    ab = ux * uy * (yy - xx) + (ux * ux - uy * uy) * xy
    width = _normal(radius, across, bb) - _normal(-radius, across, bb)
    middle, spread = along - ab / bb * across, aa - ab * ab / bb
    return width * (_normal(length, middle, spread) - _normal(0.0, middle, spread))


def in_sight(camera: ScanCamera, point: _Point, walls: Sequence[Sequence[_Point]]) -> bool:
    """Tell whether a camera sees a point: in its field of view, and no side of a wall between."""
    dx, dy = point[0] - camera.position[0], point[1] - camera.position[1]
    c, s = cos(camera.heading_rad), sin(camera.heading_rad)
    h, d = c * dy - s * dx, c * dx + s * dy
    if d <= 0.0 or abs(h) > d * tan(0.5 * camera.fov_rad):
        return False
    for wall in walls:
        ring = [*wall, wall[0]]
        if any(_cross(camera.position, point, start, end) for start, end in pairwise(ring)):
            return False
        if _within(camera.position, ring) or _within(point, ring):
            return False
    return True


def _normal(place: float, mean: float, variance: float) -> float:
    return 0.5 * (1.0 + erf((place - mean) / sqrt(2.0 * variance)))


def _side(start: _Point, end: _Point, point: _Point) -> float:
    return (end[0] - start[0]) * (point[1] - start[1]) - (end[1] - start[1]) * (point[0] - start[0])


def _cross(a: _Point, b: _Point, c: _Point, d: _Point) -> bool:
    return _side(a, b, c) * _side(a, b, d) < 0.0 and _side(c, d, a) * _side(c, d, b) < 0.0


def _within(point: _Point, ring: Sequence[_Point]) -> bool:
    sides = [_side(start, end, point) for start, end in pairwise(ring)]
    return all(side > 0.0 for side in sides) or all(side < 0.0 for side in sides)
