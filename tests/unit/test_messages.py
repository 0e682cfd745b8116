"""Messages: sizes on the air, round trips, and bytes that are no message."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsnsim.errors import DecodeError
from wsnsim.messages.base import decode_any
from wsnsim.messages.header import SIZE
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import QuantisedWeightsPayload, WeightsPayload

TYPES = (StatePayload, WeightsPayload, QuantisedWeightsPayload)


def state(step: int = 7) -> StatePayload:
    return StatePayload(
        1, step, np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3]), np.array([0.5, -0.5, 0.5, 0.5])
    )


def test_the_state_is_eighty_bytes_behind_its_header() -> None:
    # 24 + 24 + 32 bytes: Kushwaha & Koutsoukos 2013, Sec. 4.2.1
    assert len(state().encode()) == SIZE + 80


def test_weights_cost_eight_bytes_or_one() -> None:
    weights = np.linspace(0.0, 1.0, 1000)
    assert len(WeightsPayload(0, 1, weights).encode()) == SIZE + 8000
    assert len(QuantisedWeightsPayload.quantise(0, 1, weights).encode()) == SIZE + 1000


def test_state_round_trip_is_exact() -> None:
    back = decode_any(state().encode(), TYPES)
    assert isinstance(back, StatePayload)
    assert (back.target, back.step) == (1, 7)
    for name in ("position", "velocity", "orientation"):
        np.testing.assert_array_equal(getattr(back, name), getattr(state(), name))


positive = arrays(np.float64, st.integers(1, 300), elements=st.floats(0.0, 1e6)).filter(
    lambda weights: weights.max() > 1e-6
)


@given(positive, st.integers(0, 255), st.integers(0, 2**32 - 1))
def test_float_weights_round_trip_exactly(weights: np.ndarray, target: int, step: int) -> None:
    back = decode_any(WeightsPayload(target, step, weights).encode(), TYPES)
    assert isinstance(back, WeightsPayload)
    assert (back.target, back.step) == (target, step)
    np.testing.assert_array_equal(back.weights, weights)


@given(positive)
def test_quantised_weights_are_within_half_a_quantum(weights: np.ndarray) -> None:
    back = decode_any(QuantisedWeightsPayload.quantise(0, 1, weights).encode(), TYPES)
    assert isinstance(back, QuantisedWeightsPayload)
    assert np.abs(back.relative() - weights / weights.max()).max() <= 0.5 / 255 * (1 + 1e-9)
    assert back.relative().min() > 0.0


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "0 bytes"),
        (b"\x77" + bytes(20), "0x77"),
        (state().encode()[:3], "6 bytes"),
        (state().encode()[:-1], "80 bytes"),
        (WeightsPayload(0, 1, np.ones(3)).encode()[:-1], "8 bytes a weight"),
        (WeightsPayload(0, 1, np.array([1.0, np.nan])).encode(), "finite"),
        (WeightsPayload(0, 1, np.array([1.0, -0.5])).encode(), "at least 0"),
        (WeightsPayload(0, 1, np.zeros(4)).encode(), "one above 0"),
        (WeightsPayload(0, 1, np.empty(0)).encode(), "got 0 bytes"),
        (b"\x11\x00\x01\x00\x00\x00\x05\x06", "largest"),
        (StatePayload(0, 1, np.full(3, np.nan), np.zeros(3), np.array([1.0, 0, 0, 0])).encode(), "finite"),
        (StatePayload(0, 1, np.zeros(3), np.zeros(3), np.array([2.0, 0, 0, 0])).encode(), "quaternion"),
    ],
)
def test_bytes_that_are_no_message_are_refused_with_the_reason(data: bytes, says: str) -> None:
    with pytest.raises(DecodeError, match=says):
        decode_any(data, TYPES)


@given(st.binary(max_size=200))
def test_any_bytes_decode_or_raise_the_one_error(data: bytes) -> None:
    try:
        payload = decode_any(data, TYPES)
    except DecodeError:
        return
    assert type(payload).decode(payload.encode()).encode() == payload.encode()
