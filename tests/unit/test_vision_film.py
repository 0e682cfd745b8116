import sys
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

from wsnsim.errors import SimulationError
from wsnsim.vision.film import Film

av = pytest.importorskip("av")

SIZE = (64, 48)
LEVELS = [10 * (k + 1) for k in range(20)]


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Two seconds of grey at 10 frames a second, each frame lighter than the last."""
    path = tmp_path_factory.mktemp("film") / "clip.avi"
    write(path, LEVELS)
    return path


def write(path, levels, codec="ffv1", options=None):
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=10, options=options or {})
        stream.width, stream.height, stream.pix_fmt = *SIZE, "gray" if codec == "ffv1" else "yuv420p"
        stream.time_base = Fraction(1, 10)
        for number, level in enumerate(levels):
            picture = np.full((SIZE[1], SIZE[0]), level, np.uint8)
            if codec != "ffv1":  # luminance as it is, no colour
                picture = np.concatenate((picture, np.full((SIZE[1] // 2, SIZE[0]), 128, np.uint8)))
            frame = av.VideoFrame.from_ndarray(picture, format=stream.pix_fmt)
            frame.pts = number
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def level(picture):
    assert picture.shape == (48, 64, 3)
    assert picture.dtype == np.uint8
    assert np.ptp(picture) == 0
    return int(picture[0, 0, 0])


def test_the_frame_nearest_in_time_is_shown(clip):
    film = Film(clip, SIZE, rate_hz=4.0)
    assert film.length_s == pytest.approx(2.0)
    # Steps are 0.25 s apart, frames 0.1 s: at 0.25 s frames 2 and 3 are as near, at 0.75 s 7 and 8.
    shown = [level(film(step)) for step in range(8)]
    assert [shown[k] for k in (0, 2, 4, 6)] == [LEVELS[k] for k in (0, 5, 10, 15)]
    assert shown[1] in LEVELS[2:4]
    assert shown[3] in LEVELS[7:9]
    late = Film(clip, SIZE, rate_hz=4.0, start_s=0.32)
    assert [level(late(step)) for step in (0, 1, 2)] == [LEVELS[k] for k in (3, 6, 8)]


def test_the_order_of_steps_changes_no_picture(clip):
    forwards = Film(clip, SIZE, rate_hz=10.0)
    expected = [level(forwards(step)) for step in range(20)]
    assert expected == LEVELS
    film = Film(clip, SIZE, rate_hz=10.0)
    order = np.random.default_rng(0).permutation(20)
    assert [level(film(int(step))) for step in order] == [LEVELS[k] for k in order]
    assert film(3) is film(3)


def test_a_loop_begins_again(clip):
    film = Film(clip, SIZE, rate_hz=10.0, start_s=0.5, loop=True)
    assert [level(film(step)) for step in (0, 14, 15, 34, 35, 4015)] == [
        LEVELS[k] for k in (5, 19, 0, 19, 0, 0)
    ]
    film.check_length(10**6)


def test_a_film_must_last_as_long_as_the_run(clip):
    film = Film(clip, SIZE, rate_hz=4.0)
    film.check_length(8)
    with pytest.raises(
        ValueError, match=r"must last as long as the run, .* is 2 s long .* taken 2\.25 s from"
    ):
        film.check_length(9)
    with pytest.raises(ValueError, match=r"must begin before it ends, .* is 2 s long and start_s is 3"):
        Film(clip, SIZE, rate_hz=4.0, start_s=3.0)


def test_missing_damaged_and_other_files_are_named(clip, tmp_path):
    (tmp_path / "text.avi").write_text("no film at all")
    (tmp_path / "empty.avi").write_bytes(b"")
    Image.new("RGB", SIZE).save(tmp_path / "picture.png")
    whole = clip.read_bytes()
    frames = whole.index(b"movi")
    (tmp_path / "cut.avi").write_bytes(whole[: (frames + whole.index(b"idx1")) // 2])
    (tmp_path / "head.avi").write_bytes(whole[:300])
    for name, message in [
        ("gone.avi", "must be a file that can be read, .*gone.avi: No such file"),
        ("text.avi", "must be a video file, .*text.avi is damaged or none at all"),
        ("empty.avi", "empty.avi"),
        ("picture.png", "must have two frames or more, .*picture.png has 1"),
        ("cut.avi", r"must be whole, .*cut.avi breaks off after frame \d+ of 20"),
        ("head.avi", "head.avi"),
    ]:
        with pytest.raises(ValueError, match=message):
            Film(tmp_path / name, SIZE, rate_hz=4.0)


def test_a_film_without_pictures_is_refused(tmp_path):
    path = tmp_path / "sound.wav"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    with pytest.raises(ValueError, match=r"must hold moving pictures, .*sound\.wav has none"):
        Film(path, SIZE, rate_hz=4.0)


def test_a_film_that_goes_away_during_the_run_ends_it(clip, tmp_path):
    path = tmp_path / "clip.avi"
    path.write_bytes(clip.read_bytes())
    film = Film(path, SIZE, rate_hz=4.0)
    path.unlink()
    with pytest.raises(
        SimulationError, match=r"t = 0\.500000 s: the film .* cannot be decoded as far as frame 6"
    ):
        film(2)


def test_without_pyav_the_way_to_get_it_is_told(clip, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(
        ValueError, match=r'needs PyAV, which cannot be imported .*: pip install "wsnsim\[vision\]"'
    ):
        Film(clip, SIZE, rate_hz=4.0)


def test_frames_that_are_stored_out_of_order_are_shown_in_order(tmp_path):
    # MPEG-4 with two frames between each two that they are predicted from: the file holds 0 3 1 2 6 4 5 ...
    path = tmp_path / "clip.mp4"
    write(path, LEVELS, "mpeg4", {"bf": "2", "qmin": "1", "qmax": "2"})
    with av.open(str(path)) as container:
        stamps = [packet.pts for packet in container.demux(video=0) if packet.size]
    assert stamps != sorted(stamps)
    film = Film(path, SIZE, rate_hz=10.0)
    assert film.length_s == pytest.approx(2.0)
    # The luminance of video, 16 to 235, is stretched to 0 to 255.
    expected = [(level - 16) * 255 / 219 for level in LEVELS[1:]]
    found = [film(step).mean() for step in range(1, 20)]
    assert found == pytest.approx(expected, abs=4.0)


def test_a_real_film(shared):
    path = shared / "data/opencv_samples/vtest.avi"
    film = Film(path, (320, 240), rate_hz=4.0)
    assert film.length_s == pytest.approx(79.5)  # 795 frames at 10 a second
    for step in (1, 5, 10):
        with av.open(str(path)) as container:
            number = film.frame_at(step / 4.0)
            frame = [frame for _, frame in zip(range(number + 1), container.decode(video=0), strict=False)][
                -1
            ]
        assert frame.time == pytest.approx(step / 4.0, abs=0.05 + 1e-9)
        # 768 x 576 and 320 x 240 have one aspect: nothing is cut off.
        whole = Image.fromarray(frame.to_ndarray(format="rgb24"))
        expected = np.asarray(whole.resize((320, 240), Image.Resampling.LANCZOS))
        np.testing.assert_allclose(film(step).astype(int), expected, atol=1)
    assert (film(1) != film(10)).mean() > 0.05
