"""Studies from YAML files: read, checked, and every cell's scenario made and checked too."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from wsnsim.errors import Problem, ScenarioError
from wsnsim.scenario.faults import shown
from wsnsim.scenario.load import LoadedScenario, name_of, overridden_scenario, validated
from wsnsim.scenario.marks import Marks
from wsnsim.scenario.overrides import Override, parse_override, parse_path
from wsnsim.scenario.resolved import scenario_hash
from wsnsim.scenario.yaml_marks import Document, read_yaml
from wsnsim.sweeps.cells import Cell, Setting, cells_of, scenarios_of, settings_at
from wsnsim.sweeps.checks import path_faults, study_faults
from wsnsim.sweeps.schema import SeedOverride, Study


@dataclass(frozen=True)
class PlannedRun:
    """One run of a study.

    Parameters
    ----------
    cell : its cell
    seed : its seed
    settings : everything put into the cell's scenario file, in this order
    loaded : the scenario, complete
    scenario_sha256 : of all that the run depends on; the same for cells that come to the same
    """

    cell: Cell
    seed: int
    settings: tuple[tuple[str, Any], ...]
    loaded: LoadedScenario
    scenario_sha256: str


@dataclass(frozen=True)
class LoadedStudy:
    """A study that was checked, with all its runs.

    Parameters
    ----------
    study : complete, files by their absolute paths
    path : the file it came from
    text : of that file
    overrides : values from the command line, put into every run last
    cells : in the order of the study
    runs : seed by seed, so that each cell has its first run before any has its second
    """

    study: Study
    path: Path
    text: str
    overrides: tuple[str, ...]
    cells: tuple[Cell, ...]
    runs: tuple[PlannedRun, ...]

    def baseline_of(self, cell: Cell) -> Cell:
        """Return the cell of the same scenario that the others are compared to."""
        same = [each for each in self.cells if each.scenario == cell.scenario]
        return next((each for each in same if each.label == self.study.baseline), same[0])


def load_study(path: str | Path, overrides: Sequence[str] = ()) -> LoadedStudy:
    """Read a study from a YAML file, and every scenario that it comes to.

    Parameters
    ----------
    path : the file
    overrides : texts such as ``system.particles=250``, put into every run after all settings

    Raises
    ------
    ScenarioError : every problem at once, each with its line and, if it is one cell's alone, the cell
    """
    file = Path(path)
    document = read_yaml(file)
    study = _read(document, file)
    last: list[tuple[str, Override]] = []
    problems: list[Problem] = []
    for text in overrides:
        try:
            last.append((text.partition("=")[0].strip(), parse_override(text)))
        except ScenarioError as error:
            problems += error.problems
    if problems:
        raise ScenarioError(problems)
    cells = cells_of(study)
    runs = _Planner(study, document, file, tuple(last)).runs(cells)
    return LoadedStudy(study, file, file.read_text("utf-8-sig"), tuple(overrides), cells, runs)


def _read(document: Document, file: Path) -> Study:
    if not isinstance(document.data, Mapping):
        got = "an empty file" if document.data is None else shown(document.data)
        message = f"must hold a mapping with keys such as scenario and seeds, got {got}"
        raise ScenarioError([Problem("", message, file)])
    data = {"name": name_of(file), **document.data}
    study, faults = validated(Study, data, {"base_dir": file.absolute().parent})
    faults += path_faults(data)
    if study is not None and not faults:
        faults += study_faults(study)
    marks = Marks(document, {})
    problems = [*document.problems, *(marks.problem(fault) for fault in dict.fromkeys(faults))]
    if problems or study is None:
        raise ScenarioError(sorted(problems, key=lambda each: (each.line or 0, each.column or 0)))
    return study


@dataclass(frozen=True)
class _Planner:
    """Makes the scenarios of all runs and gathers what is wrong with them."""

    study: Study
    document: Document
    file: Path
    last: tuple[tuple[str, Override], ...]

    def runs(self, cells: Sequence[Cell]) -> tuple[PlannedRun, ...]:
        """Return all runs.

        Raises
        ------
        ScenarioError : every problem of every cell
        """
        found: dict[tuple[int, int], PlannedRun] = {}
        by_problem: dict[Problem, list[str]] = {}
        scenarios = scenarios_of(self.study)
        documents: dict[str, Document] = {}
        for name, (scenario, _) in scenarios.items():
            documents[name] = read_yaml(Path(scenario.file))
        for cell in cells:
            scenario, place = scenarios[cell.scenario]
            for seeds, between in _seed_groups(self.study, scenario.seed_overrides, place):
                settings = (
                    *settings_at(self.study.base, ("base",)),
                    *settings_at(scenario.base, (*place, "base")),
                    *between,
                    *cell.settings,
                )
                try:
                    loaded = self._loaded(documents[cell.scenario], Path(scenario.file), settings)
                except ScenarioError as error:
                    for problem in error.problems:
                        by_problem.setdefault(problem, []).append(cell.name)
                    continue
                values = (
                    *((each.path, each.value) for each in settings),
                    *((key, each.value) for key, each in self.last),
                )
                for seed in seeds:
                    seeded = replace(loaded, scenario=loaded.scenario.model_copy(update={"seed": seed}))
                    digest = scenario_hash(seeded)
                    found[seed, cell.number] = PlannedRun(cell, seed, values, seeded, digest)
        if by_problem:
            raise ScenarioError([_of_cells(*each, len(cells)) for each in by_problem.items()])
        order = {seed: at for at, seed in enumerate(self.study.seeds)}
        return tuple(found[key] for key in sorted(found, key=lambda key: (order[key[0]], key[1])))

    def _loaded(self, document: Document, file: Path, settings: Sequence[Setting]) -> LoadedScenario:
        """Make the scenario of a cell; what a study has no use for is left out of it."""
        overrides = [
            Override(self._where(setting), parse_path(setting.path), setting.value) for setting in settings
        ]
        # a study compares: expectations are for single runs, and so are pictures
        without = [
            Override("a sweep", ("expect",), {}),
            Override("a sweep", ("record",), {"frames": "frames" in self.study.keep}),
        ]
        return overridden_scenario(document, file, [*without, *overrides, *(each for _, each in self.last)])

    def _where(self, setting: Setting) -> str:
        """Say where in the study a setting stands."""
        values = self.document.values
        line, column = values.get(setting.place) or values[setting.place[:-1]]
        return f"{self.file}:{line}:{column}"


def _seed_groups(
    study: Study, own: Sequence[SeedOverride], place: tuple[str | int, ...]
) -> list[tuple[list[int], tuple[Setting, ...]]]:
    """Return seeds that have the same settings, with these settings."""
    groups: dict[tuple[int, ...], list[int]] = {}
    overrides = [
        *((each, ("seed_overrides", at, "set")) for at, each in enumerate(study.seed_overrides)),
        *((each, (*place, "seed_overrides", at, "set")) for at, each in enumerate(own)),
    ]
    for seed in study.seeds:
        key = tuple(at for at, (override, _) in enumerate(overrides) if seed in override.seeds)
        groups.setdefault(key, []).append(seed)
    return [
        (
            seeds,
            tuple(setting for at in key for setting in settings_at(overrides[at][0].set, overrides[at][1])),
        )
        for key, seeds in groups.items()
    ]


def _of_cells(problem: Problem, names: Sequence[str], cells: int) -> Problem:
    """Say whose problem it is, unless it is everybody's."""
    whose = list(dict.fromkeys(names))
    if len(whose) == cells:
        return problem
    more = f" and {len(whose) - 1} more" if len(whose) > 1 else ""
    return replace(problem, message=f"{problem.message} (cell {whose[0]}{more})")
