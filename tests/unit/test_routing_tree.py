import math
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.net.channel.links import Links, links_between
from wsnsim.net.channel.propagation import LogDistance, distances
from wsnsim.net.routing.search import min_hop_tree
from wsnsim.net.routing.tree import RoutingError, tree_from_parents

tree_to = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["tree_to"]
CHAIN = {"a": "base", "base": None, "b": "a", "c": "b", "d": "base"}
RANGE_M = 10.0 ** ((0.0 + 95.0 - 40.05) / 30.0)
"""Where 0 dBm has become -95 dBm at 40.05 + 30 log10(d)."""


def test_a_tree_by_hand():
    tree = tree_from_parents(CHAIN)
    assert tree.root == "base"
    assert tree.depth == {"a": 1, "base": 0, "b": 2, "c": 3, "d": 1}
    assert tree.children["base"] == ("a", "d")
    assert tree.height == 3
    assert tree.descendants("base") == ("a", "d", "b", "c")
    assert tree.path("c", "base") == ("c", "b", "a", "base")
    assert tree.path("base", "b") == ("base", "a", "b")
    assert tree.path("c", "d") == ("c", "b", "a", "base", "d")
    assert tree.path("a", "a") == ("a",)


@pytest.mark.parametrize(
    ("parents", "words"),
    [
        ({}, "exactly one node"),
        ({"a": "b", "b": "a"}, "exactly one node"),
        ({"a": None, "b": None}, "exactly one node"),
        ({"a": None, "b": "c"}, "parent of 'b' must be a node, got 'c'"),
        ({"a": None, "b": "c", "c": "b"}, "circle of ['b', 'c']"),
    ],
)
def test_bad_trees(parents, words):
    with pytest.raises(RoutingError, match=re.escape(words)):
        tree_from_parents(parents)


def test_fewest_hops_then_the_stronger_link_then_the_first():
    places = {
        "base": (0, 0, 0),
        "near": (50, 0, 0),
        "left": (40, 40, 0),
        "right": (40, -40, 0),
        "closer": (100, 10, 0),
        "between": (90, 0, 0),
    }
    tree = tree_to("base", places)
    assert tree.depth == {"base": 0, "near": 1, "left": 1, "right": 1, "closer": 2, "between": 2}
    assert tree.parent["closer"] == "near"
    twins = {"base": (0, 0, 0), "one": (30, 30, 0), "two": (30, -30, 0), "far": (75, 0, 0)}
    assert tree_to("base", twins).parent["far"] == "one"
    swapped = {name: twins[name] for name in ("base", "two", "one", "far")}
    assert tree_to("base", swapped).parent["far"] == "two"


def test_links_are_good_up_to_the_sensitivity():
    for distance, works in ((RANGE_M - 0.01, True), (RANGE_M + 0.01, False)):
        places = {"base": (0, 0, 0), "a": (distance, 0, 0)}
        if works:
            assert tree_to("base", places).depth["a"] == 1
        else:
            with pytest.raises(RoutingError):
                tree_to("base", places)


def test_noise_shortens_links_where_it_rules():
    places = {"base": (0, 0, 0), "a": (20, 0, 0), "b": (40, 0, 0)}
    assert tree_to("base", places, noise_dbm=-80.0).parent["b"] == "a"


def test_nodes_out_of_reach_are_named_with_their_nearest_node_and_the_range():
    places = {"base": (0, 0, 0), "a": (60, 0, 0), "lost": (160, 0, 0), "too": (165, 0, 0)}
    with pytest.raises(RoutingError) as raised:
        tree_to("base", places)
    words = str(raised.value)
    assert f"links of up to {RANGE_M:.1f} m" in words
    assert "node 'lost' cannot: the nearest node that does is 'a', 100.0 m away" in words
    assert "node 'too' cannot: the nearest node that does is 'a', 105.0 m away" in words
    assert "node 'a'" not in words


def test_a_link_must_work_both_ways():
    places = {"base": (0, 0, 0), "a": (1, 0, 0), "b": (2, 0, 0)}
    power = np.array([[0.0, -50.0, -50.0], [-50.0, 0.0, -60.0], [-99.0, -60.0, 0.0]])
    assert min_hop_tree(places, "base", Links.from_matrix(power), -90.0, "of a kind").parent["b"] == "a"


def test_the_base_must_be_a_node():
    with pytest.raises(RoutingError, match="base: must be one of the nodes"):
        tree_to("b", {"a": (0, 0, 0)})


def test_log_distance():
    model = LogDistance(exponent=2.0, reference_loss_db=40.0, reference_distance_m=2.0)
    places = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [20.0, 0.0, 0.0]])
    losses = model.loss_db(places, np.array([0, 0]), np.array([1, 2]))
    assert losses[0] == 40.0
    assert losses[1] == pytest.approx(60.0)
    assert distances(places)[1, 2] == pytest.approx(math.hypot(20, 1))
    links = links_between(places, model, 5.0)
    assert links.arriving_dbm(0, 2) == pytest.approx(-55.0)
    assert links.arriving_dbm(0, 0) == -math.inf
    assert model.reach_m(places, 60.0) == pytest.approx(20.0)
    for wrong in ({"exponent": 0.0}, {"reference_distance_m": -1.0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            LogDistance(**wrong)
