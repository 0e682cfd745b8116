"""Runs at their edges: the last step, slow imagers, silent cameras, refused folders, images as they were."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

import wsnsim
from wsnsim.metrics.conservation import violations
from wsnsim.records import MemorySink
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build

SHORT = ("duration_s=2", "expect={}", "network.standard=ideal")


@pytest.fixture
def setup_a(scenarios: Path) -> Path:
    return scenarios / "published" / "multiview_setup_a.yaml"


@pytest.mark.parametrize("steps", [7, 8])
def test_the_last_step_is_estimated_though_a_camera_is_silent(setup_a: Path, steps: int) -> None:
    """The base station waits for the dead camera up to its deadline, beyond the last frame's period."""
    run = wsnsim.run(
        setup_a,
        overrides=(
            f"duration_s={steps / 4}",
            "system.particles=250",
            "motes.nodes=[{id: c4, battery: {kind: capacity, capacity_j: 0.05}}]",
        ),
    )
    assert len(run.steps) == steps
    assert run.steps["error_m"].notna().all()
    assert run.summary["lost_fraction"] == 0
    assert violations(run.tables, run.summary["simulated_s"]) == []


@pytest.mark.parametrize("rate_hz", [3, 4, 30])
def test_a_deadline_of_one_period_uses_every_second_frame(setup_a: Path, rate_hz: int) -> None:
    """With one camera dead every step lasts to its deadline: the next frame's instant, just too late for it.

    Whether the instants of a rate round up or down in floating point must not matter.
    """
    loaded = load_scenario(
        setup_a,
        (
            f"duration_s={24.2 / rate_hz}",
            "system.particles=50",
            "system.spread={kind: fixed}",
            f"system.deadline_s={1 / rate_hz}",
            "motes.nodes=[{id: c4, battery: {kind: capacity, capacity_j: 1.0e-6}}]",
            *(f"cameras[c{k}].rate_hz={rate_hz}" for k in (1, 2, 3, 4)),
            "motes.default.platform=workstation",
            "motes.default.battery={kind: mains}",
        ),
    )
    steps = wsnsim.run(loaded).steps
    assert list(steps["heard"]) == [3, 0] * 12


def test_an_imager_too_slow_for_the_rate_skips_frames_and_is_never_in_two_states(setup_a: Path) -> None:
    """1600 x 1200 pixels take 0.32 s to read out at 6 MHz: every second frame of 4 Hz is taken."""
    sizes = tuple(f"cameras[c{k}].resolution_px=[1600, 1200]" for k in (1, 2, 3, 4))
    run = wsnsim.run(setup_a, overrides=(*SHORT, "system.particles=10", *sizes))
    cameras = run.nodes.query("role == 'camera'")
    assert (cameras["images_taken"] == 4).all()
    assert (cameras["images_skipped"] == 4).all()
    capture = run.tables["energy"].query("component == 'camera' and cause == 'capture'")
    np.testing.assert_allclose(capture["seconds"], 4 * 1600 * 1200 / 6e6)
    assert "still reading out" in run.tables["events"].query("kind == 'frame_skipped'")["detail"].iloc[0]


def test_a_scenario_that_cannot_be_built_touches_no_folder(setup_a: Path, tmp_path: Path) -> None:
    wsnsim.run(setup_a, overrides=SHORT, out=tmp_path / "good")
    before = {file.name: file.read_bytes() for file in (tmp_path / "good").iterdir()}
    far = (*SHORT, "motes.base.position_m=[9999, 0, 1]")
    for folder in ("good", "new"):
        with pytest.raises(wsnsim.ScenarioError, match="cannot"):
            wsnsim.run(setup_a, overrides=far, out=tmp_path / folder, force=True)
    assert {file.name: file.read_bytes() for file in (tmp_path / "good").iterdir()} == before
    assert not (tmp_path / "new").exists()


def test_arguments_that_would_be_ignored_are_refused(setup_a: Path) -> None:
    loaded = load_scenario(setup_a)
    with pytest.raises(ValueError, match="seed"):
        wsnsim.run(loaded, seed=3)
    with pytest.raises(ValueError, match="overrides"):
        wsnsim.run(loaded, overrides=("seed=3",))


def test_images_depend_on_seed_camera_and_time_only(setup_a: Path) -> None:
    """Every frame that two trackers over two radios look at is the same image, bit by bit."""

    def images(*overrides: str) -> dict[tuple[str, int], str]:
        simulation = build(load_scenario(setup_a, (*SHORT, *overrides)))
        seen: dict[tuple[str, int], str] = {}
        for camera in simulation.cameras:
            render = camera.renderer.render

            def noted(step, bodies, poses, name=camera.node.id, render=render):  # type: ignore[no-untyped-def]
                image = render(step, bodies, poses)
                seen[name, step] = hashlib.sha256(image.tobytes()).hexdigest()
                return image

            object.__setattr__(camera.renderer, "render", noted)
        simulation.run(MemorySink())
        return seen

    one = images()
    other = images(
        "network.standard=ieee802154",
        "system.particles=100",
        "system.encoding=uint8",
        "system.particle_sd_m=0.4",
    )
    assert len(one) == 4 * 8
    common = one.keys() & other.keys()
    assert len(common) >= 16
    assert all(one[key] == other[key] for key in common)
    assert images("seed=1")["c1", 1] != one["c1", 1]


def test_two_targets_are_tracked_by_two_trackers(setup_a: Path) -> None:
    second = (
        "{id: second, shape: {kind: ellipsoid, semi_axes_m: [0.3, 0.3, 0.3], texture: {seed: 8}}, "
        "motion: {kind: waypoints, points_m: [[3.0, 2.6, 1.8], [4.2, 2.7, 1.9]], speed_mps: 0.4}}"
    )
    first = (
        "{id: first, shape: {kind: ellipsoid, semi_axes_m: [0.4, 0.28, 0.34], texture: {seed: 4}}, "
        "motion: {kind: waypoints, points_m: [[2.9, 4.2, 0.8], [4.0, 4.1, 0.9]], speed_mps: 0.4}}"
    )
    run = wsnsim.run(setup_a, overrides=(*SHORT, f"world.targets=[{first}, {second}]"))
    assert len(run.steps) == 2 * 8
    assert set(run.steps["target"]) == {"first", "second"}
    assert (run.steps.groupby("target")["error_m"].mean() < 0.08).all()
    assert run.summary["lost_fraction"] == 0
    assert violations(run.tables, run.summary["simulated_s"]) == []


def test_the_papers_colour_space_works_too(setup_a: Path) -> None:
    run = wsnsim.run(setup_a, overrides=(*SHORT, "system.colour_space=hs"))
    assert run.summary["position_error_mean_m"] < 0.08
