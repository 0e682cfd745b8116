from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import wsnsim.vision.photos as photos
from wsnsim.vision.photos import PHOTO_NAMES, load_background

FOLDER = Path(photos.__file__).with_name("photos")


@pytest.mark.parametrize("name", PHOTO_NAMES)
@pytest.mark.parametrize("resolution", [(320, 240), (64, 128)])
def test_built_in_photographs_come_in_any_resolution(name, resolution):
    image = load_background(name, resolution)
    assert image.shape == (resolution[1], resolution[0], 3)
    assert image.dtype == np.uint8
    assert image.std() > 20.0


def test_every_photograph_is_credited_and_small():
    files = {path.stem: path for path in FOLDER.glob("*.jpg")}
    assert sorted(f"photo/{stem}" for stem in files) == sorted(PHOTO_NAMES)
    assert sum(path.stat().st_size for path in files.values()) < 500_000
    table = (FOLDER / "CREDITS.md").read_text()
    for path in files.values():
        row = next(line for line in table.splitlines() if f"`{path.name}`" in line)
        assert "creativecommons.org" in row


def test_the_middle_of_the_picture_is_kept_undistorted(tmp_path):
    stripes = np.zeros((100, 300, 3), np.uint8)
    stripes[:, 100:200] = (200, 100, 50)
    path = tmp_path / "stripes.png"
    Image.fromarray(stripes).save(path)
    image = load_background(path, (50, 50))
    np.testing.assert_array_equal(image[:, 3:-3], np.broadcast_to((200, 100, 50), (50, 44, 3)))


@pytest.mark.parametrize("mode", ["L", "LA", "P", "RGBA", "1", "CMYK"])
def test_pictures_of_other_modes_become_rgb(tmp_path, mode):
    path = tmp_path / "picture.tif"
    Image.new("RGB", (8, 8), "white").convert(mode).save(path)
    np.testing.assert_array_equal(load_background(path, (4, 4)), np.full((4, 4, 3), 255))


def test_grey_pictures_have_equal_channels():
    image = load_background("photo/gravel", (100, 100)).astype(int)
    assert abs(image - image[:, :, :1]).max() == 0


def test_pictures_are_turned_upright(tmp_path):
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[0] = 255
    exif = Image.Exif()
    exif[0x0112] = 3  # upside down
    path = tmp_path / "turned.png"
    Image.fromarray(pixels).save(path, exif=exif)
    assert load_background(path, (4, 4))[:, 0, 0].tolist() == [0, 0, 0, 255]


def test_unknown_names_are_guessed():
    with pytest.raises(ValueError, match=r"photo/china, .*got 'photo/chian'; did you mean 'photo/china'\?"):
        load_background("photo/chian", (4, 4))


def test_missing_files_and_folders_are_named(tmp_path):
    for path in (tmp_path / "gone.png", tmp_path):
        with pytest.raises(ValueError, match=path.name):
            load_background(path, (4, 4))


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "gif", "tif"])
def test_damaged_files_are_named(tmp_path, suffix):
    noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    whole = tmp_path / f"whole.{suffix}"
    Image.fromarray(noise).save(whole)
    for name, content in (
        ("truncated", whole.read_bytes()[:700]),
        ("empty", b""),
        ("text", b"no picture at all"),
    ):
        path = tmp_path / f"{name}.{suffix}"
        path.write_bytes(content)
        with pytest.raises(ValueError, match=f"must be an image file that can be read.*{name}"):
            load_background(path, (4, 4))


def test_pictures_of_more_than_8_bits_are_refused(tmp_path):
    path = tmp_path / "deep.png"
    Image.fromarray(np.full((4, 4), 40_000, np.uint16)).save(path)
    with pytest.raises(ValueError, match="must have 8 bits a channel"):
        load_background(path, (4, 4))
