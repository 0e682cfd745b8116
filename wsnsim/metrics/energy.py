"""What the motes used up, and how long their batteries would last."""

import pandas as pd

from wsnsim.metrics.figures import Figures
from wsnsim.types import Seconds

ENERGY_COLUMNS = (
    "energy_radio_tx_j",
    "energy_radio_rx_j",
    "energy_radio_listen_j",
    "energy_radio_sleep_j",
    "energy_cpu_j",
    "energy_camera_j",
    "energy_board_j",
)
"""The columns of the `nodes` table that add up to all the energy a node drew."""


def energy(nodes: pd.DataFrame, steps: int, simulated_s: Seconds) -> Figures:
    """Return energy, work and lifetime of the motes; the base station is left out.

    - `lifetime_first_death_s`: when the first battery really emptied, None if
      none did.
    - `lifetime_first_death_extrapolated_s`: when the first battery would empty
      if every mote went on drawing what it drew on average in this run.

    Parameters
    ----------
    nodes : the record table
    steps : tracking steps in the run
    simulated_s : time from the beginning to the end of the run [s]
    """
    motes = nodes[nodes["role"] != "base"]
    drawn_j = drawn_by_node_j(motes)
    total_j = float(drawn_j.sum())
    deaths = motes["died_at_s"].dropna()
    return {
        "energy_total_j": total_j,
        "energy_per_step_j": total_j / steps if steps else None,
        "energy_max_node_j": float(drawn_j.max()) if len(motes) else None,
        "cpu_cycles_per_step": float(motes["cpu_cycles"].sum()) / steps if steps else None,
        "images_skipped": int(motes["images_skipped"].sum()),
        "lifetime_first_death_s": float(deaths.min()) if len(deaths) else None,
        "lifetime_first_death_extrapolated_s": _extrapolated_s(motes, simulated_s),
    }


def drawn_by_node_j(nodes: pd.DataFrame) -> "pd.Series[float]":
    """Return what each node drew in all [J], one for each row of the `nodes` table."""
    return nodes[list(ENERGY_COLUMNS)].sum(axis=1)


def _extrapolated_s(motes: pd.DataFrame, simulated_s: Seconds) -> float | None:
    powered = motes[motes["battery_capacity_j"].notna()]
    drawn_j = drawn_by_node_j(powered)
    powered, drawn_j = powered[drawn_j > 0], drawn_j[drawn_j > 0]
    if not len(powered) or not simulated_s > 0:
        return None
    lived_s = powered["died_at_s"].fillna(simulated_s)
    capacity_j = powered["battery_capacity_j"].astype("float64")
    return float((capacity_j * lived_s / drawn_j).min())
