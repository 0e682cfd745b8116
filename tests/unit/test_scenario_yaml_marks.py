"""YAML 1.2 with marks: what plain text becomes, where it stands, what is refused."""

import importlib.util
import math
from pathlib import Path

import pytest
import yaml

from wsnsim.errors import ScenarioError
from wsnsim.scenario.yaml_marks import read_yaml, read_yaml_text


def error_of(text, file=None):
    with pytest.raises(ScenarioError) as caught:
        read_yaml_text(text, file)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *(
            (t, t)
            for t in [
                "off",
                "On",
                "yes",
                "NO",
                "y",
                "12:30",
                "1_000",
                "0b11",
                "0O7",
                "2024-01-01",
                "=",
                "tRUE",
            ]
        ),
        *((t, t) for t in [*[".", "-.", "+", "+.nan", "-.nan", ".iNF", "0x", "1.2.3", "nULL"], "< 0.12"]),
        *((t, True) for t in ["true", "True", "TRUE"]),
        *((t, False) for t in ["false", "False", "FALSE"]),
        *((t, None) for t in ["null", "Null", "NULL", "~", ""]),
        ("0o17", 15),
        ("0xfF", 255),
        ("007", 7),
        ("-12", -12),
        ("+3", 3),
        ("1e6", 1e6),
        ("1E-3", 1e-3),
        (".5", 0.5),
        ("-.5e1", -5.0),
        ("3.", 3.0),
        (".inf", math.inf),
        ("-.Inf", -math.inf),
        ("'12'", "12"),
        ('"null"', "null"),
        ("!!str 12", "12"),
        ("!!float 12", 12.0),
    ],
)
def test_core_schema_scalars(text, value):
    data = read_yaml_text(f"key: {text}").data["key"]
    assert data == value
    assert type(data) is type(value)


@pytest.mark.parametrize("text", [".nan", ".NaN", ".NAN"])
def test_nan(text):
    assert math.isnan(read_yaml_text(f"[{text}]").data[0])


def test_marks_of_keys_and_values():
    document = read_yaml_text("a:\n  - b: 1\n    c: [2, {d: 3}]\n'e f':   x\n")
    assert document.data == {"a": [{"b": 1, "c": [2, {"d": 3}]}], "e f": "x"}
    assert document.keys == {
        ("a",): (1, 1),
        ("a", 0, "b"): (2, 5),
        ("a", 0, "c"): (3, 5),
        ("a", 0, "c", 1, "d"): (3, 13),
        ("e f",): (4, 1),
    }
    assert document.values == {
        (): (1, 1),
        ("a",): (2, 3),
        ("a", 0): (2, 5),
        ("a", 0, "b"): (2, 8),
        ("a", 0, "c"): (3, 8),
        ("a", 0, "c", 0): (3, 9),
        ("a", 0, "c", 1): (3, 12),
        ("a", 0, "c", 1, "d"): (3, 16),
        ("e f",): (4, 10),
    }
    assert document.problems == ()


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_line_ends_and_byte_order_mark_change_nothing(tmp_path, line_end, mark):
    file = tmp_path / "s.yaml"
    file.write_bytes(mark + line_end.join(["a: ü", "b:", "  c: {d: 1, e: 2}"]).encode())
    document = read_yaml(file)
    assert document.data == {"a": "ü", "b": {"c": {"d": 1, "e": 2}}}
    assert document.keys["b", "c", "e"] == (3, 13)


def test_columns_count_characters():
    assert read_yaml_text("{ü😀: 1, a: 2}").keys[("a",)] == (1, 9)


def test_merge_keys_give_way_to_the_mappings_own():
    document = read_yaml_text(
        "one: &one {a: 1, b: 1}\ntwo: &two {b: 2, c: 2}\n"
        "x: {<<: *one, a: 0}\ny: {<<: [*one, *two], d: 4}\nz: &z {<<: *two, b: 7}\nw: {<<: *z}\n"
    )
    assert document.data["x"] == {"a": 0, "b": 1}
    assert document.data["y"] == {"a": 1, "b": 1, "c": 2, "d": 4}
    assert document.data["w"] == {"b": 7, "c": 2}
    assert document.keys["x", "b"] == (1, 18)
    assert document.problems == ()


def test_an_alias_is_a_copy():
    data = read_yaml_text("a: &a [1]\nb: *a").data
    assert data == {"a": [1], "b": [1]}
    assert data["a"] is not data["b"]


def test_a_quoted_merge_sign_is_a_key():
    assert read_yaml_text("{'<<': 1}").data == {"<<": 1}


def test_all_duplicate_and_odd_keys_at_once():
    document = read_yaml_text(
        "a: 1\nb: {c: 1, c: 2, c: 3}\na: 2\n3: x\ntrue: y\n? [q]\n: z\n", Path("s.yaml")
    )
    assert document.data == {"a": 1, "b": {"c": 1}}
    assert [str(problem) for problem in document.problems] == [
        "s.yaml:3:1: a: key must stand once in its mapping, got it again (first at 1:1)",
        "s.yaml:4:1: a key must be text, got 3; put it in quotes",
        "s.yaml:5:1: a key must be text, got true; put it in quotes",
        "s.yaml:6:3: a key must be text, got a collection",
        "s.yaml:2:11: b.c: key must stand once in its mapping, got it again (first at 2:5)",
        "s.yaml:2:17: b.c: key must stand once in its mapping, got it again (first at 2:5)",
    ]


def test_a_fault_in_an_anchor_is_told_once():
    document = read_yaml_text("a: &a {x: 1, x: 2}\nb: *a\nc: {<<: *a}\n")
    assert [(p.line, p.column) for p in document.problems] == [(1, 14)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{<<: 3}", "<< must name a mapping or a list of mappings"),
        ("{<<: {a: 1}, <<: {b: 1}}", "<<: key must stand once in its mapping, got it again (first at 1:2)"),
        ("[!foo 3]", "[0]: must carry no tag, got !foo"),
        ("[!!set {a}]", "[0]: must carry no tag, got tag:yaml.org,2002:set"),
        ("[!!int x]", '[0]: must be a whole number that can be read, got "x"'),
        ("[!!bool yes]", '[0]: must be true or false that can be read, got "yes"'),
        ("a: " + "9" * 5000, f'a: must be a whole number that can be read, got "{"9" * 56}...'),
    ],
)
def test_faults_that_leave_the_rest_readable(text, message):
    assert [str(problem) for problem in read_yaml_text(text).problems] == [message]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\n\tb: 2", "s:2:1: must be indented with spaces, got a tab"),
        ("a:\n\t- b", "s:2:1: must be indented with spaces, got a tab"),
        ("\ta: 1", "s:1:1: must be indented with spaces, got a tab"),
        ("a: 1\n---\nb: 2", "s:2:1: must hold one document, got a second one"),
        ("a: @x", "s:1:4: text that begins with @ must stand in quotes"),
        ("a: b: c", "s:1:5: must be YAML, but mapping values are not allowed in this context"),
        ("a: *x", "s:1:4: must be YAML, but found undefined alias"),
        (
            "a:\n  b: {c: 1\nd: 2",
            "s:3:2: must be YAML, but did not find expected ',' or '}' "
            "while parsing a flow mapping that begins at 2:6",
        ),
        ("a: &a [*a]", "s:1:4: a[0]: must not contain itself through an alias"),
        ("a: &a {<<: *a}", "s:1:4: a: must not contain itself through an alias"),
        ("a: ä\x07", "s:1:5: must be printable text, got the character U+0007"),
    ],
)
def test_what_cannot_be_read(text, message):
    assert error_of(text, Path("s")) == message


def test_nesting_has_an_end():
    assert "must be nested at most 50 deep" in error_of("[" * 60 + "]" * 60)
    assert "must be nested at most 50 deep" in error_of("[" * 100_000 + "]" * 100_000)
    chain = "a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}]\n" for n in range(1, 60))
    assert "must be nested at most 50 deep" in error_of(chain)
    merges = "a0: &a0 {x: 1}\n" + "".join(f"a{n}: &a{n} {{<<: *a{n - 1}}}\n" for n in range(1, 60))
    assert "must be nested at most 50 deep" in error_of(merges)


def test_aliases_of_aliases_have_an_end(monkeypatch):
    monkeypatch.setattr("wsnsim.scenario.yaml_marks._MAX_VALUES", 10_000)
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 8)}]" for n in range(1, 12)]
    assert "must hold at most 10000 values" in error_of("\n".join(lines))


def test_files_that_cannot_be_read(tmp_path):
    def message(file):
        with pytest.raises(ScenarioError) as caught:
            read_yaml(file)
        return str(caught.value)

    (tmp_path / "quickstart.yaml").write_text("a: 1")
    missing = tmp_path / "quikstart.yaml"
    assert message(missing) == f'{missing}: must be a file that exists; did you mean "quickstart.yaml"?'
    assert message(tmp_path) == f"{tmp_path}: must be a file, not a folder"
    below = tmp_path / "quickstart.yaml" / "x.yaml"
    assert message(below) == f"{below}: must be a file that can be read (Not a directory)"
    latin = tmp_path / "latin.yaml"
    latin.write_bytes("a: 1\nüb: Größe\n".encode().replace("ß".encode(), b"\xdf"))
    assert message(latin) == f"{latin}:2:8: must be UTF-8 text, got the byte 0xdf"
    utf16 = tmp_path / "utf16.yaml"
    utf16.write_bytes("a: 1".encode("utf-16"))
    assert message(utf16) == f"{utf16}:1:1: must be UTF-8 text, got the byte 0xff"


def test_an_unreadable_file_is_refused(tmp_path, monkeypatch):
    def refuse(self, *arguments, **options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(ScenarioError, match=r"must be a file that can be read \(Permission denied\)"):
        read_yaml(tmp_path / "s.yaml")


def test_without_libyaml_the_slow_parser_does_the_same(monkeypatch):
    monkeypatch.delattr(yaml, "CSafeLoader", raising=False)
    spec = importlib.util.find_spec("wsnsim.scenario.yaml_marks")
    slow = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(slow)
    assert issubclass(slow._CoreLoader, yaml.SafeLoader)
    text = "a: &a {b: off, c: 1e6}\nd: [*a, {<<: *a, b: 2}]\nd: 3\n"
    fast, document = read_yaml_text(text), slow.read_yaml_text(text)
    assert document.data == fast.data
    assert document.values == fast.values
    assert document.keys == fast.keys
    assert document.problems == fast.problems
    for wrong in ["a:\n\t- b", "a: 1\n---\nb: 1", "[" * 60]:
        with pytest.raises(ScenarioError) as caught:
            slow.read_yaml_text(wrong)
        assert str(caught.value) == error_of(wrong)
