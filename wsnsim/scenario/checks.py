"""What must hold between the parts of a scenario.

The checks read plain data, so that they speak even where other values are
wrong; whatever has not the form they look for, the schema has named already.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from wsnsim.scenario.faults import Fault, KeyPath, did_you_mean, path_text, shown
from wsnsim.scenario.schema_cameras import Camera
from wsnsim.scenario.schema_motes import BaseStation
from wsnsim.scenario.schema_routing import EtxTree


def cross_faults(data: Mapping[str, Any]) -> list[Fault]:
    """Return the faults between the parts of a scenario.

    Parameters
    ----------
    data : the scenario as plain data, defaults not filled in
    """
    return [
        *_node_names(data),
        *_world_names(data),
        *_crowd(data),
        *_relays(data),
        *_rates(data),
        *_duration(data),
        *_recorded_cameras(data),
        *_probing(data),
    ]


def unseeing(data: Mapping[str, Any], needs_cameras: bool) -> Iterator[Fault]:
    """Find what is missing where there are, or have to be, cameras.

    Parameters
    ----------
    data : the scenario as plain data, defaults not filled in
    needs_cameras : whether the system is of no use without cameras and targets
    """
    cameras, world = data.get("cameras", []), data.get("world")
    if needs_cameras:
        yield from _none_of(("cameras",), cameras, "cameras" in data)
    elif not cameras and "base" in (motes := _mapping(data, "motes")):
        yield from _none_of(("motes", "nodes"), motes.get("nodes", []), "nodes" in motes)
    if isinstance(world, Mapping):
        if needs_cameras:
            yield from _none_of(("world", "targets"), world.get("targets", []), "targets" in world)
    elif world is None and (needs_cameras or (isinstance(cameras, list) and cameras)):
        yield Fault(("world",), "must be given (ground truth)")


def _none_of(path: KeyPath, items: Any, given: bool) -> Iterator[Fault]:
    """Find a list without items."""
    if isinstance(items, list) and not items:
        what = _MEANINGS[path[-1]]
        yield Fault(path, "must have at least 1 item, got 0" if given else f"must be given ({what})")


_MEANINGS: Mapping[str | int, str] = {
    "cameras": "what sees",
    "targets": "bodies to track",
    "nodes": "motes beside the base station; or a layout of many",
}


def _mapping(data: Any, key: str) -> Mapping[str, Any]:
    value = data.get(key) if isinstance(data, Mapping) else None
    return value if isinstance(value, Mapping) else {}


def _items(data: Any, *keys: str) -> Iterator[tuple[KeyPath, Mapping[str, Any]]]:
    """Yield path and content of each mapping in the list at `keys`."""
    for key in keys[:-1]:
        data = _mapping(data, key)
    items = data.get(keys[-1])
    for index, item in enumerate(items if isinstance(items, list) else []):
        if isinstance(item, Mapping):
            yield (*keys, index), item


def _named(data: Any, *keys: str) -> Iterator[tuple[KeyPath, str]]:
    """Yield path and id of each item in the list at `keys`."""
    for path, item in _items(data, *keys):
        if isinstance(item.get("id"), str):
            yield (*path, "id"), item["id"]


def _node_names(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Find two nodes of one name; an entry of `motes.nodes` may have a camera's, whose mote it changes."""
    cameras = list(_named(data, "cameras"))
    first: dict[str, KeyPath] = {}
    for path, name in cameras:
        yield from _twice(first, path, name)
    entries: dict[str, KeyPath] = {}
    for path, name in _named(data, "motes", "nodes"):
        yield from _twice(entries, path, name)
    for path, name in _named(data, "motes", "sinks"):
        yield from _twice(entries | first, path, name)
        entries.setdefault(name, path)
    base = _mapping(_mapping(data, "motes"), "base")
    base_id = base.get("id", BaseStation.model_fields["id"].default)
    if isinstance(base_id, str):
        yield from _twice(entries | first, ("motes", "base", "id"), base_id)


def _world_names(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Find two things of one name in the world, where random streams are told apart by names."""
    first: dict[str, KeyPath] = {}
    for group in ("targets", "people", "occluders"):
        for path, name in _named(data, "world", group):
            yield from _twice(first, path, name)
    crowds = {
        item["id"]: (path, item["count"])
        for path, item in _items(data, "world", "people")
        if isinstance(item.get("id"), str) and isinstance(item.get("count"), int) and item["count"] > 1
    }
    for name, path in first.items():
        crowd, _, number = name.rpartition("-")
        crowd_path, count = crowds.get(crowd, ((), 0))
        if number.isdecimal() and 1 <= int(number) <= count:
            of_crowd = f"which one of the crowd {path_text(crowd_path)} has too"
            yield Fault(path, f"must be a name of its own, got {shown(name)}, {of_crowd}")


def _crowd(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Ask for a crowd where somebody walks with it, for somebody where there is one, and for its step."""
    world = _mapping(data, "world")
    members = [
        (*path, "motion", "kind")
        for group in ("targets", "people")
        for path, item in _items(data, "world", group)
        if _mapping(item, "motion").get("kind") == "crowd"
    ]
    if world.get("crowd") is None:
        for path in members:
            yield Fault(path, "must have a world.crowd to walk with: write crowd: {} under world")
        return
    if not members:
        message = "must have members: give targets or people motion: {kind: crowd}, or leave it out"
        yield Fault(("world", "crowd"), message)
    if _mapping(world, "crowd").get("step_s") is None and not data.get("cameras"):
        message = "must be given: there is no camera whose frame period could be the time of a step [s]"
        yield Fault(("world", "crowd", "step_s"), message)


def _twice(first: dict[str, KeyPath], path: KeyPath, name: str) -> Iterator[Fault]:
    """Note who has the name first; the second is at fault."""
    if name in first:
        yield Fault(
            path, f"must be a name of its own, got {shown(name)}, which {path_text(first[name])} has too"
        )
    first.setdefault(name, path)


def _relays(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Ask relays for their places; the mote of a camera is where the camera is."""
    cameras = {name for _, name in _named(data, "cameras")}
    for path, entry in _items(data, "motes", "nodes"):
        name = entry.get("id")
        if not isinstance(name, str):
            continue
        placed = entry.get("position_m") is not None
        if placed and name in cameras:
            yield Fault(
                (*path, "position_m"),
                f"must be left out: {shown(name)} is a camera's mote, and stands where it does",
            )
        elif not placed and name not in cameras:
            near = did_you_mean(name, cameras)
            yield Fault(
                (*path, "position_m"),
                f"must be given: no camera is named {shown(name)}, so it is a relay{near}",
            )


def _recorded_cameras(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Ask `record.images` for cameras that there are, each of them once."""
    cameras = [name for _, name in _named(data, "cameras")]
    names = _mapping(data, "record").get("images")
    first: dict[str, KeyPath] = {}
    for index, name in enumerate(names if isinstance(names, list) else []):
        path: KeyPath = ("record", "images", index)
        if not isinstance(name, str):
            continue
        if name not in cameras:
            yield Fault(path, f"must be the id of a camera, got {shown(name)}{did_you_mean(name, cameras)}")
        elif name in first:
            yield Fault(path, f"must be named once, got {shown(name)}, which {path_text(first[name])} is too")
        first.setdefault(name, path)


def _probing(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Ask for a run that goes on when the links have been probed: until then nothing has a way."""
    routing = _mapping(_mapping(data, "network"), "routing")
    if routing.get("estimate") != "probes":
        return
    fields = EtxTree.model_fields
    probes = _positive(routing.get("probes", fields["probes"].default))
    interval = _positive(routing.get("probe_interval_s", fields["probe_interval_s"].default))
    duration = _positive(data.get("duration_s"))
    if probes and interval and duration and probes * interval >= duration:
        message = (
            f"must be over before the run is: {probes:g} probes every {interval:g} s take "
            f"{probes * interval:g} s, got {duration:g} s of duration_s"
        )
        yield Fault(("network", "routing", "probes"), message)


def _positive(value: Any) -> float | None:
    """Return a number that the schema may accept, else None."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number and 0 < value < 1e12 else None


def _rate(camera: Mapping[str, Any]) -> float | None:
    return _positive(camera.get("rate_hz", Camera.model_fields["rate_hz"].default))


def _rates(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Ask for one rate: the trackers combine images of one instant."""
    first: tuple[KeyPath, float] | None = None
    for path, camera in _items(data, "cameras"):
        rate = _rate(camera)
        if rate is None:
            continue
        if first is None:
            first = ((*path, "rate_hz"), rate)
        elif rate != first[1]:
            message = (
                f"must be the same for all cameras (a tracking step takes an image of each), got {rate:g}"
            )
            yield Fault((*path, "rate_hz"), f"{message}, and {path_text(first[0])} is {first[1]:g}")


def _duration(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Ask for one image at least: without it there is nothing to track."""
    duration = _positive(data.get("duration_s"))
    rates = [rate for _, camera in _items(data, "cameras") if (rate := _rate(camera)) is not None]
    # A duration of one rounded period is enough.
    if duration is not None and rates and duration * max(rates) * (1 + 1e-12) < 1:
        period = f"{1 / max(rates):g} s at {max(rates):g} Hz"
        yield Fault(("duration_s",), f"must be one frame period at least ({period}), got {shown(duration)}")
