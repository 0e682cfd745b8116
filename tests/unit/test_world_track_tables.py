"""Recordings of many people in one file.

Real data: UCY Zara01 (Lerner, Chrysanthou, Lischinski, Crowds by Example, 2007); TUD Campus of MOTChallenge.
"""

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.world.track_tables import read_homography, read_motchallenge, read_obsmat

OBSMAT = """\
  1.0e+00  7.0e+00  2.5  0.0  -1.0   0.1 0.0 0.2
  1.0e+00  8.0e+00  9.0  0.0   9.0   0.0 0.0 0.0
  1.1e+01  7.0e+00  3.5  5.0   1.0   0.1 0.0 0.2
"""
MOT = """\
1,3,100,50,20,60,1,-1,-1,-1
1,4,0,0,1,1,1,2.5,3.5,0.0
2,3,104,50,20,60,1,-1,-1,-1
2,4,0,0,1,1,1,-1,3.5,0.25
"""
SHIFT = np.array([[0.1, 0.0, -10.0], [0.0, 0.1, -5.0], [0.0, 0.0, 1.0]])


@pytest.fixture
def write(tmp_path):
    def make(content, name="tracks.txt"):
        path = tmp_path / name
        path.write_text(content)
        return path

    return make


def test_obsmat_by_hand(write):
    table = read_obsmat(write(OBSMAT))
    assert table.known_ids == (7, 8)
    frames, places = table.track(7)
    np.testing.assert_array_equal(frames, [1, 11])
    # the columns are x, z, y, and z is not used
    np.testing.assert_array_equal(places, [[2.5, -1.0, 0.0], [3.5, 1.0, 0.0]])


def test_motchallenge_by_hand(write):
    table = read_motchallenge(write(MOT))
    assert table.known_ids == (3, 4)
    assert table.line_without_place(4) is None
    frames, places = table.track(4)
    np.testing.assert_array_equal(frames, [1, 2])
    # one coordinate of −1 is a place
    np.testing.assert_array_equal(places, [[2.5, 3.5, 0.0], [-1.0, 3.5, 0.25]])
    assert table.line_without_place(3) == 1
    # feet at (110, 110) and (114, 110)
    np.testing.assert_allclose(table.track(3, SHIFT)[1], [[1.0, 6.0, 0.0], [1.4, 6.0, 0.0]])


def test_a_tilted_camera_shrinks_what_is_far(write):
    # w = 1 − v / 200: the horizon is where v is 200, and what is nearer to it is farther away
    tilted = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -0.005, 1.0]])
    table = read_motchallenge(write("1,1,90,90,20,10,1\n2,1,90,140,20,10,1\n"))
    np.testing.assert_allclose(table.track(1, tilted)[1], [[200.0, 200.0, 0.0], [400.0, 600.0, 0.0]])
    beyond = read_motchallenge(write("1,1,90,90,20,10,1\n2,1,90,240,20,10,1\n"))
    with pytest.raises(ScenarioError, match=r"tracks\.txt:2:1: the lower edge of the box must be below"):
        beyond.track(1, tilted)


@pytest.mark.parametrize("extra", ["", ",1", ",1,0.7"])
def test_motchallenge_files_of_other_years_have_no_places(write, extra):
    table = read_motchallenge(write(f"1,1,90,90,20,10,1{extra}\n"))
    assert table.line_without_place(1) == 1
    np.testing.assert_array_equal(table.feet, [[100.0, 100.0]])


@pytest.mark.parametrize(
    ("content", "place", "message"),
    [
        ("", None, "must hold at least one row, got an empty file"),
        ("# only words\n\n", None, "must hold at least one row"),
        ("1 2 3 0\n", "1:8", "y: must be a finite number, got ''"),
        ("1 2 3 0 4\n11 2 x 0 4\n", "2:6", "x: must be a finite number, got 'x'"),
        ("1 2 3 0 nan\n", "1:9", "y: must be a finite number, got 'nan'"),
        ("1 2.5 3 0 4\n", "1:3", "id: must be a whole number, got 2.5"),
        ("1,2,3,0,4\n", "1:1", "frame: must be a finite number, got '1,2,3,0,4'"),
        ("1 2 1e10 0 4\n", "1:5", "x: must be a number of size 1e+09 or less, got '1e10'"),
    ],
)
def test_faults_of_obsmat(write, content, place, message):
    path = write(content)
    with pytest.raises(ScenarioError) as caught:
        read_obsmat(path)
    text = str(caught.value)
    assert text.startswith(f"{path}:" if place is None else f"{path}:{place}: ")
    assert message in text


@pytest.mark.parametrize(
    ("content", "place", "message"),
    [
        ("1,2,3,4,5\n", "1:10", "bb_height: must be a finite number, got ''"),
        ("1,2,3,4,5,6,1,1,,1\n", "1:17", "y: must be a finite number, got ''"),
        ("1,two,3,4,5,6\n", "1:3", "id: must be a finite number, got 'two'"),
        ("1 2 3 4 5 6\n", "1:1", "frame: must be a finite number, got '1 2 3 4 5 6'"),
        ("time_s,x_m,y_m\n", "1:1", "frame: must be a finite number, got 'time_s'"),
    ],
)
def test_faults_of_motchallenge(write, content, place, message):
    path = write(content)
    with pytest.raises(ScenarioError) as caught:
        read_motchallenge(path)
    assert str(caught.value).startswith(f"{path}:{place}: ")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ((3, 1), ":2:1: frame: must increase from row to row of track 5, got 1 after 3 (line 1)"),
        ((3, 3), ":2:1: frame: must increase from row to row of track 5, got 3 again (line 1)"),
    ],
)
def test_frames_of_a_track_must_increase(write, frames, message):
    table = read_obsmat(write("".join(f"{frame} 5 0 0 0\n" for frame in frames)))
    with pytest.raises(ScenarioError) as caught:
        table.track(5)
    assert message in str(caught.value)


def test_frames_of_other_tracks_do_not_matter(write):
    table = read_obsmat(write("5 1 0 0 0\n1 2 0 0 0\n7 1 0 0 0\n2 2 0 0 0\n"))
    np.testing.assert_array_equal(table.track(1)[0], [5, 7])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("1 0 0\n0 1 0\n", "must hold 3 lines of 3 numbers, got lines of [3, 3] numbers"),
        ("1 0 0\n0 1\n0 0 1\n", "got lines of [3, 2, 3] numbers"),
        ("1 0 0\n0 x 0\n0 0 1\n", ":2:3: entry: must be a finite number, got 'x'"),
        ("1 0 0\n2 0 0\n0 0 1\n", "must be a matrix that has an inverse"),
    ],
)
def test_faults_of_homographies(write, content, message):
    with pytest.raises(ScenarioError) as caught:
        read_homography(write(content))
    assert message in str(caught.value)


def test_ucy_like_numpy(shared):
    file = shared / "data" / "ucy" / "zara01" / "obsmat.txt"
    rows = np.loadtxt(file)
    table = read_obsmat(file)
    assert list(table.known_ids) == sorted({int(each) for each in rows[:, 1]})
    assert len(table.known_ids) == 148
    for track in table.known_ids:
        own = rows[rows[:, 1] == track]
        frames, places = table.track(track)
        np.testing.assert_array_equal(frames, own[:, 0])
        np.testing.assert_array_equal(places[:, :2], own[:, [2, 4]])
    np.testing.assert_array_equal(
        read_homography(file.with_name("H.txt")), np.loadtxt(file.with_name("H.txt"))
    )


def test_tud_campus_like_numpy(shared):
    file = shared / "data" / "motmetrics" / "motmetrics" / "data" / "TUD-Campus" / "gt.txt"
    rows = np.loadtxt(file, delimiter=",")
    table = read_motchallenge(file)
    for track in table.known_ids:
        own = rows[rows[:, 1] == track]
        frames, places = table.track(track, SHIFT)
        np.testing.assert_array_equal(frames, own[:, 0])
        feet = np.column_stack([own[:, 2] + own[:, 4] / 2, own[:, 3] + own[:, 5]])
        np.testing.assert_allclose(places[:, :2], 0.1 * feet - [10.0, 5.0])
