"""Messages: sizes on the air, exact round trips, and bytes that are no message."""

import numpy as np
import pytest

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.header import SIZE
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.numbers import ENCODINGS, Encoding
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.multiview.system import SYSTEM

FLOAT_BYTES = {"float64": 8, "float32": 4, "float16": 2}
SPREAD = np.array([0.3, -0.1, 0.2, 0.05, 0.0, 0.4])


def state(encoding: Encoding = "float64", spread: np.ndarray | None = None) -> StatePayload:
    return StatePayload(
        1,
        7,
        np.array([1.0, 2.0, 3.0]),
        np.array([0.1, 0.2, 0.3]),
        np.array([0.5, -0.5, 0.5, 0.5]),
        np.empty(0) if spread is None else spread,
        encoding,
    )


def sighting(encoding: Encoding = "float64", **changes: object) -> SightingPayload:
    said = {"pixel": np.array([160.25, 119.75]), "distance_m": 4.5, "similarity": 0.8, **changes}
    return SightingPayload(1, 7, **said, encoding=encoding)  # type: ignore[arg-type]


def ray(encoding: Encoding = "float64", **changes: object) -> RayPayload:
    said = {"pixel": np.array([320.4, -7.5]), "spread": np.array([4.0, -3.0, 2.0]), "similarity": 0.8}
    return RayPayload(1, 7, **{**said, **changes}, encoding=encoding)  # type: ignore[arg-type]


def mixture(encoding: Encoding, dimension: int, facing: np.ndarray) -> MixturePayload:
    covs = np.array([np.eye(dimension), np.eye(dimension) + 0.5]) / 16
    density = GaussianMixture(np.array([-400.0, -401.0]), np.arange(2.0 * dimension).reshape(2, -1) / 4, covs)
    return MixturePayload(1, 7, density, (2, 8), 0.9, (facing, np.empty(0)), encoding)


def every_payload(encoding: Encoding) -> list[Payload]:
    weights = np.linspace(0.0, 1.0, 12)
    return [
        state(encoding),
        state(encoding, SPREAD),
        WeightsPayload(1, 7, weights, 0.9, np.empty(0), encoding),
        WeightsPayload(1, 7, weights, 0.9, np.array([0.1, -0.2, 0.9]), encoding),
        WeightsPayload(1, 7, weights, 0.9, np.array([0.5, 0.5, -0.5, 0.5]), encoding),
        SearchPayload(1, 7),
        sighting(encoding),
        mixture(encoding, 2, np.empty(0)),
        mixture(encoding, 3, np.array([0.1, -0.2, 0.9])),
        ray(encoding),
    ]


def test_the_published_sizes_in_float64() -> None:
    """|χ| = 24 + 24 + 32 bytes and 8 a weight: Kushwaha & Koutsoukos 2013, Sec. 4.2.1."""
    assert len(state().encode()) == SIZE + 80
    one, two = (len(WeightsPayload(0, 1, np.ones(m)).encode()) for m in (1000, 2000))
    assert two - one == 8 * 1000


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_sizes_follow_the_layout(encoding: Encoding) -> None:
    """A block of n numbers: n floats, or an exponent and n bytes; metres take two bytes an axis more."""
    size = FLOAT_BYTES.get(encoding, 1)
    blocks, whole = (0, 0) if encoding != "uint8" else (1, 1)
    assert len(state(encoding).encode()) == SIZE + 10 * size + 3 * blocks + 6 * whole
    assert len(state(encoding, SPREAD).encode()) == SIZE + 16 * size + 4 * blocks + 6 * whole
    for m, facing in ((1, 0), (250, 3), (1000, 4)):
        weights = WeightsPayload(0, 1, np.ones(m), 0.5, np.full(facing, 0.5), encoding)
        assert len(weights.encode()) == SIZE + 1 + size * (m + 1 + facing)
    pixel = 2 * size if encoding != "uint8" else 4
    assert len(sighting(encoding).encode()) == SIZE + pixel + 2 * size + blocks
    assert len(SearchPayload(0, 1).encode()) == SIZE
    rays = {"float64": 54, "float32": 30, "float16": 18, "uint8": 15}
    assert len(ray(encoding).encode()) == rays[encoding]


def test_every_payload_has_a_tag_of_its_own_and_is_one_of_the_systems() -> None:
    tags = [payload_type.tag for payload_type in SYSTEM.payloads]
    assert len(set(tags)) == len(tags)
    assert {type(payload) for payload in every_payload("float64")} == set(SYSTEM.payloads)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_numbers_that_fit_come_back_as_they_were(encoding: Encoding) -> None:
    """Multiples of 1/64 below 1, of each block's own quantum: exact in every encoding."""
    sent = StatePayload(
        200,
        2**32 - 1,
        np.array([-3.5, 12.25, 100.0]),
        np.array([-1.0, 0.5, 0.0]),
        np.array([0.5, -0.5, 0.5, 0.5]),
        np.array([0.5, 0.25, 0.5, -0.125, 0.0, 0.75]),
        encoding,
    )
    back = decode_any(sent.encode(), SYSTEM.payloads)
    assert isinstance(back, StatePayload)
    assert (back.target, back.step, back.encoding) == (200, 2**32 - 1, encoding)
    for name in ("position", "velocity", "orientation", "spread"):
        np.testing.assert_array_equal(getattr(back, name), getattr(sent, name), err_msg=name)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_the_extremes_of_shares_and_weights_are_exact(encoding: Encoding) -> None:
    sent = WeightsPayload(3, 9, np.array([1.0, 0.0, 0.2]), 1.0, np.array([-1.0, 0.0, 1.0]), encoding)
    back = decode_any(sent.encode(), SYSTEM.payloads)
    assert isinstance(back, WeightsPayload)
    assert back.similarity == 1.0
    np.testing.assert_array_equal(back.facing, sent.facing)
    assert back.relative()[0] == 1.0


def test_the_8_bit_ray_is_good_for_a_tenth_of_a_pixel(test_seed: int) -> None:
    """Eighths of a pixel at VGA and outside of it; widths within 2.5 %, the axis within 1/64 of a width."""
    rng = np.random.default_rng(test_seed)
    for _ in range(200):
        sent = ray("uint8", pixel=rng.uniform(-640.0, 1280.0, 2), spread=np.exp(rng.uniform(-2.0, 5.0, 3)))
        back = RayPayload.decode(sent.encode())
        assert np.abs(back.pixel - sent.pixel).max() <= 1 / 16
        diagonal = back.spread[::2] / sent.spread[::2]
        assert np.abs(np.log(diagonal)).max() <= 0.025 + 1e-12
        slope = sent.spread[1] / sent.spread[0]
        assert abs(back.spread[1] - slope * back.spread[0]) <= back.spread[2] / 64 + 1e-9
        root = back.root()
        np.testing.assert_allclose(np.linalg.cholesky(root @ root.T), root, rtol=1e-9, atol=1e-9)


def test_a_weight_below_half_a_level_is_not_ruled_out() -> None:
    """8 bits: the code 0 reads as the middle of what it stands for, a quarter of a level."""
    sent = WeightsPayload(0, 1, np.array([1.0, 0.4 / 255, 0.0]), encoding="uint8")
    back = WeightsPayload.decode(sent.encode())
    np.testing.assert_allclose(back.relative(), [1.0, 0.25 / 255, 0.25 / 255], rtol=1e-12)


@pytest.mark.parametrize(
    ("payload", "says"),
    [
        (WeightsPayload(0, 1, np.array([1.0, 7e4]), encoding="float16"), "float16 holds numbers up to 65504"),
        (WeightsPayload(0, 1, np.array([1.0, 1e39]), encoding="float32"), "float32 holds numbers up to 3.4"),
        (WeightsPayload(0, 1, np.array([1e-9, 1e-8]), encoding="float16"), "relative to the largest"),
        (WeightsPayload(0, 1, np.zeros(2), encoding="uint8"), "one above 0"),
        (WeightsPayload(0, 1, np.array([1.0, np.nan]), encoding="uint8"), "at least 0"),
        (WeightsPayload(0, 1, np.ones(2), 1.0, np.ones(2)), "3 or 4 numbers, got 2"),
        (WeightsPayload(0, 1, np.ones(2), 1.0, np.full(3, np.nan), "uint8"), "between -1 and 1"),
        (WeightsPayload(0, 1, np.ones(2), 1.5), "between -1 and 1"),
        (sighting("float16", distance_m=1e5), "use a wider encoding"),
        (sighting("float64", distance_m=np.inf), "got inf"),
        (sighting("uint8", distance_m=1e7), "up to 1e\\+06 m"),
        (sighting("uint8", pixel=np.array([4e4, 0.0])), "32767"),
        (ray(pixel=np.array([0.0, 4096.0])), "within 4095 px"),
        (ray(pixel=np.array([0.0, np.nan])), "within 4095 px"),
        (ray(spread=np.array([1.0, 0.0, 0.0])), "diagonal of at least"),
        (ray(spread=np.array([1.0, np.inf, 1.0])), "got \\[1.0, inf, 1.0\\]"),
        (StatePayload(0, 1, np.full(3, 2e7), np.zeros(3), np.eye(4)[0]), "within 1e\\+07 m"),
        (StatePayload(0, 1, np.zeros(3), np.full(3, 2e5), np.eye(4)[0]), "within 100000 m/s"),
        (StatePayload(0, 1, np.full(3, 7e4), np.zeros(3), np.eye(4)[0], encoding="float16"), "got 70000"),
        (StatePayload(0, 1, np.full(3, 4e4), np.zeros(3), np.eye(4)[0], encoding="uint8"), "32767 m"),
        (StatePayload(0, 1, np.full(3, np.nan), np.zeros(3), np.eye(4)[0], encoding="uint8"), "nan"),
        (StatePayload(0, 1, np.zeros(3), np.full(3, np.nan), np.eye(4)[0]), "nan"),
    ],
)
def test_what_an_encoding_cannot_hold_is_refused_with_its_limit(payload: Payload, says: str) -> None:
    with pytest.raises(EncodeError, match=says):
        payload.encode()


def raw(tag: int, encoding: Encoding, body: bytes) -> bytes:
    return bytes([tag | ENCODINGS.index(encoding) << 6, 0, 1, 0, 0, 0]) + body


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "0 bytes"),
        (b"\x37" + bytes(20), "0x37"),
        (state().encode()[:3], "6 bytes"),
        (state().encode()[:-1], "80 bytes"),
        (state().encode() + b"\0", "80 bytes"),
        (raw(0x01, "float64", np.array([np.nan, *[0.0] * 5, 1, 0, 0, 0], "<f8").tobytes()), "finite"),
        (raw(0x01, "float64", np.array([*[0.0] * 6, 2, 0, 0, 0], "<f8").tobytes()), "unit quaternion"),
        (raw(0x01, "float64", bytes(80)), "unit quaternion"),
        (raw(0x01, "uint8", bytes(6 + 4 + 4 + 5)), "unit quaternion"),
        (raw(0x10, "float64", b""), "got 0 bytes"),
        (raw(0x10, "float64", b"\x00" + bytes(16)), "8 bytes a number"),
        (raw(0x10, "float64", b"\x01" + bytes(8)), "8 bytes a number"),
        (raw(0x10, "float64", b"\x01" + bytes(17)), "8 bytes a number"),
        (raw(0x10, "float64", b"\x01" + bytes(16)), "one above 0"),
        (raw(0x10, "float64", b"\x01" + np.array([1.0, -0.5, 0.5], "<f8").tobytes()), "at least 0"),
        (raw(0x10, "float64", b"\x01" + np.array([1.0, np.nan, 0.5], "<f8").tobytes()), "finite"),
        (raw(0x10, "float64", b"\x01" + np.array([1.0, 1.0, 1.5], "<f8").tobytes()), "between -1 and 1"),
        (raw(0x10, "float16", b"\x01" + np.array([1.0, np.inf, 0.5], "<f2").tobytes()), "finite"),
        (raw(0x10, "float32", b"\x01" + b"\x00\x00\xa0\x7f" + bytes(4)), "finite"),
        (raw(0x10, "float16", b"\x01" + b"\x00\x7d" + bytes(2)), "finite"),
        (raw(0x01, "float64", np.array([1e8, *[0.0] * 5, 1, 0, 0, 0], "<f8").tobytes()), "within 1e\\+07 m"),
        (raw(0x01, "float64", np.array([*[0.0] * 5, 1e6, 1, 0, 0, 0], "<f8").tobytes()), "within 100000 m/s"),
        (raw(0x10, "uint8", b"\x03\xff\x7f\x00\x00"), "3 or 4 numbers, got 2"),
        (raw(0x10, "uint8", b"\x01\xff\xff"), "similarity"),
        (raw(0x10, "uint8", b"\x01\x05\x06\x7f"), "must be 255"),
        (raw(0x10, "uint8", b"\x01\xff\x80"), "between -1 and 1"),
        (raw(0x02, "float64", b"\x00"), "behind the header"),
        (raw(0x12, "uint8", bytes(6)), "7 bytes"),
        (raw(0x12, "uint8", bytes(7)), "above 0"),
        (raw(0x12, "float64", np.array([1.0, 2.0, 1e7, 0.5], "<f8").tobytes()), "up to 1e\\+06 m"),
        (raw(0x12, "float64", np.array([4e4, 2.0, 3.0, 0.5], "<f8").tobytes()), "32767"),
        (raw(0x12, "float64", np.array([1.0, 2.0, 3.0, -0.5], "<f8").tobytes()), "similarity"),
        (raw(0x13, "uint8", bytes(8)), "9 bytes"),
        (raw(0x13, "uint8", bytes(8) + b"\xff"), "similarity"),
        (raw(0x13, "float64", np.array([1.0, 2.0, 1.0, 0.0, 0.0, 0.5], "<f8").tobytes()), "diagonal"),
        (raw(0x13, "float64", np.array([5e3, 2.0, 1.0, 0.0, 1.0, 0.5], "<f8").tobytes()), "4095"),
        (raw(0x13, "float32", np.array([1.0, 2.0, 1.0, -1.0, 0.0, 0.5], "<f4").tobytes()), "width must be"),
        (raw(0x13, "float32", np.array([1.0, 2.0, 1.0, 1.0, 1e5, 0.5], "<f4").tobytes()), "lean must be"),
        (raw(0x12, "float64", np.array([1.0, 2.0, -3.0, 0.5], "<f8").tobytes()), "above 0"),
        (raw(0x12, "float64", np.array([np.inf, 2.0, 3.0, 0.5], "<f8").tobytes()), "finite"),
        (raw(0x12, "float64", np.array([1.0, 2.0, 3.0, 2.5], "<f8").tobytes()), "between -1 and 1"),
    ],
)
def test_bytes_that_are_no_message_are_refused_with_the_reason(data: bytes, says: str) -> None:
    with pytest.raises(DecodeError, match=says):
        decode_any(data, SYSTEM.payloads)


@pytest.mark.parametrize("payload_type", SYSTEM.payloads)
def test_a_payload_refuses_the_tag_of_another(payload_type: type[Payload]) -> None:
    for payload in every_payload("float32"):
        if type(payload) is not payload_type:
            with pytest.raises(DecodeError, match="tag"):
                payload_type.decode(payload.encode())


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_cut_or_lengthened_message_is_never_taken_for_the_whole_one(encoding: Encoding) -> None:
    """The number of weights is in no header: a cut may leave fewer of them, which a base station refuses."""
    for payload in every_payload(encoding):
        data = payload.encode()
        for damaged in [*(data[:size] for size in range(len(data))), data + b"\0", data + data[-1:]]:
            try:
                back = decode_any(damaged, SYSTEM.payloads)
            except DecodeError:
                continue
            if isinstance(payload, StatePayload):
                # without its last block a state with a spread is one without
                assert back.spread.size == 0 < payload.spread.size
            else:
                assert isinstance(payload, WeightsPayload)
                assert back.weights.size != payload.weights.size
