"""Saying less where a mote's bandwidth budget asks for it (`at_limit: degrade`).

What has to be said takes the form that loses least: the numbers in a coarser encoding, one step at a time
down to 8 bits; then mixtures of fewer components, down to one. Weights of particles cannot become fewer,
since all nodes draw the same particles; rays and weights end at 8 bits. Where nothing is short enough,
nothing is said.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, cast

from wsnsim.errors import EncodeError
from wsnsim.estimation.reduction import reduce
from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.messages.batch import batched
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.numbers import ENCODINGS, Encoding
from wsnsim.systems.multiview.mixing import joining_work


def fitted(payloads: Sequence[Payload], allowance_bytes: float) -> tuple[list[Payload], Work]:
    """Return payloads that together are no longer than allowed, and the work of making them so.

    Parameters
    ----------
    payloads : what is to be said in one message, not empty
    allowance_bytes : of the message [bytes]; infinite without a budget

    Returns
    -------
    the payloads as they are where they fit; none where no form of them does
    """
    if _fits(payloads, allowance_bytes):
        return list(payloads), Work()
    work = Work()
    for shorter, cost in _shorter(payloads):
        work += cost
        if _fits(shorter, allowance_bytes):
            return shorter, work
    return [], work


def _fits(payloads: Sequence[Payload], allowance_bytes: float) -> bool:
    if math.isinf(allowance_bytes):
        return True
    try:
        return len(batched(list(payloads)).encode()) <= allowance_bytes
    except EncodeError:
        # numbers beyond what this encoding holds
        return False


def _shorter(payloads: Sequence[Payload]) -> Iterator[tuple[list[Payload], Work]]:
    """Yield shorter and shorter forms, each with the work it takes beyond the one before."""
    # what is said of a target always has numbers, and so an encoding
    widest = min(ENCODINGS.index(cast(Any, payload).encoding) for payload in payloads)
    for encoding in ENCODINGS[widest + 1 :]:
        yield [_coarser(payload, encoding) for payload in payloads], Work()
    coarsest = [_coarser(payload, ENCODINGS[-1]) for payload in payloads]
    orders = [payload.mixture.order for payload in payloads if isinstance(payload, MixturePayload)]
    for most in range(max(orders, default=1) - 1, 0, -1):
        yield [_fewer(payload, most) for payload in coarsest], _reducing(coarsest, most)


def _coarser(payload: Payload, encoding: Encoding) -> Payload:
    """Return a payload in an encoding no wider than its own."""
    own = cast(Any, payload)
    if ENCODINGS.index(own.encoding) >= ENCODINGS.index(encoding):
        return payload
    return cast(Payload, replace(own, encoding=encoding))


def _fewer(payload: Payload, most: int) -> Payload:
    if not isinstance(payload, MixturePayload):
        return payload
    return replace(payload, mixture=reduce(payload.mixture, most))


def _reducing(payloads: Sequence[Payload], most: int) -> Work:
    """Return the work of bringing mixtures down to so many components."""
    work = Work()
    for payload in payloads:
        if isinstance(payload, MixturePayload) and payload.mixture.order > most:
            work += joining_work(payload.mixture.order, 1)
    return work
