"""What a network's standard brings with it: its medium accesses, its radios, and the defaults of both.

Everything else of the schema has the defaults of IEEE 802.15.4. These functions
read plain data, so that they speak even where other values are wrong.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from wsnsim.scenario.faults import Fault, KeyPath, one_of, shown
from wsnsim.scenario.schema_mac import CsmaCa, Dcf, Lpl, Tdma
from wsnsim.scenario.schema_motes import MoteDefaults
from wsnsim.scenario.schema_network import NetworkParams


@dataclass(frozen=True)
class _Standard:
    title: str
    macs: tuple[str, ...]
    """The first is the default."""
    radio: str
    max_frame_bytes: int
    network: Mapping[str, float]
    """Defaults of `network:` that differ from the schema's."""


def _kind(mac: type[CsmaCa | Dcf | Lpl | Tdma]) -> str:
    return str(mac.model_fields["kind"].default)


_STANDARDS = {
    "ieee802154": _Standard(
        title="IEEE 802.15.4",
        macs=(_kind(CsmaCa), _kind(Tdma), _kind(Lpl)),
        radio=MoteDefaults.model_fields["radio"].default,
        max_frame_bytes=127,
        network={},
    ),
    # What a maker of cards with the WaveLAN's chips gives for 8 % of lost 1024 B frames, at 1, 2, 5.5 and
    # 11 Mbit/s: -91, -88, -85 and -82 dBm. With this noise the model's are -92.1, -87.5, -84.9, -81.9 dBm.
    "ieee80211b": _Standard(
        title="IEEE 802.11b",
        macs=(_kind(Dcf),),
        radio="wavelan_silver",
        max_frame_bytes=2332,
        network=MappingProxyType({"tx_power_dbm": 15.0, "noise_dbm": -89.0, "sensitivity_dbm": -91.0}),
    ),
}


def with_standard(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's plain data with the defaults of its network's standard filled in."""
    network, standard = _section(data, "network"), _standard_of(data)
    if standard is None or not standard.network:
        return dict(data)
    filled = dict(data)
    filled["network"] = {**standard.network, **network}
    if isinstance(mac := network.get("mac", {}), Mapping):
        filled["network"]["mac"] = {"kind": standard.macs[0], **mac}
    motes = data.get("motes")
    if isinstance(motes, Mapping) and isinstance(default := motes.get("default", {}), Mapping):
        filled["motes"] = {**motes, "default": {"radio": standard.radio, **default}}
    return filled


def standard_faults(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Find medium accesses, radios and frames that do not go with the network's standard."""
    standard = _standard_of(data)
    if standard is None:
        return
    kind = _section(data, "network", "mac").get("kind")
    if kind not in standard.macs and any(kind in each.macs for each in _STANDARDS.values()):
        message = f"must be {one_of(standard.macs)} in {standard.title} (or left out), got {shown(kind)}"
        yield Fault(("network", "mac", "kind"), message)
    frame_bytes = _section(data, "network", "routing").get("frame_bytes")
    if isinstance(frame_bytes, int) and frame_bytes > standard.max_frame_bytes:
        yield Fault(
            ("network", "routing", "frame_bytes"),
            f"must be at most {standard.max_frame_bytes} in {standard.title}, got {frame_bytes}",
        )
    yield from _radio_faults(data, standard)


def _radio_faults(data: Mapping[str, Any], standard: _Standard) -> Iterator[Fault]:
    from wsnsim.hardware.profiles import RADIOS

    fitting = [name for name, radio in RADIOS.items() if _STANDARDS[radio.standard] is standard]
    paths: list[KeyPath] = [("motes", "default"), ("motes", "base")]
    for key in ("nodes", "sinks"):
        entries = _section(data, "motes").get(key)
        paths += [("motes", key, at) for at in range(len(entries) if isinstance(entries, list) else 0)]
    for path in paths:
        radio = _section(data, *path).get("radio")
        if isinstance(radio, str) and radio in RADIOS and radio not in fitting:
            message = f"must be a radio of {standard.title}, which the network is: {one_of(fitting)}"
            yield Fault((*path, "radio"), f"{message} (or left out), got {shown(radio)}")


def _standard_of(data: Mapping[str, Any]) -> _Standard | None:
    """Return the network's standard; None for an ideal network, or for one that does not exist."""
    default = NetworkParams.model_fields["standard"].default
    name = _section(data, "network").get("standard", default)
    return _STANDARDS.get(name) if isinstance(name, str) else None


def _section(data: Any, *path: str | int) -> Mapping[str, Any]:
    """Return the mapping at a path, an empty one where there is none."""
    for step in path:
        if isinstance(step, int):
            data = data[step]
        else:
            data = data.get(step) if isinstance(data, Mapping) else None
    return data if isinstance(data, Mapping) else {}
