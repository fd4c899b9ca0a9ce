from __future__ import annotations

from typing import Any

import pytest

from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.problems import Problem
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.signals.light import Light
from tests.graphs import SHA256, fork

GRAPH = fork()
WHOLE = ("r1", "j9", "r2", "r3")


def problems(*measures: dict[str, Any], **fields: Any) -> list[Problem]:
    one = Scenario.model_validate(
        {
            "name": "test",
            "map": MapReference(name="toy", sha256=SHA256),
            "roi": WHOLE,
            "measures": [{"id": f"m{n}", **measure} for n, measure in enumerate(measures)],
            **fields,
        }
    )
    return [p for p in check(one, GRAPH, lights=()) if p.code != "no_actors"]


@pytest.mark.parametrize(
    ("measure", "code", "where"),
    [
        ({"kind": "closure", "places": ["r1", "r7"]}, "unknown_place", "places[1]"),
        ({"kind": "closure", "places": ["r1>r7"]}, "unknown_segment", "places[0]"),
        ({"kind": "closure", "places": ["r2>j9>r1"]}, "place_broken", "places[0]"),
        ({"kind": "closure", "places": ["r1>j9"]}, "place_broken", "places[0]"),
        ({"kind": "speed_limit", "places": ["r1>r2"], "speed": 5}, "place_broken", "places[0]"),
        ({"kind": "closure", "places": ["r1"], "begin": 900}, "measure_too_late", "begin"),
        ({"kind": "incident", "lane": "r1", "s": 5}, "unknown_place", "lane"),
        ({"kind": "incident", "lane": "1.0.-1", "s": 500}, "place_off_lane", "s"),
        ({"kind": "signal_outage", "junction": "9"}, "unknown_light", "junction"),
        (
            {"kind": "roadworks", "places": ["r1"], "closed_lanes": ["9.0.-9"]},
            "unknown_place",
            "closed_lanes[0]",
        ),
    ],
)
def test_a_measure_that_cannot_be_is_named_with_its_place(
    measure: dict[str, Any], code: str, where: str
) -> None:
    (found,) = problems(measure)
    assert (found.code, found.where) == (code, f"measures[0].{where}")


def test_a_turn_may_leave_out_the_junction_between_its_roads() -> None:
    assert problems({"kind": "closure", "places": ["r1>r2", "r1>j9>r3"]}) == []


def test_an_id_that_an_actor_has_too_is_refused() -> None:
    actor = {"id": "m0", "category": "car", "spawn": "1.0.-1.10"}
    found = problems({"kind": "closure", "places": ["r2"], "begin": 5}, actors=[actor])
    assert "duplicate_id" in {one.code for one in found}


def test_an_actor_whose_only_route_is_closed_when_it_departs_is_named() -> None:
    actor = {"id": "a", "category": "car", "spawn": "1.0.-1.10", "goal": "2.0.-1.29"}
    closed = {"kind": "closure", "places": ["r1>r2"], "begin": 100, "end": 200}
    for depart, expected in ((50, []), (150, ["only_route_closed"]), (200, [])):
        found = problems(closed, actors=[{**actor, "depart": depart}])
        assert [one.code for one in found] == expected
    other = {"kind": "permission", "places": ["r1>r2"], "banned": ["truck"]}
    assert problems(other, actors=[actor]) == []


def test_two_outages_of_one_light_at_the_same_time_are_refused() -> None:
    light = Light(names=("9",), green=())
    one = Scenario.model_validate(
        {
            "name": "test",
            "map": MapReference(name="toy", sha256=SHA256),
            "roi": WHOLE,
            "measures": [
                {"id": "a", "kind": "signal_outage", "junction": "9", "end": 60},
                {"id": "b", "kind": "signal_outage", "junction": "9", "begin": 30},
                {"id": "c", "kind": "signal_outage", "junction": "9", "begin": 3, "end": 5},
            ],
        }
    )
    found = [p.where for p in check(one, GRAPH, lights=(light,)) if p.code == "light_twice"]
    assert found == ["measures[1].junction", "measures[2].junction"]


def test_outages_of_one_light_that_overlap_are_listed_in_pairs_and_very_many_are_counted() -> None:
    def pairs(*times: tuple[float, float | None]) -> list[Problem]:
        measures = [
            {"id": f"m{n}", "kind": "signal_outage", "junction": "9", "begin": begin, "end": end}
            for n, (begin, end) in enumerate(times)
        ]
        one = Scenario.model_validate(
            {"name": "test", "map": MapReference(name="toy", sha256=SHA256), "roi": WHOLE}
            | {"measures": measures, "simulation": {"duration": 1e6}}
        )
        found = check(one, GRAPH, lights=[Light(("9",), (10.0,))])
        return [problem for problem in found if problem.code == "light_twice"]

    assert [(one.where, one.message[:13]) for one in pairs((5, 9), (0, 5), (8, None), (0, 6))] == [
        ("measures[2].junction", "'m2' and 'm0'"),
        ("measures[3].junction", "'m3' and 'm0'"),
        ("measures[3].junction", "'m3' and 'm1'"),
    ]
    assert pairs(*((float(n), n + 1.0) for n in range(3000))) == []
    found = pairs(*((float(n), None) for n in range(3000)))
    assert len(found) == 201
    assert found[-1].message == f"and {3000 * 2999 // 2 - 200:,} more of this kind"
