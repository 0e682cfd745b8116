"""Motions of targets and people from their sections of a scenario."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from wsnsim.rng import RandomStreams
from wsnsim.scenario import schema_motion
from wsnsim.scenario.faults import KeyPath, one_of, quoted
from wsnsim.scenario.load import LoadedScenario
from wsnsim.types import BoolArray, FloatArray
from wsnsim.world.bodies import Body
from wsnsim.world.motion import ConstantVelocity, Motion, Spinning, TimedPath, Waypoints, jittered
from wsnsim.world.random_motion import Area, gauss_markov, random_waypoint
from wsnsim.world.recorded import read_track_csv
from wsnsim.world.track_tables import TrackTable, read_homography, read_motchallenge, read_obsmat
from wsnsim.world.track_text import content_rows

_NAMES = {"obsmat.txt": "obsmat", "gt.txt": "motchallenge", "det.txt": "motchallenge"}
"""Names that the files of these data sets have always."""
_TABLES = {"obsmat": read_obsmat, "motchallenge": read_motchallenge}
_SHOWN_IDS = 6


class MotionBuilder:
    """Makes motions of one body alone; a file of many tracks is read once.

    Parameters
    ----------
    loaded : the scenario
    streams : the run's randomness
    is_clear : tells which of the places (n, 3) are outside the occluders, (n,)
    """

    def __init__(
        self, loaded: LoadedScenario, streams: RandomStreams, is_clear: Callable[[FloatArray], BoolArray]
    ) -> None:
        self._loaded = loaded
        self._streams = streams
        self._is_clear = is_clear
        self._tables: dict[tuple[str, str], TrackTable] = {}

    def motion(self, path: KeyPath, name: str, body: Body, motion: schema_motion.OwnMotion) -> Motion:
        """Return the motion of a body.

        Parameters
        ----------
        path : of the motion's section
        name : of who moves; each has randomness of its own
        body : that moves
        motion : the section

        Raises
        ------
        ScenarioError : a file cannot be read or has no such track, or an area is of no use
        """
        made = self._without_spin(path, name, body, motion)
        spin = motion.spin
        return made if spin.rate_radps == 0.0 else Spinning(made, np.array(spin.axis), spin.rate_radps)

    def _without_spin(self, path: KeyPath, name: str, body: Body, motion: schema_motion.OwnMotion) -> Motion:
        orientation = np.array(motion.orientation)
        if isinstance(motion, schema_motion.Recorded):
            return self._recorded(path, motion)
        if isinstance(motion, schema_motion.ConstantVelocity):
            return ConstantVelocity(np.array(motion.start_m), np.array(motion.velocity_mps), orientation)
        if isinstance(motion, schema_motion.Waypoints):
            generator = self._streams.stream("motion", name)
            points = jittered(np.array(motion.points_m), generator, motion.jitter_m)
            return Waypoints(points, motion.speed_mps, orientation)
        area = self._area(path, body, motion)
        generator = self._streams.stream(motion.kind, name)
        until_s = self._loaded.scenario.duration_s
        key = "area_m"
        try:
            start = self._start(path, area, motion, generator)
            if isinstance(motion, schema_motion.RandomWaypoint):
                return random_waypoint(
                    generator, area, start, motion.speed_mps, motion.pause_s, until_s, orientation
                )
            key = "interval_s"
            return gauss_markov(
                generator,
                area,
                start,
                _mean_velocity(motion, generator),
                np.array(motion.sd_mps),
                motion.memory,
                motion.interval_s,
                until_s,
                orientation,
            )
        except ValueError as error:
            raise self._loaded.error((*path, key), str(error)) from error

    def _area(
        self, path: KeyPath, body: Body, motion: schema_motion.RandomWaypoint | schema_motion.GaussMarkov
    ) -> Area:
        world = self._loaded.scenario.true_world
        size = np.array(world.size_m)
        place = (*path, "area_m")
        if motion.area_m is None:
            half = body.semi_axes_m
            margin = float(half[:2].max())
            low = np.array([margin, margin, half[2]])
            high = np.array([size[0] - margin, size[1] - margin, half[2]])
            if (low > high).any() or half[2] > size[2]:
                message = f"must be given: the body does not fit into the world's size_m {list(world.size_m)}"
                raise self._loaded.error(place, message)
            return Area(low, high)
        corners = np.array(motion.area_m)
        area = Area(corners.min(axis=0), corners.max(axis=0))
        if world.leaving == "error" and ((area.low < 0.0) | (area.high > size)).any():
            message = f"must lie inside the world's size_m {list(world.size_m)}, got {corners.tolist()}"
            raise self._loaded.error(place, f"{message}; or set world.leaving: allow")
        return area

    def _start(
        self,
        path: KeyPath,
        area: Area,
        motion: schema_motion.RandomWaypoint | schema_motion.GaussMarkov,
        generator: np.random.Generator,
    ) -> FloatArray:
        if motion.start_m is None:
            return area.draw_clear(generator, self._is_clear)
        start = np.array(motion.start_m)
        if ((start < area.low) | (start > area.high)).any():
            bounds = f"{area.low.tolist()} to {area.high.tolist()}"
            message = f"must lie in the area, {bounds}, got {start.tolist()} [m]"
            raise self._loaded.error((*path, "start_m"), message)
        return start

    def _recorded(self, path: KeyPath, motion: schema_motion.Recorded) -> TimedPath:
        kind = self._format(path, motion)
        if kind == "csv":
            track = read_track_csv(
                Path(motion.file),
                scale=motion.scale,
                offset_m=np.array(motion.offset_m),
                height_m=motion.height_m,
                orientation=np.array(motion.orientation),
            )
        else:
            track = self._from_table(path, motion, kind)
        begin, end = float(track.times[0]), float(track.times[-1])
        start = begin if motion.start_s is None else motion.start_s
        runs = f"the track runs from {begin:g} to {end:g} s"
        if motion.start_s is not None and end <= start:
            message = f"must be before the end of the track at {end:g} s, got {start:g} s"
            raise self._loaded.error((*path, "start_s"), message)
        if begin - start >= self._loaded.scenario.duration_s:
            last = start + self._loaded.scenario.duration_s
            message = f"must be later, or null: {runs}, and the run ends at {last:g} s of it, got {start:g} s"
            raise self._loaded.error((*path, "start_s"), message)
        return replace(track, times=track.times - start)

    def _format(self, path: KeyPath, motion: schema_motion.Recorded) -> str:
        """Return the format of a file; keys that it has no use for are refused."""
        file = Path(motion.file)
        kind = motion.format or ("csv" if file.suffix.lower() == ".csv" else _NAMES.get(file.name.lower()))
        if kind is None:
            header = next(content_rows(file), None)
            if header is None or "time_s" not in header.fields:
                kinds = one_of(["csv", "obsmat", "motchallenge"])
                message = f"must be given: {kinds}; neither name nor header of {quoted(file.name)} tells"
                raise self._loaded.error((*path, "format"), message)
            kind = "csv"
        unused = {"csv": ("track_id", "frame_rate_hz", "homography"), "obsmat": ("homography",)}
        for key in unused.get(kind, ()):
            if getattr(motion, key) is not None:
                message = f"must be left out: the format {kind} has no use for it"
                raise self._loaded.error((*path, key), message)
        return kind

    def _from_table(self, path: KeyPath, motion: schema_motion.Recorded, kind: str) -> TimedPath:
        file = Path(motion.file)
        if (motion.file, kind) not in self._tables:
            self._tables[motion.file, kind] = _TABLES[kind](file)
        table = self._tables[motion.file, kind]
        if motion.frame_rate_hz is None:
            message = f"must be given: the images a second of {quoted(file.name)}, which numbers its images"
            raise self._loaded.error((*path, "frame_rate_hz"), message)
        known = table.known_ids
        track_id = known[0] if motion.track_id is None and len(known) == 1 else motion.track_id
        if track_id is None or track_id not in known:
            must = f"must be one of the {len(known)} tracks of {quoted(file.name)} ({_some(known, track_id)})"
            got = "nothing (null)" if track_id is None else f"{track_id}"
            raise self._loaded.error((*path, "track_id"), f"{must}, got {got}")
        line = table.line_without_place(track_id)
        if line is not None and motion.homography is None:
            message = (
                f"must be given: line {line} of {quoted(file.name)} has no place (x, y, z are -1 or missing)"
                "; name a file with the 3 × 3 matrix that takes its image (u, v, 1) to the floor (x, y, 1)"
            )
            raise self._loaded.error((*path, "homography"), message)
        matrix = (
            None if line is None or motion.homography is None else read_homography(Path(motion.homography))
        )
        frames, places = table.track(track_id, matrix)
        points = motion.scale * places + np.array(motion.offset_m) + np.array([0.0, 0.0, motion.height_m])
        return TimedPath(frames / motion.frame_rate_hz, points, np.array([motion.orientation]))


def _mean_velocity(motion: schema_motion.GaussMarkov, generator: np.random.Generator) -> FloatArray:
    drawn = generator.uniform(0.0, 2.0 * np.pi)
    heading = drawn if motion.heading_deg is None else np.radians(motion.heading_deg)
    return motion.mean_speed_mps * np.array([np.cos(heading), np.sin(heading), 0.0])


def _some(known: tuple[int, ...], wanted: int | None) -> str:
    """Write a few ids, those next to the one that was wanted."""
    near = known if wanted is None else sorted(known, key=lambda each: abs(each - wanted))
    shown = sorted(near[:_SHOWN_IDS])
    return ", ".join(str(each) for each in shown) + (", ..." if len(known) > _SHOWN_IDS else "")
