"""The report in a real browser: figures drawn, no error, nothing asked of anybody."""

import re
import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest

from wsnsim.report.context import ReportContext
from wsnsim.report.page import write_report
from wsnsim.sim.recording import png_bytes

BROWSER = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)

pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs chromium on the PATH")

OPTIONS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--disable-default-apps", "--enable-logging=stderr", "--v=0", "--virtual-time-budget=5000",
]  # fmt: skip


def load(page, folder, *more):
    """Return the document after its scripts ran, and what the browser logged of its console."""
    done = subprocess.run(
        [BROWSER, *OPTIONS, *more, f"--user-data-dir={folder / 'profile'}", "--dump-dom", page.as_uri()],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


@pytest.fixture(scope="module")
def report(synthetic_run, tmp_path_factory):
    run = synthetic_run("overloaded", targets=("box", "<b>cart</b> & co"))
    picture = png_bytes(np.full((240, 320, 3), 90, dtype=np.uint8))
    images = pd.DataFrame([{"time_s": 1.0, "step": 4, "camera": c, "png": picture} for c in ("c1", "c2")])
    path = tmp_path_factory.mktemp("browser") / "report.html"
    write_report(
        path,
        ReportContext(
            name="</script><script>alert(1)</script>", seed=0, system="multi-view histograms, tracker T0",
            citation="Kushwaha & Koutsoukos (2013)", standard="IEEE 802.15.4", size_m=run.size_m,
            cameras=run.cameras, tables={**run.tables, "images": images}, summary=run.summary,
            lost_above_m=1.6, semi_axes_m=dict.fromkeys(run.tables["steps"]["target"], np.full(3, 0.4)),
        ),
    )  # fmt: skip
    return path


def test_the_figures_are_drawn_without_an_error_and_without_a_request(report, tmp_path):
    # Every host resolves to nothing, so that a request would fail and be logged.
    document, console = load(report, tmp_path, "--host-resolver-rules=MAP * ~NOTFOUND")
    assert console == []
    assert document.count("<image ") == 2
    assert document.count('class="believed"') == 4
    for chart in ("paths", "timeline", "latency", "bandwidth", "energy"):
        drawn = document.split(f'id="{chart}"', 1)[1].split(f'id="{chart}-data"', 1)[0]
        assert drawn.count('class="main-svg"') >= 2, f"{chart} is not drawn"
        assert re.search(r'class="(trace scatter|trace bars|scatterlayer|barlayer)', drawn)
    assert "error, a patch a step" in document


def test_the_button_shows_the_whole_network_at_equal_scale(synthetic_run, tmp_path):
    run = synthetic_run()
    nodes = run.tables["nodes"].copy()
    nodes.loc[nodes["node"] == "base", "x_m"] = 60.0
    page = tmp_path / "report.html"
    write_report(
        page,
        ReportContext(
            name="far", seed=0, system="tracker", citation="", standard="IEEE 802.15.4", size_m=run.size_m,
            cameras=run.cameras, tables={**run.tables, "nodes": nodes}, summary=run.summary, lost_above_m=1.6,
        ),
    )  # fmt: skip
    script = """<script>setTimeout(() => {
      const map = document.getElementById("paths"), told = [];
      const tell = () => {
        const { xaxis: x, yaxis: y } = map._fullLayout;
        told.push([...x.range, ...y.range, x._length, y._length].map((v) => v.toFixed(3)).join(" "));
      };
      const buttons = [...map.querySelectorAll(".updatemenu-button")];
      const press = (k) => buttons[k].dispatchEvent(new MouseEvent("click", { bubbles: true }));
      tell(); press(1);
      setTimeout(() => { tell(); press(0); }, 500);
      setTimeout(() => { tell(); document.title = told.join("|"); }, 1000);
    }, 1000)</script></body>"""
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page.read_text("utf-8"))
    page.write_text(text.replace("</body>", script), "utf-8")
    document, console = load(page, tmp_path)
    assert console == []
    told = re.search("<title>(.*?)</title>", document)[1]
    first, whole, again = ([float(v) for v in view.split()] for view in told.split("|"))
    assert first[1] < 60 < whole[1]
    assert again == pytest.approx(first, abs=0.1)
    for left, right, bottom, top, width, height in (first, whole):
        assert (right - left) / width == pytest.approx((top - bottom) / height, rel=1e-3)
        assert left < 0
        assert bottom < 0
        assert right > 12
        assert top > 9


def test_the_browser_would_have_told_of_an_error_and_of_a_request(report, tmp_path):
    page = tmp_path / "broken.html"
    text = report.read_text("utf-8").replace(
        "<header>", '<header><img src="https://example.invalid/x.png"><script>broken(</script>', 1
    )
    page.write_text(text, "utf-8")
    _, console = load(page, tmp_path, "--host-resolver-rules=MAP * ~NOTFOUND")
    assert any("example.invalid" in line for line in console)
    assert any("script" in line.lower() for line in console)
