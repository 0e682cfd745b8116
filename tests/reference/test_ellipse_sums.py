"""Sums inside ellipses by prefix sums of the rows, against a plain sum over all pixels of the image."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.bench.twins import full_mask_sums
from wsnsim.geometry.quadrics import Outlines, outline_box
from wsnsim.kernels.ellipse_sums import ellipse_sums, log_ratio_scores

SEED = int(os.environ.get("WSNSIM_TEST_SEED", "0"))
WIDTH, HEIGHT = 96, 64


def random_outlines(generator, count, log_radius=(-1.0, 4.0)):
    """Ellipses of all sizes and directions, in, across and beyond the border of the image."""
    radii = np.exp(generator.uniform(*log_radius, (count, 2)))
    angles = generator.uniform(0.0, np.pi, count)
    turn = np.array([[np.cos(angles), -np.sin(angles)], [np.sin(angles), np.cos(angles)]]).transpose(2, 0, 1)
    shapes = turn @ (np.eye(2) / radii[:, None, :] ** 2) @ turn.transpose(0, 2, 1)
    centres = generator.uniform((-20.0, -20.0), (WIDTH + 20.0, HEIGHT + 20.0), (count, 2))
    return Outlines(centres, (shapes + shapes.transpose(0, 2, 1)) / 2, generator.uniform(size=count) < 0.9)


def fast(scores, outlines, box=(0, 0, WIDTH, HEIGHT)):
    x0, y0, x1, y1 = box
    region = scores[y0:y1, x0:x1]
    return np.array(
        ellipse_sums(region, x0, y0, WIDTH, HEIGHT, outlines.centres, outlines.shapes, outlines.visible)
    )


def one(x, y, first, second, skew=0.0):
    """Return one visible ellipse of semi-axes about `first` and `second`."""
    shape = np.array([[1 / first**2, skew / (first * second)], [skew / (first * second), 1 / second**2]])
    return Outlines(np.array([[x, y]]), shape[None], np.ones(1, np.bool_))


def test_equals_the_twin():
    generator = np.random.default_rng(SEED)
    scores = generator.normal(size=(HEIGHT, WIDTH))
    outlines = random_outlines(generator, 1500)
    expected, found = full_mask_sums(scores, outlines), fast(scores, outlines)
    # All three kinds must be there, or the comparison says little.
    inside = expected[2]
    assert min((inside == 1.0).sum(), (inside == 0.0).sum(), ((inside > 0) & (inside < 1)).sum()) > 100
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


@settings(max_examples=100, deadline=None)
@given(
    st.floats(-60.0, WIDTH + 60.0),
    st.floats(-60.0, HEIGHT + 60.0),
    st.floats(0.05, 60.0),
    st.floats(0.05, 60.0),
    st.floats(-0.95, 0.95),
)
def test_each_pixel_is_counted_once_or_not_at_all(x, y, first, second, skew):
    outlines = one(x, y, first, second, skew)
    sums, pixels, inside = fast(np.ones((HEIGHT, WIDTH)), outlines)[:, 0]
    assert sums == pixels
    assert 0.0 <= inside <= 1.0
    assert (inside > 0.0) == (pixels > 0)
    # A pixel on the outline itself falls on either side of it by rounding.
    v, u = np.mgrid[:HEIGHT, :WIDTH] - np.array([y, x])[:, None, None]
    a, b, c = outlines.shapes[0, 0, 0], outlines.shapes[0, 0, 1], outlines.shapes[0, 1, 1]
    distances = a * u * u + 2.0 * b * u * v + c * v * v
    assert (distances <= 1.0 - 1e-6).sum() <= pixels <= (distances <= 1.0 + 1e-6).sum()


@settings(max_examples=50, deadline=None)
@given(st.integers(10, 50), st.integers(10, 40), st.floats(3.0, 9.0), st.floats(-3.0, 3.0))
def test_sums_are_linear_in_the_scores(x, y, radius, factor):
    generator = np.random.default_rng(SEED + 1)
    first, second = generator.normal(size=(2, HEIGHT, WIDTH))
    outlines = one(x, y, radius, radius)
    expected = fast(first, outlines)[0] + factor * fast(second, outlines)[0]
    np.testing.assert_allclose(fast(first + factor * second, outlines)[0], expected, rtol=0.0, atol=1e-9)


def test_a_region_that_holds_the_ellipses_is_enough():
    generator = np.random.default_rng(SEED + 2)
    scores = generator.normal(size=(HEIGHT, WIDTH))
    outlines = random_outlines(generator, 40, (0.0, 2.0))
    outlines = Outlines(outlines.centres * 0.3 + [10.0, 20.0], outlines.shapes, outlines.visible)
    box = outline_box(outlines, WIDTH, HEIGHT)
    assert (box.x1 - box.x0) * (box.y1 - box.y0) < WIDTH * HEIGHT
    np.testing.assert_allclose(fast(scores, outlines, box), fast(scores, outlines), rtol=0, atol=1e-11)
    x0, y0, x1, y1 = box
    for smaller in ((x0 + 1, y0, x1, y1), (x0, y0 + 1, x1, y1), (x0, y0, x1 - 1, y1), (x0, y0, x1, y1 - 1)):
        with pytest.raises(ValueError, match="region: must hold the ellipses"):
            fast(scores, outlines, smaller)


@pytest.mark.parametrize(
    ("centre", "share"),
    # The border of the image is half a pixel beyond the centres of its last pixels.
    [((-0.5, 30.0), 0.5), ((95.5, 30.0), 0.5), ((40.0, 63.5), 0.5), ((-0.5, -0.5), 0.25), ((-30.0, 30.0), 0)],
)
def test_share_inside_of_a_cut_circle(centre, share):
    # Gauss's circle problem: the count of a circle of radius 20 errs by less than 1 % of its area.
    assert fast(np.ones((HEIGHT, WIDTH)), one(*centre, 20.0, 20.0))[2, 0] == pytest.approx(share, abs=0.01)


def test_by_hand():
    scores = np.arange(20.0).reshape(4, 5)
    # The plus sign of five pixels round (2, 1): 2 + 6 + 7 + 8 + 12.
    sums, pixels, inside = ellipse_sums(
        scores, 10, 20, 90, 90, np.array([[12.0, 21.0]]), np.eye(2)[None] / 1.1**2, np.ones(1, np.bool_)
    )
    assert (sums[0], pixels[0], inside[0]) == (35.0, 5, 1.0)
    # Between the pixels: a whole ellipse of the image that has none of them.
    tiny = ellipse_sums(
        scores, 10, 20, 90, 90, np.array([[12.5, 21.5]]), np.eye(2)[None] / 0.2**2, np.ones(1, np.bool_)
    )
    assert [values[0] for values in tiny] == [0.0, 0, 0.0]


def test_no_ellipses_and_an_empty_region():
    empty = Outlines(np.empty((0, 2)), np.empty((0, 2, 2)), np.empty(0, np.bool_))
    scores = np.zeros((0, 0))
    assert fast(scores, empty).shape == (3, 0)
    hidden = Outlines(np.zeros((2, 2)), np.stack([np.eye(2)] * 2), np.zeros(2, np.bool_))
    assert not fast(scores, hidden).any()


def test_ellipses_that_are_no_numbers_are_nowhere():
    """A NaN must never become an index: such ellipses are passed over, the others are not touched."""
    centres = np.array([[np.nan, 5.0], [15.0, 10.0], [15.0, 10.0], [1e300, 5.0], [15.0, 10.0]])
    shapes = np.array([np.eye(2), np.full((2, 2), np.nan), np.eye(2) * 1e300, np.eye(2), np.eye(2) / 16.0])
    result = ellipse_sums(np.ones((20, 30)), 0, 0, 30, 20, centres, shapes, np.ones(5, np.bool_))
    for values in result:
        np.testing.assert_array_equal(values[[0, 1, 3]], 0.0)
        assert np.isfinite(values).all()
    assert result[2][4] == 1.0


@pytest.mark.parametrize("slant", [0.0, 0.5, 1.0 - 1e-9])
@pytest.mark.parametrize("radius", [1e3, 1e9, 1e12, 1e50])
def test_ellipses_larger_than_any_image(radius, slant):
    """Their chords begin and end beyond what an integer holds."""
    for centre in ((15.0, 10.0), (-1e8, 3e8), (9e8, -9e8)):
        outlines = one(*centre, radius, radius, slant)
        sums, pixels, inside = fast(np.ones((HEIGHT, WIDTH)), outlines)[:, 0]
        assert sums == pixels <= WIDTH * HEIGHT
        assert 0.0 <= inside <= 1.0
        if centre == (15.0, 10.0):
            assert pixels == WIDTH * HEIGHT


def test_scores_are_the_tables_values():
    generator = np.random.default_rng(SEED + 3)
    colour = generator.integers(0, 110, (20, 30)).astype(np.int16)
    texture = generator.integers(0, 10, (20, 30)).astype(np.int16)
    tables = generator.normal(size=110), generator.normal(size=10)
    scores = log_ratio_scores(colour, texture, *tables)
    np.testing.assert_array_equal(scores, tables[0][colour] + tables[1][texture])


def test_bins_beyond_the_tables_are_refused():
    colour, texture = np.zeros((2, 3), np.int16), np.zeros((2, 3), np.int16)
    with pytest.raises(ValueError, match="bins must lie in the tables of 2 and 1"):
        log_ratio_scores(colour + 2, texture, np.zeros(2), np.zeros(1))
    with pytest.raises(ValueError, match="bins must lie in the tables of 2 and 1"):
        log_ratio_scores(colour, texture - 1, np.zeros(2), np.zeros(1))
    with pytest.raises(ValueError, match="texture: must have the shape of colour"):
        log_ratio_scores(colour, texture[:1], np.zeros(2), np.zeros(1))
