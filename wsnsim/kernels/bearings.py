"""How well points of a floor plan explain where cameras see the object (Ercan et al. 2007, Eqs. 1 to 3)."""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray


@kernel
def misfits_and_volumes(
    points: FloatArray,
    cameras: FloatArray,
    values: FloatArray,
    seeing: int,
    position_sd: float,
    angle_sd: float,
    read_sd: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the two sums of the normal part of Eq. 3 over the cameras that see the object.

    Parameters
    ----------
    points : (m, 2) - [m]
    cameras : (n, 6) - rows as in `sightlines`
    values : (n,) - what the cameras measure [px]
    seeing : cameras that do, as a bit mask
    position_sd, angle_sd, read_sd : σ_pos [m], σ_θ [rad] and σ_read [px] of Eq. 2

    Returns
    -------
    misfits : (m,) - of (z − f h/d)² / σ², inf behind one of the cameras
    volumes : (m,) - of log 2πσ²
    """
    misfits, volumes = np.zeros(len(points)), np.zeros(len(points))
    for k in range(len(cameras)):
        if not seeing >> k & 1:
            continue
        x, y, c, s, focal = cameras[k, 0], cameras[k, 1], cameras[k, 2], cameras[k, 3], cameras[k, 4]
        for i in range(len(points)):
            dx, dy = points[i, 0] - x, points[i, 1] - y
            h, d = c * dy - s * dx, c * dx + s * dy
            if d <= 0.0:
                misfits[i] = np.inf
                continue
            slope = h / d
            stretch = 1.0 + slope * slope
            place = position_sd / d
            spread = focal * focal * stretch * (stretch * angle_sd * angle_sd + place * place)
            spread += read_sd * read_sd
            error = values[k] - focal * slope
            misfits[i] += error * error / spread
            volumes[i] += np.log(2.0 * np.pi * spread)
    return misfits, volumes
