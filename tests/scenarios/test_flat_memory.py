"""A long run needs no more memory than a short one: what happened is handed on, not kept."""

import gc
import tracemalloc

from wsnsim.records import Row
from wsnsim.scenario.load import scenario_from_dict
from wsnsim.sim.build import build

EARLY, LATE = (200, 225, 250), (400, 425, 450)
"""Steps at which memory is looked at; the caches of NumPy and CPython fill up before."""
ROW_BYTES = 400
"""Less than a row of any table takes with its numbers; NumPy's caches come and go by a third of it a step."""


class Counter:
    """A sink that keeps nothing but the number of rows."""

    def __init__(self) -> None:
        self.rows = 0

    def write(self, row: Row) -> None:
        self.rows += 1


def test_the_simulation_keeps_nothing_of_the_steps_behind_it() -> None:
    """One row kept a step would show in bytes, one object of any size in their number."""
    corner = {"resolution_px": [48, 36], "focal_px": 45, "look_at_m": [2.5, 2, 1]}
    simulation = build(
        scenario_from_dict(
            {
                "duration_s": LATE[-1] / 4,
                "world": {
                    "size_m": [5, 4, 3],
                    "targets": [
                        {
                            "id": "box",
                            "shape": {"kind": "ellipsoid", "semi_axes_m": [0.4, 0.28, 0.34]},
                            "motion": {
                                "kind": "waypoints",
                                "points_m": [[2, 2, 1], [3, 2, 1]] * 20,
                                "speed_mps": 0.4,
                            },
                        }
                    ],
                },
                "cameras": [
                    {"id": "c1", "position_m": [0, 0, 2], **corner},
                    {"id": "c2", "position_m": [5, 0, 2], **corner},
                ],
                "motes": {"base": {"position_m": [2.5, 0, 2]}},
                "network": {"standard": "ideal"},
                "system": {"kind": "multiview", "particles": 20, "encoding": "uint8"},
            }
        )
    )
    held: dict[int, int] = {}
    objects: dict[int, int] = {}

    def measure(done: int, total: int) -> None:
        if done == EARLY[0] // 10:
            tracemalloc.start()
        if done in EARLY + LATE:
            gc.collect()
            held[done] = tracemalloc.get_traced_memory()[0]
            objects[done] = len(gc.get_objects())

    sink = Counter()
    try:
        simulation.run(sink, measure)
    finally:
        tracemalloc.stop()
    assert sink.rows > 5 * LATE[-1]
    steps = LATE[0] - EARLY[-1]
    assert grown(held) < ROW_BYTES * steps
    assert grown(objects) < 0.5 * steps


def grown(values: dict[int, int]) -> int:
    """Return by how much the least of the late values exceeds the largest of the early ones."""
    return min(values[step] for step in LATE) - max(values[step] for step in EARLY)
