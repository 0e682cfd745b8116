"""How long the processors work on an image, by hand."""

import math

import pandas as pd
import pytest

from wsnsim.metrics.work import work

NODES = pd.DataFrame(
    [
        ("base", "base", 9.0, math.nan, 3.0, math.nan),
        ("c1", "camera", 2.0, 0.25, 0.2, math.nan),
        ("c2", "camera", 3.0, 0.5, 0.4, 4.0),
        ("relay", "relay", 1.0, math.nan, 0.6, math.nan),
    ],
    columns=["node", "role", "cpu_busy_s", "frame_work_mean_s", "work_longest_s", "died_at_s"],
)


def test_the_slowest_mote_counts_and_the_base_station_does_not():
    figures = work(NODES, 10.0)
    assert figures == {"frame_work_max_s": 0.5, "work_longest_s": 0.6, "busy_share_max": 3.0 / 4.0}


def test_nobody_who_took_an_image_has_no_time_for_one():
    figures = work(NODES[NODES["role"] != "camera"], 10.0)
    assert figures["frame_work_max_s"] is None
    assert figures["busy_share_max"] == pytest.approx(0.1)
    assert set(work(NODES.head(1), 10.0).values()) == {None}
