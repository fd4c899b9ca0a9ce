import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import polars as pl
import pytest

from odscen.drawing.map_drawing import Lines
from odscen.figures.by_place.level_of_service import FEWEST
from odscen.figures.by_place.traffic import TrafficFigures, traffic_figures
from odscen.reports.front_page import junction_rows, level_notes
from odscen.reports.page_templates import render_block
from odscen.reports.place_names import NO_NAMES
from odscen.reports.report_maps import PlaceShapes, service_map
from odscen.reports.report_sections import (
    NONE_RECORDED,
    CorridorTraces,
    corridor_values,
    diagram_values,
    emission_values,
    flow_values,
    level_strip,
    service_values,
)
from odscen.reports.report_words import stretch
from tests.figures.made_traffic import NOBODY, PLACES, lane_rows, made_figures
from tests.reports.test_run_report import EVIL, PLAN, Reader, planned, report

SHAPES = PlaceShapes(
    {
        "r1": Lines(np.array([[0.0, 0.0], [100.0, 0.0]]), np.array([0, 2])),
        "r2": Lines(np.array([[110.0, 0.0], [310.0, 0.0]]), np.array([0, 2])),
        "r9": Lines(np.array([[0.0, 50.0], [90.0, 50.0]]), np.array([0, 2])),
    },
    {"j10": np.array([105.0, 0.0])},
)


def section_of(name, values):
    return values and render_block("run_report.html.j2", name, **{name: values})


def service_section(figures):
    return section_of("service", service_values(figures, NO_NAMES))


def diagram_section(network):
    return section_of("diagram", diagram_values(network))


def emission_section(figures):
    return section_of("emissions", emission_values(figures, NO_NAMES))


def corridor_section(given):
    return section_of("corridor", corridor_values(given, NO_NAMES))


def brief_map(figures, shapes):
    rows = junction_rows(figures, NO_NAMES)
    drawn = service_map(figures, shapes, rows, NO_NAMES)
    return section_of(
        "brief",
        {
            "cards": [],
            "sentences": [],
            "map": drawn,
            "scene_map": None,
            "junctions": rows,
            "fewest": FEWEST,
            "notes": level_notes(figures, rows),
        },
    )


def words(markup):
    return re.sub(r"\s+", " ", Reader(str(markup)).text)


def cells(markup):
    return [
        [re.sub(r"<[^>]*>", "", cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)]
        for row in re.findall(r"<tr>(.*?)</tr>", str(markup))
    ]


def test_a_junction_has_its_level_delay_and_worst_time():
    # 50, 100, 150 and 60 vehicles lost 5, 30, 90 and 5 s: 17,050 s by 360 of them.
    section = service_section(made_figures())
    rows = cells(section)
    row = next(row for row in rows if row[0] == "Junction 10")
    assert row[:4] == ["Junction 10", "signal", "D", "47.4"]
    assert row[7] == "360"
    assert row[4] == "delay on approaches and inside"
    assert row[9] == "0:30, 90 s"
    assert "r1 &gt; j10 &gt; r2" in str(section)


def test_the_map_colours_places_and_leaves_those_without_traffic_grey():
    section = str(brief_map(made_figures(), SHAPES))
    # On r1 it takes 57 s to drive what would take 10.
    assert re.search(r'href="#place-0" class="los-f"><title>r1: level F, 6 km/h', section)
    assert re.search(r'href="#place-1" class="los-a"><title>r2: level A, 36 km/h', section)
    assert "r9: no traffic" in section
    assert "Junction 10: level D, 47 s control delay per vehicle" in section
    # The busiest time is the third quarter of an hour, and worse than the whole.
    assert "The busiest time, 0:30 to 0:45 h" in section
    assert "Junction 10: level F, 90 s control delay per vehicle" in section


def test_a_junction_that_nobody_gets_into_has_level_f_and_no_delay():
    # Two vehicles stand before it for a quarter of an hour.
    stuck = lane_rows(0, "a_0", 2, length=0.0, lost=900.0, co2=20.0, source=True, sink=False)
    rows = pl.DataFrame([stuck | {"waiting": 1800.0}])
    section = str(brief_map(traffic_figures(rows, PLACES, end=900.0), SHAPES))
    assert "<title>Junction 10: level F, no vehicle enters it</title>" in section


def test_a_place_with_few_vehicles_is_not_among_the_worst():
    section = service_section(made_figures([(3, 300.0), (3, 300.0)]))
    assert section is None


def test_the_strip_shows_levels_in_order_of_time_and_gaps():
    figures = made_figures([(40, 5.0), NOBODY, (40, 90.0), NOBODY])
    strip = level_strip(figures.junctions.filter(pl.col("junction") == "j10"))
    paths = {path.get("class"): path.get("d") for path in ET.fromstring(strip).iter("path")}
    assert paths == {"los-a": "M0 0h240v10h-240z", "los-f": "M480 0h240v10h-240z"}


def test_the_diagram_has_a_dot_for_each_interval_with_traffic_and_names_the_most():
    figures = made_figures([(50, 5.0), (100, 30.0), NOBODY, (150, 90.0), (60, 5.0)])
    section = diagram_section(figures.network)
    assert str(section).count("<circle") == 4
    # 150 vehicles over 310 m of lane in a quarter of an hour on 310 m of lanes: 600 an hour.
    assert "The flow was highest from 0:45 to 1:00 h: 600 veh/h per lane" in words(section)


def test_a_run_of_one_interval_has_no_course():
    network = made_figures([(50, 5.0)]).network
    assert flow_values(network) is None
    assert diagram_values(network) is None


def test_emissions_are_summed_and_the_largest_place_stands_first():
    section = emission_section(made_figures())
    # 360 vehicles of 20 + 20 + 40 g.
    assert "28.8 kg carbon dioxide (CO2)" in words(section)
    rows = [row for row in cells(section) if row[0] in {"r1", "r2", "j10"}]
    assert rows[0][:5] == ["r2", "road", "14.4", "50", "40"]


def test_without_emissions_there_is_no_section():
    assert emission_section(made_figures(co2=None)) is None


def traces(**changes):
    """One vehicle that drives 50 m, stands for 20 s, and drives on through a junction."""
    time = np.arange(0.0, 41.0)
    along = np.concatenate([time[:11] * 5.0, np.full(20, 50.0), 50.0 + 5.0 * np.arange(1, 11)])
    given = {
        "segments": ("r1", "j10", "r2"),
        "junctions": [("j10", 55.0, 70.0)],
        "length": 100.0,
        "begin": 0.0,
        "end": 60.0,
        "time": time,
        "along": along,
        "speed": np.concatenate([np.full(10, 5.0), np.zeros(21), np.full(10, 5.0)]),
        "piece": np.zeros(41, dtype=np.int64),
        "vehicles": 1,
    }
    return CorridorTraces(**(given | changes))


def paths_of(section, style):
    return re.findall(rf'<path d="([^"]*)"[^>]*class="trace {style}"', str(section))[0]


def test_who_stands_is_drawn_level_and_red_and_who_drives_is_not():
    section = corridor_section(traces())
    standing, moving = paths_of(section, "standing"), paths_of(section, "moving")
    assert standing.count("M") == 1
    assert moving.count("M") == 2
    assert "From r1 to r2, 100 m through 1 junction, 0:00 to 1:00 min: 1 vehicle." in words(section)
    # The last step of standing leads to where the vehicle is on the move again.
    steps = re.findall(r"-?\d+", standing.split("l")[1])
    assert int(steps[1]) == 0


def test_passages_are_not_joined():
    piece = np.repeat([0, 1], [20, 21])
    section = corridor_section(traces(piece=piece, speed=np.full(41, 5.0)))
    assert paths_of(section, "moving").count("M") == 2


def test_a_run_without_trajectories_says_so():
    assert NONE_RECORDED in words(corridor_section(NONE_RECORDED))


def test_names_of_places_are_escaped():
    plain = made_figures()
    evil = pl.lit(EVIL).alias
    figures = TrafficFigures(
        plain.network,
        plain.segments.with_columns(evil("segment")),
        plain.junctions.with_columns(evil("junction"), evil("control")),
        plain.movements.with_columns(evil("movement")),
    )
    shapes = PlaceShapes({EVIL: SHAPES.segments["r1"]}, {EVIL: SHAPES.junctions["j10"]})
    for section in (
        service_section(figures),
        brief_map(figures, shapes),
        emission_section(figures),
        corridor_section(traces(segments=(EVIL,), junctions=[(EVIL, 1.0, 2.0)])),
    ):
        assert EVIL not in str(section)
        assert "&lt;img" in str(section)


def test_the_whole_report_holds_every_section_and_is_well_formed():
    plan = replace(PLAN, actors=tuple(planned(f"car-{k}") for k in range(30)))
    page = report(plan=plan, figures=made_figures(), shapes=SHAPES, corridor=traces())
    found = re.findall(r'<section id="(\w+)"', page)
    wanted = {
        "brief",
        "figures",
        "service",
        "map",
        "flow",
        "diagram",
        "corridor",
        "emissions",
    }
    assert wanted <= set(found)
    assert page.count("How to read this:") == len(found)


@pytest.mark.parametrize(
    ("begin", "end", "text"),
    [
        (63000.0, 63900.0, "17:30 to 17:45 h"),
        (250.0, 260.0, "4:10 to 4:20 min"),
        (0.0, 60.0, "0:00 to 1:00 min"),
    ],
)
def test_stretches_of_time_are_written_for_people(begin, end, text):
    assert stretch(begin, end) == text
