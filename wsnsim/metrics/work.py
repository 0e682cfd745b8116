"""Whether the motes' processors keep up with their cameras."""

import pandas as pd

from wsnsim.metrics.figures import Figures
from wsnsim.types import Seconds


def work(nodes: pd.DataFrame, simulated_s: Seconds) -> Figures:
    """Return how long the motes' processors work; the base station is left out.

    - `frame_work_max_s`: processor time for each image taken, on the camera's
      mote where it is longest. All work of the mote counts, the answers to
      messages and what it relays in its program included.
    - `work_longest_s`: the longest that a mote works without a break on one input.
    - `busy_share_max`: the largest share of its life that a mote's processor works.

    Parameters
    ----------
    nodes : the record table
    simulated_s : time from the beginning to the end of the run [s]
    """
    motes = nodes[nodes["role"] != "base"]
    lived_s = motes["died_at_s"].astype("float64").fillna(simulated_s)
    share = (motes["cpu_busy_s"] / lived_s)[lived_s > 0.0]
    an_image_s = motes["frame_work_mean_s"].astype("float64").dropna()
    return {
        "frame_work_max_s": float(an_image_s.max()) if len(an_image_s) else None,
        "work_longest_s": float(motes["work_longest_s"].max()) if len(motes) else None,
        "busy_share_max": float(share.max()) if len(share) else None,
    }
