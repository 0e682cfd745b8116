"""What the map shows: the world and its cameras at first, everything on demand."""

from dataclasses import dataclass

import numpy as np

from wsnsim.report.context import ReportContext
from wsnsim.types import BoolArray, FloatArray

_MARGIN = 0.07
"""Free space round what must be seen, in parts of its longer side: enough for a node's name."""

_ROUND_A_POINT_M = 1.0
"""Free space where everything is in one place [m]."""


@dataclass(frozen=True)
class View:
    """A rectangle of the floor.

    Parameters
    ----------
    x : from and to [m]
    y : from and to [m]
    """

    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def longer_m(self) -> float:
        """Length of the longer side [m]."""
        return max(self.x[1] - self.x[0], self.y[1] - self.y[0])

    @property
    def aspect(self) -> float:
        """Height over width."""
        return (self.y[1] - self.y[0]) / (self.x[1] - self.x[0])

    def misses(self, places: FloatArray) -> BoolArray:
        """Return (n,) whether each of the `places`, (n, 2) [m], lies outside; a missing one does not."""
        low, high = np.array([self.x, self.y]).T
        missed: BoolArray = ((places < low) | (places > high)).any(axis=1)
        return missed


@dataclass(frozen=True)
class Outside:
    """What the first view of the map leaves out.

    Parameters
    ----------
    nodes : relays and base station, by name
    estimates : how many
    """

    nodes: tuple[str, ...]
    estimates: int

    def __bool__(self) -> bool:
        return bool(self.nodes or self.estimates)


def world_view(context: ReportContext) -> View:
    """Return the world, its cameras and the true paths, with a margin."""
    return _round(_core(context))


def nodes_view(context: ReportContext) -> View:
    """Return all nodes, and the world where there is one, with a margin."""
    corners = [] if context.size_m is None else [[0.0, 0.0], list(context.size_m[:2])]
    return _round(np.vstack([_nodes(context), np.array(corners, dtype=np.float64).reshape(-1, 2)]))


def whole_view(context: ReportContext) -> View:
    """Return all of that, all nodes and all estimates, with a margin."""
    return _round(np.vstack([_core(context), _nodes(context), _columns(context, "estimate")]))


def outside(context: ReportContext) -> Outside:
    """Return which nodes and how many estimates the first view leaves out."""
    view = world_view(context)
    names = context.tables["nodes"]["node"].to_numpy(str)
    return Outside(
        nodes=tuple(str(name) for name in names[view.misses(_nodes(context))]),
        estimates=int(view.misses(_columns(context, "estimate")).sum()),
    )


def _core(context: ReportContext) -> FloatArray:
    corners = np.zeros((1, 2)) if context.size_m is None else np.array([[0.0, 0.0], context.size_m[:2]])
    cameras = np.array([camera.position[:2] for camera in context.cameras.values()]).reshape(-1, 2)
    return np.vstack([corners, cameras, _columns(context, "truth")])


def _nodes(context: ReportContext) -> FloatArray:
    return context.tables["nodes"][["x_m", "y_m"]].to_numpy(float)


def _columns(context: ReportContext, whose: str) -> FloatArray:
    return context.tables["steps"][[f"{whose}_x_m", f"{whose}_y_m"]].to_numpy(float)


def _round(places: FloatArray) -> View:
    low, high = np.nanmin(places, axis=0), np.nanmax(places, axis=0)
    margin = _MARGIN * float((high - low).max()) or _ROUND_A_POINT_M
    (left, bottom), (right, top) = (low - margin).tolist(), (high + margin).tolist()
    return View(x=(left, right), y=(bottom, top))
