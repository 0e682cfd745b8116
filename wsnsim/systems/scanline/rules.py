"""What the front end that looks at pixels lets a scenario choose."""

from typing import Literal

from pydantic import Field

from wsnsim.systems.scanline.choices import Section


class PixelFrontEnd(Section):
    """Scan lines from images: background subtraction, vertical sums, a threshold, blobs (Sec. 3)."""

    kind: Literal["pixels"] = Field(
        description="pixels: from the images, by background subtraction, vertical sums and a threshold"
    )
    pose_error: Literal["none", "bias"] = Field(
        "none",
        description="none: the cameras stand exactly where they are believed to; bias: the tracker's belief "
        "is off by one draw of the noise's position_sd_m and angle_sd_rad each",
    )
    foreground_sd: float = Field(
        4.5,
        ge=1,
        le=100,
        description="distance from the background in colour from which on a pixel is foreground, in standard "
        "deviations of its noise [-]",
    )
    learning_rate: float = Field(
        0.05, ge=0, le=1, description="share of a frame in the background's running average [-]"
    )
    column_px: int = Field(
        6, ge=1, le=10_000, description="foreground pixels that make a column part of a blob [px]"
    )
    gap_px: float = Field(2.0, ge=0, le=1000, description="blobs that are closer become one [px]")
    width_px: float = Field(2.0, ge=0, le=1000, description="narrower blobs are left out [px]")
    colour_share: float = Field(
        0.02,
        ge=0,
        le=1,
        description="colours that less of the object than this has from any side are not taken for its own "
        "[-]",
    )
    colour_ratio: float = Field(
        0.5,
        gt=0,
        le=100,
        description="a foreground pixel is the object's if its colour is so many times as frequent on "
        "the object as in the whole foreground [-]",
    )
    object_share: float = Field(
        0.5,
        ge=0,
        le=1,
        description="share of a column's foreground that must have the object's colours for the column to be "
        "the object's [-]",
    )
    object_column_px: int = Field(
        6, ge=1, le=10_000, description="such pixels that a column of the object must have [px]"
    )
    object_px: int = Field(
        30,
        ge=1,
        le=1_000_000,
        description="such pixels from which on the object counts as seen, if three columns side by side have "
        "them, and four tenths of the width that goes with its height [px]",
    )
