"""Cameras as a scenario describes them, and what a person reads who described them wrongly."""

# ruff: noqa: E501  (an error is one line, here as on the screen)

import math
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from wsnsim.errors import ScenarioError
from wsnsim.scenario.cameras import focal_length_px, pinhole
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash
from wsnsim.sim.build import build
from wsnsim.vision.drift import RandomDrift, SinusoidalDrift
from wsnsim.vision.film import Film

GOOD = """\
duration_s: 2
world:
  size_m: [10, 8, 4]
  targets:
    - id: box
      shape: {kind: ellipsoid, semi_axes_m: [0.40, 0.28, 0.34]}
      motion: {kind: waypoints, points_m: [[3, 4, 1], [7, 4, 1]]}
cameras:
  - {id: c1, position_m: [0, 0, 3], CAMERA}
motes:
  base: {position_m: [5, 0, 2]}
network: {standard: ideal}
system: {kind: multiview}
"""
LOOK = "look_at_m: [5, 4, 1]"


@pytest.fixture
def load(tmp_path):
    def load(camera, overrides=()):
        file = tmp_path / "s.yaml"
        file.write_text(GOOD.replace("CAMERA", camera))
        return load_scenario(file, overrides)

    return load


def camera_of(loaded):
    return loaded.scenario.cameras[0]


def test_defaults_are_as_they_were(load):
    camera = camera_of(load(LOOK))
    assert (camera.focal_px, camera.fov_deg, camera.distortion) == (300.0, None, (0.0, 0.0))
    found = pinhole(camera)
    assert (found.focal_px, found.resolution_px, found.distortion) == (300.0, (320, 240), (0.0, 0.0))
    pixels, _ = found.project(np.array([[5.0, 4.0, 1.0]]))
    np.testing.assert_allclose(pixels, [[159.5, 119.5]])


def test_angles_that_are_left_out_are_0(load):
    camera = camera_of(load("pitch_deg: -20"))
    assert (camera.yaw_deg, camera.pitch_deg, camera.roll_deg, camera.look_at_m) == (0.0, -20.0, 0.0, None)
    forward = pinhole(camera).rotation[2]
    np.testing.assert_allclose(forward, [math.cos(math.radians(20)), 0.0, -math.sin(math.radians(20))])


def test_angles_and_a_point_are_two_ways_to_say_the_same(load):
    yaw, pitch = math.degrees(math.atan2(4, 5)), math.degrees(math.atan2(-2, math.hypot(4, 5)))
    turned = pinhole(camera_of(load(f"yaw_deg: {yaw}, pitch_deg: {pitch}")))
    np.testing.assert_allclose(turned.rotation, pinhole(camera_of(load(LOOK))).rotation, atol=1e-12)


def test_the_field_of_view_reaches_from_border_to_border(load):
    camera = camera_of(load(f"{LOOK}, fov_deg: 90, resolution_px: [640, 480]"))
    assert camera.focal_px is None
    assert focal_length_px(camera) == pytest.approx(320.0)
    borders = pinhole(camera).rays(np.array([[-0.5, 239.5], [639.5, 239.5]]))
    np.testing.assert_allclose(borders[:, 0], [-1.0, 1.0])


def test_an_override_goes_from_a_point_to_angles(load):
    camera = camera_of(load(LOOK, ["cameras[c1].look_at_m=null", "cameras[c1].yaw_deg=45"]))
    assert (camera.look_at_m, camera.yaw_deg) == (None, 45.0)


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        ("rate_hz: 4", "cameras[0]: must look somewhere: give look_at_m, or yaw_deg, pitch_deg and roll_deg"),
        (
            f"{LOOK}, yaw_deg: 3, roll_deg: 0",
            "cameras[0]: must look one way: look_at_m or angles, got both look_at_m and yaw_deg and roll_deg; leave one out or make it null",
        ),
        (
            f"{LOOK}, focal_px: 300, fov_deg: 60",
            "cameras[0]: must have focal_px or fov_deg, got both: 300 px and 60°; leave one out or make it null",
        ),
        (
            f"{LOOK}, distortion: [-1, 0]",
            "cameras[0]: distortion: a ray must reach the corners of the image, 0.667 focal lengths from its middle, got [-1.0, 0.0], with which none gets beyond 0.385; take weaker coefficients or a longer focal length",
        ),
        (f"{LOOK}, distortion: [-0.1]", "cameras[0].distortion: must have exactly 2 items, got 1"),
        (f"{LOOK}, distortion: [.inf, 0]", "cameras[0].distortion[0]: must be a finite number, got inf"),
        ("pitch_deg: 91", "cameras[0].pitch_deg: must be at most 90, got 91"),
        (f"{LOOK}, fov_deg: 180", "cameras[0].fov_deg: must be at most 175, got 180"),
        (
            f"{LOOK}, background: 3",
            'cameras[0].background: must be photo/NAME, an image file, or a mapping of kind "picture" or "video", got 3',
        ),
        (
            f"{LOOK}, background: {{kind: movie}}",
            'cameras[0].background: must be photo/NAME, an image file, or a mapping of kind "picture" or "video", got a mapping',
        ),
        (
            f"{LOOK}, background: {{kind: picture, source: photo/cofee}}",
            'cameras[0].background.source: must be a known photograph: "photo/china", "photo/coffee", "photo/flower" or "photo/gravel", got "photo/cofee"; did you mean "photo/coffee"?',
        ),
        (
            f"{LOOK}, background: {{kind: picture, clutter: {{decoys: -1, radius: 3}}}}",
            "cameras[0].background.clutter.decoys: must be at least 0, got -1",
        ),
        (
            f"{LOOK}, background: {{kind: picture, clutter: {{radius_px: [9, 4]}}}}",
            "cameras[0].background.clutter: radius_px must be the smallest and then the largest, got 9 and 4",
        ),
        (
            f"{LOOK}, background: {{kind: video, file: clip.avi}}",
            'cameras[0].background.file: must be a file that exists, got "HERE/clip.avi"',
        ),
        (
            f"{LOOK}, background: {{kind: video, fil: s.yaml}}",
            'cameras[0].background.fil: unknown key; did you mean "file"?',
        ),
        (
            f"{LOOK}, illumination_drift: {{kind: sinusoid, amplitude: 1}}",
            "cameras[0].illumination_drift.amplitude: must be less than 1, got 1",
        ),
        (
            f"{LOOK}, illumination_drift: {{kind: sinusoidal}}",
            'cameras[0].illumination_drift.kind: must be "sinusoid" or "ornstein_uhlenbeck", got "sinusoidal"; did you mean "sinusoid"?',
        ),
        (
            f"{LOOK}, illumination_drift: {{amplitude: 0.1}}",
            'cameras[0].illumination_drift.kind: must be given: "sinusoid" or "ornstein_uhlenbeck"',
        ),
    ],
)
def test_one_error(load, tmp_path, camera, message):
    with pytest.raises(ScenarioError) as caught:
        load(camera)
    lines = str(caught.value).replace(f"{tmp_path}/", "HERE/").splitlines()
    assert all(line.startswith("HERE/s.yaml:9:") for line in lines)
    assert message in [line.split(": ", 1)[1] for line in lines]


def test_what_turns_out_wrong_later_is_told_with_its_line(load, tmp_path):
    pytest.importorskip("av")
    (tmp_path / "clip.avi").write_text("no film")
    Image.new("I;16", (8, 8)).save(tmp_path / "deep.png")
    for camera, message in [
        (
            "background: {kind: video, file: clip.avi}",
            "cameras[0].background.file: a film must be a video file",
        ),
        (
            "background: {kind: picture, source: deep.png}",
            "cameras[0].background.source: a photograph must have 8 bits",
        ),
        ("background: deep.png", "cameras[0].background: a photograph must have 8 bits"),
    ]:
        loaded = load(f"{LOOK}, {camera}")
        with pytest.raises(ScenarioError) as caught:
            build(loaded)
        (problem,) = caught.value.problems
        assert str(problem).split(": ", 1)[1].startswith(message)
        assert problem.line == 9


def test_a_film_that_is_too_short_for_the_run(load, shared):
    pytest.importorskip("av")
    path = shared / "data/opencv_samples/vtest.avi"
    background = f"background: {{kind: video, file: {path}, start_s: 78}}"
    with pytest.raises(
        ScenarioError, match=r"background\.file: the film must last as long as the run, .* 79\.5 s"
    ):
        build(load(f"{LOOK}, {background}"))
    looped = build(load(f"{LOOK}, {background.replace('}', ', loop: true}')}"))
    assert isinstance(looped.cameras[0].renderer.background, Film)


def test_everything_a_camera_can_be_is_built_and_written_out_again(load, tmp_path):
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    Image.new("L", (64, 48), 90).save(tmp_path / "wall.png")
    clutter = "background: {kind: picture, source: wall.png, clutter: {decoys: 3, seed: 5}}"
    drift = "illumination_drift: {kind: ornstein_uhlenbeck, sd: 0.2, correlation_s: 9}"
    loaded = load(f"yaw_deg: 38, roll_deg: 4, fov_deg: 56, distortion: [-0.2, 0.05], {clutter}, {drift}")
    file = folder / "resolved.yaml"
    file.write_text(resolved_yaml(loaded, folder))
    again = load_scenario(file)
    assert again.scenario == loaded.scenario
    assert scenario_hash(again) == scenario_hash(loaded)
    camera = build(loaded).cameras[0].renderer
    assert isinstance(camera.drift, RandomDrift)
    assert camera.background.shape == (240, 320, 3)
    # A grey picture becomes RGB; the decoys on it are coloured.
    plain = camera.background == 90
    assert 0.5 < plain.all(axis=2).mean() < 1.0
    np.testing.assert_array_equal(camera.background, build(again).cameras[0].renderer.background)


def test_a_phase_that_is_not_given_is_each_cameras_own():
    data = {
        "duration_s": 1,
        "world": {
            "size_m": [10, 8, 4],
            "targets": [
                {
                    "id": "box",
                    "shape": {"kind": "ellipsoid", "semi_axes_m": [0.4, 0.3, 0.3]},
                    "motion": {"kind": "waypoints", "points_m": [[3, 4, 1]]},
                }
            ],
        },
        "cameras": [
            {
                "id": name,
                "position_m": [0, 0, 3],
                "look_at_m": [5, 4, 1],
                "illumination_drift": {"kind": "sinusoid"} | phase,
            }
            for name, phase in [("c1", {}), ("c2", {}), ("c3", {"phase_deg": 90})]
        ],
        "motes": {"base": {"position_m": [5, 0, 2]}},
        "network": {"standard": "ideal"},
        "system": {"kind": "multiview"},
    }
    drifts = [camera.renderer.drift for camera in build(scenario_from_dict(data)).cameras]
    assert all(isinstance(drift, SinusoidalDrift) for drift in drifts)
    assert len({drift.phase_rad for drift in drifts}) == 3
    assert drifts[2](0) == pytest.approx(1.2)
    again = [camera.renderer.drift for camera in build(scenario_from_dict(data)).cameras]
    assert again == drifts


def test_a_film_is_opened_only_where_one_is_asked_for():
    code = "import sys, wsnsim.sim.eyes; sys.exit('av' in sys.modules or 'cv2' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
