"""The paper's simulation at the level of measurements: a crowd, cameras, a tracker, and its errors."""

from dataclasses import dataclass

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.geometry.polygons import half_planes
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.sightlines import disc_masks
from wsnsim.rng import RandomStreams
from wsnsim.systems.scanline.baselines import Baseline
from wsnsim.systems.scanline.filter import FilterParams, Tracker
from wsnsim.systems.scanline.hull import visual_hull, without_own, without_phantoms, without_small
from wsnsim.systems.scanline.measurement import MeasurementNoise, ScanCamera, measure, report
from wsnsim.systems.scanline.motion import WaypointWalk
from wsnsim.systems.scanline.occlusion import KnownPlaces, NoKnowledge, NormalPriors, ScanLines, UniformPriors
from wsnsim.systems.scanline.priors import VirtualSensor, stationary
from wsnsim.systems.scanline.regions import Rig, Room
from wsnsim.world.crowd import Crowd

SIDE = 100.0
BLOCK = np.array([[30.0, 40.0], [70.0, 40.0], [70.0, 60.0], [30.0, 60.0]])
"""40 × 20 in the middle."""
PLACES = [(50, 0), (100, 0), (100, 50), (100, 100), (50, 100), (0, 100), (0, 50), (0, 0)]
"""Wall middles and corners in turn."""
CHOSEN = {
    2: (0, 2),
    3: (0, 3, 5),
    4: (0, 2, 4, 6),
    5: (0, 2, 3, 5, 6),
    6: (0, 1, 3, 4, 5, 7),
    7: range(7),
    8: range(8),
}
"""Roughly evenly spaced; two look at right angles."""


def rig(cameras=4, block=False, focal_px=320.0, fov_deg=90.0):
    """Return the paper's square room with 2 to 8 cameras at its sides."""
    chosen = []
    for k in CHOSEN[cameras]:
        x, y = PLACES[k]
        chosen.append(
            ScanCamera((float(x), float(y)), float(np.arctan2(50 - y, 50 - x)), focal_px, np.radians(fov_deg))
        )
    room = Room(np.zeros(2), np.full(2, SIDE), (BLOCK,) if block else ())
    return Rig(chosen, MeasurementNoise(), room)


DEFAULT = FilterParams()


@dataclass(frozen=True)
class Setup:
    cameras: int = 4
    occluders: int = 40
    block: bool = False
    prior: str = "none"
    steps: int = 4000
    seed: int = 0
    diameter: float = 3.33
    sensor_sd: float = 8.0
    q: float = 1.2
    params: FilterParams = DEFAULT
    noise_sd: float = 0.4
    memory: float = 0.3
    joint: str = "subsets"
    exponent: float = 0.25
    wide: bool = False
    margin_px: float = 7.0


@dataclass(frozen=True)
class Outcome:
    rmse: float
    rmse_axis: float
    rmse_occluders: float
    replaced: int
    hull_share: float
    blind: float
    pieces: float = np.nan
    phantom_share: float = np.nan
    missed_share: float = np.nan


def frames(setup):
    """Yield truth (2,), occluders (k, 2) and z (n,) of each step; the same for all priors."""
    stage = rig(setup.cameras, setup.block)
    streams = RandomStreams(setup.seed)
    crowd = Crowd(
        setup.occluders + 1,
        setup.diameter,
        stage.room.low,
        stage.room.high,
        1.0,
        0.33,
        1.0,
        stage.room.walls,
    )
    paths = crowd.paths(streams.stream("crowd"), setup.steps)
    generator = streams.stream("camera")
    for places in paths[1:]:
        truth, occluders = places[0], places[1:]
        allowed = stage.masks(truth[None])[0]
        hidden = disc_masks(
            frozen(truth[None], np.float64), stage.rows, frozen(occluders, np.float64), setup.diameter / 2
        )
        visible = allowed & ~hidden[0]
        z = np.array([measure(c, truth, stage.noise, generator) for c in stage.cameras])
        for k in range(len(z)):
            if not visible >> k & 1:
                z[k] = np.nan
        yield truth, occluders, z


def scan_line(camera, occluders, radius, noise, generator):
    """Return the blobs (b, 2) of one scan line, merged where they overlap."""
    c, s = np.cos(camera.heading_rad), np.sin(camera.heading_rad)
    way = occluders - np.asarray(camera.position)
    d, h = way @ [c, s], way @ [-s, c]
    # one error of the pose for the whole frame
    turn = generator.normal(0.0, noise.angle_sd_rad)
    shift = generator.normal(0.0, noise.position_sd_m, 2)
    d, h = d - shift[0], h - shift[1]
    d, h = d + turn * h, h - turn * d
    distance = np.hypot(d, h)
    half = np.arcsin(np.minimum(radius / np.maximum(distance, radius), 1.0))
    angle = np.arctan2(h, d)
    edge = camera.fov_rad / 2
    low, high = np.maximum(angle - half, -edge), np.minimum(angle + half, edge)
    keep = low < high
    merged = []
    for a, b in sorted(zip(low[keep], high[keep], strict=True)):
        if merged and a <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], b)
        else:
            merged.append([a, b])
    ends = camera.focal_px * np.tan(np.array(merged).reshape(-1, 2))
    return np.sort(ends + generator.normal(0.0, noise.read_sd_px, ends.shape), axis=1)


class Source:
    """What the cluster head learns of the occluders, step by step."""

    def __init__(self, setup, stage, generator):
        self.setup, self.stage, self.generator = setup, stage, generator
        self.radius = setup.diameter / 2
        self.sensor, self.tracks = VirtualSensor(setup.sensor_sd, setup.q), None
        self.squares, self.shares, self.counts = [], [], []

    def known(self, truth, occluders, z):
        return getattr(self, self.setup.prior)(truth, occluders, z)

    def none(self, truth, occluders, z):
        return NoKnowledge()

    def perfect(self, truth, occluders, z):
        return KnownPlaces(occluders, self.radius)

    def stationary(self, truth, occluders, z):
        return NormalPriors(*stationary(len(occluders), self.stage.room.centre, 21.3), self.radius)

    def kalman(self, truth, occluders, z):
        if self.tracks is None:
            self.tracks = self.sensor.start(self.generator, occluders)
        else:
            self.tracks = self.sensor.step(self.generator, self.tracks, occluders)
        self.squares.append(((self.tracks.places - occluders) ** 2).sum(axis=1).mean())
        return NormalPriors(
            self.tracks.places,
            self.tracks.covs,
            self.radius,
            self.setup.joint,
            exponent=self.setup.exponent,
        )

    def scanlines(self, truth, occluders, z):
        return ScanLines(self.blobs(occluders), self.radius if self.setup.wide else 0.0)

    def hull(self, truth, occluders, z):
        return NormalPriors(*self.pieces(truth, occluders, z).priors(), self.radius)

    def polygons(self, truth, occluders, z):
        return UniformPriors(self.pieces(truth, occluders, z).polygons, self.radius)

    def blobs(self, bodies):
        return [
            scan_line(c, bodies, self.radius, self.stage.noise, self.generator) for c in self.stage.cameras
        ]

    def pieces(self, truth, occluders, z):
        """Return the hull without what is too small, the object's own piece and phantoms."""
        blobs, heard = self.blobs(np.vstack([occluders, truth])), report(z)
        hull = visual_hull(self.stage, blobs, heard.heard, self.setup.margin_px)
        hull = without_small(hull, 0.8 * self.setup.diameter)
        self.shares.append(hull.area_m2 / np.prod(self.stage.room.sides))
        hull = without_phantoms(without_own(hull, self.stage, heard, 10.0), self.stage, blobs)
        self.counts.append(counts(hull, occluders))
        return hull


def counts(hull, occluders):
    """Return how many pieces there are, how many with no occluder's middle, and how many middles in none."""
    inside = np.array([within(polygon, occluders) for polygon in hull.polygons]).reshape(-1, len(occluders))
    return len(inside), (~inside.any(axis=1)).sum(), (~inside.any(axis=0)).sum()


def within(polygon, points):
    """Tell which points (m, 2) are in a convex polygon (k, 2)."""
    planes, _ = half_planes((polygon,))
    return (points @ planes[:, :2].T <= planes[:, 2]).all(axis=1)


def run(setup):
    """Return the tracker's errors over one run."""
    stage = rig(setup.cameras, setup.block)
    streams = RandomStreams(setup.seed)
    generator = streams.stream("particles")
    source = Source(setup, stage, streams.stream("occluder-sensor"))
    walk = WaypointWalk(stage.room, noise_sd=setup.noise_sd, memory=setup.memory)
    tracker = Tracker(stage, walk, setup.params)
    state = tracker.start(generator)
    squares, replaced, blind = [], 0, 0
    for truth, occluders, z in frames(setup):
        state = tracker.step(generator, state, report(z), source.known(truth, occluders, z))
        replaced += state.replaced
        blind += np.isnan(z).all()
        squares.append((state.mean - truth) ** 2)
    squares = np.array(squares)
    pieces, phantoms, missed = np.sum(source.counts, axis=0) if source.counts else (np.nan,) * 3
    return Outcome(
        float(np.sqrt(squares.sum(axis=1).mean())),
        float(np.sqrt(squares.mean())),
        float(np.sqrt(np.mean(source.squares))) if source.squares else np.nan,
        replaced,
        float(np.mean(source.shares)) if source.shares else np.nan,
        float(blind / setup.steps),
        float(pieces / setup.steps),
        float(phantoms / pieces),
        float(missed / (setup.steps * setup.occluders)) if setup.occluders else np.nan,
    )


def run_baseline(setup, kind, acceleration_sd=0.5):
    """Return the errors of one of the trackers of Sec. 4, which start where the object is."""
    stage = rig(setup.cameras, setup.block)
    baseline = Baseline(stage, acceleration_sd)
    step, belief, squares = getattr(baseline, kind), None, []
    for truth, _, z in frames(setup):
        if belief is None:
            belief = Gaussian(np.concatenate([truth, np.zeros(2)]), np.eye(4))
        belief = step(belief, report(z))
        squares.append((belief.mean[:2] - truth) ** 2)
    squares = np.array(squares)
    return float(np.sqrt(squares.sum(axis=1).mean()))
