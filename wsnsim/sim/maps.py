"""What a scenario's cameras see of the floor and how far its radios reach, before anything runs.

Coverage is geometry: a point is seen where it lies in a camera's image and
nothing that stands about is between. Left out: people and targets in the way,
who move, and what light and background make of the image. Margins are those of
undisturbed links; where no node stands, the path loss by distance counts, and walls
where the scenario's radio has them, since the shadowing of a link that does not exist
is not known.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines
from wsnsim.net.channel.propagation import Propagation, distances
from wsnsim.net.routing.linkquality import expected_transmissions, weakest_usable_dbm
from wsnsim.net.routing.tree import Tree
from wsnsim.rng import RandomStreams
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_routing import MinHopTree
from wsnsim.sim.channels import run_links
from wsnsim.sim.engine import Simulation
from wsnsim.sim.macs import mac_family, radio_config
from wsnsim.sim.propagations import place_propagation
from wsnsim.types import BoolArray, FloatArray, IntArray, NodeId
from wsnsim.world.solids import any_blocks, contains
from wsnsim.world.world import World

_CELLS = 150
"""Cells along the longer side of a map."""
_MARGIN = 0.05
"""Free space round the nodes, in parts of the longer side of what holds them."""
_GOOD: float = MinHopTree.model_fields["link_success_min"].default
"""Share of the longest frames that a usable link carries, where the routing does not say."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Points in the middle of equal cells on a level rectangle.

    Parameters
    ----------
    x, y : (nx,), (ny,) - ascending [m]
    height_m : of all points [m]
    """

    x: FloatArray
    y: FloatArray
    height_m: float

    @classmethod
    def over(cls, low: FloatArray, high: FloatArray, height_m: float, cells: int = _CELLS) -> Self:
        """Cover the rectangle from `low` to `high`, (2,) each [m], with `cells` along its longer side."""
        cell_m = float((high - low).max()) / cells
        axes = []
        for start, end in zip(low.tolist(), high.tolist(), strict=True):
            number = max(1, round((end - start) / cell_m))
            axes.append(start + (end - start) * (np.arange(number) + 0.5) / number)
        return cls(axes[0], axes[1], height_m)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows (along y) and columns (along x)."""
        return len(self.y), len(self.x)

    @property
    def points(self) -> FloatArray:
        """All points (ny nx, 3), row by row [m]."""
        x, y = np.meshgrid(self.x, self.y)
        return np.column_stack((x.ravel(), y.ravel(), np.full(x.size, self.height_m)))


@dataclass(frozen=True, eq=False)
class Coverage:
    """Which cameras see each point, and how large a target would be there.

    Parameters
    ----------
    grid : (ny, nx) points
    cameras : names of c cameras
    seen : (c, ny, nx) - whether a camera sees a point
    shares : (c, ny, nx) - share of its image that the target's outline would take; 0 where it is not seen
    solid : (ny, nx) - whether a point lies inside something that stands about, and so is no floor
    target : name of the target whose size counts
    """

    grid: Grid
    cameras: tuple[str, ...]
    seen: BoolArray
    shares: FloatArray
    solid: BoolArray
    target: str

    @cached_property
    def seen_by(self) -> IntArray:
        """(ny, nx) number of cameras that see a point."""
        return np.asarray(self.seen.sum(axis=0), dtype=np.int64)

    @property
    def largest_share(self) -> FloatArray:
        """(ny, nx) largest share of an image that the target would take."""
        return np.asarray(self.shares.max(axis=0))

    @property
    def mean_share(self) -> FloatArray:
        """(ny, nx) mean share over the cameras that see the point; 0 where none does."""
        return np.asarray(self.shares.sum(axis=0) / np.maximum(self.seen_by, 1))

    def floor_share(self, points: BoolArray) -> float:
        """Return the share of the floor, what stands on it left out, at which `points` (ny, nx) is true."""
        floor = ~self.solid
        return float(points[floor].mean()) if floor.any() else 0.0


@dataclass(frozen=True, eq=False)
class Links:
    """How good the links between nodes are.

    Parameters
    ----------
    nodes : names of n nodes
    positions : (n, 3) - [m]
    power_dbm : (n, n) - power of node i at node j [dBm]
    etx : (n, n) - expected transmissions of a full frame from node i to node j [-]
    weakest_dbm : weakest power that makes a link usable [dBm]
    success : share of full frames that arrive with that power [-]
    tree : the routing tree
    """

    nodes: tuple[NodeId, ...]
    positions: FloatArray
    power_dbm: FloatArray
    etx: FloatArray
    weakest_dbm: float
    success: float
    tree: Tree

    @property
    def margin_db(self) -> FloatArray:
        """(n, n) what the weaker direction of a link has beyond the weakest usable power [dB]."""
        return np.asarray(np.minimum(self.power_dbm, self.power_dbm.T) - self.weakest_dbm)

    @property
    def distance_m(self) -> FloatArray:
        """(n, n) how far nodes are from each other [m]."""
        return distances(self.positions)

    def in_tree(self, one: NodeId, other: NodeId) -> bool:
        """Tell whether the routing tree uses the link of two nodes."""
        return self.tree.parent[one] == other or self.tree.parent[other] == one


@dataclass(frozen=True, eq=False)
class Reach:
    """How well one more node would be linked, anywhere.

    Parameters
    ----------
    grid : (ny, nx) points
    margin_db : (ny, nx) - margin of the link to the node heard best, by distance and walls alone; minus
        infinity where links are known from a file only [dB]
    best : (ny, nx) - which node that is
    """

    grid: Grid
    margin_db: FloatArray
    best: IntArray


@dataclass(frozen=True, eq=False)
class Maps:
    """Everything that is known of a scenario's views and links before it runs."""

    coverage: Coverage
    links: Links
    reach: Reach


def scenario_maps(scenario: Scenario, simulation: Simulation, height_m: float | None = None) -> Maps:
    """Return the maps of a scenario.

    Parameters
    ----------
    scenario : what `simulation` was built from
    simulation : built, not run
    height_m : at which the cameras' views are mapped; None for the mean height at which targets start [m]
    """
    world = simulation.world
    if height_m is None:
        height_m = float(np.mean([pose.position[2] for pose in world.at(0.0)]))
    cameras = {camera.node.id: camera.renderer.camera for camera in simulation.cameras}
    links = links_of(scenario, simulation.positions, simulation.tree)
    return Maps(
        coverage_of(cameras, world, height_m),
        links,
        reach_of(links, world.size_m, place_propagation(scenario), scenario.network.tx_power_dbm),
    )


def coverage_of(
    cameras: Mapping[str, PinholeCamera], world: World, height_m: float, cells: int = _CELLS
) -> Coverage:
    """Return which cameras see each point of the floor plan at a height.

    The outline is that of an ellipsoid with the half extents and the orientation
    that the world's first target starts with, whole even where the image cuts it.

    Parameters
    ----------
    cameras : by name
    world : the floor plan, what stands on it, and the target
    height_m : of the points [m]
    cells : along the longer side of the floor plan
    """
    grid = Grid.over(np.zeros(2), world.size_m[:2], height_m, cells)
    points = grid.points
    target = world.targets[0]
    orientation, semi_axes = target.motion.at(0.0).orientation, target.body.semi_axes_m
    bodies, poses = [placed.body for placed in world.scenery], [placed.pose for placed in world.scenery]
    seen, shares = [], []
    for camera in cameras.values():
        pixels, _ = camera.project(points)
        size = np.array(camera.resolution_px, dtype=np.float64)
        # a pixel that is NaN, behind the camera, is in no image
        shown = ((pixels >= -0.5) & (pixels <= size - 0.5)).all(axis=1)
        shown &= ~any_blocks(bodies, poses, camera.position[None], points)
        outlines = ellipsoid_outlines(camera, points, orientation, semi_axes)
        area_px = np.pi / np.sqrt(np.linalg.det(outlines.shapes))
        share = np.minimum(area_px / float(size.prod()), 1.0)
        seen.append(shown)
        shares.append(np.where(shown & outlines.visible, share, 0.0))
    solid = np.zeros(len(points), dtype=np.bool_)
    for body, pose in zip(bodies, poses, strict=True):
        solid |= contains(body, pose, points)
    layers = (len(cameras), *grid.shape)
    return Coverage(
        grid,
        tuple(cameras),
        np.array(seen).reshape(layers),
        np.array(shares).reshape(layers),
        solid.reshape(grid.shape),
        target.id,
    )


def links_of(scenario: Scenario, positions: Mapping[NodeId, tuple[float, float, float]], tree: Tree) -> Links:
    """Return the links between nodes as the radio makes them, also where the network is ideal."""
    network = scenario.network
    success = network.routing.link_success_min if isinstance(network.routing, MinHopTree) else _GOOD
    family, radio = mac_family(network), radio_config(network)
    links = run_links(scenario, positions, RandomStreams(scenario.seed))
    etx = expected_transmissions(links, family.phy, radio, family.phy.max_mpdu_bytes, family.ack_bytes)
    return Links(
        tuple(positions),
        np.array(list(positions.values()), dtype=np.float64),
        links.matrix(links.power_dbm, -np.inf),
        links.matrix(etx, np.inf),
        weakest_usable_dbm(family.phy, radio, success),
        success,
        tree,
    )


def reach_of(
    links: Links,
    size_m: FloatArray,
    propagation: Propagation | None,
    tx_power_dbm: float,
    cells: int = _CELLS,
) -> Reach:
    """Return the margin of a further node's best link, over the world and all nodes.

    Parameters
    ----------
    links : of the nodes that there are; the further one is as high as they are on average
    size_m : (3,) - of the world [m]
    propagation : path loss between any two places; None where links are known from a file only, and those
        of a further node are not
    tx_power_dbm : of all nodes [dBm]
    cells : along the longer side of the map
    """
    places = np.vstack([[0.0, 0.0], size_m[:2], links.positions[:, :2]])
    low, high = places.min(axis=0), places.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    grid = Grid.over(low - margin, high + margin, float(links.positions[:, 2].mean()), cells)
    points = grid.points
    margin_db = np.full(len(points), -np.inf)
    best = np.zeros(len(points), dtype=np.int64)
    if propagation is not None:
        here, there = np.zeros(len(points), dtype=np.int64), np.arange(1, len(points) + 1)
        least_db = np.full(len(points), np.inf)
        for at, place in enumerate(links.positions):
            loss_db = propagation.loss_db(np.vstack([place, points]), here, there)
            less = loss_db < least_db
            least_db, best = np.where(less, loss_db, least_db), np.where(less, at, best)
        margin_db = tx_power_dbm - least_db - links.weakest_dbm
    return Reach(grid, margin_db.reshape(grid.shape), best.reshape(grid.shape))
