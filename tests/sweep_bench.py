"""A small study for tests of sweeps: tiny cameras, a tracker that guesses, fails, dies or waits when told."""

import textwrap
from pathlib import Path

TRACKER = """
import os, signal, time
from pathlib import Path
import numpy as np
from wsnsim.systems.base import Basis, Belief, Step, System, SystemParams, TrackEstimate
from wsnsim.systems.silent import SilentProgram

class Params(SystemParams):
    sd_m: float = 0.1
    do: str = ""
    marker: str = ""

class Program(SilentProgram):
    def __init__(self, params, site):
        self.params, self.site = params, site
        self.rng = site.streams.stream("guess")

    def on_start(self, ctx):
        marker = Path(self.params.marker)
        first = not marker.exists()
        if self.params.do:
            marker.touch()
        match self.params.do:
            case "raise":
                raise RuntimeError("a bug of the user")
            case "raise once" if first:
                raise RuntimeError("a bug of the user, mended since")
            case "exit":
                os._exit(7)
            case "die":
                os.kill(os.getpid(), signal.SIGKILL)
            case "die once" if first:
                os.kill(os.getpid(), signal.SIGKILL)
            case "wait" if first:
                time.sleep(600)
        return Step()

    def on_frame(self, ctx, frame):
        target = self.site.targets[0]
        start = target.start
        place = np.asarray(start.position) + self.rng.normal(0.0, self.params.sd_m, 3)
        belief = Belief(place, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        estimate = TrackEstimate(frame.time, target.id, belief, np.eye(3), Basis.UPDATE, 1, 1)
        return Step(estimates=(estimate,))

def program(params, site, node, role):
    return Program(params, site) if node == "c1" else SilentProgram()

SYSTEM = System("guesses", "nobody", Params, (), program)
"""

SCENARIO = """
duration_s: 1.0
world:
  size_m: [4, 4, 3]
  targets:
    - id: t
      shape: {kind: ellipsoid, semi_axes_m: [0.3, 0.3, 0.3]}
      motion:
        kind: waypoints
        points_m: [[2, 2, 1], [2.2, 2, 1]]
        speed_mps: 0.1
        spin: {axis: [0, 0, 1], rate_radps: 0}
cameras:
  - {id: c1, position_m: [0, 0, 2], look_at_m: [2, 2, 1], resolution_px: [32, 24], focal_px: 30}
  - {id: c2, position_m: [4, 0, 2], look_at_m: [2, 2, 1], resolution_px: [32, 24], focal_px: 30}
motes: {base: {position_m: [2, 0.2, 1]}}
network: {standard: ideal}
system: {kind: "guessing:SYSTEM"}
expect: {position_error_mean_m: "< 0"}
"""


def write_study(folder: Path, text: str) -> Path:
    """Write scenario, tracker and study into a folder; return the study's file."""
    (folder / "guessing.py").write_text(TRACKER)
    (folder / "tiny.yaml").write_text(SCENARIO)
    study = folder / "study.yaml"
    study.write_text(textwrap.dedent(text))
    return study
