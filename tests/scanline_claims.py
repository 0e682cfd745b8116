"""Made-up sweeps of the studies behind `reports/scanline.md`, with planted errors, bytes and joules."""

from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd

from wsnsim.claims.results import Results
from wsnsim.claims.scanline.evidence import Evidence, Known, Rooms
from wsnsim.claims.scanline.speed import Speed
from wsnsim.claims.scanline.studies import CAMERAS, CROWDS, HULL_CROWDS, LAB_CAMERAS, SDS, STUDIES, units_m
from wsnsim.metrics.figures import SUMMARY_KEYS
from wsnsim.sweeps.study import load_study

ROOT = Path(__file__).parent.parent
SEEDS = (0, 1, 2)
STEPS = 100
SPREAD = 0.01
"""Of the errors of a cell's runs, as a share."""
KNOWN = dict(zip((f"kalman-{sd}" for sd in SDS), (1.7, 3.0, 5.2, 8.9), strict=True))
ROOMS = Rooms(
    block=Known({"kalman": 5.0}, 35.0, 34.0),
    open=Known(KNOWN, 30.0, 31.0),
    lab=Known({"kalman": 14.0}, 80.0, 64.0),
)

_CURVE = (3.1, 3.3, 3.8, 4.5)
_NONE = (1.02, 2.0, 3.0, 6.0, 10.0, 13.0, 15.0)
_PERFECT = (1.0, 1.5, 2.0, 3.0, 5.0, 6.0, 12.0)
AS_CLAIMED = {
    **{f"cameras/N{n}-{prior}": 20.0 / n * share for n in CAMERAS for prior, share in
       (("none", 1.9), ("kalman", 1.2), ("perfect", 1.0))},
    "cameras/N8-none": 1.8, "cameras/N8-kalman": 1.4, "cameras/N8-perfect": 1.2,
    **{f"priors/kalman-{sd}": rmse for sd, rmse in zip(SDS, _CURVE, strict=True)},
    "priors/none": 6.0, "priors/perfect": 3.0, "priors/stationary": 4.0, "priors/scan_lines": 3.5,
    "priors/none-published": 6.0, "priors/perfect-published": 3.0, "priors/kalman-8-published": 4.2,
    "tradeoff/N3-none": 9.0, "tradeoff/N3-perfect": 7.0, "tradeoff/N5-none": 2.5, "tradeoff/N5-perfect": 2.0,
    "tradeoff/N6-none": 2.0, "tradeoff/N6-perfect": 1.5, "tradeoff/N8-none": 1.4, "tradeoff/N8-perfect": 1.0,
    **dict(zip((f"occluders/M{m}-none" for m in CROWDS), _NONE, strict=True)),
    **dict(zip((f"occluders/M{m}-perfect" for m in CROWDS), _PERFECT, strict=True)),
    "hull/M10-ellipses": 1.3, "hull/M40-ellipses": 3.0,
    **{f"lab/N{n}-{prior}": 100.0 / n * share for n in LAB_CAMERAS for prior, share in
       (("none", 1.8), ("kalman", 1.3), ("perfect", 1.0))},
    "lab/N16-kalman-whole": 9.0,
    "trackers/auxiliary-none": 6.0,
    "trackers/extended": 20.0, "trackers/unscented": 20.0, "trackers/map": 20.0,
    "radio/kalman": 1.45, "radio/jpeg": 20.0,
}  # fmt: skip
THE_OPPOSITE = {
    **{f"cameras/N{n}-{prior}": 20.0 / n * share for n in CAMERAS for prior, share in
       (("none", 1.0), ("kalman", 1.2), ("perfect", 1.5))},
    **{f"priors/{cell}": 2.0 for cell in ("none", "perfect", *(f"kalman-{sd}" for sd in SDS))},
    **{f"priors/{cell}-published": 2.0 for cell in ("none", "perfect")},
    "priors/stationary": 5.0, "priors/scan_lines": 5.0,
    "tradeoff/N3-none": 1.0, "tradeoff/N5-none": 5.0, "tradeoff/N6-none": 6.0,
    "tradeoff/N8-none": 7.0, "tradeoff/N8-perfect": 2.0,
    "occluders/M1-none": 4.0, "occluders/M1-perfect": 1.0, "occluders/M10-none": 3.0,
    "occluders/M10-perfect": 1.0, "occluders/M20-none": 2.0, "occluders/M20-perfect": 1.0,
    "occluders/M40-none": 1.5, "occluders/M120-none": 3.0, "occluders/M120-perfect": 2.0,
    "occluders/M160-none": 7.0, "occluders/M160-perfect": 2.0,
    **{f"hull/M{m}-{shape}": 0.7 for m in HULL_CROWDS for shape in ("ellipses", "polygons")},
    **{f"lab/N{n}-{prior}": 100.0 / n * share for n in LAB_CAMERAS for prior, share in
       (("none", 1.0), ("kalman", 1.2), ("perfect", 1.5))},
    "trackers/auxiliary-none": 2.0, "trackers/extended": 2.0, "trackers/unscented": 2.0, "trackers/map": 2.0,
    "radio/kalman": 0.5,
}  # fmt: skip
COSTS_AS_CLAIMED = {
    "bearing": (32.0, 0.5, 0.001, 0.998), "stationary": (32.0, 0.5, 0.001, 0.998),
    "kalman": (300.0, 0.501, 0.004, 0.95), "perfect": (300.0, 0.501, 0.004, 0.95),
    "scan_line": (36.0, 0.5, 0.00115, 0.99), "jpeg": (300_000.0, 0.6, 0.01, 0.0),
    "jpeg-alone": (40_000.0, 0.6, 0.1, 1.0),
}  # fmt: skip
"""Bytes a step, joules of all motes a step, joules of sending of a camera a frame, share heard in time."""
COSTS_OPPOSITE = {
    "bearing": (32.0, 0.5, 0.01, 0.8), "stationary": (32.0, 0.5, 0.01, 0.8),
    "kalman": (32.0, 1.0, 0.01, 0.8), "perfect": (32.0, 1.0, 0.01, 0.8),
    "scan_line": (320.0, 1.0, 0.2, 0.8), "jpeg": (320.0, 0.5, 0.01, 1.0),
    "jpeg-alone": (320.0, 0.5, 0.01, 0.6),
}  # fmt: skip
FAST = Speed({("none", 2): 1e-3, ("none", 8): 2e-3, ("kalman", 2): 3e-3, ("kalman", 8): 7e-3,
              ("perfect", 2): 1e-3, ("perfect", 8): 3e-3}, {2: 90.0, 4: 100.0, 8: 200.0})  # fmt: skip
SLOW = Speed({("none", 2): 4e-3, ("none", 8): 2e-2, ("kalman", 2): 1e-3, ("kalman", 8): 2e-2,
              ("perfect", 2): 1e-3, ("perfect", 8): 3e-2}, {2: 90.0, 4: 40.0, 8: 30.0})  # fmt: skip


def made_up_evidence(rmse, costs, speed=None):
    """Return evidence in which each setting comes to what is planted, 1.5 units where nothing is."""
    results = [_results(study, rmse, costs) for study in STUDIES]
    nodes = {cell: _nodes(values) for cell, values in costs.items()}
    return Evidence(*results, nodes=nodes, units_m=units_m(), rooms=ROOMS, speed=speed)


def _results(study, rmse, costs):
    short = study.name.removeprefix("scanline-")
    unit_m = units_m()[study.name]
    cells = [cell.name for cell in load_study(ROOT / study.file).cells]
    rows = []
    for number, cell in enumerate(cells):
        for seed in SEEDS:
            generator = np.random.default_rng([crc32(f"{short}/{cell}".encode()), seed])
            error_m = unit_m * rmse.get(f"{short}/{cell}", 1.5) * np.exp(generator.normal(0, SPREAD))
            size, joules, _, heard = costs.get(cell, costs["bearing"])
            rows.append(
                {
                    "cell": number, "name": cell, "seed": seed, "status": "complete",
                    "scenario_sha256": f"{cell}-{seed}", "provenance": 1,
                    **dict.fromkeys(sorted(SUMMARY_KEYS), 0.1),
                    "position_rmse_m": error_m, "steps": STEPS, "app_bytes_per_step": size,
                    "mac_bytes_per_step": 5 * size, "energy_per_step_j": joules, "heard_ratio": heard,
                }
            )  # fmt: skip
    made = pd.DataFrame({"provenance": [1], "wsnsim": "0", "python": "3", "libraries": "{}", "machine": "m"})
    named = pd.DataFrame({"cell": range(len(cells)), "name": cells})
    return Results(study, named, pd.DataFrame(rows), {}, (), made)


def _nodes(values):
    """Return tables of nodes: two cameras and a base, whose sending and processing cost what is planted."""
    _, joules, sending, _ = values
    parts = {"radio_tx": sending, "radio_rx": 0.001, "radio_listen": 0.01, "cpu": joules / 8, "camera": 0.004,
             "board": 0.02}  # fmt: skip
    energy = {f"energy_{name}_j": STEPS * value for name, value in parts.items()}
    roles = ("camera", "camera", "base")
    rows = [{"seed": seed, "role": role, "cpu_cycles": 1e6, **energy} for seed in SEEDS for role in roles]
    return pd.DataFrame(rows)
