"""The four studies behind the page, and where in them a tracker's runs are."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from wsnsim.claims.results import Results, StudyFile, read_results

TRACKERS = ("P", "T0", "T1", "T2", "T3", "T4")
SETUPS = ("A", "B")
DEPLOYMENTS = ("LCR", "FGH")
DEFAULT, PUBLISHED = "default", "published"
FORMS = (PUBLISHED, DEFAULT)
FIXED_SPREAD = ("T3-25px", "T4-25px")
FULL_WORDS = ("T0-float64", "T1-float64", "T2-float64")
"""Cells of the radio study whose numbers take eight bytes."""

ERROR_M, ERROR_PX = "position_error_mean_m", "reprojection_error_mean_px"
LOST = "lost_fraction"
SENT, WITH_RELAYS = "app_bytes_per_step", "mac_bytes_per_step"
AT_BASE = "base_ingress_bytes_per_step"
"""Over the ideal network a frame is a message without headers: bytes on the air are bytes times hops."""
OFFERED = "offered_bps"
CYCLES, JOULES, LATE = "cpu_cycles_per_step", "energy_per_step_j", "latency_p95_s"
FIGURES = (ERROR_M, ERROR_PX, LOST, SENT, WITH_RELAYS, AT_BASE, OFFERED, CYCLES, JOULES, LATE)
"""All figures that the page shows."""

_STUDIES = "scenarios/studies"
VARIANTS = StudyFile(
    "multiview-variants",
    f"{_STUDIES}/multiview_variants.yaml",
    tuple(
        f"{setup}/{cell}"
        for setup in SETUPS
        for cell in (*TRACKERS, *FIXED_SPREAD, *(f"{tracker}-published" for tracker in TRACKERS))
    ),
    keeps_steps=True,
)
FACTORS = StudyFile(
    "multiview-factors", f"{_STUDIES}/multiview_factors.yaml", ("default",), keeps_steps=False
)
RADIO = StudyFile(
    "multiview-radio", f"{_STUDIES}/multiview_radio.yaml", (*TRACKERS, *FULL_WORDS), keeps_steps=True
)
DEPLOYED = StudyFile(
    "multiview-deployments",
    f"{_STUDIES}/multiview_deployments.yaml",
    tuple(f"{place}/{tracker}" for place in DEPLOYMENTS for tracker in TRACKERS),
    keeps_steps=True,
)
STUDIES = (VARIANTS, FACTORS, RADIO, DEPLOYED)


@dataclass(frozen=True, eq=False)
class Evidence:
    """All results, seen in one of the two forms of the trackers.

    Parameters
    ----------
    variants, factors, radio, deployed : the studies' results
    form : the mended trackers, or the printed ones
    """

    variants: Results
    factors: Results
    radio: Results
    deployed: Results
    form: str = DEFAULT

    def seen_as(self, form: str) -> "Evidence":
        """Return the same results in another form."""
        return replace(self, form=form)

    @property
    def studies(self) -> tuple[Results, ...]:
        """The studies in the order of the page."""
        return (self.variants, self.factors, self.radio, self.deployed)

    def place(self, world: str, tracker: str) -> tuple[Results, str] | None:
        """Return where the runs of a tracker in a world are, in this form; None where nobody ran them."""
        results = self.variants if world in SETUPS else self.deployed
        cell = f"{world}/{tracker}" + ("-published" if self.form == PUBLISHED else "")
        return (results, cell) if cell in results else None

    def figure(self, world: str, tracker: str, key: str) -> "pd.Series[float] | None":
        """Return a figure of a tracker's runs, by seed."""
        found = self.place(world, tracker)
        return found[0].figure(found[1], key) if found is not None else None

    def steps(self, world: str, tracker: str) -> pd.DataFrame | None:
        """Return the steps of all of a tracker's runs."""
        found = self.place(world, tracker)
        return found[0].steps[found[1]] if found is not None else None


def read_evidence(folder: Path) -> Evidence:
    """Read the studies' results, each from the folder of its name.

    Raises
    ------
    OutputError : a study, a cell or a run is missing
    """
    variants, factors, radio, deployed = (read_results(study, folder / study.name) for study in STUDIES)
    return Evidence(variants, factors, radio, deployed)


def turning(evidence: Evidence) -> dict[int, bool]:
    """Tell for each seed of setup B whether the target turns, as its true orientations say."""
    steps = evidence.variants.steps["B/T0"]
    columns = ["truth_qw", "truth_qx", "truth_qy", "truth_qz"]
    return {
        int(str(seed)): bool(np.ptp(own[columns].to_numpy(np.float64), axis=0).max() > 1e-9)
        for seed, own in steps.groupby("seed")
    }
