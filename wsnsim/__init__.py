"""wsnsim: a simulator of wireless camera networks.

Pixels, trackers, packets and joules in one run. `run` does what the command
``wsnsim run`` does, `sweep` what ``wsnsim sweep`` does; `load` reads a scenario without running it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wsnsim.errors import OutputError, ScenarioError, SimulationError, WsnsimError
    from wsnsim.runs.result import Run
    from wsnsim.runs.run import run
    from wsnsim.scenario.load import load_scenario as load
    from wsnsim.scenario.schema import Scenario
    from wsnsim.sweeps.sweep import Sweep, sweep

__version__ = "0.1.0"

__all__ = [
    "OutputError",
    "Run",
    "Scenario",
    "ScenarioError",
    "SimulationError",
    "Sweep",
    "WsnsimError",
    "load",
    "run",
    "sweep",
]

_HOMES = {
    "OutputError": ("wsnsim.errors", "OutputError"),
    "Run": ("wsnsim.runs.result", "Run"),
    "Scenario": ("wsnsim.scenario.schema", "Scenario"),
    "ScenarioError": ("wsnsim.errors", "ScenarioError"),
    "SimulationError": ("wsnsim.errors", "SimulationError"),
    "Sweep": ("wsnsim.sweeps.sweep", "Sweep"),
    "WsnsimError": ("wsnsim.errors", "WsnsimError"),
    "load": ("wsnsim.scenario.load", "load_scenario"),
    "run": ("wsnsim.runs.run", "run"),
    "sweep": ("wsnsim.sweeps.sweep", "sweep"),
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts fast."""
    if name not in _HOMES:
        raise AttributeError(f"module 'wsnsim' has no attribute {name!r}")
    module, attribute = _HOMES[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
