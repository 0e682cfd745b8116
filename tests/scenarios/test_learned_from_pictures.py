"""A reference model from a user's pictures of the target, in a whole run."""

from pathlib import Path

import pandas as pd

import wsnsim
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.systems.multiview.viewpoints import viewpoints
from wsnsim.vision.album import write_album

SHORT = ("duration_s=2", "system.particles=100", "expect={}")


def test_an_album_of_the_same_pictures_gives_the_same_run(scenarios: Path, tmp_path: Path) -> None:
    path = scenarios / "published" / "multiview_setup_a.yaml"
    base = build(load_scenario(path, SHORT)).nodes["base"]
    (target,) = base._program._site.targets  # type: ignore[attr-defined]
    album = write_album([target.portrait(direction) for direction in viewpoints()], tmp_path / "album")
    taken = wsnsim.run(path, overrides=SHORT)
    given = (*SHORT, f"world.targets[box].learn_from={album}")
    learned = wsnsim.run(path, overrides=given, out=tmp_path / "run")
    # the album writes positions as text: directions differ in the last bit
    pd.testing.assert_frame_equal(
        learned.tables["estimates"], taken.tables["estimates"], rtol=1e-9, atol=1e-12
    )

    # the resolved scenario names the album, and what its pictures show belongs to the run's identity
    again = wsnsim.run(tmp_path / "run" / "scenario.yaml")
    assert again.tables["estimates"].equals(learned.tables["estimates"])
