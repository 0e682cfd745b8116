"""What everybody knows of a deployment before a run: cameras, room, walls, and what occluders are like."""

from dataclasses import dataclass
from math import asin, atan, atan2, degrees

import numpy as np

from wsnsim.errors import Problem, ScenarioError
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.lens import undistort
from wsnsim.geometry.polygons import is_convex
from wsnsim.systems.base import Site
from wsnsim.systems.scanline.choices import VirtualOccluders
from wsnsim.systems.scanline.measurement import MeasurementNoise, ScanCamera, displaced
from wsnsim.systems.scanline.motion import WaypointWalk
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.regions import Rig, Room
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.types import FloatArray, NodeId
from wsnsim.world.footprints import footprints

_MOST_TILT_DEG = 5.0
"""A line of pixels tells a direction on the floor as long as the camera is level: 5° are .4 % of it."""


@dataclass(frozen=True, eq=False)
class Stage:
    """A deployment on the floor plan.

    Parameters
    ----------
    rig : cameras and room
    names : of the nodes that carry the cameras, in the same order
    target : name of the object
    start : (2,) - where it is at the beginning [m]
    height_m : at which it is
    target_radius_m : of the object, seen from above [m]
    occluders : how many move about
    radius_m : of each [m]
    walk : how the object moves, a step a frame
    """

    rig: Rig
    names: tuple[NodeId, ...]
    target: str
    start: FloatArray
    height_m: float
    target_radius_m: float
    occluders: int
    radius_m: float
    walk: WaypointWalk

    @property
    def size(self) -> FloatArray:
        """Sides of the room (2,) [m]."""
        return self.rig.room.sides


def stage_of(params: ScanlineParams, site: Site) -> Stage:
    """Return a site as the tracker sees it.

    Raises
    ------
    ScenarioError : more or fewer targets than one, virtual blocks that are none, too many cameras, or one
        that is not level or in a wall
    """
    if params.virtual_occluders is not None and site.floor.people:
        message = "must be null, or world.people nobody: real and virtual occluders do not mix"
        found = f"got {site.floor.people} people"
        raise ScenarioError([Problem("system.virtual_occluders", f"{message}, {found}")])
    if len(site.targets) != 1:
        message = f"must be one, the object, where the system is scanline, got {len(site.targets)}"
        raise ScenarioError([Problem("world.targets", f"{message}; let the others be people")])
    (target,) = site.targets
    virtual = params.virtual_occluders
    height_m = float(target.start.position[2])
    size_m = site.floor.size_m[:2].astype(np.float64)
    blocks = _blocks(virtual, size_m)
    room = Room(np.zeros(2), size_m, (*footprints(site.floor.scenery, height_m), *blocks))
    problems = [
        Problem(f"cameras[{number}]", fault)
        for number, camera in enumerate(site.cameras.values())
        if (fault := _fault(camera, room, len(blocks))) is not None
    ]
    if problems:
        raise ScenarioError(problems)
    noise = MeasurementNoise(params.noise.position_sd_m, params.noise.angle_sd_rad, params.noise.read_sd_px)
    try:
        rig = Rig(_believed(params, site, noise), noise, room)
    except ValueError as error:
        raise ScenarioError([Problem("cameras", str(error).removeprefix("cameras: "))]) from error
    walk = params.walk
    return Stage(
        rig=rig,
        names=tuple(site.cameras),
        target=target.id,
        start=target.start.position[:2],
        height_m=height_m,
        target_radius_m=float(target.semi_axes_m[:2].max()),
        occluders=site.floor.people if virtual is None else virtual.count,
        radius_m=site.floor.person_radius_m if virtual is None else 0.5 * virtual.diameter_m,
        walk=WaypointWalk(
            room,
            walk.speed_mps / site.rate_hz,
            walk.noise_sd_m,
            walk.memory,
            walk.reached,
            walk.under_way,
        ),
    )


def _believed(params: ScanlineParams, site: Site, noise: MeasurementNoise) -> list[ScanCamera]:
    """Return the cameras where they are believed to be: real images come from where they really are."""
    pixels = isinstance(params.front_end, PixelFrontEnd)
    return _beside(site, noise) if pixels and params.front_end.pose_error == "bias" else _given(site)


def real_cameras(params: ScanlineParams, site: Site, noise: MeasurementNoise) -> list[ScanCamera]:
    """Return the cameras where they are: without images, those of the scenario are where they should be."""
    pixels = isinstance(params.front_end, PixelFrontEnd)
    return _given(site) if pixels or params.front_end.pose_error != "bias" else _beside(site, noise)


def _given(site: Site) -> list[ScanCamera]:
    return [scan_camera(camera) for camera in site.cameras.values()]


def _beside(site: Site, noise: MeasurementNoise) -> list[ScanCamera]:
    """Return the cameras of the scenario, each off by one draw of the noise."""
    return [
        displaced(camera, noise, site.streams.stream("scanline.pose", name))
        for name, camera in zip(site.cameras, _given(site), strict=True)
    ]


def _blocks(virtual: VirtualOccluders | None, size_m: FloatArray) -> tuple[FloatArray, ...]:
    """Return the blocks that only delete measurements, each a convex polygon (k, 2) [m].

    Raises
    ------
    ScenarioError : one that is not convex, or outside the room
    """
    blocks, problems = [], []
    for number, corners in enumerate(() if virtual is None else virtual.blocks_m):
        block = np.array(corners, dtype=np.float64).reshape(-1, 2)
        fault = ""
        if not is_convex(block):
            fault = "must be convex with an area and no straight corner; divide it or leave the corner out"
        elif (block.max(axis=0) <= 0.0).any() or (block.min(axis=0) >= size_m).any():
            fault = f"must reach into the room of {size_m.tolist()} m"
        if fault:
            must, _, hint = fault.partition("; ")
            said = f"{must}, got {block.tolist()} [m]" + (f"; {hint}" if hint else "")
            problems.append(Problem(f"system.virtual_occluders.blocks_m[{number}]", said))
        blocks.append(block)
    if problems:
        raise ScenarioError(problems)
    return tuple(blocks)


def scan_camera(camera: PinholeCamera) -> ScanCamera:
    """Return what a level camera is on the floor plan; its scan line is without the lens's distortion."""
    forward = camera.rotation[2]
    edge = np.array([[0.5 * camera.resolution_px[0] / camera.focal_px, 0.0]])
    half = atan(float(undistort(edge, camera.distortion)[0, 0]))
    x, y, _ = camera.position
    return ScanCamera((float(x), float(y)), atan2(forward[1], forward[0]), camera.focal_px, 2.0 * half)


def _fault(camera: PinholeCamera, room: Room, virtual: int) -> str | None:
    """Return why a camera cannot take part, where the last so many walls of a room are virtual."""
    pitch_deg = degrees(asin(float(np.clip(camera.rotation[2, 2], -1.0, 1.0))))
    roll_deg = degrees(asin(float(np.clip(camera.rotation[0, 2], -1.0, 1.0))))
    if max(abs(pitch_deg), abs(roll_deg)) > _MOST_TILT_DEG:
        return (
            f"must look level, within {_MOST_TILT_DEG:g}°, for a scan line to tell directions, got "
            f"a pitch of {pitch_deg:.1f}° and a roll of {roll_deg:.1f}°; "
            "let it look at a point of its own height"
        )
    place = camera.position[:2]
    real, number = len(room.walls) - virtual, int(room.wall_of(place[np.newaxis])[0])
    if number < 0:
        return None
    kind = "world.occluders" if number < real else f"virtual_occluders.blocks_m[{number - real}]"
    return f"must stand outside {kind}, seen from above, got {place.tolist()} [m]"


def anywhere_sds_m(room: Room) -> FloatArray:
    """Return the standard deviations (2,) of the place of who is anywhere in the room, along its sides [m].

    Walkers between uniform waypoints are at its middle more often than at its sides: .213 of a side, the
    paper's RMSE_max of 21.3 units on each axis, against .289 of a uniform distribution.
    """
    return np.asarray(0.213 * room.sides)
