"""Writes a layout out as what it stands for: nodes, a base station, a tree, a path loss.

Explicit keys come first: what the scenario says of a node, of the base station or of the network is kept,
and the layout fills in the rest.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from wsnsim.scenario.faults import Fault, KeyPath, quoted
from wsnsim.scenario.layout_file import LayoutError, Place, Plan, read_layout
from wsnsim.scenario.schema_layout import (
    Generated,
    GridLayout,
    Layout,
    LineLayout,
    RandomLayout,
    StarLayout,
)

_AT: KeyPath = ("motes", "layout")


def has_layout(data: Mapping[str, Any]) -> bool:
    """Tell whether a scenario, as plain data, names a layout."""
    motes = data.get("motes")
    return isinstance(motes, Mapping) and motes.get("layout") is not None


def plan_of(layout: Layout, seed: Any) -> tuple[Plan | None, list[Fault]]:
    """Return what a layout says, or what is wrong with it.

    Parameters
    ----------
    layout : as it stands in the scenario, files by their absolute paths
    seed : of the scenario; what is no seed the schema has named already
    """
    if isinstance(layout, str):
        try:
            return read_layout(Path(layout)), []
        except (LayoutError, OSError) as error:
            return None, [Fault(_AT, f"must be a file with a layout, got {quoted(layout)}: {error}")]
    if isinstance(layout, GridLayout | LineLayout) and layout.sink >= layout.nodes:
        message = f"must be the number of a node, 0 to {layout.nodes - 1}, got {layout.sink}"
        return None, [Fault((*_AT, "sink"), message)]
    own = seed if isinstance(seed, int) and seed >= 0 else 0
    return Plan(tuple(_places(layout, own)), getattr(layout, "sink", 0)), []


def written_out(data: Mapping[str, Any], plan: Plan) -> dict[str, Any]:
    """Return a scenario in which a plan's nodes stand one by one.

    Parameters
    ----------
    data : the scenario as plain data
    plan : what its layout says
    """
    motes = data["motes"]
    given_base = motes.get("base") if isinstance(motes.get("base"), Mapping) else {}
    base = {"id": f"n{plan.sink}", "position_m": list(plan.places[plan.sink]), **given_base}
    names = [f"n{number}" for number in range(len(plan.places))]
    names[plan.sink] = base["id"]
    places = {name: list(place) for name, place in zip(names, plan.places, strict=True) if name != base["id"]}
    nodes = motes.get("nodes", [])
    if isinstance(nodes, list):
        # in front, where the faults of what is written by hand are looked for
        nodes = [_placed(entry, places) for entry in nodes]
        by_hand = {entry["id"] for entry in nodes if isinstance(entry, Mapping) and "id" in entry}
        nodes += [{"id": name, "position_m": place} for name, place in places.items() if name not in by_hand]
    result = {**data, "motes": {**motes, "layout": None, "nodes": nodes, "base": base}}
    network = data.get("network", {})
    if isinstance(network, Mapping):
        result["network"] = _network(network, plan, names)
    return result


def _placed(entry: Any, places: Mapping[str, list[float]]) -> Any:
    """Return an entry by hand with its place from the layout, unless it has one."""
    name = entry.get("id") if isinstance(entry, Mapping) else None
    return {"position_m": places[name], **entry} if isinstance(name, str) and name in places else entry


def _network(given: Mapping[str, Any], plan: Plan, names: list[str]) -> dict[str, Any]:
    network = {**(plan.network or {}), **given}
    propagation, known = given.get("propagation"), (plan.network or {}).get("propagation")
    if isinstance(propagation, Mapping) and known and propagation.get("kind", known["kind"]) == known["kind"]:
        network["propagation"] = {**known, **propagation}
    if plan.parents and "routing" not in given:
        parents = {
            name: names[parent] for name, parent in zip(names, plan.parents, strict=True) if parent >= 0
        }
        network["routing"] = {"kind": "tree", "parents": parents}
    return network


def _places(layout: Generated, seed: int) -> Iterator[Place]:
    z = layout.height_m
    if isinstance(layout, LineLayout):
        for number in range(layout.nodes):
            yield number * layout.spacing_m, 0.0, z
    elif isinstance(layout, GridLayout):
        columns = math.isqrt(layout.nodes - 1) + 1
        for number in range(layout.nodes):
            row, column = divmod(number, columns)
            yield column * layout.spacing_m, row * layout.spacing_m, z
    elif isinstance(layout, StarLayout):
        radius_m, around = layout.radius_m, layout.nodes - 1
        yield radius_m, radius_m, z
        for number in range(around):
            angle = 2 * math.pi * number / around
            yield radius_m + radius_m * math.cos(angle), radius_m + radius_m * math.sin(angle), z
    else:
        yield from _scattered(layout, seed)


def _scattered(layout: RandomLayout, seed: int) -> Iterator[Place]:
    # NumPy takes longer to import than everything else here, and no other layout needs it
    from wsnsim.rng import RandomStreams

    rng = RandomStreams(seed if layout.seed is None else layout.seed).stream("layout.places")
    yield 0.5 * layout.side_m, 0.5 * layout.side_m, layout.height_m
    for x, y in rng.uniform(0.0, layout.side_m, size=(layout.nodes - 1, 2)).tolist():
        yield x, y, layout.height_m
