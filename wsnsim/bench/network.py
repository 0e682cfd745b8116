"""What the radio network costs this machine: CPU time a packet and a frame, beside ns-3, and as it grows.

Times are CPU times of the event loop alone; what comes before, from the layout
to the first event, is start-up and shown apart. Ours and the peer run by turns.
"""

import cProfile
import pstats
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from io import StringIO
from pathlib import Path
from statistics import median

from wsnsim.bench.ns3 import Peer, compiled
from wsnsim.claims.network.layouts import Layout, random_layout, stored
from wsnsim.claims.network.runs import DRAIN_S, PAYLOAD_BYTES, bed
from wsnsim.net.config import RadioConfig
from wsnsim.runs.provenance import peak_memory_bytes
from wsnsim.sim.collector import only_the_new
from wsnsim.types import Seconds

OURS, PEER = "wsnsim", "ns-3"
_TURNS = 3
_DURATION_S, _QUICK_S = 100.0, 10.0
_GROWING, _QUICK_GROWING = (200, 1_000, 10_000), (50, 100)
_RADIOS = {"CC2420": RadioConfig(), "ns-3's radio": None}
"""ns-3's hears farther than 200 motes of the layouts' density reach: there a frame concerns 199 of 200, but
some 570 of 10,000."""
_HOP_PERIOD_S = 3.0
"""Of packets that go one hop: the frames a mote then sends are those of `rgg_n200` at T = 10 s."""
_MOTE_SECONDS, _QUICK_MOTE_SECONDS = 90_000.0, 1_000.0
"""Motes times simulated time where the network grows [s]: as many frames whatever the number of motes."""


@dataclass(frozen=True)
class Load:
    """A layout and the period of its motes' packets [s]."""

    layout: Layout
    period_s: Seconds
    radio: RadioConfig | None = None
    """None: ns-3's."""


@dataclass(frozen=True)
class Cost:
    """What a network costs, median of the turns.

    Parameters
    ----------
    who : wsnsim or ns-3
    what : layout and load
    motes : in it
    startup_s : CPU time before the first event [s]
    loop_s : CPU time of the event loop [s]
    frames : on the air, acknowledgements included
    delivered : packets
    delivery_ratio : of those sent
    us_per_frame, us_per_delivered : CPU time of the loop [µs]
    ratio : of the time a delivered packet to the peer's, median of the turns' ratios; None without a peer
    growth : of the time a frame to that of the smallest network, the same; None where nothing grows
    peak_memory_mb : the most that this process has held so far [MB]; None for the peer
    """

    who: str
    what: str
    motes: int
    startup_s: float
    loop_s: float
    frames: float
    delivered: float
    delivery_ratio: float
    us_per_frame: float
    us_per_delivered: float
    ratio: float | None = None
    growth: float | None = None
    peak_memory_mb: float | None = None


@dataclass(frozen=True)
class _Turn:
    startup_s: float
    loop_s: float
    frames: float
    delivered: float
    generated: float


def usual_loads() -> list[Load]:
    """Return what the network's speed is judged by."""
    return [Load(stored("rgg_n50"), 1.0), Load(stored("rgg_n200"), 10.0)]


def bench_network(
    loads: Sequence[Load], *, quick: bool = False, said: Callable[[str], None] = lambda text: None
) -> list[Cost]:
    """Time the network beside ns-3, then as it grows at one density.

    Parameters
    ----------
    quick : little time and few motes, to see that everything runs
    said : told what is being timed, and why there is no peer if there is none
    """
    turns, duration_s = (1, _QUICK_S) if quick else (_TURNS, _DURATION_S)
    with tempfile.TemporaryDirectory() as folder:
        peer = compiled(Path(folder))
        if isinstance(peer, str):
            said(f"{peer}: no comparison")
        costs = []
        _run(Load(stored("rgg_n10"), 1.0), 1.0, 0)  # compiles, and loads what is loaded once
        for load in loads:
            costs += _compared(load, duration_s, turns, None if isinstance(peer, str) else peer, said)
    sizes, mote_seconds = (_QUICK_GROWING, _QUICK_MOTE_SECONDS) if quick else (_GROWING, _MOTE_SECONDS)
    for name, radio in _RADIOS.items():
        costs += _grown(name, radio, sizes, mote_seconds, turns, said)
    return costs


def profile_network(load: Load, duration_s: Seconds = 30.0, lines: int = 25) -> str:
    """Return where the event loop's time goes, by function: own time first."""
    _run(load, 1.0, 0)
    profile = cProfile.Profile()
    _run(load, duration_s, 0, profile)
    text = StringIO()
    pstats.Stats(profile, stream=text).strip_dirs().sort_stats("tottime").print_stats(lines)
    return text.getvalue()


def _compared(
    load: Load, duration_s: Seconds, turns: int, peer: Peer | None, said: Callable[[str], None]
) -> list[Cost]:
    what = f"{load.layout.name}, T = {load.period_s:g} s"
    ours: list[_Turn] = []
    theirs: list[_Turn] = []
    for turn in range(turns):
        said(f"{what}: turn {turn + 1} of {turns}")
        # each second turn runs backwards: whoever comes first has no advantage
        measures = [(ours, partial(_run, load, duration_s, turn))]
        if peer is not None:
            measures.append((theirs, partial(_run_peer, peer, load, duration_s, turn)))
        for taken, measure in measures[:: 1 if turn % 2 == 0 else -1]:
            taken.append(measure())
    ratio = None
    if theirs:
        ratio = median(_per_packet(a) / _per_packet(b) for a, b in zip(ours, theirs, strict=True))
    costs = [_cost(OURS, what, load.layout.motes, ours, ratio, None, peak_memory_bytes() / 2**20)]
    return costs + ([_cost(PEER, what, load.layout.motes, theirs)] if theirs else [])


def _grown(
    name: str,
    radio: RadioConfig | None,
    sizes: Sequence[int],
    mote_seconds: float,
    turns: int,
    said: Callable[[str], None],
) -> list[Cost]:
    """Time packets of one hop, so that the load is the same everywhere in a network of any size."""
    loads = {motes: Load(random_layout(motes), _HOP_PERIOD_S, radio) for motes in sizes}
    taken: dict[int, list[_Turn]] = {motes: [] for motes in sizes}
    peaks_mb: dict[int, float] = {}
    for turn in range(turns):
        for motes, load in loads.items():
            said(f"{motes} motes of the same density, {name}: turn {turn + 1} of {turns}")
            packets = max(1, round(mote_seconds / motes / _HOP_PERIOD_S))
            taken[motes].append(_run(load, packets * _HOP_PERIOD_S, turn, one_hop=True))
            # the smaller come first, so that in the first turn the peak is each one's own
            peaks_mb.setdefault(motes, peak_memory_bytes() / 2**20)
    what = f"one hop each, T = {_HOP_PERIOD_S:g} s, {name}"
    first = [_per_frame(turn) for turn in taken[sizes[0]]]
    costs = []
    for motes in sizes:
        growth = median(_per_frame(turn) / least for turn, least in zip(taken[motes], first, strict=True))
        costs.append(_cost(OURS, what, motes, taken[motes], None, growth, peaks_mb[motes]))
    return costs


def _run(
    load: Load,
    duration_s: Seconds,
    seed: int,
    profile: cProfile.Profile | None = None,
    *,
    one_hop: bool = False,
) -> _Turn:
    began = time.process_time()
    network = bed(load.layout, seed, radio=load.radio)
    network.periodic(load.period_s, round(duration_s / load.period_s), bytes(PAYLOAD_BYTES), one_hop=one_hop)
    with only_the_new():
        built = time.process_time()
        if profile is None:
            network.run(duration_s + DRAIN_S)
        else:
            profile.runcall(network.run, duration_s + DRAIN_S)
        ran = time.process_time()
    tally = network.tally()
    return _Turn(built - began, ran - built, tally.counters.frames_tx, tally.delivered, tally.generated)


def _run_peer(peer: Peer, load: Load, duration_s: Seconds, seed: int) -> _Turn:
    said = peer.run(load.layout, load.period_s, duration_s, seed)
    frames = said["data_frames"] + said["ack_frames"]
    return _Turn(said["startup_cpu_s"], said["loop_cpu_s"], frames, said["delivered"], said["generated"])


def _per_frame(turn: _Turn) -> float:
    return 1e6 * turn.loop_s / max(turn.frames, 1.0)


def _per_packet(turn: _Turn) -> float:
    return 1e6 * turn.loop_s / max(turn.delivered, 1.0)


def _cost(
    who: str,
    what: str,
    motes: int,
    turns: Sequence[_Turn],
    ratio: float | None = None,
    growth: float | None = None,
    peak_memory_mb: float | None = None,
) -> Cost:
    return Cost(
        who,
        what,
        motes,
        median(turn.startup_s for turn in turns),
        median(turn.loop_s for turn in turns),
        median(turn.frames for turn in turns),
        median(turn.delivered for turn in turns),
        median(turn.delivered / turn.generated for turn in turns),
        median(_per_frame(turn) for turn in turns),
        median(_per_packet(turn) for turn in turns),
        ratio,
        growth,
        peak_memory_mb,
    )
