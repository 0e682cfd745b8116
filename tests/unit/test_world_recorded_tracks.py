import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.geometry.rotations import quaternion_from_axis_angle, quaternion_to_matrix
from wsnsim.world.recorded import read_track_csv

GOOD = """# a walk
person, time_s ,x_m,y_m

7,1.0,2.0,3.0
7,1.5,3.0,3.0  # faster now
7,3.0,3.0,0.0
"""


@pytest.fixture
def write(tmp_path):
    def make(content):
        path = tmp_path / "walk.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return make


@pytest.mark.parametrize(
    ("time", "position", "velocity"),
    [
        (0.0, [2, 3, 1.1], [0, 0, 0]),
        (1.0, [2, 3, 1.1], [2, 0, 0]),
        (1.25, [2.5, 3, 1.1], [2, 0, 0]),
        (2.0, [3, 2, 1.1], [0, -2, 0]),
        (3.0, [3, 0, 1.1], [0, 0, 0]),
        (9.0, [3, 0, 1.1], [0, 0, 0]),
    ],
)
def test_straight_lines_between_rows(write, time, position, velocity):
    pose = read_track_csv(write(GOOD), height_m=1.1).at(time)
    np.testing.assert_allclose(pose.position, position)
    np.testing.assert_allclose(pose.velocity, velocity)


def test_scale_and_offset(write):
    track = read_track_csv(write(GOOD), scale=2.0, offset_m=(10.0, 20.0, 0.5), height_m=1.0)
    pose = track.at(1.25)
    np.testing.assert_allclose(pose.position, [15.0, 26.0, 1.5])
    np.testing.assert_allclose(pose.velocity, [4.0, 0.0, 0.0])


def test_heights_are_scaled_like_the_rest(write):
    track = read_track_csv(write("z_m,y_m,x_m,time_s\n1,2,3,4\n2,2,3,5\n"), scale=0.5, height_m=9.0)
    np.testing.assert_allclose(track.at(4.5).position, [1.5, 1.0, 0.75])


@pytest.mark.parametrize("content", ["\ufeff" + GOOD, GOOD.replace("\n", "\r\n")])
def test_files_of_other_systems(write, content):
    np.testing.assert_allclose(read_track_csv(write(content)).at(1.25).position, [2.5, 3.0, 0.0])


@pytest.mark.parametrize(
    ("content", "place", "message"),
    [
        ("", None, "must hold a header and at least one row, got an empty file"),
        ("# nothing\n\n", None, "must hold a header and at least one row"),
        ("time_s,x_m,y_m\n", "1:1", "at least one row below the header"),
        ("time_s,x_m\n1,2\n", "1:1", "must name 'y_m' once, got time_s, x_m"),
        ("time_s,x_m,x_m,y_m\n1,2,3,4\n", "1:1", "must name 'x_m' once"),
        ("time_s,x_m,y_m,z_m,z_m\n1,2,3,4,5\n", "1:1", "must name 'z_m' once"),
        ("1,2,3\n4,5,6\n", "1:1", "must name 'time_s' once"),
        ("time_s,x_m,y_m\n1,two,3\n", "2:3", "x_m: must be a finite number, got 'two'"),
        ("time_s,x_m,y_m\n1,2, nan\n", "2:6", "y_m: must be a finite number, got 'nan'"),
        ("time_s,x_m,y_m\n1,2,inf\n", "2:5", "y_m: must be a finite number, got 'inf'"),
        ("time_s,x_m,y_m\n1,2\n", "2:4", "y_m: must be a finite number, got ''"),
        (
            "# c\ntime_s,x_m,y_m\n1,2,3\n1,2,3\n",
            "4:1",
            "time_s: must increase from row to row, got 1 after 1",
        ),
        ("time_s,x_m,y_m\n1,2,3\n0.5,2,3\n", "3:1", "time_s: must increase"),
    ],
)
def test_faults_name_file_line_and_column(write, content, place, message):
    path = write(content)
    with pytest.raises(ScenarioError) as caught:
        read_track_csv(path)
    text = str(caught.value)
    assert text.startswith(f"{path}:" if place is None else f"{path}:{place}: ")
    assert message in text


def test_all_faults_at_once_but_not_thousands(write):
    with pytest.raises(ScenarioError) as caught:
        read_track_csv(write("time_s,x_m,y_m\n1,a,b\n" + "2,c,3\n" * 40))
    lines = str(caught.value).splitlines()
    assert "2:3" in lines[0]
    assert "2:5" in lines[1]
    # 2 + 40 fields and 39 times that do not increase.
    assert lines[-1].endswith("71 more problems like these")


@pytest.mark.parametrize("content", [b"\xff\xfe\x00t", b"time_s\x00,\xe9"])
def test_binary_files_are_refused(write, content):
    with pytest.raises(ScenarioError, match="must be a readable text file"):
        read_track_csv(write(content))


def test_missing_files_and_folders_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match=r"gone\.csv: must be a file that exists"):
        read_track_csv(tmp_path / "gone.csv")
    with pytest.raises(ScenarioError, match="must be a readable text file"):
        read_track_csv(tmp_path)


TURNING = """time_s,x_m,y_m,qw,qx,qy,qz
0,0,0,2,0,0,0
2,4,0,1,0,0,1
"""


def test_orientations_of_their_own(write):
    track = read_track_csv(write(TURNING))
    # from none to a quarter turn about z, at a constant rate
    for time, angle in ((0.0, 0.0), (1.0, np.pi / 4), (2.0, np.pi / 2), (3.0, np.pi / 2)):
        expected = quaternion_from_axis_angle((0, 0, 1), angle)
        np.testing.assert_allclose(track.at(time).orientation, expected, atol=1e-12)


def test_the_files_orientations_turn_the_given_one(write):
    lying = quaternion_from_axis_angle((0, 1, 0), np.pi / 2)
    np.testing.assert_array_equal(read_track_csv(write(GOOD), orientation=lying).at(1.2).orientation, lying)
    track = read_track_csv(write(TURNING), orientation=lying)
    # what pointed up in the body points along x first, and then along y
    for time, axis in ((0.0, [1, 0, 0]), (2.0, [0, 1, 0])):
        turn = quaternion_to_matrix(track.at(time).orientation)
        np.testing.assert_allclose(turn[:, 2], axis, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (",qz", "", "the header must name 'qz' once"),
        ("1,0,0,1", "0,0,0,0", ":3:7: qw: must be a quaternion other than zero, got all zeros"),
        ("1,0,0,1", "1,0,?,1", ":3:11: qy: must be a finite number, got '?'"),
    ],
)
def test_faults_of_orientations(write, old, new, message):
    with pytest.raises(ScenarioError) as caught:
        read_track_csv(write(TURNING.replace(old, new)))
    assert message in str(caught.value)
