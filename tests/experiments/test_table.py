import math
from typing import Any

import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.experiments.table import OUTCOME, SWEEP, columns_of, outcome_of, read_limit
from odscen.figures.measures.conflicts import conflict_table
from odscen.records.run_events import Event, EventKind

NONE = {"ttc": None, "drac": None, "pet": None, "kind": "following", "x": 0.0, "y": 0.0}


def met(one: str, other: str, begin: float, **measures: float) -> dict[str, Any]:
    return {"one": one, "other": other, "begin": begin, "end": begin + 1.0, **NONE, **measures}


def hit(actor: str, partner: str, **fields: Any) -> Event:
    return Event(5.0, EventKind.COLLISION, actor, partner=partner, **fields)


def no_tracks() -> pl.DataFrame:
    raise AssertionError


CONFLICTS = conflict_table(
    [
        met("ego", "van", 1.0, ttc=1.5, drac=2.0),
        met("van", "ego", 9.0, ttc=2.0, pet=0.7),
        met("a", "b", 1.0, ttc=0.2, drac=9.0),
    ]
)


def test_the_closest_encounters_are_those_of_who_is_watched() -> None:
    found = outcome_of([], CONFLICTS, no_tracks, {"ego"})
    assert found == {
        "collision": False, "impact_speed": None, "min_ttc": 1.5, "min_pet": 0.7, "max_drac": 2.0,
    }  # fmt: skip
    assert tuple(found) == OUTCOME
    everybody = outcome_of([], CONFLICTS, no_tracks, None)
    assert (everybody["min_ttc"], everybody["max_drac"]) == (0.2, 9.0)
    assert outcome_of([], None, no_tracks, {"ego"})["min_ttc"] is None


def test_the_hardest_impact_is_the_one_of_the_row() -> None:
    events = [
        hit("van", "ego", values={"impact_speed": 4.0}),
        hit("ego", "wall", values={"impact_speed": 6.5}),
        hit("a", "b", values={"impact_speed": 20.0}),
    ]
    found = outcome_of(events, None, no_tracks, {"ego"})
    assert (found["collision"], found["impact_speed"]) == (True, 6.5)


def test_an_impact_that_sumo_reports_has_its_speed_from_the_trajectories() -> None:
    rows = pl.DataFrame(
        {
            "time": [4.9, 5.0, 5.0],
            "id": ["ego", "ego", "van"],
            "hdg": [0.0, 0.0, math.pi / 2],
            "speed": [9.0, 3.0, 4.0],
        }
    )
    found = outcome_of([hit("ego", "van")], None, lambda: rows, {"ego"})
    assert found["impact_speed"] == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("text", "value", "holds"),
    [
        ("min_ttc >= 1.5", 1.5, True),
        ("min_ttc >= 1.5", 1.4, False),
        ("min_ttc > 1.5", 1.5, False),
        ("min_ttc<2", 1.9, True),
        ("min_ttc <= 2e0", 2.1, False),
        ("min_ttc >= 1.5", None, True),
    ],
)
def test_a_limit_holds_or_not(text: str, value: float | None, holds: bool) -> None:
    assert read_limit(text, columns_of(SWEEP)).holds({"min_ttc": value}) is holds


@pytest.mark.parametrize("text", ["min_ttc", "min_ttc = 3", "ttc > 1", "min_ttc > fast", ""])
def test_what_is_no_limit_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"is no limit|no column 'ttc'"):
        read_limit(text, columns_of(SWEEP))
