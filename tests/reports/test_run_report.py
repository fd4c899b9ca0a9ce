import base64
import hashlib
import re
from html.parser import HTMLParser

import numpy as np
import polars as pl
import pytest

from odscen.drawing.map_drawing import Area, Lines, MapDrawing
from odscen.figures.measures.summary import actor_outcomes
from odscen.records.run_events import Event, EventKind
from odscen.records.run_plan import Plan, PlannedActor
from odscen.reports.place_names import PlaceNames
from odscen.reports.report_words import duration
from odscen.reports.run_report import render_report

EVIL = '<img src=x onerror="alert(1)">'


def planned(name, category="car", *, depart=0.0, x=0.0, y=0.0):
    return PlannedActor(name, category, "1.0.-1.0", "1.0.-1.9", depart, 4.5, 1.8, x, y, 0.0, 0.0)


PLAN = Plan(
    "Crossing",
    7,
    60.0,
    0.5,
    (100.0, 50.0),
    (planned("a"), planned("b", "bus", x=10.0), planned("p", "pedestrian", depart=5.0)),
)
EVENTS = (
    Event(0.0, EventKind.DEPARTED, "a", 0.0, 0.0, error=0.02),
    Event(1.0, EventKind.DEPARTED, "b", 10.0, 0.0, error=0.01),
    Event(8.0, EventKind.COLLISION, "a", 30.0, 5.0, partner="b", detail="junction"),
    Event(9.0, EventKind.TELEPORT_START, "b", 31.0, 5.0),
    Event(11.0, EventKind.ARRIVED, "a", travel_time=11.0),
)
SUMMARY = {
    "status": "completed",
    "map": "town",
    "sim_seconds": 60.0,
    "wall_seconds": 0.4,
    "problems": ["bus-2: no way to its goal"],
    "expectations": [
        {"expectation": "arrived>=0.95", "value": 0.333, "passed": False},
        {"expectation": "collided==0", "value": None, "passed": False},
    ],
}


def driven():
    time = np.arange(12.0)
    return pl.DataFrame(
        {
            "timestep_time": np.tile(time, 2),
            "vehicle_id": ["a"] * 12 + ["b"] * 12,
            "vehicle_x": np.concatenate([100.0 + 10.0 * time, 110.0 + time]),
            "vehicle_y": np.full(24, 50.0),
            "vehicle_speed": [10.0] * 12 + [1.0] * 12,
        }
    )


def road():
    xy = np.array([[-20.0, -5.0], [300.0, -5.0], [300.0, 5.0], [-20.0, 5.0]])
    return MapDrawing(
        "town", (-20.0, -5.0, 300.0, 5.0), (Area(0, "road", Lines(xy, np.array([0, 4]))),)
    )


def report(summary=SUMMARY, plan=PLAN, events=EVENTS, trajectories=None, drawing=None, **traffic):
    outcomes = actor_outcomes(plan, events)
    rows = driven() if trajectories is None else trajectories
    return render_report(summary, plan, outcomes, events, rows, drawing=drawing, **traffic)


class Reader(HTMLParser):
    """Text by element id, all attributes, and whether tags nest."""

    def __init__(self, page):
        super().__init__()
        self.stack, self.attributes, self.text = [], [], ""
        self.feed(page)
        assert self.stack == []

    def handle_starttag(self, tag, attrs):
        self.attributes += attrs
        if tag not in {"meta", "input", "br"}:
            self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag

    def handle_data(self, data):
        if self.stack[-1:] not in (["style"], ["script"]):
            self.text += data + " "


def test_the_report_is_well_formed_and_says_what_happened():
    text = re.sub(r"\s+", " ", Reader(report(drawing=road())).text)
    assert "Crossing" in text
    assert "Results not valid, 2 of 2 expectations not met" in text
    assert "3 road users planned" in text
    assert (
        "1 of 3 road users arrived; 1 was still under way at the end; "
        "1 was not inserted; 1 teleported; 2 collided."
    ) in text
    assert "2 inserted 66.7 % of the planned" in text
    assert "1 arrived 33.3 % of the planned" in text
    assert "2 cm largest insertion error" in text
    assert "8 s a collided with b at x 30 m, y 5 m (junction)" in text
    assert "9 s b was gridlocked and teleported" in text
    assert "5 s p was not inserted" in text
    assert "before bus-2: no way to its goal" in text
    assert text.count("How to read this:") == len(re.findall(r"<section id=", report())) - 1


def test_the_mean_speed_counts_vehicles_only_and_in_kmh():
    text = re.sub(r"\s+", " ", Reader(report()).text)
    assert "19.8 km/h mean speed on the road" in text


def test_ways_lie_in_the_frame_of_the_map():
    page = report(drawing=road())
    way = re.search(r"<title>a \(car\) arrived</title>", page)
    assert way is not None
    data = re.search(r'<path d="([^"]*)"><title>a ', page).group(1)
    assert data == "M0 0l1100 0"


def test_what_comes_from_files_is_escaped_everywhere():
    plan = Plan(EVIL, 1, 60.0, 0.5, (0.0, 0.0), (planned(EVIL), planned("b", EVIL)))
    events = (
        Event(0.0, EventKind.DEPARTED, EVIL, 0.0, 0.0),
        Event(1.0, EventKind.COLLISION, EVIL, 0.0, 0.0, partner=EVIL, detail=EVIL),
    )
    summary = {
        "status": EVIL,
        "map": EVIL,
        "error": EVIL,
        "environment": {"preset": EVIL},
        "versions": {EVIL: EVIL},
        "expectations": [{"expectation": EVIL, "value": 1.0, "passed": True}],
    }
    rows = driven().with_columns(pl.lit(EVIL).alias("vehicle_id"))
    page = report(summary, plan, events, rows, MapDrawing(EVIL, (0.0, 0.0, 9.0, 9.0)))
    assert "<img" not in page
    assert not any(name.startswith("on") for name, _ in Reader(page).attributes)


def test_the_page_asks_for_nothing_from_outside_and_names_its_only_script():
    page = report(drawing=road())
    links = [value for name, value in Reader(page).attributes if name in {"href", "src"}]
    assert all(value.startswith("#") for value in links)
    assert "url(" not in page
    assert "@import" not in page
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page).group(1)
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    assert len(scripts) == 1
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy


def test_the_same_run_gives_the_same_page():
    assert report(drawing=road()) == report(drawing=road())


def test_a_run_in_which_nothing_moved_still_has_a_report():
    nothing = pl.DataFrame({"timestep_time": []})
    empty = Plan("Empty", 1, 60.0, 0.5, (0.0, 0.0), ())
    assert "Nothing unusual happened" in report({}, empty, (), nothing)
    page = report({"status": "failed", "error": "sumo said no"}, PLAN, (), nothing)
    assert "The run failed" in page
    assert "sumo said no" in page


def test_long_tables_are_cut_and_say_so():
    plan = Plan("Many", 1, 60.0, 0.5, (0.0, 0.0), tuple(planned(f"c{k}") for k in range(3100)))
    page = report(plan=plan, events=())
    assert "The first 3,000 of 3,100 actors" in page
    assert "2,800 more are in events.json" in page


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(None, ""), (4.25, "4.2 s"), (65.0, "1 min 05 s"), (7260.0, "2 h 01 min")],
)
def test_durations_are_written_for_people(seconds, text):
    assert duration(seconds) == text


def test_rules_are_told_with_units_and_where_they_acted_by_streets() -> None:
    values = {"all[0].ttc": 3.0, "all[1].speed": 12.5, "all[2].time": 4.0}
    events = (Event(4.0, EventKind.RULE_STARTED, "a", 100.0, 118.0, rule="cut-in", values=values),)
    names = PlaceNames({"j1": "East Street / North Street"}, middles={"j1": np.zeros(2)})
    page = report(events=events, names=names)
    assert "cut-in (time to collision 3 s, speed 12.5 m/s)" in page
    assert "at 150 m north-east of East Street / North Street (x 100 m, y 118 m)" in page
