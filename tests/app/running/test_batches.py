"""Several runs at a time: their order, what ends all of them, and Ctrl-C."""

from __future__ import annotations

import _thread
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from odscen.app.running.batches import run_all
from odscen.app.running.runs import CheckedRun, check_file
from odscen.base.errors import InputError, WorkspaceError
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.sumo_simulator import SumoSimulator
from tests.reporters import Listener


class Failing(SumoSimulator):
    """Cannot prepare a run."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    def prepare(self, *_: Any) -> SumoPreparedRun:
        raise self.error


@pytest.fixture
def checked(workspace: Workspace, sampled: Path, tmp_path: Path) -> Any:
    """A function: name, seconds and perhaps simulator to a checked run."""

    def make(name: str, until: float = 5.0, simulator: SumoSimulator | None = None) -> CheckedRun:
        settings = RunSettings(until=until)
        return check_file(
            workspace, sampled, name=name, out=tmp_path / "runs", settings=settings,
            simulator=simulator,
        )  # fmt: skip

    return make


def test_several_runs_come_back_in_order_whatever_order_they_end_in(checked: Any) -> None:
    runs = [checked(f"run{i}", until=9.0 - 3 * i) for i in range(3)]
    listener = Listener()
    results = run_all(runs, processes=2, reports=False, reporter=listener)
    assert [r.summary["sim_seconds"] for r in results] == [9.0, 6.0, 3.0]
    assert sorted(run.folder.name for run in listener.runs) == ["run0", "run1", "run2"]
    assert [r.folder.name for r in results] == ["run0", "run1", "run2"]


@pytest.mark.slow
def test_a_run_that_cannot_be_prepared_ends_the_others_and_tells_its_reason(
    checked: Any, tmp_path: Path
) -> None:
    broken = checked("broken", simulator=Failing(WorkspaceError("no such map")))
    runs = [broken, *(checked(f"r{i}") for i in range(4))]
    with pytest.raises(WorkspaceError, match="no such map"):
        run_all(runs, processes=1, reports=False)
    assert not (tmp_path / "runs" / "r3").exists()


@pytest.mark.slow
def test_a_run_that_cannot_be_prepared_is_left_out_where_somebody_is_told(checked: Any) -> None:
    broken = checked("broken", simulator=Failing(InputError("no such place")))
    told: dict[str, str] = {}
    results = run_all(
        [broken, checked("good")],
        reports=False,
        refused=lambda name, error: told.update({name: str(error)}),
    )
    assert told == {"broken": "no such place"}
    assert [result.folder.name for result in results] == ["good"]


@pytest.mark.slow
def test_ctrl_c_ends_the_preparation_of_a_run(
    checked: Any, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    seen: list[str] = []

    class Endless(SumoSimulator):
        def prepare(self, *_: Any) -> SumoPreparedRun:
            try:
                for step in range(6000):
                    time.sleep(0.01)
                    if step == 50:  # when the main thread waits for this one
                        _thread.interrupt_main()
                seen.append("prepared")
            finally:
                seen.append("ended")
            raise AssertionError

    # In the background of a script it would be ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    with pytest.raises(KeyboardInterrupt):
        run_all([checked("large", simulator=Endless())], reports=False)
    assert seen == ["ended"]
    assert not (tmp_path / "runs").exists()
