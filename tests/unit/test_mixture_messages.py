"""Messages of mixtures: sizes as the trackers plan with, what each encoding keeps, what is refused."""

from itertools import product

import numpy as np
import pytest

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.factors import pack_factors, unpack_factors
from wsnsim.messages.header import SIZE
from wsnsim.messages.mixture import MixturePayload, mixture_bytes
from wsnsim.messages.numbers import ENCODINGS, Encoding

FACING = np.array([0.1, -0.2, 0.9])
NOTHING = np.empty(0)


def density(order: int, dimension: int = 3, log_mass: float = 0.0) -> GaussianMixture:
    means = np.linspace(-1.5, 1.5, order * dimension).reshape(order, dimension)
    covs = np.array([(0.2 + 0.1 * i) ** 2 * (np.eye(dimension) + 0.3) for i in range(order)])
    return GaussianMixture(log_mass - 0.5 * np.arange(order), means, covs)


def message(
    mixture: GaussianMixture,
    encoding: Encoding = "float64",
    cameras: tuple[int, ...] = (4,),
    facings: tuple[np.ndarray, ...] | None = None,
) -> MixturePayload:
    said = (NOTHING,) * len(cameras) if facings is None else facings
    return MixturePayload(1, 7, mixture, cameras, 0.75, said, encoding)


def back_from(payload: MixturePayload) -> MixturePayload:
    return MixturePayload.decode(payload.encode())


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_the_size_is_known_before_the_message(encoding: Encoding) -> None:
    for order, dimension in product((1, 4, 255), (2, 3)):
        for cameras in ((0,), (7,), (8,), (255,), (1, 3, 4), tuple(range(40))):
            for facing in (NOTHING, FACING, np.full(4, 0.5)):
                payload = message(density(order, dimension), encoding, cameras, (facing,) * len(cameras))
                size = mixture_bytes(order, dimension, cameras, facing.size, encoding)
                assert len(payload.encode()) == size


def test_a_component_has_the_published_numbers() -> None:
    """1 + 3 + 6 numbers in space, 80 bytes in float64, 1 + 2 + 3 in an image; in 8 bits 13 and 7 bytes."""
    for encoding, front, space, image in (
        ("float64", 17, 80, 48),
        ("float32", 13, 40, 24),
        ("float16", 13, 20, 12),
        ("uint8", 13, 13, 7),
    ):
        for dimension, each in ((3, space), (2, image)):
            one, five = (mixture_bytes(n, dimension, (0,), 0, encoding) for n in (1, 5))
            assert five - one == 4 * each
            assert one - each == front
            assert front > SIZE


def test_8_bits_take_a_quarter_of_float64_or_less() -> None:
    """With what cameras say of the orientation; without, from two components on."""
    for order, cameras in product(range(1, 9), ((0,), (0, 1), (0, 1, 2, 3, 9))):
        for facing in (0, 3, 4):
            if facing or order > 1:
                wide, narrow = (mixture_bytes(order, 3, cameras, facing, e) for e in ("float64", "uint8"))
                assert narrow <= wide / 4


def test_in_float64_nothing_changes() -> None:
    sent = message(density(4, 3, -400.0), "float64", (0, 9, 200), (FACING, NOTHING, -FACING))
    back = back_from(sent)
    assert (back.target, back.step, back.similarity, back.encoding) == (1, 7, 0.75, "float64")
    assert back.cameras == (0, 9, 200)
    for heard, said in zip(back.facings, sent.facings, strict=True):
        np.testing.assert_array_equal(heard, said)
    for name in ("log_weights", "means", "covs"):
        np.testing.assert_array_equal(getattr(back.mixture, name), getattr(sent.mixture, name))


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("log_mass", [0.0, -400.0, 30.0, -2e4])
def test_the_log_mass_survives_and_leaves_the_weights_alone(encoding: Encoding, log_mass: float) -> None:
    """Two cameras 2 m apart agree to e^-400; float16 keeps a logarithm within 2^-11 of itself."""
    sent = message(density(4, 3, log_mass), encoding)
    back = back_from(sent).mixture
    steps = {"float64": 0.0, "float32": 2.0**-24 * 2e4, "float16": 2.0**-11 * 2, "uint8": 0.025}
    assert back.log_mass == pytest.approx(sent.mixture.log_mass, rel=2.0**-11, abs=0.03)
    np.testing.assert_allclose(
        np.log(back.weights), np.log(sent.mixture.weights), atol=2 * steps[encoding] + 1e-9
    )


@pytest.mark.parametrize("encoding", ["float16", "uint8"])
def test_weights_beyond_a_narrow_encoding_read_as_its_end(encoding: Encoding) -> None:
    few = density(2)
    for log_weights, heard in (
        ([0.0, -1e6], [0.0, {"float16": -65504.0, "uint8": -12.75}[encoding]]),
        ([-1e6, -1e6], [-65504.0, -65504.0]),
        ([1e6, 1e6], [65504.0, 65504.0]),
    ):
        back = back_from(message(GaussianMixture(np.array(log_weights), few.means, few.covs), encoding))
        np.testing.assert_allclose(back.mixture.log_weights, heard, rtol=0.0, atol=1e-9)


def test_8_bits_keep_means_and_widths_fine_against_the_prediction(test_seed: int) -> None:
    """Means from the prediction within 1/64 of its deviation, widths within 2.5 %, shares within 1/254."""
    rng = np.random.default_rng(test_seed)
    for _ in range(50):
        means = np.clip(rng.standard_normal((4, 3)), -3.9, 3.9)
        covs = np.array([np.diag(sds**2) for sds in np.exp(rng.uniform(-6.0, 1.0, (4, 3)))])
        sent = message(GaussianMixture(np.zeros(4), means, covs), "uint8", (4,), (FACING,))
        back = back_from(sent)
        assert np.abs(back.mixture.means - means).max() <= 1 / 64
        ratios = np.diagonal(back.mixture.covs, axis1=1, axis2=2) / np.diagonal(covs, axis1=1, axis2=2)
        assert np.abs(0.5 * np.log(ratios)).max() <= 0.025 + 1e-12
        assert abs(back.similarity - 0.75) <= 1 / 254
        assert np.abs(back.facings[0] - FACING).max() <= 1 / 254


@pytest.mark.parametrize("encoding", ["float32", "float16", "uint8"])
def test_what_is_thinner_than_an_encoding_holds_is_widened(encoding: Encoding) -> None:
    """Never narrowed, and only where it is thin: along its length it keeps its width within 2.5 %."""
    along = np.array([1.0, 1.0, 1.0]) / np.sqrt(3.0)
    across = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    thin = np.outer(along, along) + 1e-14 * np.eye(3)
    (cov,) = back_from(message(GaussianMixture.single(np.zeros(3), thin), encoding)).mixture.covs
    assert np.linalg.eigvalsh(cov)[0] > 1e-14
    assert along @ cov @ along == pytest.approx(1.0, rel=0.051)
    assert across @ cov @ across < 1e-5


@pytest.mark.parametrize(
    ("encoding", "largest"), [("float32", 4096.0), ("float16", 1023.0), ("uint8", 1023.0)]
)
def test_the_thinnest_covariances_of_all_are_positive_definite(encoding: Encoding, largest: float) -> None:
    """Leans at their end in every row, or a little below it: they arrive, one code wider at most."""
    ends = [sign * largest * share for sign in (-1.0, 1.0) for share in (1.0, 0.99)]
    factors = np.array([np.eye(3)] * 64)
    factors[:, 1, 0], factors[:, 2, 0], factors[:, 2, 1] = np.array(list(product(ends, repeat=3))).T
    arrived = unpack_factors(memoryview(pack_factors(factors, encoding)), 3, encoding)
    np.testing.assert_allclose(arrived, factors, rtol=np.expm1(1 / 20) + 1e-9)
    np.linalg.cholesky(arrived @ arrived.transpose(0, 2, 1))


@pytest.mark.parametrize("encoding", ["float16", "uint8"])
def test_widths_beyond_a_narrow_encoding_read_as_its_end(encoding: Encoding) -> None:
    least, most = {"float16": (2.0**-14, 200.0), "uint8": (np.exp(-8.0), np.exp(4.75))}[encoding]
    sent = GaussianMixture.single(np.zeros(2), np.diag([1e-12, 200.0**2]))
    (cov,) = back_from(message(sent, encoding)).mixture.covs
    np.testing.assert_allclose(np.sqrt(np.diag(cov)), [least, most], rtol=1e-9)


GOOD = density(2)


def mixture(**changes: np.ndarray) -> GaussianMixture:
    return GaussianMixture(
        **{"log_weights": GOOD.log_weights, "means": GOOD.means, "covs": GOOD.covs, **changes}
    )


@pytest.mark.parametrize(
    ("payload", "says"),
    [
        (message(GOOD, cameras=()), "one or more, ascending"),
        (message(GOOD, cameras=(3, 2)), "ascending, got \\(3, 2\\)"),
        (message(GOOD, cameras=(3, 3)), "ascending, got \\(3, 3\\)"),
        (message(GOOD, cameras=(-1, 3)), "up to 255"),
        (message(GOOD, cameras=(256,)), "up to 255"),
        (message(GOOD, cameras=(1, 2), facings=(FACING,)), "one facing a camera, got 1 of 2"),
        (message(GOOD, cameras=(1, 2), facings=(FACING, np.ones(4))), "all facings must be"),
        (message(GOOD, facings=(np.ones(2),)), "all facings must be"),
        (message(GOOD, facings=(np.full(3, 1.5),)), "between -1 and 1"),
        (message(GOOD, "uint8", facings=(np.full(3, np.nan),)), "between -1 and 1"),
        (message(density(256)), "up to 255 components"),
        (message(density(1, 4)), "2 or 3 dimensions"),
        (message(mixture(means=np.full((2, 3), 2e3))), "means must lie within 1024"),
        (message(mixture(log_weights=np.array([0.0, -2e9]))), "log weights must lie"),
        (message(mixture(covs=np.array([np.eye(3)] * 2) * 1e-20)), "variances must lie"),
        (message(mixture(covs=np.array([np.eye(3)] * 2) * 1e20)), "variances must lie"),
    ],
)
def test_what_is_no_message_is_not_sent(payload: MixturePayload, says: str) -> None:
    with pytest.raises(EncodeError, match=says):
        payload.encode()


def raw(encoding: Encoding, body: bytes) -> bytes:
    return bytes([0x11 | ENCODINGS.index(encoding) << 6, 0, 1, 0, 0, 0]) + body


def single(
    log_weight: float = 0.0, mean: float = 0.0, cov: tuple[float, float, float] = (1.0, 0.0, 1.0)
) -> bytes:
    """An image's mixture of one component in float64, of camera 0."""
    return raw("float64", b"\x01\x00\x01" + np.array([0.5, log_weight, mean, mean, *cov], "<f8").tobytes())


NARROW = b"\x7f" + b"\x00\x00" + b"\x00" + b"\x00\x01\x01" + b"\xa0\xa0" + b"\x00\x00"
"""One component in 8 bits: similarity, log weight in front, weight, means, widths, lean."""


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (raw("uint8", b"\x01"), "at least 2 bytes"),
        (raw("uint8", b"\x00\x00\x01" + NARROW), "order 0"),
        (raw("uint8", b"\x01\x06\x01" + NARROW), "shape 0x06"),
        (raw("uint8", b"\x01\x00\x00" + NARROW), "mask of cameras"),
        (raw("uint8", b"\x01\x08\x01\x00" + NARROW), "mask of cameras"),
        (raw("uint8", b"\x01\x08\x01"), "mask of cameras"),
        (raw("uint8", b"\x01\x02\x01\x00" + NARROW), "a facing must be"),
        (raw("uint8", b"\x01\x02\x01\x02" + NARROW), "a facing must be"),
        (raw("uint8", b"\x01\x00\x01" + NARROW[:-1]), "bytes of numbers must follow"),
        (raw("uint8", b"\x01\x00\x01" + NARROW + b"\x00"), "bytes of numbers must follow"),
        (raw("uint8", b"\x01\x00\x01\x81" + NARROW[1:]), "similarity"),
        (raw("uint8", b"\x01\x00\x01\x7f\x00\x00\x01" + NARROW[4:]), "that in front"),
        (raw("uint8", b"\x01\x00\x01\x7f\x00\x7c\x00" + NARROW[4:]), "finite"),
        (raw("uint8", b"\x01\x00\x01\x7f\x00\x00\x00\x30" + NARROW[5:]), "means must lie"),
        (single(np.nan), "finite"),
        (single(1e10), "log weights must lie"),
        (single(0.0, 1e6), "means must lie"),
        (single(0.0, 0.0, (1.0, 1.0, 1.0)), "positive definite"),
        (single(0.0, 0.0, (1.0, 0.0, -1.0)), "positive definite"),
        (single(0.0, 0.0, (1.0, 0.0, np.inf)), "finite"),
        (single(0.0, 0.0, (1.0, 0.0, 1e30)), "variances must lie"),
    ],
)
def test_impossible_numbers_are_refused_with_the_reason(data: bytes, says: str) -> None:
    with pytest.raises(DecodeError, match=says):
        MixturePayload.decode(data)


def test_the_hand_made_messages_are_sound_but_for_their_fault() -> None:
    """The bytes above without what is wrong with each, read by hand from the layout."""
    wide = MixturePayload.decode(single(-3.0, 0.5, (2.0, 1.0, 3.0)))
    np.testing.assert_array_equal(wide.mixture.covs, [[[2.0, 1.0], [1.0, 3.0]]])
    np.testing.assert_array_equal(wide.mixture.means, [[0.5, 0.5]])
    assert (wide.cameras, wide.similarity, wide.mixture.log_mass) == ((0,), 0.5, -3.0)
    narrow = MixturePayload.decode(raw("uint8", b"\x01\x00\x01" + NARROW))
    np.testing.assert_array_equal(narrow.mixture.means, [[1.0, 1.0]])
    np.testing.assert_allclose(narrow.mixture.covs, [np.eye(2)], rtol=1e-12)
    assert (narrow.cameras, narrow.similarity, narrow.mixture.log_mass) == ((0,), 1.0, 0.0)
