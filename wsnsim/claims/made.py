"""What a page was made of: its studies, and the versions that ran them."""

import json
from collections.abc import Sequence

import numpy as np

from wsnsim.claims.markdown import table
from wsnsim.claims.results import Results
from wsnsim.report.wording import count


def studies_table(studies: Sequence[Results]) -> str:
    """Return cells, seeds, runs of each study."""
    rows = []
    for results in studies:
        overrides = " ".join(f"`--set {each}`" for each in results.overrides) or "none"
        rows.append(
            (
                f"[`{results.study.file}`](../{results.study.file})",
                count(len(results.cells)),
                _seeds_text(results.seeds),
                count(len(results.runs)),
                overrides,
            )
        )
    return table(("study", "cells", "seeds", "runs", "overrides"), rows)


def provenance_table(studies: Sequence[Results]) -> str:
    """Return versions and platforms that the runs were made with."""
    seen: dict[tuple[str, ...], int] = {}
    for results in studies:
        made = results.provenance.set_index("provenance")
        for number_of, runs in results.runs.groupby("provenance"):
            row = made.loc[number_of]
            libraries = ", ".join(
                f"{name} {version}" for name, version in json.loads(str(row["libraries"])).items()
            )
            key = (str(row["wsnsim"]), str(row["python"]), libraries, str(row["machine"]))
            seen[key] = seen.get(key, 0) + len(runs)
    return table(
        ("wsnsim", "Python", "libraries", "machine", "runs"),
        [(*key, count(runs)) for key, runs in seen.items()],
        numbers_from=4,
    )


def _seeds_text(seeds: tuple[int, ...]) -> str:
    whole = len(seeds) > 1 and bool(np.all(np.diff(seeds) == 1))
    return f"{seeds[0]} to {seeds[-1]}" if whole else ", ".join(str(seed) for seed in seeds)
