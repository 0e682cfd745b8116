"""The page of maps in a real browser: figures and floors drawn, no error, nothing asked of anybody."""

import re
import runpy
from pathlib import Path

import pytest
from click.testing import CliRunner

from wsnsim.cli.validate import command

_report = runpy.run_path(str(Path(__file__).with_name("test_report_offline.py")))
BROWSER, load = _report["BROWSER"], _report["load"]

pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs chromium on the PATH")


@pytest.fixture(scope="module")
def page(scenarios, tmp_path_factory):
    path = tmp_path_factory.mktemp("maps") / "maps.html"
    occluder = "{id: wall, kind: wall, from_m: [4, 2], to_m: [4, 7], height_m: 3}"
    done = CliRunner().invoke(
        command,
        [str(scenarios / "quickstart.yaml"), "--maps", "--out", str(path), "--quiet"]
        + ["--set", f"world.occluders=[{occluder}]", "--set", "network.propagation.shadowing_db=4"],
    )
    assert done.exit_code == 0, done.output
    return path


def test_floors_and_links_are_drawn_without_an_error_and_without_a_request(page, tmp_path):
    document, console = load(page, tmp_path, "--host-resolver-rules=MAP * ~NOTFOUND")
    assert console == []
    for chart, words in (("seen", "3 cameras"), ("share", "1 to 3 %"), ("links", "link of the routing tree")):
        drawn = document.split(f'id="{chart}"', 1)[1].split(f'id="{chart}-data"', 1)[0]
        assert drawn.count('class="main-svg"') >= 2, f"{chart} is not drawn"
        floor = re.search(r"<image [^>]*>", drawn)[0]
        assert "data:image/png;base64," in floor
        width, height = (float(re.search(rf'{side}="([\d.]+)"', floor)[1]) for side in ("width", "height"))
        assert width > 300
        assert height > 100
        assert words in drawn
        assert "scatterlayer" in drawn


def test_the_floor_lies_under_its_numbers(page, tmp_path):
    """The picture's corners are the world's, in the axes that the points are drawn in."""
    script = """<script>setTimeout(() => {
      const map = document.getElementById("seen"), { xaxis: x, yaxis: y } = map._fullLayout;
      const floor = map.querySelector(".imagelayer image");
      const at = (name) => Number(floor.getAttribute(name));
      const told = [at("x") - x._offset, at("x") + at("width") - x._offset].map((v) => x.p2d(v));
      told.push(y.p2d(at("y") + at("height") - y._offset), y.p2d(at("y") - y._offset));
      document.title = told.map((v) => v.toFixed(4)).join(" ");
    }, 1500)</script></body>"""
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page.read_text("utf-8"))
    changed = tmp_path / "maps.html"
    changed.write_text(text.replace("</body>", script), "utf-8")
    document, _ = load(changed, tmp_path)
    told = [float(value) for value in re.search("<title>(.*?)</title>", document)[1].split()]
    assert told == pytest.approx([0.0, 10.0, 0.0, 8.0], abs=0.02)
