"""Round bodies on a floor plan that walk from waypoint to waypoint and round each other."""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray, IntArray

_TURN = 0.2617993877991494
"""15°: a body that is in the way is passed by so much more each time."""
_TURNS = 8
"""To either side: 120° at most."""


@kernel
def is_free(
    x: float,
    y: float,
    margin: float,
    low: FloatArray,
    high: FloatArray,
    half_planes: FloatArray,
    starts: IntArray,
) -> bool:
    """Tell whether a place is in the room and `margin` from its sides and from the polygons' at least."""
    if x < low[0] + margin or y < low[1] + margin or x > high[0] - margin or y > high[1] - margin:
        return False
    for i in range(len(starts) - 1):
        outside = -np.inf
        for e in range(starts[i], starts[i + 1]):
            outside = max(outside, half_planes[e, 0] * x + half_planes[e, 1] * y - half_planes[e, 2])
        if outside < margin:
            return False
    return True


@kernel
def is_clear(x: float, y: float, places: FloatArray, body: int, diameter: float) -> bool:
    """Tell whether no body but `body` is nearer than a diameter."""
    for j in range(len(places)):
        ex, ey = places[j, 0] - x, places[j, 1] - y
        if j != body and ex * ex + ey * ey < diameter * diameter:
            return False
    return True


@kernel
def walk(
    places: FloatArray,
    targets: FloatArray,
    fresh: FloatArray,
    noise: FloatArray,
    speed: float,
    diameter: float,
    low: FloatArray,
    high: FloatArray,
    half_planes: FloatArray,
    starts: IntArray,
) -> tuple[FloatArray, FloatArray]:
    """Move bodies for some steps, one after the other in each.

    A body that has reached its target, or whose way leads into a wall or out of the room, takes a new
    target. A step that would meet another body is turned, to the right first, until it does not; a body
    that finds no way stands for this step.

    Parameters
    ----------
    places, targets : (n, 2) - at the beginning [m]
    fresh : (t, n, 2) - target that a body takes in a step if it needs one [m]
    noise : (t, n, 2) - added to each step [m]
    speed : length of a step without noise [m]
    diameter : of the bodies [m]
    low, high : (2,) - corners of the room [m]
    half_planes : (e, 3) - of convex polygons, inside where nx x + ny y ≤ c
    starts : (p + 1,) - polygon i has the half-planes of [starts[i], starts[i + 1])

    Returns
    -------
    paths : (t, n, 2) - places after each step
    targets : (n, 2) - at the end
    """
    steps, count, _ = noise.shape
    now, aims = places.copy(), targets.copy()
    paths = np.empty((steps, count, 2))
    margin = 0.5 * diameter
    for t in range(steps):
        for i in range(count):
            x, y = now[i, 0], now[i, 1]
            wx, wy = aims[i, 0] - x, aims[i, 1] - y
            length = np.sqrt(wx * wx + wy * wy)
            new = length < speed
            if not new:
                ahead_x, ahead_y = x + speed * wx / length, y + speed * wy / length
                new = not is_free(ahead_x, ahead_y, margin, low, high, half_planes, starts)
            if new:
                aims[i] = fresh[t, i]
                wx, wy = aims[i, 0] - x, aims[i, 1] - y
                length = max(np.sqrt(wx * wx + wy * wy), 1e-12)
            dx, dy = speed * wx / length + noise[t, i, 0], speed * wy / length + noise[t, i, 1]
            for k in range(2 * _TURNS + 1):
                angle = _TURN * ((k + 1) // 2) * (-1.0 if k % 2 else 1.0)
                c, s = np.cos(angle), np.sin(angle)
                px, py = x + c * dx - s * dy, y + s * dx + c * dy
                free = is_free(px, py, margin, low, high, half_planes, starts)
                if k == 0 and not free:
                    break
                if free and is_clear(px, py, now, i, diameter):
                    now[i, 0], now[i, 1] = px, py
                    break
        paths[t] = now
    return paths, aims
