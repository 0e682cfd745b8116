"""Scenarios from files and from Python: read, put overrides in, check everything, fill in every default."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import BaseModel, ValidationError

from wsnsim.errors import Problem, ScenarioError
from wsnsim.scenario.checks import cross_faults, unseeing
from wsnsim.scenario.faults import Fault, KeyPath, one_of, shown
from wsnsim.scenario.layout_file import Plan
from wsnsim.scenario.layouts import has_layout, plan_of, written_out
from wsnsim.scenario.marks import Marks
from wsnsim.scenario.overrides import Override, apply_overrides, parse_override
from wsnsim.scenario.plain import plain_data
from wsnsim.scenario.registry import BUILT_IN, find_system
from wsnsim.scenario.schema import MAX_NAME, Scenario
from wsnsim.scenario.schema_layout import LayoutHolder
from wsnsim.scenario.standards import standard_faults, with_standard
from wsnsim.scenario.wording import faults_of
from wsnsim.scenario.yaml_marks import Document, read_yaml

if TYPE_CHECKING:
    from wsnsim.systems.base import System, SystemParams

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario that was checked, with its tracking system and the folder that its files are found from."""

    scenario: Scenario
    """Complete: every default filled in, files by their absolute paths."""
    system: "System[Any]"
    system_params: "SystemParams"
    path: Path | None
    """The file it came from; None for one made in Python."""
    base_dir: Path
    marks: Marks = field(repr=False, compare=False)

    def resolve_path(self, text: str) -> Path:
        """Return the place of a file that the scenario names."""
        return self.base_dir / text

    def error(self, path: KeyPath, message: str) -> ScenarioError:
        """Return the error to raise for a value that turns out wrong later, with its place in the file."""
        return ScenarioError([self.marks.problem(Fault(path, message))])


def load_scenario(path: str | Path, overrides: Sequence[str] = (), seed: int | None = None) -> LoadedScenario:
    """Read a scenario from a YAML file.

    Parameters
    ----------
    path : the file
    overrides : texts such as ``cameras[c1].focal_px=250``, put in one after the other
    seed : takes the place of the scenario's own, after the overrides

    Raises
    ------
    ScenarioError : every problem at once, each with its line or its override
    """
    file = Path(path)
    document = read_yaml(file)
    parsed: list[Override] = []
    problems: list[Problem] = []
    for text in overrides:
        try:
            parsed.append(parse_override(text))
        except ScenarioError as error:
            problems += error.problems
    if seed is not None:
        parsed.append(Override(f"--seed {seed}", ("seed",), seed))
    return overridden_scenario(document, file, parsed, problems)


def overridden_scenario(
    document: Document, file: Path, overrides: Sequence[Override], problems: Sequence[Problem] = ()
) -> LoadedScenario:
    """Make a scenario from a file's document.

    Parameters
    ----------
    document : what was read from `file`
    overrides : put in one after the other
    problems : found before, to be told together with all others

    Raises
    ------
    ScenarioError : every problem at once
    """
    if not isinstance(document.data, Mapping):
        got = "an empty file" if document.data is None else shown(document.data)
        message = f"must hold a mapping with keys such as name and world, got {got}"
        raise ScenarioError([Problem("", message, file), *problems])
    overridden = apply_overrides(document.data, overrides)
    marks = Marks(document, overridden.arguments)
    data = {"name": name_of(file), **overridden.data}
    folder = file.absolute().parent
    return _checked(data, marks, [*document.problems, *problems, *overridden.problems], file, folder)


def scenario_from_dict(data: Mapping[str, Any], base_dir: str | Path = ".") -> LoadedScenario:
    """Make a scenario from plain data, as a YAML file would hold it.

    Parameters
    ----------
    data : numbers, text, lists and mappings; tuples, paths and NumPy values are taken too
    base_dir : folder from which the files it names are found

    Raises
    ------
    ScenarioError : every problem at once, each with its path
    """
    plain = plain_data(data)
    if not isinstance(plain, dict):
        raise ScenarioError([Problem("", f"must be a mapping, got {shown(plain)}")])
    marks = Marks(Document(plain, {}, {}, (), None), {})
    return _checked({"name": "scenario", **plain}, marks, [], None, Path(base_dir).absolute())


def _checked(
    data: dict[str, Any], marks: Marks, problems: Sequence[Problem], file: Path | None, base_dir: Path
) -> LoadedScenario:
    """Check plain data as a whole and make a scenario of it."""
    data, faults = _with_layout(data, base_dir)
    data = with_standard(data)
    scenario, section_faults = validated(Scenario, data, {"base_dir": base_dir})
    system, params, system_faults = _system_of(data.get("system"))
    faults += [*section_faults, *system_faults, *cross_faults(data), *standard_faults(data)]
    if system is not None:
        # who does not say which system shall run is not asked for what another one needs
        faults += unseeing(data, system.needs_cameras)
    found = [*problems, *(marks.problem(fault) for fault in dict.fromkeys(faults))]
    if found or scenario is None or system is None or params is None:
        raise ScenarioError(sorted(found, key=_reading_order))
    complete = scenario.model_copy(update={"system": params.model_dump(mode="json")})
    return LoadedScenario(complete, system, params, file, base_dir, marks)


def _with_layout(data: dict[str, Any], base_dir: Path) -> tuple[dict[str, Any], list[Fault]]:
    """Write a layout out as the nodes it stands for, or say what is wrong with it."""
    if not has_layout(data):
        return data, []
    motes = data["motes"]
    held, faults = validated(LayoutHolder, {"layout": motes["layout"]}, {"base_dir": base_dir})
    plan = None
    if held is None:
        faults = [replace(fault, path=("motes", *fault.path)) for fault in faults]
    else:
        plan, faults = plan_of(held.layout, data.get("seed", Scenario.model_fields["seed"].default))
    # without its layout the rest is looked at as if it had a base station and a mote somewhere
    somewhere = (0.0, 0.0, 0.0)
    return written_out(data, Plan((somewhere, somewhere)) if plan is None else plan), faults


def _system_of(section: Any) -> "tuple[System[Any] | None, SystemParams | None, list[Fault]]":
    """Find the tracking system and check its section against its own parameters."""
    if not isinstance(section, Mapping):
        return None, None, []
    kind = section.get("kind")
    if not isinstance(kind, str):
        known = f'{one_of(sorted(BUILT_IN))}, or your own "package.module:ATTRIBUTE"'
        got = f"must be {known}, got {shown(kind)}" if "kind" in section else f"must be given: {known}"
        return None, None, [Fault(("system", "kind"), got)]
    try:
        system = find_system(kind)
    except ScenarioError as error:
        return None, None, [Fault(("system", "kind"), problem.message) for problem in error.problems]
    params, faults = validated(system.params, section, None)
    return system, params, [replace(fault, path=("system", *fault.path)) for fault in faults]


def validated(model: type[M], data: Any, context: Any) -> tuple[M | None, list[Fault]]:
    """Check data against a model: no text for numbers, no fractions for whole numbers, lists for tuples."""
    try:
        return model.model_validate_json(json.dumps(data), strict=True, context=context), []
    except ValidationError as error:
        return None, faults_of(error, model, data)


def _reading_order(problem: Problem) -> tuple[bool, int, int]:
    """Sort by line; what stands on the command line comes last."""
    return (problem.argument is not None, problem.line or 0, problem.column or 0)


def name_of(file: Path) -> str:
    """Make a scenario's name of its file's."""
    kept = "".join(c if c.isalpha() or c.isdecimal() or c in "_." else "-" for c in file.stem)
    return re.sub("-+", "-", kept).strip(".-")[:MAX_NAME] or "scenario"
