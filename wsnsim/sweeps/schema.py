"""A study as frozen values: which scenarios, what is varied, which seeds."""

from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Field

from wsnsim.metrics.figures import SUMMARY_KEYS
from wsnsim.records import ROW_TYPES
from wsnsim.scenario.faults import did_you_mean, one_of, shown
from wsnsim.scenario.schema import MAX_NAME
from wsnsim.scenario.schema_base import InputFile, Part, Seed, wrong

TABLES = tuple(sorted({"steps"} | {row.table for row in ROW_TYPES} - {"images"}))
"""Tables of a run that a sweep can keep; pictures are for single runs."""

_MANY = 100_000


def _seeds(value: Any) -> Any:
    """Write out ``{first: 0, count: 15}``."""
    if isinstance(value, list):
        return value
    whole = isinstance(value, Mapping) and all(type(each) is int for each in value.values())
    if not whole or "count" not in value or set(value) - {"first", "count"}:
        raise wrong(
            f"must be a list of seeds or a mapping such as {{first: 0, count: 15}}, got {shown(value)}"
        )
    if not 1 <= value["count"] <= _MANY:
        raise wrong(f"count must be 1 to {_MANY}, got {value['count']}")
    first = value.get("first", 0)
    return list(range(first, first + value["count"]))


def _different(seeds: list[int]) -> list[int]:
    if len(set(seeds)) < len(seeds):
        again = next(seed for at, seed in enumerate(seeds) if seed in seeds[:at])
        raise wrong(f"each seed must stand once, got {again} again")
    return seeds


def _figure(key: str) -> str:
    if key not in SUMMARY_KEYS:
        near = did_you_mean(key, SUMMARY_KEYS)
        raise wrong(f"must be a figure of summary.json, got {shown(key)}{near}")
    return key


def _table(name: str) -> str:
    if name not in TABLES:
        raise wrong(f"must be one of {one_of(TABLES)}, got {shown(name)}{did_you_mean(name, TABLES)}")
    return name


Word: TypeAlias = Annotated[str, Field(pattern=r"^\w[\w.-]*$", max_length=64)]
Seeds: TypeAlias = Annotated[
    list[Seed], Field(min_length=1), BeforeValidator(_seeds), AfterValidator(_different)
]
Figure: TypeAlias = Annotated[str, AfterValidator(_figure)]
Table: TypeAlias = Annotated[str, AfterValidator(_table)]
Settings: TypeAlias = dict[str, Any]
"""Values by their paths, as after ``--set``: ``{"cameras[c1].focal_px": 250}``."""


class SeedOverride(Part):
    """What is different for some of the seeds."""

    seeds: Seeds = Field(description="the seeds")
    set: Settings = Field(description="values by path, put in for these seeds")


class StudyScenario(Part):
    """One of several scenarios of a study."""

    file: InputFile = Field(description="the scenario, from the study's folder")
    base: Settings = Field(default_factory=dict, description="values by path, put in for all cells")
    seed_overrides: tuple[SeedOverride, ...] = Field((), description="what differs for some of the seeds")


class Case(Part):
    """A cell by its name."""

    name: Word = Field(description="name of the cell")
    scenario: Word | None = Field(None, description="one of `scenarios`; null: all of them")
    set: Settings = Field(default_factory=dict, description="values by path")


class Charts(Part):
    """What the report draws."""

    x: tuple[Figure, ...] | None = Field(
        None,
        min_length=1,
        max_length=4,
        description="costs, one chart each: figures of summary.json; null: bytes on the air and energy a "
        "step, or without cameras offered load and 95th percentile of the latency",
    )
    y: Figure | None = Field(
        None,
        description="what they buy: a figure of summary.json; null: the mean position error, or without "
        "cameras the delivery ratio",
    )


class Study(Part):
    """A study: scenarios × (the default, factors around it, a grid, cases) × seeds."""

    name: str = Field(
        pattern=r"^\w[\w.-]*$",
        max_length=MAX_NAME,
        description="name of the study; the file's own where it is left out",
    )
    scenario: InputFile | None = Field(None, description="the scenario, from the study's folder")
    scenarios: dict[Word, StudyScenario] = Field(
        default_factory=dict, description="several scenarios by name, in place of `scenario`"
    )
    base: Settings = Field(default_factory=dict, description="values by path, put in for all cells")
    seeds: Seeds = Field(description="a list, or {first: 0, count: 15}")
    seed_overrides: tuple[SeedOverride, ...] = Field((), description="what differs for some of the seeds")
    factors: dict[Word, dict[str, list[Any] | dict[str, Any]]] = Field(
        default_factory=dict,
        description="one at a time around the default: a path with its values, or named levels with settings",
    )
    grid: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(
        default_factory=dict, description="paths with their values, all combinations"
    )
    cases: tuple[Case, ...] = Field((), description="further cells by name")
    baseline: str | None = Field(
        None, description="cell that the others are compared to; null: the first one of each scenario"
    )
    keep: tuple[Table, ...] = Field((), description="tables of the runs that are kept, steps for example")
    charts: Charts = Field(Charts(), description="what the report draws")
