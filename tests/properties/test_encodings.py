"""Encodings: every number comes back within half a quantum, and damage never breaks a decoder."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.batch import BatchPayload, parts_of
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.numbers import ENCODINGS, Encoding, block_bytes, pack_block, quantum, unpack_block
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.multiview.system import SYSTEM

DTYPES = {"float64": np.float64, "float32": np.float32, "float16": np.float16}
ROUNDING = 1 + 1e-12

encodings = st.sampled_from(ENCODINGS)
targets, steps = st.integers(0, 255), st.integers(0, 2**32 - 1)


def numbers(size: int, largest: float) -> st.SearchStrategy[np.ndarray]:
    return arrays(np.float64, size, elements=st.floats(-largest, largest))


quaternions = numbers(4, 1.0).filter(lambda q: np.linalg.norm(q) > 1e-3).map(lambda q: q / np.linalg.norm(q))
states = st.builds(
    StatePayload,
    targets,
    steps,
    numbers(3, 3e4),
    numbers(3, 1e3),
    quaternions,
    st.one_of(st.just(np.empty(0)), numbers(6, 1e3)),
    encodings,
)
weights = st.builds(
    WeightsPayload,
    targets,
    steps,
    arrays(np.float64, st.integers(1, 60), elements=st.floats(0.0, 6e4)).filter(lambda w: w.max() > 1e-3),
    st.floats(0.0, 1.0),
    st.one_of(numbers(3, 1.0), quaternions, st.just(np.empty(0))),
    encodings,
)
sightings = st.builds(
    SightingPayload,
    targets,
    steps,
    numbers(2, 3e4),
    st.floats(1e-2, 6e4),
    st.floats(0.0, 1.0),
    encodings,
)
rays = st.builds(
    RayPayload,
    targets,
    steps,
    numbers(2, 4e3),
    st.builds(
        lambda widths, lean: np.array([widths[0], lean * widths[1], widths[1]]),
        arrays(np.float64, 2, elements=st.floats(0.1, 1e3)),
        st.floats(-100.0, 100.0),
    ),
    st.floats(0.0, 1.0),
    encodings,
)


@st.composite
def mixtures(draw: st.DrawFn) -> MixturePayload:
    """A mixture of one to three components, of one to three cameras; some say how the target stands."""
    order, dimension = draw(st.integers(1, 3)), draw(st.integers(2, 3))
    factors = np.tril(draw(arrays(np.float64, (order, dimension, dimension), elements=st.floats(-3.0, 3.0))))
    diagonal = np.arange(dimension)
    factors[:, diagonal, diagonal] = 0.05 + np.abs(factors[:, diagonal, diagonal])
    density = GaussianMixture(
        draw(numbers(order, 1e4)),
        draw(numbers(order * dimension, 8.0)).reshape(order, -1),
        factors @ factors.transpose(0, 2, 1),
    )
    cameras = tuple(sorted(draw(st.sets(st.integers(0, 255), min_size=1, max_size=3))))
    said = st.one_of(st.just(np.empty(0)), draw(st.sampled_from([numbers(3, 1.0), quaternions])))
    facings = tuple(draw(said) for _ in cameras)
    similarity = draw(st.floats(0.0, 1.0))
    return MixturePayload(draw(targets), draw(steps), density, cameras, similarity, facings, draw(encodings))


singles = st.one_of(states, weights, sightings, st.builds(SearchPayload, targets, steps), rays, mixtures())
batches = st.lists(singles, min_size=1, max_size=3).map(lambda parts: BatchPayload(tuple(parts)))
payloads = st.one_of(singles, batches)


def half_quantum(values: np.ndarray, encoding: Encoding) -> np.ndarray:
    """Return the largest error of each number of a block, by the definition of its encoding."""
    if encoding == "uint8":
        return np.full(values.shape, 0.5 * quantum(values))
    return 0.5 * np.spacing(np.abs(values).astype(DTYPES[encoding])).astype(np.float64)


def assert_within(back: np.ndarray, sent: np.ndarray, bound: np.ndarray | float) -> None:
    assert back.shape == sent.shape
    assert (np.abs(back - sent) <= np.asarray(bound) * ROUNDING).all(), (sent, back)


@given(arrays(np.float64, st.integers(1, 20), elements=st.floats(-6e4, 6e4)), encodings)
def test_a_block_comes_back_within_half_a_quantum(values: np.ndarray, encoding: Encoding) -> None:
    data = pack_block(values, encoding)
    assert len(data) == block_bytes(values.size, encoding)
    assert_within(unpack_block(memoryview(data), encoding), values, half_quantum(values, encoding))


@given(arrays(np.float64, st.integers(1, 20), elements=st.floats(allow_nan=False, allow_infinity=False)))
@example(np.array([5e-324]))
@example(np.array([127.0, -0.1]))
@example(np.array([127.0 + 1e-13]))
def test_the_8_bit_quantum_is_a_power_of_two_no_coarser_than_it_must_be(values: np.ndarray) -> None:
    """127 codes reach the largest number, with half of the quantum they would not; 2^-128 is the finest."""
    step, largest = quantum(values), np.abs(values).max()
    assert np.frexp(step)[0] == 0.5
    assert largest / step <= 127.0 * ROUNDING
    assert step == 2.0**-128 or largest / step > 63.5


@given(states)
def test_a_state_comes_back_within_half_a_quantum(sent: StatePayload) -> None:
    back = StatePayload.decode(sent.encode())
    assert (back.target, back.step, back.encoding) == (sent.target, sent.step, sent.encoding)
    whole = np.rint(sent.position) if sent.encoding == "uint8" else np.zeros(3)
    # adding metres and their fraction rounds once more, at a float64's precision
    slack = np.spacing(np.abs(sent.position)) if sent.encoding == "uint8" else 0.0
    assert_within(back.position, sent.position, half_quantum(sent.position - whole, sent.encoding) + slack)
    for name in ("velocity", "spread"):
        values = getattr(sent, name)
        assert_within(getattr(back, name), values, half_quantum(values, sent.encoding))
    # bringing the quaternion back to length 1 moves it by no more than rounding had moved its length
    error = half_quantum(sent.orientation, sent.encoding)
    assert_within(back.orientation, sent.orientation, error + np.linalg.norm(error) + 1e-15)


@given(weights)
def test_weights_come_back_within_half_a_quantum(sent: WeightsPayload) -> None:
    back = WeightsPayload.decode(sent.encode())
    assert (back.target, back.step, back.encoding) == (sent.target, sent.step, sent.encoding)
    said, heard = np.append(sent.facing, sent.similarity), np.append(back.facing, back.similarity)
    if sent.encoding == "uint8":
        assert_within(back.relative(), sent.weights / sent.weights.max(), 1 / 510)
        assert back.weights.min() > 0.0
        assert_within(heard, said, 1 / 254)
    else:
        assert_within(back.weights, sent.weights, half_quantum(sent.weights, sent.encoding))
        assert_within(heard, said, half_quantum(said, sent.encoding))


@given(sightings)
def test_a_sighting_comes_back_within_half_a_quantum(sent: SightingPayload) -> None:
    back = SightingPayload.decode(sent.encode())
    assert (back.target, back.step, back.encoding) == (sent.target, sent.step, sent.encoding)
    coarse = sent.encoding == "uint8"
    assert_within(back.pixel, sent.pixel, 0.5 if coarse else half_quantum(sent.pixel, sent.encoding))
    distance = np.array([sent.distance_m])
    assert_within(np.array([back.distance_m]), distance, half_quantum(distance, sent.encoding))
    similarity = np.array([sent.similarity])
    half = 1 / 254 if coarse else half_quantum(similarity, sent.encoding)
    assert_within(np.array([back.similarity]), similarity, half)


@given(rays)
def test_a_ray_comes_back_within_half_a_quantum(sent: RayPayload) -> None:
    back = RayPayload.decode(sent.encode())
    assert (back.target, back.step, back.encoding) == (sent.target, sent.step, sent.encoding)
    coarse = sent.encoding == "uint8"
    assert_within(back.pixel, sent.pixel, 1 / 16 if coarse else half_quantum(sent.pixel, sent.encoding))
    widths, lean = sent.spread[::2], sent.spread[1] / sent.spread[0] * back.spread[0]
    # the axis keeps its direction in the image; of float64 nothing is rounded
    half_lean = {"float64": 0.0, "float32": 2.0**-17, "float16": 1 / 64, "uint8": 1 / 64}[sent.encoding]
    half_width = {"float64": 0.0, "float32": 2.0**-24, "float16": 2.0**-11, "uint8": 1 / 40}[sent.encoding]
    assert_within(np.log(back.spread[::2]), np.log(widths), half_width + 1e-12)
    assert abs(back.spread[1] - lean) <= half_lean * back.spread[2] * (1 + 1e-6) + 1e-9 * abs(lean)


@given(payloads)
def test_rounding_twice_is_rounding_once(sent: Payload) -> None:
    """Whoever passes on what arrived tells the same; a quaternion alone is scaled to length 1 again."""
    for part in parts_of(sent):
        assert_repeats(part)


def content(payload: Payload) -> list[object]:
    return [value.tolist() if isinstance(value, np.ndarray) else value for value in vars(payload).values()]


def assert_repeats(sent: Payload) -> None:
    once = decode_any(sent.encode(), SYSTEM.payloads)
    twice = decode_any(once.encode(), SYSTEM.payloads)
    if isinstance(once, StatePayload):
        assert isinstance(twice, StatePayload)
        for name in ("position", "velocity", "spread"):
            np.testing.assert_array_equal(getattr(once, name), getattr(twice, name))
    elif isinstance(once, WeightsPayload) and once.encoding == "uint8":
        assert isinstance(twice, WeightsPayload)
        np.testing.assert_array_equal(once.weights, twice.weights)
    elif isinstance(once, MixturePayload | RayPayload):
        assert twice.encode() == once.encode() == sent.encode()
    else:
        assert content(once) == content(twice)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A message with some bytes changed, then cut or lengthened."""
    data = bytearray(draw(payloads).encode())
    for _ in range(draw(st.integers(0, 4))):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    return bytes(data[: draw(st.integers(0, len(data)))]) + draw(st.binary(max_size=9))


def assert_sound(payload: Payload) -> None:
    """Whatever was decoded is what its docstring says, and can be passed on."""
    for value in vars(payload).values():
        if isinstance(value, np.ndarray | float):
            assert np.isfinite(value).all()
    assert 0.0 <= getattr(payload, "similarity", 0.0) <= 1.0 + 1e-9
    if isinstance(payload, StatePayload):
        assert abs(np.linalg.norm(payload.orientation) - 1.0) < 1e-5
        assert payload.spread.size in (0, 6)
    elif isinstance(payload, WeightsPayload):
        assert payload.relative().max() == 1.0
        assert payload.relative().min() >= 0.0
        assert_facing(payload.facing)
    elif isinstance(payload, SightingPayload):
        assert payload.distance_m > 0.0
    elif isinstance(payload, RayPayload):
        np.linalg.cholesky(payload.root() @ payload.root().T)
    elif isinstance(payload, MixturePayload):
        assert_mixture(payload)
    assert decode_any(payload.encode(), SYSTEM.payloads).kind == payload.kind


def assert_facing(facing: np.ndarray) -> None:
    assert facing.size in (0, 3, 4)
    assert (np.abs(facing) <= 1.0 + 1e-9).all()


def assert_mixture(payload: MixturePayload) -> None:
    """Warnings are errors: what a product or a fusion makes of its numbers stays in a float64's range."""
    density = payload.mixture
    np.testing.assert_array_equal(density.covs, density.covs.transpose(0, 2, 1))
    np.linalg.cholesky(density.covs)
    assert np.isfinite(density.log_mass)
    assert np.isfinite(density.mean_and_cov()[1]).all()
    assert np.isfinite(np.linalg.inv(density.covs)).all()
    assert payload.cameras
    assert all(a < b for a, b in pairwise((-1, *payload.cameras, 256)))
    assert len(payload.facings) == len(payload.cameras)
    for facing in payload.facings:
        assert_facing(facing)


@given(st.one_of(st.binary(max_size=120), damaged()))
@settings(max_examples=400)
def test_any_bytes_decode_to_a_payload_or_raise_the_one_error(data: bytes) -> None:
    try:
        payload = decode_any(data, SYSTEM.payloads)
    except DecodeError:
        return
    for part in parts_of(payload):
        assert_sound(part)


@given(payloads, st.data())
@settings(max_examples=200)
def test_a_cut_or_a_flipped_bit_is_refused_or_leaves_sound_numbers(
    sent: Payload, data: st.DataObject
) -> None:
    sound = sent.encode()
    assert_refused_or_sound(sound[: data.draw(st.integers(0, len(sound) - 1))])
    assert_refused_or_sound(flipped(sound, data.draw(st.integers(0, 8 * len(sound) - 1))))


def flipped(data: bytes, bit: int) -> bytes:
    at = bit // 8
    return data[:at] + bytes([data[at] ^ 1 << bit % 8]) + data[at + 1 :]


def assert_refused_or_sound(data: bytes) -> None:
    try:
        payload = decode_any(data, SYSTEM.payloads)
    except DecodeError:
        return
    for part in parts_of(payload):
        assert_sound(part)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_bit_and_every_cut_of_one_message_of_each_kind(encoding: Encoding) -> None:
    half, facing = np.full(4, 0.5), np.array([0.5, -0.25, 0.125])
    density = GaussianMixture.single(np.full(2, 0.5), 0.01 * (np.eye(2) + 1.0))
    messages: list[Payload] = [
        SearchPayload(1, 7),
        StatePayload(1, 7, np.ones(3), np.full(3, 0.5), half, np.array([1.0, 0, 1, 0, 0, 1]), encoding),
        WeightsPayload(1, 7, np.array([0.25, 1.0]), 0.5, half, encoding),
        SightingPayload(1, 7, np.array([160.0, 120.0]), 4.0, 0.5, encoding),
        RayPayload(1, 7, np.array([160.0, 120.0]), np.array([4.0, -3.0, 2.0]), 0.5, encoding),
        MixturePayload(1, 7, density, (1, 9), 0.5, (facing, np.empty(0)), encoding),
        BatchPayload((SearchPayload(1, 7), WeightsPayload(0, 7, np.ones(1), encoding=encoding))),
    ]
    assert {type(message) for message in messages} == {*SYSTEM.payloads, BatchPayload}
    for message in messages:
        data = message.encode()
        for bit in range(8 * len(data)):
            assert_refused_or_sound(flipped(data, bit))
        for size in range(len(data)):
            assert_refused_or_sound(data[:size])


@given(st.one_of(states, weights, sightings), st.floats(1.0, 1e300))
def test_a_number_too_large_is_an_error_or_comes_back(payload: Payload, size: float) -> None:
    """No encoding ever sends an infinity, whatever the size of the number."""
    name = {"state": "velocity", "weights": "weights", "sighting": "pixel"}[payload.kind]
    large = replace(payload, **{name: size * (1.0 + np.abs(getattr(payload, name)) / 1e5)})  # type: ignore[type-var]
    try:
        sent = large.encode()
    except EncodeError:
        assert size > 2.5e4
        # float64 holds any number, but no state and no sighting is that far away
        assert payload.kind != "weights" or payload.encoding != "float64"  # type: ignore[attr-defined]
        return
    back = decode_any(sent, SYSTEM.payloads)
    if payload.kind != "weights" or payload.encoding != "uint8":  # type: ignore[attr-defined]
        np.testing.assert_allclose(getattr(back, name), getattr(large, name), rtol=1 / 127, atol=0.5)
