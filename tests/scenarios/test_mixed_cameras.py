"""Cameras that differ: their order must not matter, and what they cannot see through is told."""

from pathlib import Path

import pytest

import wsnsim
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build

SHORT = ("duration_s=3", "system.particles=200")


def four_and_a_wide_one(setup_a: Path, first: bool) -> wsnsim.Run:
    cameras = load_scenario(setup_a).scenario.model_dump(mode="json")["cameras"]
    wide = {**cameras[0], "id": "wide", "position_m": [3.5, 6.8, 2.4], "focal_px": 30.0, "noise_sd": 60.0}
    mixed = [wide, *cameras] if first else [*cameras, wide]
    data = load_scenario(setup_a, SHORT).scenario.model_dump(mode="json")
    return wsnsim.run({**data, "cameras": mixed, "expect": {}})


@pytest.fixture
def setup_a(scenarios: Path) -> Path:
    return scenarios / "published" / "multiview_setup_a.yaml"


def test_the_order_of_cameras_does_not_decide_what_is_learned(setup_a: Path) -> None:
    """The portraits are taken as by a middling camera, not by the first one."""
    last, first = (four_and_a_wide_one(setup_a, at_front) for at_front in (False, True))
    assert last.summary["lost_fraction"] == first.summary["lost_fraction"] == 0
    errors = [run.summary["position_error_mean_m"] for run in (last, first)]
    assert errors[1] == pytest.approx(errors[0], rel=1e-9)


def test_a_camera_inside_a_target_is_refused(setup_a: Path) -> None:
    loaded = load_scenario(setup_a, ("world.targets[box].shape.semi_axes_m=[6, 6, 6]",))
    with pytest.raises(wsnsim.ScenarioError, match=r"must start away from the cameras, got \"c1\" inside"):
        build(loaded)


def test_a_long_scenario_is_checked_without_looking_at_every_frame(
    setup_a: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Straight lines between places inside a room stay inside: 4 million instants need no look."""
    from wsnsim.world.motion import Waypoints

    looks = 0
    at = Waypoints.at

    def counted(self: Waypoints, time: float):  # type: ignore[no-untyped-def]
        nonlocal looks
        looks += 1
        return at(self, time)

    monkeypatch.setattr(Waypoints, "at", counted)
    build(load_scenario(setup_a, ("duration_s=1e6",)))
    assert looks < 100
