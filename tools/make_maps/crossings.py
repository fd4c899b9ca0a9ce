"""Single junctions and a street of four: lights, signs, and one for left-hand traffic."""

from __future__ import annotations

import math
from dataclasses import replace

from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.crossing import crossing
from tools.make_maps.furniture import lights_between
from tools.make_maps.geometry import Pose
from tools.make_maps.parts import BROKEN, SOLID, End, LaneSpec, Profile, RoadRecord, street

EAST, NORTH, WEST, SOUTH = (k * math.pi / 2 for k in range(4))
COMPASS = {"east": EAST, "north": NORTH, "west": WEST, "south": SOUTH}
ORIGIN = Pose(0.0, 0.0, 0.0)

WIDE_REACH = 18.0
"""Metres from the middle of a junction of roads with two lanes each way to the end of its arms."""
SHORT_LINK = 11.0
"""Metres of a road between two junctions, with a crosswalk at each end."""

POCKET = 3.25
"""Width of a left-turn lane."""


def signal_crossing(name: str) -> Builder:
    """Four arms with lights, left-turn lanes, bicycle lanes, sidewalks and crosswalks."""
    builder = Builder(name)
    arms = [
        _pocket_arm(builder, heading, reach=17.0, length=130.0, label=label)
        for label, heading in COMPASS.items()
    ]
    crossing(builder, arms, control="lights", name="Signal crossing")
    return builder


def t_junction_signs(name: str) -> Builder:
    """Main road west-east; a side road from the south stops, one from the north yields."""
    builder = Builder(name)
    second = Pose(110.0, 0.0, 0.0)
    # The road between the two junctions belongs to both.
    east = arm(builder, EAST, reach=14.0, length=second.x - 28.0, label="Main Road")
    west = arm(builder, WEST, reach=14.0, length=120.0, label="Main Road")
    south = arm(builder, SOUTH, reach=14.0, length=100.0, label="Stop Lane", speed=30.0)
    far = arm(builder, EAST, reach=14.0, length=120.0, centre=second, label="Main Road")
    north = arm(
        builder, NORTH, reach=14.0, length=100.0, centre=second, label="Yield Lane", speed=30.0
    )
    crossing(builder, [east, south, west], control="stop", major=(0, 2), name="Stop")
    near = End(east.record, "start")
    crossing(builder, [far, north, near], control="yield", major=(0, 2), name="Yield")
    return builder


def left_hand_crossing(name: str) -> Builder:
    """Made for right-hand traffic and mirrored when written."""
    builder = Builder(name)
    arms = [
        arm(builder, heading, reach=15.0, length=120.0, label=f"{label.title()} Road")
        for label, heading in COMPASS.items()
    ]
    crossing(builder, arms, control="lights", name="Left-hand crossing")
    return builder


def bus_street(name: str) -> Builder:
    """A street with bus lanes by ``<access>`` past four T-junctions, two of them 11 m apart.

    The first has lights, the others signs of Germany, France and Sweden; between the second and the
    third there is a crosswalk with lights on the plain road.
    """
    builder = Builder(name)
    west = _bus_road(builder, Pose(0.0, 0.0, 0.0), 130.0)
    south = _side_road(builder, west, SOUTH, "Light Lane")
    link = builder.road(
        west.end.ahead(2 * WIDE_REACH), [xodr.Line(SHORT_LINK)], street(2), name="Bus Street"
    )
    north = _side_road(builder, link, NORTH, "German Lane")
    middle = _bus_road(builder, link.end.ahead(2 * WIDE_REACH), 150.0)
    french = _side_road(builder, middle, SOUTH, "French Lane")
    east = _bus_road(builder, middle.end.ahead(2 * WIDE_REACH), 120.0)
    swedish = _side_road(builder, east, NORTH, "Swedish Lane")
    far = _bus_road(builder, east.end.ahead(2 * WIDE_REACH), 130.0)
    main = (west, link, middle, east, far)
    kinds = (
        (south, {"control": "lights", "name": "Lights"}),
        (north, {"control": "yield", "country": "DE", "name": "German signs"}),
        (french, {"control": "stop", "country": "FR", "name": "French signs"}),
        (swedish, {"control": "yield", "country": "SE", "name": "Swedish signs"}),
    )
    for before, after, (side, options) in zip(main, main[1:], kinds, strict=False):
        ends = [End(after, "start"), side, End(before, "end")]
        crossing(builder, ends, major=(0, 2), **options)
    lights_between(builder, End(middle, "end"), back=60.0)
    return builder


def _bus_road(builder: Builder, start: Pose, length: float) -> RoadRecord:
    """Two lanes each way; buses alone on the outer ones, but for 30 m at both ends.

    There those who turn right, or have done so, may use them, too.
    """
    plain = street(2)
    side = tuple(replace(lane, only="bus") if lane.key == "car 0" else lane for lane in plain.right)
    return builder.road(
        start,
        [xodr.Line(length)],
        plain,
        sections=((30.0, replace(plain, right=side, left=side)), (length - 30.0, plain)),
        name="Bus Street",
    )


def _side_road(builder: Builder, before: RoadRecord, heading: float, label: str) -> End:
    """Side road of the junction at the end of a road of the main street."""
    centre = before.end.ahead(WIDE_REACH)
    return arm(
        builder, heading, reach=WIDE_REACH, length=90.0, centre=centre, speed=30.0, label=label
    )


def arm(
    builder: Builder,
    heading: float,
    *,
    reach: float,
    length: float,
    centre: Pose = ORIGIN,
    speed: float = 50.0,
    label: str = "",
) -> End:
    """Straight street that ends ``reach`` metres from ``centre``, coming from ``heading``."""
    far = Pose(centre.x, centre.y, heading).ahead(reach + length)
    record = builder.road(far.back(), [xodr.Line(length)], street(), speed=speed, name=label)
    return End(record, "end")


def _pocket_arm(
    builder: Builder, heading: float, *, reach: float, length: float, label: str
) -> End:
    """Make an arm with bicycle lanes, and a left-turn lane for those who arrive.

    The reference line, between the two directions, is half a lane to the left, so that lanes of
    opposite arms face each other. (CARLA adds a lane offset, which would do the same, to the t of
    crosswalks.)
    """
    plain = street(bikes=True)
    pocket = LaneSpec("driving", POCKET, BROKEN, key="pocket")
    far = Pose(0.0, 0.0, heading).ahead(reach + length).left(-POCKET / 2)
    record = builder.road(
        far.back(),
        [xodr.Line(length)],
        Profile((pocket, *plain.right), plain.left, SOLID),
        name=f"{label.title()} Street",
    )
    return End(record, "end")
