"""How well occluders and object are known without a look at the object, in units of each room.

RMSE_occ is the error of the cluster head's own filters beside the true crowd, with every report heard;
RMSE_max that of who takes everybody to be in the room's centre.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from wsnsim.claims.results import StudyFile
from wsnsim.claims.scanline.evidence import Known, Rooms
from wsnsim.claims.scanline.studies import (
    CAMERA_STUDY,
    KALMAN,
    LAB_STUDY,
    PRIOR_STUDY,
    SDS,
    params_of,
    runs_of,
)
from wsnsim.sim.build import build
from wsnsim.sweeps.study import PlannedRun
from wsnsim.systems.scanline.choices import PerfectPriors
from wsnsim.systems.scanline.occlusion import NormalPriors
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.sensor import make_sensors
from wsnsim.systems.scanline.sources import Heard, source_for
from wsnsim.systems.scanline.stage import stage_of
from wsnsim.types import FloatArray

_RUNS, _FRAMES = 3, 1000
"""The first seeds, and frames of them: some twenty occluders or more, whose errors forget within ten frames,
tell the error to 1 %. The object's way is looked at to its end."""


def measured_rooms() -> Rooms:
    """Return what is known in the rooms of the studies."""
    return Rooms(
        block=known_in(CAMERA_STUDY, {KALMAN: f"N2-{KALMAN}"}),
        open=known_in(PRIOR_STUDY, {f"{KALMAN}-{sd}": f"{KALMAN}-{sd}" for sd in SDS}),
        lab=known_in(LAB_STUDY, {KALMAN: f"N2-{KALMAN}"}),
    )


def known_in(study: StudyFile, cells: Mapping[str, str], runs: int = _RUNS, frames: int = _FRAMES) -> Known:
    """Return what is known in a study's room.

    Parameters
    ----------
    study : whose runs of one seed have the same crowd
    cells : with Kalman filters, by kind of priors
    runs : the first seeds of each cell
    frames : at which the occluders are looked at
    """
    filters: dict[str, list[float]] = {prior: [] for prior in cells}
    occluders, target = [], []
    for number in range(runs):
        rooms = {prior: _Room(runs_of(study, cell)[number], frames) for prior, cell in cells.items()}
        first = next(iter(rooms.values()))
        places = first.occluders()
        for prior, room in rooms.items():
            filters[prior].append(_rms(room.believed() - places))
        occluders.append(_rms(places - first.centre))
        target.append(_rms(first.target() - first.centre))
    return Known(
        {prior: float(np.mean(errors)) for prior, errors in filters.items()},
        float(np.mean(occluders)),
        float(np.mean(target)),
    )


class _Room:
    """A run's crowd and object, frame by frame [unit].

    Parameters
    ----------
    run : its priors are Kalman filters
    frames : at which the occluders are looked at
    """

    def __init__(self, run: PlannedRun, frames: int) -> None:
        simulation = build(run.loaded)
        self._world, self._site = simulation.world, simulation.site
        self._params = params_of(run)
        self._times = [step / self._site.rate_hz for step in range(1, simulation.schedule.steps + 1)]
        self._frames = frames
        self.centre = 0.5 * self._site.floor.size_m[:2] / self._params.unit_m

    def target(self) -> FloatArray:
        """Return the object's places (steps, 2), to the end of the run."""
        places = [self._world.at(time)[0].position[:2] for time in self._times]
        return np.array(places) / self._params.unit_m

    def occluders(self) -> FloatArray:
        """Return the occluders' places (frames, k, 2)."""
        exact = self._params.model_copy(update={"priors": PerfectPriors(kind="perfect")})
        frames = [[heard.places[k] for k in sorted(heard.places)] for heard in self._heard(exact)]
        return np.array(frames) / self._params.unit_m

    def believed(self) -> FloatArray:
        """Return where the head's filters take the occluders to be, (frames, k, 2)."""
        stage = stage_of(self._params, self._site)
        source = source_for(self._params, stage, self._site.rate_hz)
        means = []
        for heard in self._heard(self._params):
            knowledge, _ = source.knowledge(heard, heard.report(len(stage.names)))
            assert isinstance(knowledge, NormalPriors)
            means.append(knowledge.means)
        return np.array(means) / self._params.unit_m

    def _heard(self, params: ScanlineParams) -> Iterator[Heard]:
        """Yield what all motes together say of the occluders at each frame."""
        sensors = make_sensors(params, self._site, self._world).values()
        for step, time in enumerate(self._times[: self._frames], start=1):
            heard = Heard()
            for sensor in sensors:
                said = sensor.measured(step, time).occluders
                heard = heard.with_places(said.ids, said.places)
            yield heard


def _rms(errors: FloatArray) -> float:
    """Return the root mean square length of vectors (..., 2)."""
    return float(np.sqrt((errors**2).sum(axis=-1).mean()))
