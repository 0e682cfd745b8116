"""The report in a real browser: figures drawn, no error, nothing asked of anybody."""

import re
import shutil
import subprocess

import pytest

from wsnsim.report.context import ReportContext
from wsnsim.report.page import write_report

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
    path = tmp_path_factory.mktemp("browser") / "report.html"
    write_report(
        path,
        ReportContext(
            name="</script><script>alert(1)</script>", seed=0, system="multi-view histograms, tracker T0",
            citation="Kushwaha & Koutsoukos (2013)", standard="IEEE 802.15.4", size_m=run.size_m,
            cameras=run.cameras, tables=run.tables, summary=run.summary, lost_above_m=1.6,
        ),
    )  # fmt: skip
    return path


def test_the_figures_are_drawn_without_an_error_and_without_a_request(report, tmp_path):
    # Every host resolves to nothing, so that a request would fail and be logged.
    document, console = load(report, tmp_path, "--host-resolver-rules=MAP * ~NOTFOUND")
    assert console == []
    for chart in ("paths", "timeline", "bandwidth", "energy"):
        drawn = document.split(f'id="{chart}"', 1)[1].split(f'id="{chart}-data"', 1)[0]
        assert drawn.count('class="main-svg"') >= 2, f"{chart} is not drawn"
        assert re.search(r'class="(trace scatter|trace bars|scatterlayer|barlayer)', drawn)
    assert "error, a patch a step" in document


def test_the_browser_would_have_told_of_an_error_and_of_a_request(report, tmp_path):
    page = tmp_path / "broken.html"
    text = report.read_text("utf-8").replace(
        "<header>", '<header><img src="https://example.invalid/x.png"><script>broken(</script>', 1
    )
    page.write_text(text, "utf-8")
    _, console = load(page, tmp_path, "--host-resolver-rules=MAP * ~NOTFOUND")
    assert any("example.invalid" in line for line in console)
    assert any("script" in line.lower() for line in console)
