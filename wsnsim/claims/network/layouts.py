"""Where the motes of a comparison stand, and the tree their packets climb: stored, regular or random.

The stored ones, `layouts/rgg_*.json`, are random geometric graphs: motes thrown
over a square, the sink in its middle, links of up to 50 m, and a tree of fewest
hops; the peers' reference figures belong to exactly these. All have 11.9
motes within 50 m of a mote, edges aside.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import cast

import numpy as np

from wsnsim.errors import OutputError
from wsnsim.net.channel.places import numbered_by_place
from wsnsim.net.channel.propagation import LogDistance
from wsnsim.types import FloatArray, NodeId

STORED = ("rgg_n10", "rgg_n50", "rgg_n200")
SIDE_PER_ROOT_MOTE_M = 25.583
"""A square of that side for each mote gives the density of the stored layouts [m]."""
LINK_RANGE_M = 50.0
REFERENCE_LOSS_DB, EXPONENT = 40.05, 3.0
"""PL(d) = 40.05 + 30 log10(d / 1 m) dB."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Motes, their tree and the loss between them.

    Parameters
    ----------
    name : what it is called
    xy : (n, 2) - where they are [m]
    parent : the parent of each, -1 for the sink
    propagation : path loss
    """

    name: str
    xy: FloatArray
    parent: tuple[int, ...]
    propagation: LogDistance

    @property
    def motes(self) -> int:
        """How many motes it has, the sink included."""
        return len(self.parent)

    @property
    def positions(self) -> FloatArray:
        """(n, 3) - where they are [m]."""
        return np.column_stack([self.xy, np.zeros(len(self.xy))])

    @property
    def parents(self) -> Mapping[NodeId, NodeId | None]:
        """Each mote's parent by name; `n0` is the first."""
        return {f"n{i}": None if p < 0 else f"n{p}" for i, p in enumerate(self.parent)}


def stored(name: str) -> Layout:
    """Return one of the layouts in `STORED`."""
    return _parsed(name, files(__package__).joinpath("layouts", f"{name}.json").read_text("utf-8"))


def read_layout(path: Path) -> Layout:
    """Read a layout of one's own, a file like those in `layouts/`.

    Raises
    ------
    OutputError : no such file, or one without `xy` and `parent` of one length
    """
    try:
        return _parsed(path.stem, path.read_text("utf-8"))
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise OutputError(
            f"{path}: must be a JSON object with `xy`, a list of [x, y] in metres, and `parent`, for each "
            f"mote the number of its parent, -1 for the sink; got {type(error).__name__}: {error}"
        ) from error


def star(leaves: int, radius_m: float = 10.0) -> Layout:
    """Return motes on a circle round the sink."""
    angles = 2.0 * np.pi * np.arange(leaves) / leaves
    around = radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    return _layout(f"star_n{leaves}", np.vstack([np.zeros((1, 2)), around]), [-1] + [0] * leaves)


def line(motes: int, spacing_m: float = 50.0) -> Layout:
    """Return motes in a row, each the parent of the next."""
    xy = np.column_stack([spacing_m * np.arange(motes), np.zeros(motes)])
    return _layout(f"line{motes}", xy, list(range(-1, motes - 1)))


def hidden_pair(distance_m: float = 130.0) -> Layout:
    """Return two motes on either side of the sink that do not hear each other."""
    return _layout("hidden2", np.array([[0.0, 0.0], [distance_m, 0.0], [-distance_m, 0.0]]), [-1, 0, 0])


def random_layout(motes: int, seed: int = 0) -> Layout:
    """Return a random geometric graph of the stored ones' kind and density.

    Motes that cannot reach the sink are thrown again until all can. Many are numbered as a scenario's are:
    neighbours side by side.

    Parameters
    ----------
    motes : at least 2, the sink included
    seed : of the generator
    """
    rng = np.random.default_rng(seed)
    side = SIDE_PER_ROOT_MOTE_M * np.sqrt(motes)
    xy = rng.uniform(0.0, side, (motes, 2))
    xy[0] = 0.5 * side
    parent = _tree(xy)
    while (lost := np.flatnonzero(parent[1:] < 0) + 1).size:
        xy[lost] = rng.uniform(0.0, side, (len(lost), 2))
        parent = _tree(xy)
    names = dict(enumerate(xy.tolist()))
    order = [0, *(mote for mote in numbered_by_place(names) if mote)]
    xy = xy[order]
    return _layout(f"random_n{motes}", xy, _tree(xy).tolist())


def _tree(xy: FloatArray) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    """Return each mote's nearest neighbour that is one hop nearer to mote 0; -1 without a way."""
    from scipy.spatial import cKDTree

    near = cast("list[list[int]]", cKDTree(xy).query_ball_point(xy, LINK_RANGE_M))
    depth = np.full(len(xy), -1)
    depth[0] = 0
    parent = np.full(len(xy), -1)
    ring = [0]
    while ring:
        found = {other for mote in ring for other in near[mote] if depth[other] < 0}
        for mote in found:
            above = [other for other in near[mote] if depth[other] == depth[ring[0]]]
            parent[mote] = min(above, key=lambda other: (float(np.linalg.norm(xy[other] - xy[mote])), other))
        for mote in found:
            depth[mote] = depth[ring[0]] + 1
        ring = sorted(found)
    return parent


def _layout(name: str, xy: FloatArray, parent: list[int]) -> Layout:
    return Layout(name, xy, tuple(parent), LogDistance(EXPONENT, REFERENCE_LOSS_DB))


def _parsed(name: str, text: str) -> Layout:
    content = json.loads(text)
    xy = np.array(content["xy"], dtype=np.float64)
    parent = tuple(int(p) for p in content["parent"])
    if xy.shape != (len(parent), 2) or parent.count(-1) != 1:
        raise ValueError(f"{xy.shape} positions, {len(parent)} parents, {parent.count(-1)} sinks")
    loss = content.get("path_loss", {})
    exponent = float(loss.get("exponent", EXPONENT))
    reference_db = float(loss.get("reference_loss_db", loss.get("pl0_db", REFERENCE_LOSS_DB)))
    return Layout(str(content.get("name", name)), xy, parent, LogDistance(exponent, reference_db))
