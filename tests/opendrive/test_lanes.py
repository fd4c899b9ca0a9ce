from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.ids import LaneKey
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.conftest import shared_map_files
from tests.opendrive.snippets import LINE, document, lane, road, section


def table_of(*roads: str) -> RoadTable:
    return RoadTable.of(parse(document(*roads)))


def row(table: RoadTable, lane_id: int, *, number: int = 0, road_id: str = "1") -> np.ndarray:
    return np.array([table.lane_index[LaneKey(road_id, number, lane_id)]])


def angle(value: np.ndarray) -> np.ndarray:
    return np.abs((value + np.pi) % (2 * np.pi) - np.pi)


FOUR_LANES = section(lane(2, width=2), lane(1, width=3), lane(-1, width=3.5), lane(-2, width=1.5))
OFFSET = '<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>'


def test_lanes_are_listed_by_road_section_and_id() -> None:
    table = table_of(road("b", lanes=FOUR_LANES), road("a", lanes=section(lane(-1))))
    assert table.lane_keys == (
        *(LaneKey("b", 0, number) for number in (-2, -1, 1, 2)),
        LaneKey("a", 0, -1),
    )
    assert table.lane_rank.tolist() == [2, 1, 1, 2, 1]
    assert table.lane_forward.tolist() == [True, True, False, False, True]


def test_borders_are_sums_of_widths_from_the_shifted_centre_line() -> None:
    table = table_of(road(lanes=OFFSET + FOUR_LANES))
    lanes, s = np.arange(4), np.full(4, 50.0)
    inner, outer = table.lane_borders(lanes, s)
    assert inner.tolist() == [-3.0, 0.5, 0.5, 3.5]
    assert outer.tolist() == [-4.5, -3.0, 3.5, 5.5]
    assert table.lane_width(lanes, s).tolist() == [1.5, 3.5, 3.0, 2.0]


def test_a_border_is_an_offset_from_the_centre_line_whatever_lies_inside() -> None:
    border = '<border sOffset="0" a="{}" b="0" c="0" d="0"/>'
    text = section(
        f'<lane id="1" type="driving">{border.format(3)}</lane>',
        lane(-1, width=3.5),
        f'<lane id="-2" type="driving">{border.format(-5)}</lane>',
    )
    table = table_of(road(lanes=OFFSET + text))
    inner, outer = table.lane_borders(np.arange(3), np.full(3, 10.0))
    assert inner.tolist() == [-3.0, 0.5, 0.5]
    assert outer.tolist() == [-4.5, -3.0, 3.5]


def test_driving_direction_follows_rule_and_lane_direction() -> None:
    right, left = road(lanes=FOUR_LANES), road(lanes=FOUR_LANES, more='rule="LHT"')
    turned = road(lanes=section(lane(1), lane(-1, more='direction="reversed"')))
    assert table_of(right).lane_forward.tolist() == [True, True, False, False]
    assert table_of(left).lane_forward.tolist() == [False, False, True, True]
    assert table_of(turned).lane_forward.tolist() == [False, False]


def test_the_outer_lane_of_a_bend_is_longer_by_its_radius() -> None:
    plan = LINE.replace("<line/>", '<arc curvature="0.02"/>')
    table = table_of(road(plan=plan, lanes=FOUR_LANES))
    points = table.lane_points(row(table, -1), np.array([40.0]))
    radius = 50.0 + 1.75
    assert points.curvature[0] == pytest.approx(1 / radius)
    assert math.hypot(points.x[0], points.y[0] - 50.0) == pytest.approx(radius)
    assert points.hdg[0] == pytest.approx(0.8)


def test_a_lane_that_narrows_turns_its_centre_line() -> None:
    shape = '<lane id="-1" type="driving"><width sOffset="0" a="4" b="-0.02" c="0" d="0"/></lane>'
    table = table_of(road(lanes=section(shape)))
    lane_rows, s = np.repeat(row(table, -1), 3), np.full(3, 60.0)
    points = table.lane_points(lane_rows, s, at=np.array([0.0, 0.5, 1.0]))
    assert points.y == pytest.approx([0.0, -1.4, -2.8])
    assert points.hdg == pytest.approx([0.0, math.atan(0.01), math.atan(0.02)])


def test_superelevation_lifts_the_left_side() -> None:
    inside = '<lateralProfile><superelevation s="0" a="0.1" b="0" c="0" d="0"/></lateralProfile>'
    table = table_of(road(inside=inside, lanes=FOUR_LANES))
    left, right = (table.lane_points(row(table, n), np.array([10.0])) for n in (1, -1))
    assert (left.y[0], left.z[0]) == pytest.approx((1.5 * math.cos(0.1), 1.5 * math.sin(0.1)))
    assert (right.y[0], right.z[0]) == pytest.approx((-1.75 * math.cos(0.1), -1.75 * math.sin(0.1)))


def test_lane_heights_lift_a_kerb() -> None:
    kerb = lane(-1, kind="sidewalk", inside='<height sOffset="0" inner="0.1" outer="0.2"/>')
    table = table_of(road(lanes=section(kerb)))
    z = table.lane_points(np.repeat(row(table, -1), 3), np.full(3, 5.0), at=np.array([0, 0.5, 1])).z
    assert z == pytest.approx([0.1, 0.15, 0.2])


def test_a_section_owns_its_lanes_up_to_its_very_end() -> None:
    """The lane offset jumps where the next section starts: the lane before must not."""
    offsets = (
        '<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="50" a="3" b="0" c="0" d="0"/>'
    )
    table = table_of(road(lanes=offsets + section(lane(-1)) + section(lane(-1), s=50)))
    ends = table.lane_points(np.array([0, 1]), np.array([50.0, 50.0]))
    assert ends.y == pytest.approx([-1.75, 1.25])
    assert ends.x == pytest.approx([50.0, 50.0])


def test_questions_outside_a_road_are_answered_at_its_ends() -> None:
    rise = '<elevationProfile><elevation s="0" a="0" b="0" c="0" d="0.001"/></elevationProfile>'
    table = table_of(road(inside=rise))
    far = table.reference(np.array([0, 0]), np.array([-1e9, 1e9]))
    assert far.x.tolist() == [-1e9, 1e9]
    assert far.z.tolist() == [0.0, 1000.0]
    assert table.lane_points(np.array([0]), np.array([1e9])).x[0] == pytest.approx(100.0)


def test_marks_say_which_way_a_change_may_go() -> None:
    mark = '<roadMark sOffset="{}" type="broken" laneChange="{}"/>'
    text = section(
        lane(0, inside=mark.format(0, "none")),
        lane(-1, inside=mark.format(0, "increase") + mark.format(30, "both")),
        lane(-2, inside=mark.format(10, "decrease")),
        lane(-3),
    )
    table = table_of(road(lanes=text))
    one, two, three = (row(table, number) for number in (-1, -2, -3))
    for s, outer in ((0.0, 1), (29.0, 1), (30.0, 3)):
        assert table.lane_change_at(one, np.array([s])) == outer
        assert table.inner_lane_change_at(two, np.array([s])) == outer
    assert table.inner_lane_change_at(one, np.array([5.0])) == 0
    # No mark, no prohibition.
    assert table.lane_change_at(two, np.array([5.0])) == 3
    assert table.lane_change_at(two, np.array([10.0])) == 2
    assert table.lane_change_at(three, np.array([10.0])) == 3


def test_the_limit_of_a_lane_goes_before_that_of_its_road() -> None:
    types = '<type s="0" type="town"/><type s="20" type="town"><speed max="20"/></type>'
    own = '<speed sOffset="50" max="no limit"/>'
    table = table_of(road(inside=types, lanes=section(lane(1), lane(-1, inside=own))))
    assert np.isnan(table.speed_limit(row(table, 1), np.array([10.0]))[0])
    assert table.speed_limit(row(table, 1), np.array([60.0])) == 20.0
    assert table.speed_limit(row(table, -1), np.array([49.0])) == 20.0
    assert table.speed_limit(row(table, -1), np.array([50.0])) == math.inf


def test_sections_are_found_by_s() -> None:
    table = table_of(road(lanes=section(lane(-1)) + section(lane(-1), lane(-2), s=30)))
    assert table.section_at(np.zeros(3, int), np.array([0.0, 29.9, 30.0])).tolist() == [0, 0, 1]
    assert [table.lane_keys[i] for i in table.lanes_at(0, 40.0)] == [("1", 1, -2), ("1", 1, -1)]


coefficients = st.tuples(
    st.floats(-2, 2), st.floats(-0.05, 0.05), st.floats(-5e-4, 5e-4), st.floats(-5e-6, 5e-6)
)


def cubic(tag: str, s_name: str, values: tuple[float, ...]) -> str:
    a, b, c, d = values
    return f'<{tag} {s_name}="0" a="{a}" b="{b}" c="{c}" d="{d}"/>'


@pytest.mark.slow
@given(
    st.floats(-0.02, 0.02),
    st.floats(-0.02, 0.02),
    coefficients,
    coefficients,
    st.tuples(st.floats(-0.1, 0.1), *[st.floats(-1e-4, 1e-4)] * 2, st.just(0.0)),
    st.floats(0, 1),
    st.floats(2.0, 98.0),
)
def test_directions_of_lane_lines_are_derivatives_of_their_points(
    start: float,
    end: float,
    elevation: tuple[float, ...],
    offset: tuple[float, ...],
    roll: tuple[float, ...],
    at: float,
    s: float,
) -> None:
    plan = LINE.replace("<line/>", f'<spiral curvStart="{start}" curvEnd="{end}"/>')
    inside = (
        f"<elevationProfile>{cubic('elevation', 's', elevation)}</elevationProfile>"
        f"<lateralProfile>{cubic('superelevation', 's', roll)}</lateralProfile>"
    )
    lanes = cubic("laneOffset", "s", offset) + section(lane(1), lane(-1))
    table = table_of(road(plan=plan, inside=inside, lanes=lanes))
    h = 1e-4
    before, here, after = (
        table.lane_points(np.zeros(1, int), np.array([s + d]), at=at) for d in (-h, 0.0, h)
    )
    dx, dy, dz = after.x - before.x, after.y - before.y, after.z - before.z
    assert angle(np.arctan2(dy, dx) - here.hdg)[0] < 1e-6
    assert abs(np.arctan2(dz, np.hypot(dx, dy)) - here.pitch)[0] < 1e-6


@pytest.mark.parametrize(
    "file",
    [file for file in shared_map_files() if file.parent.name.startswith("carla")],
    ids=lambda f: f"{f.parent.name}/{f.stem}",
)
def test_lane_centres_are_where_carla_sees_them(file: Path) -> None:
    carla = pytest.importorskip("carla")
    text = file.read_text()
    table = RoadTable.of(parse(text))
    waypoints = carla.Map(file.stem, text).generate_waypoints(2.0)
    keys = [LaneKey(str(w.road_id), w.section_id, w.lane_id) for w in waypoints]
    lanes = np.array([table.lane_index[key] for key in keys])
    points = table.lane_points(lanes, np.array([w.s for w in waypoints]))
    places = [(w.transform.location, w.transform.rotation.yaw, w.lane_width) for w in waypoints]
    x, y, z, yaw, width = np.array([(p.x, -p.y, p.z, -a, w) for p, a, w in places]).T
    distance = np.hypot(points.x - x, points.y - y)
    # CARLA computes in single precision: a tenth of a millimetre at a kilometre.
    assert np.percentile(distance, 99) < 0.001
    assert distance.max() < 0.02
    assert np.abs(points.z - z).max() < 0.001
    assert np.abs(points.width - width).max() < 0.001
    hdg = points.hdg + np.where(table.lane_forward[lanes], 0.0, np.pi)
    # CARLA leaves superelevation out of headings: up to 0.02 rad in Town07.
    assert np.percentile(angle(hdg - np.radians(yaw)), 99) < 0.005
