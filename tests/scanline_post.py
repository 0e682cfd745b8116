"""Programs of the scan-line system without a network: what is said arrives at once, or is lost."""

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from wsnsim.messages.base import Payload
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.systems.base import Context, Program, Received, Role, Scope, Step, TrackEstimate
from wsnsim.systems.scanline.system import make_program
from wsnsim.vision.frame import Frame

ROOM = """
name: small-room
seed: 0
duration_s: 4.0
world:
  size_m: [8, 6, 3]
  crowd: {speed_mps: 1.0, noise_sd_m: 0.03}
  targets:
    - id: object
      shape: {kind: cylinder, semi_axes_m: [0.2, 0.2, 0.9]}
      motion: {kind: crowd}
  people:
    - {id: walker, count: 5, shape: {kind: cylinder, semi_axes_m: [0.2, 0.2, 0.9]}, motion: {kind: crowd}}
cameras:
  - {id: c1, position_m: [4, 0, 1.5],
     look_at_m: [4, 3, 1.5], resolution_px: [320, 24], focal_px: 160, rate_hz: 7.5}
  - {id: c2, position_m: [8, 3, 1.5],
     look_at_m: [4, 3, 1.5], resolution_px: [320, 24], focal_px: 160, rate_hz: 7.5}
  - {id: c3, position_m: [4, 6, 1.5],
     look_at_m: [4, 3, 1.5], resolution_px: [320, 24], focal_px: 160, rate_hz: 7.5}
  - {id: c4, position_m: [0, 3, 1.5],
     look_at_m: [4, 3, 1.5], resolution_px: [320, 24], focal_px: 160, rate_hz: 7.5}
motes:
  default: {platform: imote2_416, radio: cc2420, battery: {kind: two_aa}}
  base: {id: base, position_m: [4, 1, 2], platform: workstation, battery: {kind: mains}}
network:
  standard: ieee802154
  propagation: {kind: log_distance, exponent: 3.0}
  routing: {kind: min_hop_tree}
system:
  kind: scanline
  noise: {position_sd_m: 0.05, angle_sd_rad: 0.005, read_sd_px: 1.0}
  walk: {speed_mps: 1.0, noise_sd_m: 0.03}
  tracker: {kind: auxiliary, particles: 200}
"""
"""Four cameras, five people who walk about, 30 steps."""
RATE_HZ = 7.5


def room(folder: Path) -> Path:
    """Write the small room to a file."""
    file = folder / "room.yaml"
    file.write_text(ROOM)
    return file


@dataclass(frozen=True)
class Said:
    """A message, told of as a test wants to know it."""

    at: float
    source: str
    to: str
    payload: Payload


class Post:
    """Runs all programs of a scenario, each event at its time, in the order in which they were made.

    Parameters
    ----------
    file : the scenario
    overrides : of its keys
    lost : tells which messages are
    work_s : for how long a program is busy with an input; what comes meanwhile waits
    """

    def __init__(
        self,
        file: Path,
        overrides: tuple[str, ...] = (),
        lost: Callable[[Said], bool] = lambda said: False,
        work_s: Callable[[str, Step], float] = lambda node, step: 0.0,
    ) -> None:
        loaded = load_scenario(file, overrides)
        self.simulation = build(loaded)
        self.site = self.simulation.site
        self.battery_j: dict[str, float] = dict.fromkeys([*self.site.motes, "base"], 100.0)
        """What each node finds in its battery, to be changed at will."""
        self.lost = lost
        self.said: list[Said] = []
        self.told: list[tuple[str, TrackEstimate, float]] = []
        """Node, estimate, and when it was made."""
        self.notes: list[tuple[float, str, str]] = []
        """When, node, kind."""
        self.dead: set[str] = set()
        self._work_s = work_s
        self._free_s: dict[str, float] = {}
        self._queue: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()
        self.programs: dict[str, Program] = {}
        for node in self.simulation.nodes.values():
            role = Role(node.role)
            self.programs[node.id] = make_program(loaded.system_params, self.site, node.id, role)

    def run(self) -> "Post":
        """Run to the end."""
        for node in self.programs:
            self._ask(0.0, node, lambda program, ctx: program.on_start(ctx))
        for camera in self.simulation.cameras:
            assert camera.sensor is not None
            for step in range(1, self.site.steps + 1):
                time = step / self.site.rate_hz
                measured = camera.sensor.measured(step, time)
                frame = Frame(step, time, camera.node.id, lambda: None, measured)  # type: ignore[arg-type, return-value]
                self._ask(
                    time, camera.node.id, lambda program, ctx, frame=frame: program.on_frame(ctx, frame)
                )
        while self._queue:
            _, _, act = heapq.heappop(self._queue)
            act()
        return self

    def errors_m(self) -> dict[int, float]:
        """Return the error of the last estimate of each frame."""
        errors = {}
        for _, estimate, _ in self.told:
            (pose,) = self.simulation.world.at(estimate.time)
            errors[round(estimate.time * self.site.rate_hz)] = math.dist(
                estimate.belief.position[:2], pose.position[:2]
            )
        return errors

    def _ask(self, time: float, node: str, call: Callable[[Program, Context], Step]) -> None:
        def act() -> None:
            if node in self.dead:
                return
            if self._free_s.get(node, 0.0) > time:
                self._ask(self._free_s[node], node, call)
                return
            step = call(self.programs[node], Context(node, time, self.battery_j[node]))
            done = time + self._work_s(node, step)
            self._free_s[node] = done
            self._at(done, lambda: self._take_effect(done, node, step))

        self._at(time, act)

    def _at(self, time: float, act: Callable[[], None]) -> None:
        heapq.heappush(self._queue, (time, next(self._order), act))

    def _take_effect(self, time: float, node: str, step: Step) -> None:
        if node in self.dead:
            return
        self.notes += [(time, node, note.kind) for note in step.notes]
        self.told += [(node, estimate, time) for estimate in step.estimates]
        for timer in step.timers:
            key = timer.key
            self._ask(max(time, timer.at), node, lambda program, ctx, key=key: program.on_timer(ctx, key))
        for send in step.sends:
            to = [send.to] if isinstance(send.to, str) else ["base"]
            for receiver in self.site.motes if send.to is Scope.TREE else to:
                said = Said(time, node, receiver, type(send.payload).decode(send.payload.encode()))
                self.said.append(said)
                if not self.lost(said):
                    message = Received(node, said.payload)
                    self._ask(time, receiver, lambda program, ctx, m=message: program.on_payload(ctx, m))
