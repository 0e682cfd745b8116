"""Recorded images with the true and the estimated target drawn over them.

After Fig. 8 of Kushwaha & Koutsoukos (2013): cameras below each other, steps
beside each other, the estimate as a blue ellipse.
"""

from base64 import b64encode
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TypeVar

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import IDENTITY, quaternion_to_matrix
from wsnsim.report.context import ReportContext
from wsnsim.report.wording import length, plural
from wsnsim.types import FloatArray

_MOST_CAMERAS, _MOST_STEPS = 12, 6
"""Images shown: with more the page would be too large to mail."""

_WIDTH_PX, _QUALITY = 480, 80
"""Longer side of a shown image at most, and its JPEG quality: about 25 kB each."""

_CORNERS = 48
"""Corners of a drawn outline."""

T = TypeVar("T")


@dataclass(frozen=True)
class Outline:
    """The rim of a target as an image shows it.

    Parameters
    ----------
    kind : `true` or `believed`
    path : a closed line in the camera's pixels, as SVG writes it
    x, y : of the target's centre in the image [px]
    """

    kind: str
    path: str
    x: float
    y: float


@dataclass(frozen=True)
class Picture:
    """One image as it stands in the page.

    Parameters
    ----------
    address : the image itself, as a data URL
    width, height : of the camera's image, in whose pixels outlines are given [px]
    outlines : the true ones first
    words : what is to be seen, for those who cannot
    """

    address: str
    width: int
    height: int
    outlines: tuple[Outline, ...]
    words: str


@dataclass(frozen=True)
class Gallery:
    """Pictures by camera and step.

    Parameters
    ----------
    heads : a title for each column
    rows : name of a camera and its pictures, None where it took none
    caption : how to read it
    """

    heads: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Picture | None, ...]], ...]
    caption: str


def gallery(context: ReportContext) -> Gallery | None:
    """Return the recorded images to show, None where there are none."""
    images = context.tables.get("images")
    if images is None or images.empty:
        return None
    recorded = [name for name in context.cameras if (images["camera"] == name).any()]
    cameras = recorded[:_MOST_CAMERAS]
    steps = _spread(sorted(int(step) for step in images["step"].unique()), _MOST_STEPS)
    times = images.drop_duplicates("step").set_index("step")["time_s"]
    shown = images[images["camera"].isin(cameras) & images["step"].isin(steps)]
    files = {(row["camera"], int(row["step"])): row["png"] for row in shown.to_dict("records")}
    rows = tuple(
        (
            camera,
            tuple(
                _picture(context, camera, step, files[camera, step]) if (camera, step) in files else None
                for step in steps
            ),
        )
        for camera in cameras
    )
    heads = tuple(f"step {step}, {times[step]:.2f} s" for step in steps)
    return Gallery(heads, rows, _caption(context, len(files), len(images)))


def _caption(context: ReportContext, shown: int, recorded: int) -> str:
    several = context.tables["steps"]["target"].nunique() > 1
    sentences = [
        "Images as the motes' programs got them. Blue: the outline of "
        f"{'each' if several else 'the'} target at its estimated position; black and white dashes: its true "
        "outline."
    ]
    if context.scenery or context.walks or several:
        sentences.append("Outlines show through what hides a target.")
    if shown < recorded:
        sentences.append(f"{plural(shown, 'image')} of {recorded}; all are in results.sqlite.")
    return " ".join(sentences)


def _spread(values: Sequence[T], most: int) -> list[T]:
    """Return `most` of the values at equal distances, first and last among them."""
    places = np.linspace(0, len(values) - 1, min(len(values), most)).round().astype(int)
    return [values[place] for place in places]


def _picture(context: ReportContext, name: str, step: int, png: bytes) -> Picture:
    camera = context.cameras[name]
    steps = context.tables["steps"]
    rows = steps[steps["step"] == step]
    found: dict[str, list[Outline]] = {"true": [], "believed": []}
    words = [f"Image of camera {name} at step {step}."]
    for row in rows.to_dict("records"):
        semi_axes = context.semi_axes_m.get(str(row["target"]))
        if semi_axes is None:
            continue
        true = _outline("true", camera, _state(row, "truth"), semi_axes)
        believed = _outline("believed", camera, _state(row, "estimate"), semi_axes)
        found["true"] += [true] if true else []
        found["believed"] += [believed] if believed else []
        words.append(_told(str(row["target"]), camera, true, believed, float(row["error_m"])))
    width, height = camera.resolution_px
    return Picture(_address(png), width, height, (*found["true"], *found["believed"]), " ".join(words))


def _state(row: Mapping[Hashable, float], whose: str) -> tuple[FloatArray, FloatArray]:
    """Return position and orientation; the identity for a system that says nothing of orientations."""
    position = np.array([row[f"{whose}_{axis}_m"] for axis in "xyz"], dtype=np.float64)
    orientation = np.array([row[f"{whose}_q{part}"] for part in "wxyz"], dtype=np.float64)
    return position, orientation if np.isfinite(orientation).all() else IDENTITY


def _outline(
    kind: str, camera: PinholeCamera, state: tuple[FloatArray, FloatArray], semi_axes: FloatArray
) -> Outline | None:
    """Return the outline of an ellipsoid, None where the camera does not have all of it before it."""
    position, orientation = state
    points = rim(camera.position, position, orientation, semi_axes)
    pixels, _ = camera.project(np.vstack([points, position]))
    if len(points) == 0 or not np.isfinite(pixels).all():
        return None
    *corners, (x, y) = pixels.tolist()
    path = "M" + "L".join(f"{u:.1f} {v:.1f}" for u, v in corners) + "Z"
    return Outline(kind, path, x, y)


def rim(eye: FloatArray, position: FloatArray, orientation: FloatArray, semi_axes: FloatArray) -> FloatArray:
    """Return points of an ellipsoid where a sight line from `eye` touches it.

    In units of the semi-axes the ellipsoid is a ball, and the rim a circle on it
    in the plane of the points p with p · e = 1, e being the eye.

    Parameters
    ----------
    eye : (3,) - outside of the ellipsoid [m]
    position : (3,) - of its centre [m]
    orientation : (4,) - unit quaternion (w, x, y, z)
    semi_axes : (3,) - [m]

    Returns
    -------
    (n, 3) - in the world [m]; none where the eye is inside, or the position is missing
    """
    axes = quaternion_to_matrix(orientation) * semi_axes
    e = np.linalg.solve(axes, eye - position)
    distance = float(np.linalg.norm(e))
    if not distance > 1.0:
        return np.empty((0, 3))
    # two directions across the sight line, from the axis that is least along it
    across = np.cross(e, np.eye(3)[np.abs(e).argmin()])
    across /= np.linalg.norm(across)
    up = np.cross(e, across) / distance
    angles = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)[:, None]
    circle = np.cos(angles) * across + np.sin(angles) * up
    on_ball = e / distance**2 + np.sqrt(1.0 - distance**-2) * circle
    return np.asarray(position + on_ball @ axes.T, dtype=np.float64)


def _told(
    target: str, camera: PinholeCamera, true: Outline | None, believed: Outline | None, error_m: float
) -> str:
    if true is None or not _inside(camera, true):
        return f"Target {target} is outside of it."
    if believed is None or not _inside(camera, believed):
        return f"Target {target} is in it, its estimate is not."
    apart = np.hypot(true.x - believed.x, true.y - believed.y)
    return f"Target {target} is in it; the estimate is {apart:.0f} pixels, or {length(error_m)}, beside it."


def _inside(camera: PinholeCamera, outline: Outline) -> bool:
    width, height = camera.resolution_px
    return 0 <= outline.x < width and 0 <= outline.y < height


def _address(png: bytes) -> str:
    """Return an image as a data URL, as a JPEG no larger than needed."""
    from PIL import Image

    with Image.open(BytesIO(png)) as opened:
        picture = opened.convert("RGB")
    picture.thumbnail((_WIDTH_PX, _WIDTH_PX))
    file = BytesIO()
    picture.save(file, "JPEG", quality=_QUALITY)
    return "data:image/jpeg;base64," + b64encode(file.getvalue()).decode()
