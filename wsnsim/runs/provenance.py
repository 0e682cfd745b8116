"""What a result was made with: versions, platform, time, memory."""

import platform
import resource
import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from wsnsim import __version__

_LIBRARIES = ("simpy", "numpy", "scipy", "networkx", "pandas", "numba", "pydantic", "PyYAML", "Pillow")


def provenance() -> dict[str, Any]:
    """Return versions of wsnsim, Python and the libraries that can touch a number, and the platform."""
    return {
        "wsnsim": __version__,
        "python": platform.python_version(),
        "libraries": {name: _version(name) for name in _LIBRARIES},
        "platform": platform.platform(),
        "machine": platform.machine(),
    }


def peak_memory_bytes() -> int:
    """Return the most memory this process has held so far [bytes]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
