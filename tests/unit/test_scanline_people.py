"""Where the people are: a crowd is looked up at once, others one by one, with the same places."""

from pathlib import Path

import numpy as np

from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.systems.scanline.sensor import people_places

ROOM = Path(__file__).parents[2] / "scenarios" / "published" / "scanline_room.yaml"


def one_by_one(world, time):
    return np.array([person.motion.at(time).position[:2] for person in world.people]).reshape(-1, 2)


def test_a_crowd_is_where_each_of_it_is() -> None:
    world = build(load_scenario(ROOM, overrides=["duration_s=4"])).world
    places = people_places(world)
    for time in (0.0, 0.1, 1 / 7.5, 2.0, 4.0, 100.0):
        np.testing.assert_array_equal(places(time), one_by_one(world, time))


def test_so_are_people_of_different_motions() -> None:
    walk = "{kind: waypoints, points_m: [[1, 1, 0.9], [3, 1, 0.9]], speed_mps: 1.0}"
    overrides = ["duration_s=4", "world.people[walker].count=1", f"world.people[walker].motion={walk}"]
    world = build(load_scenario(ROOM, overrides=overrides)).world
    np.testing.assert_array_equal(people_places(world)(1.5), one_by_one(world, 1.5))
    alone = build(load_scenario(ROOM, overrides=["duration_s=4", "world.people=[]"])).world
    assert people_places(alone)(1.0).shape == (0, 2)
