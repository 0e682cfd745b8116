"""What the report is told of a run."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from wsnsim.report.context import ReportContext
from wsnsim.scenario.load import LoadedScenario
from wsnsim.sim.engine import Simulation

if TYPE_CHECKING:
    import pandas as pd

_STANDARDS = {"ieee802154": "IEEE 802.15.4", "ideal": "an ideal network"}


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
        size_m=scenario.world.size_m,
        cameras={camera.node.id: camera.renderer.camera for camera in simulation.cameras},
        tables=tables,
        summary=figures,
        lost_above_m=lost_above_m,
    )
