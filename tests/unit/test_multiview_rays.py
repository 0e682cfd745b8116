"""Tracker P: filters in the images that know nothing of space, and rays that meet."""

import runpy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.eye import Eye
from wsnsim.systems.multiview.p import PCamera
from wsnsim.systems.multiview.p import posterior as intersection
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import propose
from wsnsim.systems.multiview.variants import Question, Report

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, CAMERAS = scene.CENTRE, scene.UPRIGHT, scene.CAMERAS
box = scene.Scene(5)


def params(**changes: object) -> MultiviewParams:
    return scene.params(  # type: ignore[no-any-return]
        **{"variant": "P", "image_particles": 150, "particles": 150, "smoothing_scans": 0, **changes}
    )


def site(cameras: dict[str, PinholeCamera] = CAMERAS) -> Site:
    return Site(cameras, (box.target,), scene.RATE_HZ, 20, box.streams)


def state(step: int = 1, place: np.ndarray = CENTRE) -> StatePayload:
    return StatePayload(0, step, place, np.zeros(3), UPRIGHT)


def eye(name: str = "c1", **changes: object) -> Eye:
    return Eye(params(**{"image_particles": 300, **changes}), site(), name, box.models())


def ray(
    part: PCamera, node: str, step: int, believed: np.ndarray, place: np.ndarray | None
) -> RayPayload | None:
    """Return what tracker P says of the frame of a step."""
    said = state(step, believed)
    proposal = propose(said, part._eye.params, part._eye.site)
    payload, _ = part.answer(box.frame(node, step, place), said, proposal)
    return payload


def seen(node: str, place: np.ndarray) -> np.ndarray:
    pixels, _ = CAMERAS[node].project(place[None])
    return np.asarray(pixels[0])


def test_p_follows_a_moving_target_in_its_image_whatever_the_base_station_believes() -> None:
    """0.6 m/s aside, 40 px over 4 steps; the base station believes that it stands where it began."""
    part, right = PCamera(eye()), CAMERAS["c1"].rotation[0]
    for step in range(1, 6):
        place = CENTRE + 0.15 * (step - 1) * right
        payload = ray(part, "c1", step, CENTRE, place)
        assert payload is not None
        # a similarity sharpened with 25 tells the place to about 4 px; 0.6 px of offset come on top
        assert np.linalg.norm(payload.pixel - seen("c1", place)) < 10.0
        assert payload.similarity > 0.6
    assert np.linalg.norm(seen("c1", place) - seen("c1", CENTRE)) > 35.0
    track = part._tracks[0]
    expected = seen("c1", place + 0.15 * right) - seen("c1", place)
    assert np.linalg.norm(track.velocity - expected) < 0.6 * np.linalg.norm(expected)


def test_p_begins_where_the_base_station_says_after_a_gap() -> None:
    """A filter that has not seen the frame before knows nothing of where its target went."""
    part, right = PCamera(eye()), CAMERAS["c1"].rotation[0]
    assert ray(part, "c1", 1, CENTRE, CENTRE) is not None
    far = CENTRE + 0.9 * right
    payload = ray(part, "c1", 3, far, far)
    assert payload is not None
    assert np.linalg.norm(payload.pixel - seen("c1", far)) < 10.0
    # a filter that did see the frame before believes itself
    other = PCamera(eye())
    assert ray(other, "c1", 1, CENTRE, CENTRE) is not None
    payload = ray(other, "c1", 2, far, CENTRE)
    assert payload is not None
    assert np.linalg.norm(payload.pixel - seen("c1", CENTRE)) < 10.0


def test_p_says_nothing_when_it_has_lost_its_target_and_begins_anew() -> None:
    part = PCamera(eye(image_tracker={"similarity_min": 0.75}))
    assert ray(part, "c1", 1, CENTRE, CENTRE) is not None
    assert ray(part, "c1", 2, CENTRE, None) is None
    assert part._tracks == {}
    assert ray(part, "c1", 3, CENTRE, CENTRE) is not None


def test_p_may_learn_its_histogram_from_the_image() -> None:
    part = PCamera(eye(image_tracker={"histogram": "image"}))
    payload = ray(part, "c1", 1, CENTRE, CENTRE)
    assert payload is not None
    assert payload.similarity > 0.9
    assert np.linalg.norm(payload.pixel - seen("c1", CENTRE)) < 10.0
    sums = [(root**2).sum() for root in (part._tracks[0].sqrt_colour, part._tracks[0].sqrt_texture)]
    np.testing.assert_allclose(sums, 1.0)


def question(there: Site, rule: MultiviewParams, place: np.ndarray = CENTRE) -> Question:
    proposal = propose(state(place=place), rule, there)
    return Question(state(place=place), proposal, None)  # type: ignore[arg-type]


def rays_to(there: Site, place: np.ndarray, sd_px: float = 1.0) -> list[Report]:
    reports = []
    for node, camera in there.cameras.items():
        (pixel,), _ = camera.project(place[None])
        said = RayPayload(0, 1, pixel, np.array([sd_px, 0.0, sd_px]), 0.9)
        reports.append(Report((node,), said))
    return reports


@pytest.mark.parametrize("off", [0.0, 0.3, 1.0])
def test_two_rays_meet_at_the_target(off: float) -> None:
    """The weak prior of 3 m pulls by (0.015 / 3)² of the way: 25 µm a metre."""
    there, rule = site({node: CAMERAS[node] for node in ("c1", "c2")}), params()
    place = CENTRE + off * np.array([0.6, 0.6, 0.5])
    found = intersection(rule, there, question(there, rule), rays_to(there, place))
    assert np.linalg.norm(found.position - place) < 1e-6 + 2e-4 * off


def test_nearly_parallel_rays_stay_near_the_prediction() -> None:
    """Cameras 1 cm apart and a pixel of disagreement: the rays meet metres before the target, or never."""
    camera = CAMERAS["c1"]
    beside = PinholeCamera.look_at(camera.position + [0.01, 0.0, 0.0], CENTRE, 300.0, scene.SIZE)
    there, rule = site({"c1": camera, "c2": beside}), params()
    for shift in (-1.0, -0.5, 0.0, 0.5, 1.0, -40.0, 40.0):
        first, second = rays_to(there, CENTRE)
        moved = replace(second.said, pixel=second.said.pixel + [shift, 0.0])  # type: ignore[arg-type, union-attr]
        found = intersection(rule, there, question(there, rule), [first, Report(second.cameras, moved)])
        assert np.isfinite(found.position).all()
        assert np.linalg.eigvalsh(found.cov).min() > 0.0
        if abs(shift) > 1.0:
            continue
        assert np.linalg.norm(found.position - CENTRE) < 3.0
        sds = np.sqrt(np.linalg.eigvalsh(found.cov))
        # across the rays two pixels at 4.5 m, along them little more than the prior
        assert sds[1] < 0.02
        assert 1.0 < sds[2] <= 3.0
