"""The trackers that Ercan et al. 2007, Sec. 4, find wanting: EKF, UKF, and MAP with a Kalman filter.

All have constant velocity under white acceleration as their model, and all learn from the cameras that see
the object only: none has a place for what a blind camera says, but that the UKF and the MAP estimate leave
out places that walls and fields of view forbid. That is where they fail, and it is not mended here.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.estimation.kalman import Gaussian, predict, update
from wsnsim.systems.scanline.likelihood import Likelihood
from wsnsim.systems.scanline.measurement import Report, camera_frame, gradient, project, variance
from wsnsim.systems.scanline.occlusion import NoKnowledge
from wsnsim.systems.scanline.regions import Rig
from wsnsim.types import FloatArray

_PLACE = np.hstack([np.eye(2), np.zeros((2, 2))])
"""H of a measured place."""
GRID = 41
"""Places on each side from which the MAP estimate takes its start."""
NEWTON_STEPS = 10
"""Of Gauss–Newton at most."""
_LEAST_DEPTH = 1e-6
"""Of a place before a camera [m]."""


@dataclass(frozen=True)
class Baseline:
    """What the three trackers share.

    Parameters
    ----------
    rig : cameras and room
    acceleration_sd : of the model on each axis [m/step²]
    """

    rig: Rig
    acceleration_sd: float = 0.5

    def start(self) -> Gaussian:
        """Return what is known of an object in the room: place (2,) and velocity (2,)."""
        room = self.rig.room
        variances = np.concatenate([room.sides**2 / 12.0, np.ones(2)])
        return Gaussian(np.concatenate([room.centre, np.zeros(2)]), np.diag(variances))

    def predicted(self, belief: Gaussian) -> Gaussian:
        """Return the belief one step later."""
        identity = np.eye(2)
        transition = np.block([[identity, identity], [np.zeros((2, 2)), identity]])
        gain = np.vstack([0.5 * identity, identity])
        return predict(belief, transition, self.acceleration_sd**2 * (gain @ gain.T))

    def extended(self, belief: Gaussian, report: Report) -> Gaussian:
        """Take a step of the extended Kalman filter, camera by camera.

        A camera behind which the object is believed to be has no gradient there and is left out.

        References
        ----------
        Bar-Shalom, Li, Kirubarajan (2001), ch. 10.3.
        """
        belief = self.predicted(belief)
        for k, camera in enumerate(self.rig.cameras):
            place = belief.mean[:2]
            if not report.seeing >> k & 1 or camera_frame(camera, place)[1] <= _LEAST_DEPTH:
                continue
            slope = np.concatenate([gradient(camera, place), np.zeros(2)])[np.newaxis]
            # as if it were linear: z − (f h/d)(x̂) + H x̂ is measured
            linear = report.values_px[k] - project(camera, place) + slope @ belief.mean
            spread = np.array([[float(variance(camera, place, self.rig.noise))]])
            belief = update(belief, linear, slope, spread)
        return belief

    def unscented(self, belief: Gaussian, report: Report) -> Gaussian:
        """Take a step of the unscented Kalman filter, camera by camera.

        Sigma points that a seeing camera cannot see are discarded (Sec. 4); where fewer than two remain, the
        camera is left out.

        References
        ----------
        Julier & Uhlmann (2004), Unscented filtering and nonlinear estimation, with κ = 0: no weight is
        below 0, so that those that remain can be scaled.
        """
        belief = self.predicted(belief)
        dimension = len(belief.mean)
        for k, camera in enumerate(self.rig.cameras):
            if not report.seeing >> k & 1:
                continue
            root = np.linalg.cholesky(dimension * belief.cov)
            points = belief.mean + np.vstack([root.T, -root.T])
            points = points[self.rig.masks(points[:, :2]) >> k & 1 == 1]
            if len(points) < 2:
                continue
            values = project(camera, points[:, :2])
            mean, centre = float(values.mean()), points.mean(axis=0)
            noise = float(variance(camera, points[:, :2], self.rig.noise).mean())
            spread = float(((values - mean) ** 2).mean()) + noise
            gain = (values - mean) @ (points - centre) / (len(points) * spread)
            cov = belief.cov - spread * np.outer(gain, gain)
            belief = Gaussian(belief.mean + gain * (report.values_px[k] - mean), _positive(cov))
        return belief

    def map_kalman(self, belief: Gaussian, report: Report) -> Gaussian:
        """Take a step of a Kalman filter whose mean becomes the most probable place.

        The place maximises prior times likelihood, over places that walls and fields of view allow: the best
        of a grid, then Gauss–Newton, as long as it stays in what is allowed. It is the mean afterwards; the
        curvature there, without the prior, is the covariance of what was measured.
        """
        belief = self.predicted(belief)
        if not report.seeing:
            return belief
        likelihood = Likelihood(self.rig, report, NoKnowledge(), 0.0)
        room, prior = self.rig.room, np.linalg.inv(belief.cov[:2, :2])
        axes = [np.linspace(room.low[k], room.high[k], GRID) for k in range(2)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)

        def scores(places: FloatArray) -> FloatArray:
            offsets = places - belief.mean[:2]
            far = np.einsum("ij,jk,ik->i", offsets, prior, offsets)
            return np.asarray(likelihood.log_density(places) - 0.5 * far, dtype=np.float64)

        found = scores(grid)
        if found.max() == -np.inf:
            return belief
        place, best = grid[int(found.argmax())], float(found.max())
        for _ in range(NEWTON_STEPS):
            information, pull = self._information(place, report)
            pull = pull - prior @ (place - belief.mean[:2])
            there = place + np.linalg.solve(information + prior, pull)
            score = float(scores(there[np.newaxis])[0])
            if not score > best:
                break
            place, best = there, score
        values, directions = np.linalg.eigh(self._information(place, report)[0])
        # a single camera says nothing along its ray
        told = values > 1e-6 * values.max()
        values, matrix = values[told], directions.T[told] @ _PLACE
        # what, measured with the curvature's covariance, takes the filter's mean to the place
        pull = directions.T[told] @ prior @ (place - belief.mean[:2])
        return update(belief, directions.T[told] @ place + pull / values, matrix, np.diag(1.0 / values))

    def _information(self, place: FloatArray, report: Report) -> tuple[FloatArray, FloatArray]:
        """Return Fisher's information (2, 2) and the score (2,) of the seeing cameras at a place."""
        information, score = np.zeros((2, 2)), np.zeros(2)
        for k, camera in enumerate(self.rig.cameras):
            if report.seeing >> k & 1 and camera_frame(camera, place)[1] > _LEAST_DEPTH:
                slope = gradient(camera, place)
                spread = float(variance(camera, place, self.rig.noise))
                information += np.outer(slope, slope) / spread
                score += slope * float(report.values_px[k] - project(camera, place)) / spread
        return information, score


def _positive(cov: FloatArray) -> FloatArray:
    """Return a symmetric matrix with its eigenvalues above 0: discarded sigma points may take them below."""
    values, directions = np.linalg.eigh(0.5 * (cov + cov.T))
    return np.asarray((directions * np.maximum(values, 1e-9 * values.max())) @ directions.T)
