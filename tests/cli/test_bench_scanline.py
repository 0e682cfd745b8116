"""`wsnsim bench scanline` runs and its kernels agree with their twin; how fast they are is no test."""

import json
import subprocess
import sys

import pytest


@pytest.fixture(scope="module")
def done():
    done = subprocess.run(
        [sys.executable, "-m", "wsnsim", "bench", "scanline", "--quick", "--json"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


@pytest.fixture(scope="module")
def measures(done):
    return json.loads(done.stdout)


def test_steps_are_timed_for_all_cameras_and_knowledge(measures):
    steps = [(measure["setup"], measure["what"]) for measure in measures if measure["what"][:6] == "a step"]
    kinds = ("no prior", "Gaussian priors", "known places")
    assert steps == [(f"N = {cameras}", f"a step, {kind}") for cameras in (2, 4, 8) for kind in kinds]
    assert all(measure["cpu_ms"] > 0.0 for measure in measures)
    assert all("of N = 2" in measure["note"] for measure in measures if measure["what"][:6] == "a step")


def test_parts_of_a_step_are_timed(measures):
    parts = [measure["what"] for measure in measures if measure["setup"] == "N = 8"][3:]
    assert parts == [
        "masks by the table of regions",
        "normal part",
        "coverage, Eq. 4",
        "joint probability, Eqs. 5 and 6",
        "both at once, as in a step",
        "resampling",
        "motion, expected and drawn",
    ]


def test_the_twin_says_the_same(measures):
    compared = [measure for measure in measures if measure["peer"] is not None]
    assert [measure["setup"] for measure in compared] == ["N = 2", "N = 4", "N = 8"]
    for measure in compared:
        assert float(measure["note"].split("within ")[1].split(" ")[0]) < 1e-3
        assert measure["peer"].startswith("plain Python")
        assert measure["ratio"] > 0.0


def test_what_is_timed_is_said_on_stderr(done):
    assert "40 occluders: 40 particles" in done.stderr
    assert "8 cameras: parts of a step" in done.stderr
