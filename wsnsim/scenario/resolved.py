"""A scenario with nothing left open, as YAML to run again and as a hash to compare by."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.schema_base import PHOTO_PREFIX
from wsnsim.scenario.yaml_write import yaml_text

_HEADER = """\
# The scenario as it was run, every default written out.
# Running this file again gives the same results.
"""


def resolved_yaml(loaded: LoadedScenario, target_dir: Path | None = None) -> str:
    """Write a scenario with every default, so that it runs again from another folder.

    Parameters
    ----------
    loaded : the scenario
    target_dir : where the text will be written; files inside that folder are named from there, so that
        the folder can be moved, all others by their absolute paths
    """
    data = _with_files(loaded, lambda file: _place(file, target_dir))
    return _HEADER + yaml_text(data)


def scenario_hash(loaded: LoadedScenario) -> str:
    """Return the SHA-256 of what a run depends on, in hexadecimal.

    Files count by their contents, not by where they are; keys count in no order.

    Raises
    ------
    OSError : a file that the scenario names is gone
    """
    digests: dict[Path, str] = {}

    def digest(file: Path) -> str:
        if file not in digests:
            digests[file] = f"sha256:{hashlib.sha256(file.read_bytes()).hexdigest()}"
        return digests[file]

    from wsnsim.vision.album import album_pictures

    data = _with_files(loaded, digest)
    world = loaded.scenario.world
    targets = () if world is None else world.targets
    albums = [target.learn_from for target in targets if target.learn_from is not None]
    pictures = [picture for album in albums for picture in album_pictures(loaded.resolve_path(album))]
    data["pictures"] = [digest(picture) for picture in pictures]
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _with_files(loaded: LoadedScenario, name: Callable[[Path], str]) -> dict[str, Any]:
    """Return the scenario as plain data in which each file stands as `name` writes it."""
    data = loaded.scenario.model_dump(mode="json")
    world = data["world"] or {"targets": [], "people": []}
    for mover in (*world["targets"], *world["people"]):
        motion = mover["motion"]
        for key in ("file", "homography"):
            if motion.get(key) is not None:
                motion[key] = name(loaded.resolve_path(motion[key]))
    for target in world["targets"]:
        if target["learn_from"] is not None:
            target["learn_from"] = name(loaded.resolve_path(target["learn_from"]))
    for section in (data["network"]["propagation"], data["network"]["noise"] or {}):
        if "file" in section:
            section["file"] = name(loaded.resolve_path(section["file"]))
    for camera in data["cameras"]:
        holder, key = camera, "background"
        if isinstance(camera["background"], dict):
            holder = camera["background"]
            key = "file" if holder["kind"] == "video" else "source"
        if key == "file" or not holder[key].startswith(PHOTO_PREFIX):
            holder[key] = name(loaded.resolve_path(holder[key]))
    return data


def _place(file: Path, target_dir: Path | None) -> str:
    """Write a path as text, from `target_dir` on where the file lies inside it."""
    if target_dir is not None and file.is_relative_to(target_dir.absolute()):
        # With the dot, a folder named `photo` is not taken for the package's photographs.
        return f"./{file.relative_to(target_dir.absolute()).as_posix()}"
    return str(file)
