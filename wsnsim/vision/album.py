"""Albums: pictures of a target that a user took, each with where the camera stood.

An album is a CSV file beside its pictures. Its header names the columns `file`,
`x_m`, `y_m`, `z_m` and `focal_px`, and if some are turned `roll_deg`; others are
ignored, and so are blank lines and what follows a `#`. A row is one picture: the
camera stood at (x, y, z) in the target's own axes and looked at its centre, with the
target's z upwards in the picture (a camera straight above or below it has the target's
x to its right), or rolled about its optical axis, clockwise as seen from behind it.

Pictures are taken as they come from a pinhole camera whose axis meets the middle: cut
nothing off, and take a lens's distortion out first. They should show the target about
as large as the network's cameras will, for its texture changes with the distance.
"""

import csv
from collections.abc import Sequence
from math import atan2, cos, degrees, pi, radians, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wsnsim.errors import Problem
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines, outline_boxes
from wsnsim.geometry.rotations import IDENTITY, quaternion_to_matrix
from wsnsim.types import ByteArray, FloatArray
from wsnsim.vision.photos import read_picture
from wsnsim.vision.portrait import Portrait
from wsnsim.world.track_text import Row, content_rows, fail

LEAST_VIEWS = 6
"""Fewer leave a side of the target more than 55° from all of them (a cube's faces against its corners)."""

_NUMBERS = ("x_m", "y_m", "z_m", "focal_px")
_COLUMNS = ("file", *_NUMBERS)
_ROLL = "roll_deg"
_SAME_SIDE = cos(radians(10.0))
"""Cosine above which two pictures show the same side."""
_LEAST_AREA_PX = 100.0
"""A histogram of 110 bins from fewer pixels is mostly empty."""
_MOST_PIXELS = 1920 * 1080
_LEAST_ROLL_DEG = 1e-9
"""Less is rounding."""


class View(NamedTuple):
    """A picture of a target and the side it shows.

    Parameters
    ----------
    direction : (3,) - unit vector from the target's centre to the camera, in the target's axes
    portrait : the picture, of a target that stands unturned
    """

    direction: FloatArray
    portrait: Portrait


def read_album(
    path: Path | str, semi_axes_m: FloatArray, *, least_views: int = LEAST_VIEWS
) -> tuple[View, ...]:
    """Read the pictures of a target.

    Parameters
    ----------
    path : of the CSV file
    semi_axes_m : (3,) - of the ellipsoid that stands for the target [m]
    least_views : how many pictures there must be

    Raises
    ------
    ScenarioError : the file cannot be read or lacks a column, a value is not a finite number, a camera
        stands in the target or does not show all of it, a picture is missing, damaged, too small, too
        large or without colour, or there are too few; each problem with its line
    """
    file = Path(path)
    rows = content_rows(file)
    header = next(rows, None)
    if header is None:
        fail([Problem("", "must hold a header and a row for each picture, got an empty file", file)])
    columns = _columns(header, file)
    problems: list[Problem] = []
    views = [_view(row, columns, file, semi_axes_m, problems) for row in rows]
    if len(views) < least_views:
        message = f"must hold at least {least_views} pictures from different sides, got {len(views)}"
        problems.append(Problem("", message, file, header.line, 1))
    taken = tuple(view for view in views if view is not None)
    if not problems and _sides(taken) < least_views:
        message = f"must hold pictures from at least {least_views} sides, got {_sides(taken)} of them"
        problems.append(Problem("", message, file, header.line, 1))
    if problems:
        fail(problems)
    return taken


def album_pictures(path: Path | str) -> tuple[Path, ...]:
    """Return the picture files that an album names.

    Raises
    ------
    ScenarioError : the file cannot be read or does not name its columns
    """
    file = Path(path)
    rows = content_rows(file)
    header = next(rows, None)
    if header is None:
        return ()
    at = _columns(header, file)["file"]
    return tuple(file.parent / row.fields[at] for row in rows if at < len(row.fields))


def write_album(portraits: Sequence[Portrait], folder: Path | str) -> Path:
    """Write pictures of a target, and the CSV file that `read_album` takes.

    Parameters
    ----------
    portraits : each by a camera without distortion that looks at the target's centre
    folder : made if it does not exist; files of the same names in it are replaced

    Returns
    -------
    the CSV file

    Raises
    ------
    ValueError : a camera has distortion or looks elsewhere
    """
    from PIL import Image

    place = Path(folder)
    rows = [
        (f"view{number:02d}.png", *_pose(portrait), portrait.camera.focal_px)
        for number, portrait in enumerate(portraits, start=1)
    ]
    place.mkdir(parents=True, exist_ok=True)
    for (name, *_), portrait in zip(rows, portraits, strict=True):
        Image.fromarray(portrait.image).save(place / name)
    table = place / "album.csv"
    with table.open("w", encoding="utf-8", newline="") as opened:
        writer = csv.writer(opened, lineterminator="\n")
        writer.writerow(("file", "x_m", "y_m", "z_m", _ROLL, "focal_px"))
        writer.writerows(rows)
    return table


def _sides(views: tuple[View, ...]) -> int:
    """Count the directions that are no repetition of an earlier one."""
    sides: list[FloatArray] = []
    for view in views:
        if all(float(view.direction @ side) < _SAME_SIDE for side in sides):
            sides.append(view.direction)
    return len(sides)


def _columns(header: Row, file: Path) -> dict[str, int]:
    names = header.fields
    problems = [
        Problem("", f"the header must name {name!r} once, got {', '.join(names)}", file, header.line, 1)
        for name in (*_COLUMNS, _ROLL)
        if names.count(name) != 1 and (name in _COLUMNS or name in names)
    ]
    if problems:
        fail(problems)
    return {name: names.index(name) for name in (*_COLUMNS, _ROLL) if name in names}


def _view(
    row: Row, columns: dict[str, int], file: Path, semi_axes_m: FloatArray, problems: list[Problem]
) -> View | None:
    """Return the picture of one row, or None and more problems."""
    before = len(problems)

    def problem(column: str, message: str) -> None:
        place = row.column(columns[column])
        problems.append(Problem("", f"{column}: {message}", file, row.line, place))

    numbers = {
        name: row.number(name, index, file, problems) for name, index in columns.items() if name != "file"
    }
    if len(problems) > before:
        return None
    position, focal_px = np.array([numbers[name] for name in _NUMBERS[:3]]), numbers["focal_px"]
    if np.linalg.norm(position / semi_axes_m) <= 1.0:
        axes = ", ".join(f"{axis:g}" for axis in semi_axes_m)
        problem(
            "x_m",
            f"the camera must stand outside the target of semi-axes {axes}, got {position.tolist()} [m]",
        )
    if focal_px <= 0.0:
        problem("focal_px", f"must be above 0, got {focal_px:g} [px]")
    index = columns["file"]
    name = row.fields[index] if index < len(row.fields) else ""
    try:
        image = _picture(file.parent / name, name)
    except ValueError as error:
        problem("file", str(error))
    if len(problems) > before:
        return None
    camera = _camera(position, radians(numbers.get(_ROLL, 0.0)), focal_px, image)
    if (message := _unfit(camera, semi_axes_m)) is not None:
        problem("focal_px", message)
    return View(position / np.linalg.norm(position), Portrait(image, camera, IDENTITY))


def _picture(path: Path, name: str) -> ByteArray:
    """Read one picture in colour.

    Raises
    ------
    ValueError : it cannot be taken
    """
    if not name or not path.is_file():
        raise ValueError(f"must be a picture beside the album, got {name!r}, of which there is none")
    picture = read_picture(path)
    width, height = picture.size
    if width * height > _MOST_PIXELS:
        raise ValueError(
            f"must have at most 1920 x 1080 pixels in all, got {width} x {height}; "
            "make the picture and its focal_px smaller by one factor"
        )
    image = np.asarray(picture, dtype=np.uint8)
    if np.array_equal(image[..., 0], image[..., 1]) and np.array_equal(image[..., 1], image[..., 2]):
        raise ValueError(f"must have colours, from which the target is learned, got {name!r} in grey")
    return image


def _unfit(camera: PinholeCamera, semi_axes_m: FloatArray) -> str | None:
    """Return why nothing can be learned from what a camera shows, or None."""
    width, height = camera.resolution_px
    outline = ellipsoid_outlines(camera, np.zeros((1, 3)), IDENTITY, semi_axes_m)
    size = f"a picture of {width} x {height} px"
    if not outline.visible[0]:
        return "the camera must stand before the whole target, got a part of it beside or behind the lens"
    # the outermost pixels count as cut off: what they show may go on beyond them
    x0, y0, x1, y1 = outline_boxes(outline, width, height)[0]
    if x0 < 1 or y0 < 1 or x1 > width - 1 or y1 > height - 1:
        return f"the picture must show the whole target, got {camera.focal_px:g} px and {size}, which cuts it"
    area = pi / float(np.sqrt(np.linalg.det(outline.shapes[0])))
    if area < _LEAST_AREA_PX:
        return f"the target must fill at least {_LEAST_AREA_PX:g} pixels, got {area:.0f} in {size}"
    return None


def _camera(position: FloatArray, roll_rad: float, focal_px: float, image: ByteArray) -> PinholeCamera:
    """Return the camera at `position`, which looks at the origin, rolled about its optical axis."""
    height, width, _ = image.shape
    level = PinholeCamera.look_at(position, np.zeros(3), focal_px, (width, height))
    if roll_rad == 0.0:
        return level
    right, down, forward = level.rotation
    turned = (
        cos(roll_rad) * right + sin(roll_rad) * down,
        cos(roll_rad) * down - sin(roll_rad) * right,
        forward,
    )
    return PinholeCamera(focal_px, (width, height), np.stack(turned), level.position)


def _pose(portrait: Portrait) -> tuple[float, float, float, float]:
    """Return where a portrait's camera stands in the target's axes [m], and its roll [deg]."""
    camera, to_world = portrait.camera, quaternion_to_matrix(portrait.orientation)
    if any(camera.distortion):
        raise ValueError(f"camera: must have no distortion, got {list(camera.distortion)}")
    position = to_world.T @ camera.position
    rotation = camera.rotation @ to_world
    level = PinholeCamera.look_at(position, np.zeros(3), camera.focal_px, camera.resolution_px).rotation
    if not np.allclose(rotation[2], level[2], rtol=0.0, atol=1e-6):
        raise ValueError(f"camera: must look at the target's centre, got {rotation[2].tolist()}")
    roll = degrees(atan2(float(rotation[0] @ level[1]), float(rotation[0] @ level[0])))
    if abs(roll) < _LEAST_ROLL_DEG:
        roll = 0.0
    x, y, z = (float(part) for part in position)
    return x, y, z, roll
