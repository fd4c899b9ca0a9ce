import itertools

import numpy as np
import pytest
import shapely

from odscen.drawing.map_drawing import BRIDGE, MapDrawing
from odscen.drawing.map_shapes import map_drawing
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.convert.legs import OPPOSITE, entry, junction, leg, way
from tests.drawing import maps
from tests.opendrive.snippets import document


def draw(text, **options):
    odr = parse(text, file="test.xodr")
    return map_drawing(odr, RoadTable.of(odr), **options)


def ring_areas(lines):
    total = []
    for a, b in zip(lines.start[:-1], lines.start[1:], strict=True):
        x, y = lines.xy[a:b].T
        total.append(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2))
    return total


def by_kind(drawing):
    return {area.kind: area.rings for area in drawing.areas}


def test_lanes_become_rings_of_their_kind_counter_clockwise():
    drawing = draw(maps.STREET)
    kinds = by_kind(drawing)
    assert set(kinds) == {"road", "sidewalk"}
    assert ring_areas(kinds["road"]) == pytest.approx([350.0, 350.0])
    assert ring_areas(kinds["sidewalk"]) == pytest.approx([200.0, 200.0])
    assert drawing.bounds == pytest.approx((0.0, -5.5, 100.0, 5.5))


def test_lanes_of_type_none_and_without_width_are_not_drawn():
    text = maps.document(maps.road(right=maps.lane(-1) + maps.lane(-2, "none")))
    assert ring_areas(by_kind(draw(text))["road"]) == pytest.approx([350.0])
    text = maps.document(maps.road(right=maps.lane(-1) + maps.lane(-2, "shoulder", 0.0)))
    assert set(by_kind(draw(text))) == {"road"}


def test_unknown_lane_types_are_drawn_as_other_surface():
    text = maps.document(maps.road(right=maps.lane(-1, "somethingNew")))
    assert set(by_kind(draw(text))) == {"other"}


def test_neighbouring_lanes_share_every_point_of_their_border():
    text = maps.document(
        maps.road(
            shape='<arc curvature="0.02"/>', right=maps.lane(-1) + maps.lane(-2, "sidewalk", 2.0)
        )
    )
    kinds = by_kind(draw(text))
    inner = {tuple(p) for p in kinds["road"].xy.tolist()}
    outer = {tuple(p) for p in kinds["sidewalk"].xy.tolist()}
    shared = inner & outer
    assert len(shared) * 2 == len(kinds["sidewalk"].xy) == len(kinds["road"].xy)


@pytest.mark.parametrize("curvature", [0.1, 0.01, -0.03])
def test_no_drawn_border_is_more_than_the_tolerance_off(curvature):
    text = maps.document(maps.road(shape=f'<arc curvature="{curvature}"/>', length=30.0))
    (area,) = draw(text).areas
    radius = 1.0 / curvature
    ring = np.concatenate([area.rings.xy, area.rings.xy[:1]])
    along = np.linspace(0.0, 1.0, 20)[:, None]
    for a, b in itertools.pairwise(ring):
        if np.hypot(*(b - a)) > 3.4:  # the ends of the lane
            continue
        points = a * (1 - along) + b * along
        distance = np.hypot(points[:, 0], points[:, 1] - radius)
        off = np.minimum(np.abs(distance - abs(radius)), np.abs(distance - abs(radius + 3.5)))
        assert off.max() < 0.03 + 0.01  # and a centimetre of rounding


def test_marks_run_along_the_borders_in_their_style():
    marks = draw(maps.STREET).marks
    broken = next(mark for mark in marks if mark.dash)
    solid = next(mark for mark in marks if not mark.dash)
    assert broken.dash == (3.0, 6.0)
    assert broken.lines.xy.tolist() == [[0.0, 0.0], [100.0, 0.0]]
    assert sorted(solid.lines.xy[:, 1].tolist()) == [-3.5, -3.5, 3.5, 3.5]


def test_broken_lines_are_longer_outside_towns():
    (mark,) = draw(maps.document(maps.road(centre=maps.mark(), kind="rural"))).marks
    assert mark.dash == (6.0, 12.0)


def test_marks_change_where_the_map_says_so_and_none_is_not_painted():
    centre = maps.mark("solid") + maps.mark("none", s=30) + maps.mark("broken", s=60)
    marks = draw(maps.document(maps.road(centre=centre))).marks
    ends = {bool(mark.dash): mark.lines.xy[:, 0].tolist() for mark in marks}
    assert ends == {False: [0.0, 30.0], True: [60.0, 100.0]}


@pytest.mark.parametrize(("side", "dashed_y"), [("right", -3.6), ("left", 3.6), ("centre", -0.1)])
def test_double_lines_lie_beside_the_border_in_the_order_of_the_standard(side, dashed_y):
    double = maps.mark("solid broken", width=0.1)
    parts = {
        "right": {"right": maps.lane(-1, more=double)},
        "left": {"left": maps.lane(1, more=double), "right": ""},
        "centre": {"centre": double},
    }
    marks = draw(maps.document(maps.road(**parts[side]))).marks
    assert len(marks) == 2
    dashed = next(mark for mark in marks if mark.dash)
    assert np.allclose(dashed.lines.xy[:, 1], dashed_y)


def test_a_road_above_another_is_a_level_up_with_two_sides():
    over = '<elevation s="0" a="6" b="0" c="0" d="0"/>'
    text = maps.document(
        maps.road("1"), maps.road("2", x=50.0, y=-50.0, hdg=np.pi / 2, elevation=over)
    )
    drawing = draw(text)
    assert [area.level for area in drawing.areas] == [0, 1]
    (sides,) = [mark for mark in drawing.marks if mark.color == BRIDGE]
    assert sides.level == 1
    assert sorted(set(np.round(sides.lines.xy[:, 0], 2).tolist())) == [50.0, 53.5]


def test_roads_that_cross_on_the_ground_stay_there():
    low = '<elevation s="0" a="1" b="0" c="0" d="0"/>'
    text = maps.document(
        maps.road("1"), maps.road("2", x=50.0, y=-50.0, hdg=np.pi / 2, elevation=low)
    )
    assert {area.level for area in draw(text).areas} == {0}


def test_a_crosswalk_has_bars_across_the_walkers_path():
    drawing = draw(maps.STREET)
    assert ring_areas(drawing.crosswalks) == pytest.approx([28.0])
    areas = ring_areas(drawing.bars)
    assert len(areas) == 7
    assert areas == pytest.approx([2.0] * 7)
    assert (drawing.bars.xy[:, 0].min(), drawing.bars.xy[:, 0].max()) == (48.0, 52.0)


def test_repeated_parking_spaces_are_drawn_one_by_one():
    space = """<objects><object id="1" type="parkingSpace" name="" s="10" t="-5" zOffset="0" hdg="0"
        orientation="none" length="5" width="2"><repeat s="10" length="30" distance="10" tStart="-5"
        tEnd="-8" widthStart="2" widthEnd="2" heightStart="0" heightEnd="0" zOffsetStart="0"
        zOffsetEnd="0"/></object></objects>"""
    spaces = draw(maps.document(maps.road(more=space))).parking_spaces
    assert ring_areas(spaces) == pytest.approx([10.0] * 3)
    centres = spaces.xy.reshape(3, 4, 2).mean(axis=1)
    assert centres.tolist() == [[10.0, -5.0], [20.0, -6.0], [30.0, -7.0]]


def test_repeated_outlines_in_road_coordinates_move_along_the_road():
    corners = "".join(
        f'<cornerRoad s="{s}" t="{t}" dz="0" height="0"/>'
        for s, t in ((0, -6), (5, -6), (5, -4), (0, -4))
    )
    space = f"""<objects><object id="1" type="parkingSpace" name="" s="0" t="-4" zOffset="0" hdg="0"
        orientation="none"><repeat s="20" length="20" distance="10" tStart="-4" tEnd="-4"
        heightStart="0" heightEnd="0" zOffsetStart="0" zOffsetEnd="0"/>
        <outline>{corners}</outline></object></objects>"""
    spaces = draw(maps.document(maps.road(more=space))).parking_spaces
    centres = spaces.xy.reshape(2, 4, 2).mean(axis=1)
    assert centres.tolist() == [[22.5, -5.0], [32.5, -5.0]]


def test_signs_and_lights_are_where_the_map_puts_them():
    symbols = draw(maps.STREET).symbols
    assert [(symbol.kind, symbol.x, symbol.y, symbol.text) for symbol in symbols] == [
        ("speed_limit", 40.0, -5.0, "30"),
        ("stop", 20.0, -5.0, ""),
        ("traffic_light", 10.0, -5.0, ""),
        ("yield", 30.0, -5.0, ""),
    ]


def test_a_width_record_at_the_very_end_of_a_section_is_ignored():
    widths = (
        '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
        '<width sOffset="100" a="9" b="0" c="0" d="0"/>'
    )
    text = maps.document(maps.road(right=f'<lane id="-1" type="driving">{widths}</lane>'))
    assert ring_areas(by_kind(draw(text))["road"]) == pytest.approx([350.0])


def test_a_very_short_road_is_drawn():
    (area,) = draw(maps.document(maps.road(length=0.02))).areas
    assert area.rings.total == 1


def test_small_gaps_in_a_junction_are_carriageway_and_islands_are_not():
    def square(side):
        legs = ((-4, 0, 0), (side, -4, 90), (side + 4, side, 180), (0, side + 4, 270))
        parts = [
            maps.road(str(k), x=x, y=y, hdg=np.radians(turn), length=side + 8).replace(
                'junction="-1"', 'junction="9"'
            )
            for k, (x, y, turn) in enumerate(legs)
        ]
        incoming = maps.road("in", x=-54.0, length=50.0)
        links = '<connection id="0" incomingRoad="in" connectingRoad="0" contactPoint="start"/>'
        junction = f'<junction id="9" name="">{links}</junction>'
        text = maps.document(incoming, *parts).replace("</OpenDRIVE>", f"{junction}</OpenDRIVE>")
        return sorted(ring_areas(by_kind(draw(text))["road"]))

    assert min(square(3.0)) == pytest.approx(9.0)
    assert len(square(3.0)) == 6
    assert len(square(20.0)) == 5


def test_bits_of_bicycle_lanes_inside_a_crossing_are_carriageway(pytestconfig):
    text = (pytestconfig.rootpath / "maps" / "signal_crossing.xodr").read_bytes()
    kinds = by_kind(draw(text))
    middle = shapely.box(-8.0, -8.0, 8.0, 8.0)
    painted = [
        shapely.polygons(kinds["road"].xy[a:b])
        for a, b in itertools.pairwise(kinds["road"].start.tolist())
    ]
    covered = shapely.union_all(shapely.make_valid(painted))
    assert shapely.area(shapely.difference(middle, covered)) < 0.1


@pytest.mark.slow
def test_real_towns_are_drawn_small_and_the_same_every_time(shared_maps):
    text = (shared_maps / "carla-2019" / "Town05.xodr").read_bytes()
    first = draw(text).to_json()
    assert first == draw(text).to_json()
    assert len(first) < 2_500_000
    assert {area.level for area in draw(text).areas} == {0, 1}


LINKED = '<link><predecessor id="-1"/><successor id="1"/></link>'


def painted_way(name: str, kind: str) -> str:
    mark = f'<roadMark sOffset="0" type="{kind}" width="0.12" laneChange="none"/>'
    return way(name, links=LINKED + mark)


def painted_crossing(kind: str) -> MapDrawing:
    """Four legs with straight ways of 20 m, each with a mark on its right border."""
    text = document(
        *(leg(name) for name in OPPOSITE),
        *(painted_way(name, kind) for name in OPPOSITE),
        junction(*(entry(name) for name in OPPOSITE)),
    )
    odr = parse(text)
    return map_drawing(odr, RoadTable.of(odr))


def painted_metres(drawing: MapDrawing) -> float:
    return sum(
        float(np.hypot(*np.diff(line, axis=0).T).sum())
        for mark in drawing.marks
        for line in mark.lines.each
    )


def test_solid_lines_of_connecting_roads_end_where_others_cross_them() -> None:
    drawing = painted_crossing("solid")
    for mark in drawing.marks:
        for line in mark.lines.each:
            # All ways are 3.5 m wide, right of the axes: within 3.5 m of both all is crossed.
            assert np.abs(line).max(axis=1).min() >= 3.5 - 0.2
    # Each way has its line on 6.65 m before and behind what the ways across it take.
    assert painted_metres(drawing) == pytest.approx(4 * 2 * (10.0 - 3.5 + 0.15), abs=0.05)


def test_broken_lines_guide_drivers_over_a_junction() -> None:
    assert painted_metres(painted_crossing("broken")) == pytest.approx(4 * 20.0, abs=0.05)
