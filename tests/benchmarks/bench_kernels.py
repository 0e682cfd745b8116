"""How the kernels' time grows with the size of the ellipses, beside NumPy over the full image.

Not collected with the tests, and nothing is asserted. Run it with
``pytest -s tests/benchmarks/bench_kernels.py``; `wsnsim bench vision` has the published setups.
"""

import numpy as np
import pytest

from wsnsim.bench.scenes import FEATURES, Setup, build_scene
from wsnsim.bench.timing import by_turns
from wsnsim.bench.twins import full_mask_similarities
from wsnsim.kernels.ellipse_sums import ellipse_sums
from wsnsim.kernels.histograms import particle_histogram_similarities

PARTICLES = 250


@pytest.mark.parametrize("distance_m", [2.0, 3.3, 4.7, 6.6, 9.2, 13.0])
def test_time_an_ellipse(distance_m):
    scene = build_scene(Setup(distance_m, 0.2, "photo/coffee"), PARTICLES)
    whole, region, outlines = scene.whole_image().region, scene.region, scene.outlines
    place = region.x0, region.y0, *scene.size_px, outlines.centres, outlines.shapes, outlines.visible
    roots = np.sqrt(scene.colour), np.sqrt(scene.texture)
    scores = np.linspace(-1.0, 1.0, region.colour.size).reshape(region.colour.shape)
    times = by_turns(
        {
            "numpy": lambda: full_mask_similarities(
                whole.colour, whole.texture, outlines, scene.colour, scene.texture
            ),
            "histograms": lambda: particle_histogram_similarities(
                region.colour, region.texture, *place, *roots
            ),
            "sums": lambda: ellipse_sums(scores, *place),
            "bins": lambda: FEATURES.bin_region(scene.image, (0, 0, *scene.size_px)),
        },
        turns=5,
    )
    print(
        f"\n{scene.pixel_share * scene.image[..., 0].size:6.0f} px: histograms "
        f"{1e6 * times.typical('histograms') / PARTICLES:.2f} µs an ellipse, "
        f"NumPy × {times.ratio('numpy', 'histograms'):.0f}; sums "
        f"{1e6 * times.typical('sums') / PARTICLES:.2f} µs, × {times.ratio('histograms', 'sums'):.1f} less; "
        f"bins of the frame {1e3 * times.typical('bins'):.2f} ms",
        end="",
    )
