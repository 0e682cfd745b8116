"""Whole runs of a system whose messages are fused on their way: every law holds, and a rerun is the same."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar, Self

import pytest

import wsnsim
from wsnsim.errors import DecodeError
from wsnsim.hardware.work import Work
from wsnsim.metrics.conservation import violations
from wsnsim.metrics.traffic import content_arrived
from wsnsim.runs.result import Run
from wsnsim.scenario.load import scenario_from_dict
from wsnsim.systems.base import (
    Aggregate,
    Context,
    GroupKey,
    Program,
    Received,
    Role,
    Scope,
    Send,
    Site,
    Step,
    System,
    SystemParams,
)
from wsnsim.systems.silent import SilentProgram
from wsnsim.types import NodeId, Seconds
from wsnsim.vision.frame import Frame

STEPS = 6
PADDING = 150
"""Bytes that make a message two frames long."""


@dataclass(frozen=True)
class Roll:
    """The cameras, by their numbers, whose frame of a step was taken."""

    tag: ClassVar[int] = 7
    kind: ClassVar[str] = "roll"
    step: int
    cameras: tuple[int, ...]

    def encode(self) -> bytes:
        return bytes((self.tag, self.step, *self.cameras)) + bytes([255]) * PADDING

    @classmethod
    def decode(cls, data: bytes) -> Self:
        if len(data) < 2 + PADDING:
            raise DecodeError(f"roll: must have {2 + PADDING} bytes at least, got {len(data)}")
        return cls(data[1], tuple(data[2:-PADDING]))


class Calling(SilentProgram):
    """Says that a frame was taken, and puts the rolls of others to its own."""

    def __init__(self, site: Site, node: NodeId) -> None:
        self._site, self._node = site, node
        self._numbers = {camera: number for number, camera in enumerate(site.cameras)}

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        roll = Roll(frame.step, (self._numbers[self._node],))
        return Step((Send(Scope.BASE, roll, group=GroupKey(frame.step)),), Work(int_ops=1e6))

    def due(self, group: GroupKey) -> Seconds:
        return (group.epoch + 1) / self._site.rate_hz

    def usual(self) -> tuple[int, Work]:
        return 2 + len(self._numbers) + PADDING, Work(float_ops=1e4)

    def awaits(self, group: GroupKey, parts: Sequence[Received], below: frozenset[NodeId]) -> bool:
        return not {self._numbers[node] for node in below & self._numbers.keys()} <= set(called(parts))

    def aggregate(self, ctx: Context, group: GroupKey, parts: Sequence[Received]) -> Aggregate:
        return Aggregate(Roll(group.epoch, tuple(called(parts))), Work(float_ops=1e4 * len(parts)))


def called(parts: Sequence[Received]) -> list[int]:
    return [number for part in parts if isinstance(part.payload, Roll) for number in part.payload.cameras]


class Listening(SilentProgram):
    """The base station's: writes down what it heard."""

    heard: ClassVar[list[Roll]] = []

    def on_payload(self, ctx: Context, message: Received) -> Step:
        assert isinstance(message.payload, Roll)
        self.heard.append(message.payload)
        return Step()


def program(params: SystemParams, site: Site, node: NodeId, role: Role) -> Program:
    if role is Role.BASE:
        return Listening()
    # a relay in the tree's middle knows nothing of rolls
    return SilentProgram() if node == "plain" else Calling(site, node)


@pytest.fixture(autouse=True)
def rolls(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("roll_call")
    module.SYSTEM = System("roll call", "nobody", SystemParams, (Roll,), program)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "roll_call", module)
    Listening.heard = []


def scene(standard: str, seed: int = 0, batteries_j: dict[str, float] | None = None) -> dict[str, object]:
    """Four cameras round a room, a relay of each kind, and a base station behind them."""
    look = {"resolution_px": [32, 24], "focal_px": 30, "look_at_m": [5, 4, 1]}
    corners = {"c1": [0, 0, 3], "c2": [10, 0, 3], "c3": [10, 8, 3], "c4": [0, 8, 3]}
    batteries = {
        name: {"battery": {"kind": "capacity", "capacity_j": j}} for name, j in (batteries_j or {}).items()
    }
    entries = [{"id": "relay", "position_m": [12, 4, 3]}, {"id": "plain", "position_m": [18, 4, 3]}]
    entries += [{"id": name} for name in batteries if name in corners]
    return {
        "seed": seed,
        "duration_s": STEPS / 4,
        "world": {
            "size_m": [10, 8, 4],
            "targets": [
                {
                    "id": "box",
                    "shape": {"kind": "ellipsoid", "semi_axes_m": [0.4, 0.3, 0.3]},
                    "motion": {"kind": "waypoints", "points_m": [[3, 3, 1], [7, 5, 1]], "speed_mps": 0.5},
                }
            ],
        },
        "cameras": [{"id": name, "position_m": place, **look} for name, place in corners.items()],
        "motes": {
            "nodes": [entry | batteries.get(str(entry["id"]), {}) for entry in entries],
            "base": {"position_m": [24, 4, 2]},
        },
        "network": {
            "standard": standard,
            "mac": {"kind": "csma_ca", "cca_threshold_dbm": -90, "max_channel_retries": 5},
            "routing": {
                "kind": "tree",
                "parents": {
                    "c1": "c2", "c4": "c3", "c2": "relay", "c3": "relay", "relay": "plain", "plain": "base"
                },
            },
        },
        "system": {"kind": "roll_call:SYSTEM"},
    }  # fmt: skip


def played(standard: str, seed: int = 0, batteries_j: dict[str, float] | None = None) -> Run:
    return wsnsim.run(scenario_from_dict(scene(standard, seed, batteries_j)))


def broken(run: Run) -> list[str]:
    return violations(run.tables, float(run.summary["simulated_s"]))  # type: ignore[arg-type]


@pytest.mark.parametrize("standard", ["ideal", "ieee802154"])
def test_four_cameras_arrive_as_one_message_a_step(standard: str) -> None:
    run = played(standard)
    assert broken(run) == []
    assert [roll.step for roll in Listening.heard] == list(range(1, STEPS + 1))
    assert [sorted(roll.cameras) for roll in Listening.heard] == [[0, 1, 2, 3]] * STEPS
    # c1 … c4, relay and plain send once a step
    assert len(run.messages) == 6 * STEPS
    assert run.summary["delivery_ratio"] == 1.0
    assert run.summary["delivery_ratio_down"] is None
    assert run.summary["base_ingress_bytes_per_step"] == 6 + PADDING
    per_step = 2 * (3 + PADDING) + 2 * (4 + PADDING) + 2 * (6 + PADDING)
    assert run.summary["app_bytes_per_step"] == per_step
    assert run.summary["offered_bps"] == pytest.approx(8 * 4 * per_step)


@pytest.mark.parametrize("standard", ["ideal", "ieee802154"])
def test_a_camera_that_dies_in_the_middle_of_the_tree_costs_its_branch(standard: str) -> None:
    run = played(standard, batteries_j={"c2": 0.3})
    died_at_s = run.nodes.set_index("node").loc["c2", "died_at_s"]
    assert 0.25 < died_at_s < 1.5
    assert broken(run) == []
    for roll in Listening.heard:
        assert len(set(roll.cameras)) == len(roll.cameras)
        if roll.step / 4 > died_at_s:
            assert sorted(roll.cameras) == [2, 3]
    assert {roll.step for roll in Listening.heard} == set(range(1, STEPS + 1))
    arrived = content_arrived(run.messages)
    assert set(run.messages.loc[~arrived & (run.messages["created_s"] > died_at_s), "source"]) == {"c1"}


def test_the_same_seed_gives_the_same_tables_and_another_does_not() -> None:
    first, again, other = (played("ieee802154", seed) for seed in (3, 3, 4))
    for name, table in first.tables.items():
        assert table.equals(again.tables[name]), name
    assert not first.messages.equals(other.messages)
