"""Sets of small numbers as bit masks: bit n mod 8 of byte n div 8 says whether n is in."""

from collections.abc import Iterable


def bit_bytes(count: int) -> int:
    """Return how many bytes a mask of `count` bits takes."""
    return (count + 7) // 8


def pack_bits(members: Iterable[int], count: int) -> bytes:
    """Encode a set of numbers below `count`."""
    mask = sum(1 << member for member in members)
    return mask.to_bytes(bit_bytes(count), "little")


def unpack_bits(data: memoryview) -> tuple[int, ...]:
    """Return the numbers in the set, ascending."""
    mask = int.from_bytes(data, "little")
    return tuple(number for number in range(8 * len(data)) if mask >> number & 1)
