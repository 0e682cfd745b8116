"""Recorded tracks as a scenario names them: which format, which track, when."""

# ruff: noqa: E501  (an error is one line, here as on the screen)

import sys
from types import ModuleType

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import load_scenario
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash
from wsnsim.sim.worlds import build_world
from wsnsim.systems.base import System, SystemParams

SCENARIO = """\
duration_s: 10
world:
  size_m: [20, 20, 4]
  targets:
    - id: walker
      shape: {kind: ellipsoid, semi_axes_m: [0.3, 0.3, 0.85]}
      motion: {kind: recorded, file: tracks.csv, height_m: 0.9}
cameras: [{id: c1, position_m: [0, 0, 3], look_at_m: [16, 9, 1]}]
motes: {base: {position_m: [16, 0, 2]}}
system: {kind: "fake_tracker:SYSTEM"}
"""
MOTION = "world.targets[walker].motion"
CSV = "time_s,x_m,y_m\n2,1,1\n6,9,1\n"
OBSMAT = "".join(
    f"{frame} {track} {x} 0 {2 * x}\n" for track, frame, x in [(3, 50, 1), (5, 50, 2), (3, 150, 5)]
)
MOT = "1,3,100,50,20,60,1,-1,-1,-1\n26,3,200,50,20,60,1,-1,-1,-1\n1,4,0,0,1,1,1,2.5,3.5,0.1\n"


@pytest.fixture(autouse=True)
def tracker(monkeypatch):
    module = ModuleType("fake_tracker")
    module.SYSTEM = System("fake", "nobody", SystemParams, (), lambda params, site, node, role: None)
    monkeypatch.setitem(sys.modules, "fake_tracker", module)


@pytest.fixture
def load(tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    (tmp_path / "tracks.csv").write_text(CSV)
    (tmp_path / "obsmat.txt").write_text(OBSMAT)
    (tmp_path / "gt.txt").write_text(MOT)
    (tmp_path / "words.txt").write_text("some words\n")
    (tmp_path / "walk.dat").write_text(CSV)
    (tmp_path / "H.txt").write_text("0.1 0 -10\n0 0.1 -5\n0 0 1\n")

    def make(**keys):
        overrides = [f"{MOTION}.{key}={value}" for key, value in keys.items()]
        return load_scenario(tmp_path / "s.yaml", overrides)

    return make


def walker(loaded):
    return build_world(loaded, RandomStreams(0)).targets[0].motion


def test_a_csv_track(load):
    pose = walker(load()).at(4.0)
    np.testing.assert_allclose(pose.position, [5.0, 1.0, 0.9])
    np.testing.assert_allclose(walker(load(start_s=3)).at(1.0).position, pose.position)
    np.testing.assert_allclose(walker(load(start_s="null")).at(2.0).position, pose.position)
    np.testing.assert_allclose(walker(load(file="walk.dat")).at(4.0).position, pose.position)


def test_an_obsmat_track(load):
    # frames 50 to 150 at 25 Hz: from 2 s to 6 s
    motion = walker(load(file="obsmat.txt", frame_rate_hz=25, track_id=3, scale=1.5, offset_m="[1, 0, 0.1]"))
    np.testing.assert_allclose(motion.at(1.0).position, [2.5, 3.0, 1.0])
    np.testing.assert_allclose(motion.at(4.0).position, [5.5, 9.0, 1.0])
    np.testing.assert_allclose(motion.at(4.0).velocity, [1.5, 3.0, 0.0])


def test_motchallenge_tracks(load):
    motion = walker(load(file="gt.txt", frame_rate_hz=25, track_id=3, homography="H.txt", start_s="null"))
    # feet from (110, 110) to (210, 110) in a second
    np.testing.assert_allclose(motion.at(0.5).position, [6.0, 6.0, 0.9])
    np.testing.assert_allclose(motion.at(0.5).velocity, [10.0, 0.0, 0.0])
    placed = walker(load(file="gt.txt", frame_rate_hz=25, track_id=4, height_m=0.8))
    np.testing.assert_allclose(placed.at(0.0).position, [2.5, 3.5, 0.9])


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"file": "words.txt"},
            'motion.format: must be given: "csv", "obsmat" or "motchallenge"; neither name nor header of '
            '"words.txt" tells',
        ),
        ({"format": "obsmt"}, 'got "obsmt"; did you mean "obsmat"?'),
        ({"track_id": 3}, "motion.track_id: must be left out: the format csv has no use for it"),
        (
            {"file": "obsmat.txt", "homography": "H.txt"},
            "motion.homography: must be left out: the format obsmat has no use for it",
        ),
        (
            {"file": "obsmat.txt", "track_id": 3},
            'motion.frame_rate_hz: must be given: the images a second of "obsmat.txt", which numbers its images',
        ),
        (
            {"file": "obsmat.txt", "frame_rate_hz": 25},
            'motion.track_id: must be one of the 2 tracks of "obsmat.txt" (3, 5), got nothing (null)',
        ),
        (
            {"file": "obsmat.txt", "frame_rate_hz": 25, "track_id": 4},
            'motion.track_id: must be one of the 2 tracks of "obsmat.txt" (3, 5), got 4',
        ),
        (
            {"file": "gt.txt", "frame_rate_hz": 25, "track_id": 3},
            'motion.homography: must be given: line 1 of "gt.txt" has no place (x, y, z are -1 or missing); '
            "name a file with the 3 × 3 matrix that takes its image (u, v, 1) to the floor (x, y, 1)",
        ),
        ({"homography": "G.txt"}, 'must be a file that exists, got "HERE/G.txt"'),
        ({"start_s": 6}, "motion.start_s: must be before the end of the track at 6 s, got 6 s"),
        (
            {"file": "obsmat.txt", "frame_rate_hz": 1, "track_id": 3},
            "motion.start_s: must be later, or null: the track runs from 50 to 150 s, and the run ends at 10 s of it, "
            "got 0 s",
        ),
        ({"format": "obsmat", "frame_rate_hz": 1}, "HERE/tracks.csv:1:1: frame: must be a finite number"),
        ({"file": "words.txt", "format": "csv"}, "HERE/words.txt:1:1: the header must name 'time_s' once"),
        ({"offset_m": "[15, 0, 0]"}, "but is at [20.5, 1, 0.9] m after 4.25 s"),
    ],
)
def test_what_a_person_reads(load, tmp_path, keys, message):
    with pytest.raises(ScenarioError) as caught:
        walker(load(**keys))
    assert message in str(caught.value).replace(str(tmp_path), "HERE")


def test_near_ids_are_named(load, tmp_path):
    (tmp_path / "obsmat.txt").write_text("".join(f"1 {t} 0 0 0\n" for t in range(1, 41) if t != 18))
    loaded = load(file="obsmat.txt", frame_rate_hz=25, track_id=18)
    with pytest.raises(ScenarioError, match=r"\(15, 16, 17, 19, 20, 21, \.\.\.\), got 18"):
        walker(loaded)


def test_a_resolved_track_is_the_same_track(load, tmp_path):
    loaded = load(file="gt.txt", frame_rate_hz=25, track_id=3, homography="H.txt", start_s="null")
    (tmp_path / "elsewhere").mkdir()
    copy = tmp_path / "elsewhere" / "scenario.yaml"
    copy.write_text(resolved_yaml(loaded))
    again = load_scenario(copy)
    assert again.scenario == loaded.scenario
    np.testing.assert_array_equal(walker(again).points, walker(loaded).points)
    before = scenario_hash(loaded)
    (tmp_path / "H.txt").write_text("0.1 0 -10\n0 0.1 -4\n0 0 1\n")
    assert scenario_hash(loaded) != before


def test_pedestrians_of_zara(load, shared):
    file = shared / "data" / "ucy" / "zara01" / "obsmat.txt"
    rows = np.loadtxt(file)
    for pedestrian in (9, 34, 77):
        own = rows[rows[:, 1] == pedestrian]
        motion = walker(
            load(
                file=file,
                frame_rate_hz=25,
                track_id=pedestrian,
                start_s=own[0, 0] / 25,
                offset_m="[5, -3, 0]",
            )
        )
        for time in np.linspace(0.0, 9.9, 12):
            x, y = (np.interp(time, (own[:, 0] - own[0, 0]) / 25, own[:, column]) for column in (2, 4))
            np.testing.assert_allclose(motion.at(time).position, [x + 5.0, y - 3.0, 0.9])
