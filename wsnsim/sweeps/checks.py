"""What must hold across the keys of a study."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from wsnsim.scenario.faults import Fault, KeyPath, did_you_mean, one_of, shown
from wsnsim.scenario.overrides import parse_path
from wsnsim.sweeps.cells import CASES, GRID, Cell, cells_of, scenarios_of
from wsnsim.sweeps.schema import SeedOverride, Study


def path_faults(data: Any) -> Iterator[Fault]:
    """Yield the paths that cannot be read, of a study whose keys may be wrong in any way."""
    if not isinstance(data, Mapping):
        return
    for place, settings in _settings(data):
        if isinstance(settings, Mapping):
            for path in settings:
                if path == "seed":
                    message = "must not be set; the study's seeds are under seeds"
                    yield Fault((*place, path), message, of_key=True)
                try:
                    parse_path(path)
                except ValueError as error:
                    yield Fault((*place, path), str(error), of_key=True)


def study_faults(study: Study) -> Iterator[Fault]:
    """Yield what is wrong with a study whose keys are right by themselves."""
    if (study.scenario is None) == (not study.scenarios):
        both = "; got both" if study.scenarios else ""
        yield Fault(
            ("scenarios",) if study.scenarios else (), f"must have either scenario or scenarios{both}"
        )
        return
    yield from _factor_faults(study)
    yield from _case_faults(study)
    yield from _seed_faults(study.seeds, study.seed_overrides, ())
    for name, each in study.scenarios.items():
        yield from _seed_faults(study.seeds, each.seed_overrides, ("scenarios", name))
    cells = cells_of(study)
    yield from _name_faults(cells)
    if study.baseline is not None:
        known = {cell.label for cell in cells}
        for scenario in scenarios_of(study):
            if study.baseline not in {cell.label for cell in cells if cell.scenario == scenario}:
                near = did_you_mean(study.baseline, known)
                of = f" of scenario {scenario}" if scenario else ""
                yield Fault(("baseline",), f"must be a cell{of}, got {shown(study.baseline)}{near}")


def _settings(data: Mapping[str, Any]) -> Iterator[tuple[KeyPath, Any]]:
    """Yield every mapping from paths to values, with its place."""
    yield ("base",), data.get("base")
    yield ("grid",), data.get("grid")
    yield from _overrides(data, ())
    for name, scenario in _items(data.get("scenarios")):
        if isinstance(scenario, Mapping):
            yield ("scenarios", name, "base"), scenario.get("base")
            yield from _overrides(scenario, ("scenarios", name))
    for at, case in enumerate(_list(data.get("cases"))):
        if isinstance(case, Mapping):
            yield ("cases", at, "set"), case.get("set")
    for factor, levels in _items(data.get("factors")):
        for level, content in _items(levels):
            if isinstance(content, Mapping):
                yield ("factors", factor, level), content
            elif isinstance(content, list):
                yield ("factors", factor), {level: content}


def _overrides(data: Mapping[str, Any], place: KeyPath) -> Iterator[tuple[KeyPath, Any]]:
    for at, override in enumerate(_list(data.get("seed_overrides"))):
        if isinstance(override, Mapping):
            yield (*place, "seed_overrides", at, "set"), override.get("set")


def _items(value: Any) -> list[tuple[str, Any]]:
    return list(value.items()) if isinstance(value, Mapping) else []


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _factor_faults(study: Study) -> Iterator[Fault]:
    for factor, levels in study.factors.items():
        place: KeyPath = ("factors", factor)
        if factor in (GRID, CASES):
            yield Fault(place, f"a factor must not be called {GRID} or {CASES}", of_key=True)
        lists = [key for key, content in levels.items() if isinstance(content, list)]
        if not levels or (lists and len(levels) > 1):
            yield Fault(
                place,
                "must have either one path with a list of values, or named levels, each with its settings",
            )
        for key in lists:
            if not levels[key]:
                yield Fault((*place, key), "must have at least 1 item, got 0")


def _case_faults(study: Study) -> Iterator[Fault]:
    for at, case in enumerate(study.cases):
        if case.scenario is not None and case.scenario not in study.scenarios:
            known = one_of(study.scenarios) if study.scenarios else "left out in a study of one scenario"
            near = did_you_mean(case.scenario, study.scenarios)
            yield Fault(("cases", at, "scenario"), f"must be {known}, got {shown(case.scenario)}{near}")


def _seed_faults(seeds: Sequence[int], overrides: Sequence[SeedOverride], place: KeyPath) -> Iterator[Fault]:
    for at, override in enumerate(overrides):
        strange = [seed for seed in override.seeds if seed not in set(seeds)]
        if strange:
            yield Fault(
                (*place, "seed_overrides", at, "seeds"),
                f"must be seeds of the study, got {strange[0]}",
            )


def _name_faults(cells: Sequence[Cell]) -> Iterator[Fault]:
    seen: set[str] = set()
    for cell in cells:
        if cell.name in seen:
            place = cell.settings[0].place if cell.settings else ()
            if cell.factor == CASES and cell.settings:
                place = (*cell.settings[0].place[:2], "name")
            yield Fault(place, f"cells must have different names, got {shown(cell.name)} again")
        seen.add(cell.name)
