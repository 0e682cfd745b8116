"""Photographs as backgrounds: four that come with the package, and the user's own.

Authors and licences of the four stand in `photos/CREDITS.md`.
"""

from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wsnsim.types import ByteArray

if TYPE_CHECKING:
    from PIL import Image

PHOTO_NAMES = ("photo/china", "photo/coffee", "photo/flower", "photo/gravel")
"""Names of the photographs that come with the package."""

_FOLDER = Path(__file__).with_name("photos")
_PREFIX = "photo/"


def load_background(name_or_path: str | Path, resolution_px: tuple[int, int]) -> ByteArray:
    """Return a photograph in a camera's resolution.

    The largest part in the middle that has the camera's aspect is cut out and resized.
    Grey pictures become RGB with three equal channels; transparency is ignored.

    Parameters
    ----------
    name_or_path : one of `PHOTO_NAMES`, or the path of an image file that Pillow reads
    resolution_px : (width, height) [px]

    Returns
    -------
    (h, w, 3) - RGB

    Raises
    ------
    ValueError : the name is not known, or the file is missing, damaged, or no image of 8 bits a channel
    """
    return fitted(read_picture(_locate(name_or_path)), resolution_px)


def fitted(picture: "Image.Image", resolution_px: tuple[int, int]) -> ByteArray:
    """Return the largest part in the middle of an RGB picture that has an image's aspect, resized.

    Parameters
    ----------
    picture : of mode RGB
    resolution_px : (width, height) [px]

    Returns
    -------
    (h, w, 3) - RGB
    """
    from PIL import ImageOps
    from PIL.Image import Resampling

    return np.array(ImageOps.fit(picture, resolution_px, Resampling.LANCZOS), dtype=np.uint8)


def _locate(name_or_path: str | Path) -> Path:
    name = name_or_path.as_posix() if isinstance(name_or_path, Path) else name_or_path
    if name in PHOTO_NAMES:
        return _FOLDER / f"{name.removeprefix(_PREFIX)}.jpg"
    path = Path(name_or_path)
    if path.is_file():
        return path
    known = ", ".join(PHOTO_NAMES)
    guess = get_close_matches(name, PHOTO_NAMES, n=1)
    hint = f"; did you mean {guess[0]!r}?" if guess else ""
    raise ValueError(f"a photograph must be one of {known} or an image file that exists, got {name!r}{hint}")


def read_picture(path: Path) -> "Image.Image":
    """Return the picture in `path`, turned upright, as RGB."""
    from PIL import Image, ImageOps

    try:
        with Image.open(path) as opened:
            picture = ImageOps.exif_transpose(opened)
        if picture.mode.startswith(("I", "F")):
            raise ValueError(
                f"a photograph must have 8 bits a channel, {path} is of Pillow's mode {picture.mode!r}"
            )
        return picture.convert("RGB")
    except (OSError, SyntaxError, EOFError, Image.DecompressionBombError) as error:
        # Pillow reports a damaged PNG as SyntaxError.
        raise ValueError(f"a photograph must be an image file that can be read, {path}: {error}") from error
