"""How well a place of the object explains a report: Eq. 3 of Ercan et al. 2007, with floors.

The normal part of Eq. 3 is computed first; where it is hopeless the other, which costs most, is left out.
With 0/1 probabilities Fig. 4 divides by 0, and one wrong 0 loses the object for good: p(η) has a floor.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.kernels.bearings import misfits_and_volumes
from wsnsim.kernels.jit import frozen
from wsnsim.systems.scanline.measurement import Report
from wsnsim.systems.scanline.occlusion import Knowledge
from wsnsim.systems.scanline.regions import Rig
from wsnsim.types import FloatArray

_HOPELESS_NATS = 35.0
"""Below the best particle's normal part: what is worse has no weight in double precision."""


@dataclass(frozen=True)
class Likelihood:
    """Tells how probable a report is, given the object's place.

    Parameters
    ----------
    rig : cameras and room
    report : what was heard
    knowledge : of the occluders
    floor : least p(η); 0 as printed
    bounded : the object cannot be in a wall or outside the room: p(η) is the floor there; printed is without
    """

    rig: Rig
    report: Report
    knowledge: Knowledge
    floor: float = 1e-3
    bounded: bool = True

    def log_density(self, points: FloatArray) -> FloatArray:
        """Return log f(Z, η | x) of points (m, 2), (m,); −inf where it is 0 (Eq. 3).

        Where the normal part is more than 35 nats below the largest of these points, it stands alone with
        the floor of p(η).
        """
        logs = self.log_normal(points)
        best = logs.max(initial=-np.inf)
        if best == -np.inf:
            return logs
        active = np.flatnonzero(logs >= best - _HOPELESS_NATS)
        probabilities = np.full(len(points), self.floor)
        chosen = points[active]
        probabilities[active] = self.knowledge.probabilities(
            self.rig, chosen, self.rig.masks(chosen), self.report.seeing, self.report.blind, self.floor
        )
        if self.bounded:
            probabilities[active] *= self.rig.room.within(chosen)
        with np.errstate(divide="ignore"):
            return np.asarray(logs + np.log(np.maximum(probabilities, self.floor)))

    def log_normal(self, points: FloatArray) -> FloatArray:
        """Return log f(Z | η, x) (m,): −inf behind a camera that sees the object."""
        misfits, volumes = self._normal(points)
        return -0.5 * (misfits + volumes)

    def misfit(self, points: FloatArray) -> FloatArray:
        """Return the sum over the seeing cameras of (z − f h/d)² / σ², (m,): inf behind one of them."""
        return self._normal(points)[0]

    def _normal(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the misfits (m,), and log 2πσ² summed over the seeing cameras (m,)."""
        noise = self.rig.noise
        return misfits_and_volumes(
            frozen(points, np.float64),
            self.rig.rows,
            frozen(self.report.values_px, np.float64),
            self.report.seeing,
            noise.position_sd_m,
            noise.angle_sd_rad,
            noise.read_sd_px,
        )
