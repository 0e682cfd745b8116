import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import wsnsim
from wsnsim.kernels.jit import frozen, kernel

MODULE = """
from wsnsim.kernels.jit import kernel

@kernel
def twice(x: float) -> float:
    return 2.0 * x

@kernel
def thrice(x: float) -> float:
    return twice(x) + x
"""
CALL = "import mine; assert mine.thrice(2.0) == 6.0; print(mine.thrice.compiled._cache.__class__.__name__)"


def run(folder, call=CALL, **environment):
    paths = os.pathsep.join((str(folder), str(Path(wsnsim.__file__).parents[1])))
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": paths, **environment}
    done = subprocess.run(
        [sys.executable, "-c", call],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.py").write_text(MODULE)
    return tmp_path


def test_kernels_are_cached_beside_their_source(folder):
    assert run(folder) == "FunctionCache"
    cached = {path.name.split("-")[0] for path in (folder / "__pycache__").glob("*.nbi")}
    assert cached == {"mine.thrice", "mine.twice"}


def test_kernels_run_where_no_cache_can_be_written(folder):
    # Files where the folders of the cache would be stop even a superuser.
    (folder / "__pycache__").write_text("")
    (folder / "no_home").write_text("")
    blocked = str(folder / "no_home")
    assert run(folder, HOME=blocked, XDG_CACHE_HOME=blocked) == "NullCache"


def test_importing_kernels_does_not_import_numba():
    rooms = (
        "geometry.quadrics vision.renderer vision.features kernels.histograms world.recorded vision.photos"
    )
    code = "import sys\n" + "".join(f"import wsnsim.{room}\n" for room in rooms.split())
    code += "print([name for name in ('numba', 'scipy', 'pandas', 'PIL') if name in sys.modules])"
    environment = {**os.environ, "PYTHONPATH": str(Path(wsnsim.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_kernel_keeps_name_and_docstring():
    @kernel
    def named(x: int) -> int:
        """Say what it does."""
        return x

    assert named.__name__ == "named"
    assert named.__doc__ == "Say what it does."


def test_frozen_arrays_are_contiguous_and_read_only():
    array = np.arange(12).reshape(3, 4)
    view = frozen(array.T, np.float64)
    assert view.flags.c_contiguous
    assert view.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        view[0, 0] = 1.0
    same = frozen(array, array.dtype)
    assert np.shares_memory(same, array)
    assert array.flags.writeable


@pytest.mark.parametrize(
    ("before", "after", "doubled"),
    [("x + 1.0", "x + 3.0", [4.0, 8.0]), ("x + STEP", "x + 2.0 * STEP", [4.0, 6.0])],
)
def test_a_change_in_another_file_compiles_its_callers_anew(tmp_path, before, after, doubled):
    """What a cached kernel calls is compiled into it, and numba looks at the caller's file only."""
    imports = "from wsnsim.kernels.jit import kernel\n"
    (tmp_path / "mine.py").write_text(
        f"{imports}from other import change\n\n"
        "@kernel\ndef doubled(x: float) -> float:\n    return 2.0 * change(x)\n"
    )
    found = []
    for value in (before, after):
        (tmp_path / "other.py").write_text(
            f"{imports}STEP = 1.0\n\n@kernel\ndef change(x: float) -> float:\n    return {value}\n"
        )
        # Python tells the old bytecode of a module from the new one by the second and the size only.
        call = "import mine; print(mine.doubled(1.0))"
        found.append(float(run(tmp_path, call, PYTHONDONTWRITEBYTECODE="1")))
    assert found == doubled
