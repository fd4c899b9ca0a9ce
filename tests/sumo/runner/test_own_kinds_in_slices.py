"""A condition and an action of a package of one's own, in a run, in slices and killed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.run_jobs import run_prepared
from tests.own_package import forget, install
from tests.sumo.conftest import start_killed_workers
from tests.sumo.runner.test_long_runs import results
from tests.sumo.story_case import MIDDLE, document, node_at, prepared, read

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

MOTORWAY = "motorway_weave"
PLACE = [500.0, MIDDLE]


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    (tmp_path / "package").mkdir()
    install(tmp_path / "package", monkeypatch)
    yield
    forget()


def scenario() -> Any:
    near = {"kind": "seconds_to_place", "place": PLACE, "values": {"below": 3.0}}
    ease = {"kind": "ease", "values": {"to": 12.0, "over": 4.0}}
    van = {
        "id": "van", "category": "car", "spawn": node_at(MOTORWAY, 370.0, MIDDLE), "speed": 20.0,
        "goal": node_at(MOTORWAY, 900.0, MIDDLE), "initial_speed": 20.0,
    }  # fmt: skip
    rule = {"id": "r", "actor": "van", "when": {"own": near}, "then": [{"own": ease}]}
    return document(MOTORWAY, [van], [rule], until=16.0)


@pytest.mark.slow
def test_it_fires_at_the_instant_and_acts_as_the_package_says(tmp_path: Path) -> None:
    assert run_prepared(prepared(scenario()), tmp_path / "run").status == "completed"
    found = read(tmp_path / "run")
    van, begin = found.tracks["van"], found.instant("r")
    assert PLACE[0] - van.centre(begin)[0] == pytest.approx(60.0, abs=0.05)
    assert found.of_rule("r")[0].values == {"own": pytest.approx(3.0, abs=1e-3)}
    assert found.instant("r", "ended") == pytest.approx(begin + 4.0, abs=1e-6)
    there = van.at(begin + 4.0)[0] - van.at(begin)[0]
    assert there == pytest.approx(4.0 * (20.0 + 12.0) / 2.0, abs=0.05)
    assert van.speed[van.time > begin + 4.2] == pytest.approx(12.0, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3])
def test_killed_after_any_slice_it_ends_with_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    alone, cut = tmp_path / "alone", tmp_path / "cut"
    assert run_prepared(prepared(scenario(), slice_length=4.0), alone).status == "completed"
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        patch.setenv("KILL_AFTER_SLICE", str(number))
        assert run_prepared(prepared(scenario(), slice_length=4.0), cut).status == "failed"
    assert resume(cut).status == "completed"
    assert results(cut) == results(alone)


def test_what_the_package_raises_ends_the_run_with_its_name(tmp_path: Path) -> None:
    ready = prepared(scenario())
    code = tmp_path / "package" / "my_kinds.py"
    code.write_text(code.read_text().replace("max(one.speed, 0.1)", "0"))
    result = run_prepared(ready, tmp_path / "run")
    assert result.status == "failed"
    error = str(result.summary["error"])
    assert "own kind 'seconds_to_place' failed: ZeroDivisionError" in error
