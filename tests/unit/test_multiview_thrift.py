"""Answers that fit a bandwidth budget: coarser numbers first, then fewer components, then silence."""

import numpy as np
import pytest

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.hardware.work import Work
from wsnsim.messages.batch import batched
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.numbers import ENCODINGS
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.multiview.thrift import fitted

WEIGHTS = WeightsPayload(0, 7, np.linspace(0.001, 1.0, 200))


def mixture(order=4, target=0, encoding="float64"):
    rng = np.random.default_rng(order)
    density = GaussianMixture(
        np.log(np.full(order, 1 / order)),
        rng.normal(size=(order, 3)),
        np.tile(0.1 * np.eye(3), (order, 1, 1)),
    )
    return MixturePayload(target, 7, density, (2,), 0.8, (np.empty(0),), encoding)


def size(payloads):
    return len(batched(list(payloads)).encode())


def test_without_a_budget_everything_stays_as_it_is():
    assert fitted([WEIGHTS], np.inf) == ([WEIGHTS], Work())
    assert fitted([WEIGHTS], size([WEIGHTS])) == ([WEIGHTS], Work())


@pytest.mark.parametrize(("room", "encoding"), [(1600, "float32"), (800, "float16"), (400, "uint8")])
def test_weights_take_the_finest_encoding_that_fits(room, encoding):
    (said,), work = fitted([WEIGHTS], room)
    assert said.encoding == encoding
    assert size([said]) <= room
    finer = ENCODINGS[ENCODINGS.index(encoding) - 1]
    assert len(WeightsPayload(0, 7, WEIGHTS.weights, encoding=finer).encode()) > room
    np.testing.assert_allclose(
        WeightsPayload.decode(said.encode()).relative(), WEIGHTS.relative(), atol=1 / 255
    )
    assert work == Work()


def test_there_are_never_fewer_weights():
    assert fitted([WEIGHTS], 200) == ([], Work())


def test_numbers_that_an_encoding_cannot_hold_go_on_to_the_next():
    faint = WeightsPayload(0, 7, 1e-60 * WEIGHTS.weights)
    (said,), _ = fitted([faint], 1600)
    # float32 and float16 know no numbers so small; 8 bits are relative to the largest
    assert said.encoding == "uint8"


def test_mixtures_lose_components_when_no_encoding_is_enough():
    whole = mixture(4)
    (coarse,), work = fitted([whole], 70)
    assert (coarse.encoding, coarse.mixture.order, work) == ("uint8", 4, Work())
    (fewer,), work = fitted([whole], 50)
    assert (fewer.encoding, fewer.mixture.order) == ("uint8", 2)
    assert size([fewer]) <= 50
    assert work.float_ops > 0
    # what the mixture says as a whole is kept: mass, mean and covariance
    for kept, given in zip(fewer.mixture.mean_and_cov(), whole.mixture.mean_and_cov(), strict=True):
        np.testing.assert_allclose(kept, given, atol=1e-9)
    assert fitted([whole], 20)[0] == []


def test_several_targets_share_one_message():
    both = [mixture(3, target=0), mixture(5, target=1)]
    said, _ = fitted(both, 90)
    assert size(said) <= 90
    assert [payload.target for payload in said] == [0, 1]
    # as many components of both as fit: those that have fewer keep them
    assert [payload.mixture.order for payload in said] == [2, 2]


def test_what_is_coarse_already_is_not_made_finer():
    said, _ = fitted([mixture(2, encoding="uint8"), WEIGHTS], 1400)
    assert [payload.encoding for payload in said] == ["uint8", "float32"]


def test_rays_end_at_eight_bits():
    ray = RayPayload(0, 7, np.array([10.0, 20.0]), np.array([1.0, 0.0, 1.0]), 0.9)
    (said,), _ = fitted([ray], 16)
    assert said.encoding == "uint8"
    assert fitted([ray], 14)[0] == []
