"""The recipes of docs/ci.md: the scripts run as they stand there, and what calls them fits."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from lxml import etree

from tests.experiments.conftest import ROOT, write_tiny

TEXT = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")


SCRIPTS = ("ci.sh", "merge.sh")


def recipe(title):
    (found,) = re.findall(
        rf'^```\w+ title="{re.escape(title)}"\n(.*?)^```$', TEXT, re.MULTILINE | re.DOTALL
    )
    return found


@pytest.fixture
def project(tiny_baseline, tmp_path):
    """A fresh clone of a project as docs/ci.md has it: three scenarios, baselines, the scripts."""
    origin = tmp_path / "origin"
    suite = write_tiny(origin / "traffic", "a", "b", "c")
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
    for name in SCRIPTS:
        (folder / name).write_text(recipe(f"traffic/{name}"))
    git(origin, "init", "--quiet")
    git(origin, "add", ".")
    git(origin, "-c", "user.name=a", "-c", "user.email=a@b.c", "commit", "--quiet", "-m", "Start")
    git(tmp_path, "clone", "--quiet", "origin", "clone")
    return tmp_path / "clone"


def git(folder, *arguments):
    subprocess.run(["git", *arguments], cwd=folder, check=True)


def run_script(project, name, *arguments):
    """As CI does, with this Python and this odscen installed."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "PIP_NO_INDEX": "1"}
    return subprocess.run(
        ["sh", f"traffic/{name}", *arguments],
        cwd=project,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_the_script_runs_in_a_fresh_clone_and_leaves_what_is_promised(project):
    done = run_script(project, "ci.sh")
    assert done.returncode == 0, done.stdout + done.stderr
    out = project / "build" / "traffic" / "part-1"
    assert etree.parse(out / "junit.xml").getroot().get("tests") == "6"
    assert "All scenarios pass" in (out / "index.html").read_text()
    assert "3 passed" in (out / "summary.md").read_text()
    assert (out / "runs" / "a" / "seed-1" / "report.html").is_file()
    assert [path.name for path in (project / "build" / "workspace" / "suite-maps").iterdir()]


@pytest.mark.slow
def test_parts_end_with_their_own_codes_and_are_merged_to_one_page_with_all_reports(project):
    (project / "traffic" / "baselines" / "b.json").unlink()
    codes = [run_script(project, "ci.sh", f"{part}/3").returncode for part in (1, 2, 3)]
    assert codes == [0, 1, 0]
    moved = project / "elsewhere"
    (project / "build").rename(moved)  # as an artifact, on a machine that has built no map
    (project / "build").mkdir()
    (moved / "traffic").rename(project / "build" / "traffic")
    done = run_script(project, "merge.sh")
    assert done.returncode == 1, done.stdout + done.stderr
    out = project / "build" / "traffic"
    assert etree.parse(out / "junit.xml").getroot().get("tests") == "6"
    assert "1 new, 2 passed" in (out / "summary.md").read_text()
    page = (out / "index.html").read_text()
    assert "1 of 3 scenarios do not pass" in page
    (link,) = re.findall(r'href="(part-[^"]+)"', page)
    assert link == "part-2/runs/b/seed-1/report.html"
    assert (out / link).is_file()


@pytest.mark.slow
def test_a_part_that_died_shows_when_the_others_are_merged(project):
    for part in (1, 3):
        assert run_script(project, "ci.sh", f"{part}/3").returncode == 0
    done = run_script(project, "merge.sh")
    assert done.returncode == 2
    assert "b: none of the parts has run it" in done.stderr


@pytest.mark.parametrize("title", [".github/workflows/traffic.yml", ".gitlab-ci.yml"])
def test_what_ci_calls_is_the_scripts_and_what_it_keeps_is_what_they_write(title):
    yaml = pytest.importorskip("yaml")
    steps = yaml.safe_load(recipe(title))
    assert "traffic" in str(steps)
    for script in ("traffic/ci.sh", "traffic/merge.sh"):
        commands = [line for line in recipe(title).splitlines() if f"sh {script}" in line]
        assert len(commands) == 1
    texts = [recipe(f"traffic/{name}").replace("$out", "build/traffic") for name in SCRIPTS]
    written = set(re.findall(r"build/[\w./]+", "\n".join(texts)))
    kept = set(re.findall(r"build/[\w./]+", recipe(title)))
    assert kept
    for path in kept:
        assert any(own.startswith(path.rstrip("/")) for own in written), path


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count"), [("ci.sh", 8), ("merge.sh", 5)])
def test_the_options_of_the_scripts_are_those_of_the_command(name, count):
    text = recipe(f"traffic/{name}").replace("\\\n", " ")
    words = shlex.split(text, comments=True)
    help_text = subprocess.run(
        [sys.executable, "-m", "odscen", "test", "--help"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    options = [word for word in words[words.index("test") :] if word.startswith("--")]
    assert len(options) == count
    assert all(option in help_text for option in options)


@pytest.mark.slow
def test_a_suite_runs_with_what_is_left_of_a_smaller_installation(tiny_baseline, tmp_path):
    installed = Path(sysconfig.get_path("purelib"))
    site = tmp_path / "site"
    parts = ("sumo", "sumo_data", "libsumo", "eclipse_sumo.libs", "libsumo.libs")
    if any(not (installed / part).is_dir() for part in parts):
        pytest.skip("SUMO is laid out otherwise here")
    try:
        for part in parts:  # links: nothing is removed but from the copy
            shutil.copytree(installed / part, site / part, copy_function=os.link)
    except (OSError, shutil.Error):
        pytest.skip("the environment is on another file system")
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.write_text(f"#!/bin/sh\necho {shlex.quote(str(site))}\n")
    python.chmod(0o755)
    script = tmp_path / "slim.sh"
    script.write_text(recipe("traffic/slim.sh"))
    path = f"{python.parent}{os.pathsep}{os.environ['PATH']}"
    subprocess.run(["sh", str(script)], env=os.environ | {"PATH": path}, check=True)
    assert not (site / "sumo_data").exists()
    assert (installed / "sumo_data").is_dir()
    one, other = next((site / "libsumo.libs").iterdir()), "eclipse_sumo.libs"
    assert one.samefile(site / other / one.name)
    suite = write_tiny(tmp_path / "suite", "one")
    (suite.parent / "baselines").mkdir()
    shutil.copy(tiny_baseline, suite.parent / "baselines")
    code = "import sys, sumo; assert sumo.__file__.startswith(sys.argv[1])"
    search = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    environment = os.environ | {"PYTHONPATH": search}
    subprocess.run([sys.executable, "-c", code, str(site)], env=environment, check=True)
    done = subprocess.run(
        [sys.executable, "-m", "odscen", "test", str(suite), "--workspace", str(tmp_path / "ws")],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
