"""The studies behind the page, the settings that each of them must hold, and what its scenario says."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from wsnsim.claims.results import StudyFile
from wsnsim.sweeps.study import PlannedRun, load_study
from wsnsim.systems.scanline.params import ScanlineParams

NONE, KALMAN, PERFECT = "none", "kalman", "perfect"
PRIORS = (NONE, KALMAN, PERFECT)
"""What is known of the occluders in the paper's figures: nothing, a Kalman filter's places, everything."""
PAPER_SD = 8
"""σ_v of Fig. 9, in units."""
SDS = (2, 4, 8, 16)
"""σ_v of Fig. 10, in units."""
BEYOND = ("stationary", "scan_lines")
"""Kinds of knowledge that the paper does not try."""
WHOLE = "kalman-whole"
"""A Kalman filter's places, with each frame's p(η) taken whole: as if occlusions did not last."""
DEFAULT, PUBLISHED = "default", "published"
FORMS = (PUBLISHED, DEFAULT)
CAMERAS = (2, 3, 4, 5, 6, 7, 8)
TRADED = (3, 4, 5, 6, 8)
CROWDS = (1, 10, 20, 40, 80, 120, 160)
LAB_CAMERAS = (2, 4, 8, 12, 16)
USUAL_CAMERAS = 4
KALMAN_TRACKERS = ("extended", "unscented", "map")
PARTICLE_TRACKERS = ("auxiliary", "printed", "plain")
HULL_CROWDS = (10, 40)
HULLS = ("none", "ellipses", "polygons", "scan_lines")
RADIO_CELLS = ("bearing", "stationary", "kalman", "perfect", "scan_line", "jpeg")
ALONE = "jpeg-alone"
"""A single camera that sends an image in ten seconds: all of it arrives."""
BENCH = "scanline-bench.json"
"""What `wsnsim bench scanline --json` printed, in the folder of the sweeps."""

ROOT = Path(__file__).parents[3]
"""Of the project."""


def _study(name: str, cells: tuple[str, ...]) -> StudyFile:
    return StudyFile(f"scanline-{name}", f"scenarios/studies/scanline_{name}.yaml", cells, keeps_steps=False)


CAMERA_STUDY = _study("cameras", tuple(f"N{n}-{prior}" for n in CAMERAS for prior in PRIORS))
PRIOR_STUDY = _study(
    "priors",
    (
        NONE,
        PERFECT,
        *(f"{KALMAN}-{sd}" for sd in SDS),
        *BEYOND,
        *(f"{cell}-{PUBLISHED}" for cell in (NONE, PERFECT, f"{KALMAN}-{PAPER_SD}")),
    ),
)
TRADE_STUDY = _study(
    "tradeoff", tuple(f"N{n}-{prior}" for n in TRADED if n != USUAL_CAMERAS for prior in (NONE, PERFECT))
)
CROWD_STUDY = _study("occluders", tuple(f"M{m}-{prior}" for m in CROWDS for prior in (NONE, PERFECT)))
TRACKER_STUDY = _study(
    "trackers",
    (*(f"{tracker}-{prior}" for tracker in PARTICLE_TRACKERS for prior in (NONE, PERFECT)), *KALMAN_TRACKERS),
)
HULL_STUDY = _study("hull", tuple(f"M{m}-{kind}" for m in HULL_CROWDS for kind in HULLS))
LAB_STUDY = _study(
    "lab", (*(f"N{n}-{prior}" for n in LAB_CAMERAS for prior in PRIORS), f"N{LAB_CAMERAS[-1]}-{WHOLE}")
)
RADIO_STUDY = _study("radio", (*RADIO_CELLS, ALONE))
STUDIES = (
    CAMERA_STUDY,
    PRIOR_STUDY,
    TRADE_STUDY,
    CROWD_STUDY,
    TRACKER_STUDY,
    HULL_STUDY,
    LAB_STUDY,
    RADIO_STUDY,
)


def units_m() -> Mapping[str, float]:
    """Return the length that each study's scenario calls a unit, by the study's name [m]."""
    return {study.name: params_of(runs_of(study)[0]).unit_m for study in STUDIES}


def runs_of(study: StudyFile, cell: str | None = None) -> tuple[PlannedRun, ...]:
    """Return the runs of a study, or of one of its cells, as it plans them now, seed by seed."""
    runs = _runs(ROOT / study.file)
    return runs if cell is None else tuple(run for run in runs if run.cell.name == cell)


def params_of(run: PlannedRun) -> ScanlineParams:
    """Return the parameters of a run's system."""
    params = run.loaded.system_params
    assert isinstance(params, ScanlineParams)
    return params


@cache
def _runs(file: Path) -> tuple[PlannedRun, ...]:
    return load_study(file).runs
