"""Recorded images stand in the page with the outlines of truth and estimate where a camera shows them."""

import dataclasses
import re
from base64 import b64decode
from io import BytesIO

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines
from wsnsim.report.context import ReportContext
from wsnsim.report.images import gallery, rim
from wsnsim.report.page import render
from wsnsim.sim.recording import png_bytes

SEMI_AXES_M = np.array([0.4, 0.28, 0.34])


def images(cameras, steps):
    rows = [
        (step / 4, step, camera, png_bytes(np.full((240, 320, 3), 10 * number, dtype=np.uint8)))
        for step in steps
        for number, camera in enumerate(cameras)
    ]
    return pd.DataFrame(rows, columns=["time_s", "step", "camera", "png"])


@pytest.fixture
def make_context(synthetic_run):
    def make(frame, **run_options):
        run = synthetic_run(**run_options)
        targets = run.tables["steps"]["target"].unique()
        return ReportContext(
            name="demo", seed=4, system="tracker", citation="", standard="IEEE 802.15.4", size_m=run.size_m,
            cameras=run.cameras, tables={**run.tables, "images": frame}, summary=run.summary,
            lost_above_m=1.6, semi_axes_m=dict.fromkeys(targets, SEMI_AXES_M),
        )  # fmt: skip

    return make


def test_cameras_stand_below_each_other_and_steps_beside(make_context):
    found = gallery(make_context(images(["c2", "c1"], [1, 10, 20])))
    assert found.heads == ("step 1, 0.25 s", "step 10, 2.50 s", "step 20, 5.00 s")
    assert [name for name, _ in found.rows] == ["c1", "c2"]
    assert all(picture is not None for _, pictures in found.rows for picture in pictures)


def test_a_frame_that_was_not_taken_leaves_a_gap_that_is_told(make_context):
    frame = images(["c1", "c2"], [1, 10]).iloc[:3]
    context = make_context(frame)
    (_, first), (_, second) = gallery(context).rows
    assert [picture is None for picture in (*first, *second)] == [False, False, False, True]
    assert render(context).count("no image taken") == 1


def test_many_images_are_thinned_and_that_is_told(make_context):
    found = gallery(make_context(images(["c1"], range(1, 37))))
    assert "6 images of 36; all are in results.sqlite." in found.caption.replace("\u202f", " ")
    steps = [int(re.match(r"step (\d+)", head)[1]) for head in found.heads]
    assert steps == [1, 8, 15, 22, 29, 36]


def test_without_images_there_is_no_section(make_context):
    context = make_context(images([], []))
    assert gallery(context) is None
    assert "Images with the estimate" not in render(context)


def outline_of(path):
    return np.array([[float(v) for v in pair.split()] for pair in path[1:-1].split("L")])


def test_the_outlines_are_those_of_the_ellipsoid_at_truth_and_estimate(make_context):
    """Against the dual conic: every corner of the path lies on the ellipse."""
    context = make_context(images(["c3"], [7]))
    ((_, (picture,)),) = gallery(context).rows
    row = context.tables["steps"].query("step == 7").iloc[0]
    assert [outline.kind for outline in picture.outlines] == ["true", "believed"]
    for outline, whose in zip(picture.outlines, ("truth", "estimate"), strict=True):
        position = row[[f"{whose}_{axis}_m" for axis in "xyz"]].to_numpy(float)
        orientation = row[[f"{whose}_q{part}" for part in "wxyz"]].to_numpy(float)
        conic = ellipsoid_outlines(context.cameras["c3"], position[None], orientation, SEMI_AXES_M)
        apart = outline_of(outline.path) - conic.centres[0]
        radius_px = np.sqrt(1 / np.linalg.eigvalsh(conic.shapes[0]).max())
        on_rim = np.sqrt(np.einsum("ni,ij,nj->n", apart, conic.shapes[0], apart))
        # corners are written to a tenth of a pixel
        assert np.abs(on_rim - 1).max() < 0.08 / radius_px
    assert "the estimate is" in picture.words


def test_a_sight_line_to_the_rim_touches_the_ellipsoid():
    eye, position = np.array([4.0, -1.0, 2.0]), np.array([0.5, 0.2, 0.3])
    points = rim(eye, position, np.array([1.0, 0, 0, 0]), SEMI_AXES_M)
    on_unit = (points - position) / SEMI_AXES_M
    assert np.allclose((on_unit**2).sum(axis=1), 1.0)
    # tangent: the normal (gradient) is square to the sight line
    assert np.allclose(np.einsum("ni,ni->n", on_unit / SEMI_AXES_M, points - eye), 0.0, atol=1e-12)
    assert len(rim(position + 0.1, position, np.array([1.0, 0, 0, 0]), SEMI_AXES_M)) == 0
    assert len(rim(eye, np.full(3, np.nan), np.array([1.0, 0, 0, 0]), SEMI_AXES_M)) == 0


def test_what_is_behind_the_camera_has_no_outline_and_is_told_so(make_context):
    context = make_context(images(["c1"], [1]))
    away = PinholeCamera.look_at((0.0, 0.0, 3.0), (-6.0, -4.0, 3.0), 300.0, (320, 240))
    turned = dataclasses.replace(context, cameras={**context.cameras, "c1": away})
    ((_, (picture,)),) = gallery(turned).rows
    assert picture.outlines == ()
    assert "Target box is outside of it." in picture.words


def test_the_page_holds_the_pictures_themselves_in_small(make_context):
    context = make_context(images(["c1", "c2"], [1, 10]))
    page = render(context)
    found = re.findall(r'<image href="data:image/jpeg;base64,([^"]+)"', page)
    assert len(found) == 4
    with Image.open(BytesIO(b64decode(found[1]))) as picture:
        assert picture.size == (320, 240)
    assert page.count('class="believed"') == page.count('class="true"') == 4
    assert render(context) == page


def test_a_large_image_is_made_smaller_and_its_outlines_stay_in_its_own_pixels(make_context):
    frame = images(["c1"], [1])
    frame.loc[0, "png"] = png_bytes(np.zeros((960, 1280, 3), dtype=np.uint8))
    context = make_context(frame)
    large = PinholeCamera.look_at((0.0, 0.0, 3.0), (6.0, 4.5, 1.0), 1200.0, (1280, 960))
    context = dataclasses.replace(context, cameras={**context.cameras, "c1": large})
    ((_, (picture,)),) = gallery(context).rows
    assert (picture.width, picture.height) == (1280, 960)
    with Image.open(BytesIO(b64decode(picture.address.partition(",")[2]))) as shown:
        assert shown.size == (480, 360)
