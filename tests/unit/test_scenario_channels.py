"""`network.propagation`, `network.noise` and `network.fading` as a scenario writes them."""

import math

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.net.channel.free_space import FreeSpace, TwoRayGround
from wsnsim.net.channel.propagation import LogDistance, mean_of
from wsnsim.records import FrameRow, MemorySink
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash
from wsnsim.sim.build import build
from wsnsim.sim.channels import run_channel, run_links
from wsnsim.sim.propagations import node_propagation

PLACES = {"a": (1.0, 2.0, 1.5), "b": (9.0, 2.0, 1.5), "base": (9.0, 8.0, 1.5)}
WALLS = [
    {"id": "brick", "kind": "wall", "from_m": [5, 0], "to_m": [5, 4], "attenuation_db": 11.0},
    {"id": "plaster", "kind": "wall", "from_m": [6, 0], "to_m": [6, 9]},
    {"id": "low", "kind": "box", "centre_m": [9, 5, 0.25], "size_m": [4, 1, 0.5]},
]
ROOM = {"size_m": [10, 10, 3], "occluders": WALLS}


def data(places=PLACES, world=None, **network):
    return {
        "duration_s": 2,
        "world": world,
        "motes": {
            "nodes": [{"id": name, "position_m": list(places[name])} for name in places if name != "base"],
            "base": {"position_m": list(places["base"])},
        },
        "network": network,
        "system": {"kind": "traffic", "payload_bytes": 20},
        "record": {"frames": True},
    }


def links(**network):
    loaded = scenario_from_dict(data(**network))
    return run_links(loaded.scenario, PLACES, RandomStreams(loaded.scenario.seed))


def problems(*, places=PLACES, **network):
    with pytest.raises(ScenarioError) as raised:
        build(scenario_from_dict(data(places, **network)))
    return [str(problem) for problem in raised.value.problems]


@pytest.mark.parametrize(
    ("section", "model"),
    [
        ({}, LogDistance()),
        ({"exponent": 2.5}, LogDistance(2.5)),
        ({"kind": "free_space", "frequency_hz": 868e6}, FreeSpace(868e6)),
        ({"kind": "two_ray"}, TwoRayGround()),
    ],
)
def test_each_kind_is_its_model(section, model, tmp_path):
    loaded = scenario_from_dict(data(propagation=section))
    assert mean_of(node_propagation(loaded.scenario, PLACES, RandomStreams(0))) == model
    file = tmp_path / "resolved.yaml"
    file.write_text(resolved_yaml(loaded))
    assert load_scenario(file).scenario.network == loaded.scenario.network


def test_each_wall_on_the_straight_line_adds_its_loss():
    free, walled = links(), links(world=ROOM, propagation={"walls": {"loss_db": 4.0}})
    assert links(world=ROOM).power_dbm.tolist() == free.power_dbm.tolist()
    lost = {
        pair: free.arriving_dbm(*pair) - walled.arriving_dbm(*pair)
        for pair in ((0, 1), (1, 0), (1, 2), (0, 2))
    }
    # from a to b through both walls; from b to the base over the box; from a to the base past the brick one
    assert lost == pytest.approx({(0, 1): 15.0, (1, 0): 15.0, (1, 2): 0.0, (0, 2): 4.0})


def test_walls_take_frames_with_them():
    thick = {**ROOM, "occluders": [{**WALLS[0], "to_m": [5, 10], "attenuation_db": 60.0}]}
    assert build(scenario_from_dict(data(world=thick))).tree.depth["a"] == 1
    (words,) = problems(world=thick, propagation={"walls": {}})
    assert "node 'a' cannot: the nearest node that does is 'b', 8.0 m away" in words


def test_hardware_and_shadowing_differ_by_seed_and_frames_arrive_with_what_they_make(tmp_path):
    section = {
        "shadowing_db": 3,
        "asymmetry_db": 1,
        "tx_offset_db": 2.45,
        "rx_offset_db": 1.9,
        "offset_correlation": 0.7,
    }
    loaded = scenario_from_dict(data(propagation=section))
    found = run_links(loaded.scenario, PLACES, RandomStreams(0))
    assert found.power_dbm.tolist() != run_links(loaded.scenario, PLACES, RandomStreams(1)).power_dbm.tolist()
    plain = links(propagation={"shadowing_db": 3, "asymmetry_db": 1})
    # the offsets have streams of their own, so that shadowing stays what it is without them, and each is
    # one node's: round any three nodes both ways they add up to the same
    offset = found.matrix(found.power_dbm - plain.power_dbm, 0.0)
    assert abs(offset).min(initial=9.0, where=~np.eye(3, dtype=bool)) > 0.0
    assert offset[0, 1] + offset[1, 2] + offset[2, 0] == pytest.approx(
        offset[1, 0] + offset[2, 1] + offset[0, 2]
    )
    simulation, sink = build(loaded), MemorySink()
    simulation.run(sink)
    at = {node: number for number, node in enumerate(simulation.positions)}
    frames = [row for row in sink.rows if isinstance(row, FrameRow)]
    assert len(frames) >= 4
    for row in frames:
        assert row.rssi_dbm == pytest.approx(found.arriving_dbm(at[row.sender], at[row.receiver]))


def test_fading_and_noise_reach_the_frames(tmp_path):
    trace = tmp_path / "noise.txt"
    trace.write_text("\n".join(map(str, np.random.default_rng(0).integers(-95, -80, 300))))
    outcomes = {}
    for name, network in {
        "plain": {},
        "fading": {"fading": {"kind": "rayleigh", "coherence_s": 0.05}, "tx_power_dbm": -25},
        "noise": {"noise": {"kind": "trace", "file": str(trace)}, "tx_power_dbm": -17},
    }.items():
        simulation, sink = build(scenario_from_dict(data(**network))), MemorySink()
        simulation.run(sink)
        outcomes[name] = [row.outcome for row in sink.rows if isinstance(row, FrameRow)]
    assert set(outcomes["plain"]) == {"received"}
    # noise that is above the signal now and then, or links that fade below the sensitivity, cost frames
    assert set(outcomes["noise"]) > {"received"}
    assert set(outcomes["fading"]) > {"received"}


def test_rician_fading_of_a_run_has_its_ratio():
    loaded = scenario_from_dict(data(fading={"kind": "rician", "k_db": 10.0, "coherence_s": 1.0}))
    fading = run_channel(loaded.scenario, PLACES, RandomStreams(0)).fading
    gains = np.concatenate([fading.gains(0, np.arange(1, 200), at * 2 * 10**9) for at in range(50)])
    # variance of a Rician gain, (1 + 2 K) / (1 + K)²; the standard error of a variance is under 3 % here
    assert gains.var() == pytest.approx(21 / 121, rel=0.1)


def test_motes_at_one_place_are_a_reference_distance_apart():
    places = {**PLACES, "b": PLACES["a"]}
    simulation, sink = build(scenario_from_dict(data(places))), MemorySink()
    simulation.run(sink)
    assert simulation.tree.depth == {"a": 1, "b": 1, "base": 0}
    found = run_links(scenario_from_dict(data(places)).scenario, places, RandomStreams(0))
    assert found.arriving_dbm(0, 1) == -40.05


@pytest.mark.parametrize(
    ("section", "words"),
    [
        (
            {"kind": "logdistance"},
            'network.propagation.kind: must be "log_distance", "free_space", "two_ray", "link_table" or',
        ),
        ({"exponent": -1}, "network.propagation.exponent: must be greater than 0, got -1"),
        ({"kind": "free_space", "exponent": 2}, "network.propagation.exponent: unknown key"),
        ({"walls": {"loss_db": -3}}, "network.propagation.walls.loss_db: must be at least 0, got -3"),
        ({"offset_correlation": 1.5}, "network.propagation.offset_correlation: must be at most 1, got 1.5"),
        ({"kind": "link_table"}, "network.propagation.file: must be given"),
        ({"kind": "link_table", "file": "no.txt"}, "network.propagation.file: must be a file that exists"),
        (
            {"kind": "recorded", "file": "no.k7", "channel": 27},
            "network.propagation.channel: must be at most 26, got 27",
        ),
    ],
)
def test_bad_sections_are_refused_at_their_keys(section, words):
    assert any(line.startswith(words) for line in problems(propagation=section))


def test_numbers_to_choose_from_stand_without_quotes():
    assert problems(mesh_header_bytes=3) == ["network.mesh_header_bytes: must be 0 or 5, got 3"]


def test_fading_must_be_of_a_kind():
    assert problems(fading={"kind": "nakagami"})[0].startswith(
        'network.fading.kind: must be "rayleigh" or "rician"'
    )
    assert problems(fading={"kind": "rician", "coherence_s": 0})[0].startswith(
        "network.fading.coherence_s: must be at least"
    )


def test_two_rays_need_motes_above_the_ground():
    places = {**PLACES, "a": (1.0, 2.0, 0.0)}
    (line,) = problems(places=places, propagation={"kind": "two_ray"})
    assert line == "network.propagation: z of a node: must be above the ground at 0 for two rays, got 0 [m]"


def test_too_weak_a_path_loss_for_a_large_network_is_told(monkeypatch):
    monkeypatch.setattr("wsnsim.net.channel.links._MOST_LINKS", 5)
    (line,) = problems(propagation={"kind": "free_space"})
    assert line.startswith("network.propagation: links: at most 5 may arrive above -inf dBm")


def test_an_isolated_mote_is_named_with_its_nearest_neighbour():
    (line,) = problems(
        places={**PLACES, "b": (2000.0, 0.0, 1.5)}, propagation={"kind": "free_space"}, tx_power_dbm=-20
    )
    assert "node 'b' cannot: the nearest node that does is 'base', 1991.0 m away" in line
    reach = 10.0 ** ((-20.0 + 95.0) / 20.0) * 299_792_458.0 / (4.0 * math.pi * 2.4e9)
    assert f"of up to {reach:.1f} m" in line


def test_files_of_the_network_are_named_where_a_resolved_scenario_stands(tmp_path):
    (tmp_path / "links.txt").write_text(
        "gain a base -60\ngain base a -60\ngain b base -60\ngain base b -60\n"
    )
    (tmp_path / "noise.txt").write_text("-98\n" * 30)
    network = {
        "propagation": {"kind": "link_table", "file": "links.txt"},
        "noise": {"kind": "trace", "file": "noise.txt"},
    }
    loaded = scenario_from_dict(data(**network), tmp_path)
    text = resolved_yaml(loaded, tmp_path)
    assert 'file: "./links.txt"' in text
    assert 'file: "./noise.txt"' in text
    before = scenario_hash(loaded)
    (tmp_path / "noise.txt").write_text("-97\n" * 30)
    assert scenario_hash(loaded) != before
