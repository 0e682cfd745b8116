"""Messages of several fragments over a lossy hop: each fragment is repeated, one that is lost loses all."""

import runpy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from wsnsim.net.interface import Outcome
from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.routing.config import DisseminationConfig

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

SECOND = 10**9
DISTANCE_M, NOISE_DBM, COUNT = 66.5, -93.9, 500
RETRIES = 3


@pytest.mark.parametrize("routed", [False, True], ids=["plain", "routed"])
def test_a_message_arrives_if_all_its_fragments_do(routed, test_seed):
    """p: a frame arrives; q: its acknowledgement too. All fragments but the last have to be acknowledged in
    1 + r attempts, or the source gives up; the last has to arrive once:

        P = (1 - (1 - pq)^(1 + r))^(n - 1) · (1 - (1 - p)^(1 + r)).
    """
    places = {"n0": (0.0, 0.0, 0.0), "n1": (DISTANCE_M, 0.0, 0.0)}
    # any repetition of broadcasts brings in the link that counts copies
    routing = RoutingConfig(spread=DisseminationConfig(repeats=1)) if routed else None
    run = RadioBench(
        places, {"n0": None, "n1": "n0"}, test_seed, routing=routing, noise_dbm=NOISE_DBM,
        max_frame_retries=RETRIES, reassembly_timeout_s=0.5,
    )  # fmt: skip
    for number in range(COUNT):
        run.send("n1", "n0", bytes(150), at_ns=number * SECOND)
    run.run(COUNT + 2)
    sinr = 10 ** ((-40.05 - 30 * np.log10(DISTANCE_M) - NOISE_DBM) / 10)
    # 104 B and 46 B, with fragment headers of 4 B and 5 B, below them MAC, mesh and route headers
    header = 11 + 5 + (3 if routed else 0)
    sizes = [header + 4 + 104, header + 5 + 46]
    ack = run.phy.frame_success(sinr, 5)
    arrive = [run.phy.frame_success(sinr, size) for size in sizes]
    assert 0.1 < arrive[0] < 0.9
    first = 1 - (1 - arrive[0] * ack) ** (1 + RETRIES)
    last = 1 - (1 - arrive[1]) ** (1 + RETRIES)
    chance = first * last
    assert 0.1 < chance < 0.95
    error = np.sqrt(chance * (1 - chance) / COUNT)
    assert len(run.delivered_at) / COUNT == pytest.approx(chance, abs=4 * error)
    causes = Counter(outcome for *_, outcome in run.dropped_at)
    assert sum(causes.values()) == COUNT - len(run.delivered_at)
    assert set(causes) <= {Outcome.NO_ACK, Outcome.REASSEMBLY}
    assert run.network.fragments(150) == 2
