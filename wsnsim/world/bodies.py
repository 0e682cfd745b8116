"""What a target, a person or a piece of the room is: a simple solid with coloured patches painted on it.

Left out: limbs, articulated motion, gloss. The texture is fixed to the body and
turns with it, so that the body looks different from every side.
"""

import colorsys
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, Self, TypeAlias

import numpy as np

from wsnsim.geometry.polygons import half_planes, is_convex
from wsnsim.types import FloatArray

Form: TypeAlias = Literal["ellipsoid", "box", "cylinder", "prism"]
"""A body's solid; in units of its semi-axes the unit ball, a cube of side 2, a unit cylinder along z, or
what has a convex polygon for its section at all z in ±1."""

_NO_SIDES = np.empty((0, 3))
_CANDIDATES = 10
"""Candidates for each patch centre; more gives patches of more equal size (Mitchell 1991)."""


@dataclass(frozen=True, eq=False)
class PatchTexture:
    """Voronoi patches of one colour each on the unit sphere.

    A surface point x of a body with semi-axes a lies in the direction x / a
    (component by component) and has the colour of the nearest patch centre.

    Parameters
    ----------
    centres : (p, 3) - unit vectors in body axes
    colours : (p, 3) - RGB [0–255]

    Raises
    ------
    ValueError : the shapes do not match, a centre is not of unit length or a colour is out of range
    """

    centres: FloatArray
    colours: FloatArray

    def __post_init__(self) -> None:
        if self.centres.ndim != 2 or self.centres.shape[1] != 3 or len(self.centres) < 1:
            raise ValueError(f"centres: must have shape (p, 3) with p at least 1, got {self.centres.shape}")
        if self.colours.shape != self.centres.shape:
            raise ValueError(f"colours: must have shape {self.centres.shape}, got {self.colours.shape}")
        if not np.allclose(np.linalg.norm(self.centres, axis=1), 1.0, rtol=0.0, atol=1e-9):
            raise ValueError("centres: must be unit vectors")
        if not ((self.colours >= 0.0) & (self.colours <= 255.0)).all():
            raise ValueError("colours: must lie in 0–255")

    @classmethod
    def plain(cls, colour: tuple[float, float, float]) -> Self:
        """Return one colour all over, RGB [0–255]."""
        return cls(np.array([[0.0, 0.0, 1.0]]), np.array([colour]))

    @classmethod
    def random(cls, generator: np.random.Generator, patches: int = 18, colours: int = 9) -> Self:
        """Return well-spread patches in well-separated colours, each of them used.

        The hues stand at equal distances round the colour circle from a random
        beginning; saturation is 0.65–0.95 and value 0.7–1.

        Parameters
        ----------
        generator : source of randomness
        patches : number of patches
        colours : number of colours

        Raises
        ------
        ValueError : not 1 ≤ colours ≤ patches
        """
        if not 1 <= colours <= patches:
            raise ValueError(f"colours: must be 1 to the number of patches {patches}, got {colours}")
        hues = generator.uniform() + np.arange(colours) / colours
        saturations = generator.uniform(0.65, 0.95, colours)
        values = generator.uniform(0.7, 1.0, colours)
        palette = 255.0 * np.array(
            [colorsys.hsv_to_rgb(h % 1.0, s, v) for h, s, v in zip(hues, saturations, values, strict=True)]
        )
        which = generator.permutation(np.arange(patches) % colours)
        return cls(_spread_directions(generator, patches), palette[which])


@dataclass(frozen=True, eq=False)
class Body:
    """Shape and surface of something solid.

    Parameters
    ----------
    semi_axes_m : (3,) - half extents along its own x, y, z [m]; a cylinder and a prism stand along z, and
        those of a prism's polygon are its greatest distances from the middle
    texture : painted on it
    form : which solid it is
    corners_m : (k, 2) - of a prism's polygon in body axes, in either order [m]; none for other forms

    Raises
    ------
    ValueError : a semi-axis is not above 0, or a prism's corners make no convex polygon
    """

    semi_axes_m: FloatArray
    texture: PatchTexture
    form: Form = "ellipsoid"
    corners_m: FloatArray = field(default_factory=lambda: np.empty((0, 2)))

    def __post_init__(self) -> None:
        axes = self.semi_axes_m
        if axes.shape != (3,) or not (np.isfinite(axes) & (axes > 0.0)).all():
            raise ValueError(f"semi_axes_m: must be three numbers above 0, got {axes.tolist()} [m]")
        if self.form == "prism" and not is_convex(self.corners_m):
            must = "must make a convex polygon with an area and no straight corner"
            raise ValueError(f"corners_m: {must}, got {self.corners_m.tolist()} [m]")

    @cached_property
    def side_planes(self) -> FloatArray:
        """Half-planes (k, 3) of a prism's sides in units of the semi-axes: inside where nx x + ny y ≤ c."""
        return half_planes((self.corners_m / self.semi_axes_m[:2],))[0] if self.form == "prism" else _NO_SIDES


def _spread_directions(generator: np.random.Generator, count: int) -> FloatArray:
    """Return `count` unit vectors (count, 3) that keep apart, by best candidates."""
    chosen = np.empty((count, 3))
    for i in range(count):
        candidates = generator.standard_normal((_CANDIDATES, 3))
        candidates /= np.linalg.norm(candidates, axis=1, keepdims=True)
        nearest = (candidates @ chosen[:i].T).max(axis=1, initial=-1.0)
        chosen[i] = candidates[nearest.argmin()]
    return chosen
