"""What everybody knows of a deployment before a run: cameras, room, walls, and what occluders are like."""

from dataclasses import dataclass
from math import asin, atan, atan2, degrees

import numpy as np

from wsnsim.errors import Problem, ScenarioError
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.lens import undistort
from wsnsim.systems.base import Site
from wsnsim.systems.scanline.measurement import MeasurementNoise, ScanCamera
from wsnsim.systems.scanline.motion import WaypointWalk
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.regions import Rig, Room
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
    occluders : how many move about
    radius_m : of each [m]
    walk : how the object moves, a step a frame
    """

    rig: Rig
    names: tuple[NodeId, ...]
    target: str
    start: FloatArray
    height_m: float
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
    ScenarioError : more or fewer targets than one, too many cameras, or one that is not level or in a wall
    """
    problems = []
    if len(site.targets) != 1:
        message = f"must be one, the object, where the system is scanline, got {len(site.targets)}"
        raise ScenarioError([Problem("world.targets", f"{message}; let the others be people")])
    (target,) = site.targets
    virtual = params.virtual_occluders
    height_m = float(target.start.position[2])
    walls = [*footprints(site.floor.scenery, height_m)]
    if virtual is not None:
        walls += [np.array(block, dtype=np.float64) for block in virtual.blocks_m]
    try:
        room = Room(np.zeros(2), site.floor.size_m[:2].astype(np.float64), tuple(walls))
    except ValueError as error:
        raise ScenarioError([Problem("system.virtual_occluders.blocks_m", str(error))]) from error
    for name, camera in site.cameras.items():
        problem = _fault(camera, room)
        if problem is not None:
            problems.append(Problem(f"cameras[{name}]", problem))
    if problems:
        raise ScenarioError(problems)
    noise = MeasurementNoise(params.noise.position_sd_m, params.noise.angle_sd_rad, params.noise.read_sd_px)
    try:
        rig = Rig([scan_camera(camera) for camera in site.cameras.values()], noise, room)
    except ValueError as error:
        raise ScenarioError([Problem("cameras", str(error))]) from error
    walk = params.walk
    return Stage(
        rig=rig,
        names=tuple(site.cameras),
        target=target.id,
        start=target.start.position[:2],
        height_m=height_m,
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


def scan_camera(camera: PinholeCamera) -> ScanCamera:
    """Return what a level camera is on the floor plan; its scan line is without the lens's distortion."""
    forward = camera.rotation[2]
    edge = np.array([[0.5 * camera.resolution_px[0] / camera.focal_px, 0.0]])
    half = atan(float(undistort(edge, camera.distortion)[0, 0]))
    x, y, _ = camera.position
    return ScanCamera((float(x), float(y)), atan2(forward[1], forward[0]), camera.focal_px, 2.0 * half)


def _fault(camera: PinholeCamera, room: Room) -> str | None:
    """Return why a camera cannot take part."""
    pitch_deg = degrees(asin(float(np.clip(camera.rotation[2, 2], -1.0, 1.0))))
    roll_deg = degrees(asin(float(np.clip(camera.rotation[0, 2], -1.0, 1.0))))
    if max(abs(pitch_deg), abs(roll_deg)) > _MOST_TILT_DEG:
        return (
            f"must look level, within {_MOST_TILT_DEG:g}°, for a scan line to tell directions, got "
            f"a pitch of {pitch_deg:.1f}° and a roll of {roll_deg:.1f}°; "
            "let it look at a point of its own height"
        )
    place = camera.position[:2]
    planes, starts = room.half_planes
    for number in range(len(starts) - 1):
        rows = planes[starts[number] : starts[number + 1]]
        if (rows[:, :2] @ place - rows[:, 2]).max() < 0.0:
            return f"must stand outside the static occluders, got {place.tolist()} inside number {number}"
    return None


def largest_sd_m(room: Room) -> float:
    """Return the standard deviation on each axis of who is anywhere in the room, a little less at its sides.

    Walkers between uniform waypoints are at its middle more often than at its sides: .213 of a side in the
    paper's room, against .289 of a uniform distribution.
    """
    return 0.213 * float(np.sqrt(np.prod(room.sides)))
