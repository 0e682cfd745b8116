"""What a run hands back to Python: the summary and the tables."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from wsnsim.runs.expectations import Expectation

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Run:
    """A finished run.

    Parameters
    ----------
    summary : the QoS and QoI figures, units in the keys
    tables : the tables of results.sqlite by name, `steps` among them
    expectations : what the scenario's `expect:` came to
    folder : where the files are; None for a run that was kept in memory
    """

    summary: Mapping[str, float | int | None]
    tables: Mapping[str, "pd.DataFrame"] = field(repr=False)
    expectations: tuple[Expectation, ...]
    folder: Path | None

    @property
    def steps(self) -> "pd.DataFrame":
        """One row for each target and tracking step."""
        return self.tables["steps"]

    @property
    def nodes(self) -> "pd.DataFrame":
        """One row for each node."""
        return self.tables["nodes"]

    @property
    def messages(self) -> "pd.DataFrame":
        """One row for each message and receiver."""
        return self.tables["messages"]

    @property
    def met(self) -> bool:
        """Whether every expectation of the scenario was met."""
        return all(expectation.met for expectation in self.expectations)
