"""What all tests share: the project's scenarios, a finished run of the quickstart, and made-up runs."""

import importlib.util
import os
from pathlib import Path
from types import ModuleType

import pytest

from wsnsim.runs.result import Run
from wsnsim.runs.run import run

ROOT = Path(__file__).parent.parent
SCENARIOS = ROOT / "scenarios"


def _beside(name: str) -> ModuleType:
    """Return a module of this folder, which is no package and not on the import path."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# pytest finds a fixture by its name in conftest
synthetic_run = _beside("synthetic").synthetic_run


@pytest.fixture(scope="session")
def scenarios() -> Path:
    """Return the folder of the scenarios that ship with the project."""
    return SCENARIOS


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of reference data beside the project; tests that need it skip without it."""
    folder = Path(os.environ.get("WSNSIM_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no reference data at {folder}; name its folder in WSNSIM_SHARED")
    return folder


@pytest.fixture(scope="session")
def test_seed() -> int:
    """Return the seed of tests that draw, set from outside by WSNSIM_TEST_SEED."""
    return int(os.environ.get("WSNSIM_TEST_SEED", "0"))


@pytest.fixture(scope="session")
def quickstart(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a finished run of the quickstart, in a folder."""
    return run(SCENARIOS / "quickstart.yaml", out=tmp_path_factory.mktemp("quickstart") / "run")
