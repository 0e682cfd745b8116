"""Messages of mixtures: what each encoding may lose, for shapes round as a ball and thin as a needle."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.mixture import MixturePayload, mixture_bytes
from wsnsim.messages.numbers import ENCODINGS, Encoding, quantum

DTYPES = {"float64": np.float64, "float32": np.float32, "float16": np.float16}
HALF_WIDTH = {"float32": 2.0**-24, "float16": 2.0**-11, "uint8": 1 / 40}
"""Half a step of the logarithm of a width."""
HALF_LEAN = {"float32": 2.0**-14, "float16": 1 / 64, "uint8": 1 / 64}
"""Half a step of a lean up to 1000."""

encodings = st.sampled_from(ENCODINGS)
narrow = st.sampled_from(ENCODINGS[1:])
seeds = st.integers(0, 2**32 - 1)


def covariances(rng: np.random.Generator, order: int, dimension: int, aspect: float) -> np.ndarray:
    """Ellipsoids turned any way, each `aspect` times as long as it is thin, up to 2 long."""
    sds = np.exp(rng.uniform(-np.log(aspect), 0.0, (order, dimension)))
    sds[:, 0], sds[:, -1] = 1.0 / aspect, 1.0
    sds *= np.exp(rng.uniform(min(np.log(1e-3 * aspect), 0.0), np.log(2.0), (order, 1)))
    axes = np.linalg.qr(rng.standard_normal((order, dimension, dimension)))[0]
    covs = (axes * sds[:, None, :] ** 2) @ axes.transpose(0, 2, 1)
    return 0.5 * (covs + covs.transpose(0, 2, 1))


@st.composite
def messages(
    draw: st.DrawFn, encodings: st.SearchStrategy[Encoding] = encodings, aspects: float = 900.0
) -> MixturePayload:
    rng = np.random.default_rng(draw(seeds))
    order, dimension = draw(st.integers(1, 8)), draw(st.sampled_from([2, 3]))
    aspect = float(np.exp(draw(st.floats(0.0, np.log(aspects)))))
    density = GaussianMixture(
        draw(st.floats(-6e4, 100.0)) - rng.exponential(3.0, order),
        1.5 * rng.standard_normal((order, dimension)),
        covariances(rng, order, dimension, aspect),
    )
    cameras = tuple(sorted(draw(st.sets(st.integers(0, 255), min_size=1, max_size=10))))
    numbers = draw(st.sampled_from([0, 3, 4]))
    silent = draw(st.integers(0, len(cameras) - 1)) if draw(st.booleans()) else None
    facings = tuple(
        np.empty(0) if place == silent else rng.uniform(-1.0, 1.0, numbers) for place in range(len(cameras))
    )
    return MixturePayload(3, 9, density, cameras, float(rng.uniform()), facings, draw(encodings))


def half_spacing(values: np.ndarray, encoding: Encoding) -> np.ndarray:
    return 0.5 * np.spacing(np.abs(values).astype(DTYPES[encoding])).astype(np.float64)


def divergences(covs: np.ndarray, arrived: np.ndarray) -> np.ndarray:
    """Return KL(N(0, covs) ‖ N(0, arrived)) of each pair [nats]."""
    ratios = np.linalg.solve(np.linalg.cholesky(arrived), np.linalg.cholesky(covs))
    logs = np.log(np.diagonal(ratios, axis1=1, axis2=2)).sum(axis=1)
    return 0.5 * ((ratios**2).sum(axis=(1, 2)) - covs.shape[1]) - logs


@given(messages())
def test_names_weights_and_means_come_back_within_half_a_quantum(sent: MixturePayload) -> None:
    back = MixturePayload.decode(sent.encode())
    encoding = sent.encoding
    assert (back.target, back.step, back.cameras, back.encoding) == (3, 9, sent.cameras, encoding)
    said, heard = (np.array([p.similarity, *np.concatenate(p.facings)]) for p in (sent, back))
    assert [facing.size for facing in back.facings] == [facing.size for facing in sent.facings]
    assert (np.abs(heard - said) <= (1 / 254 if encoding == "uint8" else half_spacing(said, encoding))).all()
    means = sent.mixture.means
    half = 0.5 * quantum(means) if encoding == "uint8" else half_spacing(means, encoding)
    assert (np.abs(back.mixture.means - means) <= half).all()
    logs, largest = sent.mixture.log_weights, sent.mixture.log_weights.max()
    if encoding in ("float64", "float32"):
        assert (np.abs(back.mixture.log_weights - logs) <= half_spacing(logs, encoding)).all()
        return
    top = back.mixture.log_weights.max()
    assert abs(top - largest) <= half_spacing(np.array(largest), "float16")
    below = np.maximum(logs - largest, -12.75 if encoding == "uint8" else -np.inf)
    half = 1 / 40 if encoding == "uint8" else half_spacing(below, encoding)
    assert (np.abs(back.mixture.log_weights - top - below) <= half + 1e-10).all()


@given(messages(narrow))
def test_what_a_covariance_loses_does_not_depend_on_its_shape(sent: MixturePayload) -> None:
    """By the chain rule: ½(e^2δ − 1 − 2δ) a width and ½δ² a lean, with δ half of their steps."""
    covs, arrived = sent.mixture.covs, MixturePayload.decode(sent.encode()).mixture.covs
    dimension, width, lean = covs.shape[1], HALF_WIDTH[sent.encoding], HALF_LEAN[sent.encoding]
    leans = dimension * (dimension - 1) / 2
    bound = dimension * 0.5 * (np.expm1(2 * width) - 2 * width) + leans * 0.5 * lean**2 * np.exp(2 * width)
    # rounding of this test's own arithmetic: the condition number is the square of the aspect ratio
    assert (divergences(covs, arrived) <= bound * (1 + 1e-6) + 1e-8).all()


@given(messages(st.just("uint8")), seeds)
def test_8_bits_keep_every_width_within_5_percent(sent: MixturePayload, seed: int) -> None:
    """In any direction, the thinnest too: 2.5 % of a coordinate's width, and what leans add."""
    covs, arrived = sent.mixture.covs, MixturePayload.decode(sent.encode()).mixture.covs
    directions = np.linalg.eigh(covs)[1].transpose(0, 2, 1)
    drawn = np.random.default_rng(seed).standard_normal((len(covs), 20, covs.shape[1]))
    directions = np.concatenate([directions, drawn], axis=1)
    before, after = (np.einsum("kni,kij,knj->kn", directions, of, directions) for of in (covs, arrived))
    assert (np.abs(0.5 * np.log(after / before)) <= 0.05).all()


@given(messages(narrow, aspects=1e6))
def test_a_decoded_covariance_is_positive_definite_and_as_long_as_it_was(sent: MixturePayload) -> None:
    """Thinner than a message can tell, it comes back thicker, not shorter and not turned."""
    covs, arrived = sent.mixture.covs, MixturePayload.decode(sent.encode()).mixture.covs
    np.testing.assert_array_equal(arrived, arrived.transpose(0, 2, 1))
    np.linalg.cholesky(arrived)
    variances, axes = np.linalg.eigh(covs)
    along = axes[:, :, -1]
    after = np.einsum("ki,kij,kj->k", along, arrived, along)
    np.testing.assert_allclose(after, variances[:, -1], rtol=0.06)


@given(messages(aspects=1e3))
@settings(max_examples=200)
def test_what_was_decoded_is_encoded_to_the_same_bytes(sent: MixturePayload) -> None:
    """A relay that passes on what it heard does not round again."""
    data = sent.encode()
    assert MixturePayload.decode(data).encode() == data


@given(messages())
def test_the_size_is_known_before_the_message(sent: MixturePayload) -> None:
    numbers = max(facing.size for facing in sent.facings)
    full = replace(sent, facings=(np.full(numbers, 0.5),) * len(sent.cameras))
    density = sent.mixture
    size = mixture_bytes(density.order, density.dimension, sent.cameras, numbers, sent.encoding)
    assert len(full.encode()) == size
    # a camera that says nothing of the orientation saves its numbers
    each = np.dtype(DTYPES.get(sent.encoding, np.uint8)).itemsize
    silent = sum(facing.size == 0 for facing in sent.facings) if numbers else 0
    assert len(sent.encode()) == size - silent * numbers * each
