"""Values from the command line: where they go, and what happens where they cannot."""

import copy

import pytest

from wsnsim.errors import ScenarioError
from wsnsim.scenario.overrides import apply_overrides, parse_override

DATA = {
    "seed": 1,
    "cameras": [{"id": "c1", "focal_px": 300, "position_m": [0, 1, 2]}, {"id": "c2"}],
    "motes": None,
}


def put(*texts):
    return apply_overrides(DATA, [parse_override(text) for text in texts])


@pytest.mark.parametrize(
    ("text", "path", "value"),
    [
        ("seed=5", ["seed"], 5),
        ("seed=", ["seed"], None),
        ("a.b.c=off", ["a", "b", "c"], "off"),
        ("a=1e-3", ["a"], 1e-3),
        ("a=12:30", ["a"], "12:30"),
        ("a=[1, {b: x}]", ["a"], [1, {"b": "x"}]),
        ("a==1", ["a"], "=1"),
        ("expect.x=< 0.12", ["expect", "x"], "< 0.12"),
        ("expect.x='>= 0'", ["expect", "x"], ">= 0"),
        ("cameras[0].focal_px=250", ["cameras", 0, "focal_px"], 250),
        ("cameras[c2].focal_px=250", ["cameras", 1, "focal_px"], 250),
        ("cameras[c1].position_m[2]=.5", ["cameras", 0, "position_m", 2], 0.5),
        ("cameras[1]={id: c9}", ["cameras", 1], {"id": "c9"}),
        ("motes.default.radio=x", ["motes", "default", "radio"], "x"),
    ],
)
def test_values_go_where_the_path_says(text, path, value):
    before = copy.deepcopy(DATA)
    overridden = put(text)
    found = overridden.data
    for step in path:
        found = found[step]
    assert found == value
    assert type(found) is type(value)
    assert before == DATA
    assert overridden.problems == ()
    assert set(overridden.arguments.values()) == {f"--set {text}"}


def test_the_rest_stays():
    data = put("cameras[c1].focal_px=250").data
    assert data == {**DATA, "cameras": [{**DATA["cameras"][0], "focal_px": 250}, {"id": "c2"}]}


def test_later_overrides_win_and_see_earlier_ones():
    overridden = put("cameras[c2].id=c5", "cameras[c5].focal_px=1", "cameras[c5].focal_px=2")
    assert overridden.data["cameras"][1] == {"id": "c5", "focal_px": 2}
    assert overridden.arguments["cameras", 1, "focal_px"] == "--set cameras[c5].focal_px=2"


def test_everything_made_on_the_way_belongs_to_the_argument():
    assert set(put("net.mac.min_be=3").arguments) == {("net",)}
    assert set(put("motes.base.id=b").arguments) == {("motes",)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seed", "must be path=value, got no ="),
        ("=3", 'the path must look like cameras[0].focal_px, got ""'),
        ("a..b=3", 'the path must look like cameras[0].focal_px, got "a..b"'),
        ("a[0=3", 'the path must look like cameras[0].focal_px, got "a[0"'),
        ("a[]=3", 'the path must look like cameras[0].focal_px, got "a[]"'),
        (".a=3", 'the path must look like cameras[0].focal_px, got ".a"'),
        ("a b=3", 'the path must look like cameras[0].focal_px, got "a b"'),
        (
            "a=>= 0",
            "a: must be YAML, but did not find expected comment or line break while scanning a block scalar "
            "that begins at 1:1; text with YAML's own characters needs quotes",
        ),
        ("a={b: 1, b: 2}", "a: key must stand once in its mapping, got it again (first at 1:2)"),
        (f"{'a.' * 60}a=1", "the path must have at most 50 steps"),
    ],
)
def test_what_is_no_override(text, message):
    with pytest.raises(ScenarioError) as caught:
        parse_override(text)
    assert str(caught.value) == f"--set {text}: {message}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seed.x=3", 'seed: must be a mapping to take the key "x", got 1'),
        ("cameras.c1=3", 'cameras: must be a mapping to take the key "c1", got a list of 2'),
        ("cameras[2].id=3", "cameras: the item must be one of 0 to 1, got 2"),
        ("cameras[k1].id=3", 'cameras: must have an item with the id "k1"; it has "c1" or "c2"'),
        ("cameras[1].a[0]=3", "cameras[1].a: must be a list to have the item [0], got no such key"),
        ("seed[x]=3", "seed: must be a list to have the item [x], got 1"),
    ],
)
def test_overrides_without_a_place(text, message):
    overridden = put(text, "seed=8")
    assert [str(problem) for problem in overridden.problems] == [f"--set {text}: {message}"]
    assert overridden.data == {**DATA, "seed": 8}


def test_all_items_of_a_list_at_once():
    overridden = put("cameras[*].focal_px=9")
    assert [camera["focal_px"] for camera in overridden.data["cameras"]] == [9, 9]
    assert set(overridden.arguments) == {("cameras", 0, "focal_px"), ("cameras", 1, "focal_px")}
    (problem,) = put("motes[*].radio=x").problems
    assert problem.message == "must be a list to have items [*], got no such key"


def test_items_of_a_list_chosen_by_their_ids():
    assert put("cameras={only: [c2]}").data["cameras"] == [{"id": "c2"}]
    assert put("cameras={only: [c2, c1]}").data["cameras"] == DATA["cameras"]
    assert put("seed={only: [c2]}").data["seed"] == {"only": ["c2"]}
    (problem,) = put("cameras={only: [c3]}").problems
    assert 'must have an item with the id "c3"' in problem.message
    (problem,) = put("cameras={only: c2}").problems
    assert problem.message == 'only: must be a list of ids, got "c2"'
