"""A run folder takes over nothing that is not its own, and holds no half-written file."""

import json
import os

import pytest

from wsnsim.errors import OutputError
from wsnsim.store import folder as folder_module
from wsnsim.store.folder import RunFolder, Status, write_json, write_text

OWN = ["manifest.json", "scenario.yaml", "results.sqlite", "summary.json", "report.html"]


def test_a_new_folder_is_made_with_its_parents(tmp_path):
    RunFolder(tmp_path / "a" / "b").create()
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_a_folder_with_other_files_is_taken_and_they_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    RunFolder(tmp_path).create()
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("name", OWN)
def test_another_run_is_refused_with_both_ways_out(tmp_path, name):
    (tmp_path / name).write_text("old")
    with pytest.raises(OutputError, match=rf"found {name}; choose another --out, or .* with --force"):
        RunFolder(tmp_path).create()
    assert (tmp_path / name).read_text() == "old"


def test_force_removes_the_run_and_nothing_else(tmp_path):
    for name in [*OWN, "results.sqlite-wal", "results.sqlite-shm", "notes.txt", "results.sqlite.bak"]:
        (tmp_path / name).write_text("old")
    (tmp_path / "figures").mkdir()
    RunFolder(tmp_path).create(force=True)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["figures", "notes.txt", "results.sqlite.bak"]


def test_force_does_not_remove_a_folder_of_that_name(tmp_path):
    (tmp_path / "report.html").mkdir()
    with pytest.raises(OutputError):
        RunFolder(tmp_path).create(force=True)
    assert (tmp_path / "report.html").is_dir()


def test_force_removes_a_link_and_not_what_it_points_to(tmp_path):
    (tmp_path / "kept.json").write_text("kept")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "summary.json").symlink_to(tmp_path / "kept.json")
    RunFolder(tmp_path / "run").create(force=True)
    assert (tmp_path / "kept.json").read_text() == "kept"
    assert list((tmp_path / "run").iterdir()) == []


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(OutputError, match="output must be a folder, got a file"):
        RunFolder(tmp_path / "out").create()
    with pytest.raises(OutputError, match="--out"):
        RunFolder(tmp_path / "out" / "deeper").create()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_write_permission_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="choose a folder you may write to"):
        RunFolder(tmp_path).create()


def test_a_path_that_the_system_forbids_is_told(tmp_path, monkeypatch):
    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(folder_module.tempfile, "TemporaryFile", refuse)
    with pytest.raises(
        OutputError, match=r"'Permission denied'; choose a folder you may write to with --out"
    ):
        RunFolder(tmp_path).create()


def test_the_manifest_tells_the_status_first(tmp_path):
    folder = RunFolder(tmp_path)
    folder.write_manifest(Status.RUNNING, {"seed": 3, "name": "größe"})
    folder.write_manifest(Status.COMPLETE, {"seed": 3, "name": "größe"})
    assert list(json.loads(folder.manifest.read_text("utf-8")).items()) == [
        ("status", "complete"),
        ("seed", 3),
        ("name", "größe"),
    ]


def test_where_there_is_no_room_for_a_second_file_the_manifest_is_written_over(tmp_path, monkeypatch):
    folder = RunFolder(tmp_path)
    folder.write_manifest(Status.RUNNING, {"seed": 3, "note": "something longer"})

    def fail(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(folder_module.os, "fsync", fail)
    folder.write_manifest(Status.FAILED, {"seed": 3})
    assert json.loads(folder.manifest.read_text("utf-8")) == {"status": "failed", "seed": 3}
    assert [file.name for file in tmp_path.iterdir()] == ["manifest.json"]
    folder.manifest.unlink()
    with pytest.raises(OutputError, match=r"manifest\.json: .*No space left on device"):
        folder.write_manifest(Status.FAILED, {"seed": 3})


def test_a_folder_is_held_by_one_run_at_a_time(tmp_path):
    folder = RunFolder(tmp_path / "run")
    with folder.held():
        with (
            pytest.raises(OutputError, match="another run is writing into it; wait for its end, or choose"),
            RunFolder(tmp_path / "run").held(),
        ):
            pass
        with RunFolder(tmp_path / "other").held():
            pass
    with RunFolder(tmp_path / "run").held():
        assert list((tmp_path / "run").iterdir()) == []


def test_a_file_system_without_locks_keeps_nobody_out(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(37, "No locks available")

    monkeypatch.setattr("fcntl.flock", refuse)
    with RunFolder(tmp_path).held(), RunFolder(tmp_path).held():
        pass


def test_nan_never_reaches_a_json_file(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "s.json", {"x": float("nan")})
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file_and_no_scraps(tmp_path, monkeypatch):
    write_text(tmp_path / "report.html", "old")

    def fail(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(folder_module.os, "fsync", fail)
    with pytest.raises(OutputError, match=r"report\.html: .*No space left on device'; free some space"):
        write_text(tmp_path / "report.html", "new, half-written")
    assert (tmp_path / "report.html").read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]
