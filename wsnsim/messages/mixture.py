"""A Gaussian mixture, the density of a target after the images of one or several cameras.

Kushwaha & Koutsoukos 2013, Secs. 5.1 and 5.2: 1 + d + d(d + 1)/2 numbers a component, 10 in three
dimensions, which are 80 bytes in float64. Means and covariances are in the coordinates
in which the step's prediction is N(0, I): all nodes know the prediction, a relay can
fuse without it, and 8 bits are bits of the prediction's standard deviation.

The weights are logarithms and say what the density integrates to, its log-mass. In float16
and 8 bits a logarithm such as -400 would leave nothing to tell the components
apart, so that the largest of them stands alone, a float16, in front of the differences from
it: float16s, or codes of 1/20 down to -12.75, where what lies below reads as that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.bits import bit_bytes, pack_bits, unpack_bits
from wsnsim.messages.factors import factor_bytes, pack_factors, unpack_factors
from wsnsim.messages.header import SIZE, pack_header, unpack_header
from wsnsim.messages.numbers import (
    Encoding,
    as_similarity,
    block_bytes,
    float_bytes,
    pack_block,
    pack_floats,
    pack_shares,
    unpack_block,
    unpack_floats,
    unpack_shares,
)
from wsnsim.messages.weights import FACING_NUMBERS
from wsnsim.types import FloatArray

_DIMENSIONS = (2, 3)
_LARGEST_NUMBER = 255
_FRONT = 2
"""Bytes that tell order and shape."""
_PLAIN = ("float64", "float32")
"""Encodings that hold a log weight as it is."""

_CODES_A_NAT = 20.0
_LARGEST_CODE = 255
_LARGEST_LOG = 65_504.0
"""The largest float16: a log weight of a narrow encoding ends there."""

_FARTHEST = 2.0**10
_LOUDEST = 2.0**30
_LEAST_VARIANCE, _LARGEST_VARIANCE = 2.0**-40, 2.0**20
"""Beyond these a density is no message of anybody, in float64 the mark of a flipped exponent; within them
no product of mixtures leaves the range of a float64."""


@dataclass(frozen=True, eq=False)
class MixturePayload:
    """What one camera saw, or what a relay made of several.

    Parameters
    ----------
    target : the target's number
    step : the step whose prediction gives the coordinates
    mixture : in two dimensions (an image) or three, with N(0, I), the prediction, in it exactly once
    cameras : (n,) numbers (0–255), ascending, of the cameras whose images are in the mixture
    similarity : of the best particle to the reference model [0–1]
    facings : one a camera, in their order: empty, or what it says of the orientation (see `WeightsPayload`);
        those that are not empty have the same number of numbers, 3 or 4
    encoding : of all numbers
    """

    target: int
    step: int
    mixture: GaussianMixture
    cameras: tuple[int, ...]
    similarity: float
    facings: tuple[FloatArray, ...]
    encoding: Encoding = "float64"

    tag: ClassVar[int] = 0x11
    kind: ClassVar[str] = "mixture"

    def encode(self) -> bytes:
        """Return header, cameras, shares and components: as many bytes as `mixture_bytes` says.

        Raises
        ------
        EncodeError : cameras, facings or numbers that are none of those above, or beyond any message
        """
        mixture, encoding = self.mixture, self.encoding
        if mixture.order > _LARGEST_NUMBER or mixture.dimension not in _DIMENSIONS:
            raise EncodeError(
                f"mixture: a message holds up to {_LARGEST_NUMBER} components of 2 or 3 dimensions, "
                f"got {mixture.order} of {mixture.dimension}"
            )
        fault = _fault(mixture)
        if fault:
            raise EncodeError(f"mixture: {fault}")
        cameras = _pack_cameras(self.cameras)
        numbers = self._facing_numbers()
        shape = (
            _DIMENSIONS.index(mixture.dimension)
            | FACING_NUMBERS.index(numbers) << 1
            | (len(cameras) - 1) << 3
        )
        telling = [place for place, facing in enumerate(self.facings) if facing.size]
        shares = np.concatenate([[self.similarity], *self.facings])
        return b"".join(
            [
                pack_header(self.tag, self.target, self.step, encoding),
                bytes([mixture.order, shape]),
                cameras,
                pack_bits(telling, len(self.cameras)) if numbers else b"",
                pack_shares(shares, encoding),
                _pack_log_weights(mixture.log_weights, encoding),
                pack_block(mixture.means.ravel(), encoding),
                _pack_covs(mixture.covs, encoding),
            ]
        )

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the mixture in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, or impossible numbers
        """
        target, step, encoding, body = unpack_header(data, cls.tag, cls.kind)
        layout, rest = _Layout.read(body, encoding)
        shares, log_weights, means, covs = layout.split(rest)
        said = unpack_shares(shares, encoding)
        try:
            mixture = GaussianMixture(
                _unpack_log_weights(log_weights, encoding),
                unpack_block(means, encoding).reshape(layout.order, layout.dimension),
                _unpack_covs(covs, layout.dimension, encoding),
            )
        except ValueError as error:
            raise DecodeError(str(error)) from error
        fault = _fault(mixture)
        if fault:
            raise DecodeError(f"mixture: {fault}")
        facings = [np.empty(0)] * len(layout.cameras)
        for place, facing in zip(layout.telling, said[1:].reshape(-1, max(layout.numbers, 1)), strict=True):
            facings[place] = facing
        return cls(target, step, mixture, layout.cameras, as_similarity(said[0]), tuple(facings), encoding)

    def _facing_numbers(self) -> int:
        """Return of how many numbers the facings are.

        Raises
        ------
        EncodeError : not one facing a camera, or of sizes that do not go together
        """
        if len(self.facings) != len(self.cameras):
            raise EncodeError(
                f"mixture: there must be one facing a camera, got {len(self.facings)} of {len(self.cameras)}"
            )
        sizes = {facing.size for facing in self.facings} - {0}
        if len(sizes) > 1 or not sizes <= set(FACING_NUMBERS):
            raise EncodeError(f"mixture: all facings must be of 3 or of 4 numbers, got {sorted(sizes)}")
        return max(sizes, default=0)


@dataclass(frozen=True)
class _Layout:
    """What the front of a message tells about the rest."""

    encoding: Encoding
    order: int
    dimension: int
    numbers: int
    """Of a facing; 0 where no camera says one."""
    cameras: tuple[int, ...]
    telling: tuple[int, ...]
    """Places in `cameras` of those with a facing."""

    @classmethod
    def read(cls, body: memoryview, encoding: Encoding) -> tuple[Self, memoryview]:
        """Return the layout and what stands behind it.

        Raises
        ------
        DecodeError : cut short, or a layout that nobody sends
        """
        if len(body) < _FRONT:
            raise DecodeError(f"mixture: the body must hold at least {_FRONT} bytes, got {len(body)}")
        order, shape = body[0], body[1]
        facing, mask_bytes = shape >> 1 & 3, (shape >> 3) + 1
        if order < 1 or facing >= len(FACING_NUMBERS):
            raise DecodeError(f"mixture: no message has the order {order} and the shape 0x{shape:02x}")
        mask, body = body[_FRONT : _FRONT + mask_bytes], body[_FRONT + mask_bytes :]
        cameras = unpack_bits(mask)
        if not cameras or cameras[-1] // 8 + 1 != mask_bytes:
            raise DecodeError("mixture: the last byte of the mask of cameras must hold the last of them")
        telling: tuple[int, ...] = ()
        if facing:
            telling_bytes = bit_bytes(len(cameras))
            telling, body = unpack_bits(body[:telling_bytes]), body[telling_bytes:]
            if not telling or telling[-1] >= len(cameras):
                raise DecodeError("mixture: a facing must be that of a camera in the message")
        return cls(encoding, order, _DIMENSIONS[shape & 1], FACING_NUMBERS[facing], cameras, telling), body

    def split(self, rest: memoryview) -> list[memoryview]:
        """Return the bytes of shares, log weights, means and covariances.

        Raises
        ------
        DecodeError : too few bytes, or too many
        """
        shares = 1 + self.numbers * len(self.telling)
        sizes = _sizes(self.order, self.dimension, shares, self.encoding)
        if len(rest) != sum(sizes):
            raise DecodeError(f"mixture: {sum(sizes)} bytes of numbers must follow, got {len(rest)}")
        ends = np.cumsum(sizes).tolist()
        return [rest[end - size : end] for size, end in zip(sizes, ends, strict=True)]


def mixture_bytes(
    order: int, dimension: int, cameras: Sequence[int], facing_numbers: int, encoding: Encoding
) -> int:
    """Return the size of a message before there is one [bytes].

    In float64 that is 17 and 80 a component for one of the first eight cameras without a
    facing; in 8 bits 13 and 13, and in an image 13 and 7.

    Parameters
    ----------
    order : number of components
    dimension : 2 or 3
    cameras : their numbers
    facing_numbers : of each camera: 0, 3 or 4
    """
    telling = bit_bytes(len(cameras)) if facing_numbers else 0
    shares = 1 + facing_numbers * len(cameras)
    front = SIZE + _FRONT + bit_bytes(max(cameras) + 1) + telling
    return front + sum(_sizes(order, dimension, shares, encoding))


def _sizes(order: int, dimension: int, shares: int, encoding: Encoding) -> tuple[int, int, int, int]:
    """Return what shares, log weights, means and covariances take [bytes]."""
    if encoding == "float64":
        covs = order * dimension * (dimension + 1) // 2 * float_bytes(encoding)
    else:
        covs = factor_bytes(order, dimension, encoding)
    return (
        shares * float_bytes(encoding),
        order * float_bytes(encoding) + (0 if encoding in _PLAIN else float_bytes("float16")),
        block_bytes(order * dimension, encoding),
        covs,
    )


def _fault(mixture: GaussianMixture) -> str:
    """Return what makes a mixture the message of nobody; nothing where it is sound."""
    variances = np.diagonal(mixture.covs, axis1=1, axis2=2)
    if not (np.abs(mixture.means) <= _FARTHEST).all():
        return f"means must lie within {_FARTHEST:g} standard deviations of the prediction"
    if not (np.abs(mixture.log_weights) <= _LOUDEST).all():
        return f"log weights must lie between -{_LOUDEST:g} and {_LOUDEST:g}"
    if not ((variances >= _LEAST_VARIANCE) & (variances <= _LARGEST_VARIANCE)).all():
        return f"variances must lie between {_LEAST_VARIANCE:g} and {_LARGEST_VARIANCE:g} of the prediction's"
    return ""


def _pack_cameras(cameras: tuple[int, ...]) -> bytes:
    if (
        not cameras
        or list(cameras) != sorted({*cameras})
        or not 0 <= cameras[0] <= cameras[-1] <= _LARGEST_NUMBER
    ):
        raise EncodeError(
            f"mixture: cameras must be numbers up to {_LARGEST_NUMBER}, one or more, ascending, got {cameras}"
        )
    return pack_bits(cameras, cameras[-1] + 1)


def _pack_log_weights(log_weights: FloatArray, encoding: Encoding) -> bytes:
    if encoding in _PLAIN:
        return pack_floats(log_weights, encoding)
    largest = log_weights.max()
    below = np.minimum(largest - log_weights, _LARGEST_LOG)
    front = pack_floats(np.clip([largest], -_LARGEST_LOG, _LARGEST_LOG), "float16")
    if encoding == "float16":
        return front + pack_floats(below, encoding)
    codes = np.minimum(np.rint(below * _CODES_A_NAT), _LARGEST_CODE)
    differences: bytes = codes.astype(np.uint8).tobytes()
    return front + differences


def _unpack_log_weights(data: memoryview, encoding: Encoding) -> FloatArray:
    if encoding in _PLAIN:
        return unpack_floats(data, encoding)
    front = float_bytes("float16")
    (largest,) = unpack_floats(data[:front], "float16")
    if encoding == "float16":
        below = unpack_floats(data[front:], encoding)
    else:
        below = np.frombuffer(data[front:], dtype=np.uint8) / _CODES_A_NAT
    if below.min() != 0.0:
        raise DecodeError("mixture: the largest log weight must be that in front")
    return np.asarray(largest - below, dtype=np.float64)


def _pack_covs(covs: FloatArray, encoding: Encoding) -> bytes:
    if encoding == "float64":
        rows, columns = np.tril_indices(covs.shape[1])
        return pack_floats(covs[:, rows, columns].ravel(), encoding)
    return pack_factors(np.asarray(np.linalg.cholesky(covs), dtype=np.float64), encoding)


def _unpack_covs(data: memoryview, dimension: int, encoding: Encoding) -> FloatArray:
    if encoding == "float64":
        rows, columns = np.tril_indices(dimension)
        numbers = unpack_floats(data, encoding).reshape(-1, rows.size)
        covs = np.empty((len(numbers), dimension, dimension))
        covs[:, rows, columns] = covs[:, columns, rows] = numbers
        return covs
    factors = unpack_factors(data, dimension, encoding)
    return factors @ factors.transpose(0, 2, 1)
