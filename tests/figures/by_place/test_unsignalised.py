"""A T-junction and a roundabout entry written by hand: capacity of lane groups without lights."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from odscen.figures.by_place.facilities import NetFacts
from odscen.figures.by_place.gap_acceptance import potential_capacity
from odscen.figures.by_place.lane_groups import lane_groups
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.unsignalised import unsignalised_sums

HOUR = pl.DataFrame({"begin": [0.0], "end": [3600.0]})
# Lane before, lane inside, movement, letters of turn and state, and whom it gives way to.
T = (
    ("w", ":wt", "rw>j1>re", "s", "M", ()),
    ("e", ":et", "re>j1>rw", "s", "M", ()),
    ("e", ":el", "re>j1>rs", "l", "m", (":wt",)),
    ("s", ":sl", "rs>j1>rw", "l", "m", (":wt", ":et", ":el")),
    ("s", ":sr", "rs>j1>re", "r", "m", (":wt",)),
)
STEM = "rs>j1>re + rs>j1>rw"


def net(
    rows: tuple[tuple[str, str, str, str, str, tuple[str, ...]], ...], *, ring: bool = False
) -> tuple[LanePlaces, NetFacts]:
    sources = sorted({row[0] for row in rows})
    places = LanePlaces.of(
        lanes=[(lane, 100.0, True, f"r{lane}", 1.0, True) for lane in sources],
        ways=[(lane, "j1", lane, None, None, None) for lane in sources]
        + [(via, "j1", lane, lane, via, name) for lane, via, name, *_ in rows],
        segments=[],
        junctions=[("j1", "priority", 10.0)],
        movements=[(name, "j1", "priority", 10.0) for _, _, name, *_ in rows],
    )
    links = [
        {"via": via, "turn": turn, "state": state, "gives_way": bool(before),
         "onto_ring": ring, "from_ring": ring and not before, "yields_to": [*before]}
        for _, via, _, turn, state, before in rows
    ]  # fmt: skip
    angles = {"w": (1, 0), "e": (-1, 0), "s": (0, 1), "n": (0, -1)}
    facts = NetFacts(
        pl.DataFrame(
            [(lane, lane, 100.0, 15.0) for lane in (*sources, *(row[1] for row in rows))],
            schema=("lane", "edge", "length", "limit"), orient="row",
        ),
        pl.DataFrame(links, schema_overrides={"yields_to": pl.List(pl.String)}),
        pl.DataFrame({"id": ["car", "truck"], "heavy": [False, True]}),
        shapes={lane: np.array([[0.0, 0.0], angles[lane[0]]]) for lane in sources},
    )  # fmt: skip
    return places, facts


def passed(*streams: tuple[str, int, float], who: str = "car") -> pl.DataFrame:
    """First lane inside, how many of an hour enter there, evenly, and seconds each lost before."""
    rows = [
        (who, "m", via, 3600.0 * (k + 0.5) / number, lost)
        for via, number, lost in streams
        for k in range(number)
    ]
    schema = ("id", "movement", "lane", "time", "before")
    return pl.DataFrame(rows, schema=schema, orient="row")


def capacity(
    rows: tuple[tuple[str, str, str, str, str, tuple[str, ...]], ...],
    driven: pl.DataFrame,
    *,
    ring: bool = False,
) -> dict[str, float]:
    places, facts = net(rows, ring=ring)
    groups = lane_groups(places, facts)
    found = unsignalised_sums(driven, groups, places, facts, HOUR)
    return {group: value for group, _, value in found.rows()}


def test_a_stem_carries_what_the_gaps_of_the_street_leave_in_the_shares_that_were_driven() -> None:
    driven = passed((":wt", 240, 0.0), (":et", 300, 0.0), (":el", 160, 1.0), (":sl", 40, 1.0),
                    (":sr", 120, 1.0))  # fmt: skip
    found = capacity(T, driven)
    left = potential_capacity(240.0, critical=4.1, follow_up=2.2)
    free = 1.0 - 160.0 / left
    right = potential_capacity(240.0, critical=6.2, follow_up=3.3)
    stem = potential_capacity(240 + 300 + 2 * 160, critical=6.4, follow_up=3.5) * free
    assert found[STEM] == pytest.approx(160.0 / (40.0 / stem + 120.0 / right), rel=1e-4)
    # Through vehicles share the lane of the left turn, at 1,800 an hour.
    shared = 460.0 / (160.0 / left + 300.0 / 1800.0)
    assert found["re>j1>rs + re>j1>rw"] == pytest.approx(shared, rel=1e-4)
    assert set(found) == {STEM, "re>j1>rs + re>j1>rw"}, "who gives way to none has no v/c"


def test_a_queue_that_never_clears_says_what_a_lane_carries() -> None:
    street = ((":wt", 240, 0.0), (":et", 300, 0.0))
    waiting = capacity(T, passed(*street, (":sr", 60, 90.0)))
    assert waiting[STEM] == 60.0
    assert capacity(T, passed(*street, (":sr", 60, 3.0)))[STEM] > 500.0


def test_a_lane_carries_no_less_than_went_through() -> None:
    driven = passed((":wt", 1500, 0.0), (":et", 10, 0.0), (":sr", 300, 2.0))
    assert potential_capacity(1500.0, critical=6.2, follow_up=3.3) < 200.0
    assert capacity(T, driven)[STEM] == 300.0


def test_an_all_way_stop_without_others_departs_every_3_9_seconds() -> None:
    rows = tuple((*row[:4], "w", tuple(r[1] for r in T if r[0] != row[0])) for row in T)
    found = capacity(rows, passed((":wt", 100, 1.0)))
    assert found["rw>j1>re"] == pytest.approx(3600.0 / 3.9, rel=1e-4)
    crowded = capacity(rows, passed((":wt", 100, 1.0), (":sl", 300, 1.0), (":et", 200, 1.0)))
    assert crowded["rw>j1>re"] < 0.9 * found["rw>j1>re"]


def test_an_entry_of_a_roundabout_carries_what_goes_by_leaves_and_trucks_count_twice() -> None:
    rows = (
        ("w", ":ring", "rw>j1>re", "s", "M", ()),
        ("s", ":in", "rs>j1>re", "r", "m", (":ring",)),
    )
    found = capacity(rows, passed((":ring", 500, 0.0), (":in", 100, 1.0)), ring=True)
    assert found == {"rs>j1>re": pytest.approx(1380.0 * np.exp(-1.02e-3 * 500.0), rel=1e-6)}
    trucks = capacity(rows, passed((":ring", 500, 0.0), (":in", 100, 1.0), who="truck"), ring=True)
    assert trucks["rs>j1>re"] == pytest.approx(1380.0 * np.exp(-1.02e-3 * 1000.0) / 2.0, rel=1e-6)
