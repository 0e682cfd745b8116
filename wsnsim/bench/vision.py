"""What a camera mote computes, timed: histograms, log-likelihood ratios, bins, a frame, whole runs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wsnsim.bench.scenes import FEATURES, SETUPS, Scene, build_scene
from wsnsim.bench.timing import by_turns
from wsnsim.bench.twins import full_mask_similarities, full_mask_sums, has_opencv, opencv_similarities
from wsnsim.kernels.ellipse_sums import ellipse_sums, log_ratio_scores
from wsnsim.kernels.histograms import particle_histogram_similarities
from wsnsim.types import FloatArray

PARTICLES, TURNS = 1000, 7
QUICK_PARTICLES, QUICK_TURNS = 20, 1

WEIGHTED, UNWEIGHTED, SUMS = "weighted histograms", "unweighted histograms", "log-likelihood ratios"
NUMPY, OPENCV = "NumPy, full mask", "OpenCV, calcHist with mask"


@dataclass(frozen=True)
class Measure:
    """One thing timed, beside another where there is one.

    Parameters
    ----------
    what : was timed
    setup : of the images
    cpu_ms : CPU time, median [ms]
    peer : what does the same; None: nothing to compare with
    peer_cpu_ms : its CPU time, median [ms]
    ratio : the peer's time over ours, median of the turns' ratios
    deviation : largest difference of the results from NumPy's over all pixels of the image, where that
        was computed
    note : what to know of it
    """

    what: str
    setup: str
    cpu_ms: float
    peer: str | None = None
    peer_cpu_ms: float | None = None
    ratio: float | None = None
    deviation: float | None = None
    note: str | None = None


def bench_vision(*, quick: bool = False, said: Callable[[str], None] = lambda text: None) -> list[Measure]:
    """Time the kernels on a frame of setup A and one of setup B.

    Parameters
    ----------
    quick : few particles and one turn, to see that everything runs; its ratios say nothing
    said : told what is being timed

    Returns
    -------
    the measures, setup by setup
    """
    particles, turns = (QUICK_PARTICLES, QUICK_TURNS) if quick else (PARTICLES, TURNS)
    measures = []
    for name, setup in SETUPS.items():
        said(f"setup {name}: {particles} particles")
        scene = build_scene(setup, particles)
        measures += _kernels(name, scene, turns)
        measures += _images(name, scene, turns)
    return measures


def _kernels(setup: str, scene: Scene, turns: int) -> list[Measure]:
    """Time histograms and sums inside ellipses; all start from the bins."""
    whole = scene.whole_image().region
    reference = scene.colour, scene.texture
    tables = _log_ratio_tables(scene)
    functions: dict[str, Callable[[], object]] = {
        WEIGHTED: lambda: _similarities(scene, weighted=True),
        UNWEIGHTED: lambda: _similarities(scene, weighted=False),
        SUMS: lambda: _sums(scene, *tables),
        NUMPY: lambda: full_mask_similarities(whole.colour, whole.texture, scene.outlines, *reference),
    }
    if has_opencv():
        functions[OPENCV] = lambda: opencv_similarities(
            whole.colour, whole.texture, scene.outlines, *reference
        )
    times = by_turns(functions, turns)

    plain = {
        what: full_mask_similarities(
            whole.colour, whole.texture, scene.outlines, *reference, weighted=what == WEIGHTED
        )
        for what in (WEIGHTED, UNWEIGHTED)
    }
    scores = log_ratio_scores(whole.colour, whole.texture, *tables)
    deviations = {
        WEIGHTED: _deviation(_similarities(scene, weighted=True), plain[WEIGHTED]),
        UNWEIGHTED: _deviation(_similarities(scene, weighted=False), plain[UNWEIGHTED]),
        SUMS: _deviation(_sums(scene, *tables), full_mask_sums(scores, scene.outlines)),
    }
    peers = {WEIGHTED: NUMPY, UNWEIGHTED: OPENCV if has_opencv() else None, SUMS: WEIGHTED}
    notes = {
        WEIGHTED: _describe(scene),
        UNWEIGHTED: "OpenCV works in each ellipse's own box, and draws the outline with it"
        if has_opencv()
        else "OpenCV (opencv-python) is not installed: no comparison",
        SUMS: "the image of scores included",
    }
    return [
        Measure(
            what,
            setup,
            1e3 * times.typical(what),
            peer,
            None if peer is None else 1e3 * times.typical(peer),
            None if peer is None else times.ratio(peer, what),
            deviations[what],
            notes[what],
        )
        for what, peer in peers.items()
    ]


def _images(setup: str, scene: Scene, turns: int) -> list[Measure]:
    """Time binning and rendering."""
    region = scene.region
    height, width = region.colour.shape
    box = region.x0, region.y0, region.x0 + width, region.y0 + height
    columns, rows = scene.size_px
    part, frame, render = "bins of the region", "bins of the whole frame", "rendering a frame"
    times = by_turns(
        {
            part: lambda: FEATURES.bin_region(scene.image, box),
            frame: lambda: FEATURES.bin_region(scene.image, (0, 0, columns, rows)),
            render: lambda: scene.renderer.render(1, (scene.body,), (scene.pose,)),
        },
        turns,
    )
    return [
        Measure(
            part,
            setup,
            1e3 * times.typical(part),
            frame,
            1e3 * times.typical(frame),
            times.ratio(frame, part),
            note=f"{width} × {height} of {columns} × {rows} px",
        ),
        Measure(render, setup, 1e3 * times.typical(render), note=f"{columns} × {rows} px, noise included"),
    ]


def bench_run(scenario: Path, overrides: Sequence[str] = ()) -> Measure:
    """Time a whole run of a scenario, from reading it to its report.

    The run before it, of a few steps, compiles and loads what is loaded once.

    Parameters
    ----------
    scenario : a YAML file
    overrides : as after ``--set``

    Raises
    ------
    ScenarioError : the scenario cannot be run
    """
    import time

    from wsnsim.runs.provenance import peak_memory_bytes
    from wsnsim.runs.run import run

    run(scenario, overrides=(*overrides, "duration_s=1.0"))
    start = time.process_time()
    result = run(scenario, overrides=overrides)
    spent = time.process_time() - start
    summary = result.summary
    note = f"{summary['steps']:.0f} steps; peak memory of the process {peak_memory_bytes() / 2**20:.0f} MB"
    return Measure("a whole run", scenario.stem, 1e3 * spent, note=note)


def _similarities(scene: Scene, *, weighted: bool) -> FloatArray:
    region, outlines = scene.region, scene.outlines
    return np.array(
        particle_histogram_similarities(
            region.colour,
            region.texture,
            region.x0,
            region.y0,
            *scene.size_px,
            outlines.centres,
            outlines.shapes,
            outlines.visible,
            np.sqrt(scene.colour),
            np.sqrt(scene.texture),
            weighted=weighted,
        )
    )


def _sums(scene: Scene, colour_table: FloatArray, texture_table: FloatArray) -> FloatArray:
    region, outlines = scene.region, scene.outlines
    scores = log_ratio_scores(region.colour, region.texture, colour_table, texture_table)
    return np.array(
        ellipse_sums(
            scores,
            region.x0,
            region.y0,
            *scene.size_px,
            outlines.centres,
            outlines.shapes,
            outlines.visible,
        )
    )


def _log_ratio_tables(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Return log p_target / p_region of each colour and of each texture bin."""
    tables = []
    for bins, target in ((scene.region.colour, scene.colour), (scene.region.texture, scene.texture)):
        around = np.bincount(bins.ravel(), minlength=target.size) + 1.0
        tables.append(np.log((target + 1e-3) / (around / around.sum())))
    return tables[0], tables[1]


def _deviation(found: FloatArray, expected: FloatArray) -> float:
    return float(np.abs(found - expected).max())


def _describe(scene: Scene) -> str:
    areas = np.pi / np.sqrt(np.linalg.det(scene.outlines.shapes[scene.outlines.visible]))
    return (
        f"{len(scene.outlines.centres)} ellipses of {areas.mean():.0f} px on average; "
        f"target {100 * scene.pixel_share:.2f} % of the image"
    )
