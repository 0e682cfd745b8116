"""The JSON Schema says of a scenario what the loader says, as far as a schema can."""

import json
import re
from pathlib import Path

import pytest

from wsnsim.errors import ScenarioError
from wsnsim.runs.json_schema import scenario_json_schema
from wsnsim.scenario.load import load_scenario
from wsnsim.scenario.resolved import resolved_yaml
from wsnsim.scenario.yaml_marks import read_yaml

jsonschema = pytest.importorskip("jsonschema")

ROOT = Path(__file__).parents[2]
SHIPPED = [
    *sorted(file for file in (ROOT / "scenarios").rglob("*.yaml") if file.parent.name != "studies"),
    ROOT / "wsnsim" / "cli" / "assets" / "scenario.yaml",
]


@pytest.fixture(scope="module")
def schema():
    return scenario_json_schema()


@pytest.fixture(scope="module")
def validator(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def complaints(validator, data):
    return [f"{error.json_path}: {error.message}" for error in validator.iter_errors(data)]


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.name)
def test_the_shipped_scenarios_pass_as_written_and_as_resolved(validator, file, tmp_path):
    assert complaints(validator, read_yaml(file).data) == []
    resolved = tmp_path / "resolved.yaml"
    resolved.write_text(resolved_yaml(load_scenario(file)))
    assert complaints(validator, read_yaml(resolved).data) == []


def loads(file, override):
    try:
        load_scenario(file, (override,))
    except ScenarioError:
        return False
    return True


@pytest.mark.parametrize(
    ("override", "sound"),
    [
        ("seed=7", True),
        ("seed=-1", False),
        ("seed='7'", False),
        ("duration_s=3", True),
        ("duration_s='3'", False),
        ("duration_s=0", False),
        ("duration=3", False),
        ("name=größe-2", True),
        ("name='a b'", False),
        ("world.targets[0].id=Säule_1", True),
        ("world.targets[0].id='1a'", False),
        ("world.size_m=[1, 2]", False),
        ("world.size_m=[90, 90, 9]", True),
        ("world.targets[0].motion={kind: waypoint, points_m: [[1, 1, 1]]}", False),
        ("world.targets[0].motion={points_m: [[1, 1, 1]]}", False),
        ("world.targets[0].motion={kind: waypoints, points_m: [[5, 4, 1]], scale: 2}", False),
        ("world.targets[0].motion={kind: waypoints, points_m: [[5, 4, 1]]}", True),
        ("world.targets[0].shape.texture={colours: 3, patches: 4}", True),
        ("world.targets[0].shape.texture={colour: 3}", False),
        ("cameras[0].background=photo/cofee", False),
        ("cameras[0].background=photo/china", True),
        ("motes.default.platform=imote3", False),
        ("motes.default.platform=telosb", True),
        ("motes.default.battery={kind: capacity}", False),
        ("motes.default.battery={kind: capacity, capacity_j: 10}", True),
        ("motes.default.battery={kind: mains, capacity_j: 10}", False),
        ("motes.base.radio=null", True),
        ("network.standard=zigbee", False),
        ("network={}", True),
        ("network.mac.min_be=3.5", False),
        ("network={propagation: {exponent: 2.5}}", True),
        ("network={propagation: {kind: free_space}}", True),
        ("network={propagation: {exponnt: 2.5}}", False),
        ("network={propagation: {kind: log}}", False),
        ("network={routing: {repair: {hop_limit: 4}}}", True),
        ("network={routing: {kind: etx_tree, estimate: probes}}", True),
        ("network={routing: {repair: {hop_limit: 0}}}", False),
        ("network={routing: {kind: min_hops}}", False),
        ("system={kind: multiview}", True),
        ("system={kind: multiviw}", False),
        ("system={particles: 100}", False),
        ("system.particles=9", False),
        ("system.particle=100", False),
        ("system.likelihood={kind: raw, sharpness: 2}", False),
        ("system.likelihood={kind: bhattacharyya, sharpness: 2}", True),
        ("system.encoding=uint7", False),
        ("record={images: [c1], image_steps: [1, 5]}", True),
        ("record={images: [c1], image_steps: [0]}", False),
        ("expect={position_error_mean_m: '< 1'}", True),
        ("expect={position_error_mean_m: 'about 1'}", False),
        ("expect={position_error_mean_m: 1}", False),
    ],
)
def test_the_schema_and_the_loader_agree(validator, scenarios, override, sound):
    """`--set` puts the value in as YAML would read it."""
    from wsnsim.scenario.overrides import apply_overrides, parse_override

    file = scenarios / "quickstart.yaml"
    data = apply_overrides(read_yaml(file).data, [parse_override(override)]).data
    assert loads(file, override) is sound
    found = complaints(validator, data)
    assert (found == []) is sound, found


def test_a_mistake_in_a_kind_is_told_of_that_kind_alone(validator, scenarios):
    data = read_yaml(scenarios / "quickstart.yaml").data
    data["system"]["particles"] = "many"
    assert complaints(validator, data) == ["$.system.particles: 'many' is not of type 'integer'"]


def test_a_system_of_ones_own_may_have_any_keys(validator, scenarios):
    data = read_yaml(scenarios / "quickstart.yaml").data
    data["system"] = {"kind": "mypackage.tracker:SYSTEM", "anything": [1, 2]}
    assert complaints(validator, data) == []


def test_expectations_are_of_figures_that_there_are(validator, scenarios):
    data = read_yaml(scenarios / "quickstart.yaml").data
    data["expect"] = {"position_eror_mean_m": "< 1"}
    assert len(complaints(validator, data)) == 1


def sections(node, path=""):
    """Yield every part of a schema that lists properties."""
    if isinstance(node, dict):
        if isinstance(node.get("properties"), dict):
            yield path, node
        for word, value in node.items():
            yield from sections(value, f"{path}/{word}")
    elif isinstance(node, list):
        for number, value in enumerate(node):
            yield from sections(value, f"{path}/{number}")


def test_every_key_is_described_and_every_reference_leads_somewhere(schema):
    text = json.dumps(schema)
    referred = set(re.findall(r'"#/\$defs/([^"]+)"', text))
    assert referred <= set(schema["$defs"])
    undescribed = [
        f"{path}: {key}"
        for path, section in sections(schema)
        if "if" not in path.split("/")
        for key, value in section["properties"].items()
        if "description" not in value and "$ref" not in value
    ]
    assert undescribed == []
    assert "discriminator" not in text
    assert "multiview" in schema["$defs"]


def test_the_schema_is_the_same_every_time(schema):
    assert json.dumps(scenario_json_schema()) == json.dumps(schema)
