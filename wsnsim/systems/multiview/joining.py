"""What a relay does with the mixtures that pass it (T2, T3): one message of several (Sec. 5.2).

Multiply, divide the shared prediction out, reduce to what a message holds. A message
names the cameras whose images are in it: one that shares a camera with another is
left out, so that no image counts twice.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.messages.mixture import MixturePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.mixing import fused, largest_order
from wsnsim.systems.multiview.params import MultiviewParams


def disjoint(payloads: Iterable[MixturePayload]) -> tuple[MixturePayload, ...]:
    """Return messages that share no camera, those of most cameras first."""
    kept: list[MixturePayload] = []
    heard: set[int] = set()
    for payload in sorted(payloads, key=lambda payload: (-len(payload.cameras), payload.cameras)):
        if heard.isdisjoint(payload.cameras):
            heard.update(payload.cameras)
            kept.append(payload)
    return tuple(kept)


def join(
    payloads: Sequence[MixturePayload], params: MultiviewParams, site: Site, relay: int
) -> tuple[MixturePayload, Work]:
    """Return one message for several of one target and step, and what it cost; a single one goes on as it is.

    Parameters
    ----------
    payloads : at least one
    relay : number of the relay, for its draws
    """
    parts = disjoint(payloads)
    if len(parts) == 1:
        return parts[0], Work()
    first = parts[0]
    said = sorted(
        (
            (camera, facing)
            for part in parts
            for camera, facing in zip(part.cameras, part.facings, strict=True)
        ),
        key=lambda pair: pair[0],
    )
    cameras = tuple(camera for camera, _ in said)
    facings = tuple(facing for _, facing in said)
    numbers = max(facing.size for facing in facings)
    order = largest_order(params, first.mixture.dimension, cameras, numbers)
    rng = site.streams.stream("joining", first.target, first.step, relay, *cameras)
    mixture, work = fused([part.mixture for part in parts], params, order, rng)
    similarity = float(np.max([part.similarity for part in parts]))
    payload = MixturePayload(first.target, first.step, mixture, cameras, similarity, facings, params.encoding)
    return payload, work
