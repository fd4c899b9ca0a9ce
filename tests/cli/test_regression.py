import json
import re
import shutil
import subprocess
import sys

import pytest
from lxml import etree

from tests.cli.conftest import odscen
from tests.experiments.conftest import write_tiny


@pytest.fixture(scope="module")
def suite(workspace, tmp_path_factory):
    """Three tiny scenarios with baselines."""
    file = write_tiny(tmp_path_factory.mktemp("suite") / "tiny", "a", "b", "c")
    done = odscen("test", file, "--update-baseline", "--workspace", workspace)
    assert done.code == 0, done.err
    return file


@pytest.mark.slow
def test_a_suite_writes_page_junit_and_summary_and_ends_with_the_worst_code(
    suite, workspace, tmp_path
):
    shutil.copytree(suite.parent, tmp_path / "copy")
    (tmp_path / "copy" / "b.scenario.json").write_text("{")
    (tmp_path / "copy" / "baselines" / "c.json").unlink()
    files = {name: tmp_path / f"out.{name}" for name in ("junit", "html", "summary")}
    options = [text for name, path in files.items() for text in (f"--{name}", path)]
    done = odscen("test", tmp_path / "copy" / suite.name, *options, "--json",
                  "--workspace", workspace, "--out", tmp_path / "runs")  # fmt: skip
    assert done.code == 2, done.err
    assert done.json["verdicts"] == {"error": 1, "new": 1, "passed": 1}
    root = etree.parse(files["junit"]).getroot()
    assert {key: root.get(key) for key in ("tests", "errors", "failures")} == {
        "tests": "5",
        "errors": "1",
        "failures": "1",
    }
    assert "2 of 3 scenarios do not pass" in files["html"].read_text()
    assert files["summary"].read_text().startswith("## :x: tiny")
    assert (tmp_path / "runs" / "a" / "seed-1" / "report.html").is_file()
    told = done.err.splitlines()
    assert told[0].startswith("b: "), "the worst first"
    nested = odscen("compare", tmp_path / "runs", tmp_path / "runs")
    assert nested.code == 2
    assert "runs of 2 scenarios, one folder further down" in nested.err
    assert str(tmp_path / "runs" / "a") in nested.err


@pytest.mark.slow
def test_shards_share_a_suite_out(suite, workspace):
    done = [
        odscen("test", suite, "--shard", f"{part}/2", "--json", "--workspace", workspace)
        for part in (1, 2)
    ]
    assert [[case["name"] for case in one.json["cases"]] for one in done] == [["a", "c"], ["b"]]
    assert [one.code for one in done] == [0, 0]


@pytest.mark.slow
def test_options_that_make_no_sense_are_refused(suite, workspace):
    for options, words in (
        (("--shard", "3/2"), "'3/2' is no part of a suite"),
        (("--shard", "first"), "'first' is no part of a suite"),
        (("--force",), "it goes with --update-baseline"),
    ):
        done = odscen("test", suite, *options, "--workspace", workspace)
        assert (done.code, words in done.err) == (2, True), done.err


@pytest.mark.slow
def test_the_summary_is_added_to_what_github_has_of_the_step(
    suite, workspace, tmp_path, monkeypatch
):
    file = tmp_path / "summary.md"
    file.write_text("before\n")
    options = ("--summary", file, "--shard", "2/2", "--workspace", workspace)
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(file))
    assert odscen("test", suite, *options).code == 0
    assert file.read_text().startswith("before\n## :white_check_mark: tiny\n\n1 passed\n")
    monkeypatch.delenv("GITHUB_STEP_SUMMARY")
    assert odscen("test", suite, *options).code == 0
    assert file.read_text().startswith("## :white_check_mark: tiny")


@pytest.mark.slow
def test_several_scenarios_are_checked_at_once(suite, workspace, tmp_path):
    good = suite.parent / "a.scenario.json"
    unreadable, misfit = tmp_path / "x.scenario.json", tmp_path / "y.scenario.json"
    unreadable.write_text("{")
    document = json.loads(good.read_text())
    document["actors"][0]["spawn"] = "9.9.9.9"
    misfit.write_text(json.dumps(document))
    options = ("--json", "--workspace", workspace)
    done = odscen("check", unreadable, good, misfit, *options)
    assert done.code == 2
    assert [file["valid"] for file in done.json["files"]] == [False, True, False]
    assert str(unreadable) in done.json["files"][0]["error"]["message"]
    assert done.json["files"][2]["problems"][0]["severity"] == "error"
    assert odscen("check", good, good, *options).json["valid"] is True
    assert odscen("check", good, *options).json["file"] == str(good)


def python(*arguments):
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_brackets_of_an_extra_are_written_as_they_are(workspace, tmp_path):
    """As if nothing optional were installed: the names of the packages are looked up."""
    code = (
        "from importlib import metadata\n"
        "import odscen.cli.doctor_command as doctor\n"
        "found = metadata.version\n"
        "def version(name):\n"
        "    if name in doctor.OPTIONAL:\n"
        "        raise metadata.PackageNotFoundError(name)\n"
        "    return found(name)\n"
        "metadata.version = version\n"
        "from odscen.cli import main\n"
        "main()\n"
    )
    script = tmp_path / "doctor.py"
    script.write_text(code)
    done = python(script, "doctor", "--workspace", workspace)
    assert done.returncode == 0, done.stderr
    words = re.sub(r"\s+", " ", done.stdout)
    assert "pip install 'odscen[png]'" in words
    assert "'odscen[carla]'" in words


def test_the_help_says_what_is_done_without_an_option():
    words = re.sub(r"[\s│]+", " ", odscen("run", "--help").out)
    assert "Folder for the runs. (default: the workspace's runs)" in words


@pytest.mark.slow
def test_the_results_of_parts_are_merged_to_one_verdict(suite, workspace, tmp_path):
    for part in (1, 2):
        file = tmp_path / "parts" / str(part) / "results.json"
        options = ("--shard", f"{part}/2", "--results", file, "--workspace", workspace)
        assert odscen("test", suite, *options).code == 0
    junit = tmp_path / "junit.xml"
    options = ("--merge", tmp_path / "parts", "--junit", junit, "--json", "--workspace", workspace)
    done = odscen("test", suite, *options)
    assert done.code == 0, done.err
    assert done.json["verdicts"] == {"passed": 3}
    assert etree.parse(junit).getroot().get("tests") == "6"
    done = odscen("test", suite, "--merge", tmp_path / "parts" / "1", "--workspace", workspace)
    assert done.code == 2
    assert "b: none of the parts has run it" in done.err


@pytest.mark.slow
def test_other_seeds_are_chosen_on_the_command_line(suite, workspace, tmp_path):
    shutil.copytree(suite.parent, tmp_path / "copy")
    copy = tmp_path / "copy" / suite.name
    options = ("--workspace", workspace, "--json")
    done = odscen("test", copy, "--seeds", "9", "--shard", "1/3", "--update-baseline", *options)
    assert done.code == 0, done.err
    assert done.json["cases"][0]["seeds"] == list(range(1, 10))
    done = odscen("test", copy, "--seeds", "101-108", "--shard", "1/3", *options)
    assert done.code == 0, done.err
    assert done.json["cases"][0]["seeds"] == list(range(101, 109))
