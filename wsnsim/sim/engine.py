"""One run from the first instant to the last, on the integer-nanosecond clock of SimPy."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self

import simpy

from wsnsim.net.clock import Clock
from wsnsim.net.interface import Network
from wsnsim.net.routing.tree import Tree
from wsnsim.records import EnergyRow, LoadRow, NodeRow, Outlet, Sink, TruthRow, ViewRow
from wsnsim.sim.cameras import MoteCamera
from wsnsim.sim.collector import only_the_new
from wsnsim.sim.mail import MailRoom
from wsnsim.sim.node import Node
from wsnsim.systems.base import Site
from wsnsim.types import Nanoseconds, NodeId, Seconds
from wsnsim.units import instant_ns, to_ns, to_s
from wsnsim.world.world import World

_LEAST_LOADS, _MOST_LOADS = 10, 1000
_ROUNDING = 1e-6

Progress = Callable[[int, int], None]
"""Called with the number of sampling instants done and their total."""


@dataclass(frozen=True)
class Schedule:
    """When cameras look: instants k / rate_hz, k from 0 (truth only) to `steps`.

    Parameters
    ----------
    rate_hz : frame rate of all cameras [Hz]
    steps : number of the last frame
    settle_s : how long after a frame its estimate may still come [s]
    duration_s : of a run without cameras, which then ends `settle_s` later; its instants are those at which
        the load is noted [s]
    """

    rate_hz: float
    steps: int
    settle_s: Seconds
    duration_s: Seconds | None = None

    @classmethod
    def without_cameras(cls, duration_s: Seconds, settle_s: Seconds) -> Self:
        """Note the load every second; a short run ten times, a long one a thousand times."""
        total_s = duration_s + settle_s
        period_s = min(max(1.0, total_s / _MOST_LOADS), total_s / _LEAST_LOADS)
        # the end of the run has a row of its own
        return cls(1.0 / period_s, math.ceil(total_s / period_s - _ROUNDING) - 1, settle_s, duration_s)

    def at_ns(self, step: int) -> Nanoseconds:
        """Return the instant of a step [ns]."""
        return instant_ns(0.0, step, self.rate_hz)

    @property
    def end_ns(self) -> Nanoseconds:
        """Return the end of the run: whole periods after the last frame, in which its estimate can come."""
        if self.duration_s is not None:
            return to_ns(self.duration_s + self.settle_s)
        return self.at_ns(self.steps + 1 + int(self.settle_s * self.rate_hz + 1e-6))


@dataclass
class Simulation:
    """All parts of one run, put together by `sim.build`.

    Parameters
    ----------
    nodes : by name, cameras and relays in the order of the scenario, the base station last
    positions : x, y and z of each node [m]
    site : what the programs were told
    counts_pixels : whether what cameras see of targets is counted in pixels, or their sensors tell
    """

    env: simpy.Environment
    clock: Clock
    world: World
    schedule: Schedule
    nodes: Mapping[NodeId, Node]
    positions: Mapping[NodeId, tuple[float, float, float]]
    cameras: tuple[MoteCamera, ...]
    network: Network
    tree: Tree
    mail: MailRoom
    outlet: Outlet
    site: Site
    counts_pixels: bool = True

    def run(self, sink: Sink, progress: Progress | None = None) -> None:
        """Run to the end, once, and leave every record in `sink`.

        Raises
        ------
        SimulationError : a program failed
        """
        self.outlet.connect(sink)
        self._schedule_step(0, progress)
        for node in self.nodes.values():
            node.start()
        with only_the_new():
            self.env.run(until=self.schedule.end_ns)
        self._write_load(to_s(self.schedule.end_ns))
        self.mail.close()
        for node in self.nodes.values():
            self._write_totals(node)

    def _schedule_step(self, step: int, progress: Progress | None) -> None:
        def act() -> None:
            self._sample(step)
            if step > 0:
                for camera in self.cameras:
                    camera.trigger(step, step / self.schedule.rate_hz)
            if step < self.schedule.steps:
                self._schedule_step(step + 1, progress)
            if progress is not None:
                progress(step, self.schedule.steps)

        self.clock.call(self.schedule.at_ns(step) - self.clock.now, act)

    def _sample(self, step: int) -> None:
        time = step / self.schedule.rate_hz
        poses = self.world.at(time)
        for target, pose in zip(self.world.targets, poses, strict=True):
            numbers = (*pose.position, *pose.velocity, *pose.orientation)
            self.outlet.write(TruthRow(time, target.id, *(float(number) for number in numbers)))
        self._write_load(time)
        if self.counts_pixels:
            self._count_pixels(time)
            return
        for camera in self.cameras:
            if camera.sensor is not None:
                for name in camera.sensor.in_view(time):
                    self.outlet.write(ViewRow(time, camera.node.id, name, None, None))

    def _count_pixels(self, time: Seconds) -> None:
        if not self.cameras:
            return
        bodies, moving = self.world.moving_bodies, self.world.moving_at(time)
        for camera in self.cameras:
            width, height = camera.renderer.camera.resolution_px
            areas = camera.renderer.visible_pixels(bodies, moving)
            for target, area in zip(self.world.targets, areas, strict=False):
                if area >= 1.0:
                    share = float(area) / (width * height)
                    self.outlet.write(ViewRow(time, camera.node.id, target.id, float(area), share))

    def _write_load(self, time_s: Seconds) -> None:
        app = sum(self.mail.app_tx_bytes.values())
        mac = sum(self.network.counters(node).mac_tx_bytes for node in self.nodes)
        self.outlet.write(LoadRow(time_s, app, mac))

    def _write_totals(self, node: Node) -> None:
        now = self.clock.now
        ledger = node.power.ledger
        drawn, seconds = ledger.drawn_j(now), ledger.seconds(now)
        busy_s = seconds.get(("cpu", "work"), 0.0)
        for (component, cause), energy in sorted(drawn.items()):
            self.outlet.write(EnergyRow(node.id, component, cause, seconds[component, cause], energy))
        link = self.network.counters(node.id)
        x, y, z = self.positions[node.id]
        self.outlet.write(
            NodeRow(
                node=node.id,
                role=node.role.value,
                parent=self.network.tree.parent.get(node.id),
                depth=self.network.tree.depth[node.id],
                x_m=x,
                y_m=y,
                z_m=z,
                app_tx_bytes=self.mail.app_tx_bytes.get(node.id, 0),
                mac_tx_bytes=link.mac_tx_bytes,
                mac_rx_bytes=link.mac_rx_bytes,
                frames_tx=link.frames_tx,
                frames_retried=link.frames_retried,
                frames_dropped=link.frames_dropped,
                images_taken=node.images_taken,
                images_skipped=node.images_skipped,
                cpu_cycles=busy_s * node.platform.clock_hz,
                cpu_busy_s=busy_s,
                frame_work_mean_s=busy_s / node.images_taken if node.images_taken else None,
                work_longest_s=to_s(node.work_longest_ns),
                energy_radio_tx_j=drawn.get(("radio", "transmit"), 0.0),
                energy_radio_rx_j=drawn.get(("radio", "receive"), 0.0),
                # a radio that starts is on its way to listening or sending
                energy_radio_listen_j=sum(drawn.get(("radio", cause), 0.0) for cause in ("listen", "start")),
                energy_radio_sleep_j=drawn.get(("radio", "sleep"), 0.0),
                energy_cpu_j=sum(j for (component, _), j in drawn.items() if component == "cpu"),
                energy_camera_j=sum(j for (component, _), j in drawn.items() if component == "camera"),
                energy_board_j=sum(j for (component, _), j in drawn.items() if component == "board"),
                harvested_j=0.0,
                battery_capacity_j=ledger.capacity_j,
                battery_left_j=None if ledger.capacity_j is None else ledger.left_j(now),
                died_at_s=node.died_at_s,
                attempts=link.attempts,
                attempts_failed=link.attempts_failed,
                cca_total=link.cca_total,
                cca_busy=link.cca_busy,
                budget_waited_s=self.network.budget_wait_s(node.id),
                control_frames_tx=link.control_frames_tx,
                control_tx_bytes=link.control_tx_bytes,
                duplicates=link.duplicates,
            )
        )
