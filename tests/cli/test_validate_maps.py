"""`wsnsim validate --maps` as a user types it: the page, its figures, and what is refused."""

import json
import subprocess
import sys

import pytest
from click.testing import CliRunner

from wsnsim.cli.validate import command

SHORT = ("--set", "duration_s=1", "--set", "system.particles=20", "--set", "expect={}")


@pytest.fixture
def validate(scenarios, tmp_path, monkeypatch):
    """Call the command in this process, from an empty folder."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        words = [str(scenarios / "quickstart.yaml"), *SHORT, *map(str, arguments)]
        return CliRunner().invoke(command, words)

    return call


def test_maps_are_written_beside_and_said_in_words(validate, tmp_path):
    done = validate("--maps")
    assert done.exit_code == 0, done.stderr
    page = (tmp_path / "quickstart-maps.html").read_text("utf-8")
    for words in ("How many cameras see each place", "Links and their margins", "relay (2)"):
        assert words in page
    assert "of the floor is seen by no camera" in done.stdout
    assert done.stdout.endswith("Maps: quickstart-maps.html\n")
    again = tmp_path / "again.html"
    assert validate("--maps", "--out", again).exit_code == 0
    assert again.read_text("utf-8") == page


def test_json_holds_the_figures(validate, tmp_path):
    done = validate("--maps", "--json", "--out", tmp_path / "m.html", "--height", "1.5")
    document = json.loads(done.stdout)
    assert (document["valid"], document["problems"]) == (True, [])
    maps = document["maps"]
    assert maps["file"] == str(tmp_path / "m.html")
    assert maps["height_m"] == 1.5
    assert sum(maps["seen_by"].values()) == pytest.approx(1.0)
    assert [each["camera"] for each in maps["cameras"]] == ["c1", "c2", "c3", "c4"]
    links = {(each["one"], each["other"]): each for each in maps["links"]}
    assert len(links) == 6 * 5 / 2
    # -7 dBm less 40.05 + 35 log10(17.03 m), over -95 dBm
    hop = links["relay", "base"]
    assert hop["distance_m"] == pytest.approx((17**2 + 1) ** 0.5)
    assert hop["margin_db"] == pytest.approx(95 - 7 - 40.05 - 17.5 * 2.46240, abs=1e-3)
    assert hop["in_tree"]
    assert not links["c1", "base"]["in_tree"]
    assert links["c1", "base"]["margin_db"] < 0
    assert "maps" not in json.loads(validate("--json").stdout)


def test_links_of_a_file_have_a_map_and_say_nothing_of_others(validate, tmp_path):
    chain = [("c1", "relay"), ("c2", "relay"), ("c3", "relay"), ("c4", "relay"), ("relay", "base")]
    rows = [f"{one},{other},0.95\n{other},{one},0.95\n" for one, other in chain]
    (tmp_path / "links.csv").write_text("from,to,prr\n" + "".join(rows))
    table = f"network.propagation={{kind: link_table, file: {tmp_path / 'links.csv'}}}"
    done = validate("--maps", "--json", "--set", table, "--out", tmp_path / "m.html")
    assert done.exit_code == 0, done.stderr
    links = {(each["one"], each["other"]): each for each in json.loads(done.stdout)["maps"]["links"]}
    assert links["c1", "relay"]["power_there_dbm"] == -60.0
    assert links["c1", "base"]["power_there_dbm"] is None
    assert "which says nothing of those that one more mote would have" in (tmp_path / "m.html").read_text(
        "utf-8"
    )


def test_an_ideal_network_has_the_map_of_its_tree_too(validate, tmp_path):
    done = validate("--maps", "--set", "network.standard=ideal", "--quiet")
    assert (done.exit_code, done.stdout, done.stderr) == (0, "", "")
    assert "The network of this scenario is ideal" in (tmp_path / "quickstart-maps.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--out", "x.html"), "--out needs --maps: without it no page is written"),
        (("--height", "1"), "--height needs --maps"),
        (("--maps", "--out", "."), "must be a file whose name ends in .html, got a folder"),
        (
            ("--maps", "--out", "scenario.yaml"),
            "must be a file whose name ends in .html, got 'scenario.yaml'",
        ),
        (("--maps", "--out", "no/where/x.html"), "must be in a folder that exists, got 'no/where/x.html'"),
        (("--maps", "--height", "tall"), "'tall' is not a valid float"),
        (("--maps", "--height", "nan"), "must be a finite number, got nan"),
    ],
)
def test_what_cannot_be_written_is_refused(validate, tmp_path, arguments, words):
    done = validate(*arguments)
    assert done.exit_code == 2
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_scenario_that_is_wrong_draws_nothing(validate, tmp_path):
    done = validate("--maps", "--json", "--set", "motes.base.position_m=[900, 0, 1]")
    assert done.exit_code == 2
    assert json.loads(done.stdout)["valid"] is False
    assert list(tmp_path.iterdir()) == []


def test_a_page_that_cannot_be_written_is_told(scenarios):
    done = subprocess.run(
        [sys.executable, "-m", "wsnsim", "validate", str(scenarios / "quickstart.yaml"), *SHORT]
        + ["--maps", "--out", "/proc/maps.html"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("Error: /proc/maps.html: results must be writable")
    assert "Traceback" not in done.stderr
