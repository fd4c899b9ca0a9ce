"""The Dockerfile against the repository: its context is whole, its steps are commands of ours."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tools.container_steps import committed_files, context_files, instructions
from tools.release_notes import ReleaseError, own_version, release_notes

ROOT = Path(__file__).parents[1]
STEPS = instructions((ROOT / "Dockerfile").read_text())


def words_of(name: str) -> list[str]:
    return [step.words for step in STEPS if step.name == name]


@pytest.fixture(scope="module")
def sent() -> list[str]:
    if not (ROOT / ".git").exists():
        pytest.skip("this is no clone of the repository")
    return context_files((ROOT / ".dockerignore").read_text(), committed_files())


@pytest.mark.slow
def test_the_context_has_all_that_the_wheel_is_built_from_and_nothing_else(sent: list[str]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    hatch = project["tool"]["hatch"]
    wheel = hatch["build"]["targets"]["wheel"]
    named = {"pyproject.toml", project["project"]["readme"], *project["project"]["license-files"]}
    named |= {wheel["hooks"]["custom"]["path"], hatch["version"]["path"]}
    named |= {"tools/slim_sumo.sh", "frontend/package-lock.json", "frontend/package.json"}
    assert named <= set(sent)
    folders = (*wheel["packages"], *wheel["force-include"], "frontend")
    for folder in folders:
        inside = {file for file in committed_files() if file.startswith(f"{folder}/")}
        assert inside
        assert inside <= set(sent)
    rest = {file for file in sent if not file.startswith(tuple(f"{name}/" for name in folders))}
    inside = {file for file in named if file.startswith(tuple(f"{name}/" for name in folders))}
    assert rest == (named - inside) | {"Dockerfile"}


def test_what_is_not_committed_stays_outside() -> None:
    ignored = (ROOT / ".dockerignore").read_text()
    there = [".env", ".git/config", "frontend/node_modules/a/b.js", "src/odscen/web/static/x.js",
             "src/odscen/__pycache__/a.pyc", "tests/a.py", "tools/other.py"]  # fmt: skip
    assert context_files(ignored, [*there, "src/odscen/rl.py"]) == ["src/odscen/rl.py"]


def test_the_image_starts_the_page_for_others_with_its_token_on_a_volume() -> None:
    (entry,), (command,) = words_of("ENTRYPOINT"), words_of("CMD")
    assert json.loads(entry) == ["odscen"]
    name, *options = json.loads(command)
    done = subprocess.run(
        [sys.executable, "-m", "odscen", name, "--help"], capture_output=True, text=True, check=True
    )
    assert all(option in done.stdout for option in options if option.startswith("--"))
    assert "--no-token" not in options
    (volume,) = words_of("VOLUME")
    assert f"ODSCEN_WORKSPACE={volume}" in words_of("ENV")
    assert words_of("USER")[-1].isdigit()
    assert words_of("USER")[-1] != "0"
    text = (ROOT / "compose.yaml").read_text()
    assert f"workspace:{volume}" in text
    assert "${ODSCEN_TOKEN:?" in text
    assert f"127.0.0.1:8420:{words_of('EXPOSE')[0]}" in text


def test_the_stages_copy_from_where_the_wheel_is_built() -> None:
    (work,) = words_of("WORKDIR")
    runs = words_of("RUN")
    assert "pip wheel" in runs[0]
    installing = next(run for run in runs if "pip install" in run)
    assert f"source={work},target={work}" in installing
    folder = re.findall(r"--wheel-dir (\S+)", runs[0])[0]
    assert f"{work}/{folder}/*.whl" in installing
    assert f"sh {work}/tools/slim_sumo.sh" in installing


def test_what_is_removed_of_sumo_is_what_the_recipe_for_ci_removes() -> None:
    def commands(text: str) -> list[str]:
        return [line for line in text.splitlines() if line and not line.startswith("#")]

    recipe = re.findall(
        r'title="traffic/slim.sh"\n(.*?)```', (ROOT / "docs/ci.md").read_text(), re.DOTALL
    )
    assert commands((ROOT / "tools/slim_sumo.sh").read_text()) == commands(recipe[0])


CHANGES = (
    "# Changelog\n\n## 0.3.0 (unreleased)\n\n- New\n\n## 0.2.0 (2026-12-01)\n\n- Old\n- Older\n"
)


def test_the_notes_of_a_release_are_those_of_the_changelog() -> None:
    assert release_notes(CHANGES, "0.2.0", own="0.2.0") == "- Old\n- Older\n"
    for version, own, words in (
        ("0.3.0", "0.3.0", "calls 0.3.0 unreleased"),
        ("0.2.0", "0.3.0", "the tag is 0.2.0, but the package is 0.3.0"),
        ("0.4.0", "0.4.0", "says nothing of 0.4.0"),
    ):
        with pytest.raises(ReleaseError, match=words):
            release_notes(CHANGES, version, own=own)
    assert f"\n## {own_version()}" in (ROOT / "CHANGELOG.md").read_text()
