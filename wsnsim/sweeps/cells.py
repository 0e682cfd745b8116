"""The cells of a study: what is varied, written out."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from wsnsim.scenario.faults import KeyPath
from wsnsim.sweeps.schema import Settings, Study, StudyScenario

DEFAULT = "default"
GRID, CASES = "grid", "cases"
"""Groups of cells that belong to no factor."""


@dataclass(frozen=True)
class Setting:
    """One value of a cell, and where the study says so."""

    path: str
    value: Any
    place: KeyPath


@dataclass(frozen=True)
class Cell:
    """One set of settings, run with every seed.

    Parameters
    ----------
    number : from 0, in the order of the study
    name : unique in the study
    scenario : name of its scenario; empty where a study has a single one
    factor : the group it belongs to: a factor's name, `grid` or `cases`; empty for the default
    level : its name inside the group
    settings : put in after the study's and the scenario's own
    """

    number: int
    name: str
    scenario: str
    factor: str
    level: str
    settings: tuple[Setting, ...]

    @property
    def label(self) -> str:
        """The name without the scenario."""
        return self.name.removeprefix(f"{self.scenario}/") if self.scenario else self.name

    @property
    def values(self) -> Mapping[str, Any]:
        """The settings by their paths."""
        return {setting.path: setting.value for setting in self.settings}


def scenarios_of(study: Study) -> dict[str, tuple[StudyScenario, KeyPath]]:
    """Return the scenarios by name, each with its place in the study; a single one has no name."""
    if study.scenario is not None:
        return {"": (StudyScenario(file=study.scenario), ())}
    return {name: (each, ("scenarios", name)) for name, each in study.scenarios.items()}


def cells_of(study: Study) -> tuple[Cell, ...]:
    """Return all cells: for each scenario the default, the factors, the grid and the cases."""
    found: list[Cell] = []
    for scenario in scenarios_of(study):
        for factor, label, level, settings in _designed(study, scenario):
            name = f"{scenario}/{label}" if scenario else label
            found.append(Cell(len(found), name, scenario, factor, level, settings))
    return tuple(found)


def settings_at(settings: Settings, place: KeyPath) -> tuple[Setting, ...]:
    """Return the settings that stand at a place of the study."""
    return tuple(Setting(path, value, (*place, path)) for path, value in settings.items())


def _designed(study: Study, scenario: str) -> Iterator[tuple[str, str, str, tuple[Setting, ...]]]:
    """Yield factor, label, level and settings of each cell of a scenario."""
    if study.factors or not (study.grid or study.cases):
        yield "", DEFAULT, DEFAULT, ()
    for factor, levels in study.factors.items():
        for level, settings in _levels(levels, ("factors", factor)):
            yield factor, f"{factor}={level}", level, settings
    if study.grid:
        names = _short_names(list(study.grid))
        for combination in product(*(range(len(values)) for values in study.grid.values())):
            chosen = [
                Setting(path, values[at], ("grid", path, at))
                for at, (path, values) in zip(combination, study.grid.items(), strict=True)
            ]
            label = ",".join(f"{names[each.path]}={value_label(each.value)}" for each in chosen)
            yield GRID, label, label, tuple(chosen)
    for at, case in enumerate(study.cases):
        if case.scenario is None or case.scenario == scenario:
            yield CASES, case.name, case.name, settings_at(case.set, ("cases", at, "set"))


def _levels(
    levels: Mapping[str, list[Any] | dict[str, Any]], place: KeyPath
) -> Iterator[tuple[str, tuple[Setting, ...]]]:
    """Yield name and settings of each level of a factor."""
    for key, content in levels.items():
        if isinstance(content, dict):
            yield key, settings_at(content, (*place, key))
        else:
            for at, value in enumerate(content):
                yield value_label(value), (Setting(key, value, (*place, key, at)),)


def _short_names(paths: Sequence[str]) -> dict[str, str]:
    """Return the last key of each path, or the whole path where that is another's too."""
    last = {path: path.rpartition(".")[2] for path in paths}
    return {path: name if list(last.values()).count(name) == 1 else path for path, name in last.items()}


def value_label(value: Any) -> str:
    """Write a value as short as it can be told from others: ``T2``, ``log_ratio``, ``fixed:sd_m=0.1``."""
    if isinstance(value, Mapping) and isinstance(value.get("kind"), str):
        others = [f"{key}={value_label(each)}" for key, each in value.items() if key != "kind"]
        return ":".join([value["kind"], *others])
    if isinstance(value, str):
        return value
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)
