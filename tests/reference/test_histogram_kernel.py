"""The compiled scan-line histograms against a plain twin with a mask of the full image, and OpenCV."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.bench.twins import full_mask_similarities, has_opencv, opencv_similarities
from wsnsim.geometry.quadrics import Outlines, outline_box
from wsnsim.kernels.histograms import kernel_histogram, particle_histogram_similarities

SEED = int(os.environ.get("WSNSIM_TEST_SEED", "0"))
WIDTH, HEIGHT, COLOURS, TEXTURES = 96, 64, 110, 10


def random_bins(generator):
    colour = generator.integers(0, COLOURS, (HEIGHT, WIDTH)).astype(np.int16)
    # Patches, so that histograms differ from place to place.
    colour[:, 40:] = colour[:, 40:] % 7
    return colour, generator.integers(0, TEXTURES, (HEIGHT, WIDTH)).astype(np.int16)


def random_outlines(generator, count, log_radius=(-1.0, 4.0)):
    """Ellipses of all sizes and directions, in, across and beyond the border of the image."""
    radii = np.exp(generator.uniform(*log_radius, (count, 2)))
    angles = generator.uniform(0.0, np.pi, count)
    turn = np.array([[np.cos(angles), -np.sin(angles)], [np.sin(angles), np.cos(angles)]]).transpose(2, 0, 1)
    shapes = turn @ (np.eye(2) / radii[:, None, :] ** 2) @ turn.transpose(0, 2, 1)
    centres = generator.uniform((-20.0, -20.0), (WIDTH + 20.0, HEIGHT + 20.0), (count, 2))
    return Outlines(centres, (shapes + shapes.transpose(0, 2, 1)) / 2, generator.uniform(size=count) < 0.9)


def random_histogram(generator, bins):
    histogram = generator.uniform(size=bins) * (generator.uniform(size=bins) < 0.5)
    histogram[0] += 0.1
    return histogram / histogram.sum()


def fast(colour, texture, outlines, q_colour, q_texture, box=None, weighted=True):
    x0, y0, x1, y1 = box or (0, 0, WIDTH, HEIGHT)
    return np.array(
        particle_histogram_similarities(
            colour[y0:y1, x0:x1],
            texture[y0:y1, x0:x1],
            x0,
            y0,
            WIDTH,
            HEIGHT,
            outlines.centres,
            outlines.shapes,
            outlines.visible,
            np.sqrt(q_colour),
            np.sqrt(q_texture),
            weighted=weighted,
        )
    )


@pytest.mark.parametrize("weighted", [True, False])
def test_equals_the_twin(weighted):
    generator = np.random.default_rng(SEED)
    colour, texture = random_bins(generator)
    outlines = random_outlines(generator, 1500)
    q = random_histogram(generator, COLOURS), random_histogram(generator, TEXTURES)
    expected = full_mask_similarities(colour, texture, outlines, *q, weighted=weighted)
    found = fast(colour, texture, outlines, *q, weighted=weighted)
    # All three kinds must be there, or the comparison says little.
    inside = expected[2]
    assert min((inside == 1.0).sum(), (inside == 0.0).sum(), ((inside > 0) & (inside < 1)).sum()) > 100
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


def test_a_region_that_holds_the_ellipses_is_enough():
    generator = np.random.default_rng(SEED + 1)
    colour, texture = random_bins(generator)
    outlines = random_outlines(generator, 40, (0.0, 2.0))
    outlines = Outlines(outlines.centres * 0.3 + [10.0, 20.0], outlines.shapes, outlines.visible)
    q = random_histogram(generator, COLOURS), random_histogram(generator, TEXTURES)
    box = outline_box(outlines, WIDTH, HEIGHT)
    assert (box.x1 - box.x0) * (box.y1 - box.y0) < WIDTH * HEIGHT
    np.testing.assert_allclose(
        fast(colour, texture, outlines, *q, box=box), fast(colour, texture, outlines, *q), rtol=0, atol=1e-12
    )
    x0, y0, x1, y1 = box
    for smaller in ((x0 + 1, y0, x1, y1), (x0, y0 + 1, x1, y1), (x0, y0, x1 - 1, y1), (x0, y0, x1, y1 - 1)):
        with pytest.raises(ValueError, match="region: must hold the ellipses"):
            fast(colour, texture, outlines, *q, box=smaller)


@settings(max_examples=50, deadline=None)
@given(
    st.floats(0.0, WIDTH),
    st.floats(0.0, HEIGHT),
    st.floats(0.8, 40.0),
    st.floats(0.8, 40.0),
    st.floats(-0.9, 0.9),
)
def test_an_ellipse_is_exactly_similar_to_itself(x, y, first, second, skew):
    colour, texture = random_bins(np.random.default_rng(5))
    off_diagonal = skew / (first * second)
    shape = np.array([[1 / first**2, off_diagonal], [off_diagonal, 1 / second**2]])
    centre = np.array([x, y])
    p_colour, p_texture = kernel_histogram(colour, texture, 0, 0, centre, shape, COLOURS, TEXTURES)
    outlines = Outlines(centre[None], shape[None], np.ones(1, bool))
    rho_colour, rho_texture, inside = fast(colour, texture, outlines, p_colour, p_texture)[:, 0]
    if p_colour.sum() == 0.0:
        assert inside == rho_colour == rho_texture == 0.0
    else:
        assert p_colour.sum() == pytest.approx(1.0)
        assert rho_colour == pytest.approx(1.0, abs=1e-9)
        assert rho_texture == pytest.approx(1.0, abs=1e-9)
        assert 0.0 < inside <= 1.0


def test_nothing_in_common_is_zero():
    colour, texture = np.zeros((HEIGHT, WIDTH), np.int16), np.ones((HEIGHT, WIDTH), np.int16)
    outlines = Outlines(np.array([[40.0, 30.0]]), np.eye(2)[None] / 25.0, np.ones(1, bool))
    q_colour, q_texture = np.eye(COLOURS)[1], np.eye(TEXTURES)[0]
    assert fast(colour, texture, outlines, q_colour, q_texture)[:, 0].tolist() == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("centre", "share"),
    # The border of the image is half a pixel beyond the centres of its last pixels.
    [
        ((-0.5, 30.0), 0.5),
        ((95.5, 30.0), 0.5),
        ((40.0, 63.5), 0.5),
        ((-0.5, -0.5), 0.25),
        ((-30.0, 30.0), 0.0),
    ],
)
def test_share_inside_of_a_cut_circle(centre, share):
    generator = np.random.default_rng(SEED + 2)
    colour, texture = random_bins(generator)
    outlines = Outlines(np.array([centre]), np.eye(2)[None] / 20.0**2, np.ones(1, bool))
    q = random_histogram(generator, COLOURS), random_histogram(generator, TEXTURES)
    assert fast(colour, texture, outlines, *q)[2, 0] == pytest.approx(share, abs=2e-3)


def test_one_histogram_by_hand():
    colour = np.array([[0, 1, 2]], np.int16)
    texture = np.array([[1, 0, 0]], np.int16)
    # Weights 1 - 1/4, 1, 1 - 1/4 at the pixels x = 10, 11, 12 round the centre 11.
    found = kernel_histogram(colour, texture, 10, 7, np.array([11.0, 7.0]), np.eye(2) / 4.0, 4, 2)
    np.testing.assert_allclose(found[0], np.array([0.75, 1.0, 0.75, 0.0]) / 2.5)
    np.testing.assert_allclose(found[1], np.array([1.75, 0.75]) / 2.5)


def test_no_particles_and_an_empty_region():
    empty = Outlines(np.empty((0, 2)), np.empty((0, 2, 2)), np.empty(0, bool))
    bins = np.zeros((0, 0), np.int16)
    q = np.eye(COLOURS)[0], np.eye(TEXTURES)[0]
    assert fast(bins, bins, empty, *q, box=(0, 0, 0, 0)).shape == (3, 0)
    hidden = Outlines(np.zeros((2, 2)), np.stack([np.eye(2)] * 2), np.zeros(2, bool))
    assert not fast(bins, bins, hidden, *q, box=(0, 0, 0, 0)).any()
    histograms = kernel_histogram(bins, bins, 0, 0, np.zeros(2), np.eye(2), COLOURS, TEXTURES)
    assert not np.concatenate(histograms).any()


def test_ellipses_that_are_no_numbers_are_nowhere():
    """A NaN must never become an index: such particles are passed over, the others are not touched."""
    colour, texture = np.zeros((20, 30), np.int16), np.zeros((20, 30), np.int16)
    centres = np.array([[np.nan, 5.0], [15.0, 10.0], [15.0, 10.0], [1e300, 5.0], [15.0, 10.0]])
    shapes = np.array([np.eye(2), np.full((2, 2), np.nan), np.eye(2) * 1e300, np.eye(2), np.eye(2) / 16.0])
    one = np.ones(1)
    result = particle_histogram_similarities(
        colour, texture, 0, 0, 30, 20, centres, shapes, np.ones(5, np.bool_), one, one
    )
    for values in result:
        np.testing.assert_array_equal(values[[0, 1, 3]], 0.0)
        assert np.isfinite(values).all()
    assert result[2][4] == 1.0


@pytest.mark.skipif(not has_opencv(), reason="OpenCV is not installed")
def test_opencv_finds_about_the_same():
    """It draws the outline with the disc: at most √2 · 2πr more pixels, of which all may differ."""
    radius, count = 20.0, 50
    centres = np.random.default_rng(SEED + 3).uniform((21.0, 21.0), (WIDTH - 22.0, HEIGHT - 22.0), (count, 2))
    discs = Outlines(centres, np.stack([np.eye(2) / radius**2] * count), np.ones(count, np.bool_))
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    colour, texture = (x < WIDTH // 2).astype(np.int16), (y < HEIGHT // 2).astype(np.int16)
    right, bottom = np.array([1.0, 0.0]), np.array([1.0, 0.0])
    # Against a reference of one bin, the coefficient is the root of that bin's share.
    shares = fast(colour, texture, discs, right, bottom, weighted=False)[:2] ** 2
    assert np.ptp(shares[0]) > 0.5
    drawn = opencv_similarities(colour, texture, discs, right, bottom) ** 2
    more = np.sqrt(2.0) * 2.0 / radius
    np.testing.assert_allclose(drawn, shares, rtol=0.0, atol=more / (1.0 + more))


def test_bins_beyond_the_reference_are_refused():
    """A wrong bin must never become an index."""
    outlines = random_outlines(np.random.default_rng(SEED), 1)
    q = random_histogram(np.random.default_rng(SEED), 3), random_histogram(np.random.default_rng(SEED), 2)
    zeros = np.zeros((HEIGHT, WIDTH), np.int16)
    for colour, texture in ((zeros + 3, zeros), (zeros - 1, zeros), (zeros, zeros + 2), (zeros, zeros - 1)):
        with pytest.raises(ValueError, match="bins must be below the reference's 3 and 2"):
            fast(colour, texture, outlines, *q)
    many = np.full(70_000, 1.0 / 70_000)
    with pytest.raises(ValueError, match="colours times textures must be at most 65536"):
        fast(zeros, zeros, outlines, many, q[1])


def test_one_colour_everywhere():
    """Every addition goes to one bin: the two histograms of neighbouring pixels must add up."""
    colour, texture = np.full((HEIGHT, WIDTH), 7, np.int16), np.full((HEIGHT, WIDTH), 3, np.int16)
    outlines = random_outlines(np.random.default_rng(SEED + 4), 100)
    rho_colour, rho_texture, inside = fast(colour, texture, outlines, np.eye(COLOURS)[7], np.eye(TEXTURES)[3])
    np.testing.assert_allclose(rho_colour[inside > 0.0], 1.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(rho_texture[inside > 0.0], 1.0, rtol=0.0, atol=1e-12)
