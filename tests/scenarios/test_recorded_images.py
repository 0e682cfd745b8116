"""The images that a run keeps are those that the motes' programs got, rendered once, and change nothing."""

from collections import Counter
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import wsnsim
from wsnsim.errors import ScenarioError
from wsnsim.sim.node import Node
from wsnsim.vision.frame import Frame
from wsnsim.vision.renderer import Renderer

SHORT = ("duration_s=2", "system.particles=50", "expect={}")
KEPT = ("record.images=[c3, c1]", "record.image_steps=[1, 2, 5, 99]")


def pixels(png: bytes) -> np.ndarray:
    with Image.open(BytesIO(png)) as image:
        return np.asarray(image)


def test_kept_images_are_the_frames_of_the_programs_rendered_once(
    scenarios: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames: dict[tuple[str, int], Frame] = {}
    rendered: Counter[tuple[str, int]] = Counter()
    take_frame, render = Node.take_frame, Renderer.render

    def taken(node: Node, frame: Frame) -> None:
        frames[node.id, frame.step] = frame
        take_frame(node, frame)

    def counted(renderer: Renderer, step: int, *rest: object, **more: object) -> object:
        rendered[renderer.camera_id, step] += 1
        return render(renderer, step, *rest, **more)

    monkeypatch.setattr(Node, "take_frame", taken)
    monkeypatch.setattr(Renderer, "render", counted)
    images = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, *KEPT)).tables["images"]
    assert list(zip(images["camera"], images["step"], strict=True)) == [
        (camera, step) for step in (1, 2, 5) for camera in ("c1", "c3")
    ]
    assert images["time_s"].tolist() == [0.25, 0.25, 0.5, 0.5, 1.25, 1.25]
    for row in images.to_dict("records"):
        frame = frames[row["camera"], row["step"]]
        assert np.array_equal(pixels(row["png"]), frame.image)
        assert rendered[row["camera"], row["step"]] == 1


def test_a_run_that_keeps_images_is_otherwise_the_same_run(scenarios: Path) -> None:
    bare = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, "record.images=[]"))
    keeps = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, *KEPT))
    again = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, *KEPT))
    assert bare.tables["images"].empty
    for name, table in keeps.tables.items():
        assert again.tables[name].equals(table)
        if name != "images":
            assert bare.tables[name].equals(table)


def test_an_image_that_was_not_taken_is_not_kept(scenarios: Path) -> None:
    """A TelosB needs longer than a period for a frame: it skips the next ones."""
    slow = ("motes.default.platform=telosb", "record.images=[c1]", "record.image_steps=[1, 2, 3]")
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, *slow))
    skipped = run.tables["events"].query("kind == 'frame_skipped' and node == 'c1'")["detail"].str[:7]
    assert run.tables["images"]["step"].tolist() == [1]
    assert {"frame 2", "frame 3"} <= set(skipped)


def test_without_steps_the_first_and_every_tenth_are_kept(scenarios: Path) -> None:
    few = (
        "duration_s=5.5",
        "system.particles=20",
        "expect={}",
        "record.images=[c2]",
        "network.standard=ideal",
    )
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=few)
    assert run.tables["images"]["step"].tolist() == [1, 10, 20]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (
            "  images: [c1, c44]",
            'record.images[1]: must be the id of a camera, got "c44"; did you mean "c4"?',
        ),
        (
            "  images: [c1, c1]",
            'record.images[1]: must be named once, got "c1", which record.images[0] is too',
        ),
        ("  images: [relay]", 'record.images[0]: must be the id of a camera, got "relay"'),
        ("  image_steps: [0]", "record.image_steps[0]: must be"),
    ],
)
def test_a_wrong_wish_is_told_with_its_line(scenarios: Path, tmp_path: Path, line: str, says: str) -> None:
    text = (scenarios / "quickstart.yaml").read_text().split("\nrecord:")[0]
    file = tmp_path / "scenario.yaml"
    file.write_text(f"{text}\nrecord:\n{line}\n")
    number = file.read_text().splitlines().index(line) + 1
    with pytest.raises(ScenarioError) as told:
        wsnsim.load(file)
    (problem,) = told.value.problems
    assert str(problem).startswith(f"{file}:{number}:")
    assert says in str(problem)
