"""The baseline that reads nothing on the mote: whole frames as JPEG files, and what making them costs.

The bytes are real: an encoder of the usual kind makes them from the frame. The work is that of a baseline
encoder in integers (sequential, Huffman, 8 × 8 blocks, chroma at half the resolution), counted from its
loops. What is left out: tables of Huffman codes that are fitted to the image.

References
----------
ITU-T T.81 (1992), Digital compression and coding of continuous-tone still images.
Arai, Agui, Nakajima (1988), A fast DCT-SQ scheme for images, Transactions of the IEICE E71(11): an
8-point transform in 5 multiplications and 29 additions, its scale left to the quantisation.
"""

import warnings
from io import BytesIO

import numpy as np

from wsnsim.errors import DecodeError
from wsnsim.hardware.work import Work
from wsnsim.types import ByteArray

_COLOUR_OPS = 18.0
"""A pixel: three sums of three products (9 + 6) and a shift each (3) (JFIF 1.02, conversion from RGB)."""
_HALVING_OPS = 2.0
"""A pixel: four values of two chroma channels become one (3 additions and a shift), over four pixels."""
_SAMPLES_PER_PIXEL = 1.5
"""Brightness at every pixel, two chroma channels at every fourth."""
_DCT_OPS = 16.0 * (5.0 + 29.0) / 64.0
"""A sample: eight rows and eight columns of a block."""
_QUANTISE_OPS = 4.0
"""A sample: sign, product with the reciprocal of the step, rounding, shift."""
_SCAN_OPS = 3.0
"""A sample: zigzag look-up, comparison with 0, length of the run."""
_BYTE_OPS = 40.0
"""A byte of the file, about two symbols: size category, code look-up, two shifts into the bit buffer each."""
_MEMORY_BYTES = 3.0 + 3.0 * 2.0 * _SAMPLES_PER_PIXEL
"""A pixel is read once, its samples are written as 16 bits, transformed in place, and read again."""


def compressed(image: ByteArray, quality: int) -> tuple[bytes, Work]:
    """Return an image's JPEG file and the work of making it on a mote.

    Parameters
    ----------
    image : (h, w, 3) - RGB
    quality : of the tables of ITU-T T.81, Annex K, as libjpeg scales them, 1–95 [-]

    Raises
    ------
    ValueError : the quality is out of range, or the image is not 8-bit RGB
    """
    from PIL import Image

    if not 1 <= quality <= 95:
        raise ValueError(f"quality: must be 1 to 95, got {quality}")
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        raise ValueError(f"image: must be (h, w, 3) uint8, got {image.shape} {image.dtype}")
    file = BytesIO()
    Image.fromarray(image).save(file, "JPEG", quality=quality, subsampling="4:2:0")
    data = file.getvalue()
    return data, coding_work(image.shape[0] * image.shape[1], len(data))


def opened(data: bytes, resolution_px: tuple[int, int]) -> ByteArray:
    """Return the image (h, w, 3) in a JPEG file.

    Parameters
    ----------
    data : the file
    resolution_px : (width, height) that the image must have: a damaged file may tell another [px]

    Raises
    ------
    DecodeError : the file is cut short, damaged, or no JPEG file, or its image has another resolution
    """
    from PIL import Image

    with warnings.catch_warnings():
        # the size is refused below
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            with Image.open(BytesIO(data), formats=("JPEG",)) as picture:
                if picture.size == resolution_px:
                    return np.array(picture.convert("RGB"), dtype=np.uint8)
                found = picture.size
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            # Pillow has no one exception for files that are damaged
            raise DecodeError(f"jpeg: {len(data)} bytes must be a whole JPEG file: {error}") from error
    raise DecodeError(f"jpeg: the image must have {resolution_px} px, got {found}")


def coding_work(pixels: int, size_bytes: int) -> Work:
    """Return the work of encoding an image of so many pixels into a file, or of decoding it, its mirror."""
    samples = _SAMPLES_PER_PIXEL * pixels
    return Work(
        int_ops=(_COLOUR_OPS + _HALVING_OPS) * pixels
        + (_DCT_OPS + _QUANTISE_OPS + _SCAN_OPS) * samples
        + _BYTE_OPS * size_bytes,
        memory_bytes=_MEMORY_BYTES * pixels + size_bytes,
    )
