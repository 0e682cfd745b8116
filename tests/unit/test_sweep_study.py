"""Studies: the cells that they come to, what each cell's scenario is, and every mistake at its place."""

import importlib.util
import re
from pathlib import Path

import pytest

from wsnsim.errors import ScenarioError
from wsnsim.sweeps.study import LoadedStudy, load_study

_SPEC = importlib.util.spec_from_file_location("sweep_bench", Path(__file__).parents[1] / "sweep_bench.py")
bench = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(bench)


@pytest.fixture(autouse=True)
def tracker_on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))


def load(folder: Path, text: str, *overrides: str) -> LoadedStudy:
    return load_study(bench.write_study(folder, text), overrides)


def problems(folder: Path, text: str, *overrides: str) -> list[str]:
    with pytest.raises(ScenarioError) as told:
        load(folder, text, *overrides)
    return [str(problem).replace(f"{folder}/", "") for problem in told.value.problems]


def settings(study: LoadedStudy) -> dict[str, dict[str, object]]:
    return {cell.name: dict(cell.values) for cell in study.cells}


def test_one_factor_at_a_time_around_the_default(tmp_path: Path) -> None:
    study = load(
        tmp_path,
        """
        scenario: tiny.yaml
        seeds: [3, 1]
        factors:
          sd: {system.sd_m: [0.1, 0.5]}
          network:
            ideal: {network.standard: ideal}
            radio: {network.standard: ieee802154, duration_s: 2.0}
        cases:
          - {name: both, set: {system.sd_m: 0.5, duration_s: 2}}
        """,
    )
    assert settings(study) == {
        "default": {},
        "sd=0.1": {"system.sd_m": 0.1},
        "sd=0.5": {"system.sd_m": 0.5},
        "network=ideal": {"network.standard": "ideal"},
        "network=radio": {"network.standard": "ieee802154", "duration_s": 2.0},
        "both": {"system.sd_m": 0.5, "duration_s": 2},
    }
    assert study.study.name == "study"
    assert [(run.seed, run.cell.number) for run in study.runs] == [(s, c) for s in (3, 1) for c in range(6)]
    hashes = {run.cell.name: run.scenario_sha256 for run in study.runs if run.seed == 1}
    assert hashes["default"] == hashes["sd=0.1"] == hashes["network=ideal"]
    assert len(set(hashes.values())) == 4
    assert {study.baseline_of(cell).name for cell in study.cells} == {"default"}


def test_a_grid_is_all_combinations(tmp_path: Path) -> None:
    study = load(
        tmp_path,
        """
        scenario: tiny.yaml
        seeds: {first: 5, count: 2}
        grid:
          system.sd_m: [0.1, 0.2]
          duration_s: [1, 2, 3]
        baseline: sd_m=0.2,duration_s=1
        """,
    )
    assert list(settings(study)) == [f"sd_m={s},duration_s={d}" for s in (0.1, 0.2) for d in (1, 2, 3)]
    assert study.study.seeds == [5, 6]
    assert study.baseline_of(study.cells[0]).number == 3
    durations = [run.loaded.scenario.duration_s for run in study.runs if run.seed == 5]
    assert durations == [1, 2, 3, 1, 2, 3]


def test_several_scenarios_each_with_its_own_seeds_and_settings(tmp_path: Path) -> None:
    study = load(
        tmp_path,
        """
        scenarios:
          A: {file: tiny.yaml}
          B:
            file: tiny.yaml
            base: {duration_s: 2}
            seed_overrides:
              - {seeds: [1], set: {"world.targets[t].motion.spin.rate_radps": 0.35}}
        base: {system.sd_m: 0.3, duration_s: 3}
        seeds: [0, 1]
        seed_overrides:
          - {seeds: [0], set: {system.sd_m: 0.4}}
        cases:
          - {name: one}
          - {name: two, scenario: B, set: {system.sd_m: 0.7}}
        """,
        "cameras[c1].noise_sd=1.5",
    )
    assert [cell.name for cell in study.cells] == ["A/one", "B/one", "B/two"]
    found = {}
    for run in study.runs:
        scenario = run.loaded.scenario
        spin = scenario.world.targets[0].motion.spin.rate_radps
        found[run.cell.name, run.seed] = (scenario.duration_s, scenario.system["sd_m"], spin)
        assert scenario.seed == run.seed
        assert scenario.cameras[0].noise_sd == 1.5
        assert scenario.expect == {}
    assert found == {
        ("A/one", 0): (3, 0.4, 0),
        ("A/one", 1): (3, 0.3, 0),
        ("B/one", 0): (2, 0.4, 0),
        ("B/one", 1): (2, 0.3, 0.35),
        ("B/two", 0): (2, 0.7, 0),
        ("B/two", 1): (2, 0.7, 0.35),
    }


def test_mappings_items_and_whole_lists_can_be_values(tmp_path: Path) -> None:
    study = load(
        tmp_path,
        """
        scenario: tiny.yaml
        seeds: [0]
        grid:
          network: [{standard: ideal}, {standard: ieee802154, tx_power_dbm: -5}]
          "cameras[*].rate_hz": [2]
          cameras: [{only: [c2]}]
        """,
    )
    assert [run.loaded.scenario.network.standard for run in study.runs] == ["ideal", "ieee802154"]
    assert {[c.id for c in run.loaded.scenario.cameras] == ["c2"] for run in study.runs} == {True}
    assert study.runs[0].loaded.scenario.cameras[0].rate_hz == 2


def test_every_mistake_of_a_study_at_once(tmp_path: Path) -> None:
    said = problems(
        tmp_path,
        """\
        scenario: tinny.yaml
        seeds: {count: 0}
        base: {system..sd: 1}
        factors:
          f: {a b: [1]}
        cases:
          - {nam: x}
        keep: [step]
        charts: {y: position_error}
        """,
    )
    for line, word in [
        ("1:11", 'did you mean "tiny.yaml"'),
        ("2:8", "count must be 1 to"),
        ("3:8", "the path must look like"),
        ("5:7", "the path must look like"),
        ("7:5", "name of the cell"),
        ("7:6", 'did you mean "name"'),
        ("8:8", 'did you mean "steps"'),
        ("9:13", "must be a figure of summary.json"),
    ]:
        assert any(each.startswith(f"study.yaml:{line}: ") and word in each for each in said), (line, said)
    assert len(said) == 8


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("seeds: [0]", "study.yaml:1:1: must have either scenario or scenarios"),
        (
            "scenario: tiny.yaml\nscenarios: {A: {file: tiny.yaml}}\nseeds: [0]",
            "2:12: scenarios: must have either scenario or scenarios; got both",
        ),
        (
            "scenario: tiny.yaml\nseeds: [0]\nbase: {seed: 3}",
            "3:8: base.seed: must not be set; the study's seeds are under seeds",
        ),
        ("scenario: tiny.yaml\nseeds: [0, 1, 0]", "2:8: seeds: each seed must stand once, got 0 again"),
        ("scenario: tiny.yaml\nseeds: []", "2:8: seeds: must have at least 1 item, got 0"),
        ("scenario: tiny.yaml\nseeds: five", "2:8: seeds: must be a list of seeds or"),
        (
            "scenario: tiny.yaml\nseeds: [0]\nseed_overrides: [{seeds: [7], set: {}}]",
            "3:26: seed_overrides[0].seeds: must be seeds of the study, got 7",
        ),
        (
            "scenario: tiny.yaml\nseeds: [0]\nfactors: {f: {a: [1], b: [2]}}",
            "3:14: factors.f: must have either one path",
        ),
        (
            "scenario: tiny.yaml\nseeds: [0]\ngrid: {duration_s: [1, 1]}",
            '3:24: grid.duration_s[1]: cells must have different names, got "duration_s=1" again',
        ),
        (
            "scenario: tiny.yaml\nseeds: [0]\nbaseline: defualt",
            '3:11: baseline: must be a cell, got "defualt"; did you mean "default"?',
        ),
        (
            "scenarios: {A: {file: tiny.yaml}}\nseeds: [0]\ncases: [{name: x, scenario: B}]",
            '3:29: cases[0].scenario: must be "A", got "B"',
        ),
        ("[]", "must hold a mapping with keys such as scenario and seeds, got an empty list"),
    ],
)
def test_what_must_hold_across_keys(tmp_path: Path, text: str, says: str) -> None:
    (said,) = problems(tmp_path, text)
    assert says in said


def test_mistakes_of_a_cell_stand_where_the_study_makes_them(tmp_path: Path) -> None:
    said = problems(
        tmp_path,
        """\
        scenario: tiny.yaml
        seeds: [0, 1]
        base: {"cameras[c3].focal_px": 30}
        factors:
          size: {duration_s: [1, -1]}
        cases:
          - {name: odd, set: {system.sdm: 1, network.standard: wifi}}
        """,
    )
    assert sorted(said) == [
        'study.yaml:3:32: cameras: must have an item with the id "c3"; it has "c1" or "c2"',
        "study.yaml:5:26: duration_s: must be greater than 0, got -1 (cell size=-1)",
        'study.yaml:7:35: system.sdm: unknown key; did you mean "sd_m"? (cell odd)',
        'study.yaml:7:56: network.standard: must be "ieee802154", "ieee80211b" or "ideal", '
        'got "wifi" (cell odd)',
    ]


def test_mistakes_of_the_scenario_and_of_the_command_line(tmp_path: Path) -> None:
    study = "scenario: tiny.yaml\nseeds: [0]\n"
    (said,) = problems(tmp_path, study, "duration_s=soon")
    assert said == '--set duration_s=soon: duration_s: must be a number, got "soon"'
    (said,) = problems(tmp_path, study, "duration_s")
    assert "got no =" in said
    bench.SCENARIO, whole = bench.SCENARIO.replace("duration_s: 1.0", "duration_s: 0"), bench.SCENARIO
    try:
        (said,) = problems(tmp_path, study)
    finally:
        bench.SCENARIO = whole
    assert re.fullmatch(r"tiny.yaml:2:13: duration_s: must be greater than 0, got 0", said)


@pytest.mark.parametrize("name", ["quick", "multiview_variants", "multiview_factors"])
def test_the_studies_that_ship_are_fine(scenarios: Path, name: str) -> None:
    study = load_study(scenarios / "studies" / f"{name}.yaml")
    assert study.study.name == name.replace("_", "-")
    if name == "multiview_variants":
        rates = {
            run.seed: run.loaded.scenario.world.targets[0].motion.spin.rate_radps
            for run in study.runs
            if run.cell.name == "B/T2"
        }
        assert rates == dict(enumerate((0.0,) * 10 + (0.35, 0.45, 0.55, 0.65, 0.8)))
