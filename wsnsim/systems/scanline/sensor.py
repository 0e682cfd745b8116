"""What cameras measure without pixels (Ercan et al. 2007, Eqs. 1, 2), and what a further sensor says.

The object is a point, the occluders are cylinders, walls are convex polygons: who hides it is decided on the
floor plan. Where a prior needs it, the mote nearest to an occluder measures that occluder's place: a
virtual sensor, as of sound, that knows who is who.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from wsnsim.errors import Problem, ScenarioError
from wsnsim.geometry.rotations import IDENTITY
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.sightlines import disc_masks
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Sensor, Site
from wsnsim.systems.scanline.choices import KalmanPriors, MeasurementFrontEnd, VirtualOccluders
from wsnsim.systems.scanline.lines import LineOfSight
from wsnsim.systems.scanline.measurement import displaced, measure
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.reading import Measured, OccluderPlaces, Reading
from wsnsim.systems.scanline.regions import Rig
from wsnsim.systems.scanline.stage import Stage, real_cameras, stage_of
from wsnsim.types import FloatArray, NodeId, Seconds
from wsnsim.world.crowd import Crowd
from wsnsim.world.motion import TimedPath, interpolate
from wsnsim.world.world import World

Occluders = Callable[[Seconds], FloatArray]
"""Gives the occluders' places (k, 2) at an instant [m]."""


class Truth:
    """Where object and occluders are; asked once an instant, however many cameras look.

    Parameters
    ----------
    stage : the deployment as it is believed to be
    rig : the cameras where they really are
    world : what is true
    occluders : who may hide the object
    """

    def __init__(self, stage: Stage, rig: Rig, world: World, occluders: Occluders) -> None:
        self.stage = stage
        self.rig = rig
        self._world = world
        self._occluders = occluders
        self._time: Seconds | None = None
        self.place = stage.start
        """The object (2,) [m]."""
        self.occluders: FloatArray = np.empty((0, 2))
        """(k, 2) [m]"""
        self.visible = 0
        """Cameras that nothing keeps from seeing the object, as a bit mask."""
        self.nearest = np.empty(0, dtype=np.int64)
        """Number of the camera nearest to each occluder (k,)."""

    def at(self, time: Seconds) -> "Truth":
        """Return the truth of an instant [s]."""
        if time != self._time:
            self._time = time
            self._look(time)
        return self

    def _look(self, time: Seconds) -> None:
        rig = self.rig
        (pose,) = self._world.at(time)
        self.place, self.occluders = pose.position[:2], self._occluders(time)
        point = frozen(self.place[np.newaxis], np.float64)
        centres = frozen(self.occluders, np.float64)
        (hidden,) = disc_masks(point, rig.rows, centres, self.stage.radius_m)
        (allowed,) = rig.masks(point)
        self.visible = int(allowed & ~hidden)
        ways = centres[:, np.newaxis] - rig.rows[np.newaxis, :, :2]
        self.nearest = np.hypot(ways[..., 0], ways[..., 1]).argmin(axis=1)


class ScanSensor:
    """Measures for one camera's mote.

    Parameters
    ----------
    params : of the system
    truth : shared by all cameras
    number : of the camera
    streams : the run's randomness
    """

    def __init__(self, params: ScanlineParams, truth: Truth, number: int, streams: RandomStreams) -> None:
        stage = truth.stage
        self._params = params
        self._truth = truth
        self._number = number
        self._streams = streams
        self._camera = stage.rig.cameras[number]
        self._name = stage.names[number]
        self._line = LineOfSight(self._camera, stage.rig.room)
        front_end = params.front_end
        self._white = not (isinstance(front_end, MeasurementFrontEnd) and front_end.pose_error == "bias")
        self._real = truth.rig.cameras[number]

    def measured(self, step: int, time: Seconds) -> Measured:
        """Return what the mote measures at an instant [s]."""
        truth = self._truth.at(time)
        visible = bool(truth.visible >> self._number & 1)
        generator = self._streams.stream("scanline.camera", self._name, step)
        value = self._value(truth.place, generator)
        recognised = visible and generator.uniform() < self._params.detected
        blobs = self._blobs(truth, visible, step) if self._params.says_lines else np.empty((0, 2))
        return Measured(
            Reading(value if recognised else np.nan, blobs),
            self._places(truth, step) if self._params.measures_occluders else None,
            not visible,
        )

    def in_view(self, time: Seconds) -> tuple[str, ...]:
        """Return the object's name where nothing hides it from the camera."""
        visible = self._truth.at(time).visible >> self._number & 1
        return (self._truth.stage.target,) if visible else ()

    def _value(self, place: FloatArray, generator: np.random.Generator) -> float:
        """Return z, drawn whether or not it is used: which draws belong to which step hangs on nothing."""
        noise = self._truth.stage.rig.noise
        return float(measure(self._real, place, noise, generator, white_pose=self._white))

    def _blobs(self, truth: Truth, visible: bool, step: int) -> FloatArray:
        noise, generator = truth.stage.rig.noise, self._streams.stream("scanline.line", self._name, step)
        real = displaced(self._camera, noise, generator) if self._white else self._real
        bodies, radii = truth.occluders, np.full(len(truth.occluders), truth.stage.radius_m)
        if visible:
            bodies = np.vstack([bodies, truth.place[np.newaxis]])
            radii = np.append(radii, truth.stage.target_radius_m)
        blobs = self._line.blobs(real, bodies, radii)
        edge = self._camera.half_width_px
        noisy = blobs + generator.normal(0.0, noise.read_sd_px, blobs.shape)
        # an end that leaves the image is told as the image's
        noisy = np.where(np.abs(blobs) >= edge, blobs, np.clip(noisy, -edge, edge))
        return np.sort(noisy, axis=None).reshape(-1, 2)

    def _places(self, truth: Truth, step: int) -> OccluderPlaces:
        own = np.flatnonzero(truth.nearest == self._number)
        places = truth.occluders[own]
        priors = self._params.priors
        if isinstance(priors, KalmanPriors):
            generator = self._streams.stream("scanline.occluder_sensor", step)
            errors = generator.normal(0.0, priors.sensor_sd_m, (len(truth.occluders), 2))
            places = places + errors[own]
        return OccluderPlaces(own, places)


def make_sensors(params: ScanlineParams, site: Site, world: World) -> Mapping[NodeId, Sensor]:
    """Return the sensors of all cameras' motes.

    Raises
    ------
    ScenarioError : virtual occluders that have no room, or an object that walks through virtual blocks
    """
    stage = stage_of(params, site)
    virtual = params.virtual_occluders
    occluders = people_places(world) if virtual is None else _virtual(virtual, stage, site)
    if virtual is not None:
        _keep_out(len(virtual.blocks_m), stage, site, world)
    rig = replace(stage.rig, cameras=real_cameras(params, site, stage.rig.noise))
    truth = Truth(stage, rig, world, occluders)
    return {name: ScanSensor(params, truth, number, site.streams) for number, name in enumerate(stage.names)}


def people_places(world: World) -> Occluders:
    """Return what gives the people's places (k, 2) at an instant [m]."""
    paths = [person.motion for person in world.people]
    first = paths[0] if paths else None
    if isinstance(first, TimedPath) and all(
        isinstance(path, TimedPath) and path.times is first.times for path in paths
    ):
        # a crowd reaches its places at the same times: one look for all of it
        points = np.stack([path.points[:, :2] for path in paths if isinstance(path, TimedPath)], axis=1)
        return lambda time: interpolate(first.times, points, time, IDENTITY).position

    def places(time: Seconds) -> FloatArray:
        return np.array([path.at(time).position[:2] for path in paths]).reshape(-1, 2)

    return places


def _keep_out(blocks: int, stage: Stage, site: Site, world: World) -> None:
    """Make sure that the object keeps out of virtual blocks, which nothing in its world keeps it out of.

    Raises
    ------
    ScenarioError : it does not
    """
    room, times = stage.rig.room, np.arange(site.steps + 1) / site.rate_hz
    places = np.array([world.at(float(time))[0].position[:2] for time in times])
    numbers = room.wall_of(places) - (len(room.walls) - blocks)
    (inside,) = np.nonzero(numbers >= 0)
    if not len(inside):
        return
    first = inside[0]
    place = ", ".join(f"{each:.6g}" for each in places[first])
    raise ScenarioError(
        [
            Problem(
                f"system.virtual_occluders.blocks_m[{numbers[first]}]",
                f"must not be where the object walks, which is at [{place}] m after {times[first]:.6g} s; "
                "move the block, or the object's path",
            )
        ]
    )


def _virtual(virtual: VirtualOccluders, stage: Stage, site: Site) -> Occluders:
    """Return a crowd that walks in no image."""
    if virtual.count == 0:
        return lambda time: np.empty((0, 2))
    room, step_s = stage.rig.room, 1.0 / site.rate_hz
    try:
        crowd = Crowd(
            virtual.count,
            virtual.diameter_m,
            room.low,
            room.high,
            virtual.speed_mps,
            virtual.noise_sd_m,
            step_s,
            room.walls,
        )
        paths = crowd.paths(site.streams.stream("scanline.virtual_occluders"), site.steps)
    except ValueError as error:
        raise ScenarioError([Problem("system.virtual_occluders", str(error))]) from error
    return lambda time: paths[min(round(time * site.rate_hz), site.steps)]
