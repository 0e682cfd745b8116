"""What the nodes of the scan-line system say (Ercan, El Gamal & Guibas 2007): a few bytes a camera and frame.

Places in a scan line travel as shares of its half width and places on the floor as shares of the room, in
16 bits: what they are shares of, everybody knows. A frame is told by the lowest byte of its number; whoever
reads it knows which of those 256 steps apart is meant.
"""

import struct
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.types import FloatArray, IntArray

_FRONT = struct.Struct("<BB")
_LINE = "<i2"
_UNSEEN = -32_768
WIDEST = 1.25
"""Of a place in the scan line, in half widths: noise may put the object a little beside its end."""
_LINE_QUANTUM = WIDEST / 32_767.0
MOST_BLOBS = 255
"""In a scan line, whose number one byte tells."""
_ROOM = 65_535.0
_OCCLUDER = np.dtype([("id", "<u2"), ("place", "<u2", 2)])
_MOST_IDS = 65_536
_TRACK = struct.Struct("<HH5e")
_ENERGY = struct.Struct("<f")
_HEAD = struct.Struct("<HB")
_HANDOVER = struct.Struct("<5f")


def step_of(low_byte: int, latest: int) -> int:
    """Return which step a message is about, from the lowest byte of its number.

    Parameters
    ----------
    low_byte : as it came
    latest : the last step there can be yet; the answer is at most 255 steps earlier
    """
    return latest - (latest - low_byte) % 256


def step_near(low_byte: int, about: int) -> int:
    """Return the step with that lowest byte that is nearest to another: 128 earlier to 127 later."""
    return about - 128 + (low_byte - about + 128) % 256


@dataclass(frozen=True, eq=False)
class ScanLinePayload:
    """Where one camera sees the object, and with `blobs` its whole scan line.

    Parameters
    ----------
    step : lowest byte of the frame's number
    share : place of the object, as a share of the line's half width, up to 1.25 on either side; None where
        the camera does not see it
    blobs : (b, 2) - ends of all blobs, ascending; None: the message says nothing of them
    """

    step: int
    share: float | None
    blobs: FloatArray | None = None

    tag: ClassVar[int] = 0x20
    kind: ClassVar[str] = "scan_line"

    def encode(self) -> bytes:
        """Return 4 bytes, and 4 more for each blob behind a byte that is there with a whole line only.

        Raises
        ------
        EncodeError : a place outside the scan line
        """
        data = _FRONT.pack(self.tag, self.step) + _packed_line(
            np.array([np.nan if self.share is None else self.share])
        )
        if self.blobs is None:
            return data
        if len(self.blobs) > MOST_BLOBS:
            raise EncodeError(f"scan_line: must have at most {MOST_BLOBS} blobs, got {len(self.blobs)}")
        return data + bytes([len(self.blobs)]) + _packed_line(self.blobs.ravel())

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the scan line in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, or impossible numbers
        """
        step, body = _opened(data, cls.tag, cls.kind)
        if len(body) < 2:
            raise DecodeError(f"scan_line: the body must hold 2 bytes at least, got {len(body)}")
        (place,) = _unpacked_line(body[:2])
        share = None if np.isnan(place) else float(place)
        if len(body) == 2:
            return cls(step, share)
        count = body[2]
        if len(body) != 3 + 4 * count:
            raise DecodeError(f"scan_line: {count} blobs take {3 + 4 * count} bytes of body, got {len(body)}")
        blobs = _unpacked_line(body[3:]).reshape(-1, 2)
        if np.isnan(blobs).any() or (np.diff(blobs.ravel()) < 0.0).any():
            raise DecodeError("scan_line: the ends of blobs must ascend")
        return cls(step, share, blobs)


@dataclass(frozen=True, eq=False)
class PlacesPayload:
    """Measured places of some occluders, six bytes each.

    Parameters
    ----------
    step : lowest byte of the frame's number
    ids : (k,) - numbers of the occluders, below 65,536
    shares : (k, 2) - places as shares of the room's sides; what is beside the room is put on its side
    """

    step: int
    ids: IntArray
    shares: FloatArray

    tag: ClassVar[int] = 0x22
    kind: ClassVar[str] = "places"

    def encode(self) -> bytes:
        """Return 2 bytes, and 6 for each occluder.

        Raises
        ------
        EncodeError : a number that two bytes do not hold, or a place that is none
        """
        if not ((self.ids >= 0) & (self.ids < _MOST_IDS)).all():
            raise EncodeError(f"places: numbers must be 0 to {_MOST_IDS - 1}, got {self.ids.tolist()}")
        if not np.isfinite(self.shares).all():
            raise EncodeError(f"places: must be finite, got {self.shares.tolist()}")
        rows = np.empty(len(self.ids), _OCCLUDER)
        rows["id"] = self.ids
        rows["place"] = _room_codes(self.shares)
        return _FRONT.pack(self.tag, self.step) + rows.tobytes()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the places in `data`.

        Raises
        ------
        DecodeError : wrong tag or length
        """
        step, body = _opened(data, cls.tag, cls.kind)
        if len(body) % _OCCLUDER.itemsize:
            raise DecodeError(f"places: each takes {_OCCLUDER.itemsize} bytes, got a body of {len(body)}")
        rows = np.frombuffer(body, _OCCLUDER)
        return cls(step, rows["id"].astype(np.int64), rows["place"] / _ROOM)


@dataclass(frozen=True, eq=False)
class TrackPayload:
    """Where a cluster head believes the object, for the base station.

    Parameters
    ----------
    step : lowest byte of the frame's number
    shares : (2,) - the place as shares of the room's sides
    velocity : (2,) - in half precision [m/s]
    cov : (3,) - xx, xy and yy of the place's covariance, in half precision [m²]
    heard : how many cameras were heard
    """

    step: int
    shares: FloatArray
    velocity: FloatArray
    cov: FloatArray
    heard: int

    tag: ClassVar[int] = 0x23
    kind: ClassVar[str] = "track"

    def encode(self) -> bytes:
        """Return 17 bytes; a number too large for half precision is the largest that it has."""
        x, y = _room_codes(self.shares)
        largest = float(np.finfo(np.float16).max)
        halves = np.clip(np.concatenate([self.velocity, self.cov]), -largest, largest)
        body = _TRACK.pack(int(x), int(y), *(float(value) for value in halves))
        return _FRONT.pack(self.tag, self.step) + body + bytes([self.heard])

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the place in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, or numbers that are no velocity or covariance
        """
        step, body = _opened(data, cls.tag, cls.kind)
        if len(body) != _TRACK.size + 1:
            raise DecodeError(f"track: the body must hold {_TRACK.size + 1} bytes, got {len(body)}")
        x, y, *halves = _TRACK.unpack(body[:-1])
        velocity, cov = np.array(halves[:2]), np.array(halves[2:])
        if not np.isfinite(halves).all() or min(cov[0], cov[2]) < 0.0:
            raise DecodeError(f"track: must have a velocity and a covariance, got {halves}")
        return cls(step, np.array([x, y]) / _ROOM, velocity, cov, body[-1])


@dataclass(frozen=True)
class EnergyPayload:
    """What a mote's battery still holds.

    Parameters
    ----------
    election : lowest byte of its number
    left_j : infinite on mains [J]
    """

    election: int
    left_j: float

    tag: ClassVar[int] = 0x24
    kind: ClassVar[str] = "energy"

    def encode(self) -> bytes:
        """Return 6 bytes."""
        return _FRONT.pack(self.tag, self.election) + _ENERGY.pack(self.left_j)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the battery in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, or an energy that is none
        """
        election, body = _opened(data, cls.tag, cls.kind)
        if len(body) != _ENERGY.size:
            raise DecodeError(f"energy: the body must hold {_ENERGY.size} bytes, got {len(body)}")
        (left_j,) = _ENERGY.unpack(body)
        if not left_j >= 0.0:
            raise DecodeError(f"energy: must be at least 0, got {left_j} [J]")
        return cls(election, left_j)


@dataclass(frozen=True)
class HeadPayload:
    """Who is the cluster head from a frame on.

    Parameters
    ----------
    term : of office, counted in 8 bits
    head : number of the mote; the base station is the one after the last
    first : lowest byte of the number of the first frame that it takes
    """

    term: int
    head: int
    first: int

    tag: ClassVar[int] = 0x25
    kind: ClassVar[str] = "head"

    def encode(self) -> bytes:
        """Return 5 bytes."""
        return _FRONT.pack(self.tag, self.term) + _HEAD.pack(self.head, self.first)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the announcement in `data`.

        Raises
        ------
        DecodeError : wrong tag or length
        """
        term, body = _opened(data, cls.tag, cls.kind)
        if len(body) != _HEAD.size:
            raise DecodeError(f"head: the body must hold {_HEAD.size} bytes, got {len(body)}")
        return cls(term, *_HEAD.unpack(body))


@dataclass(frozen=True, eq=False)
class HandoverPayload:
    """What a head leaves to the next one: where the object is believed to be.

    Parameters
    ----------
    term : of office of the next one, counted in 8 bits
    place : (2,) - [m]
    cov : (3,) - xx, xy and yy of its covariance [m²]
    """

    term: int
    place: FloatArray
    cov: FloatArray = field(default_factory=lambda: np.zeros(3))

    tag: ClassVar[int] = 0x27
    kind: ClassVar[str] = "handover"

    def encode(self) -> bytes:
        """Return 22 bytes."""
        return _FRONT.pack(self.tag, self.term) + _HANDOVER.pack(*self.place, *self.cov)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the belief in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, or numbers that are no belief
        """
        term, body = _opened(data, cls.tag, cls.kind)
        if len(body) != _HANDOVER.size:
            raise DecodeError(f"handover: the body must hold {_HANDOVER.size} bytes, got {len(body)}")
        x, y, xx, xy, yy = _HANDOVER.unpack(body)
        if not np.isfinite([x, y, xx, xy, yy]).all() or min(xx, yy) < 0.0:
            raise DecodeError("handover: must be a place and a covariance")
        return cls(term, np.array([x, y]), np.array([xx, xy, yy]))


def _opened(data: bytes, tag: int, kind: str) -> tuple[int, memoryview]:
    """Return the byte behind the tag, and the rest."""
    if len(data) < _FRONT.size:
        raise DecodeError(f"{kind}: a message must hold {_FRONT.size} bytes at least, got {len(data)}")
    first, second = _FRONT.unpack_from(data)
    if first != tag:
        raise DecodeError(f"{kind}: the tag must be 0x{tag:02x}, got 0x{first:02x}")
    return second, memoryview(data)[_FRONT.size :]


def _packed_line(shares: FloatArray) -> bytes:
    """Encode places in a scan line (n,), NaN as unseen."""
    if not (np.abs(shares[~np.isnan(shares)]) <= WIDEST).all():
        raise EncodeError(f"scan_line: places must be within ±{WIDEST} half widths, got {shares.tolist()}")
    codes = np.where(np.isnan(shares), _UNSEEN, np.rint(np.nan_to_num(shares) / _LINE_QUANTUM))
    return codes.astype(_LINE).tobytes()


def _unpacked_line(data: memoryview) -> FloatArray:
    codes = np.frombuffer(data, _LINE)
    return np.where(codes == _UNSEEN, np.nan, codes * _LINE_QUANTUM)


def _room_codes(shares: FloatArray) -> IntArray:
    return np.rint(np.clip(shares, 0.0, 1.0) * _ROOM).astype(np.int64)
