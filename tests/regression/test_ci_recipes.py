"""The recipes of docs/ci.md: the script runs as it stands there, and what it is called by fits."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from lxml import etree

from tests.regression.conftest import ROOT, write_tiny

TEXT = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")


def recipe(title):
    (found,) = re.findall(
        rf'^```\w+ title="{re.escape(title)}"\n(.*?)^```$', TEXT, re.MULTILINE | re.DOTALL
    )
    return found


@pytest.fixture
def project(tiny_baseline, tmp_path):
    """A project as docs/ci.md has it: three scenarios with baselines, and the script."""
    suite = write_tiny(tmp_path / "traffic", "a", "b", "c")
    folder = suite.parent
    suite.rename(folder / "suite.toml")
    (folder / "scenarios").mkdir()
    (folder / "baselines").mkdir()
    for name in ("a", "b", "c"):
        shutil.move(folder / f"{name}.scenario.json", folder / "scenarios")
        shutil.copy(tiny_baseline, folder / "baselines" / f"{name}.json")
    text = (folder / "suite.toml").read_text().replace('"*.scenario', '"scenarios/*.scenario')
    (folder / "suite.toml").write_text(text)
    (folder / "requirements.txt").write_text("odscen\n")
    (folder / "ci.sh").write_text(recipe("traffic/ci.sh"))
    return tmp_path


def run_script(project, *arguments):
    """As CI does, with this Python and this odscen installed."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "PIP_NO_INDEX": "1"}
    return subprocess.run(
        ["sh", "traffic/ci.sh", *arguments],
        cwd=project,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_script_runs_in_a_fresh_folder_and_leaves_what_is_promised(project):
    done = run_script(project)
    assert done.returncode == 0, done.stdout + done.stderr
    out = project / "build" / "traffic"
    assert etree.parse(out / "junit.xml").getroot().get("tests") == "6"
    assert "All scenarios pass" in (out / "index.html").read_text()
    assert "3 passed" in (out / "summary.md").read_text()
    assert (out / "runs" / "a" / "seed-1" / "report.html").is_file()
    assert [path.name for path in (project / "build" / "workspace" / "maps").iterdir()]


def test_a_part_of_the_suite_ends_with_its_own_code_and_links_to_its_reports(project):
    (project / "traffic" / "baselines" / "b.json").unlink()
    done = run_script(project, "2/3")
    assert done.returncode == 1, done.stderr
    page = (project / "build" / "traffic" / "index.html").read_text()
    assert "1 of 1 scenarios do not pass" in page
    (link,) = re.findall(r'href="(runs/[^"]+)"', page)
    assert (project / "build" / "traffic" / link).is_file()


@pytest.mark.parametrize("title", [".github/workflows/traffic.yml", ".gitlab-ci.yml"])
def test_what_ci_calls_is_the_script_and_what_it_keeps_is_what_the_script_writes(title):
    yaml = pytest.importorskip("yaml")
    steps = yaml.safe_load(recipe(title))
    assert "traffic" in str(steps)
    commands = [line for line in recipe(title).splitlines() if "traffic/ci.sh" in line]
    assert len(commands) == 1
    written = set(re.findall(r"build/[\w./]+", recipe("traffic/ci.sh")))
    kept = set(re.findall(r"build/[\w./]+", recipe(title)))
    assert kept
    for path in kept:
        assert any(own.startswith(path.rstrip("/")) for own in written), path


def test_the_options_of_the_script_are_those_of_the_command():
    words = shlex.split(recipe("traffic/ci.sh").replace("\\\n", " "), comments=True)
    help_text = subprocess.run(
        [sys.executable, "-m", "odscen", "test", "--help"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    options = [word for word in words[words.index("test") :] if word.startswith("--")]
    assert len(options) == 7
    assert all(option in help_text for option in options)
