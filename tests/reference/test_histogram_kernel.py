"""The compiled scan-line histograms against a plain twin with a mask of the full image."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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


def twin(colour, texture, outlines, q_colour, q_texture):
    """Kushwaha & Koutsoukos 2013, eqs. 16 and 17, one ellipse after another, all pixels of the image."""
    y, x = np.mgrid[: colour.shape[0], : colour.shape[1]]
    pixels = np.stack((x.ravel(), y.ravel()), axis=1)
    result = np.zeros((3, len(outlines.centres)))
    for i, (centre, shape) in enumerate(zip(outlines.centres, outlines.shapes, strict=True)):
        offset = pixels - centre
        distance = np.einsum("ni,ij,nj->n", offset, shape, offset)
        weights = np.where(distance <= 1.0, 1.0 - distance, 0.0)
        mass = weights.sum()
        if not outlines.visible[i] or mass <= 0.0:
            continue
        p_colour = np.bincount(colour.ravel(), weights, COLOURS) / mass
        p_texture = np.bincount(texture.ravel(), weights, TEXTURES) / mass
        spread = np.sqrt(np.diag(np.linalg.inv(shape)))
        low, high = np.ceil(centre - spread), np.floor(centre + spread)
        whole = (low >= 0).all() and (high < [colour.shape[1], colour.shape[0]]).all()
        total = np.pi / 2.0 / np.sqrt(np.linalg.det(shape))
        result[0, i] = np.sqrt(p_colour * q_colour).sum()
        result[1, i] = np.sqrt(p_texture * q_texture).sum()
        result[2, i] = 1.0 if whole else min(mass / total, 1.0)
    return result


def fast(colour, texture, outlines, q_colour, q_texture, box=None):
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
        )
    )


def test_equals_the_twin():
    generator = np.random.default_rng(SEED)
    colour, texture = random_bins(generator)
    outlines = random_outlines(generator, 1500)
    q = random_histogram(generator, COLOURS), random_histogram(generator, TEXTURES)
    expected = twin(colour, texture, outlines, *q)
    found = fast(colour, texture, outlines, *q)
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
