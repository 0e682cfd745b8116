"""A newcomer's first commands: a folder that runs as it is, its schema, and completion in the shell."""

import json
import os
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from wsnsim.runs.json_schema import scenario_json_schema
from wsnsim.scenario.load import load_scenario

ROOT = Path(__file__).parents[2]


def wsnsim(*arguments: str | Path, cwd: Path | None = None, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "wsnsim", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, **env},
    )


def test_a_new_folder_runs_at_once_and_meets_its_expectations(tmp_path: Path) -> None:
    made = wsnsim("init", "my-yard", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    assert "cd my-yard && wsnsim run scenario.yaml" in made.stdout
    folder = tmp_path / "my-yard"
    assert {file.name for file in folder.iterdir()} == {"scenario.yaml", "wsnsim.schema.json"}
    first = (folder / "scenario.yaml").read_text("utf-8").splitlines()[0]
    assert first == "# yaml-language-server: $schema=wsnsim.schema.json"
    assert json.loads((folder / "wsnsim.schema.json").read_text("utf-8")) == scenario_json_schema()
    done = wsnsim("run", "scenario.yaml", "--set", "duration_s=4", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "runs" / "my-yard-seed1" / "report.html").exists()


def test_what_is_there_already_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "x").mkdir()
    (tmp_path / "x" / "notes.txt").write_text("mine")
    (tmp_path / "x" / "scenario.yaml").write_text("mine too")
    refused = wsnsim("init", "x", cwd=tmp_path)
    assert refused.returncode == 2
    assert "x/scenario.yaml: must not exist yet; choose another folder" in refused.stderr
    assert sorted(file.name for file in (tmp_path / "x").iterdir()) == ["notes.txt", "scenario.yaml"]
    (tmp_path / "x" / "scenario.yaml").unlink()
    here = wsnsim("init", ".", cwd=tmp_path / "x")
    assert here.returncode == 0
    assert "Next: wsnsim run scenario.yaml" in here.stdout
    assert (tmp_path / "x" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["12", "null", "1.5", "größe", "a.b-c_d"])
def test_the_scenario_takes_the_folders_name(tmp_path: Path, name: str) -> None:
    assert wsnsim("init", name, cwd=tmp_path).returncode == 0
    assert load_scenario(tmp_path / name / "scenario.yaml").scenario.name == name


def test_a_folder_whose_name_is_no_scenarios_is_refused(tmp_path: Path) -> None:
    refused = wsnsim("init", "my yard", cwd=tmp_path)
    assert refused.returncode == 2
    assert "must be a scenario's name" in refused.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_starter_ships_with_the_package_and_shows_every_section() -> None:
    text = (files("wsnsim.cli") / "assets" / "scenario.yaml").read_text("utf-8")
    sections = {line.split(":")[0] for line in text.splitlines() if line[:1].isalpha()}
    assert sections == set(scenario_json_schema()["properties"])


def test_the_schema_goes_to_stdout_or_into_a_file(tmp_path: Path) -> None:
    printed = wsnsim("schema")
    assert printed.returncode == 0
    assert json.loads(printed.stdout)["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    written = wsnsim("schema", "--out", tmp_path / "wsnsim.schema.json")
    assert (written.returncode, written.stdout) == (0, "")
    assert (tmp_path / "wsnsim.schema.json").read_text("utf-8") == printed.stdout
    nowhere = wsnsim("schema", "--out", tmp_path / "no" / "folder.json")
    assert nowhere.returncode == 1
    assert "Traceback" not in nowhere.stderr


COMPLETE = """
eval "$(wsnsim completion bash 2>/dev/null)"
COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
_wsnsim_completion wsnsim
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("wsnsim va", ["validate"]),
        ("wsnsim run sce", ["scenes/deep/b.yml", "scenes/a.yaml"]),
        ("wsnsim validate scenes/a", ["scenes/a.yaml"]),
        ("wsnsim run --qu", ["--quiet"]),
        ("wsnsim completion f", ["fish"]),
    ],
)
def test_bash_completes_commands_options_and_scenario_files(
    tmp_path: Path, words: str, offered: list[str]
) -> None:
    (tmp_path / "scenes" / "deep").mkdir(parents=True)
    for name in ("scenes/a.yaml", "scenes/deep/b.yml", "scenes/notes.txt", "scenes/.hidden.yaml"):
        (tmp_path / name).touch()
    bin_folder = tmp_path / "bin"
    bin_folder.mkdir()
    command = bin_folder / "wsnsim"
    command.write_text(f"#!{sys.executable}\nfrom wsnsim.cli import main\nmain()\n")
    command.chmod(0o755)
    done = subprocess.run(
        ["bash", "-c", COMPLETE.format(words=words)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PATH": f"{bin_folder}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT)},
    )
    assert sorted(done.stdout.split()) == sorted(offered), done.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_shell_has_a_script(shell: str) -> None:
    done = wsnsim("completion", shell)
    assert done.returncode == 0
    assert f"_WSNSIM_COMPLETE={shell}_complete" in done.stdout
    assert wsnsim("completion", "tcsh").returncode == 2
