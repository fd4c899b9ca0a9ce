import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.app.maps import load_map
from odscen.figures.measures.usability import (
    Usability,
    UsabilityKind,
    UsabilityLevel,
    UsabilityReason,
)
from odscen.maps.store import Workspace
from odscen.opendrive.road_names import road_names
from odscen.reports.front_page import (
    MOST_ACTORS,
    advise,
    junction_rows,
    level_notes,
    scene_sentences,
    traffic_sentences,
)
from odscen.reports.place_names import (
    NO_NAMES,
    JunctionName,
    PlaceNames,
    RoadName,
    _tell_apart,
    compass_point,
    place_names,
)
from odscen.reports.report_words import moment, starting_at
from tests.figures.made_traffic import made_figures
from tests.reports.test_report_traffic import SHAPES
from tests.reports.test_run_report import PLAN, Reader, planned, report

MAPS = Path(__file__).parents[2] / "maps"
USABLE = Usability(UsabilityLevel.USABLE)
NAMES = PlaceNames(
    {"j10": "East Street / North Street"},
    {"r1": "East Street, west of North Street", "r2": "East Street, east of North Street"},
    {"j10": {"r1": np.pi, "r2": 0.0, "r3": np.pi / 2}},
    {"j10": np.array([100.0, 0.0])},
)


def traffic_report(**changes):
    plan = replace(PLAN, actors=tuple(planned(f"car-{k}") for k in range(MOST_ACTORS + 1)))
    return report(plan=plan, figures=made_figures(), shapes=SHAPES, names=NAMES, **changes)


def test_generated_names_of_roads_are_no_names_of_streets():
    text = (
        b'<road name="Road 12" id="1"><road id="2" name=""><road id=\'3\' name=\'A &gt; B\'>'
        b'<road length="3" name="Main > Street  East" id="4" junction="-1"><road name="r5" id="5">'
        b'<road name="A7" id="7"><roadMark name="x" id="9">'
    )
    assert road_names(text) == {"3": "A > B", "4": "Main > Street East", "7": "A7"}


@pytest.mark.parametrize(
    ("degrees", "name"),
    [(0, "east"), (22, "east"), (23, "north-east"), (90, "north"), (-90, "south"), (181, "west")],
)
def test_directions_are_points_of_the_compass(degrees, name):
    assert compass_point(np.radians(degrees)) == name


def test_movements_are_named_by_approach_and_turn():
    assert NAMES.name_movement("r1>j10>r2") == (
        "East Street / North Street, from the west, straight on"
    )
    # Who comes from the north and leaves to the east turns left.
    assert NAMES.name_movement("r3>j10>r2", junction="j10") == "from the north, left turn"
    assert NAMES.name_movement("r3>j10>r1", junction="j10") == "from the north, right turn"
    assert NAMES.name_movement("r3>j10>r3", junction="j10") == "from the north, U-turn"
    assert NAMES.name_lane_group("r3>j10>r1 + r3>j10>r2") == (
        "East Street / North Street, from the north, right turn and left turn"
    )
    assert NAMES.name_movement("r8>j10>r2") == "r8 > j10 > r2"


def test_two_legs_on_one_side_are_told_apart_by_their_streets():
    names = PlaceNames({}, {"r1": "A Road", "r4": "B Road"}, {"j1": {"r1": 0.1, "r4": -0.1}})
    assert names.name_movement("r1>j1>r4", junction="j1") == "from the east (A Road), U-turn"


def test_movements_of_signal_groups_are_said_by_the_side_from_which_they_come():
    names = PlaceNames({}, {}, {"j1": {"r1": 0.1, "r4": math.pi / 2.0}})
    said = names.name_approaches("j1", "r1, r4 left, walk r4, r9 right")
    assert said == "from the east, from the north left, crossing in the north, r9 right"


def test_junctions_of_one_name_are_told_apart_by_the_compass():
    middles = {"j1": np.array([0.0, 50.0]), "j2": np.array([0.0, -50.0])}
    assert _tell_apart(["j1", "j2"], middles) == {"j1": "north", "j2": "south"}
    middles["j3"] = np.array([1.0, 60.0])
    assert _tell_apart(["j1", "j2", "j3"], middles) == {"j1": "1", "j2": "2", "j3": "3"}


def test_spots_are_described_from_the_nearest_junction():
    assert NAMES.describe_spot(100.0, 118.0) == "120 m north of East Street / North Street"
    assert NAMES.describe_spot(90.0, 5.0) == "East Street / North Street"
    assert NO_NAMES.describe_spot(1.2, 3.4) == "x 1 m, y 3 m"


@pytest.mark.slow
def test_a_shipped_map_is_named_by_its_streets(tmp_path):
    entry = Workspace.open(tmp_path).add_map(MAPS / "signal_crossing.xodr")
    graph = load_map(entry).sumo.graph
    names = place_names(graph, road_names(entry.read("xodr")))
    (junction,) = names.junctions
    assert names.name_junction(junction) == "East Street / North Street"
    sides = {compass_point(way) for way in names.legs[junction].values()}
    assert sides == {"east", "north", "west", "south"}
    west = next(leg for leg, name in names.segments.items() if name.startswith("West Street"))
    assert names.name_segment(west) == "West Street, west of East Street / North Street"
    assert names.junction_names[junction] == JunctionName(("East Street", "North Street"))
    assert names.road_names[west] == RoadName("West Street", ((junction, ""),), "west")
    nameless = place_names(graph, {})
    assert nameless.name_junction(junction) == f"Junction {junction.removeprefix('j')}"
    turns = [
        names.name_movement(f"{west}>{junction}>{leg}", junction=junction)
        for leg, way in sorted(names.legs[junction].items(), key=lambda pair: pair[1])
    ]
    assert sorted(turns) == [
        "from the west, U-turn", "from the west, left turn", "from the west, right turn",
        "from the west, straight on",
    ]  # fmt: skip


def test_a_row_has_street_level_worst_movement_and_what_is_next():
    (row,) = junction_rows(made_figures(), NAMES)
    assert (row["name"], row["level"], round(row["shown"])) == (
        "East Street / North Street",
        "D",
        47,
    )
    assert row["movement"] == "from the west, straight on: 47 s, level D"
    assert row["advice"] == "Nothing: below capacity."


@pytest.mark.parametrize(
    ("control", "movement", "advice"),
    [
        ("signal", {"level": "F", "vc": 1.2, "spillback": 0.0},
         "Give it more green or a lane (demand is 120 % of its capacity)."),
        ("signal", {"level": "F", "vc": 0.8, "spillback": 0.12},
         "Try another split, cycle or offset; queue up to the next junction 12 % of the time."),
        ("priority", {"level": "E", "vc": None, "spillback": None},
         "Try a signal, a roundabout or priority for this approach."),
        ("priority", {"level": "C", "vc": 0.4, "spillback": 0.0}, "Nothing: below capacity."),
    ],
)  # fmt: skip
def test_advice_follows_from_capacity_control_and_queues(control, movement, advice):
    assert advise({"level": movement["level"], "control": control}, movement) == advice


def test_three_sentences_say_what_holds_what_is_worst_and_what_is_next():
    rows = junction_rows(made_figures([(50, 5.0), (100, 90.0)]), NAMES)
    values = {"arrived": 140, "planned": 150, "mean_delay": 61.2}
    sentences = traffic_sentences(values, USABLE, rows)
    assert sentences == [
        "The results are valid: 140 of 150 road users arrived.",
        "A vehicle lost 1 min 01 s on average; the longest delay is at East Street / North Street: "
        "1 min 02 s per vehicle, level E.",
        "Next, at East Street / North Street: try another split, cycle or offset.",
    ]
    reason = UsabilityReason(
        UsabilityKind.GRIDLOCK, UsabilityLevel.NOT_USABLE, 900.0, 1, "unresolved queue"
    )
    broken = traffic_sentences(values, Usability(UsabilityLevel.NOT_USABLE, (reason,)), rows)
    assert broken[0] == "The results are not valid: unresolved queue."
    assert broken[2].startswith("Next: find out why traffic breaks down, first at East Street")


def test_a_scene_is_told_by_criteria_closest_moment_and_what_is_next():
    conflicts = pl.DataFrame(
        {"begin": [9.0, 4.0], "one": ["car-1", "ego"], "other": ["car-2", "child"],
         "ttc": [2.5, 0.8], "pet": [None, None]},
        schema_overrides={"pet": pl.Float64},
    )  # fmt: skip
    missed = {"words": "minimum TTC of ego is over 1.5 s", "value": 0.8, "unit": "s"}
    criteria = [{"words": "no collision", "passed": True}, {**missed, "passed": False}]
    assert scene_sentences({"collided": 0}, USABLE, criteria, conflicts) == [
        "1 of 2 criteria is not met: minimum TTC of ego is over 1.5 s; it is 0.8 s.",
        "The closest moment is that of ego and child, from 4 s on: time to collision 0.8 s.",
        "Next: watch the replay at 2 s.",
    ]
    assert scene_sentences({"collided": 0}, USABLE, criteria[:1], conflicts)[0] == (
        "The criterion is met."
    )


def test_levels_that_seem_to_contradict_each_other_are_explained():
    rows = [
        {"control": "signal", "level": "E", "shown": 78.3},
        {"control": "priority", "level": "F", "shown": 71.5},
    ]
    notes = level_notes(made_figures(), rows)
    assert notes[0].startswith("78.3 s is level E at a signal, but 71.5 s is level F without one")
    # The street before the junction is F, the junction D: nothing to explain.
    assert len(notes) == 1
    calm = level_notes(made_figures([(50, 16.0)]), [])
    assert [note.split(",")[0] for note in calm] == ["Streets are graded by speed"]


def test_only_the_first_page_is_open_and_has_no_ids():
    page = traffic_report()
    front, *folded = page.split("<details")
    assert len(folded) == 3
    assert "<details open" not in page
    text = re.sub(r"<[^>]*>", " ", front)
    shown = text.split("In brief")[1]
    assert "East Street / North Street" in shown
    assert not re.search(r"\bj10\b|\br1\b", shown)


def test_a_scene_is_one_page_with_its_trajectories_and_without_diagrams_of_flow():
    page = report(figures=made_figures([(4, 5.0)] * 6), shapes=SHAPES)
    sections = re.findall(r'<section id="(\w+)"', page)
    assert {"flow", "diagram", "map"}.isdisjoint(sections)
    assert "trajectories of all actors" in page.split("<details")[0]
    assert Reader(page).text.count("What to look at next") == 0


def test_moments_are_times_of_day_once_a_run_has_a_clock():
    assert moment(4397.0) == "1 h 13 min"
    with starting_at(35_100.0):
        assert moment(4397.0) == "10:58:17"
