"""Rays and solids: where a ray enters a unit ball, cube, cylinder or a prism, and what it meets there.

Each body has coordinates of its own, in units of its semi-axes: a ball of radius 1, a
cube of side 2, a cylinder of radius 1 and |z| ≤ 1 round the origin, or a prism of |z| ≤ 1
whose sides are half-planes. A body that holds the eye is not seen from inside.
"""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray

BALL, CUBE, CYLINDER, PRISM = 0, 1, 2, 3
"""Codes of the four solids."""


@kernel
def enter(
    form: int,
    ox: float,
    oy: float,
    oz: float,
    vx: float,
    vy: float,
    vz: float,
    planes: FloatArray,
    first_plane: int,
    end_plane: int,
) -> tuple[float, int]:
    """Return where the ray o + t v, t > 0, enters a solid from outside, and by which face.

    Parameters
    ----------
    form : code of the solid
    ox, oy, oz, vx, vy, vz : the ray
    planes : (e, 3) - sides of prisms, inside where nx x + ny y ≤ c
    first_plane, end_plane : which of them are this prism's

    Returns
    -------
    t : infinity where it does not
    face : of a cube 0 to 5 (-x, +x, -y, ...), of a cylinder 0 (side), 1 (bottom) or 2 (top); of a prism
        of k sides 0 to k - 1, k (bottom) or k + 1 (top); of a ball 0
    """
    if form == BALL:
        return _enter_ball(ox, oy, oz, vx, vy, vz), 0
    if form == CUBE:
        return _enter_cube(ox, oy, oz, vx, vy, vz)
    if form == PRISM:
        return _enter_prism(ox, oy, oz, vx, vy, vz, planes, first_plane, end_plane)
    return _enter_cylinder(ox, oy, oz, vx, vy, vz)


@kernel
def _enter_ball(ox: float, oy: float, oz: float, vx: float, vy: float, vz: float) -> float:
    """Return the nearer root t of |o + t v|² = 1."""
    vv = vx * vx + vy * vy + vz * vz
    ov = ox * vx + oy * vy + oz * vz
    outside = ox * ox + oy * oy + oz * oz - 1.0
    chord = ov * ov - vv * outside
    if chord < 0.0 or ov >= 0.0 or outside <= 0.0:
        return np.inf
    return float((-ov - np.sqrt(chord)) / vv)


@kernel
def _enter_cube(ox: float, oy: float, oz: float, vx: float, vy: float, vz: float) -> tuple[float, int]:
    """Return where the last of three slabs is entered, if that is before the first is left."""
    near, far = _slab(ox, vx)
    face = 1 if vx < 0.0 else 0
    first, last = _slab(oy, vy)
    if first > near:
        near, face = first, 3 if vy < 0.0 else 2
    far = min(far, last)
    first, last = _slab(oz, vz)
    if first > near:
        near, face = first, 5 if vz < 0.0 else 4
    far = min(far, last)
    if near > 0.0 and near < far:
        return near, face
    return np.inf, 0


@kernel
def _enter_cylinder(ox: float, oy: float, oz: float, vx: float, vy: float, vz: float) -> tuple[float, int]:
    """Return where the later of tube and slab is entered, if that is before the first is left."""
    near, far = _tube(ox, oy, vx, vy)
    face = 0
    first, last = _slab(oz, vz)
    if first > near:
        near, face = first, 2 if vz < 0.0 else 1
    far = min(far, last)
    if near > 0.0 and near < far:
        return near, face
    return np.inf, 0


@kernel
def _enter_prism(
    ox: float,
    oy: float,
    oz: float,
    vx: float,
    vy: float,
    vz: float,
    planes: FloatArray,
    first_plane: int,
    end_plane: int,
) -> tuple[float, int]:
    """Return where the last of the half-planes and the slab is entered, if that is before the first is left.

    References
    ----------
    Cyrus & Beck (1978), Generalized two- and three-dimensional clipping, Computers & Graphics 3.
    """
    near, far, face = -np.inf, np.inf, 0
    for e in range(first_plane, end_plane):
        to_go = planes[e, 2] - planes[e, 0] * ox - planes[e, 1] * oy
        rate = planes[e, 0] * vx + planes[e, 1] * vy
        if rate < 0.0:
            if to_go / rate > near:
                near, face = to_go / rate, e - first_plane
        elif rate > 0.0:
            far = min(far, to_go / rate)
        elif to_go <= 0.0:
            return np.inf, 0
    first, last = _slab(oz, vz)
    if first > near:
        near, face = first, end_plane - first_plane + (1 if vz < 0.0 else 0)
    far = min(far, last)
    if near > 0.0 and near < far:
        return near, face
    return np.inf, 0


@kernel
def _slab(o: float, v: float) -> tuple[float, float]:
    """Return between which t the number o + t v lies in -1 to 1."""
    if v == 0.0:
        return (-np.inf, np.inf) if abs(o) < 1.0 else (np.inf, -np.inf)
    one, other = (-1.0 - o) / v, (1.0 - o) / v
    return min(one, other), max(one, other)


@kernel
def _tube(ox: float, oy: float, vx: float, vy: float) -> tuple[float, float]:
    """Return between which t the point o + t v of the plane lies in the unit circle."""
    vv = vx * vx + vy * vy
    ov = ox * vx + oy * vy
    outside = ox * ox + oy * oy - 1.0
    if vv == 0.0:
        return (-np.inf, np.inf) if outside < 0.0 else (np.inf, -np.inf)
    chord = ov * ov - vv * outside
    if chord < 0.0:
        return np.inf, -np.inf
    half = np.sqrt(chord)
    return (-ov - half) / vv, (-ov + half) / vv


@kernel
def patch_at(ux: float, uy: float, uz: float, start: int, end: int, patch_centres: FloatArray) -> int:
    """Return the patch whose centre lies nearest to the direction of a surface point u."""
    best, patch = -np.inf, start
    for p in range(start, end):
        cosine = patch_centres[p, 0] * ux + patch_centres[p, 1] * uy + patch_centres[p, 2] * uz
        if cosine > best:
            best, patch = cosine, p
    return patch


@kernel
def facing(
    form: int,
    face: int,
    ux: float,
    uy: float,
    uz: float,
    per_axis: FloatArray,
    light: FloatArray,
    planes: FloatArray,
    first_plane: int,
    end_plane: int,
) -> float:
    """Return max(0, n·l) of the real body's normal n at a surface point u of its solid (Lambert's law).

    Parameters
    ----------
    form, face : of `enter`
    ux, uy, uz : the point, in units of the semi-axes
    per_axis : (3,) - 1 / semi-axes [1/m]
    light : (3,) - unit vector towards the light, in body axes
    planes, first_plane, end_plane : of `enter`
    """
    gx, gy, gz = ux, uy, uz
    if form == CUBE:
        side = 2.0 * (face % 2) - 1.0
        gx = side if face // 2 == 0 else 0.0
        gy = side if face // 2 == 1 else 0.0
        gz = side if face // 2 == 2 else 0.0
    elif form == CYLINDER:
        if face == 0:
            gz = 0.0
        else:
            gx, gy, gz = 0.0, 0.0, 2.0 * face - 3.0
    elif form == PRISM:
        top = face - (end_plane - first_plane)
        if top < 0:
            gx, gy, gz = planes[first_plane + face, 0], planes[first_plane + face, 1], 0.0
        else:
            gx, gy, gz = 0.0, 0.0, 2.0 * top - 1.0
    nx, ny, nz = per_axis[0] * gx, per_axis[1] * gy, per_axis[2] * gz
    cosine = (nx * light[0] + ny * light[1] + nz * light[2]) / np.sqrt(nx * nx + ny * ny + nz * nz)
    return float(max(cosine, 0.0))
