"""A made-up run: tables by a recipe instead of a simulation, for the tests of metrics and report."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.ledger import EnergyLedger
from wsnsim.hardware.profiles import PLATFORMS, RADIOS
from wsnsim.metrics.steps import steps_table
from wsnsim.metrics.summary import summary
from wsnsim.records import (
    EnergyRow,
    EstimateRow,
    EventRow,
    LoadRow,
    MessageRow,
    NodeRow,
    TruthRow,
    ViewRow,
)
from wsnsim.store.reader import RunStore
from wsnsim.store.writer import SqliteSink

STEPS = 36
RATE_HZ = 4.0
SIMULATED_S = (STEPS + 1) / RATE_HZ
SIZE_M = (12.0, 9.0, 4.0)
PLACES = {
    "c1": (0.0, 0.0, 3.0),
    "c2": (12.0, 0.0, 3.5),
    "c3": (12.0, 9.0, 4.0),
    "c4": (0.0, 9.0, 3.0),
    "relay": (6.0, 8.0, 3.0),
    "base": (6.0, 0.0, 2.0),
}
PARENTS = {"c1": "base", "c2": "base", "c3": "relay", "c4": "relay", "relay": "base", "base": None}
DEPTHS = {"c1": 1, "c2": 1, "c3": 2, "c4": 2, "relay": 1, "base": 0}
SKIPPED_EVERY = {"fine": STEPS + 1, "overloaded": 6}
WEIGHTS_BYTES = {"fine": 1008, "overloaded": 8008}
STATE_BYTES = 80


@dataclass(frozen=True, eq=False)
class SyntheticRun:
    """Tables made up by a recipe instead of a simulation."""

    tables: dict
    summary: dict
    cameras: dict
    size_m: tuple[float, float, float]


def _truth(step):
    turn = 2 * math.pi * step / STEPS
    return np.array([6 + 3.2 * math.cos(turn), 4.6 + 2.4 * math.sin(1.0 + turn), 0.9])


def _rows(load, targets, died):
    generator = np.random.default_rng(7)
    message = 0
    sent = dict.fromkeys(PLACES, 0)
    offered = []
    for step in range(STEPS + 1):
        time_s = step / RATE_HZ
        offered.append((time_s, sum(sent.values())))
        skipped = step % SKIPPED_EVERY[load] == 0
        for number, target in enumerate(targets):
            offset = np.array([0.9, -1.1, 0.0]) * number
            true = _truth(step) + offset
            yield TruthRow(time_s, target, *true.tolist(), 0.5, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0)
            if step == 0:
                continue
            seeing = [c for i, c in enumerate(("c1", "c2", "c3", "c4")) if (step + 3 * i) % 11 > 1]
            for camera in seeing:
                share = 0.02 + 0.004 * math.sin(step + len(camera))
                yield ViewRow(time_s, camera, target, share * 76_800, share)
            if skipped:
                for camera in PLACES:
                    if camera.startswith("c"):
                        detail = f"frame {step}: no state of {target} for it"
                        yield EventRow(time_s + 0.25, camera, "frame_unused", detail)
                yield _estimate(generator, step, target, true, "skipped", 0, 0)
                continue
            yield MessageRow(
                message, "state", "base", "c1", time_s, time_s + 0.004, STATE_BYTES, 1, 1, "delivered"
            )
            for mote in ("c2", "c3", "c4", "relay"):
                yield MessageRow(
                    message,
                    "state",
                    "base",
                    mote,
                    time_s,
                    time_s + 0.009,
                    STATE_BYTES,
                    1,
                    DEPTHS[mote],
                    "delivered",
                )
            message += 1
            sent["base"] += STATE_BYTES
            heard = 0
            for camera in seeing:
                if died and camera == "c4" and time_s > 5.0:
                    continue
                size = WEIGHTS_BYTES[load]
                sent[camera] += size
                arrives = load == "fine" or generator.random() < 0.08
                heard += arrives
                outcome = "delivered" if arrives else ("dropped_queue", "dropped_channel_access")[message % 2]
                yield MessageRow(
                    message,
                    "weights",
                    camera,
                    "base",
                    time_s + 0.02,
                    time_s + 0.15 if arrives else None,
                    size,
                    math.ceil(size / 100),
                    DEPTHS[camera] if arrives else None,
                    outcome,
                )
                message += 1
            kind = ("update" if heard else "timed_out") if seeing else "unasked"
            yield _estimate(generator, step, target, true, kind, len(seeing), int(heard))
        if step % 9 == 4:
            yield EventRow(time_s, "c3", "frame_skipped", f"frame {step}: the processor was busy")
    offered.append((SIMULATED_S, sum(sent.values())))
    nodes = list(_node_rows(load, sent, died))
    yield from nodes
    yield from _load_rows(offered, sum(row.mac_tx_bytes for row in nodes if isinstance(row, NodeRow)))


def _estimate(generator, step, target, true, kind, asked, heard):
    time_s, spread = step / RATE_HZ, 0.035 if kind == "update" else 0.4
    believed = true + generator.normal(0, spread, 3)
    return EstimateRow(
        time_s, time_s + 0.2 + 0.01 * (step % 3), "base", target, *believed.tolist(), 0.5, 0.1, 0.0,
        spread**2, 0.0, 0.0, spread**2, 0.0, spread**2, 1.0, 0.0, 0.0, 0.0, asked, heard, kind,
    )  # fmt: skip


def _load_rows(offered, mac_bytes):
    """Let the bytes on the air grow as those that were offered did, to their total."""
    _, total = offered[-1]
    for time_s, app_bytes in offered:
        yield LoadRow(time_s, app_bytes, mac_bytes * app_bytes // total)


def _node_rows(load, sent, died):
    platform, radio = PLATFORMS["imote2_416"], RADIOS["cc2420"]
    for name, place in PLACES.items():
        base = name == "base"
        lived = 5.0 if died and name == "c4" else SIMULATED_S
        capacity = None if base else 18_720.0
        ledger = EnergyLedger(capacity)
        relayed = sent["c3"] + sent["c4"] if name == "relay" else 0
        air_bytes = int((sent[name] + relayed) * 1.3 * (1.0 if load == "fine" else 0.15)) + 200
        sending_ns, receiving_ns = air_bytes * 32_000, 60_000_000
        watts = {"transmit": radio.transmit_w(0.0), "receive": radio.receive_w, "listen": radio.listen_w}
        busy_ns = 0 if name == "relay" else int(0.4 * lived * 1e9)
        ledger.enter(0, "board", "base load", 30.0 if base else platform.board_w)
        ledger.enter(0, "cpu", "work", platform.cpu_active_w)
        ledger.enter(0, "radio", "transmit", watts["transmit"])
        for instant, component, cause, power in sorted(
            [
                (busy_ns, "cpu", "idle", platform.cpu_idle_w),
                (sending_ns, "radio", "receive", watts["receive"]),
                (sending_ns + receiving_ns, "radio", "listen", watts["listen"]),
            ]
        ):
            ledger.enter(instant, component, cause, power)
        if name.startswith("c"):
            ledger.enter(int(lived * 1e9) - 1_000_000_000, "camera", "capture", 0.044)
        end = int(lived * 1e9)
        ledger.stop(end)
        drawn, seconds = ledger.drawn_j(end), ledger.seconds(end)
        for (component, cause), joules in drawn.items():
            yield EnergyRow(name, component, cause, seconds[component, cause], joules)
        by_component = {
            c: math.fsum(j for (component, _), j in drawn.items() if component == c)
            for c in ("cpu", "camera", "board")
        }
        yield NodeRow(
            node=name, role=name if name in ("base", "relay") else "camera", parent=PARENTS[name],
            depth=DEPTHS[name], x_m=place[0], y_m=place[1], z_m=place[2], app_tx_bytes=sent[name],
            mac_tx_bytes=air_bytes, mac_rx_bytes=1_875, frames_tx=air_bytes // 90 + 1, frames_retried=7,
            frames_dropped=0 if load == "fine" else 90, images_taken=STEPS if name.startswith("c") else 0,
            images_skipped=4 if name == "c3" else 0, cpu_cycles=busy_ns * 0.416, cpu_busy_s=busy_ns / 1e9,
            frame_work_mean_s=busy_ns / 1e9 / STEPS if name.startswith("c") else None, work_longest_s=0.06,
            energy_radio_tx_j=drawn["radio", "transmit"], energy_radio_rx_j=drawn["radio", "receive"],
            energy_radio_listen_j=drawn["radio", "listen"], energy_radio_sleep_j=0.0,
            energy_cpu_j=by_component["cpu"], energy_camera_j=by_component["camera"],
            energy_board_j=by_component["board"], harvested_j=0.0, battery_capacity_j=capacity,
            battery_left_j=None if base else ledger.left_j(end),
            died_at_s=5.0 if lived < SIMULATED_S else None,
        )  # fmt: skip


@pytest.fixture(scope="session")
def synthetic_run(tmp_path_factory):
    """Return a maker of made-up runs: `load` is fine or overloaded, `died` stops c4 at 5 s."""

    def make(load="fine", targets=("box",), died=False):
        path = tmp_path_factory.mktemp("synthetic") / "results.sqlite"
        with SqliteSink(path) as sink:
            for row in _rows(load, targets, died):
                sink.write(row)
        store = RunStore(path)
        tables = {name: store.table(name) for name in store.tables}
        cameras = {
            name: PinholeCamera.look_at(place, (6.0, 4.5, 1.0), 300.0, (320, 240))
            for name, place in PLACES.items()
            if name.startswith("c")
        }
        tables["steps"] = steps_table(tables["truth"], tables["estimates"], tables["views"], cameras)
        figures = summary(
            steps=tables["steps"], nodes=tables["nodes"], messages=tables["messages"], load=tables["load"],
            base="base", step_s=1 / RATE_HZ, lost_above_m=dict.fromkeys(targets, 1.6), channel_bps=250_000.0,
            simulated_s=SIMULATED_S, wall_s=3.2,
        )  # fmt: skip
        return SyntheticRun(tables, figures, cameras, SIZE_M)

    return make
