"""Parking places of maps, and the lanes that they are reached from."""

from __future__ import annotations

import math

import numpy as np
import pytest

from odscen.drawing.map_shapes import map_drawing
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import MapGraph
from odscen.lanegraph.parking_areas import MapParking, map_parking
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.drawing import maps


def found(text: str) -> tuple[MapGraph, MapParking]:
    odr = parse(text, file="test.xodr")
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    drawing = map_drawing(odr, table)
    strips = [ring for one in drawing.areas if one.kind == "parking" for ring in one.rings.each]
    return graph, map_parking(graph.lanes, spaces=drawing.parking_spaces.each, strips=strips)


def space(s: float, t: float, *, length: float = 5.0, width: float = 2.0, hdg: float = 0.0) -> str:
    return (
        f'<object id="{s}" type="parkingSpace" name="" s="{s}" t="{t}" zOffset="0" hdg="{hdg}" '
        f'orientation="none" length="{length}" width="{width}"/>'
    )


def street(*objects: str, **fields: str) -> str:
    return maps.document(maps.road(more=f"<objects>{''.join(objects)}</objects>", **fields))


def test_places_beside_a_lane_are_an_area_and_cars_stand_along_it() -> None:
    graph, parking = found(street(*(space(s, -5.0) for s in (20.0, 26.0, 32.0))))
    (area,) = parking.areas
    assert parking.unreached == 0
    assert area.id == "P1"
    assert [(one.x, one.y) for one in area.places] == [
        pytest.approx((s, -5.0)) for s in (20, 26, 32)
    ]
    assert [one.hdg for one in area.places] == pytest.approx([0.0] * 3)
    assert [(one.length, one.width) for one in area.places] == [pytest.approx((5.0, 2.0))] * 3
    beside = graph.lanes.x[list(area.nodes)]
    assert np.abs(beside - (20, 26, 32)).max() <= graph.lanes.spacing / 2.0 + 0.1


def test_cars_drive_forwards_into_places_across_the_road() -> None:
    _, parking = found(street(space(30.0, -6.5, hdg=math.pi / 2.0), space(60.0, -6.5, hdg=-0.9)))
    (first,), (second,) = (area.places for area in parking.areas)
    assert first.hdg == pytest.approx(-math.pi / 2.0)
    assert second.hdg == pytest.approx(-0.9, abs=1e-3)


def test_places_far_from_each_other_are_areas_of_their_own() -> None:
    _, parking = found(street(space(10.0, -5.0), space(60.0, -5.0)))
    assert [area.id for area in parking.areas] == ["P1", "P2"]


def test_places_that_no_lane_reaches_and_those_for_bicycles_are_counted() -> None:
    bicycles = space(40.0, -5.0, length=2.0, width=0.6)
    _, parking = found(street(space(20.0, -30.0), bicycles, space(60.0, -5.0)))
    assert [len(area.places) for area in parking.areas] == [1]
    assert parking.unreached == 2


def test_a_bus_lane_gives_no_access() -> None:
    right = maps.lane(-1, "bus")
    _, parking = found(street(space(20.0, -5.0), right=right))
    assert parking == MapParking((), 1)


@pytest.mark.parametrize(
    ("width", "count", "hdg"), [(2.5, 100 // 6, 0.0), (5.0, int(100 / 2.5), -math.pi / 2.0)]
)
def test_a_parking_lane_has_a_place_for_each_car_that_fits(
    width: float, count: int, hdg: float
) -> None:
    right = maps.lane(-1) + maps.lane(-2, "parking", width=width)
    _, parking = found(maps.document(maps.road(right=right)))
    places = [place for area in parking.areas for place in area.places]
    assert len(places) == count
    assert {round(place.y, 2) for place in places} == {round(-3.5 - width / 2.0, 2)}
    assert [place.hdg for place in places] == pytest.approx([hdg] * count)
    gaps = np.diff(sorted(place.x for place in places))
    assert gaps == pytest.approx(np.full(count - 1, 6.0 if width < 4.0 else 2.5), abs=0.05)


def test_a_long_object_is_a_row_of_places() -> None:
    _, parking = found(street(space(50.0, -5.0, length=24.0, width=2.2)))
    assert [round(place.x, 2) for area in parking.areas for place in area.places] == [
        41.0, 47.0, 53.0, 59.0,
    ]  # fmt: skip


def test_a_map_without_parking_has_none() -> None:
    assert found(maps.document(maps.road()))[1] == MapParking()
