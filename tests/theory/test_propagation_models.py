"""Path-loss models against the physics that they simplify, and sparse links against all pairs."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import shortest_path
from scipy.stats import chi2, kstest

from wsnsim.net.channel import pair_draws
from wsnsim.net.channel.free_space import SPEED_OF_LIGHT_MPS, FreeSpace, TwoRayGround
from wsnsim.net.channel.links import MARGIN_DB, SMALL_NODES, Links, LinksError, floor_of, links_between
from wsnsim.net.channel.obstacles import Obstructed
from wsnsim.net.channel.offsets import Offset, node_offsets
from wsnsim.net.channel.propagation import LogDistance, every_pair
from wsnsim.net.channel.shadowing import Shadowed
from wsnsim.net.config import RadioConfig, RouteConfig
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.routing.search import radio_links, tree_over
from wsnsim.rng import RandomStreams

ONE, OTHER = np.array([0]), np.array([1])
ALPHA = 1e-3
NODES = [f"n{i}" for i in range(400)]
DENSITY = 200 / 361.8**2
"""Of the reference layouts [1/m²]."""


def loss(model, *places):
    return float(model.loss_db(np.array(places, dtype=np.float64), ONE, OTHER)[0])


def field(number, seed, height_m=1.0):
    """Return `number` nodes on a square, as dense as the reference layouts."""
    rng = np.random.default_rng(seed)
    side = math.sqrt(number / DENSITY)
    return np.column_stack((rng.uniform(0.0, side, (number, 2)), np.full(number, height_m)))


@pytest.mark.parametrize("distance_m", [1.0, 7.0, 120.0, 5e4])
@pytest.mark.parametrize("frequency_hz", [868e6, 2.4e9])
def test_free_space_spreads_over_a_sphere(distance_m, frequency_hz):
    wavelength = SPEED_OF_LIGHT_MPS / frequency_hz
    # an isotropic antenna takes lambda² / 4 pi of the sphere's 4 pi d²
    share = (wavelength**2 / (4 * math.pi)) / (4 * math.pi * distance_m**2)
    model = FreeSpace(frequency_hz)
    assert loss(model, (0, 0, 0), (distance_m, 0, 0)) == pytest.approx(-10 * math.log10(share), abs=1e-9)


def test_the_usual_reference_loss_is_that_of_free_space():
    assert loss(FreeSpace(2.4e9), (0, 0, 0), (0, 1, 0)) == pytest.approx(
        LogDistance().reference_loss_db, abs=0.01
    )


@pytest.mark.parametrize(("h", "g"), [(1.5, 1.5), (2.0, 6.0)])
def test_two_rays_interfere_far_away_and_free_space_holds_near_by(h, g):
    model = TwoRayGround(FreeSpace(2.4e9))
    wavelength = SPEED_OF_LIGHT_MPS / 2.4e9
    crossover = 4 * math.pi * h * g / wavelength
    for factor in (0.1, 0.5, 0.999):
        places = (0, 0, h), (math.sqrt((factor * crossover) ** 2 - (h - g) ** 2), 0, g)
        assert loss(model, *places) == pytest.approx(loss(model.near, *places))
    # both models meet where one follows the other
    meeting = [
        loss(model, (0, 0, h), (math.sqrt((f * crossover) ** 2 - (h - g) ** 2), 0, g))
        for f in (1 - 1e-9, 1 + 1e-9)
    ]
    assert meeting[0] == pytest.approx(meeting[1], abs=1e-6)
    for factor in (10.0, 40.0):
        flat = factor * crossover
        direct, reflected = math.hypot(flat, h - g), math.hypot(flat, h + g)
        wave = 2 * math.pi / wavelength
        exact = abs(np.exp(-1j * wave * direct) / direct - np.exp(-1j * wave * reflected) / reflected)
        exact_db = -20 * math.log10(exact * wavelength / (4 * math.pi))
        # sin(x) for x, with x = 2 pi h g / (wavelength d) = 1 / (2 factor): off by x²/6
        tolerance = 20 / math.log(10) * (1 / (2 * factor)) ** 2 / 6 + 1e-3
        assert loss(model, (0, 0, h), (flat, 0, g)) == pytest.approx(exact_db, abs=tolerance)


def test_two_rays_need_nodes_above_the_ground():
    with pytest.raises(ValueError, match=r"above the ground at 0 for two rays, got 0 \[m\]"):
        loss(TwoRayGround(), (0, 0, 0), (10, 0, 1))


MODELS = [LogDistance(), LogDistance(2.4, 55.0, 2.0), FreeSpace(), TwoRayGround()]


@pytest.mark.parametrize("model", MODELS)
def test_a_model_reaches_as_far_as_its_loss_says(model):
    for height_m in (0.5, 3.0):
        for loss_db in (60.0, 95.0, 117.0):
            reach = model.reach_m(np.array([[0.0, 0.0, height_m]]), loss_db)
            here = (0.0, 0.0, height_m)
            assert loss(model, here, (reach * (1 + 1e-9), 0, height_m)) >= loss_db
            assert loss(model, here, (reach * (1 - 1e-9), 0, height_m)) <= loss_db + 1e-6


@pytest.mark.parametrize("model", MODELS)
def test_nodes_at_one_place_are_as_far_as_the_reference_distance(model):
    place = (3.0, 4.0, 2.0)
    reference_m = (
        model.near.reference_distance_m if isinstance(model, TwoRayGround) else model.reference_distance_m
    )
    assert loss(model, place, place) == loss(model, place, (3.0 + reference_m, 4.0, 2.0))
    links = links_between(np.array([place, place]), model, 0.0)
    assert links.arriving_dbm(0, 1) == -loss(model, place, place)


@pytest.mark.parametrize("name", ["exponent", "reference_distance_m"])
def test_what_must_be_positive_is(name):
    with pytest.raises(ValueError, match=f"{name}: must be positive, got -1"):
        LogDistance(**{name: -1.0})
    with pytest.raises(ValueError, match="frequency_hz: must be positive"):
        FreeSpace(0.0)


@pytest.mark.parametrize(("tx", "rx", "correlation"), [(2.45, 1.92, 0.7), (1.1, 0.0, 0.0), (1.0, 1.0, -1.0)])
def test_offsets_have_their_moments_and_weigh_on_all_links_of_a_node(tx, rx, correlation, test_seed):
    nodes = [f"m{i}" for i in range(3000)]
    tx_db, rx_db = node_offsets(nodes, tx, rx, correlation, RandomStreams(test_seed))
    for part, sd in ((tx_db, tx), (rx_db, rx)):
        if sd > 0.0:
            assert kstest(part / sd, "norm").pvalue > ALPHA
            squares = float((part**2).sum()) / sd**2
            assert chi2.ppf(ALPHA / 2, len(nodes)) < squares < chi2.ppf(1 - ALPHA / 2, len(nodes))
        else:
            assert not part.any()
    if rx > 0.0:
        # Fisher's transform of a correlation of 3000 has a standard error of 1 / sqrt(2997)
        found = float(np.corrcoef(tx_db, rx_db)[0, 1])
        limit = 1.0 - 1e-12
        gap = math.atanh(np.clip(found, -limit, limit)) - math.atanh(np.clip(correlation, -limit, limit))
        assert abs(gap) < 3.3 / math.sqrt(2997) or abs(correlation) == 1.0
        assert abs(correlation) < 1.0 or found == pytest.approx(correlation)
    places = np.zeros((3, 3)) + [[0.0], [5.0], [20.0]]
    model = Offset(LogDistance(), tx_db[:3], rx_db[:3])
    pairs = every_pair(3)
    gain_db = LogDistance().loss_db(places, *pairs) - model.loss_db(places, *pairs)
    assert gain_db == pytest.approx(tx_db[pairs[0]] + rx_db[pairs[1]])
    with pytest.raises(ValueError, match="must be those of 3 nodes, got 2"):
        model.loss_db(places[:2], ONE, OTHER)


def test_offsets_of_a_node_hang_on_its_name_and_the_seed_alone():
    whole = node_offsets(NODES, 2.0, 1.0, 0.5, RandomStreams(3))
    few = node_offsets([NODES[i] for i in (7, 2)], 2.0, 1.0, 0.5, RandomStreams(3))
    assert [part[[7, 2]].tolist() for part in whole] == [part.tolist() for part in few]
    assert node_offsets(NODES, 2.0, 1.0, 0.5, RandomStreams(4))[0][0] != whole[0][0]


def test_walls_add_up_on_the_way():
    model = Obstructed(LogDistance(), lambda begins, ends: 3.0 * np.abs(begins[:, 0] - ends[:, 0]))
    places = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    pairs = every_pair(3)
    added = model.loss_db(places, *pairs) - LogDistance().loss_db(places, *pairs)
    assert added == pytest.approx(np.array([6.0, 15.0, 6.0, 9.0, 15.0, 9.0]))
    assert model.reach_m(places, 80.0) == LogDistance().reach_m(places, 80.0)


def test_the_streams_of_many_pairs_are_those_of_each(test_seed, monkeypatch):
    """The kernel reads the same numbers as a generator for each pair; some pairs it leaves to that."""
    streams = RandomStreams(test_seed + 2**40)
    pairs = every_pair(120)
    fast = pair_draws.pair_normals("net.shadowing", NODES, *pairs, streams)
    monkeypatch.setattr(pair_draws, "_FEW", 10**9)
    slow = pair_draws.pair_normals("net.shadowing", NODES, *pairs, streams)
    assert np.array_equal(fast, slow)
    first = streams.stream("net.shadowing", "n0", "n1").standard_normal(2)
    assert (fast[0][0], fast[1][0]) == tuple(first)


@pytest.mark.parametrize("shadowed", [False, True])
def test_sparse_links_are_those_of_all_pairs_above_the_floor(shadowed, test_seed):
    places = field(len(NODES), test_seed)
    model = LogDistance()
    if shadowed:
        model = Shadowed(model, NODES, 4.0, 1.0, RandomStreams(test_seed))
    pairs = every_pair(len(NODES))
    power = np.full((len(NODES), len(NODES)), -np.inf)
    power[pairs] = -model.loss_db(places, *pairs)
    whole = Links.from_matrix(power, -95.0)
    sparse = links_between(places, model, 0.0, -95.0)
    found = sparse.matrix(sparse.power_dbm, -np.inf)
    if not shadowed:
        assert np.array_equal(sparse.starts, whole.starts)
        assert np.array_equal(sparse.receivers, whole.receivers)
    # beyond its reach shadowing brings one in 700 above the floor: Poisson, and no more than that allows
    missed = len(whole.receivers) - len(sparse.receivers)
    expected = len(whole.receivers) / 700
    assert 0 <= missed <= (expected + 4.0 * math.sqrt(expected) + 1.0 if shadowed else 0)
    assert np.array_equal(found[sparse.senders, sparse.receivers], power[sparse.senders, sparse.receivers])
    assert np.array_equal(sparse.power_dbm > -95.0, np.ones(len(sparse.power_dbm), dtype=bool))


def test_links_know_their_way_back_and_their_weaker_direction():
    power = np.array([[0.0, -50.0, -60.0], [-70.0, 0.0, -np.inf], [-40.0, -80.0, 0.0]])
    links = Links.from_matrix(power)
    ends = list(zip(links.senders.tolist(), links.receivers.tolist(), strict=True))
    for at, (i, j) in enumerate(ends):
        back = ends.index((j, i)) if (j, i) in ends else -1
        assert links.reverse[at] == back
        assert links.strength_dbm[at] == min(power[i, j], power[j, i])
    above = links.above(-60.0)
    assert list(zip(above.senders.tolist(), above.receivers.tolist(), strict=True)) == [
        (0, 1),
        (0, 2),
        (2, 0),
    ]


def test_small_networks_keep_all_links_and_large_ones_those_near_the_noise():
    assert floor_of(SMALL_NODES, -95.4) == -math.inf
    assert floor_of(SMALL_NODES + 1, -95.4) == -95.4 - MARGIN_DB
    places = {f"n{i}": tuple(place) for i, place in enumerate(field(60, 0) * [40.0, 40.0, 1.0])}
    assert len(radio_links(places, LogDistance(), RadioConfig()).receivers) == 60 * 59


def test_a_large_network_has_links_and_a_tree_in_proportion(test_seed):
    """A node hears as many others in 4,000 as the density says, and the tree is the one of fewest hops."""
    number = 4000
    places = field(number, test_seed)
    places[0, :2] = places[:, :2].mean(axis=0)
    positions = {f"n{i}": tuple(place) for i, place in enumerate(places)}
    radio = RadioConfig()
    links = radio_links(positions, LogDistance(), radio)
    reach = 10 ** ((-(radio.noise_dbm - MARGIN_DB) - 40.05) / 30.0)
    middle = np.abs(places[:, :2] - places[0, :2]).max(axis=1) < np.ptp(places[:, 0]) / 2 - reach
    degrees = np.diff(links.starts)[middle]
    mean = DENSITY * math.pi * reach**2
    # the density in the middle of a field is itself a count of the nodes there
    assert degrees.mean() == pytest.approx(mean, rel=4.0 / math.sqrt(len(degrees)))
    tree = tree_over(links, positions, "n0", CsmaCaFamily(), radio, RouteConfig(), "good")
    usable = links.strength_dbm >= radio.sensitivity_dbm
    graph = csr_array((usable.astype(float), links.receivers, links.starts), shape=(number, number))
    graph.eliminate_zeros()
    hops = shortest_path(graph, indices=0, unweighted=True)
    assert [tree.depth[f"n{i}"] for i in range(number)] == hops.astype(int).tolist()


def test_more_links_than_memory_holds_are_refused(monkeypatch):
    monkeypatch.setattr("wsnsim.net.channel.links._MOST_LINKS", 10_000)
    with pytest.raises(
        LinksError, match=r"at most 10000 may arrive above -105\.4 dBm, got more between 320 nodes"
    ):
        links_between(field(320, 0), FreeSpace(), 0.0, -105.4)


def test_the_reference_layout_has_as_many_neighbours_as_it_says(shared):
    layout = json.loads(Path(shared / "reference/radio/rgg_n200.json").read_text())
    places = np.column_stack((np.array(layout["xy"]), np.zeros(layout["n"])))
    floor_dbm = -40.05 - 30.0 * math.log10(layout["link_range_m"]) - 1e-9
    links = links_between(places, LogDistance(), 0.0, floor_dbm)
    assert len(links.receivers) / layout["n"] == pytest.approx(layout["mean_degree"], abs=0.01)
