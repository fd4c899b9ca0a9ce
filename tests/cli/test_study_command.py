"""``odscen study`` and ``odscen dataset`` on the command line; a study that is killed."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest

from tests.cli.conftest import odscen

if TYPE_CHECKING:
    from pathlib import Path


def plan(folder: Path, **parts: Any) -> Path:
    sample = {"maps": ["signal*"], "count": 2, "fill": 0.2}
    data = {"name": "s", "sample": [sample], "seeds": 3, "run": {"until": 10}, **parts}
    file = folder / "small.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return file


def test_a_plan_is_shown_without_running_it(workspace: Path, tmp_path: Path) -> None:
    given = ("--workspace", workspace, "--json", "--dry-run")
    found = odscen("study", "run", plan(tmp_path), *given)
    assert found.json == {"scenarios": 2, "variants": 1, "cases": 1, "seeds": 3, "runs": 6}
    wrong = odscen("study", "run", plan(tmp_path, seeds=0), *given)
    assert wrong.code == 2
    assert "seeds" in wrong.json["error"]["message"]
    assert not (tmp_path / "small-study").exists()


@pytest.mark.slow
def test_a_killed_study_resumes_is_extended_and_reported(workspace: Path, tmp_path: Path) -> None:
    file, place = plan(tmp_path), ("--workspace", workspace)
    command = [sys.executable, "-m", "odscen", "study", "run", file, *place, "-o", "killed"]
    killed = tmp_path / "killed"
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None and not (killed / "journal.jsonl").is_file():
            time.sleep(0.05)
        while process.poll() is None and not (killed / "journal.jsonl").stat().st_size:
            time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
    half = odscen("study", "status", killed, "--json").json
    assert 0 < half["ended"] < 6
    done = odscen("study", "resume", killed, *place, "--jobs", 2, "--json")
    assert (done.code, done.json["counts"]["completed"]) == (0, 6), done.err
    assert len((killed / "journal.jsonl").read_text("utf-8").splitlines()) == 6
    whole = odscen("study", "run", file, *place, "-o", "whole", "--jobs", 2, cwd=tmp_path)
    assert whole.code == 0, whole.err
    tables = [(tmp_path / one / "results.parquet").read_bytes() for one in ("killed", "whole")]
    assert tables[0] == tables[1]
    more = odscen("study", "extend", killed, "--seeds", "4", *place, "--jobs", 2, "--json")
    assert (more.json["runs"], more.json["ended"]) == (8, 8)
    found = odscen("study", "report", killed, "--figure", "planned", "--json")
    assert [group["runs"] for group in found.json["means"]] == [4, 4]
    assert (killed / "study.html").is_file()


@pytest.mark.slow
def test_a_dataset_is_made_in_one_command(workspace: Path, tmp_path: Path) -> None:
    study = json.loads(plan(tmp_path).read_text("utf-8"))
    file = tmp_path / "data.json"
    data = {"name": "d", "licence": "CC0-1.0", "study": {**study, "seeds": 1}}
    file.write_text(json.dumps(data), encoding="utf-8")
    given = ("-o", tmp_path / "out", "--workspace", workspace, "--jobs", 2, "--json")
    found = odscen("dataset", file, *given)
    assert (found.code, found.json["runs"], found.json["left_out"]) == (0, 2, {}), found.err
    assert len(list((tmp_path / "out/train/pyg/shard-00000").glob("*.npz"))) == 2
