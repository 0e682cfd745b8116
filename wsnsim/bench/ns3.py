"""The peer of the network's speed: ns-3's lr-wpan module, in a small driver, where that can be compiled."""

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from wsnsim.claims.network.layouts import Layout
from wsnsim.claims.network.runs import PAYLOAD_BYTES
from wsnsim.types import Seconds

DRIVER = Path(__file__).parents[2] / "tests" / "benchmarks" / "ns3" / "lr_wpan_tree.cc"
"""Stands beside the package in a checkout, not in an installed wheel."""
_LIBRARIES = ("lr-wpan", "spectrum", "propagation", "mobility", "network", "core")
_AS_IT_IS = ("-100", "as_is")
"""No SINR is so low that it would destroy a frame by itself; nothing is mended."""


@dataclass(frozen=True)
class Peer:
    """The compiled driver."""

    binary: Path

    def run(self, layout: Layout, period_s: Seconds, duration_s: Seconds, seed: int) -> dict[str, float]:
        """Send periodic packets over a layout's tree and return what the driver says."""
        file = self.binary.with_name(f"{layout.name}.txt")
        lines = [f"{layout.motes} {layout.propagation.reference_loss_db} {layout.propagation.exponent}"]
        lines += [f"{x} {y} {parent}" for (x, y), parent in zip(layout.xy, layout.parent, strict=True)]
        file.write_text("\n".join(lines) + "\n", "utf-8")
        words = ["tree", period_s, duration_s, PAYLOAD_BYTES, seed, *_AS_IT_IS]
        command = [str(self.binary), str(file), *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        said: dict[str, float] = json.loads(done.stdout)
        return said


def compiled(folder: Path, driver: Path = DRIVER) -> Peer | str:
    """Compile the driver, or say why there is no peer.

    Parameters
    ----------
    folder : for the binary and the layouts that it reads
    """
    if not driver.is_file():
        return f"no {driver.name}, which only a checkout of the project has (tests/benchmarks/ns3)"
    compiler = shutil.which("g++")
    if compiler is None:
        return "no g++ to compile ns-3's driver with"
    binary = folder / driver.stem
    command = [compiler, "-O2", "-std=c++17", str(driver), "-o", str(binary)]
    command += [f"-lns3-{name}" for name in _LIBRARIES]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        first = done.stderr.strip().splitlines()[0]
        return (
            f"ns-3's driver does not compile ({first}); Debian has ns-3 3.37: apt install ns3 libns3-dev g++"
        )
    return Peer(binary)
