"""Two normal numbers for each pair of nodes, by their names, for as many pairs as there are.

Each pair has a stream of its own. Making a generator takes tens of microseconds,
so that the streams of many pairs are started and read by a kernel, which gives
the same numbers; the few that it leaves undecided are read as the others were.
"""

from collections.abc import Sequence
from functools import cache
from zlib import crc32

import numpy as np

from wsnsim.rng import RandomStreams
from wsnsim.types import FloatArray, IntArray, NodeId

PCG_MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645
"""Of the 128-bit generator (O'Neill 2014)."""
_FEW = 2000
"""Pairs from which on it is worth to load the kernel."""


def pair_normals(
    name: str, nodes: Sequence[NodeId], senders: IntArray, receivers: IntArray, streams: RandomStreams
) -> tuple[FloatArray, FloatArray]:
    """Draw what two nodes share, and by what the way from one to the other differs from the way back.

    Parameters
    ----------
    name : of the stream; its ids are the names of a pair's nodes, in the order of the alphabet
    nodes : names
    senders, receivers : (m,), (m,) - pairs of different nodes

    Returns
    -------
    shared : (m,) - the same for both directions; normal with mean 0 and variance 1
    between : (m,) - of opposite signs for the two directions; normal with mean 0 and variance 1
    """
    rank = np.empty(len(nodes), dtype=np.int64)
    rank[sorted(range(len(nodes)), key=lambda at: nodes[at])] = np.arange(len(nodes))
    forward = rank[senders] < rank[receivers]
    ones, others = np.where(forward, senders, receivers), np.where(forward, receivers, senders)
    # both directions of a pair ask for the same two numbers
    pairs, places = np.unique(ones * len(nodes) + others, return_inverse=True)
    draws = _normals(name, nodes, pairs // len(nodes), pairs % len(nodes), streams)[places]
    return draws[:, 0], np.where(forward, draws[:, 1], -draws[:, 1])


def _normals(
    name: str, nodes: Sequence[NodeId], ones: IntArray, others: IntArray, streams: RandomStreams
) -> FloatArray:
    """Return the first two normal numbers (m, 2) of each pair's stream."""
    draws = np.full((len(ones), 2), np.nan)
    if len(ones) > _FEW:
        from wsnsim.kernels.streams import first_two_normals

        keys = np.array([crc32(node.encode()) for node in nodes], dtype=np.uint64)
        seed = [streams.seed >> shift & 0xFFFFFFFF for shift in (0, 32, 64, 96)]
        common = np.array([*seed, crc32(name.encode())], dtype=np.uint64)
        draws = first_two_normals(common, keys[ones], keys[others], _ziggurat_widths())
    for at in np.flatnonzero(np.isnan(draws[:, 0])).tolist():
        stream = streams.stream(name, nodes[ones[at]], nodes[others[at]])
        draws[at] = stream.standard_normal(2)
    return draws


@cache
def _ziggurat_widths() -> FloatArray:
    """Return by what NumPy's ziggurat multiplies the 52 random bits of each of its 256 strips, (256,).

    Read off NumPy itself: a generator is put into the state from which it next gives a chosen
    strip with the number 1. Strip 1, which never decides at once, has 0.
    """
    bits = np.random.PCG64(0)
    generator, state = np.random.Generator(bits), bits.state
    backward = pow(PCG_MULTIPLIER, -1, 1 << 128)
    widths = np.zeros(256)
    for strip in range(256):
        if strip != 1:
            # the output of a state below 2**64 is the state; the state before it is asked for
            before = ((1 << 9 | strip) - state["state"]["inc"]) * backward % (1 << 128)
            bits.state = {**state, "state": {"state": before, "inc": state["state"]["inc"]}}
            widths[strip] = generator.standard_normal()
    return widths
