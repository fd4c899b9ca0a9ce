import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.arrays import offsets, ranges
from odscen.base.errors import InputError
from odscen.drawing.map_drawing import Area, Lines, MapDrawing, Mark, Symbol

PLACES = st.floats(-5000, 5000).map(lambda value: round(value, 2))
RING = st.lists(st.tuples(PLACES, PLACES), min_size=3, max_size=6)


def lines(rings):
    xy = np.array([point for ring in rings for point in ring], dtype=float).reshape(-1, 2)
    return Lines(xy, offsets(np.array([len(ring) for ring in rings], dtype=np.int64)))


def square(x, y, size=1.0):
    return [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]


@pytest.mark.slow
@given(st.lists(RING, max_size=4), st.text(max_size=8))
def test_a_drawing_survives_json_to_the_centimetre(rings, name):
    drawing = MapDrawing(
        name,
        (0.0, 1.5, 2.0, 3.0),
        areas=(Area(0, "road", lines(rings)),),
        marks=(
            Mark(0, "white", 0.12, (3.0, 6.0), lines(rings)),
            Mark(1, "red", 0.2, None, lines([])),
        ),
        bars=lines(rings),
        symbols=(Symbol("speed_limit", 1.0, -2.25, 0.5, "50"),),
    )
    again = MapDrawing.from_json(drawing.to_json())
    assert again.to_json() == drawing.to_json()
    assert again.symbols == drawing.symbols
    assert np.allclose(again.areas[0].rings.xy, lines(rings).xy, atol=0.005)
    assert again.marks[0].dash == (3.0, 6.0)
    assert again.marks[1].dash is None


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"format":"odscen-drawing","version":2}', "null", '{"format":1}'],
)
def test_what_is_not_a_drawing_is_refused(text):
    with pytest.raises(InputError, match="drawing"):
        MapDrawing.from_json(text)


def test_a_drawing_whose_sizes_do_not_fit_its_points_is_refused():
    document = json.loads(MapDrawing("x", (0, 0, 1, 1), bars=lines([square(0, 0)])).to_json())
    document["bars"]["sizes"] = [5]
    with pytest.raises(InputError, match="4 points"):
        MapDrawing.from_json(json.dumps(document))


def test_clipping_keeps_what_touches_the_view_whole():
    drawing = MapDrawing(
        "",
        (0.0, 0.0, 100.0, 100.0),
        areas=(
            Area(0, "road", lines([square(0, 0), square(50, 50), square(9, 9)])),
            Area(0, "green", lines([square(90, 90)])),
        ),
        symbols=(Symbol("stop", 5.0, 5.0, 0.0), Symbol("stop", 50.0, 5.0, 0.0)),
    )
    clipped = drawing.clipped((0.0, 0.0, 10.0, 10.0))
    assert [area.kind for area in clipped.areas] == ["road"]
    assert clipped.areas[0].rings.xy.tolist() == [*map(list, square(0, 0) + square(9, 9))]
    assert [symbol.x for symbol in clipped.symbols] == [5.0]


@given(st.lists(st.tuples(st.integers(0, 50), st.integers(0, 6), st.sampled_from([1, -1]))))
def test_ranges_are_what_python_gives_one_by_one(parts):
    first, sizes, step = (np.array([p[k] for p in parts], dtype=np.int64) for k in range(3))
    expected = [f + s * k for f, n, s in parts for k in range(n)]
    assert ranges(first, sizes, step=step).tolist() == expected
