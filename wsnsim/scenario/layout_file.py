"""Layouts from JSON files: where nodes stand, who is whose parent, how power falls with distance.

A file holds one object: `n`, the number of nodes; `xy`, a pair (or `x, y, z`) a node [m]; and, where they
are known, `sink`, the number of the base station (0 where it is left out); `parent`, a number a node and
-1 for the sink; `tx_dbm`; `path_loss` with `model: log-distance`, `d0_m`, `pl0_db` and `exponent`. What
else stands there is left alone.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wsnsim.scenario.faults import quoted, shown

_FARTHEST_M = 1e6
_MOST_SHOWN = 20
"""Nodes of a loop that are named at most."""

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Plan:
    """A layout written out.

    Parameters
    ----------
    places : of all nodes [m]
    sink : number of the base station
    parents : of all nodes, -1 for the sink; empty where the tree is not given
    network : what else is known, by the scenario's keys under `network:`
    """

    places: tuple[Place, ...]
    sink: int = 0
    parents: tuple[int, ...] = ()
    network: Mapping[str, Any] | None = None


class LayoutError(ValueError):
    """What is wrong with a file, and where in it."""


def read_layout(file: Path) -> Plan:
    """Read a layout.

    Raises
    ------
    LayoutError : no JSON, or numbers that make no layout
    """
    try:
        data = json.loads(file.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise LayoutError(f"must be UTF-8 text ({error.reason} at byte {error.start})") from error
    except json.JSONDecodeError as error:
        raise LayoutError(f"line {error.lineno}, column {error.colno}: must be JSON ({error.msg})") from error
    except RecursionError as error:
        raise LayoutError("must be a layout, got brackets nested without end") from error
    if not isinstance(data, dict):
        raise LayoutError(f"must hold an object with n and xy, got {shown(data)}")
    places = _places(data)
    sink = _whole("sink", data.get("sink", 0))
    if not 0 <= sink < len(places):
        raise LayoutError(f"sink: must be the number of a node, 0 to {len(places) - 1}, got {sink}")
    parents = () if data.get("parent") is None else _parents(data["parent"], len(places), sink)
    network: dict[str, Any] = {}
    if data.get("tx_dbm") is not None:
        network["tx_power_dbm"] = _number("tx_dbm", data["tx_dbm"])
    if data.get("path_loss") is not None:
        network["propagation"] = _path_loss(data["path_loss"])
    return Plan(places, sink, parents, network)


def _places(data: Mapping[str, Any]) -> tuple[Place, ...]:
    rows = data.get("xy")
    if not isinstance(rows, list):
        raise LayoutError(f"xy: must be a list with the place of each node, got {shown(rows)}")
    count = _whole("n", data.get("n", len(rows)))
    if count < 2:
        raise LayoutError(f"n: must be at least 2, a base station and a mote, got {count}")
    if len(rows) != count:
        raise LayoutError(f"xy: must have a place for each of the {count} nodes of n, got {len(rows)}")
    first: dict[Place, int] = {}
    for number, row in enumerate(rows):
        if not isinstance(row, list) or len(row) not in (2, 3):
            raise LayoutError(f"xy[{number}]: must be x and y, or x, y and z, in metres, got {shown(row)}")
        x, y, z = (_coordinate(f"xy[{number}][{at}]", value) for at, value in enumerate([*row, 0.0][:3]))
        if (x, y, z) in first:
            raise LayoutError(
                f"xy[{number}]: must be a place of its own, got that of node {first[x, y, z]}; two radios in "
                "one place have no path loss between them"
            )
        first[x, y, z] = number
    return tuple(first)


def _coordinate(where: str, value: Any) -> float:
    number = _number(where, value)
    if abs(number) > _FARTHEST_M:
        raise LayoutError(f"{where}: must lie within {_FARTHEST_M:g} m of the origin, got {number:g} m")
    return number


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise LayoutError(f"{where}: must be a finite number, got {shown(value)}")
    return float(value)


def _whole(where: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise LayoutError(f"{where}: must be a whole number, got {shown(value)}")
    return value


def _parents(rows: Any, count: int, sink: int) -> tuple[int, ...]:
    if not isinstance(rows, list) or len(rows) != count:
        got = f"{len(rows)}" if isinstance(rows, list) else shown(rows)
        raise LayoutError(f"parent: must have a number for each of the {count} nodes, got {got}")
    parents = [_whole(f"parent[{number}]", row) for number, row in enumerate(rows)]
    for number, parent in enumerate(parents):
        if number == sink and parent != -1:
            raise LayoutError(f"parent[{number}]: must be -1, as that of the sink, got {parent}")
        if number != sink and (not 0 <= parent < count or parent == number):
            raise LayoutError(
                f"parent[{number}]: must be the number of another node, 0 to {count - 1}, got {parent}; only "
                f"the sink, {sink}, has none (-1)"
            )
    _check_loops(parents, sink)
    return tuple(parents)


def _check_loops(parents: list[int], sink: int) -> None:
    """Make sure that every way up ends at the sink."""
    fine = {sink}
    for start in range(len(parents)):
        way: dict[int, None] = {}
        node = start
        while node not in fine and node not in way:
            way[node] = None
            node = parents[node]
        if node in way:
            loop = [each for at, each in enumerate(way) if at >= list(way).index(node)]
            around = " -> ".join(str(each) for each in [*loop[:_MOST_SHOWN], node])
            raise LayoutError(f"parent[{loop[0]}]: must lead to the sink, goes round in a loop: {around}")
        fine.update(way)


def _path_loss(section: Any) -> dict[str, Any]:
    if not isinstance(section, dict) or section.get("model") != "log-distance":
        got = shown(section.get("model") if isinstance(section, dict) else section)
        raise LayoutError(f'path_loss.model: must be "log-distance", got {got}')
    names = {"d0_m": "reference_distance_m", "pl0_db": "reference_loss_db", "exponent": "exponent"}
    missing = [name for name in names if name not in section]
    if missing:
        raise LayoutError(f"path_loss: must have {quoted(missing[0])}")
    return {
        "kind": "log_distance",
        **{key: _number(f"path_loss.{name}", section[name]) for name, key in names.items()},
    }
