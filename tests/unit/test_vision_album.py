"""Pictures of a target with known poses: what a tracker learns from them, and what is wrong with them."""

import numpy as np
import pytest
from PIL import Image

from wsnsim.errors import ScenarioError
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines, outline_box
from wsnsim.geometry.rotations import IDENTITY, quaternion_from_axis_angle, quaternion_to_matrix
from wsnsim.kernels.histograms import kernel_histogram
from wsnsim.rng import RandomStreams
from wsnsim.systems.multiview.viewpoints import viewpoints
from wsnsim.vision.album import read_album, write_album
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.portrait import Portrait, Studio
from wsnsim.world.bodies import Body, PatchTexture

SEMI_AXES = np.array([0.40, 0.28, 0.34])
FEATURES = FeatureSpace()


def make_studio(orientation=IDENTITY):
    streams = RandomStreams(3)
    body = Body(SEMI_AXES, PatchTexture.random(streams.stream("test_album")))
    light = np.array([0.0, 0.0, 1.0])
    return Studio(body, orientation, light, 1.0, 120.0, (160, 120), 3.0, 5.0, streams, "box")


def histograms(portrait):
    """Colour and texture as a tracker learns them (Kushwaha & Koutsoukos 2013, Eq. 8)."""
    outlines = ellipsoid_outlines(portrait.camera, np.zeros((1, 3)), portrait.orientation, SEMI_AXES)
    width, height = portrait.camera.resolution_px
    region = FEATURES.bin_region(portrait.image, outline_box(outlines, width, height))
    ellipse = outlines.centres[0], outlines.shapes[0]
    bins = FEATURES.colour_bins, FEATURES.texture_bins
    return kernel_histogram(region.colour, region.texture, region.x0, region.y0, *ellipse, *bins)


@pytest.fixture(scope="module")
def album(tmp_path_factory):
    """Return a folder with the album of a studio's 26 portraits."""
    studio = make_studio()
    folder = tmp_path_factory.mktemp("album")
    write_album([studio.portrait(direction) for direction in viewpoints()], folder)
    return folder


def edited(album, tmp_path, line=1, text=None):
    """Return an album like `album`, in which one line (from 1) has another text."""
    lines = (album / "album.csv").read_text().splitlines()
    lines[line - 1] = text or lines[line - 1]
    for picture in album.glob("*.png"):
        (tmp_path / picture.name).symlink_to(picture)
    (tmp_path / "album.csv").write_text("\n".join(lines) + "\n")
    return tmp_path / "album.csv"


def refused(path, **options):
    with pytest.raises(ScenarioError) as caught:
        read_album(path, SEMI_AXES, **options)
    return [str(problem).replace(str(path), "album.csv") for problem in caught.value.problems]


def test_an_album_of_a_studio_teaches_what_the_studio_does(album):
    studio, views = make_studio(), read_album(album / "album.csv", SEMI_AXES)
    assert len(views) == 26
    for direction, view in zip(viewpoints(), views, strict=True):
        portrait = studio.portrait(direction)
        np.testing.assert_allclose(view.direction, direction, rtol=0.0, atol=1e-15)
        np.testing.assert_array_equal(view.portrait.image, portrait.image)
        for found, expected in zip(histograms(view.portrait), histograms(portrait), strict=True):
            np.testing.assert_array_equal(found, expected)


def test_a_target_that_stands_askew_is_seen_in_its_own_axes(tmp_path):
    """The pictures are rolled against the target's z; the outlines must be where they are seen."""
    studio = make_studio(quaternion_from_axis_angle([1.0, 2.0, -0.5], 0.9))
    portraits = [studio.portrait(direction) for direction in viewpoints()]
    views = read_album(write_album(portraits, tmp_path / "album"), SEMI_AXES)
    rolled = 0
    for direction, portrait, view in zip(viewpoints(), portraits, views, strict=True):
        np.testing.assert_allclose(view.direction, direction, rtol=0.0, atol=1e-12)
        to_world = quaternion_to_matrix(portrait.orientation)
        np.testing.assert_allclose(
            view.portrait.camera.rotation, portrait.camera.rotation @ to_world, rtol=0.0, atol=1e-9
        )
        level = PinholeCamera.look_at(view.portrait.camera.position, np.zeros(3), 120.0, (160, 120))
        rolled += not np.allclose(level.rotation, view.portrait.camera.rotation)
        for found, expected in zip(histograms(view.portrait), histograms(portrait), strict=True):
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)
    assert rolled > 20


def test_roll_turns_the_camera_clockwise_as_seen_from_behind(album, tmp_path):
    path = edited(album, tmp_path, 2, "view01.png,0,-3,0,30,120")
    camera = read_album(path, SEMI_AXES)[0].portrait.camera
    expected = PinholeCamera.at_angles([0.0, -3.0, 0.0], np.pi / 2, 0.0, np.pi / 6, 120.0, (160, 120))
    np.testing.assert_allclose(camera.rotation, expected.rotation, rtol=0.0, atol=1e-12)


def test_columns_in_any_order_comments_and_no_roll(album, tmp_path):
    for picture in album.glob("*.png"):
        (tmp_path / picture.name).symlink_to(picture)
    rows = [f"120, {x:.4f}, by hand, {y:.4f}, {z:.4f}, view{i:02d}.png" for i, (x, y, z) in POSITIONS]
    header = "focal_px, x_m, taken, y_m, z_m, file"
    (tmp_path / "mine.csv").write_text("\n".join(["# of the box", "", header, *rows]))
    views = read_album(tmp_path / "mine.csv", SEMI_AXES)
    assert len(views) == 26
    np.testing.assert_allclose([view.direction for view in views], viewpoints(), rtol=0.0, atol=1e-4)


POSITIONS = tuple(enumerate((3.0 * viewpoints()).tolist(), start=1))


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (1, "file,x_m,y_m,z_m,roll_deg,focal", "1:1: the header must name 'focal_px' once"),
        (1, "file,x_m,y_m,z_m,roll_deg,roll_deg,focal_px", "1:1: the header must name 'roll_deg' once"),
        (4, "view3.png,0,0,3,0,120", "4:1: file: must be a picture beside"),
        (4, ",0,0,3,0,120", "4:1: file: must be a picture beside"),
        (5, "view04.png,nan,0,3,0,120", "5:12: x_m: must be a finite number, got 'nan'"),
        (5, "view04.png,1,0,3,0", "5:19: focal_px: must be a finite number, got ''"),
        (5, "view04.png,0,0,0.3,0,120", "5:12: x_m: the camera must stand outside"),
        (5, "view04.png,0,0,0.3402,0,120", "5:25: focal_px: the camera must stand before"),
        (5, "view04.png,0,0,3,0,-120", "5:20: focal_px: must be above 0, got -120 [px]"),
        (5, "view04.png,0,0,3,0,900", "5:20: focal_px: the picture must show the whole"),
        (5, "view04.png,0,0,40,0,120", "5:21: focal_px: the target must fill at least 100"),
    ],
)
def test_what_is_wrong_in_the_file(album, tmp_path, line, text, message):
    problems = refused(edited(album, tmp_path, line, text))
    assert len(problems) == 1
    assert problems[0].startswith(f"album.csv:{message}")


def test_all_that_is_wrong_is_told_at_once(album, tmp_path):
    path = edited(album, tmp_path, 3, "view99.png,0,0,3,0,120")
    path.write_text(path.read_text().replace("view05.png,", "view05.png,one"))
    assert [problem.split(": ")[0] for problem in refused(path)] == ["album.csv:3:1", "album.csv:6:12"]


def test_too_few_views(album, tmp_path):
    path = edited(album, tmp_path)
    path.write_text("\n".join(path.read_text().splitlines()[:6]))
    assert refused(path) == ["album.csv:1:1: must hold at least 6 pictures from different sides, got 5"]
    assert len(read_album(path, SEMI_AXES, least_views=5)) == 5
    path.write_text("")
    assert refused(path) == ["album.csv: must hold a header and a row for each picture, got an empty file"]
    path.unlink()
    assert "must be a file that exists" in refused(path)[0]


def test_pictures_that_cannot_be_taken(album, tmp_path):
    path = edited(album, tmp_path)
    whole = (album / "view01.png").read_bytes()
    pictures = {f"view{i:02d}.png": tmp_path / f"view{i:02d}.png" for i in range(1, 7)}
    for picture in pictures.values():
        picture.unlink()
    pictures["view01.png"].write_bytes(whole[: len(whole) // 2])
    pictures["view02.png"].write_text("no picture at all")
    Image.open(album / "view03.png").convert("L").save(pictures["view03.png"])
    Image.open(album / "view04.png").convert("L").convert("RGB").save(pictures["view04.png"])
    Image.fromarray(np.zeros((120, 160), np.uint16)).save(pictures["view05.png"])
    Image.new("RGB", (2000, 1100), (200, 10, 10)).save(pictures["view06.png"])
    problems = refused(path)
    assert [problem.split(": ")[0] for problem in problems] == [f"album.csv:{line}:1" for line in range(2, 8)]
    expected = (
        "truncated",
        "cannot identify image file",
        "must have colours",
        "must have colours",
        "8 bits a channel",
        "must have at most 1920 x 1080 pixels in all, got 2000 x 1100",
    )
    for problem, words in zip(problems, expected, strict=True):
        assert words in problem


def test_only_portraits_of_the_target_are_written(tmp_path):
    portrait = make_studio().portrait(viewpoints()[0])
    camera = portrait.camera
    aside = PinholeCamera.look_at(camera.position, [0.5, 0.0, 0.0], 120.0, (160, 120))
    bent = PinholeCamera.look_at(camera.position, np.zeros(3), 120.0, (160, 120), (0.1, 0.0))
    for wrong, message in ((aside, "must look at the target's centre"), (bent, "must have no distortion")):
        with pytest.raises(ValueError, match=message):
            write_album([Portrait(portrait.image, wrong, IDENTITY)], tmp_path / "album")
    assert not (tmp_path / "album").exists()


def test_pictures_of_one_side_only_are_refused(tmp_path):
    """Twelve pictures, all within a few degrees, are one side."""
    studio = make_studio()
    near = [np.array([1.0, 0.01 * number, 0.0]) for number in range(12)]
    write_album([studio.portrait(side / np.linalg.norm(side)) for side in near], tmp_path)
    (problem,) = refused(tmp_path / "album.csv")
    assert "must hold pictures from at least 6 sides, got 1 of them" in problem
