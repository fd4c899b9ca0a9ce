"""Road users are counted before any is made, and too many are refused with who makes them."""

from __future__ import annotations

import json
import resource
from typing import TYPE_CHECKING, Any

import pytest

from odscen.app.running.runs import run
from odscen.base.errors import InputError, LimitError
from odscen.runs.run_settings import RunSettings
from odscen.scenario.demand.expected_users import (
    MOST_ROAD_USERS,
    VARIABLE,
    expected_users,
    refuse_too_many,
)
from odscen.scenario.document.json_form import loads
from odscen.sumo.realize.realization import realize
from tests.experiments.study_case import place, short_scenario
from tests.sumo.story_case import loaded

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario


def scenario(folder: Path, **parts: Any) -> Scenario:
    place()
    data = json.loads(short_scenario(folder).read_text(encoding="utf-8"))
    return loads(json.dumps(data | {"parameters": {}, "flows": [], "actors": []} | parts))


def line(folder: Path) -> dict[str, Any]:
    """A line every 10 s, and its stop, on the start of the first flow of the shipped scenario."""
    data = json.loads(short_scenario(folder).read_text(encoding="utf-8"))
    start = data["flows"][0]["spawn"]
    lane, _, number = start.rpartition(".")
    stop = {"id": "s", "node": f"{lane}.{int(number) + 20}"}
    served = {"id": "l", "start": start, "stops": [{"stop": "s"}], "headway": 10.0}
    return {"stops": [stop], "lines": [served]}


def test_each_part_is_counted_as_it_is_made(tmp_path: Path) -> None:
    made = scenario(
        tmp_path,
        flows=[{"id": "f", "spawn": "x", "per_hour": 3600.0, "begin": 100.0, "end": 1e9}],
        transit={"stops": [], "lines": [line(tmp_path)["lines"][0]]},
        demand={
            "inputs": [{"id": "i", "segment": "r1", "per_hour": 1800.0, "end": 600.0}],
            "matrices": [{"id": "m", "trips": [["r1", "r2", 12.5], ["r2", "r1", 7.5]]}],
            "background": [{"id": "b", "trips": 40.0}],
            "counts": [
                {"id": "c", "rows": [["r1", 0.0, 900.0, 30.0]]},
                {"id": "seen", "use": "compare", "rows": [["r1", 0.0, 900.0, 1e6]]},
            ],
        },
        simulation={"duration": 1e6},
    )
    assert expected_users(made, until=1100.0) == {
        "flow 'f'": pytest.approx(1000.0),
        "line 'l'": 110,
        "vehicle input 'i'": pytest.approx(300.0),
        "matrix 'm'": 20.0,
        "background traffic 'b'": 40.0,
        "counts 'c'": 30.0,
    }


def test_a_line_is_as_long_as_the_run_and_not_a_moment_longer(tmp_path: Path) -> None:
    made = scenario(tmp_path, transit=line(tmp_path), simulation={"duration": 1e9})
    users = realize(made, loaded("signal_crossing").sumo, settings=RunSettings(until=60.0))
    assert [actor.id for actor in users.plan.actors] == [f"l.{n}" for n in range(6)]


def test_a_hundred_million_trips_are_refused_before_they_are_made(tmp_path: Path) -> None:
    made = scenario(tmp_path, transit=line(tmp_path), simulation={"duration": 1e9})
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    words = r"about 100,000,000 road users \(100,000,000 by line 'l'\); the limit of a run is 300,"
    with pytest.raises(LimitError, match=words):
        realize(made, loaded("signal_crossing").sumo)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB
    with pytest.raises(LimitError, match=words):
        run(place(), made, out=tmp_path / "runs")
    assert not (tmp_path / "runs" / made.name).exists()


def test_background_that_keeps_vehicles_on_the_road_is_counted_when_its_map_is_known(
    tmp_path: Path,
) -> None:
    demand = {"background": [{"id": "b", "per_km": 100.0}]}
    made = scenario(tmp_path, demand=demand, simulation={"duration": 1e9})
    with pytest.raises(LimitError, match="by background traffic 'b'"):
        realize(made, loaded("signal_crossing").sumo)


def test_the_limit_is_the_users_to_raise(monkeypatch: pytest.MonkeyPatch) -> None:
    refuse_too_many({"flow 'f'": MOST_ROAD_USERS})
    with pytest.raises(LimitError, match=VARIABLE):
        refuse_too_many({"flow 'f'": MOST_ROAD_USERS + 1})
    monkeypatch.setenv(VARIABLE, str(MOST_ROAD_USERS + 1))
    refuse_too_many({"flow 'f'": MOST_ROAD_USERS + 1})
    monkeypatch.setenv(VARIABLE, "many")
    with pytest.raises(InputError, match="'many', which is no whole number"):
        refuse_too_many({"flow 'f'": 1.0})
