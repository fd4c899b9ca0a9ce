import re
import sys
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import MissingDependencyError
from odscen.drawing.legend import RenderOptions
from odscen.drawing.map_shapes import map_drawing
from odscen.drawing.map_sheet import (
    length_text,
    render_drawing,
    render_svg,
    round_length,
    svg_to_png,
)
from odscen.drawing.palette import RELATION_COLORS
from odscen.drawing.svg_layers import PlaceMarks
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.drawing import maps

SVG = "{http://www.w3.org/2000/svg}"


def street():
    odr = parse(maps.STREET, file="street.xodr")
    return odr, RoadTable.of(odr)


def render(**options):
    odr, table = street()
    return render_svg(odr, table, name="Street", options=RenderOptions(**options))


def texts(svg):
    return [element.text for element in ET.fromstring(svg.encode()).iter(f"{SVG}text")]


def test_the_sheet_has_name_figures_scale_north_and_legend():
    shown = texts(render())
    assert shown[0] == "Street"
    assert "N" in shown
    assert any("200 m of" in text or "0.2 km of driving lanes" in text for text in shown)
    assert any(text.endswith(" m") and text[0].isdigit() for text in shown)
    for name in ("Carriageway", "Sidewalk", "Crosswalk", "Traffic light", "Stop sign"):
        assert name in shown


def test_the_legend_lists_only_what_occurs():
    odr = parse(maps.document(maps.road()), file="x")
    shown = texts(render_svg(odr, RoadTable.of(odr)))
    assert "Carriageway" in shown
    assert not {"Sidewalk", "Crosswalk", "Traffic light", "Vehicle node"} & set(shown)


def test_speed_limits_are_shown_on_request():
    assert "30" not in texts(render())
    assert "30" in texts(render(speed_limits=True))
    assert "Speed limit" in texts(render(speed_limits=True))


def test_names_from_files_are_escaped():
    odr, table = street()
    svg = render_svg(odr, table, name="<script>&")
    assert "<script" not in svg
    assert texts(svg)[0] == "<script>&"


def test_the_same_map_gives_the_same_bytes():
    assert render() == render()


def test_the_scale_bar_is_as_long_as_it_says():
    svg = render()
    bar = re.search(r'<rect x="[\d.]+" y="[\d.]+" width="([\d.]+)" height="7" fill="#ffffff"', svg)
    label = next(text for text in reversed(texts(svg)) if re.fullmatch(r"\d+ m", text))
    box = ET.fromstring(svg.encode()).find(f"{SVG}svg")
    scale = float(box.get("width")) / (float(box.get("viewBox").split()[2]) / 100)
    assert float(bar.group(1)) == pytest.approx(float(label.split()[0]) * scale, rel=1e-3)


def test_north_is_up_and_east_is_right():
    text = maps.document(maps.road(hdg=np.pi / 2))
    odr = parse(text, file="x")
    svg = render_drawing(map_drawing(odr, RoadTable.of(odr)))
    ring = re.search(r'<path d="M(-?\d+) ?(-?\d+)l([^"]*)z" class="m-area m-road"', svg)
    first_x, first_y = int(ring.group(1)), int(ring.group(2))
    steps = np.array(re.findall(r"-?\d+", ring.group(3)), dtype=int).reshape(-1, 2)
    xy = np.cumsum(np.vstack([[first_x, first_y], steps]), axis=0)
    assert (xy[:, 0].min(), xy[:, 0].max()) == (0, 350)
    assert (xy[:, 1].min(), xy[:, 1].max()) == (-10000, 0)


def test_graph_and_segments_are_drawn_in_the_colours_of_the_requirements():
    odr, table = street()
    graph = build_map_graph(odr, name="Street", sha256="0" * 64, table=table)
    drawing = map_drawing(odr, table)
    svg = render_drawing(drawing, graph=graph, options=RenderOptions(segments=True))
    for color in (RELATION_COLORS[0], "#24A3F2", "#FFD800"):
        assert color in svg
    assert "m-segments" in svg
    assert "Vehicle node" in texts(svg)
    without = render_drawing(drawing, graph=graph, options=RenderOptions(graph=False))
    assert "#24A3F2" not in without


def test_a_part_of_the_map_can_be_shown_without_margins():
    odr, table = street()
    drawing = map_drawing(odr, table)
    options = RenderOptions(margins=False)
    svg = render_drawing(drawing, options=options, view=(45.0, -5.0, 55.0, 5.0))
    assert texts(svg) == []
    assert "m-crosswalk" in svg
    assert "m-symbols" not in svg


def test_places_are_circled_and_counted_in_the_legend():
    odr, table = street()
    drawing = map_drawing(odr, table)
    near = np.array([[50.0, 0.0], [50.1, 0.0], [90.0, 0.0]])
    marks = [PlaceMarks("Gap", "#123456", near), PlaceMarks("Loss", "#abcdef", np.empty((0, 2)))]
    svg = render_drawing(drawing, marks=marks)
    [rings] = re.findall(r'd="([^"]*)" class="m-place" stroke="#123456"', svg)
    assert rings.count("M") == 2, "places within one ring share it"
    assert "Gap (3)" in texts(svg)
    assert "#abcdef" not in svg
    assert render_drawing(drawing, marks=marks[1:]) == render_drawing(drawing)


def test_nothing_in_a_sheet_points_outside():
    links = re.findall(r'href="([^"]*)"', render(speed_limits=True))
    assert links
    assert all(link.startswith("#") for link in links)
    svg = ET.fromstring(render().encode())
    ids = {element.get("id") for element in svg.iter() if element.get("id")}
    assert {link[1:] for link in links} <= ids | {"s-speed_limit", "k-s-speed_limit"}


@given(st.floats(0.5, 1e6))
def test_scale_bars_have_round_lengths(limit):
    length = round_length(limit)
    assert limit / 2.5 <= length <= limit * (1 + 1e-6)
    assert f"{length:.6e}"[0] in "125"


def test_lengths_are_written_in_metres_or_kilometres():
    assert [length_text(v) for v in (0.5, 200.0, 2000.0)] == ["0.5 m", "200 m", "2 km"]


@pytest.mark.slow
def test_a_png_has_the_width_that_was_asked_for():
    pytest.importorskip("cairosvg")
    png = svg_to_png(render(), width=321)
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(png[16:20]) == 321


def test_without_cairosvg_the_error_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "cairosvg", None)
    with pytest.raises(MissingDependencyError, match=r"odscen\[png\]"):
        svg_to_png("<svg/>")


@pytest.mark.slow
def test_real_towns_fit_into_a_small_file(shared_maps):
    text = (shared_maps / "carla-2020" / "Town04.xodr").read_bytes()
    odr = parse(text, file="Town04.xodr")
    svg = render_svg(odr, RoadTable.of(odr))
    assert len(svg) < 2_500_000
    assert {"Crosswalk", "Traffic light"} <= set(texts(svg))
