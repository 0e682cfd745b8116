"""Finding a target without a prediction: in one image, and where the rays of several cameras meet."""

import runpy
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import quaternion_from_axis_angle
from wsnsim.messages.search import SightingPayload
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.sim.build import build
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.rules import TrackLoss
from wsnsim.systems.multiview.search import Found, find, meeting_point
from wsnsim.systems.multiview.sight import look
from wsnsim.systems.multiview.similarity import view_similarities
from wsnsim.vision.features import FeatureSpace

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CAMERAS, CENTRE, UPRIGHT = scene.CAMERAS, scene.CENTRE, scene.UPRIGHT
RADIUS_M = 0.34
TOLERANCE_M = 0.4


def look_for(box: object, node: str, image: np.ndarray, **changes: object) -> Found:
    rule = scene.params(**changes)
    found, work = find(
        image,
        CAMERAS[node],
        box.target,
        box.models()[0],
        FeatureSpace("hsv"),
        rule,  # type: ignore[attr-defined]
    )
    assert found is not None
    assert work.int_ops > 0
    return found


@cache
def searches() -> tuple[np.ndarray, np.ndarray]:
    """Search 12 images with a target, half of them of a turned one, and the same 12 without it.

    Returns
    -------
    (12, 5) similarity, distance in the image [px], found over true distance, true radius [px], and the
    similarity at the true place; (12,) similarity found in the images without the target
    """
    generator = np.random.default_rng(3)
    hits, misses = [], []
    for seed in range(3):
        box = scene.Scene(seed)
        for number, node in enumerate(CAMERAS):
            place = CENTRE + generator.uniform(-0.9, 0.9, 3) * [1.0, 1.0, 0.4]
            turn = quaternion_from_axis_angle([0, 0, 1], generator.uniform(-np.pi, np.pi) * (number % 2))
            image = box.image(node, 1, place, turn, photo=True)
            found = look_for(box, node, image)
            (pixel,), (depth,) = CAMERAS[node].project(place[None])
            distance = float(np.linalg.norm(place - CAMERAS[node].position))
            off = float(np.linalg.norm(found.pixel - pixel))
            features = FeatureSpace("hsv")
            sight = look(image, CAMERAS[node], place[None], turn, box.body.semi_axes_m, features)
            true, _ = view_similarities(sight, box.models()[0], features, scene.params().colour_share)
            hits.append(
                (found.similarity, off, found.distance_m / distance, 300.0 * RADIUS_M / depth, true.max())
            )
            misses.append(look_for(box, node, box.image(node, 2, None, photo=True)).similarity)
    return np.array(hits), np.array(misses)


def test_the_target_is_found_in_the_image_within_its_own_outline() -> None:
    hits, _ = searches()
    _, off, ratio, radius, _ = hits.T
    assert np.median(off / radius) < 0.35
    assert (off < 0.7 * radius).all()
    # an ellipse within the target is as much like it as its outline: the distance errs on the far side
    assert 0.9 < np.median(ratio) < 1.25
    assert ratio.min() > 0.75
    assert np.mean(ratio < 2.0) > 0.9  # twice is what the meeting of rays allows


def test_what_is_found_is_as_like_the_target_as_the_target_itself() -> None:
    """The best place of all cannot be less like it than the true one, but for the grid's coarseness."""
    hits, _ = searches()
    assert (hits[:, 0] > hits[:, 4] - 0.01).all()


def test_backgrounds_look_less_like_the_target_than_the_target_does() -> None:
    hits, misses = searches()
    assert hits[:, 0].min() > misses.max() + 0.05
    default = TrackLoss()
    assert (hits[:, 0] > default.sighting_min).all()
    assert np.mean(misses < default.sighting_min) > 0.5


def test_a_target_near_the_border_is_found() -> None:
    box = scene.Scene(5)
    camera = CAMERAS["c1"]
    for pixel in ((45.0, 60.0), (280.0, 190.0)):
        (ray,) = camera.rays(np.array([pixel])) @ camera.rotation
        place = camera.position + 4.5 * ray / np.linalg.norm(ray)
        found = look_for(box, "c1", box.image("c1", 1, place))
        assert np.linalg.norm(found.pixel - pixel) < 10.0


def test_an_image_too_small_for_any_outline_shows_nothing() -> None:
    box = scene.Scene(5)
    tiny = PinholeCamera.look_at((0.3, 0.6, 2.4), CENTRE, 12.0, (12, 10))
    image = np.full((10, 12, 3), 90, np.uint8)
    found, work = find(image, tiny, box.target, box.models()[0], FeatureSpace("hsv"), scene.params())
    assert found is None
    assert work.int_ops == 0


@pytest.mark.parametrize("level", [0, 128, 255])
def test_an_image_of_one_colour_gives_a_number_that_is_none_of_the_target(level: int) -> None:
    box = scene.Scene(5)
    found = look_for(box, "c1", np.full((240, 320, 3), level, np.uint8))
    assert 0.0 <= found.similarity < 0.6
    assert np.isfinite(found.pixel).all()
    assert np.isfinite(found.distance_m)


def sighting(
    camera: PinholeCamera, place: np.ndarray, similarity: float = 0.9, stretch: float = 1.0
) -> SightingPayload:
    """Return what a camera says of a target at `place`, its distance `stretch` times too large."""
    (pixel,), _ = camera.project(place[None])
    distance = stretch * float(np.linalg.norm(place - camera.position))
    return SightingPayload(0, 1, pixel, distance, similarity)


def exact(names: tuple[str, ...], place: np.ndarray) -> dict[str, SightingPayload]:
    return {name: sighting(CAMERAS[name], place) for name in names}


@pytest.mark.parametrize("names", [("c1", "c2"), ("c1", "c3", "c4"), ("c1", "c2", "c3", "c4")])
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.7, -0.6, 0.3), (-0.9, 0.8, -0.2)])
def test_exact_rays_meet_where_the_target_is(names: tuple[str, ...], offset: tuple[float, ...]) -> None:
    place = CENTRE + offset
    met = meeting_point(exact(names, place), CAMERAS, TOLERANCE_M, 2)
    assert met is not None
    np.testing.assert_allclose(met[0], place, atol=1e-9)
    assert met[1] == names


def test_a_lens_that_distorts_is_taken_into_account() -> None:
    bent = {
        name: PinholeCamera.look_at(each.position, CENTRE, 300.0, scene.SIZE, (-0.25, 0.05))
        for name, each in CAMERAS.items()
    }
    place = CENTRE + [0.8, 0.7, 0.2]
    met = meeting_point({name: sighting(each, place) for name, each in bent.items()}, bent, TOLERANCE_M, 2)
    assert met is not None
    np.testing.assert_allclose(met[0], place, atol=1e-6)


def test_a_camera_that_saw_something_else_does_not_spoil_the_meeting() -> None:
    said = exact(("c1", "c2", "c3"), CENTRE)
    said["c4"] = sighting(CAMERAS["c4"], CENTRE + [1.2, 1.3, 0.0], similarity=0.99)
    met = meeting_point(said, CAMERAS, TOLERANCE_M, 2)
    assert met is not None
    np.testing.assert_allclose(met[0], CENTRE, atol=1e-9)
    assert met[1] == ("c1", "c2", "c3")


def test_of_two_meetings_the_one_that_looks_more_like_the_target_counts() -> None:
    other = CENTRE + [1.0, 0.3, -0.6]
    for similarities, place in (((0.9, 0.8), CENTRE), ((0.8, 0.9), other)):
        said = {name: sighting(CAMERAS[name], CENTRE, similarities[0]) for name in ("c1", "c2")}
        said |= {name: sighting(CAMERAS[name], other, similarities[1]) for name in ("c3", "c4")}
        met = meeting_point(said, CAMERAS, 0.1, 2)
        assert met is not None
        np.testing.assert_allclose(met[0], place, atol=1e-9)


def test_fewer_cameras_than_asked_for_are_not_enough() -> None:
    assert meeting_point({}, CAMERAS, TOLERANCE_M, 2) is None
    assert meeting_point(exact(("c1",), CENTRE), CAMERAS, TOLERANCE_M, 2) is None
    assert meeting_point(exact(("c1", "c2"), CENTRE), CAMERAS, TOLERANCE_M, 3) is None
    assert meeting_point(exact(("c1", "c2", "c3"), CENTRE), CAMERAS, TOLERANCE_M, 3) is not None


def test_rays_that_pass_each_other_do_not_meet() -> None:
    """Two rays a height h apart: their nearest point is h / 2 from each at least."""
    for height, meets in ((0.6, True), (1.2, False)):
        said = exact(("c1",), CENTRE) | {"c2": sighting(CAMERAS["c2"], CENTRE + [0.0, 0.0, height])}
        assert (meeting_point(said, CAMERAS, TOLERANCE_M, 2) is not None) is meets


def test_parallel_rays_and_one_ray_twice_do_not_meet() -> None:
    left = PinholeCamera.look_at((0.0, 0.0, 1.0), (0.0, 5.0, 1.0), 300.0, scene.SIZE)
    right = PinholeCamera.look_at((2.0, 0.0, 1.0), (2.0, 5.0, 1.0), 300.0, scene.SIZE)
    behind = PinholeCamera.look_at((0.0, -1.0, 1.0), (0.0, 5.0, 1.0), 300.0, scene.SIZE)
    middle = SightingPayload(0, 1, np.array(left.principal_point), 4.0, 0.9)
    for other in (right, left, behind):
        assert meeting_point({"a": middle, "b": middle}, {"a": left, "b": other}, TOLERANCE_M, 2) is None


def test_rays_that_would_meet_behind_a_camera_do_not() -> None:
    """Two cameras side by side that look apart: the lines meet behind both."""
    left = PinholeCamera.look_at((0.0, 0.0, 1.0), (-2.0, 2.0, 1.0), 300.0, scene.SIZE)
    right = PinholeCamera.look_at((1.0, 0.0, 1.0), (3.0, 2.0, 1.0), 300.0, scene.SIZE)
    middle = SightingPayload(0, 1, np.array(left.principal_point), 0.7, 0.9)
    assert meeting_point({"a": middle, "b": middle}, {"a": left, "b": right}, TOLERANCE_M, 2) is None


@pytest.mark.parametrize(("stretch", "meets"), [(0.51, True), (1.99, True), (0.49, False), (2.01, False)])
def test_a_size_that_contradicts_the_place_is_no_sighting_of_it(stretch: float, meets: bool) -> None:
    said = exact(("c1",), CENTRE) | {"c2": sighting(CAMERAS["c2"], CENTRE, stretch=stretch)}
    assert (meeting_point(said, CAMERAS, TOLERANCE_M, 2) is not None) is meets


def test_found_and_met_the_target_is_where_it_is() -> None:
    """From images to a place in space: within its own size, over several textures."""
    rule = MultiviewParams.model_validate({"kind": "multiview"})
    for seed in (0, 1):
        box = scene.Scene(seed)
        place = CENTRE + [0.4, -0.3, 0.1]
        said = {}
        for node in ("c1", "c2", "c3"):
            found = look_for(box, node, box.image(node, 1, place, photo=True))
            said[node] = SightingPayload(0, 1, found.pixel, found.distance_m, found.similarity)
        met = meeting_point(said, CAMERAS, TOLERANCE_M, rule.searching.cameras_min)
        assert met is not None
        assert np.linalg.norm(met[0] - place) < 0.2


def test_an_automatic_start_that_cannot_happen_is_refused(scenarios) -> None:  # type: ignore[no-untyped-def]
    """With the default two sightings have to meet; one camera alone would look for ever."""
    path = scenarios / "published" / "multiview_setup_a.yaml"
    (first, *_) = load_scenario(path).scenario.model_dump(mode="json")["cameras"]
    whole = load_scenario(path, ("system.start=automatic",)).scenario.model_dump(mode="json")
    with pytest.raises(ScenarioError, match=r"cameras_min: must be at most the number of cameras, 1"):
        build(scenario_from_dict({**whole, "cameras": [first]}))
