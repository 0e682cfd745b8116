"""Tracking systems by their `kind`: those of the package, and a user's own."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from wsnsim.errors import Problem, ScenarioError
from wsnsim.scenario.faults import did_you_mean, one_of, shown

if TYPE_CHECKING:
    from wsnsim.systems.base import System

BUILT_IN = {
    "multiview": "wsnsim.systems.multiview.system:SYSTEM",
    "scanline": "wsnsim.systems.scanline.system:SYSTEM",
    "traffic": "wsnsim.systems.traffic.system:SYSTEM",
}
"""Where the package's own systems are."""


def find_system(kind: str) -> "System[Any]":
    """Return the system that `kind` names.

    Parameters
    ----------
    kind : a name of the package's, or ``package.module:ATTRIBUTE``

    Raises
    ------
    ScenarioError : no such system, or a module that cannot be imported
    """
    if kind in BUILT_IN:
        return _imported(BUILT_IN[kind])
    if ":" not in kind:
        known = one_of(sorted(BUILT_IN))
        near = did_you_mean(kind, BUILT_IN)
        raise _no_system(f'must be {known}, or your own "package.module:ATTRIBUTE", got {shown(kind)}{near}')
    return _imported(kind)


def _imported(place: str) -> "System[Any]":
    """Return the system at ``package.module:ATTRIBUTE``."""
    from wsnsim.systems.base import System

    module_name, _, attribute = place.partition(":")
    if not all(part.isidentifier() for part in [*module_name.split("."), attribute]):
        raise _no_system(f'must look like "package.module:ATTRIBUTE", got {shown(place)}')
    try:
        module = import_module(module_name)
    except Exception as error:
        # A user's module runs any code at import; whatever it raises is theirs to see.
        reason = f"{type(error).__name__}: {error}"
        raise _no_system(f"must name a module that can be imported, got {shown(place)} ({reason})") from error
    if not hasattr(module, attribute):
        near = did_you_mean(attribute, vars(module))
        raise _no_system(f"must name an attribute of {module_name}, got {shown(attribute)}{near}")
    system = getattr(module, attribute)
    if not isinstance(system, System):
        raise _no_system(
            f"must name a wsnsim.systems.base.System, got {type(system).__name__} at {shown(place)}"
        )
    return system


def _no_system(message: str) -> ScenarioError:
    return ScenarioError([Problem("system.kind", message)])
