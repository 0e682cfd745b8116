"""`wsnsim bench` runs and its kernels agree with their twins; how fast they are is no test."""

import json
import subprocess
import sys

import pytest

from wsnsim.bench.timing import Times, by_turns


@pytest.fixture(scope="module")
def measures():
    done = subprocess.run(
        [sys.executable, "-m", "wsnsim", "bench", "vision", "--quick", "--json"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "setup A" in done.stderr
    return json.loads(done.stdout)


def test_every_kernel_is_timed_in_both_setups(measures):
    for setup in "AB":
        timed = [measure["what"] for measure in measures if measure["setup"] == setup]
        assert timed == [
            "weighted histograms",
            "unweighted histograms",
            "log-likelihood ratios",
            "bins of the region",
            "rendering a frame",
        ]
    assert all(measure["cpu_ms"] > 0.0 for measure in measures)


def test_kernels_agree_with_their_twins(measures):
    compared = [measure for measure in measures if measure["deviation"] is not None]
    assert len(compared) == 6
    assert all(measure["deviation"] < 1e-6 for measure in compared)


def test_the_target_fills_what_the_published_experiments_say(measures):
    """Kushwaha & Koutsoukos 2013, Sec. 6.1: about 2 % in setup A, 0.57 % on average in B."""
    notes = {
        measure["setup"]: measure["note"] for measure in measures if measure["what"].startswith("weighted")
    }
    shares = {setup: float(note.split("target ")[1].split(" %")[0]) for setup, note in notes.items()}
    assert 1.8 < shares["A"] < 2.3
    assert shares["B"] == pytest.approx(0.57, abs=0.05)


def test_a_whole_run_can_be_timed(scenarios):
    from wsnsim.bench.vision import bench_run

    measure = bench_run(scenarios / "quickstart.yaml", ("duration_s=1.0", "system.particles=50"))
    assert measure.setup == "quickstart"
    assert measure.cpu_ms > 0.0
    assert "steps; peak memory" in measure.note


def test_ratios_are_medians_of_the_turns():
    times = Times({"plain": (10.0, 12.0, 90.0), "fast": (1.0, 2.0, 3.0)})
    assert times.typical("plain") == 12.0
    assert times.ratio("plain", "fast") == 10.0


def test_turns_alternate_and_call_everything():
    called = []
    times = by_turns({name: lambda name=name: called.append(name) for name in ("first", "second")}, turns=3)
    assert {name: len(seconds) for name, seconds in times.seconds.items()} == {"first": 3, "second": 3}
    assert called[-1] == "second"
    assert set(called) == {"first", "second"}


def test_without_opencv_that_comparison_is_left_out(monkeypatch):
    from wsnsim.bench import vision

    monkeypatch.setattr(vision, "has_opencv", lambda: False)
    alone = [measure for measure in vision.bench_vision(quick=True) if measure.what == vision.UNWEIGHTED]
    assert [measure.setup for measure in alone] == ["A", "B"]
    for measure in alone:
        assert measure.peer is measure.ratio is measure.peer_cpu_ms is None
        assert measure.deviation < 1e-6
        assert "is not installed" in measure.note


@pytest.mark.parametrize("variant", ["P", "T0", "T2", "T4"])
def test_a_step_of_each_tracker_can_be_timed(scenarios, variant):
    from wsnsim.bench.trackers import JOIN, WEIGH, bench_tracker

    scenario = scenarios / "published" / "multiview_setup_b.yaml"
    overrides = [f"system.variant={variant}", "system.particles=50", "system.image_particles=50"]
    measures = bench_tracker(scenario, overrides, quick=True)
    *stages, whole = measures
    assert whole.what == "one step"
    parts = sum(measure.cpu_ms for measure in stages if measure.what != WEIGH)
    assert whole.cpu_ms == pytest.approx(parts)
    assert (JOIN in {measure.what for measure in stages}) == (variant == "T2")
    # histograms over the whole image cost more, even for few particles
    assert whole.ratio is None or whole.ratio > 1.0


@pytest.fixture(scope="module")
def small_load():
    from wsnsim.bench.network import Load
    from wsnsim.claims.network.layouts import stored

    return Load(stored("rgg_n10"), 0.5)


def test_without_ns3_the_network_is_timed_alone(small_load, monkeypatch):
    from wsnsim.bench import network

    monkeypatch.setattr(network, "compiled", lambda folder: "no g++")
    said = []
    compared, *grown = network.bench_network([small_load], quick=True, said=said.append)
    assert said[0] == "no g++: no comparison"
    assert (compared.who, compared.what, compared.ratio) == ("wsnsim", "rgg_n10, T = 0.5 s", None)
    assert compared.delivered <= 9 * 20
    assert [cost.motes for cost in grown] == [50, 100, 50, 100]
    assert compared.growth is None
    for smaller, larger in (grown[:2], grown[2:]):
        assert smaller.what == larger.what
        assert (smaller.growth, larger.growth) == (
            1.0,
            pytest.approx(larger.us_per_frame / smaller.us_per_frame),
        )
    for cost in (compared, *grown):
        assert cost.loop_s > 0.0
        assert cost.us_per_frame == pytest.approx(1e6 * cost.loop_s / cost.frames)
        assert cost.us_per_delivered == pytest.approx(1e6 * cost.loop_s / cost.delivered)
        assert cost.frames >= 2 * cost.delivered
        assert cost.peak_memory_mb > 1.0


def test_ns3_does_the_same_work_where_it_can_be_compiled(small_load, tmp_path):
    from wsnsim.bench.network import bench_network
    from wsnsim.bench.ns3 import compiled

    peer = compiled(tmp_path)
    if isinstance(peer, str):
        pytest.skip(peer)
    ours, theirs, *_ = bench_network([small_load], quick=True)
    assert (ours.who, theirs.who) == ("wsnsim", "ns-3")
    assert ours.ratio == pytest.approx(ours.us_per_delivered / theirs.us_per_delivered)
    assert theirs.delivery_ratio == pytest.approx(ours.delivery_ratio, abs=0.03)
    assert theirs.frames == pytest.approx(ours.frames, rel=0.05)


@pytest.mark.parametrize(
    ("driver", "why"), [("", "only a checkout"), ("int main() { nonsense }", "does not compile")]
)
def test_a_peer_that_cannot_be_made_is_a_reason(tmp_path, driver, why):
    from wsnsim.bench.ns3 import compiled

    source = tmp_path / "driver.cc"
    if driver:
        source.write_text(driver)
    said = compiled(tmp_path, source)
    assert isinstance(said, str)
    assert why in said or "no g++" in said


def test_the_network_is_profiled_by_function(small_load):
    from wsnsim.bench.network import profile_network

    text = profile_network(small_load, 2.0, lines=10)
    assert "function calls" in text
    assert "tottime" in text
    assert "medium.py" in text or "csma_ca.py" in text


def test_a_layout_that_is_none_is_a_wrong_argument(tmp_path):
    from click.testing import CliRunner

    from wsnsim.cli.bench import command

    path = tmp_path / "mine.json"
    path.write_text("{}")
    said = CliRunner().invoke(command, ["network", str(path)])
    assert said.exit_code == 2
    assert "must be a JSON object with `xy`" in said.output
