import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.reports.charts import Series, TimeUnit, clock_axis, line_chart, nice_ticks


@given(st.floats(1e-3, 1e6))
def test_ticks_enclose_the_values_and_are_round(high):
    ticks = nice_ticks(0.0, high)
    assert ticks[0] == 0.0
    assert ticks[-1] >= high * (1 - 1e-9)
    assert 2 <= len(ticks) <= 8
    step = ticks[1] - ticks[0]
    assert f"{step:.6e}"[0] in "125"


@pytest.mark.parametrize(("span", "name"), [(100, "s"), (600, "min"), (86400, "h")])
def test_long_times_are_shown_in_larger_units(span, name):
    assert TimeUnit.for_span(span).name == name


def chart(y, **bands):
    time = np.arange(len(y), dtype=float)
    series = [Series("<cars>", "c-car", np.array(y, dtype=float), **bands)]
    return line_chart(time, series, y_label="km/h", description="d")


def test_a_chart_is_well_formed_and_escaped():
    markup = chart([1, 2, 3], low=np.zeros(3), high=np.full(3, 4.0))
    ET.fromstring(markup)
    assert "&lt;cars&gt;" in markup


def test_gaps_break_the_line_and_a_lone_value_shows():
    line = re.search(r'<path d="([^"]*)" class="line', chart([1, 2, np.nan, 3, np.nan])).group(1)
    assert line.count("M") == 2
    assert line.endswith("h0.1")


def test_a_chart_of_nothing_but_gaps_or_zeros_is_drawn():
    ET.fromstring(chart([np.nan, np.nan]))
    ET.fromstring(chart([0.0]))


def test_higher_values_are_drawn_higher_up():
    line = re.search(r'<path d="M([^"]*)" class="line', chart([0, 5, 10])).group(1)
    heights = [float(point.split(",")[1]) for point in line.split()]
    assert heights == sorted(heights, reverse=True)
    assert heights[0] == 230.0


def test_the_axis_of_a_short_run_counts_minutes_and_that_of_a_long_one_hours():
    short, long = clock_axis(0.0, 90.0), clock_axis(0.0, 7200.0)
    assert short.ticks == [(0.0, "0"), (60.0, "1")]
    assert short.name == "time since the start, min"
    assert long.name == "time since the start, h:min"
    assert long.ticks[1] == (900.0, "0:15")
