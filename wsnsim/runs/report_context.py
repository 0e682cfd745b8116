"""What the report is told of a run."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from wsnsim.report.context import ReportContext
from wsnsim.scenario.load import LoadedScenario
from wsnsim.sim.engine import Simulation
from wsnsim.types import FloatArray

if TYPE_CHECKING:
    import pandas as pd

_STANDARDS = {"ieee802154": "IEEE 802.15.4", "ieee80211b": "IEEE 802.11b", "ideal": "an ideal network"}


def report_context(
    loaded: LoadedScenario,
    simulation: Simulation,
    tables: "Mapping[str, pd.DataFrame]",
    figures: Mapping[str, float | int | None],
    lost_above_m: float,
) -> ReportContext:
    """Gather what the report shows."""
    scenario = loaded.scenario
    variant = scenario.system.get("variant")
    return ReportContext(
        name=scenario.name,
        seed=scenario.seed,
        system=loaded.system.name if variant is None else f"{loaded.system.name}, tracker {variant}",
        citation=loaded.system.citation,
        standard=_STANDARDS[scenario.network.standard],
        size_m=None if scenario.world is None else scenario.world.size_m,
        cameras={camera.node.id: camera.renderer.camera for camera in simulation.cameras},
        tables=tables,
        summary=figures,
        lost_above_m=lost_above_m,
        semi_axes_m={target.id: target.body.semi_axes_m for target in simulation.world.targets},
        scenery=simulation.world.scenery,
        walks=_walks(simulation),
        wait_s=simulation.schedule.settle_s,
        platforms={name: node.platform.name for name, node in simulation.nodes.items()},
        choices=_choices(loaded),
        settings=loaded.system_params.told(simulation.site),
        unit_m=getattr(loaded.system_params, "unit_m", None),
        particles=particles_key(loaded),
    )


def particles_key(loaded: LoadedScenario) -> str | None:
    """Return the key of the number of the tracker's particles; None where it has none."""
    params = loaded.system_params
    parts = {"system.particles": params, "system.tracker.particles": getattr(params, "tracker", None)}
    return next((key for key, part in parts.items() if hasattr(part, "particles")), None)


def _choices(loaded: LoadedScenario) -> dict[str, str]:
    """Return the kind of each part of the system that has kinds, by the part's name."""
    kinds = {name: getattr(part, "kind", None) for name, part in loaded.system_params}
    return {name.replace("_", " "): kind.replace("_", " ") for name, kind in kinds.items() if kind}


def _walks(simulation: Simulation) -> dict[str, FloatArray]:
    """Return where people are at the sampling instants, from above (n, 2) [m]."""
    schedule = simulation.schedule
    times = [step / schedule.rate_hz for step in range(schedule.steps + 1)]
    return {
        person.id: np.array([person.motion.at(time).position[:2] for time in times])
        for person in simulation.world.people
    }
