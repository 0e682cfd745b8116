"""Encodings: every number comes back within half a quantum, and damage never breaks a decoder."""

from dataclasses import replace

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.numbers import ENCODINGS, Encoding, block_bytes, pack_block, quantum, unpack_block
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
payloads = st.one_of(states, weights, sightings, st.builds(SearchPayload, targets, steps))


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


def content(payload: Payload) -> list[object]:
    return [value.tolist() if isinstance(value, np.ndarray) else value for value in vars(payload).values()]


@given(payloads)
def test_rounding_twice_is_rounding_once(sent: Payload) -> None:
    """Whoever passes on what arrived tells the same; a quaternion alone is scaled to length 1 again."""
    once = decode_any(sent.encode(), SYSTEM.payloads)
    twice = decode_any(once.encode(), SYSTEM.payloads)
    if isinstance(once, StatePayload):
        assert isinstance(twice, StatePayload)
        for name in ("position", "velocity", "spread"):
            np.testing.assert_array_equal(getattr(once, name), getattr(twice, name))
    elif isinstance(once, WeightsPayload) and once.encoding == "uint8":
        assert isinstance(twice, WeightsPayload)
        np.testing.assert_array_equal(once.weights, twice.weights)
    else:
        assert content(once) == content(twice)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A message with some bytes changed, then cut or lengthened."""
    data = bytearray(draw(payloads).encode())
    for _ in range(draw(st.integers(0, 4))):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    return bytes(data[: draw(st.integers(0, len(data)))]) + draw(st.binary(max_size=9))


@given(st.one_of(st.binary(max_size=120), damaged()))
@settings(max_examples=400)
def test_any_bytes_decode_to_a_payload_or_raise_the_one_error(data: bytes) -> None:
    try:
        payload = decode_any(data, SYSTEM.payloads)
    except DecodeError:
        return
    for value in vars(payload).values():
        if isinstance(value, np.ndarray | float):
            assert np.isfinite(value).all()
    if isinstance(payload, WeightsPayload):
        assert payload.relative().max() == 1.0
        assert payload.relative().min() >= 0.0


@given(st.one_of(states, weights, sightings), st.floats(1.0, 1e300))
def test_a_number_too_large_is_an_error_or_comes_back(payload: Payload, size: float) -> None:
    """No encoding ever sends an infinity, whatever the size of the number."""
    name = {"state": "velocity", "weights": "weights", "sighting": "pixel"}[payload.kind]
    large = replace(payload, **{name: size * (1.0 + np.abs(getattr(payload, name)) / 1e5)})  # type: ignore[type-var]
    try:
        sent = large.encode()
    except EncodeError:
        assert size > 3e4
        assert payload.encoding != "float64"  # type: ignore[attr-defined]
        return
    back = decode_any(sent, SYSTEM.payloads)
    if payload.kind != "weights" or payload.encoding != "uint8":  # type: ignore[attr-defined]
        np.testing.assert_allclose(getattr(back, name), getattr(large, name), rtol=1 / 127, atol=0.5)
