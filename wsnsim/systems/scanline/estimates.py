"""From what a tracker believes on the floor plan to a statement about an instant."""

from dataclasses import replace

import numpy as np

from wsnsim.systems.base import NOT_ORIENTED, Basis, Belief, TrackEstimate
from wsnsim.systems.scanline.followers import Followed
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import FloatArray


def estimate_of(
    stage: Stage, rate_hz: float, step: int, followed: Followed, heard: int, basis: Basis | None = None
) -> TrackEstimate:
    """Return what a tracker believes of a frame.

    Parameters
    ----------
    stage : the deployment
    rate_hz : of the frames [Hz]
    step : number of the frame
    followed : the belief
    heard : cameras whose reports are in it
    basis : what it rests on; None: measurements where somebody was heard, a prediction else
    """
    cov = np.zeros((3, 3))
    cov[:2, :2] = followed.cov
    belief = Belief(
        np.array([*followed.place, stage.height_m]),
        np.array([*(followed.velocity * rate_hz), 0.0]),
        NOT_ORIENTED,
    )
    if basis is None:
        basis = Basis.UPDATE if heard else Basis.TIMED_OUT
    return TrackEstimate(step / rate_hz, stage.target, belief, cov, basis, len(stage.names), heard)


def extrapolated(stage: Stage, followed: Followed, steps: int) -> Followed:
    """Return a belief so many steps later, or earlier where it is below 0: straight on, within the room.

    Who walks in any direction has a variance of half his way's square on each axis.
    """
    room = stage.rig.room
    place = np.clip(followed.place + steps * followed.velocity, room.low, room.high)
    cov: FloatArray = followed.cov + 0.5 * (steps * stage.walk.speed) ** 2 * np.eye(2)
    return replace(followed, place=place, cov=cov, replaced=False)


def received_cov(cov: FloatArray) -> FloatArray:
    """Return the covariance (2, 2) that was rounded to (xx, xy, yy), never indefinite [m²]."""
    xx, xy, yy = cov
    most = float(np.sqrt(xx * yy))
    xy = min(max(xy, -most), most)
    return np.array([[xx, xy], [xy, yy]])
