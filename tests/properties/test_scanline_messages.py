"""Messages of the scan-line system: sizes as named, numbers within half a quantum, damage breaks nothing."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.messages.base import decode_any
from wsnsim.messages.scanline import (
    EnergyPayload,
    HandoverPayload,
    HeadPayload,
    PlacesPayload,
    ScanLinePayload,
    TrackPayload,
    step_near,
    step_of,
)
from wsnsim.systems.scanline.system import SYSTEM

LINE_HALF = 0.5 * 1.25 / 32_767 * (1 + 1e-9)
"""Half a quantum of a place in the scan line, in half widths."""
ROOM_HALF = 0.5 / 65_535 * (1 + 1e-9)
"""The same of a place on the floor, in the room's sides."""
HALF_PRECISION = 2.0**-11
"""Relative rounding of half precision (IEEE 754), absolute 2⁻²⁵ below its least normal number."""

bytes_ = st.integers(0, 255)
places = st.floats(-1.25, 1.25)
lines = st.lists(places, max_size=40).map(lambda ends: np.sort(ends[: len(ends) // 2 * 2]).reshape(-1, 2))
shares = st.floats(0.0, 1.0)
pairs = st.tuples(shares, shares).map(np.array)
occluders = st.lists(st.tuples(st.integers(0, 65_535), shares, shares), max_size=30)
small = st.floats(-6e4, 6e4)
variances = st.floats(0.0, 6e4)
covs = st.tuples(variances, small, variances).map(np.array)
terms = st.integers(0, 255)

scan_lines = st.builds(ScanLinePayload, bytes_, st.none() | places, st.none() | lines)
places_told = st.builds(
    lambda step, rows: PlacesPayload(
        step,
        np.array([row[0] for row in rows], np.int64),
        np.array([row[1:] for row in rows], np.float64).reshape(-1, 2),
    ),
    bytes_,
    occluders,
)
tracks = st.builds(
    TrackPayload, bytes_, pairs, st.tuples(small, small).map(np.array), covs, st.integers(0, 62)
)
energies = st.builds(EnergyPayload, terms, st.floats(0.0, 1e12) | st.just(math.inf))
heads = st.builds(HeadPayload, terms, st.integers(0, 65_535), bytes_)
handovers = st.builds(HandoverPayload, terms, arrays(np.float64, 2, elements=st.floats(-1e6, 1e6)), covs)


def again(payload):
    """Return a message as it arrives, found by its tag."""
    arrived = decode_any(payload.encode(), SYSTEM.payloads)
    assert type(arrived) is type(payload)
    return arrived


def assert_half_precision(arrived, given_):
    np.testing.assert_allclose(arrived, given_, rtol=HALF_PRECISION, atol=2.0**-25)


@given(scan_lines)
def test_a_bearing_takes_four_bytes_and_a_line_one_more_and_four_a_blob(payload):
    blobs = 0 if payload.blobs is None else 1 + 4 * len(payload.blobs)
    assert len(payload.encode()) == 4 + blobs
    arrived = again(payload)
    assert arrived.step == payload.step
    if payload.share is None:
        assert arrived.share is None
    else:
        assert abs(arrived.share - payload.share) <= LINE_HALF
    if payload.blobs is None:
        assert arrived.blobs is None
    else:
        assert arrived.blobs.shape == payload.blobs.shape
        np.testing.assert_allclose(arrived.blobs, payload.blobs, rtol=0, atol=LINE_HALF)


@given(places_told)
def test_places_take_two_bytes_and_six_an_occluder(payload):
    assert len(payload.encode()) == 2 + 6 * len(payload.ids)
    arrived = again(payload)
    np.testing.assert_array_equal(arrived.ids, payload.ids)
    np.testing.assert_allclose(arrived.shares, payload.shares, rtol=0, atol=ROOM_HALF)


@given(tracks)
def test_a_track_takes_seventeen_bytes(payload):
    assert len(payload.encode()) == 17
    arrived = again(payload)
    assert (arrived.step, arrived.heard) == (payload.step, payload.heard)
    np.testing.assert_allclose(arrived.shares, payload.shares, rtol=0, atol=ROOM_HALF)
    assert_half_precision(arrived.velocity, payload.velocity)
    assert_half_precision(arrived.cov, payload.cov)


@given(energies)
def test_a_battery_takes_six_bytes(payload):
    assert len(payload.encode()) == 6
    arrived = again(payload)
    assert arrived.election == payload.election
    np.testing.assert_allclose(arrived.left_j, payload.left_j, rtol=2.0**-24, atol=1e-45)


@given(heads)
def test_an_announcement_takes_five_bytes(payload):
    assert len(payload.encode()) == 5
    assert again(payload) == payload


@given(handovers)
def test_a_handover_takes_22_bytes(payload):
    assert len(payload.encode()) == 22
    arrived = again(payload)
    assert arrived.term == payload.term
    np.testing.assert_allclose(arrived.place, payload.place, rtol=2.0**-24, atol=1e-45)
    np.testing.assert_allclose(arrived.cov, payload.cov, rtol=2.0**-24, atol=1e-45)


@given(st.one_of(scan_lines, places_told, tracks, energies, heads, handovers), st.data())
def test_damage_is_decoded_or_refused(payload, data):
    """Bytes changed, lost or added: a message of the system, or a `DecodeError`, and never anything else."""
    encoded = bytearray(payload.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        encoded[data.draw(st.integers(0, len(encoded) - 1))] = data.draw(bytes_)
    damaged = bytes(encoded[: data.draw(st.integers(0, len(encoded)))]) + data.draw(st.binary(max_size=3))
    try:
        decoded = decode_any(damaged, SYSTEM.payloads)
    except DecodeError:
        return
    if isinstance(decoded, ScanLinePayload) and decoded.blobs is not None:
        assert (np.diff(decoded.blobs.ravel()) >= 0.0).all()
    # what was understood can be said again
    assert len(decoded.encode()) == len(damaged)


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (ScanLinePayload(0, 1.3), "must be within ±1.25 half widths"),
        (ScanLinePayload(0, math.inf), "must be within ±1.25 half widths"),
        (ScanLinePayload(0, None, np.zeros((256, 2))), "at most 255 blobs, got 256"),
        (PlacesPayload(0, np.array([65_536]), np.zeros((1, 2))), "numbers must be 0 to 65535"),
        (PlacesPayload(0, np.array([0]), np.full((1, 2), np.nan)), "must be finite"),
    ],
)
def test_what_does_not_fit_is_not_said(payload, message):
    with pytest.raises(EncodeError, match=message):
        payload.encode()


def test_a_place_beside_the_room_is_put_on_its_side():
    payload = PlacesPayload(0, np.array([0, 1]), np.array([[-0.5, 0.5], [0.25, 7.0]]))
    np.testing.assert_allclose(again(payload).shares, [[0.0, 0.5], [0.25, 1.0]], atol=ROOM_HALF)


def test_a_variance_beyond_half_precision_is_the_largest():
    payload = TrackPayload(0, np.zeros(2), np.zeros(2), np.array([1e9, -1e9, 1e9]), 0)
    assert again(payload).cov.tolist() == [65_504.0, -65_504.0, 65_504.0]


@given(st.integers(0, 10_000), st.integers(0, 255))
def test_a_step_is_told_by_its_lowest_byte_up_to_255_steps_later(step, later):
    assert step_of(step & 0xFF, step + later) == step


@given(st.integers(0, 10_000), st.integers(0, 10_000))
def test_a_step_of_no_more_than_255_ago_is_never_in_the_future(step, latest):
    found = step_of(step & 0xFF, latest)
    assert latest - 255 <= found <= latest
    assert (found - step) % 256 == 0


@given(st.integers(0, 10_000), st.integers(-127, 128))
def test_the_nearest_step_is_found_before_and_after(step, away):
    assert step_near(step & 0xFF, step + away) == step
