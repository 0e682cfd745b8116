"""How well a prior knows the occluders (RMSE_occ): the head's own filters beside the true crowd."""

from pathlib import Path

import numpy as np

from wsnsim.claims.results import StudyFile
from wsnsim.claims.scanline.evidence import KALMAN, NONE, SDS, UNIT_M, Occluders
from wsnsim.scenario.load import LoadedScenario
from wsnsim.sim.build import build
from wsnsim.sweeps.study import PlannedRun, load_study
from wsnsim.systems.scanline.choices import KalmanPriors
from wsnsim.systems.scanline.occlusion import NormalPriors
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.sources import Heard, source_for
from wsnsim.systems.scanline.stage import stage_of
from wsnsim.types import FloatArray

_STEPS = 1000
"""Of the first seed: forty occluders, whose errors forget within some ten steps, tell the error to 1 %."""
_ROOT = Path(__file__).parents[3]


def measured_occluders(study: StudyFile, root: Path = _ROOT) -> Occluders:
    """Return the errors of the filters of a study's priors, with every report heard.

    Parameters
    ----------
    study : that of Fig. 10
    root : of the project
    """
    runs = load_study(root / study.file).runs
    first = {run.cell.name: run for run in reversed(runs)}
    known = {sd: filter_rmse(_scenario(first[f"{KALMAN}-{sd}"])) / UNIT_M for sd in SDS}
    return Occluders(known, unknown_rmse(_scenario(first[NONE])) / UNIT_M)


def _scenario(run: PlannedRun) -> LoadedScenario:
    return run.loaded


def crowd_paths(loaded: LoadedScenario, steps: int = _STEPS) -> FloatArray:
    """Return the true places (steps, k, 2) of the occluders at the first frames [m]."""
    world, rate_hz = build(loaded).world, loaded.scenario.cameras[0].rate_hz
    return np.array(
        [
            [person.motion.at(step / rate_hz).position[:2] for person in world.people]
            for step in range(1, steps + 1)
        ]
    )


def filter_rmse(loaded: LoadedScenario, steps: int = _STEPS) -> float:
    """Return the error of a scenario's Kalman filters of its occluders, over both axes [m]."""
    site, params = build(loaded).site, loaded.system_params
    assert isinstance(params, ScanlineParams)
    assert isinstance(params.priors, KalmanPriors)
    stage = stage_of(params, site)
    source = source_for(params, stage, site.rate_hz)
    squares = []
    for at, places in enumerate(crowd_paths(loaded, steps), start=1):
        generator = site.streams.stream("scanline.occluder_sensor", at)
        measured = places + generator.normal(0.0, params.priors.sensor_sd_m, places.shape)
        heard = Heard(places=dict(enumerate(measured)))
        knowledge, _ = source.knowledge(heard, heard.report(len(stage.names)))
        assert isinstance(knowledge, NormalPriors)
        squares.append(((knowledge.means - places) ** 2).sum(axis=1).mean())
    return float(np.sqrt(np.mean(squares)))


def unknown_rmse(loaded: LoadedScenario, steps: int = _STEPS) -> float:
    """Return the error of who takes all occluders to be at the room's centre, over both axes [m]."""
    places = crowd_paths(loaded, steps)
    centre = 0.5 * np.array(loaded.scenario.true_world.size_m[:2])
    return float(np.sqrt(((places - centre) ** 2).sum(axis=2).mean()))
