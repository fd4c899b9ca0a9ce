from __future__ import annotations

from pathlib import Path

import pytest

from odscen.app.reports import renew_report
from odscen.app.runs import run
from odscen.base.errors import InputError
from odscen.regression.compare import read_runs
from odscen.sumo.realize.run_settings import RunSettings
from odscen.workspace.store import Workspace


@pytest.fixture(scope="module")
def finished(workspace: Workspace, sampled: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("damaged")
    return run(workspace, sampled, settings=RunSettings(until=20.0), out=out).folder


DAMAGE = (b"", b"\xff" * 40, b"[" * 100_000, b"[]", b'{"status": "completed", "seed": 1}')


@pytest.mark.parametrize(
    ("name", "compared"),
    [
        ("summary.json", True),
        ("plan.json", False),
        ("actors.json", True),
        ("events.json", False),
        ("signals.json", False),
        ("trajectories.parquet", True),
        ("signal_states.parquet", False),
        ("lane_places.json", True),
        ("figures/segments.csv", True),
    ],
)
def test_a_report_or_a_comparison_of_a_damaged_run_names_the_run(
    workspace: Workspace, finished: Path, tmp_path: Path, name: str, compared: bool
) -> None:
    file = finished / name
    whole = file.read_bytes()
    said: dict[str, list[str]] = {"report": [], "comparison": []}
    try:
        for damaged in (*DAMAGE, whole[: len(whole) // 2]):
            file.write_bytes(damaged)
            for what, found in said.items():
                try:
                    if what == "report":
                        renew_report(workspace, finished, out=tmp_path / "report.html")
                    else:
                        read_runs(finished)
                except InputError as error:
                    found.append(str(error))
    finally:
        file.write_bytes(whole)
    assert bool(said["comparison"]) == compared
    assert bool(said["report"]) == (name != "lane_places.json")
    assert [one for found in said.values() for one in found if str(finished) not in one] == []
    renew_report(workspace, finished, out=tmp_path / "report.html")
